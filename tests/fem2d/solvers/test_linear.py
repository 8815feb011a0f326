"""Solvers agree with each other; the inertia of a matrix is that of its eigenvalues."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from fem2d.solvers.linear import (
    EXACT,
    Pardiso,
    RefinedPardiso,
    SingularMatrixError,
    SuperLu,
    SymmetricPardiso,
    SymmetricSuperLu,
    fastest_solver,
)
from fem2d.solvers.stability import softest_mode


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


def two_threads() -> Pardiso:
    return Pardiso(threads=2)


def refined_on_two_threads() -> RefinedPardiso:
    return RefinedPardiso(threads=2)


def nearly_singular(seed: int, smallest: float, size: int = 60) -> sp.csr_matrix:
    """Symmetric, its lowest eigenvalue ``smallest``, the others of order 1 to 10."""
    rng = np.random.default_rng(seed)
    vectors, _ = np.linalg.qr(rng.normal(size=(size, size)))
    values = np.append(smallest, rng.uniform(1, 10, size - 1))
    return sp.csr_matrix(vectors * values @ vectors.T)


def of_grid(seed: int, nodes: int = 60) -> sp.csr_matrix:
    """Two unknowns a node, coupled with those of eight neighbours, as in a body of 3,600 nodes."""
    line = sp.diags([np.ones(nodes - 1), np.ones(nodes), np.ones(nodes - 1)], [-1, 0, 1])
    matrix = sp.kron(sp.kron(line, line), np.ones((2, 2))).tocsr()
    matrix.data = np.random.default_rng(seed).normal(size=matrix.nnz)
    return (matrix + 12 * sp.identity(2 * nodes**2)).tocsr()


SOLVERS = [SuperLu, Pardiso, two_threads, RefinedPardiso, refined_on_two_threads]


@pytest.mark.parametrize("kind", SOLVERS)
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


@pytest.mark.parametrize("kind", [two_threads, refined_on_two_threads])
def test_two_threads_give_the_same_bits_every_time(kind):
    matrices, right = [of_grid(seed) for seed in (1, 2)], np.linspace(-1, 1, 7200)
    solutions: list[set[bytes]] = [set(), set()]
    for _ in range(2):
        solver = kind()
        for _ in range(15):
            for matrix, of_matrix in zip(matrices, solutions, strict=True):
                solver.factorise(matrix)
                of_matrix.add(solver.solve(right).tobytes())
    assert [len(of_matrix) for of_matrix in solutions] == [1, 1]


def left_over(matrix, solution, right):
    return np.abs(matrix @ solution - right).max() / np.abs(right).max()


@pytest.mark.parametrize("residual", [1e-3, 1e-6, 1e-9, EXACT])
@pytest.mark.parametrize("size", [1e-30, 1.0, 1e30])
def test_refined_solutions_are_as_exact_as_asked(residual, size):
    matrix, solver = of_grid(4), RefinedPardiso()
    right = size * np.random.default_rng(6).normal(size=matrix.shape[0])
    solver.factorise(matrix)
    solution = solver.solve(right, residual=residual)
    assert left_over(matrix, solution, right) <= residual
    # A first solution has single precision, not less and not more.
    if residual == 1e-3:
        assert 1e-10 < left_over(matrix, solution, right) < 1e-5


@pytest.mark.parametrize("smallest", [-1e-8, 1e-11])
def test_what_single_precision_cannot_tell_from_singular_is_solved_in_double(smallest):
    matrix, solver, double = nearly_singular(3, smallest), RefinedPardiso(), Pardiso()
    expected = np.random.default_rng(4).normal(size=60)
    for each in (solver, double):
        each.factorise(matrix)
    right = matrix @ expected
    assert np.array_equal(solver.solve(right), double.solve(right))
    # The next matrix starts afresh.
    solver.factorise(unsymmetric(1))
    again = solver.solve(unsymmetric(1) @ expected, residual=1e-3)
    assert 1e-10 < left_over(unsymmetric(1), again, unsymmetric(1) @ expected) < 1e-5


def test_nothing_on_the_right_gives_nothing():
    solver = RefinedPardiso()
    solver.factorise(unsymmetric(2))
    assert not solver.solve(np.zeros(60)).any()


@pytest.mark.parametrize("kind", [Pardiso, RefinedPardiso])
def test_solving_before_factorising_says_so(kind):
    with pytest.raises(SingularMatrixError, match="call factorise first"):
        kind().solve(np.ones(3))


@pytest.mark.parametrize(
    "kind", [SuperLu, Pardiso, RefinedPardiso, SymmetricPardiso, SymmetricSuperLu]
)
def test_another_solver_is_of_the_same_kind_and_knows_nothing_of_the_first(kind):
    first, expected = kind(), np.arange(60.0)
    matrices = [symmetric(seed, 60) + 20 * sp.identity(60) for seed in (1, 2)]
    first.factorise(matrices[0].tocsr())
    second = first.another()
    assert type(second) is kind
    second.factorise(matrices[1].tocsr())
    for solver, matrix in zip((first, second), matrices, strict=True):
        np.testing.assert_allclose(solver.solve(matrix @ expected), expected, atol=1e-9)


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


@pytest.mark.parametrize("residual", [1e-5, EXACT])
@pytest.mark.parametrize("solver", [SuperLu, Pardiso, RefinedPardiso])
def test_several_right_hand_sides_are_solved_at_once(solver, residual):
    if solver is not SuperLu:
        pytest.importorskip("pypardiso")
    matrix = unsymmetric(3)
    wanted = np.random.default_rng(4).normal(size=(60, 3)) * [1.0, 1e-6, 0.0]
    one = solver()
    one.factorise(matrix)
    found = one.solve(wanted, residual=residual)
    assert found.shape == wanted.shape
    left = np.abs(wanted - matrix @ found).max(axis=0)
    assert np.all(left <= residual * np.abs(wanted).max(axis=0))
    single = np.column_stack([one.solve(column, residual=residual) for column in wanted.T])
    np.testing.assert_allclose(found, single, atol=10 * residual * np.abs(found).max())
