"""One step: Newton's method from a prediction."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from fem2d.loads.load import Load
from fem2d.solvers.bordered import BorderedSolver
from fem2d.solvers.linear import DirectSolver
from fem2d.solvers.model import FurtherUnknowns, Model, ModelBalance
from fem2d.solvers.newton import NewtonResult, NewtonStatus, solve
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.state import State
from fem2d.threads import ONE_THREAD, Threads

Array = NDArray[np.float64]

Trial: TypeAlias = tuple[NewtonResult, ModelBalance]
"""Result of Newton's method and the balance there; nothing is committed."""

Start = TypeVar("Start")
"""Where Newton's method begins."""


def balanced(
    model: Model,
    load: Load,
    before: State,
    duration_s: float | None,
    start: Array,
    *,
    solver: DirectSolver,
    newton: NewtonSettings,
    further: FurtherUnknowns | None = None,
    threads: Threads = ONE_THREAD,
) -> Trial:
    """Balance the forces at a load, from a displacement ``start`` (n, 2), mm.

    Parameters
    ----------
    model
        The model.
    load
        What acts; with ``further`` unknowns, their values in it are where the search starts.
    before
        The committed state before.
    duration_s
        Time since then, s; None in statics.
    start
        Where to begin.
    solver
        For the linear systems.
    newton
        Settings of Newton's method.
    further
        Unknowns of the load and their equations.
    threads
        Threads that share the work.
    """
    count = start.size
    values = np.empty(0) if further is None else further.values(load)
    beginning = np.concatenate([start.ravel(), values])

    def balance_at(unknowns: Array) -> ModelBalance:
        there = load if further is None else further.applied(load, unknowns[count:])
        return model.balance(
            unknowns[:count].reshape(-1, 2),
            there,
            before,
            duration_s,
            further=further,
            threads=threads,
        )

    return solve(
        balance_at,
        beginning,
        solver=BorderedSolver(solver),
        settings=newton,
        further=values.size,
    )


def from_prediction(
    solved: Callable[[Start], Trial], prediction: Start, unpredicted: Start
) -> Trial:
    """Return the trial from a prediction, or from ``unpredicted`` if that is inadmissible."""
    trial = solved(prediction)
    if trial[0].status is NewtonStatus.INADMISSIBLE and trial[0].iterations == 0:
        return solved(unpredicted)
    return trial
