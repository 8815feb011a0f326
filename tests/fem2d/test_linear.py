"""Solvers agree with each other; the inertia of a matrix is that of its eigenvalues."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from fem2d.instability import softest_mode
from fem2d.linear import (
    InParts,
    Pardiso,
    SingularMatrixError,
    SuperLu,
    SymmetricPardiso,
    SymmetricSuperLu,
    fastest_solver,
)


def symmetric(seed: int, size: int = 40) -> sp.csr_matrix:
    rng = np.random.default_rng(seed)
    dense = rng.normal(size=(size, size)) * (rng.random((size, size)) < 0.2)
    return sp.csr_matrix(dense + dense.T + np.diag(rng.normal(0.0, 3.0, size)))


def unsymmetric(seed: int, size: int = 60) -> sp.csr_matrix:
    """Structurally symmetric, values not."""
    pattern = symmetric(seed, size)
    rng = np.random.default_rng(seed + 1)
    matrix = pattern.copy()
    matrix.data = matrix.data + rng.normal(0, 0.3, matrix.nnz)
    return (matrix + 12 * sp.identity(size)).tocsr()


@pytest.mark.parametrize("kind", [SuperLu, Pardiso])
def test_solves_what_it_factorised_last(kind):
    solver = kind()
    for seed in (1, 2, 1):
        matrix = unsymmetric(seed)
        expected = np.random.default_rng(seed).normal(size=60)
        solver.factorise(matrix)
        np.testing.assert_allclose(solver.solve(matrix @ expected), expected, atol=1e-9)


def test_same_matrix_same_bits():
    matrix, right = unsymmetric(5, 400), np.random.default_rng(0).normal(size=400)
    solutions = []
    for _ in range(3):
        solver = fastest_solver()
        solver.factorise(matrix)
        solutions.append(solver.solve(right))
    assert np.array_equal(solutions[0], solutions[1])
    assert np.array_equal(solutions[0], solutions[2])


@pytest.mark.parametrize("sizes", [(2500,), (1500, 1200), (900, 40, 1300, 300)])
def test_parts_that_do_not_couple_are_solved_apart_and_give_the_same(sizes):
    matrix = sp.block_diag([unsymmetric(seed, size) for seed, size in enumerate(sizes)]).tocsr()
    mixed = np.random.default_rng(4).permutation(matrix.shape[0])
    matrix = matrix[mixed][:, mixed].tocsr()
    matrix.sort_indices()
    expected = np.random.default_rng(5).normal(size=matrix.shape[0])
    solver, whole = InParts(SuperLu), SuperLu()
    for scale in (1.0, 2.0):
        for each in (solver, whole):
            each.factorise(scale * matrix)
        right = matrix @ expected
        np.testing.assert_allclose(solver.solve(right), expected / scale, atol=1e-8)
        np.testing.assert_allclose(solver.solve(right), whole.solve(right), atol=1e-8)


def test_a_pattern_that_couples_the_parts_is_noticed():
    apart = sp.block_diag([unsymmetric(0, 1500), unsymmetric(1, 1500)]).tolil()
    coupled = apart.copy()
    coupled[0, 2000] = coupled[2000, 0] = 0.5
    solver, expected = InParts(SuperLu), np.random.default_rng(2).normal(size=3000)
    for matrix in (apart.tocsr(), coupled.tocsr(), apart.tocsr()):
        solver.factorise(matrix)
        np.testing.assert_allclose(solver.solve(matrix @ expected), expected, atol=1e-8)


def test_a_singular_part_is_named():
    matrix = sp.block_diag([unsymmetric(0, 1500), sp.csr_matrix((1500, 1500))]).tocsr()
    with pytest.raises(SingularMatrixError):
        InParts(SuperLu).factorise(matrix)


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10**6))
def test_negative_pivots_count_negative_eigenvalues(seed):
    matrix = symmetric(seed)
    values = np.linalg.eigvalsh(matrix.toarray())
    if np.min(np.abs(values)) < 1e-6:
        return
    solver = SymmetricPardiso()
    solver.factorise(matrix)
    assert solver.negative_pivots() == np.sum(values < 0)
    expected = np.arange(40.0)
    np.testing.assert_allclose(solver.solve(matrix @ expected), expected, atol=1e-7)


def test_superlu_counts_the_same_where_it_needs_no_row_exchange():
    matrix = symmetric(3) + 2.5 * sp.identity(40)
    values = np.linalg.eigvalsh(matrix.toarray())
    assert 0 < np.sum(values < 0) < 20
    solver = SymmetricSuperLu()
    solver.factorise(matrix.tocsr())
    assert solver.negative_pivots() == np.sum(values < 0)


def test_softest_mode_is_the_eigenvector_of_the_lowest_eigenvalue():
    matrix = symmetric(8)
    values, vectors = np.linalg.eigh(matrix.toarray())
    mode = softest_mode(matrix)
    rayleigh = mode @ (matrix @ mode) / (mode @ mode)
    assert values[0] < 0
    assert rayleigh == pytest.approx(values[0], rel=1e-3)
    assert abs(mode @ vectors[:, 0]) == pytest.approx(1.0, abs=1e-2)
