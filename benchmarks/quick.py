"""What lips feel at a coarse resolution beside the finest one, and what the coarse one takes.

    taskset -c 0 python -m benchmarks.quick [SCENARIO ...] [--resolution quick] [--beside thesis]
        [--set KEY=VALUE ...]

Each recording is converted once. Sips run on one thread and write nothing; processor times are
those of the sip alone, from the placing of the neck to the last increment, with compiled kernels,
medians of three. Felt are the peaks of the sip in kPa and N, impulses in N s, and the lengths of
contact as means over the load, mm; behind each value of the finer resolution stands by how many
percent the coarser one is off.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np

from fem2d.threads import Threads
from scenarios.results.quantities import LIPS
from scenarios.settings.files import recorded_names
from scenarios.settings.scenario import Scenario, load_scenario
from scenarios.sip.replay import replay
from scenarios.sip.run import with_known_motion

PEAKS = ("window_kpa", "window_1mm_kpa", "window_1_5mm_kpa", "mean_kpa", "pressure_kpa", "force_n")
REPEATS = 3


def sip(scenario: Scenario) -> tuple[dict[str, float], float, str]:
    """Return what is felt in a sip, its processor time, s, and how it went."""
    rows: list[dict[str, float]] = []
    began = time.process_time()
    outcome = replay(
        scenario, on_increment=lambda increment: rows.append(increment.row()), threads=Threads(1)
    )
    seconds = time.process_time() - began
    return felt(rows), seconds, f"{outcome.about['elements']} triangles, {outcome.messages[0]}"


def felt(rows: list[dict[str, float]]) -> dict[str, float]:
    """Return peaks, impulses and lengths of contact of a sip's history."""
    time_s = np.array([row["time_s"] for row in rows])

    def column(lip: str, name: str) -> np.ndarray:
        return np.array([row[f"{lip}_lip_{name}"] for row in rows])

    values = {f"{lip} {name}": float(column(lip, name).max()) for name in PEAKS for lip in LIPS}
    for lip in LIPS:
        force, length = column(lip, "force_n"), column(lip, "contact_mm")
        impulse = float(np.trapezoid(force, time_s))
        values[f"{lip} impulse_ns"] = impulse
        values[f"{lip} contact_mm"] = float(np.trapezoid(force * length, time_s)) / impulse
    return values


def main() -> None:
    """Print, for each scenario, what both resolutions took and what lips feel at them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", default=recorded_names())
    parser.add_argument("--resolution", default="quick")
    parser.add_argument("--beside", default="thesis")
    parser.add_argument("--set", dest="settings", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    for name in options.scenarios:
        known = with_known_motion(load_scenario(name), lambda share, what: None).known_motion()

        def at(resolution: str, settings: list[str], name=name, known=known) -> Scenario:
            chosen = [f"numerics.resolution={resolution}", *settings]
            return load_scenario(name, chosen).with_motion(known)

        sip(at(options.resolution, options.settings))
        runs = [sip(at(options.resolution, options.settings)) for _ in range(REPEATS)]
        values, _, how = runs[0]
        print(f"{name}, {options.resolution}: {statistics.median(run[1] for run in runs):.2f} s "
              f"of processor time, {how}", flush=True)  # fmt: skip
        fine, seconds, how = sip(at(options.beside, []))
        print(f"{name}, {options.beside}: {seconds:.1f} s of processor time, {how}")
        for what, value in fine.items():
            print(f"| {what} | {value:.4g} | {100 * (values[what] / value - 1):+.1f} |", flush=True)


if __name__ == "__main__":
    main()
