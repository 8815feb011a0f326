"""Each scenario with acting lips, one setting changed at a time, and what that changes.

    python -m benchmarks.acting_variants --out DIR [A38-F-acting ...] [--resolution coarse]
        [--variants "activation 0" ...]

Friction 0.5 and 1.5 instead of 1, a dermis half and twice as stiff, the neck put 2 mm off back,
forward and down, no activation and twice the one that is found: with the scenario as it is, ten
runs each of four scenarios. Every run is kept in DIR: a call that was interrupted goes on where it
was. Iterations are compared with those of the run with passive lips.
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path

from benchmarks.hands import kept_run, reference_run
from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution
from scenarios.settings.files import library_names, recorded_names
from scenarios.settings.muscles import NAMES
from scenarios.settings.scenario import Scenario, ScenarioError, load_scenario
from scenarios.sip.run import NothingComputedError

VARIANTS = (
    "",
    "contact.friction=0.5",
    "contact.friction=1.5",
    "skin.dermis_stiffness=0.5",
    "skin.dermis_stiffness=2",
    "placement.shift_x_mm=-2",
    "placement.shift_x_mm=2",
    "placement.shift_y_mm=-2",
    "activation 0",
    "activation 2",
)


def with_activations(scenario: Scenario, found: Solution, times: float) -> Scenario:
    """Return a scenario whose activations are so many times those that were found."""
    muscles = scenario.muscles
    assert muscles is not None  # these scenarios have acting lips
    known = {
        name: min(times * each["least"], 1.0) for name, each in found.summary["activations"].items()
    }

    def replaced(name: str) -> object:
        value = getattr(muscles, name)
        number = known.get(name, 0.0)
        if isinstance(value, tuple):
            return [number if each == "auto" else each for each in value]
        return number if value == "auto" else value

    given: dict[str, object] = {name: replaced(name) for name in NAMES}
    seen = dict.fromkeys(("clearance_mm", "lower_reach_mm", "reach_time_s", "seal_time_s"))
    return scenario.with_(muscles={**given, "seen": seen})


def changed(name: str, variant: str, out: Path, resolution: str) -> Scenario:
    """Return a variant of a scenario that follows the reference run kept in ``out``."""
    settings = [
        f"numerics.resolution={resolution}",
        f"motion.file={out / 'reference' / 'motion' / 'motion.csv'}",
    ]
    times = variant.removeprefix("activation ")
    if times == variant:
        settings += variant.split()
    scenario = load_scenario(name, settings)
    if scenario.hand.reference_scenario is not None:
        follows = {"reference": str((out / "reference").resolve()), "reference_scenario": None}
        scenario = scenario.with_(hand=follows)
    if times == variant:
        return scenario
    return with_activations(scenario, Solution.load(out / "as-it-is"), float(times))


def row(name: str, variant: str, run: Solution, passive: Solution) -> str:
    """Return a run as a row of the table."""
    summary, before = run.summary, passive.summary
    each = summary["newton_iterations"] / summary["increments"]
    cells = [
        name,
        variant or "nothing",
        "whole" if run.finished else run.message,
        f"{summary['increments']}, {summary['newton_iterations']}, {summary['cutbacks']}",
        f"{each / (before['newton_iterations'] / before['increments']):.2f}",
        *(f"{summary[f'{lip}_lip_window_kpa']:.0f}" for lip in LIPS),
        f"{run.history['neck_off_film_mm'].max():.1f}",
        f"{summary['wall_s']:.0f}",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Make what is missing and print the table."""
    acting = sorted(set(library_names()) - set(recorded_names()))
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=acting)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--resolution", default="coarse")
    parser.add_argument("--variants", nargs="*", default=VARIANTS, choices=VARIANTS)
    options = parser.parse_args()
    head = ["scenario", "changed", "ended", "increments, iterations, cutbacks"]
    head += ["iterations an increment, over the passive run's"]
    head += [*(f"{lip} window, kPa" for lip in LIPS), "off the film, mm", "s"]
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for variant, name in itertools.product(options.variants, options.scenarios):
        out: Path = options.out / name
        passive = reference_run(name.removesuffix("-acting"), options.resolution, out)
        folder = out / (variant.replace("=", "") or "as-it-is").replace(" ", "-")
        try:
            run = kept_run(changed(name, variant, out, options.resolution), folder)
            print(row(name, variant, run, passive), flush=True)
        except (ScenarioError, NothingComputedError) as error:
            print(f"| {name} | {variant} | {error} |", flush=True)


if __name__ == "__main__":
    main()
