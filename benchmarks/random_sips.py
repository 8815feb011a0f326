"""Draw sips at random: does every one run to the end, and what does it cost.

    python -m benchmarks.random_sips [--count 12] [--first-seed 0] [--resolution coarse]

Each seed draws, uniformly and independently: a scenario of the library; friction 0…1.5; the
dermis' stiffness ½…2 times; a shift of the neck by up to ± 2 mm in x and y and a turn by up to
± 4°; the shape of the lips (thickness, length, projection, height of the red part); the thread
(pitch, depth, flank, width and number of crests); and a deviation from the recorded path, three
sine waves of up to 1 mm and 2° in all. Measurements that no neck or head can have (threads that
overlap) are drawn again. The table has a row a seed; a seed repeats its row.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from geometry2d.neck import NECKS
from mocap.convert import convert
from mocap.motion.motion import Motion
from scenarios.results.increment import Increment
from scenarios.settings.files import recorded_names
from scenarios.settings.scenario import Scenario, load_scenario
from scenarios.settings.tables import SettingError
from scenarios.sip.replay import replay

LIP_RANGES_MM = {
    "upper_lip_thickness_mm": (14.8, 1.4),
    "lower_lip_thickness_mm": (15.1, 1.2),
    "upper_lip_length_mm": (24.4, 2.0),
    "lower_lip_length_mm": (54.3, 3.0),
    "upper_lip_projection_mm": (3.3, 1.5),
    "lower_lip_projection_mm": (1.0, 1.5),
    "upper_vermilion_mm": (8.0, 1.0),
    "lower_vermilion_mm": (10.0, 1.0),
}
"""Middle and half range of each drawn measurement of the head."""


def drawn(rng: np.random.Generator, resolution: str) -> tuple[Scenario, list[str]]:
    """Return a scenario of the library with random settings laid over it, and those."""
    name = str(rng.choice(recorded_names()))
    library_neck = NECKS[load_scenario(name).package.neck]
    while True:
        depth = rng.uniform(0.6, 1.6)
        settings: dict[str, float] = {
            "contact.friction": rng.uniform(0.0, 1.5),
            "skin.dermis_stiffness": 2.0 ** rng.uniform(-1.0, 1.0),
            "placement.shift_x_mm": rng.uniform(-2.0, 2.0),
            "placement.shift_y_mm": rng.uniform(-2.0, 2.0),
            "placement.turn_deg": rng.uniform(-4.0, 4.0),
            "package.pitch_mm": rng.uniform(2.4, 5.0),
            "package.thread_diameter_mm": library_neck.root_diameter_mm + 2 * depth,
            "package.flank_deg": rng.uniform(10.0, 45.0),
            "package.crest_width_mm": rng.uniform(0.8, 1.4),
            "package.crests": int(rng.integers(1, 4)),
        }
        for measurement, (middle, reach) in LIP_RANGES_MM.items():
            settings[f"head.{measurement}"] = middle + reach * rng.uniform(-1.0, 1.0)
        texts = [
            f"{key}={value if isinstance(value, int) else f'{value:.4f}'}"
            for key, value in settings.items()
        ]
        try:
            scenario = load_scenario(name, [*texts, f"numerics.resolution={resolution}"])
            scenario.package.section()
            scenario.head.section()
        except SettingError:
            continue
        return scenario, texts


def strayed(motion: Motion, out: Path, rng: np.random.Generator) -> Path:
    """Write a copy of a motion that strays from the path, and return it."""
    out.mkdir()
    strays = []
    for most in (1.0, 1.0, np.radians(2.0)):
        amplitude = rng.uniform(-most, most, 3) / 3
        frequency_hz, phase = rng.uniform(0.2, 2.0, 3), rng.uniform(0.0, 2 * np.pi, 3)
        waves = amplitude * np.sin(2 * np.pi * frequency_hz * motion.time_s[:, None] + phase)
        strays.append(waves.sum(axis=1))
    motion.with_(
        relative_mm=motion.relative_mm + np.column_stack(strays[:2]),
        relative_rad=motion.relative_rad + strays[2],
    ).write(out / "motion.csv", decimals=15)
    return out / "motion.csv"


def main() -> None:
    """Run the seeds and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--resolution", default="coarse")
    options = parser.parse_args()
    print(
        "| seed | scenario | settings | ended | increments | iterations | cutbacks | "
        "processor s | penetration mm |"
    )
    print("|" + "---|" * 9)
    totals = np.zeros(3, int)
    with tempfile.TemporaryDirectory() as scratch:
        motions: dict[str, Motion] = {}
        for seed in range(options.first_seed, options.first_seed + options.count):
            rng = np.random.default_rng(seed)
            scenario, settings = drawn(rng, options.resolution)
            if scenario.name not in motions and scenario.recording is not None:
                recording = scenario.recording
                motions[scenario.name] = convert(recording.video, recording.markers).motion
            motion = strayed(motions[scenario.name], Path(scratch) / f"seed-{seed}", rng)
            costs: list[tuple[int, int]] = []

            def count(increment: Increment, costs: list[tuple[int, int]] = costs) -> None:
                costs.append((increment.newton_iterations, increment.cutbacks))

            started = time.process_time()
            outcome = replay(scenario.with_motion(motion), on_increment=count)
            seconds = time.process_time() - started
            iterations, cutbacks = np.sum(costs, axis=0)
            totals += (int(outcome.finished), len(costs), iterations)
            ended = "whole" if outcome.finished else outcome.message
            values = ", ".join(text.split(".", 1)[1] for text in settings)
            told = ("neck", "teeth", "between_nodes", "lips")
            deepest = max(outcome.about[f"largest_penetration_{what}_mm"] for what in told)
            print(
                f"| {seed} | {scenario.name} | {values} | {ended} | {len(costs)} | {iterations} | "
                f"{cutbacks} | {seconds:.0f} | {deepest:.4f} |",
                flush=True,
            )
    finished, increments, iterations = totals
    print(
        f"\n{finished} of {options.count} whole; {iterations / max(increments, 1):.2f} Newton "
        "iterations an increment"
    )


if __name__ == "__main__":
    main()
