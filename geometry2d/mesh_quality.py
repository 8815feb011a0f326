"""Quality of triangle meshes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import skfem
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class MeshQuality(NamedTuple):
    """Figures of the worst triangle of a mesh.

    Attributes
    ----------
    smallest_angle_deg, largest_angle_deg
        Over all triangles.
    worst_radius_ratio
        Twice the inscribed over the circumscribed radius: 1 for an equilateral triangle, 0 for a
        degenerate one; the smallest.
    worst_aspect
        Longest edge over shortest edge of the same triangle; the largest.
    """

    smallest_angle_deg: float
    largest_angle_deg: float
    worst_radius_ratio: float
    worst_aspect: float


def mesh_quality(mesh: skfem.MeshTri) -> MeshQuality:
    """Return the quality figures of a triangle mesh."""
    edge = edge_lengths(mesh.p.T, mesh.t.T)
    angle = np.rad2deg(triangle_angles(edge))
    a, b, c = edge.T
    radius_ratio = (b + c - a) * (c + a - b) * (a + b - c) / (a * b * c)
    return MeshQuality(
        smallest_angle_deg=float(angle.min()),
        largest_angle_deg=float(angle.max()),
        worst_radius_ratio=float(radius_ratio.min()),
        worst_aspect=float((edge.max(axis=1) / edge.min(axis=1)).max()),
    )


def edge_lengths(points: Array, triangles: Indices) -> Array:
    """Return the lengths (e, 3), mm, of the edges opposite each vertex."""
    corner = points[triangles]
    side = np.roll(corner, -1, axis=1) - np.roll(corner, 1, axis=1)
    length: Array = np.hypot(side[..., 0], side[..., 1])
    return length


def triangle_angles(edge: Array) -> Array:
    """Return the angles (e, 3), rad, opposite edges of lengths (e, 3)."""
    after, before = np.roll(edge, -1, axis=1), np.roll(edge, 1, axis=1)
    cosine = (after**2 + before**2 - edge**2) / (2 * after * before)
    angles: Array = np.arccos(np.clip(cosine, -1.0, 1.0))
    return angles
