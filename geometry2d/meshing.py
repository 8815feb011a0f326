"""Triangulation of polygons along divided curves, refined by Mmg and relaxed.

A constrained Delaunay triangulation of each polygon conforms to its curves, and Mmg refines its
interior. Mmg keeps the curves: neighbouring regions match, and the boundary is exactly the given
one. All steps are deterministic: the same input gives the same bits.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace

import mmgpy
import numpy as np
import shapely
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.mesh_quality import edge_lengths, triangle_angles

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
SizeField = Callable[[Array], Array]
"""Maps points (n, 2), mm, to the edge length (n,) there, mm."""

OF_MMG = (signal.SIGINT, signal.SIGTERM, signal.SIGABRT, signal.SIGFPE, signal.SIGILL)
"""Signals whose handlers Mmg replaces without Python's knowledge."""

REMESHING_PASSES = 4
"""Each pass takes the size field at the nodes of the previous one; four passes converge."""

RELAXATION_SWEEPS = 12
POOR_ANGLE_RAD = float(np.deg2rad(36.0))
RELAXATION_STEPS = np.array(
    [[1, 0], [0.5, 0], [0.2, 0], [-0.2, 0], [0.3, 0.3], [0.3, -0.3], [0, 0.2], [0, -0.2]], float
)
"""Trial steps of a node, along and across the vector to the mean of its neighbours."""


class MeshError(DrinksimError):
    """Regions or sizes that give no mesh."""


@dataclass(frozen=True)
class MeshParts:
    """Points (n, 2), triangles (e, 3), region numbers (e,) and edges (k, 2) by curve."""

    points: Array
    triangles: Indices
    region: Indices
    region_names: tuple[str, ...]
    boundaries: Mapping[str, Indices]


def meshed(pieces: Mapping[str, Array], curves: Mapping[str, Array], field: SizeField) -> MeshParts:
    """Return a triangulation of polygons along divided curves, with its interior refined."""
    points = np.unique(np.concatenate(list(curves.values())), axis=0)
    number = {tuple(p): k for k, p in enumerate(points.tolist())}

    def numbers(some: Array) -> Indices:
        return np.array([number[tuple(p)] for p in some.tolist()], dtype=np.int64)

    triangles: list[Indices] = []
    region: list[Indices] = []
    for k, (name, ring) in enumerate(pieces.items()):
        polygon = shapely.Polygon(ring)
        if not polygon.is_valid:
            raise MeshError(
                f"region {name!r} crosses itself once divided into edges "
                f"({shapely.is_valid_reason(polygon)}): use a smaller edge length there"
            )
        cut = shapely.constrained_delaunay_triangles(polygon).geoms
        corners = np.array([shapely.get_coordinates(t)[:3] for t in cut])
        triangles.append(_counter_clockwise(points, numbers(corners.reshape(-1, 2)).reshape(-1, 3)))
        region.append(np.full(len(corners), k + 1))
    edges = {name: numbers(curve) for name, curve in curves.items()}
    mesh = mmgpy.MmgMesh2D()
    pairs = np.concatenate([np.column_stack([e[:-1], e[1:]]) for e in edges.values()])
    labels = np.concatenate([np.full(len(e) - 1, k + 1) for k, e in enumerate(edges.values())])
    all_triangles = np.concatenate(triangles)
    mesh.set_mesh_size(vertices=len(points), triangles=len(all_triangles), edges=len(pairs))
    mesh.set_vertices(points)
    mesh.set_triangles(all_triangles.astype(np.int32), np.concatenate(region).astype(np.int64))
    mesh.set_edges(pairs.astype(np.int32), labels.astype(np.int64))
    mesh.set_required_edges(np.arange(len(pairs), dtype=np.int32))
    with _signal_handlers_kept():
        for _ in range(REMESHING_PASSES):
            wished = field(mesh.get_vertices())
            mesh.set_field("metric", wished[:, None])
            sizes = {"hmin": 0.3 * wished.min(), "hmax": 3 * wished.max()}
            mesh.remesh(verbose=-1, nosurf=1, hgrad=-1, **sizes)
    parts = _from_mmg(mesh, tuple(pieces), tuple(curves), len(pairs))
    return replace(parts, points=_relaxed(parts))


@contextmanager
def _signal_handlers_kept() -> Iterator[None]:
    """Put Python's handlers back after the block: Mmg replaces them, and Ctrl-C would kill.

    Only the main thread can; signals reach no other one.
    """
    try:
        yield
    finally:
        if threading.current_thread() is threading.main_thread():
            for number in OF_MMG:
                handler = signal.getsignal(number)
                if handler is not None:
                    signal.signal(number, handler)


def _from_mmg(
    mesh: mmgpy.MmgMesh2D, regions: tuple[str, ...], curves: tuple[str, ...], edge_count: int
) -> MeshParts:
    points = np.array(mesh.get_vertices(), float)
    triangles, region = (np.array(a, np.int64) for a in mesh.get_triangles_with_refs())
    edges, label = (np.array(a, np.int64) for a in mesh.get_edges_with_refs())
    kept = label > 0
    if int(kept.sum()) != edge_count:
        raise MeshError(
            f"the mesher changed the boundary ({int(kept.sum())} edges instead of {edge_count}): "
            "use a smaller edge length"
        )
    return MeshParts(
        points=points,
        triangles=_counter_clockwise(points, triangles),
        region=region - 1,
        region_names=regions,
        boundaries={name: edges[label == k + 1] for k, name in enumerate(curves)},
    )


def _relaxed(parts: MeshParts) -> Array:
    """Return the points after moving interior nodes, one at a time, to larger smallest angles."""
    points = parts.points.copy()
    fixed = np.zeros(len(points), bool)
    for edges in parts.boundaries.values():
        fixed[edges.ravel()] = True
    around: list[list[int]] = [[] for _ in range(len(points))]
    for element, nodes in enumerate(parts.triangles):
        for node in nodes:
            around[node].append(element)
    for _ in range(RELAXATION_SWEEPS):
        worst = np.full(len(points), np.inf)
        smallest = triangle_angles(edge_lengths(points, parts.triangles)).min(axis=1)
        np.minimum.at(worst, parts.triangles.ravel(), np.repeat(smallest, 3))
        poor = np.flatnonzero(~fixed & (worst < POOR_ANGLE_RAD))
        for node in poor:
            ring = parts.triangles[around[node]]
            neighbours = np.unique(ring[ring != node])
            aim = points[neighbours].mean(axis=0) - points[node]
            steps = RELAXATION_STEPS @ np.array([aim, [-aim[1], aim[0]]])
            corners = np.repeat(points[ring][None], len(steps) + 1, axis=0)
            corners[1:][:, ring == node] += steps[:, None]
            angle = _smallest_oriented_angle(corners)
            best = int(np.argmax(angle))
            points[node] += 0.0 if best == 0 else steps[best - 1]
    return points


def _smallest_oriented_angle(corners: Array) -> Array:
    """Return the smallest angle (k,) of k rings of triangles (k, e, 3, 2); negative if inverted."""
    ahead = np.roll(corners, -1, axis=2) - corners
    back = np.roll(corners, 1, axis=2) - corners
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    angle: Array = np.arctan2(cross, np.sum(ahead * back, axis=-1)).min(axis=(1, 2))
    return angle


def _counter_clockwise(points: Array, triangles: Indices) -> Indices:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    clockwise = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    return np.where(clockwise[:, None], triangles[:, ::-1], triangles)
