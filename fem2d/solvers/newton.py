"""Newton's method for equilibrium, with a line search for forces that have no potential."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from fem2d.solvers.bordered import BorderedSolver, JoinedTangent, Tangent
from fem2d.solvers.linear import SingularMatrixError
from fem2d.solvers.newton_settings import NewtonSettings

Array = NDArray[np.float64]


class NewtonStatus(Enum):
    """How a solve ended; the value is a message."""

    CONVERGED = "the forces balance"
    TOO_MANY_ITERATIONS = "the forces did not balance within the allowed iterations"
    STALLED = "the unbalanced forces stopped getting smaller"
    INADMISSIBLE = "no admissible deformation lies along the Newton direction"
    SINGULAR = "the stiffness matrix could not be factorised"


@dataclass(frozen=True, eq=False)
class Balance:
    """Unbalanced forces at a trial, and their derivative.

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
    tangent: Callable[[bool], Tangent | JoinedTangent]


SomeBalance = TypeVar("SomeBalance", bound=Balance)
"""A balance may hold more than Newton's method needs."""


@dataclass(frozen=True)
class NewtonResult:
    """Result of a solve.

    Attributes
    ----------
    start, displacement
        (n, 2) first and last iterate, mm.
    further
        (m,) further unknowns of the last iterate.
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
    solver: BorderedSolver,
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
    decrease, steps that do not halve them are shortened to half, which ends the cycles into which
    points between stick and slip, or open and closed, draw a full Newton method.

    Parameters
    ----------
    balance_at
        Returns the balance at unknowns (2n + m,): displacements, mm, then further ones.
    start
        (2n + m,) where to begin.
    solver
        For the linear systems.
    settings
        When a balance is good enough.
    further
        m, how many of the unknowns are no displacements.
    """
    newton = _Newton(balance_at, solver, settings)
    at, balance = start, balance_at(start)
    norms = [_norm(balance)]

    def ended(status: NewtonStatus) -> tuple[NewtonResult, SomeBalance]:
        count = start.size - further
        began, there = start[:count].reshape(-1, 2), at[:count].reshape(-1, 2)
        result = NewtonResult(status, began, there, at[count:], tuple(norms), balance.force_scale)
        return result, balance

    if not np.isfinite(norms[0]):
        return ended(NewtonStatus.INADMISSIBLE)
    if norms[0] <= newton.wanted(balance):
        return ended(NewtonStatus.CONVERGED)
    for _ in range(settings.iterations):
        try:
            found = newton.next(at, balance, norms)
        except SingularMatrixError:
            return ended(NewtonStatus.SINGULAR)
        if found is None:
            return ended(NewtonStatus.INADMISSIBLE)
        at, balance = found
        norms.append(_norm(balance))
        if norms[-1] <= newton.wanted(balance):
            return ended(NewtonStatus.CONVERGED)
        if _stalled(norms, settings.patience):
            return ended(NewtonStatus.STALLED)
    return ended(NewtonStatus.TOO_MANY_ITERATIONS)


@dataclass(frozen=True)
class _Newton(Generic[SomeBalance]):
    """One iteration of the method."""

    balance_at: Callable[[Array], SomeBalance]
    solver: BorderedSolver
    settings: NewtonSettings

    def wanted(self, balance: Balance) -> float:
        """Return the unbalanced nodal force at which a balance has converged, N."""
        return self.settings.tolerance * max(balance.force_scale, self.settings.force_floor_n)

    def next(
        self, at: Array, balance: SomeBalance, norms: Sequence[float]
    ) -> tuple[Array, SomeBalance] | None:
        """Return the next iterate and its balance; None if no trial is admissible."""
        # With the tangent of the last iterate the forces decrease by about twice the ratio by
        # which they decreased before; if that is enough, no new factorisation is needed.
        if len(norms) > 1 and 4 * norms[-1] ** 2 < self.wanted(balance) * norms[-2]:
            found = self._repeated(at, balance)
            if found is not None:
                return found
        damped = len(norms) > 4 and norms[-1] > 0.5 * norms[-3]
        return self._step(at, balance, damped)

    def _solution(self, balance: Balance) -> Array:
        step: Array = -self.solver.solve(balance.residual, residual=self.settings.step_residual)
        return step

    def _repeated(self, at: Array, balance: SomeBalance) -> tuple[Array, SomeBalance] | None:
        """Return the iterate that the last factors lead to; None if it is not a good step."""
        whole = at + self._solution(balance)
        there = self.balance_at(whole)
        good = _norm(there) < self.settings.good_step * _norm(balance)
        return (whole, there) if good else None

    def _step(
        self, at: Array, balance: SomeBalance, damped: bool
    ) -> tuple[Array, SomeBalance] | None:
        """Return the next iterate and its balance; None if no trial is admissible."""
        settings = self.settings
        self.solver.factorise(balance.tangent(False))
        step = self._solution(balance)
        work = work_of(balance.residual, step)
        whole = at + step
        there = self.balance_at(whole)
        uphill = work >= 0
        enough = settings.fair_step if uphill else settings.good_step
        if _norm(there) < enough * _norm(balance):
            return whole, there
        if uphill:
            self.solver.factorise(balance.tangent(True))
            step = self._solution(balance)
            work = work_of(balance.residual, step)
        if damped:
            step, work = settings.damping * step, settings.damping * work
        if uphill or damped:
            there = self.balance_at(at + step)
        return self._along(at, balance, step, work, there)

    def _along(
        self, at: Array, balance: SomeBalance, step: Array, work: float, there: SomeBalance
    ) -> tuple[Array, SomeBalance] | None:
        """Return the iterate that a line search finds, and its balance; None if none is admissible.

        ``work`` is that of the residual on the step at its start, ``there`` the balance at its end.
        """
        settings = self.settings
        share, below, work_below = 1.0, 0.0, work
        above = work_above = np.inf
        norm = _norm(balance)
        for trial in range(settings.search_trials):
            if trial > 0:
                there = self.balance_at(at + share * step)
            norm_there = _norm(there)
            if not np.isfinite(norm_there):
                above, work_above = share, np.inf
                share = below + settings.search_retreat * (share - below)
                continue
            work_there = work_of(there.residual, step)
            last = trial == settings.search_trials - 1
            little = abs(work_there) <= settings.search_work * abs(work)
            if last or little or norm_there < settings.good_step * norm:
                return at + share * step, there
            if work_there < 0:
                if share == 1.0:
                    return at + step, there
                below, work_below = share, work_there
            else:
                above, work_above = share, work_there
            share = self._between(below, work_below, above, work_above)
        return None

    def _between(self, below: float, work_below: float, above: float, work_above: float) -> float:
        """Return the zero of the work by linear interpolation, kept off the ends of the bracket."""
        if not np.isfinite(work_above) or work_above == work_below:
            return 0.5 * (below + above)
        margin = self.settings.search_margin
        secant = -work_below / (work_above - work_below)
        return below + float(np.clip(secant, margin, 1 - margin)) * (above - below)


def work_of(force: Array, displacement: Array) -> float:
    """Return the work of nodal forces (2n,), N, on displacements (2n,) or (n, 2), mm, in N mm.

    Not by ``@``: on long vectors BLAS uses threads, which then spin for milliseconds on the core
    that assembles half of the body.
    """
    return float(np.sum(force * displacement.ravel()))


def _stalled(norms: Sequence[float], patience: int) -> bool:
    """Whether the forces have not halved within so many iterations."""
    return len(norms) > patience and min(norms[-patience:]) > 0.5 * min(norms[:-patience])


def _norm(balance: Balance) -> float:
    if not np.all(np.isfinite(balance.residual)):
        return np.inf
    return float(np.max(np.abs(balance.residual)))
