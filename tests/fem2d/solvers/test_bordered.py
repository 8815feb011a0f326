"""Bordered systems against dense ones, also where the matrix inside is nearly singular."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from fem2d.solvers.bordered import AtRest, Border, BorderedSolver, JoinedTangent, Tangent
from fem2d.solvers.linear import SingularMatrixError, SuperLu
from fem2d.threads import Threads


def bordered(count: int, further: int, seed: int, corner: bool) -> tuple[Tangent, np.ndarray]:
    """A tangent with a border of three unknowns, as a hand has, and the same as one matrix."""
    rng = np.random.default_rng(seed)
    inner = sp.diags([4.0, -1.0, -1.0], [0, 1, -1], (count, count)).tocsr()
    border = Border(
        rng.normal(size=(count, further)),
        rng.normal(size=(further, count)),
        rng.normal(size=(further, further)) if corner else np.zeros((further, further)),
    )
    whole = np.block([[inner.toarray(), border.columns], [border.rows, border.corner]])
    return Tangent(inner, border), whole


@pytest.mark.parametrize("corner", [True, False])
@pytest.mark.parametrize("further", [1, 3])
def test_a_bordered_system_is_solved_like_a_dense_one(further, corner):
    tangent, whole = bordered(40, further, 2, corner)
    wanted = np.random.default_rng(3).normal(size=40 + further)
    solver = BorderedSolver(SuperLu())
    solver.factorise(tangent)
    np.testing.assert_allclose(solver.solve(wanted), np.linalg.solve(whole, wanted), rtol=1e-9)


def test_without_a_border_it_is_the_solver_itself():
    tangent, _ = bordered(40, 1, 4, True)
    wanted = np.random.default_rng(5).normal(size=40)
    plain, wrapped = SuperLu(), BorderedSolver(SuperLu())
    plain.factorise(tangent.matrix)
    wrapped.factorise(Tangent(tangent.matrix))
    assert np.array_equal(plain.solve(wanted), wrapped.solve(wanted))


def test_blocks_with_one_border_are_solved_like_a_dense_matrix():
    (one, _), (other, _) = bordered(40, 3, 7, True), bordered(25, 3, 8, True)
    corner = np.diag([2.0, 3.0, 5.0])
    whole = np.zeros((68, 68))
    whole[:40, :40], whole[40:65, 40:65] = one.matrix.toarray(), other.matrix.toarray()
    whole[:65, 65:] = np.vstack([one.border.columns, other.border.columns])
    whole[65:, :65] = np.hstack([one.border.rows, other.border.rows])
    whole[65:, 65:] = one.border.corner + other.border.corner + corner
    wanted = np.random.default_rng(9).normal(size=68)
    solutions = []
    for threads in (Threads(1), Threads(2)):
        solver = BorderedSolver(SuperLu(), SuperLu(), threads=threads)
        solver.factorise(JoinedTangent((lambda: one, lambda: other), corner))
        solutions.append(solver.solve(wanted))
    np.testing.assert_allclose(solutions[0], np.linalg.solve(whole, wanted), rtol=1e-9)
    assert np.array_equal(*solutions)


def test_a_block_at_rest_takes_no_part_in_a_step():
    moving, whole = bordered(40, 3, 7, True)
    wanted = np.random.default_rng(9).normal(size=25 + 43)
    solver = BorderedSolver(SuperLu(), SuperLu())
    solver.factorise(JoinedTangent((lambda: AtRest(25), lambda: moving), np.zeros((3, 3))))
    found = solver.solve(wanted)
    assert np.array_equal(found[:25], np.zeros(25))
    np.testing.assert_allclose(found[25:], np.linalg.solve(whole, wanted[25:]), rtol=1e-9)


def test_a_nearly_singular_matrix_may_have_a_sound_border():
    # A limit point: the softest eigenvalue is 1e-8 of the others.
    count = 20
    inner = np.diag(np.r_[1e-8, np.ones(count - 1)])
    border = Border(np.ones((count, 1)), np.eye(1, count), np.zeros((1, 1)))
    whole = np.block([[inner, border.columns], [border.rows, border.corner]])
    solver = BorderedSolver(SuperLu())
    solver.factorise(Tangent(sp.csr_matrix(inner), border))
    wanted = np.arange(1.0, count + 2)
    np.testing.assert_allclose(solver.solve(wanted), np.linalg.solve(whole, wanted), rtol=1e-6)


def test_a_further_unknown_that_nothing_depends_on_is_refused():
    tangent, _ = bordered(40, 1, 6, False)
    empty = Border(np.zeros((40, 1)), tangent.border.rows, np.zeros((1, 1)))
    solver = BorderedSolver(SuperLu())
    solver.factorise(Tangent(tangent.matrix, empty))
    with pytest.raises(SingularMatrixError, match="further unknowns"):
        solver.solve(np.ones(41))
