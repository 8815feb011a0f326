"""One step: a first-order predictor, then Newton's method."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem2d.loads.load import Load
from fem2d.solvers.bordered import BorderedSolver, Tangent
from fem2d.solvers.linear import DirectSolver, SingularMatrixError
from fem2d.solvers.model import FurtherUnknowns, Model, ModelBalance
from fem2d.solvers.newton import NewtonResult, NewtonStatus, solve
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.state import State
from fem2d.threads import ONE_THREAD, Threads

Array = NDArray[np.float64]

Trial: TypeAlias = tuple[NewtonResult, ModelBalance]
"""Result of Newton's method and the balance there; nothing is committed."""


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

    def balance_at(unknowns: Array) -> ModelBalance:
        there = load if further is None else further.applied(load, unknowns[count:])
        displacement = unknowns[:count].reshape(-1, 2)
        return model.balance(
            displacement, there, before, duration_s, further=further, threads=threads
        )

    return solve(
        balance_at,
        np.concatenate([start.ravel(), values]),
        solver=solver,
        settings=newton,
        further=values.size,
    )


def predicted(
    balance: ModelBalance,
    forces: Array,
    load: Load,
    *,
    solver: DirectSolver,
    residual: float,
    further: FurtherUnknowns | None = None,
) -> tuple[Array, Load]:
    """Return the displacement (n, 2), mm, and load that balance the forces to first order.

    Parameters
    ----------
    balance
        At the committed displacement; its tangent is used.
    forces
        (2n,) unbalanced forces there under the new load, N.
    load
        The new load.
    solver, residual
        For the linear system, and its residual.
    further
        Unknowns of the load and their equations.
    """
    here, model = balance.displacement, balance.model
    stiffness, border = balance.stiffness(False), None
    values = equations = np.empty(0)
    moved = with_supports_moved(model, here, load)
    if model.held.size:
        move = (moved - here).ravel()
        forces = np.where(model.free, forces + stiffness @ move, -move)
    if further is not None:
        border, values = further.border(balance, psd=False), further.values(load)
        equations = further.residual(balance)
    bordered = BorderedSolver(solver)
    try:
        bordered.factorise(model.eliminated(Tangent(stiffness, border)))
        step = bordered.solve(np.concatenate([forces, equations]), residual=residual)
    except SingularMatrixError:
        return moved, load
    there = with_supports_moved(model, here - step[: here.size].reshape(here.shape), load)
    if further is not None:
        load = further.applied(load, values - step[here.size :])
    return there, load


def with_supports_moved(model: Model, displacement: Array, load: Load) -> Array:
    """Return a displacement (n, 2), mm, with the held unknowns at the values of a load."""
    if not model.held.size:
        return displacement
    moved = displacement.copy()
    moved.reshape(-1)[model.held] = load.held_mm
    return moved


def from_prediction(
    solved: Callable[[Array], Trial], prediction: Array, unpredicted: Array
) -> Trial:
    """Return the trial from a prediction, or from ``unpredicted`` if that is inadmissible."""
    trial = solved(prediction)
    if trial[0].status is NewtonStatus.INADMISSIBLE and trial[0].iterations == 0:
        return solved(unpredicted)
    return trial
