"""What the engine of a study adds to a sip, and what a second worker gives.

python -m benchmarks.study_engine --busy 1.0 --sips 24

Sips are loops that use so many seconds of a core; nothing else may run beside.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from scenarios.campaign.engine import opened_engine
from scenarios.campaign.study import carried_out
from tests.support.made_up_study import plan_of_factors, remembered


def seconds(sips: int, busy_s: float, workers: int | None) -> float:
    """Return the wall time of a study, without starting and ending its workers."""
    plan = plan_of_factors([{"neck": "A", "number": n, "busy_s": busy_s} for n in range(sips)])
    with TemporaryDirectory() as folder, opened_engine(workers=workers) as engine:
        warm = plan_of_factors([{"neck": "A", "number": n, "warm": 1} for n in range(4)])
        carried_out(
            warm, Path(folder) / "warm", engine, solver=remembered, progress=lambda s, t: None
        )
        began = time.monotonic()
        carried_out(
            plan, Path(folder) / "all", engine, solver=remembered, progress=lambda s, t: None
        )
        return time.monotonic() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--busy", type=float, default=1.0)
    parser.add_argument("--sips", type=int, default=24)
    options = parser.parse_args()
    names = {None: "this process", 1: "one worker", 2: "two workers"}
    taken = {}
    for workers, name in names.items():
        empty = seconds(100, 0.0, workers) / 100
        taken[workers] = seconds(options.sips, options.busy, workers)
        print(f"{name}: {1e3 * empty:.1f} ms an empty sip, {taken[workers]:.1f} s all sips")
    print(f"two workers give {taken[1] / taken[2]:.2f} times the throughput of one")


if __name__ == "__main__":
    main()
