"""Each scenario with one setting changed at a time, and what that changes.

    python -m benchmarks.variants [A38-F ...] [--resolution coarse] [--change SETTING ...]

Friction 0, 0.5 and 1.5 instead of 1, a dermis half and twice as stiff, the neck shifted by 2 mm
back, forward, down and up: with the scenario as it is, ten runs each. With ``--change`` the
scenario as it is and with each setting that is named.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from scenarios.results.quantities import LIPS
from scenarios.settings.files import recorded_names
from scenarios.settings.scenario import ScenarioError, load_scenario
from scenarios.sip.replay import replay
from scenarios.sip.run import convert_recording

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


def told(rows: list[dict[str, float]]) -> list[str]:
    """Return the cells of a run's costs and peaks."""
    if not rows:
        return ["0, 0, 0", "", "", "", "", "", ""]
    values = {name: [row[name] for row in rows] for name in rows[0]}
    iterations, cutbacks = sum(values["newton_iterations"]), sum(values["cutbacks"])
    least, largest = min(values["dermis_min_log_strain"]), max(values["dermis_max_log_strain"])
    return [
        f"{len(rows)}, {iterations:.0f}, {cutbacks:.0f}",
        *(f"{max(values[f'{lip}_lip_window_kpa']):.0f}" for lip in LIPS),
        *(f"{max(values[f'{lip}_lip_contact_mm']):.2f}" for lip in LIPS),
        f"{least:.2f} … {largest:.2f}",
        f"{max(values['dermis_max_mises_kpa']):.0f}",
    ]


def run(name: str, variant: str, motion: Path, resolution: str) -> bool:
    """Replay one variant, print its row and return whether it ran to the end."""
    settings = [f"numerics.resolution={resolution}", *variant.split()]
    rows: list[dict[str, float]] = []
    started = time.process_time()
    try:
        outcome = replay(
            load_scenario(name, settings).with_motion(motion),
            on_increment=lambda increment: rows.append(increment.row()),
        )
        finished, ended = outcome.finished, outcome.message
    except ScenarioError as error:
        finished, ended = False, str(error)
    seconds = time.process_time() - started
    row = [
        name,
        variant or "nothing",
        "whole" if finished else ended,
        *told(rows),
        f"{seconds:.0f}",
    ]
    print(f"| {' | '.join(row)} |", flush=True)
    return finished


def main() -> None:
    """Run the variants and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=recorded_names())
    parser.add_argument("--resolution", default="coarse")
    parser.add_argument("--change", action="append", metavar="SETTING", help="KEY=VALUE")
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
    variants = ("", *options.change) if options.change else VARIANTS
    whole = 0
    for name in options.scenarios:
        recording = load_scenario(name).recording
        if recording is None:
            raise SystemExit(f"{name} has no recording")
        with tempfile.TemporaryDirectory() as scratch:
            motion = convert_recording(
                recording, Path(scratch) / "motion", progress=lambda share, what: None
            ).motion
            whole += sum(run(name, variant, motion, options.resolution) for variant in variants)
    print(f"\n{whole} of {len(options.scenarios) * len(variants)} ran to the end")


if __name__ == "__main__":
    main()
