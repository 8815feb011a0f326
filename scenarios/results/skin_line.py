"""The skin of a lip as a line: where the points of the contact fields are on the section."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenarios.results.increment import Integers, SectionModel

Array = NDArray[np.float64]


class SkinLine:
    """The skin of one lip as a line that carries contact pressure."""

    def __init__(self, model: SectionModel, edges: Integers, arc_mm: Array) -> None:
        self.nodes = np.append(edges[:, [0, 2]].ravel(), edges[-1, 1])
        steps = np.hypot(*np.diff(model.nodes[self.nodes], axis=0).T)
        self._node_arc = np.concatenate([[0.0], np.cumsum(steps)])
        self.arc_mm = arc_mm
        self.outward = _outward(model, edges[0])

    def between(self) -> tuple[Integers, Array]:
        """Return between which of the line's nodes the contact points are.

        The number (s,) of the node before each, and the share (s,) of the way to the next.
        """
        last = self.nodes.size - 2
        before = np.clip(np.searchsorted(self._node_arc, self.arc_mm, side="right") - 1, 0, last)
        length = self._node_arc[before + 1] - self._node_arc[before]
        return before, np.clip((self.arc_mm - self._node_arc[before]) / length, 0.0, 1.0)

    def points(self, positions: Array) -> Array:
        """Return where the points (s, 2) of the contact fields are, from node positions (n, 2)."""
        along = positions[self.nodes]
        return np.column_stack(
            [np.interp(self.arc_mm, self._node_arc, along[:, axis]) for axis in (0, 1)]
        )

    def band(self, points: Array, heights_mm: Array) -> Array:
        """Return quads (s - 1, 4, 2) that stand off the line through ``points`` (s, 2)."""
        along = np.gradient(points, axis=0)
        along /= np.maximum(np.hypot(*along.T), 1e-12)[:, None]
        normal = self.outward * np.column_stack([-along[:, 1], along[:, 0]])
        tips = points + heights_mm[:, None] * normal
        return np.stack([points[:-1], tips[:-1], tips[1:], points[1:]], axis=1)


def _outward(model: SectionModel, edge: Integers) -> int:
    """Return on which side of a skin line there is no tissue: 1 to the left of it, -1 right."""
    first, last, middle = edge
    owner = model.triangles[(model.triangles == middle).any(axis=1)][0]
    start, end = model.nodes[first], model.nodes[last]
    tissue = model.nodes[owner[:3]].mean(axis=0) - start
    along = end - start
    return -1 if along[0] * tissue[1] - along[1] * tissue[0] > 0 else 1
