"""Static stability of an equilibrium: detection of wrinkles, creases and snap-through.

A static equilibrium is stable while its tangent, without inertia and viscosity and with sliding
friction held at its present value (`fem2d.solvers.model.Model.static_tangent`), is positive
definite. The number of negative eigenvalues is read off the pivots of a symmetric factorisation
(Sylvester's law of inertia); where it is not zero, a few steps of inverse iteration give the
softest mode, and with it the place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

from fem2d.solvers.linear import negative_pivots, same_pattern, symmetric_solver
from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]

ROUNDING = 1e-9


@dataclass(frozen=True)
class Instability:
    """The instability of an equilibrium.

    Attributes
    ----------
    modes
        Number of negative eigenvalues.
    place_mm
        (2,) deformed position of the node that moves most in the softest mode, mm.
    node
        That node.
    participation
        Number of nodes that take part in that mode (inverse participation ratio): many in a wrinkle
        of a long surface, few in a crease or at a corner.
    """

    modes: int
    place_mm: tuple[float, float]
    node: int
    participation: float


@dataclass(frozen=True)
class Passage:
    """A period in which committed equilibria are unstable, except at single instants.

    Attributes
    ----------
    start_s, end_s
        First and last committed instant, s.
    worst
        The instability at the first of its instants that has the most modes.
    """

    start_s: float
    end_s: float
    worst: Instability


def passages_with(
    passages: tuple[Passage, ...], before_s: float, time_s: float, instability: Instability | None
) -> tuple[Passage, ...]:
    """Return the passages up to ``time_s``, given those up to the committed instant before it.

    An unstable instant belongs to the passage before it if the equilibrium was stable in between
    for no longer than the increment that led here, so with equal increments at a single instant:
    near a limit point stability chatters, and that is one event.

    >>> fold = Instability(1, (0.0, 0.0), 7, 3.0)
    >>> passages = passages_with((), 0.0, 0.1, fold)
    >>> [(p.start_s, p.end_s) for p in passages_with(passages, 0.1, 0.2, fold)]
    [(0.1, 0.2)]
    """
    if instability is None:
        return passages
    if not passages or before_s - passages[-1].end_s > (1 + ROUNDING) * (time_s - before_s):
        return (*passages, Passage(time_s, time_s, instability))
    last = passages[-1]
    worst = instability if instability.modes > last.worst.modes else last.worst
    return (*passages[:-1], Passage(last.start_s, time_s, worst))


def instability_of(tangent: sp.csr_matrix, positions: Array) -> Instability | None:
    """Return the instability of an equilibrium with this tangent, or None if it is stable.

    Parameters
    ----------
    tangent
        (2n, 2n) static tangent, N/mm, inertia left out; only its symmetric part matters.
    positions
        (n, 2) deformed positions of the nodes, mm.
    """
    symmetric = symmetric_part(tangent)
    modes = negative_pivots(symmetric)
    if modes == 0:
        return None
    mode = softest_mode(symmetric)
    amplitude = np.linalg.norm(mode.reshape(-1, 2), axis=1)
    node = int(np.argmax(amplitude))
    share = amplitude**2 / np.sum(amplitude**2)
    return Instability(
        modes,
        (float(positions[node, 0]), float(positions[node, 1])),
        node,
        float(1.0 / np.sum(share**2)),
    )


def symmetric_part(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """Return ½ (K + Kᵀ) of a matrix whose pattern is symmetric, in the same pattern.

    scipy's sum would leave out entries that happen to vanish, and the solver analyse a pattern
    anew that changes from one equilibrium to the next.
    """
    transposed = matrix.T.tocsr()
    if not same_pattern(matrix, transposed):
        raise DrinksimError("a tangent couples one unknown to another, but not that one to it")
    data = 0.5 * (matrix.data + transposed.data)
    return sp.csr_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)


def softest_mode(symmetric: sp.csr_matrix) -> Array:
    """Return the eigenvector (2n,) of the lowest eigenvalue of a symmetric matrix."""
    below = -1e-6 * float(np.median(np.abs(symmetric.diagonal())))
    # Shifted to just below the spectrum, inverse iteration finds its lowest end in a few steps.
    while negative_pivots(_shifted(symmetric, below)) > 0:
        below *= 10
    inverse = LinearOperator(symmetric.shape, matvec=symmetric_solver().solve, dtype=float)
    start = np.ones(symmetric.shape[0])
    _, vectors = eigsh(symmetric, k=1, sigma=below, which="LM", v0=start, tol=1e-4, OPinv=inverse)
    mode: Array = vectors[:, 0]
    return mode


def _shifted(matrix: sp.csr_matrix, by: float) -> sp.csr_matrix:
    """Return a matrix, all of whose diagonal is stored, less a multiple of the identity."""
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    data = np.where(rows == matrix.indices, matrix.data - by, matrix.data)
    return sp.csr_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)
