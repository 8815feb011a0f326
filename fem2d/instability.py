"""Recognising that an equilibrium is unstable: wrinkles, creases, snap-through.

A static equilibrium is stable while the symmetric part of its tangent is positive definite. The
number of negative eigenvalues is read off the pivots of a symmetric factorisation (Sylvester's law
of inertia); where it is not zero, a few steps of inverse iteration give the softest mode, and with
it the place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import eigsh

from fem2d.linear import negative_pivots

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Instability:
    """An unstable equilibrium.

    Attributes
    ----------
    modes
        Number of independent ways in which it is unstable.
    place_mm
        (2,) deformed position of the node that moves most in the softest of them.
    node
        That node.
    participation
        Number of nodes that take part in that mode (inverse participation ratio): a wrinkle of a
        long surface involves many, a crease or a corner few.
    """

    modes: int
    place_mm: tuple[float, float]
    node: int
    participation: float


def instability_of(tangent: sp.csr_matrix, positions: Array) -> Instability | None:
    """Return how an equilibrium with this tangent is unstable, or None if it is stable.

    Parameters
    ----------
    tangent
        (2n, 2n) static tangent, N/mm, inertia left out; only its symmetric part matters.
    positions
        (n, 2) deformed positions of the nodes, mm.
    """
    symmetric = (0.5 * (tangent + tangent.T)).tocsr()
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


def softest_mode(symmetric: sp.csr_matrix) -> Array:
    """Return the eigenvector (2n,) of the lowest eigenvalue of a symmetric matrix."""
    identity = sp.identity(symmetric.shape[0], format="csr")
    below = -1e-6 * float(np.median(np.abs(symmetric.diagonal())))
    # Shifted to just below the spectrum, inverse iteration finds its lowest end in a few steps.
    while negative_pivots((symmetric - below * identity).tocsr()) > 0:
        below *= 10
    start = np.ones(symmetric.shape[0])
    _, vectors = eigsh(symmetric.tocsc(), k=1, sigma=below, which="LM", v0=start, tol=1e-4)
    mode: Array = vectors[:, 0]
    return mode
