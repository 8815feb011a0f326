"""Graded triangle meshes of regions, with named parts.

The curves of a section are divided by the size field. A constrained Delaunay triangulation of each
region conforms to them, and Mmg refines its interior. Mmg keeps the curves: neighbouring regions
match, and the boundary is exactly the given one. All steps are deterministic: the same input gives
the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import skfem
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from geometry2d.curves import graded
from geometry2d.foundation.settings import check_ranges, setting
from geometry2d.meshing import MeshError, MeshParts, SizeField, meshed
from geometry2d.regions import Section

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class MeshSize:
    """Edge lengths of a section's mesh.

    Parameters
    ----------
    contact_mm
        Edge length at the section's focus, where a package touches, mm.
    layer_mm
        Largest edge length along the dermis, mm.
    far_mm
        Largest edge length anywhere, mm.
    gradation
        Growth of the edge length per mm of distance from the focus.
    neck_reach_mm
        The focus is that part of the lips which a neck comes so near to on its path, mm; None for
        all of the lip's margin. Who knows the path narrows the section's focus.
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
    neck_reach_mm: float | None = setting(
        default=None,
        unit="mm",
        above=0.0,
        description="the mesh is finest only where the neck comes so near to the lips at rest; "
        "without it, all along the lip's margin",
    )

    def __post_init__(self) -> None:
        check_ranges(self, MeshError)
        if not self.contact_mm <= self.layer_mm <= self.far_mm:
            raise MeshError(
                f"contact_mm = {self.contact_mm:g} mm, layer_mm = {self.layer_mm:g} mm and "
                f"far_mm = {self.far_mm:g} mm: none may be smaller than the one before"
            )

    def scaled(self, factor: float) -> MeshSize:
        """Return the same grading with all lengths multiplied by ``factor``."""
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
    """Return one straight-sided triangle mesh of all sections, with named parts.

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
        Polygon (n, 2), mm, counter-clockwise, of each subdomain. A side that two regions share has
        the same two end points in both.
    size
        Edge length, mm, or a field of it.
    boundaries
        For each boundary name, a function that selects midpoints (m, 2), mm, of boundary edges.

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
    parts = meshed(pieces, {f"side_{k}": side for k, side in enumerate(sides.values())}, field)
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
        Numbers of elements along x and y. Element edges follow the borders of the layers.
    layers
        Thickness of each layer as a fraction of the height, from the top down; the rest is the
        subdomain ``below``.

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


def _section_parts(section: Section, size: MeshSize) -> MeshParts:
    field = _section_field(section, size)
    curves = {name: graded(points, field) for name, points in section.curves.items()}
    pieces = {
        region: np.concatenate(
            [(curves[c] if forwards else curves[c][::-1])[:-1] for c, forwards in loop]
        )
        for region, loop in section.loops.items()
    }
    parts = meshed(pieces, curves, field)
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


def _joined(parts: Sequence[MeshParts]) -> skfem.MeshTri:
    """Return all parts as one mesh with named regions and edges."""
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
    """Return integers that add up to ``total``, in proportion to ``fractions``, at least one."""
    counts = np.maximum(1, np.rint(fractions * total).astype(np.int64))
    while counts.sum() != total:
        excess = counts / fractions
        if counts.sum() > total:
            counts[np.argmax(np.where(counts > 1, excess, -np.inf))] -= 1
        else:
            counts[np.argmin(excess)] += 1
    return counts
