"""The lip press here and in DOLFINx, in turn: medians by the clock and of processor time.

    python -m benchmarks.lip_press_beside_dolfinx [--repeats 3] [--fine] [--python /usr/bin/python3]

Every run is a process of its own (lip_press.py, lip_press_dolfinx.py) with one thread for BLAS.
Where other work keeps the machine busy, compare processor times only. "own" is compared with
DOLFINx in plane strain.
"""

from __future__ import annotations

import argparse
import os
import re
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
SECONDS = re.compile(r"([\d.]+) s,? +processor ([\d.]+) s")


def timed(command: list[str]) -> tuple[float, float, str]:
    """Return seconds by the clock, seconds of processor and what the run printed last."""
    one_thread = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    printed = subprocess.run(command, env=one_thread, check=True, capture_output=True, text=True)
    line = printed.stdout.strip().splitlines()[-1]
    found = SECONDS.search(line)
    if found is None:
        raise ValueError(f"{command} printed no times: {line}")
    return float(found[1]), float(found[2]), line


def median_and_range(values: list[float]) -> str:
    return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--fine", action="store_true", help="the fine mesh instead of the coarse")
    parser.add_argument("--python", default="/usr/bin/python3", help="the one that has DOLFINx")
    options = parser.parse_args()
    mesh = "fine" if options.fine else "coarse"
    ours = [sys.executable, "-m", "benchmarks.lip_press", "--repeats", "1"]
    theirs = [options.python, str(HERE / "lip_press_dolfinx.py"), mesh, "--plane"]
    commands = {
        "strain": [*ours, f"{mesh} strain"],
        "own": [*ours, f"{mesh} own"],
        "stress": [*ours, f"{mesh} stress"],
        "dolfinx strain": [*theirs, "strain"],
        "dolfinx stress": [*theirs, "stress"],
    }
    runs: dict[str, list[tuple[float, float, str]]] = {name: [] for name in commands}
    for _ in range(options.repeats):
        for name, command in commands.items():
            runs[name].append(timed(command))
    for of_case in runs.values():
        clock, busy, lines = zip(*of_case, strict=True)
        print(lines[0])
        print(f"    clock {median_and_range(clock)} s, processor {median_and_range(busy)} s")
    for case, peer in (("strain", "strain"), ("own", "strain"), ("stress", "stress")):
        clock, busy = (
            statistics.median(run[k] for run in runs[f"dolfinx {peer}"])
            / statistics.median(run[k] for run in runs[case])
            for k in range(2)
        )
        print(f"{mesh} {case}: faster than DOLFINx by {clock:.2f} (clock), {busy:.2f} (processor)")


if __name__ == "__main__":
    main()
