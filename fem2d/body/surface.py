"""A named stretch of a body's boundary, with the points where tractions are integrated."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class SurfaceError(DrinksimError):
    """A surface cannot carry contact or loads."""


NODAL_RULES = {
    2: (np.array([0.0, 1.0]), np.array([1.0, 1.0]) / 2),
    3: (np.array([0.0, 0.5, 1.0]), np.array([1.0, 4.0, 1.0]) / 6),
}
"""Nodes and weights, by nodes per edge, on [0, 1]: the trapezoidal and Simpson's rule."""


def edge_shapes(nodes_per_edge: int, local: ArrayLike) -> tuple[Array, Array]:
    """Return shape functions and derivatives (q, k) of an edge at local coordinates in [0, 1].

    Two nodes: first, last. Three nodes: first, last, middle.
    """
    s = np.asarray(local, float)
    if nodes_per_edge == 2:
        return np.stack([1 - s, s], -1), np.stack([-np.ones_like(s), np.ones_like(s)], -1)
    shape = np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], -1)
    slope = np.stack([4 * s - 3, 4 * s - 1, 4 - 8 * s], -1)
    return shape, slope


@dataclass(frozen=True)
class Surface:
    """Edges of a boundary with integration points on them.

    Parameters
    ----------
    edges
        (m, 2) or (m, 3) node indices (first, last, middle), the body on the left of first→last.
    nodes
        (n, 2) reference positions of the body's nodes, mm.
    thickness_mm
        Thickness of the section, mm.
    points_per_edge
        Gauss points per edge.
    axisymmetric
        Whether x is the distance from an axis and the section stands for a full turn around it;
        the thickness is unused then.
    at_nodes
        Whether the points are each edge's nodes in the order in which they lie along it, weighted
        by the trapezoidal rule or Simpson's, instead of Gauss points. A node shared by two edges is
        a point of both. A stiff contact penalty at Gauss points constrains an edge of three nodes
        three times, while the boundary has two unknowns an edge along its normal: pressures
        alternate. At nodes there is one constraint to an unknown.
    between_nodes
        With ``at_nodes``, how many further points lie between neighbouring nodes of an edge, evenly
        spread. They stop an edge that sinks over a corner of the outline and bear no pressure
        where the nodes do (`NormalLaw.gap_offset_mm`).
    """

    edges: Index
    nodes: Array
    thickness_mm: float = 1.0
    points_per_edge: int = 4
    axisymmetric: bool = False
    at_nodes: bool = False
    between_nodes: int = 0
    is_between: NDArray[np.bool_] = field(init=False, repr=False, compare=False)
    """(q,) which points lie between nodes in addition to those at the nodes."""
    shape: Array = field(init=False, repr=False, compare=False)
    """(q, k) shape functions at the points of an edge."""
    slope: Array = field(init=False, repr=False, compare=False)
    """(q, k) their derivatives with respect to the local coordinate."""
    weight: Array = field(init=False, repr=False, compare=False)
    """(m, q) reference area of each point, mm²; points between nodes have theirs in addition."""
    reference_speed: Array = field(init=False, repr=False, compare=False)
    """(m, q) reference length per local coordinate, mm."""
    arc_length: Array = field(init=False, repr=False, compare=False)
    """(m, q) reference arc length of each point from the first edge's start, mm."""

    def __post_init__(self) -> None:
        if self.edges.ndim != 2 or self.edges.shape[1] not in {2, 3} or len(self.edges) == 0:
            raise SurfaceError(
                f"edges of shape {self.edges.shape} carry no contact: give (m, 2) or (m, 3)"
            )
        if self.between_nodes and not self.at_nodes:
            raise SurfaceError("points between nodes go with points at nodes: set at_nodes too")
        if self.at_nodes:
            local, local_weight, between = _with_points_between(
                *NODAL_RULES[self.edges.shape[1]], self.between_nodes
            )
        else:
            local, local_weight = _gauss_rule(self.points_per_edge)
            between = np.zeros(self.points_per_edge, np.bool_)
        shape, slope = edge_shapes(self.edges.shape[1], local)
        speed = np.linalg.norm(np.einsum("qk,mkc->mqc", slope, self.nodes[self.edges]), axis=-1)
        length = speed @ np.where(between, 0.0, local_weight)
        start = np.concatenate([[0.0], np.cumsum(length)[:-1]])
        radius = np.einsum("qk,mk->mq", shape, self.nodes[self.edges][..., 0])
        depth = 2 * np.pi * radius if self.axisymmetric else self.thickness_mm
        for name, value in (
            ("is_between", between),
            ("shape", shape),
            ("slope", slope),
            ("reference_speed", speed),
            ("weight", speed * local_weight * depth),
            ("arc_length", start[:, None] + local * length[:, None]),
        ):
            object.__setattr__(self, name, value)

    @cached_property
    def dofs(self) -> Index:
        """(m, 2k) degrees of freedom of each edge, node by node, x before y."""
        dofs: Index = (2 * self.edges[:, :, None] + np.arange(2)).reshape(len(self.edges), -1)
        return dofs

    def scattered(self, nodal: Array) -> Array:
        """Return forces on all unknowns (2n,) from those on :attr:`dofs` (m, 2k)."""
        total = np.zeros(2 * len(self.nodes))
        np.add.at(total, self.dofs, nodal)
        return total

    def positions(self, displacement: Array) -> Array:
        """Return the deformed positions (m, q, 2) of the points, mm."""
        deformed = (self.nodes + displacement)[self.edges]
        position: Array = self.shape @ deformed
        return position

    def stretch(self, displacement: Array) -> Array:
        """Return deformed over reference length (m, q) at the points."""
        deformed = (self.nodes + displacement)[self.edges]
        speed = np.linalg.norm(np.einsum("qk,mkc->mqc", self.slope, deformed), axis=-1)
        ratio: Array = speed / self.reference_speed
        return ratio

    def nodal(self, values: Array) -> Array:
        """Return those of the values (m, q) at points that are nodes: (m, k) along each edge."""
        chosen: Array = values[:, ~self.is_between]
        return chosen

    def carried(self, density: Array) -> Array:
        """Return the share of a load (m, q) per area that each node carries: (m, k), N."""
        along = [0, 2, 1] if self.edges.shape[1] == 3 else [0, 1]
        shares: Array = (self.weight * density) @ self.shape[:, along]
        return shares

    def assembled_force(self, traction: Array, edges: Index | None = None) -> tuple[Index, Array]:
        """Return degrees of freedom and nodal forces, N, (j, 2k) of tractions (j, q, 2), MPa.

        ``edges`` (j,) picks the edges that the tractions belong to; all of them by default.
        """
        chosen = np.arange(len(self.edges)) if edges is None else edges
        if len(chosen) == 0:
            return self.dofs[:0], np.zeros((0, self.dofs.shape[1]))
        nodal = np.einsum("qk,mq,mqc->mkc", self.shape, self.weight[chosen], traction)
        return self.dofs[chosen], nodal.reshape(len(chosen), 2 * self.edges.shape[1])

    def uniform_force(self, traction: ArrayLike) -> Array:
        """Return the nodal forces (2n,), N, of one traction (2,), MPa of reference area."""
        everywhere = np.broadcast_to(np.asarray(traction, float), (*self.weight.shape, 2))
        return self.scattered(self.assembled_force(everywhere)[1])

    def assembled_stiffness(self, slope: Array, edges: Index) -> Array:
        """Return blocks (j, 2k, 2k), N/mm, of traction derivatives (j, q, 2, 2), MPa/mm."""
        count, points, nodes = len(edges), len(self.shape), self.shape.shape[1]
        pairs = np.einsum("qa,qb->qab", self.shape, self.shape).reshape(points, nodes * nodes)
        weighted = (self.weight[edges][:, :, None, None] * slope).reshape(count, points, 4)
        block = np.swapaxes(weighted, 1, 2) @ pairs
        ordered: Array = block.reshape(count, 2, 2, nodes, nodes).transpose(0, 3, 1, 4, 2)
        return ordered.reshape(count, 2 * nodes, 2 * nodes)


@cache
def _gauss_rule(points: int) -> tuple[Array, Array]:
    """Return places (q,) and weights (q,) of Gauss's rule on an edge from 0 to 1."""
    local, weight = np.polynomial.legendre.leggauss(points)
    return 0.5 * (local + 1), 0.5 * weight


def _with_points_between(
    local: Array, weight: Array, count: int
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return points and weights with ``count`` more points in every interval, and which these are.

    They integrate nothing: each guards an interval that no node guards.
    """
    share = np.arange(count + 1) / (count + 1)
    interval = np.diff(local)
    every = np.append((local[:-1, None] + share * interval[:, None]).ravel(), local[-1])
    between = np.arange(every.size) % (count + 1) > 0
    weights = np.repeat(np.append(interval, 0.0), count + 1)[: every.size]
    weights[~between] = weight
    return every, weights, between
