"""Which sparse direct solver: factor and solve times on the matrices of the lip press.

    python -m benchmarks.linear [--repeats 7]

The matrices are tangents in the middle of a drag: unsymmetric where points slip, indefinite where
skin is compressed; solutions are as exact as a Newton step asks. Prints medians in milliseconds of
processor time; everything runs on one thread.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np

from benchmarks.lip_press import CASES, model, pressed
from fem2d.solvers.linear import DirectSolver, Pardiso, RefinedPardiso, SuperLu
from fem2d.solvers.newton_settings import NewtonSettings

STEP_RESIDUAL = NewtonSettings().step_residual


def timed(solver: DirectSolver, matrix, right_hand_side, repeats: int) -> tuple[float, float]:
    solver.factorise(matrix)  # the analysis is done once per run and not counted
    factor, solve = [], []
    for _ in range(repeats):
        begin = time.thread_time()
        solver.factorise(matrix)
        between = time.thread_time()
        solution = solver.solve(right_hand_side, residual=STEP_RESIDUAL)
        factor.append(between - begin)
        solve.append(time.thread_time() - between)
    error = np.abs(matrix @ solution - right_hand_side).max() / np.abs(right_hand_side).max()
    assert error <= STEP_RESIDUAL, f"{solver.name} left a relative residual of {error:.1e}"
    return 1e3 * statistics.median(factor), 1e3 * statistics.median(solve)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=7)
    repeats = parser.parse_args().repeats
    print(f"{'case':<16}{'unknowns':>9}{'solver':>18}{'factor ms':>11}{'solve ms':>10}")
    for name in CASES:
        system = model(name)
        state = pressed(system, 0.5, increments=15)
        balance = system.balance(state.displacement, state.load, state, 0.01)
        matrix = balance.tangent(False).matrix
        right_hand_side = np.random.default_rng(1).normal(size=matrix.shape[0])
        for solver in (RefinedPardiso(), Pardiso(), SuperLu()):
            factor, solve = timed(solver, matrix, right_hand_side, repeats)
            print(f"{name:<16}{matrix.shape[0]:>9}{solver.name:>18}{factor:>11.1f}{solve:>10.1f}")


if __name__ == "__main__":
    main()
