"""Draw sips at random: does every one run to the end, and what does it cost.

    python benchmarks/random_sips.py [--count 24] [--first-seed 0] [--resolution coarse]

Each seed draws, uniformly and independently: a scenario of the library, friction 0…1.5, the
dermis' stiffness ½…2 times, a shift of the neck by up to ± 2 mm in x and y and a turn by up to
± 4°, and the thickness of the lips within one standard deviation. The table has a row a seed; a
seed repeats its row.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from mocap.convert import convert
from scenarios.drinking import replay
from scenarios.solution import Increment
from scenarios.spec import library_names, read_scenario


def drawn(seed: int) -> tuple[str, list[str]]:
    """Return a scenario's name and the settings laid over it."""
    rng = np.random.default_rng(seed)
    name = str(rng.choice(library_names()))
    settings = {
        "contact.friction": rng.uniform(0.0, 1.5),
        "skin.dermis_stiffness": 2.0 ** rng.uniform(-1.0, 1.0),
        "placement.shift_x_mm": rng.uniform(-2.0, 2.0),
        "placement.shift_y_mm": rng.uniform(-2.0, 2.0),
        "placement.turn_deg": rng.uniform(-4.0, 4.0),
        "head.upper_lip_thickness_mm": 14.8 + 1.4 * rng.uniform(-1.0, 1.0),
        "head.lower_lip_thickness_mm": 15.1 + 1.2 * rng.uniform(-1.0, 1.0),
    }
    return name, [f"{key}={value:.4f}" for key, value in settings.items()]


def main() -> None:
    """Run the seeds and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--resolution", default="coarse")
    options = parser.parse_args()
    print("| seed | scenario | settings | ended | increments | iterations | cutbacks | s |")
    print("|---|---|---|---|---|---|---|---|")
    totals = np.zeros(3, int)
    with tempfile.TemporaryDirectory() as scratch:
        motions: dict[str, Path] = {}
        for seed in range(options.first_seed, options.first_seed + options.count):
            name, settings = drawn(seed)
            scenario = read_scenario(name, [*settings, f"solver.resolution={options.resolution}"])
            if name not in motions and scenario.recording is not None:
                out = Path(scratch) / name
                convert(Path(scenario.recording.video), Path(scenario.recording.markers), out)
                motions[name] = out / "motion.csv"
            costs: list[tuple[int, int]] = []

            def count(increment: Increment, costs: list[tuple[int, int]] = costs) -> None:
                costs.append((increment.newton_iterations, increment.cutbacks))

            started = time.process_time()
            outcome = replay(scenario.with_motion(motions[name]), on_increment=count)
            seconds = time.process_time() - started
            iterations, cutbacks = np.sum(costs, axis=0)
            totals += (int(outcome.finished), len(costs), iterations)
            ended = "whole" if outcome.finished else outcome.sentence
            values = ", ".join(text.split(".", 1)[1] for text in settings)
            print(
                f"| {seed} | {name} | {values} | {ended} | {len(costs)} | {iterations} | "
                f"{cutbacks} | {seconds:.0f} |",
                flush=True,
            )
    finished, increments, iterations = totals
    print(
        f"\n{finished} of {options.count} whole; {iterations / max(increments, 1):.1f} Newton "
        "iterations an increment"
    )


if __name__ == "__main__":
    main()
