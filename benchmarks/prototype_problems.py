"""Two problems on which prototypes of this solver stopped: a skin that tears free, fine meshes.

    python -m benchmarks.prototype_problems [--repeats 1] [CASE ...]

The problems are described in `tests.support.prototype_problems`.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Mapping

import numpy as np

from fem2d.body.kinematics import Plane
from fem2d.solvers.march import MarchStatus
from tests.support.prototype_problems import STEP_S, Case, force_on_tissue, penetration_mm, run

CASES: Mapping[str, Case] = {
    "A 0.3": Case("A", 0.3),
    "A 0.15": Case("A", 0.15),
    "A 0.1": Case("A", 0.1),
    "A 0.15 strain": Case("A", 0.15, plane=Plane.STRAIN),
    "A 0.3 slippery": Case("A", 0.3, friction=0.3),
    "A 0.3 very slippery": Case("A", 0.3, friction=0.1),
    "A uniform": Case("A", 0.0),
    "A uniform strain": Case("A", 0.0, plane=Plane.STRAIN),
    "B 0.3": Case("B", 0.3),
    "B 0.3 backwards": Case("B", 0.3, backwards=True),
    "B 0.3 slippery": Case("B", 0.3, friction=0.3),
    "B 0.15": Case("B", 0.15),
    "B 0.15 backwards": Case("B", 0.15, backwards=True),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    parser.add_argument("--repeats", type=int, default=1)
    options = parser.parse_args()
    print(
        "| case | unknowns | ended | increments | cutbacks | iterations | wall s | processor s | "
        "penetration mm | largest force x, y N | force at the end x, y N |"
    )
    print("|" + "---|" * 11)
    total = np.zeros(2, int)
    for name in options.cases or CASES:
        case = CASES[name]
        run(Case(case.problem, 0.6, plane=case.plane))  # compile before the clock starts
        walls, processor = [], []
        for _ in range(options.repeats):
            wall, busy = time.perf_counter(), time.process_time()
            result, commits = run(case)
            walls.append(time.perf_counter() - wall)
            processor.append(time.process_time() - busy)
        forces = np.array([force_on_tissue(c) for c in commits])
        largest, last = np.abs(forces).max(axis=0), np.abs(forces[-1])
        whole = result.status is MarchStatus.FINISHED
        ended = "whole" if whole else f"{result.status.value} at {result.state.time_s / STEP_S:.1f}"
        total += (result.increments, result.iterations)
        print(
            f"| {name} | {commits[0].state.displacement.size} | {ended} | {result.increments} | "
            f"{result.cutbacks} | {result.iterations} | {statistics.median(walls):.1f} | "
            f"{statistics.median(processor):.1f} | {penetration_mm(commits):.4f} | "
            f"{largest[0]:.4f}, {largest[1]:.4f} | {last[0]:.4f}, {last[1]:.4f} |",
            flush=True,
        )
    print(f"\n{total[1] / total[0]:.2f} Newton iterations an increment")


if __name__ == "__main__":
    main()
