"""One Newton loop for everything that is in equilibrium."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem2d.linear import DirectSolver, SingularMatrixError

Array = NDArray[np.float64]


class NewtonStatus(Enum):
    """How a Newton solve ended; the value says it in words."""

    CONVERGED = "the forces balance"
    TOO_MANY_ITERATIONS = "the forces did not balance within the allowed iterations"
    DIVERGED = "the forces grew from iteration to iteration"
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
    full_steps
        Steps taken whole before those that make the forces grow are damped.
    halvings
        How often a step is halved if it leads nowhere admissible.
    """

    tolerance: float = field(default=1e-8, metadata={"help": "relative force balance"})
    force_floor_n: float = field(default=1e-4, metadata={"unit": "N", "help": "smallest force"})
    iterations: int = field(default=20, metadata={"help": "most Newton iterations"})
    full_steps: int = field(default=3, metadata={"help": "steps taken whole before damping"})
    halvings: int = field(default=6, metadata={"help": "most halvings of a Newton step"})


@dataclass(frozen=True)
class Balance:
    """Unbalanced forces at a trial displacement, and what linearises them.

    Attributes
    ----------
    residual
        (n_dof,) internal minus external force, N; not finite where the deformation is inadmissible.
    force_scale
        Largest nodal force that acts, N.
    matrix
        Builds the derivative of the residual (called only if needed).
    """

    residual: Array
    force_scale: float
    matrix: Callable[[], sp.csr_matrix]


@dataclass(frozen=True)
class NewtonResult:
    """Where a Newton solve ended.

    Attributes
    ----------
    norms
        Largest unbalanced nodal force at each iterate, N.
    """

    status: NewtonStatus
    displacement: Array
    norms: tuple[float, ...]

    @property
    def converged(self) -> bool:
        """Whether the forces balance."""
        return self.status is NewtonStatus.CONVERGED

    @property
    def iterations(self) -> int:
        """Linear systems solved."""
        return len(self.norms) - 1


def solve(
    balance_at: Callable[[Array], Balance],
    start: Array,
    *,
    solver: DirectSolver,
    settings: NewtonSettings,
) -> NewtonResult:
    """Return the displacement (n, 2) at which the residual of ``balance_at`` vanishes.

    The first steps are full ones, halved only where they lead to an inadmissible deformation:
    contact that opens and closes makes a strict descent condition refuse good steps. Later ones
    that do not make the forces smaller are halved too, which ends the cycles into which points
    between stick and slip, or open and closed, can draw a full Newton method.
    """
    displacement = start
    balance = balance_at(displacement)
    norms = [_norm(balance)]
    if not np.isfinite(norms[0]):
        return NewtonResult(NewtonStatus.INADMISSIBLE, displacement, tuple(norms))
    for _ in range(settings.iterations):
        try:
            solver.factorise(balance.matrix())
            step = -solver.solve(balance.residual).reshape(start.shape)
        except SingularMatrixError:
            return NewtonResult(NewtonStatus.SINGULAR, displacement, tuple(norms))
        patient = len(norms) > settings.full_steps
        best: tuple[float, Array, Balance] | None = None
        for halving in range(settings.halvings + 1):
            trial = displacement + 0.5**halving * step
            there = balance_at(trial)
            norm = _norm(there)
            if np.isfinite(norm) and (best is None or norm < best[0]):
                best = (norm, trial, there)
            if best is not None and (not patient or best[0] < 0.9 * norms[-1] or halving > 1):
                break
        if best is None:
            return NewtonResult(NewtonStatus.INADMISSIBLE, displacement, tuple(norms))
        norm, displacement, balance = best
        norms.append(norm)
        if norm <= settings.tolerance * max(balance.force_scale, settings.force_floor_n):
            return NewtonResult(NewtonStatus.CONVERGED, displacement, tuple(norms))
        if len(norms) > 8 and norms[-1] > 0.5 * min(norms[-9:-4]):
            return NewtonResult(NewtonStatus.DIVERGED, displacement, tuple(norms))
    return NewtonResult(NewtonStatus.TOO_MANY_ITERATIONS, displacement, tuple(norms))


def _norm(balance: Balance) -> float:
    if not np.all(np.isfinite(balance.residual)):
        return np.inf
    return float(np.max(np.abs(balance.residual)))
