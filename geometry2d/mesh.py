"""Regions turned into graded meshes with named parts, and what those meshes are worth.

The curves of a section are first divided as the size field asks; a constrained Delaunay
triangulation of each region then conforms to them, and Mmg refines its inside. Mmg is told to leave
the curves alone, so neighbouring regions match and the boundary is exactly the one given.
Everything here is deterministic: the same input gives the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import mmgpy
import numpy as np
import shapely
import skfem
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from geometry2d.curves import graded
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import check_ranges, setting
from geometry2d.regions import Section

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
SizeField = Callable[[Array], Array]
"""Takes points (n, 2), gives the wished edge length (n,) there, mm."""

REMESHING_PASSES = 4
"""Each pass sees the size field at the nodes of the one before; after four nothing changes."""

RELAXATION_SWEEPS = 12
POOR_ANGLE_RAD = float(np.deg2rad(36.0))
RELAXATION_STEPS = np.array(
    [[1, 0], [0.5, 0], [0.2, 0], [-0.2, 0], [0.3, 0.3], [0.3, -0.3], [0, 0.2], [0, -0.2]], float
)
"""Trial moves of a node, along and across the way to the middle of its neighbours."""


class MeshError(DrinksimError):
    """The mesh asked for cannot be made."""


@dataclass(frozen=True)
class MeshSize:
    """How fine a section's mesh is, in mm.

    Parameters
    ----------
    contact_mm
        Edge length at the section's focus, where a package touches.
    layer_mm
        Largest edge length along the dermis.
    far_mm
        Largest edge length anywhere.
    gradation
        Growth of the edge length per mm of distance from the focus.
    """

    contact_mm: float = setting(
        unit="mm", above=0.0, description="edge length at the lip's margin, where a package touches"
    )
    layer_mm: float = setting(
        unit="mm", above=0.0, description="largest edge length along the dermis"
    )
    far_mm: float = setting(unit="mm", above=0.0, description="largest edge length anywhere")
    gradation: float = setting(
        default=0.25,
        unit="mm/mm",
        above=0.0,
        description="growth of the edge length per mm of distance from the margin",
    )

    def __post_init__(self) -> None:
        check_ranges(self, MeshError)
        if not self.contact_mm <= self.layer_mm <= self.far_mm:
            raise MeshError(
                f"contact_mm = {self.contact_mm:g} mm, layer_mm = {self.layer_mm:g} mm and "
                f"far_mm = {self.far_mm:g} mm: they must grow, or be equal"
            )

    def scaled(self, factor: float) -> MeshSize:
        """Return the same grading with every length times ``factor``."""
        return replace(
            self,
            contact_mm=factor * self.contact_mm,
            layer_mm=factor * self.layer_mm,
            far_mm=factor * self.far_mm,
        )


LEVELS: Mapping[str, MeshSize] = {
    "coarse": MeshSize(0.40, 1.1, 5.0, 0.80),
    "standard": MeshSize(0.22, 0.85, 4.0, 0.64),
    "fine": MeshSize(0.11, 0.58, 3.0, 0.50),
    "thesis": MeshSize(0.08, 0.4, 2.0, 0.34),
}
"""About 1,500, 2,900, 5,900 and 10,000 triangles in both lips; as quadratic triangles the last has
the nodes of 20,000 four-node elements. Contact varies along the skin over tenths of a millimetre
and dies away over its own width, so edges start short and grow fast (docs/theory/contact.md)."""


def section_mesh(sections: Sequence[Section], size: MeshSize) -> skfem.MeshTri:
    """Return one straight-sided triangle mesh of all sections, with their parts named.

    Parameters
    ----------
    sections
        Sections that do not touch one another; their names must differ.
    size
        Edge lengths.

    Returns
    -------
    skfem.MeshTri
        Subdomains "NAME_REGION" and boundaries "NAME_BOUNDARY", such as "upper_dermis" and
        "upper_skin"; the interface of two regions is the boundary "NAME_interface" where the
        section has a curve of that name.

    Raises
    ------
    MeshError
        If two sections share a name, or a region cannot be meshed.
    """
    names = [section.name for section in sections]
    if len(set(names)) < len(names):
        raise MeshError(f"sections {names} must have different names")
    return _joined([_section_parts(section, size) for section in sections])


def polygon_mesh(
    regions: Mapping[str, ArrayLike],
    size: float | SizeField,
    *,
    boundaries: Mapping[str, Callable[[Array], NDArray[np.bool_]]] | None = None,
) -> skfem.MeshTri:
    """Return a triangle mesh of polygons that may share whole sides.

    Parameters
    ----------
    regions
        Polygon (n, 2), mm, counter-clockwise, for each subdomain. A side that two regions share
        must have the same two end points in both.
    size
        Edge length, mm, or a field of it.
    boundaries
        For each boundary name a test of the midpoints (m, 2) of boundary edges.

    Raises
    ------
    MeshError
        If a polygon is not simple.
    """
    field = size if callable(size) else _constant_field(size)
    sides: dict[tuple[tuple[float, ...], tuple[float, ...]], Array] = {}
    pieces: dict[str, Array] = {}
    for name, polygon in regions.items():
        corner = np.asarray(polygon, float)
        ring = []
        for a, b in zip(corner, np.roll(corner, -1, axis=0), strict=True):
            ends = tuple(sorted((tuple(a.tolist()), tuple(b.tolist()))))
            key = (ends[0], ends[1])
            if key not in sides:
                sides[key] = graded(np.array(key), field)
            forwards = key[0] == tuple(a.tolist())
            ring.append(sides[key][:-1] if forwards else sides[key][:0:-1])
        pieces[name] = np.concatenate(ring)
    parts = _meshed(pieces, {f"side_{k}": side for k, side in enumerate(sides.values())}, field)
    mesh = _joined([replace(parts, boundaries={})])
    if boundaries is None:
        return mesh
    outer = mesh.boundary_facets()
    middle = mesh.p[:, mesh.facets[:, outer]].mean(axis=1).T
    return mesh.with_boundaries({name: outer[test(middle)] for name, test in boundaries.items()})


def block_mesh(
    width: float,
    height: float,
    nx: int,
    ny: int,
    *,
    layers: Mapping[str, float] | None = None,
    below: str = "bulk",
) -> skfem.MeshQuad:
    """Return a block [0, width] × [0, height] of equal four-node elements, its top sides in layers.

    Parameters
    ----------
    width, height
        Sides, mm.
    nx, ny
        Elements along x and y. Element borders are moved to the borders of the layers.
    layers
        Thickness of each layer as a fraction of the height, from the top down; what is left is
        the subdomain ``below``.

    Returns
    -------
    skfem.MeshQuad
        Boundaries "left", "right", "bottom" and "top", a subdomain for each layer and ``below``.

    Raises
    ------
    MeshError
        If sizes are not positive, fractions add up to one or more, or ``ny`` is too small.
    """
    layers = dict(layers or {})
    if width <= 0 or height <= 0 or nx < 1 or ny < 1 + len(layers):
        raise MeshError(
            f"a block of {width} by {height} mm with {nx} by {ny} elements and {len(layers)} "
            "layers: give positive sides and at least one element a layer"
        )
    rest = 1.0 - sum(layers.values())
    if rest <= 0 or any(fraction <= 0 for fraction in layers.values()):
        raise MeshError(f"layer fractions {layers} must be positive and leave something below")
    names = [below, *reversed(layers)]
    fractions = np.array([rest, *reversed(layers.values())])
    counts = _shared_out(fractions, ny)
    levels = [np.zeros(1)]
    for fraction, count in zip(fractions, counts, strict=True):
        levels.append(levels[-1][-1] + fraction * np.arange(1, count + 1) / count)
    y = height * np.concatenate(levels)
    y[-1] = height
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0.0, width, nx + 1), y)
    middle = mesh.p[:, mesh.t].mean(axis=1)[1]
    row = np.searchsorted(y, middle) - 1
    first = np.concatenate([[0], np.cumsum(counts)])
    facet = mesh.p[:, mesh.facets].mean(axis=1)
    tiny = 1e-9 * max(width, height)
    return mesh.with_subdomains(
        {
            name: np.flatnonzero((row >= first[k]) & (row < first[k + 1]))
            for k, name in enumerate(names)
        }
    ).with_boundaries(
        {
            "left": np.flatnonzero(facet[0] < tiny),
            "right": np.flatnonzero(facet[0] > width - tiny),
            "bottom": np.flatnonzero(facet[1] < tiny),
            "top": np.flatnonzero(facet[1] > height - tiny),
        }
    )


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
    edge = _edge_lengths(mesh.p.T, mesh.t.T)
    angle = np.rad2deg(_angles(edge))
    a, b, c = edge.T
    radius_ratio = (b + c - a) * (c + a - b) * (a + b - c) / (a * b * c)
    return MeshQuality(
        smallest_angle_deg=float(angle.min()),
        largest_angle_deg=float(angle.max()),
        worst_radius_ratio=float(radius_ratio.min()),
        worst_aspect=float((edge.max(axis=1) / edge.min(axis=1)).max()),
    )


def _edge_lengths(points: Array, triangles: Indices) -> Array:
    """Lengths (e, 3) of the edges opposite each vertex."""
    corner = points[triangles]
    side = np.roll(corner, -1, axis=1) - np.roll(corner, 1, axis=1)
    length: Array = np.hypot(side[..., 0], side[..., 1])
    return length


def _angles(edge: Array) -> Array:
    after, before = np.roll(edge, -1, axis=1), np.roll(edge, 1, axis=1)
    cosine = (after**2 + before**2 - edge**2) / (2 * after * before)
    angles: Array = np.arccos(np.clip(cosine, -1.0, 1.0))
    return angles


@dataclass(frozen=True)
class _Parts:
    """Points (n, 2), triangles (e, 3), region numbers (e,) and edges (k, 2) by curve."""

    points: Array
    triangles: Indices
    region: Indices
    region_names: tuple[str, ...]
    boundaries: Mapping[str, Indices]


def _section_parts(section: Section, size: MeshSize) -> _Parts:
    field = _section_field(section, size)
    curves = {name: graded(points, field) for name, points in section.curves.items()}
    pieces = {
        region: np.concatenate(
            [(curves[c] if forwards else curves[c][::-1])[:-1] for c, forwards in loop]
        )
        for region, loop in section.loops.items()
    }
    parts = _meshed(pieces, curves, field)
    names = {**section.boundary_curves}
    if "interface" in curves:
        names["interface"] = ("interface",)
    return replace(
        parts,
        region_names=tuple(f"{section.name}_{region}" for region in parts.region_names),
        boundaries={
            f"{section.name}_{name}": np.concatenate([parts.boundaries[c] for c in members])
            for name, members in names.items()
        },
    )


def _section_field(section: Section, size: MeshSize) -> SizeField:
    along = [section.curves[name] for name in section.layer_curves]
    layer = cKDTree(np.concatenate(along)) if along else None
    focus = cKDTree(section.focus) if len(section.focus) else None

    def field(points: Array) -> Array:
        wished = np.full(len(points), float(size.far_mm))
        for tree, smallest in ((layer, size.layer_mm), (focus, size.contact_mm)):
            if tree is not None:
                np.minimum(wished, smallest + size.gradation * tree.query(points)[0], out=wished)
        return wished

    return field


def _constant_field(size_mm: float) -> SizeField:
    if not size_mm > 0:
        raise MeshError(f"edge length {size_mm} mm: it must be greater than zero")
    return lambda points: np.full(len(points), float(size_mm))


def _meshed(pieces: Mapping[str, Array], curves: Mapping[str, Array], field: SizeField) -> _Parts:
    """Triangulate polygons along curves already divided, then refine their inside."""
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
    for _ in range(REMESHING_PASSES):
        wished = field(mesh.get_vertices())
        mesh.set_field("metric", wished[:, None])
        mesh.remesh(verbose=-1, nosurf=1, hgrad=-1, hmin=0.3 * wished.min(), hmax=3 * wished.max())
    parts = _from_mmg(mesh, tuple(pieces), tuple(curves), len(pairs))
    return replace(parts, points=_relaxed(parts))


def _from_mmg(
    mesh: mmgpy.MmgMesh2D, regions: tuple[str, ...], curves: tuple[str, ...], edge_count: int
) -> _Parts:
    points = np.array(mesh.get_vertices(), float)
    triangles, region = (np.array(a, np.int64) for a in mesh.get_triangles_with_refs())
    edges, label = (np.array(a, np.int64) for a in mesh.get_edges_with_refs())
    kept = label > 0
    if int(kept.sum()) != edge_count:
        raise MeshError(
            f"the mesher changed the boundary ({int(kept.sum())} edges instead of {edge_count}): "
            "use a smaller edge length"
        )
    return _Parts(
        points=points,
        triangles=_counter_clockwise(points, triangles),
        region=region - 1,
        region_names=regions,
        boundaries={name: edges[label == k + 1] for k, name in enumerate(curves)},
    )


def _relaxed(parts: _Parts) -> Array:
    """Move nodes off the curves, one at a time, where that opens the smallest angle around them."""
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
        smallest = _angles(_edge_lengths(points, parts.triangles)).min(axis=1)
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
    """Smallest angle (k,) of k rings of triangles (k, e, 3, 2); negative if one is turned over."""
    ahead = np.roll(corners, -1, axis=2) - corners
    back = np.roll(corners, 1, axis=2) - corners
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    angle: Array = np.arctan2(cross, np.sum(ahead * back, axis=-1)).min(axis=(1, 2))
    return angle


def _counter_clockwise(points: Array, triangles: Indices) -> Indices:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    clockwise = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    return np.where(clockwise[:, None], triangles[:, ::-1], triangles)


def _joined(parts: Sequence[_Parts]) -> skfem.MeshTri:
    """Return all parts as one mesh with their regions and edges named."""
    node_shift = np.concatenate([[0], np.cumsum([len(p.points) for p in parts])])
    element_shift = np.concatenate([[0], np.cumsum([len(p.triangles) for p in parts])])
    mesh = skfem.MeshTri(
        np.ascontiguousarray(np.concatenate([p.points for p in parts]).T),
        np.ascontiguousarray(
            np.concatenate([p.triangles + s for p, s in zip(parts, node_shift, strict=False)]).T
        ),
    )
    facet = {(int(a), int(b)): k for k, (a, b) in enumerate(mesh.facets.T)}
    boundaries = {
        name: np.unique([facet[int(a), int(b)] for a, b in np.sort(edges + shift, axis=1)])
        for part, shift in zip(parts, node_shift, strict=False)
        for name, edges in part.boundaries.items()
    }
    subdomains = {
        name: shift + np.flatnonzero(part.region == k)
        for part, shift in zip(parts, element_shift, strict=False)
        for k, name in enumerate(part.region_names)
    }
    return mesh.with_subdomains(subdomains).with_boundaries(boundaries)


def _shared_out(fractions: Array, total: int) -> Indices:
    """Share ``total`` out in proportion to ``fractions``, at least one each."""
    counts = np.maximum(1, np.rint(fractions * total).astype(np.int64))
    while counts.sum() != total:
        excess = counts / fractions
        if counts.sum() > total:
            counts[np.argmax(np.where(counts > 1, excess, -np.inf))] -= 1
        else:
            counts[np.argmin(excess)] += 1
    return counts
