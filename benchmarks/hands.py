"""A neck that is 2 mm off, carried by the film, by a hand that yields, and at equal force.

    python -m benchmarks.hands --out DIR [--scenario A38-F] [--resolution coarse]
        [--modes same ...] [--shifts x_mm=-2 ...] [--set contact.friction=0]

Every run is kept in DIR: a call that was interrupted goes on where it was. The reference run is the
scenario as it is. Errors of the forces are those of each lip's force along its mean direction in
the reference run, over the largest one there.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution
from scenarios.settings.scenario import Scenario, load_scenario
from scenarios.sip.run import solve

MODES = ("recorded", "same", "force")
SHIFTS = ("x_mm=-2", "x_mm=2", "y_mm=-2", "y_mm=2")


def kept_run(scenario: Scenario, folder: Path) -> Solution:
    """Return the run of a scenario in a folder: as it is, gone on with, or made."""
    return solve(scenario, out=folder, resume=True)


def reference_run(name: str, resolution: str, out: Path, settings: Sequence[str] = ()) -> Solution:
    """Return the run of a scenario as it is, in ``out``; its motion is kept there."""
    scenario = load_scenario(name, [f"numerics.resolution={resolution}", *settings])
    return kept_run(scenario, out / "reference")


def largest_force_error(run: Solution, reference: Solution, lip: str) -> tuple[float, float]:
    """Return the largest error of a lip's force, and the share of the time with less than 1 %."""
    parts = [f"{lip}_lip_force_{axis}_n" for axis in "xy"]
    wanted = np.column_stack([reference.history[part] for part in parts])
    along = wanted.sum(axis=0) / np.hypot(*wanted.sum(axis=0))
    bore = np.column_stack([run.history[part] for part in parts]) @ along
    asked = np.interp(run.time_s, reference.time_s, wanted @ along)
    error = np.abs(bore - asked) / np.max(wanted @ along)
    weight = np.gradient(run.time_s)
    return float(error.max()), float(np.sum(weight * (error < 0.01)) / np.sum(weight))


def row(what: str, run: Solution, reference: Solution) -> str:
    """Return a run as a row of the table."""
    summary = run.summary
    errors = [largest_force_error(run, reference, lip) for lip in LIPS]
    cells = [
        what,
        "whole" if run.finished else run.message,
        ", ".join(f"{summary[f'{lip}_lip_window_kpa']:.1f}" for lip in LIPS),
        ", ".join(
            f"{summary[f'{lip}_lip_impulse_ns'] / reference.summary[f'{lip}_lip_impulse_ns']:.3f}"
            for lip in LIPS
        ),
        ", ".join(f"{100 * worst:.1f} ({100 * share:.0f})" for worst, share in errors),
        f"{run.history['neck_off_film_mm'].max():.2f}",
        f"{summary['newton_iterations'] / summary['increments']:.2f}",
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Make what is missing and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--scenario", default="A38-F")
    parser.add_argument("--resolution", default="coarse")
    parser.add_argument("--modes", nargs="*", default=MODES, choices=MODES)
    parser.add_argument("--shifts", nargs="*", default=SHIFTS, choices=SHIFTS)
    parser.add_argument("--set", action="append", default=[], metavar="TABLE.KEY=VALUE")
    options = parser.parse_args()
    out: Path = options.out / options.resolution
    reference = reference_run(options.scenario, options.resolution, out, options.set)
    head = [
        "hand, shift",
        "ended",
        "windows upper, lower, kPa",
        "impulses over the reference's",
        "largest error of force, % (share of time below 1 %)",
        "off the film, mm",
        "iterations an increment",
    ]
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    print(row("reference", reference, reference), flush=True)
    for mode in options.modes:
        for shift in options.shifts:
            settings = [
                f"numerics.resolution={options.resolution}",
                f"motion.file={out / 'reference' / 'motion' / 'motion.csv'}",
                f"placement.shift_{shift}",
                *options.set,
            ]
            if mode != "recorded":
                settings += [f"hand.mode={mode}", f"hand.reference={out / 'reference'}"]
            scenario = load_scenario(options.scenario, settings)
            run = kept_run(scenario, out / f"{mode}-{shift.replace('_mm=', '')}")
            print(row(f"{mode}, {shift.replace('_mm=', ' ')} mm", run, reference), flush=True)


if __name__ == "__main__":
    main()
