"""Sparse direct solvers behind one small interface: the fastest available, SuperLU always.

A `DirectSolver` analyses a sparsity pattern once and then factorises the values of each Newton
iteration. On this class of matrices PARDISO needs half of SuperLU's time at 4,000
unknowns and a third at 40,000 (benchmarks/linear.py), installs from a wheel and is chosen where it
imports. There it factorises in single precision and refines, which takes two thirds of the time.
"""

from __future__ import annotations

import ctypes
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

from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]


EXACT = 1e-12
"""Residual of a solution as exact as double precision makes it."""


class SingularMatrixError(DrinksimError):
    """The matrix could not be factorised."""


NOTHING_YET = "no matrix is factorised: call factorise first"


class DirectSolver(Protocol):
    """Factorises matrices of one sparsity pattern and solves with the last one factorised."""

    name: str

    def factorise(self, matrix: sp.csr_matrix) -> None:
        """Factorise; raises `SingularMatrixError`."""

    def solve(self, right_hand_side: Array, *, residual: float = EXACT) -> Array:
        """Return the solution (n,) or solutions (n, k) for the matrix factorised last.

        The residual of each is at most ``residual`` times the largest entry of its right-hand side,
        or that of double precision. Raises `SingularMatrixError`.
        """

    def another(self) -> DirectSolver:
        """Return a new solver of the same kind, on one thread."""


class SuperLu:
    """scipy's SuperLU, ordered for structurally symmetric matrices."""

    name = "superlu"
    _PIVOT_THRESHOLD = 0.001
    """A diagonal pivot is kept if it is at least this share of the largest in its column."""

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

    def solve(self, right_hand_side: Array, *, residual: float = EXACT) -> Array:
        """Return the solution (n,) for the matrix factorised last, as exactly as it can."""
        solution: Array = self._factor.solve(right_hand_side)
        return solution

    def another(self) -> SuperLu:
        """Return a new solver of the same kind."""
        return type(self)()


class Pardiso:
    """MKL's PARDISO for structurally symmetric matrices, with reproducible results.

    Parameters
    ----------
    threads
        Threads that share a factorisation. With more than one, sums are made in a fixed order,
        which makes solutions a third slower. Results depend on the number by rounding.
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
        self._routine = self._library.libmkl["pardiso"]
        self._routine.argtypes, self._routine.restype = [ctypes.c_void_p] * 16, None
        self._threads = threads
        for number, value in self._PARAMETERS:
            self._library.set_iparm(number, value)
        if threads > 1:
            self._library.set_iparm(self._REPRODUCIBLE_ON, threads)
        self._matrix: sp.csr_matrix | None = None

    def factorise(self, matrix: sp.csr_matrix) -> None:
        """Factorise, analysing anew only if the pattern changed; raises `SingularMatrixError`."""
        nothing = np.zeros(matrix.shape[0])
        if self._matrix is None or not same_pattern(self._matrix, matrix):
            self._rows = matrix.indptr.astype(np.int32) + np.int32(1)
            self._columns = matrix.indices.astype(np.int32) + np.int32(1)
            self._call(self._ANALYSE, matrix, nothing)
        self._matrix = matrix
        self._call(self._FACTORISE, matrix, nothing)

    def solve(self, right_hand_side: Array, *, residual: float = EXACT) -> Array:
        """Return the solution (n,) for the matrix factorised last, as exactly as it can."""
        if self._matrix is None:
            raise SingularMatrixError(NOTHING_YET)
        return self._call(self._SOLVE, self._matrix, np.asarray(right_hand_side, order="F"))

    def another(self) -> Pardiso:
        """Return a new solver of the same kind, on one thread."""
        return type(self)()

    def _call(self, phase: int, matrix: sp.csr_matrix, vector: Array) -> Array:
        """Call the routine itself: the wrapper analyses each matrix anew and copies its pattern."""
        library, solution = self._library, np.zeros_like(vector)
        count = 1 if vector.ndim == 1 else vector.shape[1]
        one, kind, size, quiet, error = 1, self._MATRIX_TYPE, matrix.shape[0], 0, 0
        numbers = np.array([one, one, kind, phase, size, count, quiet, error], np.int32)
        at = [numbers.ctypes.data + numbers.itemsize * i for i in range(numbers.size)]
        library.libmkl.MKL_Set_Num_Threads_Local(self._threads)
        self._routine(
            library.pt.ctypes.data,
            *at[:5],
            matrix.data.ctypes.data,
            self._rows.ctypes.data,
            self._columns.ctypes.data,
            library.perm.ctypes.data,
            at[5],
            library.iparm.ctypes.data,
            at[6],
            vector.ctypes.data,
            solution.ctypes.data,
            at[7],
        )
        if numbers[-1] != 0:
            raise SingularMatrixError(f"PARDISO: error {numbers[-1]}")
        return np.ascontiguousarray(solution)

    def __del__(self, at_exit: Callable[[], bool] = sys.is_finalizing) -> None:
        matrix = getattr(self, "_matrix", None)
        if matrix is not None and not at_exit():
            self._call(self._FREE, matrix, np.zeros(matrix.shape[0]))


class _SinglePardiso(Pardiso):
    """PARDISO in single precision."""

    # 24: two levels, which makes solutions on two threads half as long; 28: single precision.
    _PARAMETERS = (*Pardiso._PARAMETERS, (24, 1), (28, 1))

    def factorise(self, matrix: sp.csr_matrix) -> None:
        """Factorise, analysing anew only if the pattern changed; raises `SingularMatrixError`."""
        data = matrix.data.astype(np.float32)
        super().factorise(sp.csr_matrix((data, matrix.indices, matrix.indptr), matrix.shape))

    def _call(self, phase: int, matrix: sp.csr_matrix, vector: Array) -> Array:
        return super()._call(phase, matrix, vector.astype(np.float32)).astype(float)


class RefinedPardiso:
    """PARDISO in single precision with iterative refinement to a given residual.

    Each refinement solves once more for what is left and gains six or seven digits of the residual
    (Langou et al. 2006). Where it does not, as with matrices that are nearly singular, the
    matrix is factorised in double precision after all.

    Parameters
    ----------
    threads
        As of `Pardiso`.
    """

    name = "pardiso, refined"
    _MOST_SOLUTIONS = 4

    def __init__(self, threads: int = 1) -> None:
        self._single, self._double = _SinglePardiso(threads), Pardiso(threads)
        self._matrix: sp.csr_matrix | None = None
        self._in_double = False

    def factorise(self, matrix: sp.csr_matrix) -> None:
        """Factorise; raises `SingularMatrixError`."""
        self._single.factorise(matrix)
        self._matrix, self._in_double = matrix, False

    def solve(self, right_hand_side: Array, *, residual: float = EXACT) -> Array:
        """Return the solution (n,) for the matrix factorised last; see `DirectSolver`."""
        if self._matrix is None:
            raise SingularMatrixError(NOTHING_YET)
        if not self._in_double:
            refined = self._refined(self._matrix, right_hand_side, residual)
            if refined is not None:
                return refined
            self._double.factorise(self._matrix)
            self._in_double = True
        return self._double.solve(right_hand_side)

    def another(self) -> RefinedPardiso:
        """Return a new solver of the same kind, on one thread."""
        return type(self)()

    def _refined(self, matrix: sp.csr_matrix, wanted: Array, residual: float) -> Array | None:
        """Return the solution for ``wanted``; None if refining does not get there."""
        solution, left = np.zeros_like(wanted), wanted
        size = np.max(np.abs(wanted), axis=0, initial=0.0)
        enough = residual * size
        for _ in range(self._MOST_SOLUTIONS):
            if np.all(size <= enough):
                return solution
            scale = np.where(size > 0, size, 1.0)
            solution += scale * self._single.solve(left / scale)
            left = wanted - matrix @ solution
            before, size = size, np.max(np.abs(left), axis=0)
            if not np.all((size < 0.1 * before) | (size <= enough)):
                return None
        return solution if np.all(size <= enough) else None


def same_pattern(one: sp.csr_matrix, other: sp.csr_matrix) -> bool:
    """Whether two matrices have their entries at the same places, in the same order."""
    return np.array_equal(one.indptr, other.indptr) and np.array_equal(one.indices, other.indices)


@cache
def _mkl_library() -> str | None:
    """Return the path of the library in MKL's wheel, or None.

    Without it, the wrapper searches the whole environment when it is imported and for every solver:
    half a second each, five with a cold disk cache.
    """
    try:
        installed = files("mkl") or []
    except PackageNotFoundError:
        return None
    return next((str(file.locate()) for file in installed if "mkl_rt" in file.name), None)


class SymmetricSolver(DirectSolver, Protocol):
    """Factorises symmetric matrices, which may be indefinite, and counts negative eigenvalues."""

    def negative_pivots(self) -> int:
        """Return the number of negative eigenvalues of the matrix factorised last.

        By Sylvester's law of inertia it is the number of negative pivots.
        """


class SymmetricPardiso(Pardiso):
    """PARDISO with Bunch and Kaufman's pivots; it is given the upper triangle."""

    _MATRIX_TYPE = -2
    # 2: minimum degree, whose analysis takes half as long as nested dissection: what touches what
    # changes, and every pattern is factorised only a few times.
    _PARAMETERS = ((1, 1), (2, 0), (10, 13))
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

    Always the same one: the analysis of a pattern takes three times as long as a factorisation.
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
    """Return the upper triangle, faster than scipy does."""
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    kept = matrix.indices >= rows
    before = np.concatenate([[0], np.cumsum(kept)])
    return sp.csr_matrix(
        (matrix.data[kept], matrix.indices[kept], before[matrix.indptr]), matrix.shape
    )


def fastest_solver(threads: int = 1) -> DirectSolver:
    """Return refined PARDISO where its wheel is installed, SuperLU elsewhere.

    Two threads suit a body of one component; components are solved in parallel with one each.
    """
    try:
        return RefinedPardiso(threads)
    except ImportError:
        return SuperLu()
