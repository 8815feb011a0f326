"""The first-order predictor of a step: where forces balance if everything is linear."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem2d.loads.load import Load
from fem2d.solvers.bordered import BorderedSolver, JoinedTangent, Tangent
from fem2d.solvers.linear import DirectSolver, SingularMatrixError
from fem2d.solvers.model import FurtherUnknowns, Model, ModelBalance

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Departure:
    """A model at a committed displacement under a new load.

    Attributes
    ----------
    balance
        At the committed displacement.
    moved
        (n, 2) that displacement with the held unknowns at the values of the load, mm.
    stiffness
        The derivative of the forces there.
    forces
        (2n,) unbalanced forces that the predictor is to balance, N.
    """

    balance: ModelBalance
    moved: Array
    stiffness: sp.csr_matrix
    forces: Array

    @classmethod
    def of(cls, balance: ModelBalance, forces: Array, load: Load) -> Departure:
        """Return where a step begins.

        Parameters
        ----------
        balance
            At the committed displacement.
        forces
            (2n,) unbalanced forces there under the new load, supports unmoved, N.
        load
            The new load.
        """
        model, here, stiffness = balance.model, balance.displacement, balance.stiffness(False)
        moved = with_supports_moved(model, here, load)
        if model.held.size:
            move = (moved - here).ravel()
            forces = np.where(model.free, forces + stiffness @ move, -move)
        return cls(balance, moved, stiffness, forces)

    def tangent(self, further: FurtherUnknowns | None = None) -> Tangent:
        """Return the tangent, with the border of what the tissue adds to further unknowns."""
        border = None if further is None else further.border(self.balance, psd=False)
        return self.balance.model.eliminated(Tangent(self.stiffness, border))

    def after(self, step: Array, load: Load) -> Array:
        """Return the displacement (n, 2), mm, after a step (2n,) of the predictor."""
        here = self.balance.displacement
        return with_supports_moved(self.balance.model, here - step.reshape(here.shape), load)


@dataclass(frozen=True, eq=False)
class Prediction:
    """What balances the forces to first order.

    Attributes
    ----------
    load
        The new load, with the predicted values of the further unknowns.
    displacements
        (n, 2) of each component, mm.
    kept
        The same with the further unknowns where they were. From these a step tells where points
        meet something on their way: in a hand that follows a recorded motion they are those of the
        recorded motion itself.
    """

    load: Load
    displacements: list[Array]
    kept: list[Array]


def predicted(departure: Departure, load: Load, *, solver: DirectSolver, residual: float) -> Array:
    """Return the displacement (n, 2), mm, that balances the forces to first order.

    Parameters
    ----------
    departure
        Where the step begins.
    load
        The new load.
    solver, residual
        For the linear system, and its residual.
    """
    try:
        solver.factorise(departure.tangent().matrix)
        step = solver.solve(departure.forces, residual=residual)
    except SingularMatrixError:
        return departure.moved
    return departure.after(step, load)


def predicted_together(
    departures: Sequence[Departure],
    load: Load,
    loads: Sequence[Load],
    further: FurtherUnknowns,
    *,
    solver: BorderedSolver,
    residual: float,
    may_reach: Callable[[Load], bool] | None = None,
) -> Prediction:
    """Return what balances the forces of components that share further unknowns to first order.

    Parameters
    ----------
    departures
        Where the step of each component begins; of the whole model, if there is only one.
    load
        The new load; the values of the further unknowns in it are those at the beginning.
    loads
        The part of it that acts on each component.
    further
        Unknowns of the load and their equations.
    solver, residual
        For the linear systems, and their residual.
    may_reach
        Whether the further unknowns may reach their values in a load. If they may not, they stay
        where they are: a body that is about to meet the tissue to first order knows nothing of it.
    """
    alone, corner = further.alone(load)
    equations = alone + sum(further.residual(each.balance) for each in departures)
    forces = [each.forces for each in departures]
    try:
        solver.factorise(
            JoinedTangent(tuple(partial(each.tangent, further) for each in departures), corner)
        )
        steps, by_further = solver.solve_blocks(forces, residual=residual)
        change = solver.further(steps, equations)
    except SingularMatrixError:
        unmoved = [each.moved for each in departures]
        return Prediction(load, unmoved, unmoved)
    kept = [each.after(step, own) for each, step, own in zip(departures, steps, loads, strict=True)]
    reached = further.applied(load, further.values(load) - change)
    if may_reach is not None and not may_reach(reached):
        return Prediction(load, kept, kept)
    moved = [
        each.after(step - response @ change, own)
        for each, step, response, own in zip(departures, steps, by_further, loads, strict=True)
    ]
    return Prediction(reached, moved, kept)


def with_supports_moved(model: Model, displacement: Array, load: Load) -> Array:
    """Return a displacement (n, 2), mm, with the held unknowns at the values of a load."""
    if not model.held.size:
        return displacement
    moved = displacement.copy()
    moved.reshape(-1)[model.held] = load.held_mm
    return moved
