"""Static equilibrium of a body alone: prescribed displacements and dead loads, no contact.

For tests, studies and whatever needs a body without the machinery of contact
(:mod:`fem2d.march`): Newton's method with an energy line search, falling back on the projected
tangent where the exact one does not lead downhill, in increments that are halved where that fails.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem2d.body import Body, Response
from fem2d.linear import DirectSolver, SingularMatrixError, SuperLu, fastest_solver

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ITERATION_LIMIT = 40
SMALL = 10_000
SMALLEST_STEP = 2.0**-12
ROUNDING = 1e-9
EPSILON = float(np.finfo(float).eps)
BACKTRACKING = tuple(0.5**k for k in range(8))


class EquilibriumStatus(Enum):
    """How the search ended; the value says it in words."""

    FOUND = "equilibrium was found at the full load"
    STOPPED = "Newton's method did not converge beyond the fraction given, however small the step"


@dataclass(frozen=True)
class Equilibrium:
    """Where a body came to rest.

    Attributes
    ----------
    status
        Whether the full load was reached.
    fraction
        Share of loads and displacements at which ``displacement`` is in equilibrium.
    displacement
        (n, 2), mm.
    reaction
        (2n,) forces that hold the body, N: internal forces less dead loads.
    iterations
        Newton iterations of each increment.
    """

    status: EquilibriumStatus
    fraction: float
    displacement: Array
    reaction: Array
    iterations: tuple[int, ...]


def equilibrium(
    body: Body,
    fixed: ArrayLike,
    values: ArrayLike = 0.0,
    *,
    load: ArrayLike = 0.0,
    start: ArrayLike | None = None,
    steps: int = 1,
    tolerance: float = 1e-10,
) -> Equilibrium:
    """Return the equilibrium of a body held at some unknowns and loaded at others.

    Displacements and loads grow together, from ``start`` (where the load counts as zero) to their
    values. A displacement increment enters through the first linear solve of its step and not by
    moving nodes, which would turn the elements beside them inside out.

    Parameters
    ----------
    body
        The body.
    fixed
        (m,) unknowns ``2 * node + component`` that are held.
    values
        (m,) or one displacement for all of them, mm.
    load
        (2n,) dead nodal forces, N, or 0.
    start
        (n, 2) displacements to start from, mm; zero if absent.
    steps
        Increments of equal size to begin with.
    tolerance
        Residual over the size of the forces that counts as equilibrium (or rounding, if larger).
    """
    size = body.pattern.size
    held = np.asarray(fixed, np.int64)
    free = np.setdiff1d(np.arange(size), held)
    target = np.broadcast_to(np.asarray(values, float), held.shape)
    dead = np.broadcast_to(np.asarray(load, float), (size,))
    u = np.zeros(size) if start is None else np.array(start, float).ravel()
    origin = u[held].copy()
    # Below this size any solver is fast, and one without a library to look for starts at once.
    solver = SuperLu() if size < SMALL else fastest_solver()
    fraction, step = 0.0, 1.0 / steps
    iterations: list[int] = []
    response = body.response(u)
    while fraction < 1.0 and step >= SMALLEST_STEP:
        goal = fraction + step if fraction + step < 1 - ROUNDING else 1.0
        move = np.zeros(size)
        move[held] = origin + goal * (target - origin) - u[held]
        settled = _increment(body, free, u, response, move, goal * dead, solver, tolerance)
        if settled is None:
            step /= 2
            continue
        u, response, count = settled
        fraction = goal
        iterations.append(count)
    return Equilibrium(
        EquilibriumStatus.FOUND if fraction == 1.0 else EquilibriumStatus.STOPPED,
        fraction,
        u.reshape(-1, 2),
        response.force - fraction * dead,
        tuple(iterations),
    )


def _increment(
    body: Body,
    free: Index,
    u: Array,
    response: Response,
    move: Array,
    dead: Array,
    solver: DirectSolver,
    tolerance: float,
) -> tuple[Array, Response, int] | None:
    """Return displacement, response and iterations after one increment, None if Newton fails."""
    for count in range(1, ITERATION_LIMIT + 1):
        for projected in (False, True):
            tangent = body.response(u, projected=True) if projected else response
            matrix = body.pattern.matrix(tangent.stiffness)
            change = move.copy()
            try:
                solver.factorise(matrix[free][:, free].tocsr())
            except SingularMatrixError:
                continue
            change[free] = solver.solve((dead - response.force - matrix @ move)[free])
            accepted = _searched(body, u, response, change, dead, moving=bool(np.any(move)))
            if accepted is not None:
                break
        else:
            return None
        length, u, response = accepted
        move = (1 - length) * move
        scale = float(np.linalg.norm(response.force) + np.linalg.norm(dead))
        rest = float(np.linalg.norm((dead - response.force)[free]))
        if not np.any(move) and rest <= max(tolerance * scale, _noise(body, response)):
            return u, response, count
    return None


def _noise(body: Body, response: Response) -> float:
    """Return the size of forces that rounding of the deformation gradient alone produces, N."""
    size = float(np.ptp(body.nodes, axis=0).max())
    return 2 * EPSILON * float(np.abs(response.stiffness).max()) * size


def _searched(
    body: Body, u: Array, response: Response, change: Array, dead: Array, *, moving: bool
) -> tuple[float, Array, Response] | None:
    """Return the longest of a few step lengths that is admissible and goes downhill.

    Downhill means in strain energy less the work of the dead loads, which equilibrium makes
    stationary. While held nodes are still ``moving`` that energy may rise, and it is not asked.
    """
    before = response.energy - dead @ u
    slack = ROUNDING * abs(response.energy)
    for length in BACKTRACKING:
        trial = u + length * change
        reached = body.response(trial)
        if not np.isfinite(reached.energy):
            continue
        if moving or reached.energy - dead @ trial <= before + slack:
            return length, trial, reached
    return None
