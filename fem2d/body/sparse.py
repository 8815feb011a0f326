"""The sparsity pattern of a body: built once, filled at every assembly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix

from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Index32 = NDArray[np.int32]


class PatternError(DrinksimError):
    """A matrix entry lies outside the pattern."""


@dataclass(frozen=True, eq=False)
class SparsePattern:
    """CSR pattern of a matrix with two unknowns a node, coupling the nodes that share an element.

    Unknown ``2 * node + component``. The two rows of a node have the same columns, in pairs, so
    the entry (component i of node a, component k of node b) lies at
    ``first[a, b] + i * row_length[a] + k`` of the data.

    Attributes
    ----------
    indptr, indices
        The usual two arrays of a CSR matrix of size 2n, columns ascending.
    neighbour_start
        (n + 1,) where each node's neighbours start in the list of all pairs of neighbours.
    pair_keys
        (pairs,) ``a * n + b`` of all pairs of neighbouring nodes, ascending.
    """

    indptr: Index32
    indices: Index32
    neighbour_start: Index
    pair_keys: Index

    @classmethod
    def of(cls, connectivity: NDArray[np.integer], nodes: int) -> SparsePattern:
        """Return the pattern for elements (e, a) of node numbers below ``nodes``."""
        con = np.asarray(connectivity, np.int64)
        keys = np.unique((con[:, :, None] * nodes + con[:, None, :]).ravel())
        rows, columns = keys // nodes, keys % nodes
        counts = np.bincount(rows, minlength=nodes)
        start = np.concatenate([[0], np.cumsum(counts)])
        indptr = np.zeros(2 * nodes + 1, np.int64)
        indptr[1:] = np.cumsum(np.repeat(2 * counts, 2))
        pair_columns = np.stack([2 * columns, 2 * columns + 1], axis=1)
        indices = np.empty(4 * len(keys), np.int64)
        first = 4 * start[rows] + 2 * (np.arange(len(keys)) - start[rows])
        for component in range(2):
            where = first + component * 2 * counts[rows]
            indices[where], indices[where + 1] = pair_columns[:, 0], pair_columns[:, 1]
        return cls(indptr.astype(np.int32), indices.astype(np.int32), start, keys)

    @property
    def size(self) -> int:
        """Number of unknowns, 2n."""
        return len(self.indptr) - 1

    @property
    def nonzeros(self) -> int:
        """Number of entries stored."""
        return len(self.indices)

    @property
    def row_length(self) -> Index:
        """(n,) entries in each of the two rows of a node."""
        return 2 * np.diff(self.neighbour_start)

    def node_pairs(self, first: ArrayLike, second: ArrayLike) -> Index:
        """Return where in the data the entry (2 · first, 2 · second) of each pair of nodes lies.

        Raises
        ------
        PatternError
            If two nodes do not share an element.
        """
        a, b = np.broadcast_arrays(np.asarray(first, np.int64), np.asarray(second, np.int64))
        key = a * (self.size // 2) + b
        at = np.minimum(np.searchsorted(self.pair_keys, key), len(self.pair_keys) - 1)
        missing = self.pair_keys[at] != key
        if np.any(missing):
            i, j = a[missing].flat[0], b[missing].flat[0]
            raise PatternError(
                f"nodes {i} and {j} share no element: their entry is not in the pattern"
            )
        start = self.neighbour_start[a]
        where: Index = 4 * start + 2 * (at - start)
        return where

    def slots(self, dofs: ArrayLike) -> Index:
        """Return where the dense blocks over ``dofs`` (m, k) lie in the data: (m, k, k).

        ``np.add.at(data, pattern.slots(dofs), blocks)`` adds blocks (m, k, k) to a matrix.
        """
        unknowns = np.atleast_2d(np.asarray(dofs, np.int64))
        row, column = unknowns[:, :, None], unknowns[:, None, :]
        where: Index = (
            self.node_pairs(row // 2, column // 2)
            + (row % 2) * self.row_length[row // 2]
            + column % 2
        )
        return where

    def matrix(self, data: Array) -> csr_matrix:
        """Return the sparse matrix with these entries; it shares the pattern's arrays."""
        return csr_matrix((data, self.indices, self.indptr), shape=(self.size, self.size))
