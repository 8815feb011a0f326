"""Each scenario with one setting changed at a time, and what that changes.

    python benchmarks/variants.py [A38-F ...] [--resolution coarse]

Friction 0, 0.5 and 1.5 instead of 1, a dermis half and twice as stiff, the neck shifted by 2 mm
back, forward, down and up: with the scenario as it is, ten runs each.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from scenarios.drinking import replay
from scenarios.run import convert_recording
from scenarios.solution import LIPS, Increment
from scenarios.spec import library_names, read_scenario

VARIANTS = (
    "",
    "contact.friction=0",
    "contact.friction=0.5",
    "contact.friction=1.5",
    "skin.dermis_stiffness=0.5",
    "skin.dermis_stiffness=2",
    "placement.shift_x_mm=-2",
    "placement.shift_x_mm=2",
    "placement.shift_y_mm=-2",
    "placement.shift_y_mm=2",
)


def main() -> None:
    """Run the variants and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=library_names())
    parser.add_argument("--resolution", default="coarse")
    options = parser.parse_args()
    head = [
        "scenario",
        "changed",
        "ended",
        "increments, iterations, cutbacks",
        *(f"{lip} window, kPa" for lip in LIPS),
        *(f"{lip} contact, mm" for lip in LIPS),
        "log strain",
        "von Mises, kPa",
        "s",
    ]
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    whole = 0
    for name in options.scenarios:
        recording = read_scenario(name).recording
        if recording is None:
            raise SystemExit(f"{name} has no recording")
        with tempfile.TemporaryDirectory() as scratch:
            motion = convert_recording(
                recording, Path(scratch) / "motion", progress=lambda share, what: None
            ).motion
            for variant in VARIANTS:
                settings = [f"solver.resolution={options.resolution}", *variant.split()]
                increments: list[Increment] = []
                started = time.process_time()
                outcome = replay(
                    read_scenario(name, settings).with_motion(motion),
                    on_increment=increments.append,
                )
                seconds = time.process_time() - started
                whole += outcome.finished

                values = {
                    key: [increment.history[key] for increment in increments]
                    for key in increments[0].history
                }
                iterations = sum(i.newton_iterations for i in increments)
                cutbacks = sum(i.cutbacks for i in increments)
                row = [
                    name,
                    variant or "nothing",
                    "whole" if outcome.finished else outcome.sentence,
                    f"{len(increments)}, {iterations}, {cutbacks}",
                    *(f"{max(values[f'{lip}_lip_window_kpa']):.0f}" for lip in LIPS),
                    *(f"{max(values[f'{lip}_lip_contact_mm']):.2f}" for lip in LIPS),
                    f"{min(values['dermis_min_log_strain']):.2f} … "
                    f"{max(values['dermis_max_log_strain']):.2f}",
                    f"{max(values['dermis_max_mises_kpa']):.0f}",
                    f"{seconds:.0f}",
                ]
                print(f"| {' | '.join(row)} |", flush=True)
    print(f"\n{whole} of {len(options.scenarios) * len(VARIANTS)} ran to the end")


if __name__ == "__main__":
    main()
