"""Bordered systems against dense ones, also where the matrix inside is nearly singular."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from fem2d.solvers.bordered import Border, BorderedSolver, Tangent
from fem2d.solvers.linear import SingularMatrixError, SuperLu


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
