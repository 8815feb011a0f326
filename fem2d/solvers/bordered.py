"""Linear systems that are bordered by a few unknowns beside the displacements.

A pressure that is to be found, or the coordinates of a neck in a yielding hand, are unknowns ``q``
of Newton's method like the displacements ``u``, with one equation ``g(u, q) = 0`` each. A Newton
step solves

    [ K  B ] [δu]     [ r ]
    [ C  D ] [δq] = − [ g ]        B = ∂r/∂q,  C = ∂g/∂u,  D = ∂g/∂q

by elimination of δu: one factorisation of ``K``, one more solution for each ``q``, and a small
dense system with the matrix ``D − C K⁻¹ B`` (Batoz and Dhatt 1979, for a load whose size a
displacement determines). ``K`` must not be singular. Near a limit point of the load it nearly is,
while the bordered matrix is well conditioned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem2d.solvers.linear import EXACT, DirectSolver, SingularMatrixError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Border:
    """The border that further unknowns add to a tangent.

    Attributes
    ----------
    columns
        (2n, m) derivative of the unbalanced forces by the further unknowns.
    rows
        (m, 2n) derivative of their equations by the displacements.
    corner
        (m, m) derivative of their equations by the further unknowns.
    """

    columns: Array
    rows: Array
    corner: Array


@dataclass(frozen=True, eq=False)
class Tangent:
    """The derivative of a balance: the stiffness, and the border if there are further unknowns."""

    matrix: sp.csr_matrix
    border: Border | None = None


class BorderedSolver:
    """Solves with tangents that may have a border.

    Parameters
    ----------
    solver
        For the matrices inside the border.
    """

    def __init__(self, solver: DirectSolver) -> None:
        self._solver = solver
        self._border: Border | None = None

    def factorise(self, tangent: Tangent) -> None:
        """Factorise a tangent; raises `SingularMatrixError`."""
        self._solver.factorise(tangent.matrix)
        self._border = border = tangent.border
        if border is not None:
            self._by_further = np.column_stack([self._solver.solve(c) for c in border.columns.T])
            self._complement = border.corner - border.rows @ self._by_further

    def solve(self, right_hand_side: Array, *, residual: float = EXACT) -> Array:
        """Return the solution (2n + m,) for the tangent factorised last; see `DirectSolver`."""
        if self._border is None:
            return self._solver.solve(right_hand_side, residual=residual)
        count = self._border.rows.shape[1]
        alone = self._solver.solve(right_hand_side[:count], residual=residual)
        try:
            further = np.linalg.solve(
                self._complement, right_hand_side[count:] - self._border.rows @ alone
            )
        except np.linalg.LinAlgError as error:
            raise SingularMatrixError(f"further unknowns: {error}") from error
        return np.concatenate([alone - self._by_further @ further, further])
