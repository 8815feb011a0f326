"""One Newton loop for everything that is in equilibrium."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fem2d.solvers.bordered import BorderedSolver, Tangent
from fem2d.solvers.linear import DirectSolver, SingularMatrixError
from geometry2d.foundation.settings import setting

Array = NDArray[np.float64]

LINE_SEARCH_TRIALS = 7
"""Places tried along one step: each costs an evaluation of forces, a new step three times that."""

STEP_RESIDUAL = 1e-5
"""What a step may leave of the forces that it is to balance: far less than their being nonlinear
leaves, and single precision mostly gets there without being refined."""


class NewtonStatus(Enum):
    """How a Newton solve ended; the value says it in words."""

    CONVERGED = "the forces balance"
    TOO_MANY_ITERATIONS = "the forces did not balance within the allowed iterations"
    STALLED = "the unbalanced forces stopped getting smaller"
    INADMISSIBLE = "no admissible deformation lay along the Newton direction"
    SINGULAR = "the stiffness matrix could not be factorised"


@dataclass(frozen=True)
class NewtonSettings:
    """When a solve is good enough and when it is given up.

    Parameters
    ----------
    tolerance
        Largest unbalanced nodal force, relative to the largest nodal force that acts.
    force_floor_n
        Nodal force below which nothing is considered to act, N.
    iterations
        Most iterations before giving up.
    patience
        Iterations in which the unbalanced forces must halve; else the solve has stalled.
    """

    tolerance: float = setting(
        default=1e-6,
        above=0.0,
        maximum=0.1,
        description="largest unbalanced nodal force over the largest nodal force that acts",
    )
    force_floor_n: float = setting(
        default=1e-6,
        unit="N",
        above=0.0,
        description="nodal force below which nothing is considered to act",
    )
    iterations: int = setting(
        default=25, minimum=1, maximum=1000, description="largest number of iterations in a step"
    )
    patience: int = setting(
        default=8,
        minimum=1,
        maximum=1000,
        description="iterations within which the unbalanced forces must halve",
    )


@dataclass(frozen=True, eq=False)
class Balance:
    """Unbalanced forces at a trial, and what linearises them.

    Attributes
    ----------
    residual
        (2n + m,) internal minus external force, N, then what is left of the equations of further
        unknowns, as forces; not finite where the deformation is inadmissible.
    force_scale
        Largest nodal force that acts, N.
    tangent
        Builds the derivative of the residual (called only if needed); called with True, a stand-in
        for it that is positive definite in the displacements, so that its step leads downhill.
    """

    residual: Array
    force_scale: float
    tangent: Callable[[bool], Tangent]


SomeBalance = TypeVar("SomeBalance", bound=Balance)
"""What is being balanced may say more about a trial than Newton's method asks."""


@dataclass(frozen=True)
class NewtonResult:
    """Where a Newton solve ended.

    Attributes
    ----------
    start, displacement
        (n, 2) where it began and where it ended, mm.
    further
        (m,) further unknowns where it ended.
    norms
        Largest unbalanced nodal force at each iterate, N.
    force_scale
        Largest nodal force that acts at the last iterate, N.
    """

    status: NewtonStatus
    start: Array
    displacement: Array
    further: Array
    norms: tuple[float, ...]
    force_scale: float

    @property
    def converged(self) -> bool:
        """Whether the forces balance."""
        return self.status is NewtonStatus.CONVERGED

    @property
    def imbalance(self) -> float:
        """Largest unbalanced nodal force over the largest that acts; 0 if nothing acts."""
        return self.norms[-1] / self.force_scale if self.force_scale > 0 else 0.0

    @property
    def iterations(self) -> int:
        """Linear systems solved."""
        return len(self.norms) - 1

    @property
    def predictor_error_mm(self) -> float:
        """Largest displacement of a node from where the solve began, mm."""
        return float(np.max(np.linalg.norm(self.displacement - self.start, axis=1)))


def solve(
    balance_at: Callable[[Array], SomeBalance],
    start: Array,
    *,
    solver: DirectSolver,
    settings: NewtonSettings,
    further: int = 0,
) -> tuple[NewtonResult, SomeBalance]:
    """Return the unknowns at which the residual of ``balance_at`` vanishes.

    The second value is the balance there, or at the last iterate if the solve failed.

    A step that halves the unbalanced forces is taken whole. Others are judged by their work, for
    the residual has no potential (friction): with the step ``s`` and the residual ``r``, the work
    ``s·r`` is negative at the start of a step that leads downhill and vanishes where it should end
    (Crisfield 1982). A step that overshoots, as when it runs into contact, is shortened until most
    of that work is used up. A step that leads uphill, which an indefinite tangent can produce, is
    replaced by one from the positive definite stand-in, unless it lessens the forces: with the
    unsymmetric tangent of friction, steps that lead uphill can be right. Once the forces no longer
    shrink, steps that do not halve them are shortened to half, which ends the cycles into which
    points between stick and slip, or open and closed, draw a full Newton method.

    Parameters
    ----------
    balance_at
        Returns the balance at unknowns (2n + m,): displacements, mm, then further ones.
    start
        (2n + m,) where to begin.
    solver
        For the linear systems of the displacements.
    settings
        When a balance is good enough.
    further
        m, how many of the unknowns are no displacements.
    """
    bordered = BorderedSolver(solver)
    at = start
    balance = balance_at(at)
    norms = [_norm(balance)]

    def ended(status: NewtonStatus) -> tuple[NewtonResult, SomeBalance]:
        count = start.size - further
        began, there = start[:count].reshape(-1, 2), at[:count].reshape(-1, 2)
        result = NewtonResult(status, began, there, at[count:], tuple(norms), balance.force_scale)
        return result, balance

    if not np.isfinite(norms[0]):
        return ended(NewtonStatus.INADMISSIBLE)
    if norms[0] <= _wanted(balance, settings):
        return ended(NewtonStatus.CONVERGED)
    for _ in range(settings.iterations):
        damped = len(norms) > 4 and norms[-1] > 0.5 * norms[-3]
        # With the tangent of the last iterate the forces shrink again by about twice the ratio
        # by which they shrank on the way here; if that is enough, no new factors are needed.
        again = len(norms) > 1 and 4 * norms[-1] ** 2 < _wanted(balance, settings) * norms[-2]
        try:
            found = _repeated(balance_at, at, balance, bordered) if again else None
            if found is None:
                found = _next_iterate(balance_at, at, balance, bordered, damped)
        except SingularMatrixError:
            return ended(NewtonStatus.SINGULAR)
        if found is None:
            return ended(NewtonStatus.INADMISSIBLE)
        at, balance = found
        norms.append(_norm(balance))
        if norms[-1] <= _wanted(balance, settings):
            return ended(NewtonStatus.CONVERGED)
        if len(norms) > settings.patience and min(norms[-settings.patience :]) > 0.5 * min(
            norms[: -settings.patience]
        ):
            return ended(NewtonStatus.STALLED)
    return ended(NewtonStatus.TOO_MANY_ITERATIONS)


def _repeated(
    balance_at: Callable[[Array], SomeBalance],
    at: Array,
    balance: SomeBalance,
    solver: BorderedSolver,
) -> tuple[Array, SomeBalance] | None:
    """Return where the step of the last factors leads; None if it does not halve the forces."""
    whole = at - solver.solve(balance.residual, residual=STEP_RESIDUAL)
    there = balance_at(whole)
    return (whole, there) if _norm(there) < 0.5 * _norm(balance) else None


def _next_iterate(
    balance_at: Callable[[Array], SomeBalance],
    at: Array,
    balance: SomeBalance,
    solver: BorderedSolver,
    damped: bool,
) -> tuple[Array, SomeBalance] | None:
    """Return where one step leads, and the balance there; None if no place is admissible."""
    solver.factorise(balance.tangent(False))
    step = -solver.solve(balance.residual, residual=STEP_RESIDUAL)
    work = work_of(balance.residual, step)
    whole = at + step
    there = balance_at(whole)
    if _norm(there) < (0.5 if work < 0 else 0.9) * _norm(balance):
        return whole, there
    uphill = work >= 0
    if uphill:
        solver.factorise(balance.tangent(True))
        step = -solver.solve(balance.residual, residual=STEP_RESIDUAL)
        work = work_of(balance.residual, step)
    if damped:
        step, work = 0.5 * step, 0.5 * work
    if uphill or damped:
        there = balance_at(at + step)
    return _along(balance_at, at, balance, step, work, there)


def _along(
    balance_at: Callable[[Array], SomeBalance],
    at: Array,
    balance: SomeBalance,
    step: Array,
    work: float,
    there: SomeBalance,
) -> tuple[Array, SomeBalance] | None:
    """Return how far to go along a step, and the balance there; None if no place is admissible.

    ``work`` is that of the residual on the step where it starts, ``there`` the balance at its end.
    """
    share, below, work_below = 1.0, 0.0, work
    above = work_above = np.inf
    norm = _norm(balance)
    for trial in range(LINE_SEARCH_TRIALS):
        if trial > 0:
            there = balance_at(at + share * step)
        norm_there = _norm(there)
        if not np.isfinite(norm_there):
            above, work_above = share, np.inf
            share = below + 0.3 * (share - below)
            continue
        work_there = work_of(there.residual, step)
        last = trial == LINE_SEARCH_TRIALS - 1
        if last or abs(work_there) <= 0.7 * abs(work) or norm_there < 0.5 * norm:
            return at + share * step, there
        if work_there < 0:
            if share == 1.0:
                return at + step, there
            below, work_below = share, work_there
        else:
            above, work_above = share, work_there
        share = _between(below, work_below, above, work_above)
    return None


def work_of(force: Array, displacement: Array) -> float:
    """Return the work of nodal forces (2n,), N, on displacements (2n,) or (n, 2), mm, in N mm.

    Not by ``@``: on long vectors BLAS wakes threads for it, which then spin for milliseconds on
    the core that assembles half of the body.
    """
    return float(np.sum(force * displacement.ravel()))


def _wanted(balance: Balance, settings: NewtonSettings) -> float:
    """Return the unbalanced nodal force that is good enough, N."""
    return settings.tolerance * max(balance.force_scale, settings.force_floor_n)


def _between(below: float, work_below: float, above: float, work_above: float) -> float:
    """Return where the work would vanish if it were linear, kept off the ends of the bracket."""
    if not np.isfinite(work_above) or work_above == work_below:
        return 0.5 * (below + above)
    secant = -work_below / (work_above - work_below)
    return below + float(np.clip(secant, 0.1, 0.9)) * (above - below)


def _norm(balance: Balance) -> float:
    if not np.all(np.isfinite(balance.residual)):
        return np.inf
    return float(np.max(np.abs(balance.residual)))
