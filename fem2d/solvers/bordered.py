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

Components of a model that only share further unknowns make ``K`` a matrix of diagonal blocks. Each
is then built, factorised and solved with alone, in parallel; ``D`` and ``C K⁻¹ B`` are sums over
the components.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem2d.solvers.linear import EXACT, DirectSolver, SingularMatrixError
from fem2d.threads import ONE_THREAD, Threads

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


@dataclass(frozen=True)
class AtRest:
    """In place of the tangent of a component that balances and that no further unknown acts on.

    It takes no part in a step.

    Attributes
    ----------
    unknowns
        2n, how many displacements it has.
    """

    unknowns: int


@dataclass(frozen=True, eq=False)
class JoinedTangent:
    """The derivative of the balances of components that share further unknowns.

    Attributes
    ----------
    components
        What builds the tangent of each component; the corner of its border holds what that
        component alone adds.
    corner
        (m, m) what the further unknowns add by themselves.
    """

    components: tuple[Callable[[], Tangent | AtRest], ...]
    corner: Array


class BorderedSolver:
    """Solves with tangents that may have a border.

    Parameters
    ----------
    solvers
        For the matrix inside the border: one for each of its diagonal blocks.
    residual
        Residual of the solutions with the border's columns; see `DirectSolver`.
    threads
        That share the blocks.
    """

    def __init__(
        self,
        *solvers: DirectSolver,
        residual: float = EXACT,
        threads: Threads = ONE_THREAD,
    ) -> None:
        self._solvers, self._residual, self._threads = solvers, residual, threads
        self._borders: tuple[Border, ...] = ()
        self._moves: tuple[bool, ...] = (True,) * len(solvers)

    def factorise(self, tangent: Tangent | JoinedTangent) -> None:
        """Factorise a tangent; raises `SingularMatrixError`."""
        if isinstance(tangent, JoinedTangent):
            self._factorise_bordered(tangent)
        elif tangent.border is not None:
            corner = np.zeros_like(tangent.border.corner)
            self._factorise_bordered(JoinedTangent((lambda: tangent,), corner))
        else:
            self._solvers[0].factorise(tangent.matrix)
            self._borders = ()

    def solve(self, right_hand_side: Array, *, residual: float = EXACT) -> Array:
        """Return the solution (2n + m,) for the tangent factorised last; see `DirectSolver`."""
        if not self._borders:
            return self._solvers[0].solve(right_hand_side, residual=residual)
        ends = np.cumsum([border.rows.shape[1] for border in self._borders])
        *forces, equations = np.split(right_hand_side, ends)
        blocks, by_further = self.solve_blocks(forces, residual=residual)
        further = self.further(blocks, equations)
        done = [block - by @ further for block, by in zip(blocks, by_further, strict=True)]
        return np.concatenate([*done, further])

    def solve_blocks(
        self, forces: Sequence[Array], *, residual: float = EXACT
    ) -> tuple[list[Array], Sequence[Array]]:
        """Return K⁻¹ r (2n,) of each block, and K⁻¹ B (2n, m)."""
        blocks = self._threads.run(
            [
                partial(solver.solve, force, residual=residual)
                if moves
                else partial(np.zeros_like, force)
                for solver, force, moves in zip(self._solvers, forces, self._moves, strict=True)
            ]
        )
        return blocks, self._by_further

    def further(self, blocks: Sequence[Array], equations: Array) -> Array:
        """Return the further unknowns (m,), given K⁻¹ r of each block and what is left of g (m,).

        Raises
        ------
        SingularMatrixError
            If the equations do not determine them.
        """
        for border, block in zip(self._borders, blocks, strict=True):
            equations = equations - border.rows @ block
        try:
            further: Array = np.linalg.solve(self._complement, equations)
        except np.linalg.LinAlgError as error:
            raise SingularMatrixError(f"further unknowns: {error}") from error
        return further

    def _factorise_bordered(self, tangent: JoinedTangent) -> None:
        tasks = [
            partial(self._factorised, solver, build, len(tangent.corner))
            for solver, build in zip(self._solvers, tangent.components, strict=True)
        ]
        done = self._threads.run(tasks)
        self._moves, self._borders, self._by_further = zip(*done, strict=True)
        self._complement = tangent.corner + sum(
            border.corner - border.rows @ by_further
            for border, by_further in zip(self._borders, self._by_further, strict=True)
        )

    def _factorised(
        self, solver: DirectSolver, build: Callable[[], Tangent | AtRest], further: int
    ) -> tuple[bool, Border, Array]:
        """Factorise one block; return whether it moves, its border and K⁻¹ B."""
        tangent = build()
        if isinstance(tangent, AtRest):
            columns = np.zeros((tangent.unknowns, further))
            return False, Border(columns, columns.T, np.zeros((further, further))), columns
        assert tangent.border is not None  # what joins components is their border
        solver.factorise(tangent.matrix)
        columns = tangent.border.columns
        if not columns.any():
            return True, tangent.border, columns
        return True, tangent.border, solver.solve(columns, residual=self._residual)
