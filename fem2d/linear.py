"""Sparse direct solvers behind one small interface: the fastest available, SuperLU always.

`DirectSolver` is told the sparsity pattern once and analyses it once; then every Newton iteration
hands it new values. On this class of matrices PARDISO needs half of SuperLU's time at 4,000
unknowns and a third at 40,000 (benchmarks/linear.py), installs from a wheel and is chosen where it
imports.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

Array = NDArray[np.float64]


class SingularMatrixError(ArithmeticError):
    """The matrix could not be factorised."""


class DirectSolver(Protocol):
    """Factorises matrices of one sparsity pattern and solves with the last one factorised."""

    name: str

    def factorise(self, matrix: sp.csr_matrix) -> None:
        """Factorise; raises `SingularMatrixError`."""

    def solve(self, right_hand_side: Array) -> Array:
        """Return the solution (n,) for the matrix factorised last."""

    def another(self) -> DirectSolver:
        """Return a solver of the same kind, on one thread, that knows no matrix yet."""


class SuperLu:
    """scipy's SuperLU, ordered for structurally symmetric matrices."""

    name = "superlu"
    _PIVOT_THRESHOLD = 0.001
    """A diagonal pivot of this share of the largest in its column is kept."""

    def factorise(self, matrix: sp.csr_matrix) -> None:
        """Factorise; raises `SingularMatrixError`."""
        try:
            self._factor = splu(
                matrix.tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=self._PIVOT_THRESHOLD,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise SingularMatrixError(str(error)) from error

    def solve(self, right_hand_side: Array) -> Array:
        """Return the solution (n,) for the matrix factorised last."""
        solution: Array = self._factor.solve(right_hand_side)
        return solution

    def another(self) -> SuperLu:
        """Return a solver of the same kind that knows no matrix yet."""
        return type(self)()


class Pardiso:
    """MKL's PARDISO for structurally symmetric matrices, so that bits repeat.

    Parameters
    ----------
    threads
        Threads that share a factorisation. With more than one PARDISO is told to sum in an order
        that does not depend on which is first, which makes solutions a third slower.
    """

    name = "pardiso"
    _MATRIX_TYPE = 1  # structurally symmetric
    _ANALYSE, _FACTORISE, _SOLVE, _FREE = 11, 22, 33, -1
    # 1: the values here, no others; 2: nested dissection; 8: refine a solution only if a pivot was
    # perturbed (by default always, which doubles the time of a solve); 10: perturb tiny pivots to
    # 1e-13. Scaling and matching (11, 13) stay off: they make the analysis depend on the first
    # matrix, and then a resumed run on where it was resumed.
    _PARAMETERS: tuple[tuple[int, int], ...] = ((1, 1), (2, 2), (8, 0), (10, 13))

    _REPRODUCIBLE_ON = 34

    def __init__(self, threads: int = 1) -> None:
        library = _mkl_library()
        if library is not None:
            os.environ.setdefault("PYPARDISO_MKL_RT", library)
        # MKL's threads would otherwise spin for 0.2 s on the core that assembles half of a body.
        os.environ.setdefault("KMP_BLOCKTIME", "0")
        from pypardiso import PyPardisoSolver

        self._library = PyPardisoSolver(mtype=self._MATRIX_TYPE)
        self._threads = threads
        for number, value in self._PARAMETERS:
            self._library.set_iparm(number, value)
        if threads > 1:
            self._library.set_iparm(self._REPRODUCIBLE_ON, threads)
        self._matrix: sp.csr_matrix | None = None

    def factorise(self, matrix: sp.csr_matrix) -> None:
        """Factorise, analysing anew only if the pattern changed; raises `SingularMatrixError`."""
        nothing = np.zeros(matrix.shape[0])
        if self._matrix is None or not _same_pattern(self._matrix, matrix):
            self._call(self._ANALYSE, matrix, nothing)
        self._matrix = matrix
        self._call(self._FACTORISE, matrix, nothing)

    def solve(self, right_hand_side: Array) -> Array:
        """Return the solution (n,) for the matrix factorised last."""
        if self._matrix is None:
            raise SingularMatrixError("nothing was factorised yet: call factorise first")
        return self._call(self._SOLVE, self._matrix, np.ascontiguousarray(right_hand_side))

    def another(self) -> Pardiso:
        """Return a solver of the same kind, on one thread, that knows no matrix yet."""
        return type(self)()

    def _call(self, phase: int, matrix: sp.csr_matrix, vector: Array) -> Array:
        from pypardiso.pardiso_wrapper import PyPardisoError

        self._library.set_phase(phase)
        self._library.libmkl.MKL_Set_Num_Threads_Local(self._threads)
        try:
            # The wrapper's public solve() analyses the pattern again at every new matrix.
            solution: Array = self._library._call_pardiso(matrix, vector)
        except PyPardisoError as error:
            raise SingularMatrixError(f"PARDISO: {error}") from error
        return solution

    def __del__(self, at_exit: Callable[[], bool] = sys.is_finalizing) -> None:
        matrix = getattr(self, "_matrix", None)
        if matrix is not None and not at_exit():
            self._call(self._FREE, matrix, np.zeros(matrix.shape[0]))


def _same_pattern(one: sp.csr_matrix, other: sp.csr_matrix) -> bool:
    return np.array_equal(one.indptr, other.indptr) and np.array_equal(one.indices, other.indices)


@cache
def _mkl_library() -> str | None:
    """Return where MKL's own wheel says that its library is, or None.

    Left to itself, the wrapper searches the whole environment for it when it is imported and for
    every solver: half a second each, five where nothing is in the disk's cache yet.
    """
    try:
        installed = files("mkl") or []
    except PackageNotFoundError:
        return None
    return next((str(file.locate()) for file in installed if "mkl_rt" in file.name), None)


class SymmetricSolver(DirectSolver, Protocol):
    """Factorises symmetric matrices, which may be indefinite, and knows their inertia."""

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of the matrix factorised last.

        By Sylvester's law of inertia it is the number of negative pivots.
        """


class SymmetricPardiso(Pardiso):
    """PARDISO with Bunch and Kaufman's pivots; it is given the upper triangle."""

    _MATRIX_TYPE = -2
    _PARAMETERS = ((1, 1), (2, 2), (10, 13))
    _NEGATIVE_PIVOTS = 23

    def factorise(self, matrix: sp.csr_matrix) -> None:
        """Factorise; raises `SingularMatrixError`."""
        super().factorise(_upper_triangle(matrix))

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of the matrix factorised last."""
        return int(self._library.get_iparm(self._NEGATIVE_PIVOTS))


class SymmetricSuperLu(SuperLu):
    """SuperLU with its pivots kept on the diagonal."""

    _PIVOT_THRESHOLD = 0.0

    def factorise(self, matrix: sp.csr_matrix) -> None:
        """Factorise; raises `SingularMatrixError` if a pivot vanishes."""
        super().factorise(matrix)
        if not np.array_equal(self._factor.perm_r, self._factor.perm_c):
            raise SingularMatrixError("a pivot on the diagonal vanished: the inertia is not known")

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of the matrix factorised last."""
        return int(np.sum(self._factor.U.diagonal() < 0))


@cache
def symmetric_solver() -> SymmetricSolver:
    """Return PARDISO where its wheel is installed, SuperLU elsewhere.

    Always the same one: analysing the pattern of a run's matrices takes three times as long as
    factorising.
    """
    try:
        return SymmetricPardiso()
    except ImportError:
        return SymmetricSuperLu()


def negative_pivots(symmetric: sp.csr_matrix) -> int:
    """Return the number of negative eigenvalues of a symmetric matrix.

    Raises
    ------
    SingularMatrixError
        If a pivot vanishes.
    """
    solver = symmetric_solver()
    solver.factorise(symmetric)
    return solver.negative_pivots()


def _upper_triangle(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """Return the upper triangle; scipy's own takes longer than the factors are worth."""
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    kept = matrix.indices >= rows
    before = np.concatenate([[0], np.cumsum(kept)])
    return sp.csr_matrix(
        (matrix.data[kept], matrix.indices[kept], before[matrix.indptr]), matrix.shape
    )


def fastest_solver(threads: int = 1) -> DirectSolver:
    """Return PARDISO where its wheel is installed, SuperLU elsewhere.

    Two threads suit a body alone. Lips that come to rest side by side have one each.
    """
    try:
        return Pardiso(threads)
    except ImportError:
        return SuperLu()
