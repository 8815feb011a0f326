"""A run as artists on matplotlib axes: the deformed lips, teeth, face and neck in the world.

Drawing a frame means setting vertices and colours; nothing is created anew, so that a film of a
hundred frames takes seconds.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Curve
from matplotlib.transforms import Affine2D, Transform
from numpy.typing import NDArray

from geometry2d.rigid import RigidPlacement
from scenarios.results.increment import Integers, SectionModel
from scenarios.results.quantities import IN_NECK_FRAME, WITH_JAW
from scenarios.results.skin_line import SkinLine
from scenarios.results.solution import Snapshot
from scenarios.views.colours import (
    pressure_colours,
)
from scenarios.views.shown import Shown
from scenarios.views.themes import (
    BONE,
    BULK,
    HARD_EDGE,
    LIGHT,
    NECK,
    NECK_EDGE,
    SKIN_EDGE,
    TOOTH,
    Theme,
)

Array = NDArray[np.float64]

# Name of the outline, its colours (the package has its theme's), and where it lies in the stack.
RIGID_PARTS = (
    ("package", None, "none", 0),
    ("upper_jaw", BONE, HARD_EDGE, 1),
    ("lower_jaw", BONE, HARD_EDGE, 1),
    ("upper_tooth", TOOTH, HARD_EDGE, 2),
    ("lower_tooth", TOOTH, HARD_EDGE, 2),
    ("upper_wall", NECK, NECK_EDGE, 6),
    ("lower_wall", NECK, NECK_EDGE, 6),
)

FADED = 0.55
"""Opacity of a section that is laid over a recording."""

BAND_MM = 8.0
"""How far the highest pressure of the colours stands off the skin."""

# A T6 triangle as the polygon of its six nodes, in order around it.
AROUND = [0, 3, 1, 4, 2, 5]


def boundary_loops(triangles: Integers) -> list[Integers]:
    """Return the closed node loops around quadratic triangles (e, 6), middles included.

    Triangles may be numbered either way round. Where a region touches itself in a single node,
    loops are closed there in any order.
    """
    sides = triangles[:, [[0, 3, 1], [1, 4, 2], [2, 5, 0]]].reshape(-1, 3)
    _, at, times = np.unique(sides[:, 1], return_index=True, return_counts=True)
    sides_of: dict[int, list[tuple[int, int]]] = {}
    for first, middle, last in sides[np.sort(at[times == 1])].tolist():
        sides_of.setdefault(first, []).append((middle, last))
        sides_of.setdefault(last, []).append((middle, first))
    loops = []
    while any(sides_of.values()):
        corner = next(node for node, ways in sides_of.items() if ways)
        loop = []
        while sides_of[corner]:
            middle, following = sides_of[corner].pop()
            sides_of[following].remove((middle, corner))
            loop += [corner, middle]
            corner = following
        loops.append(np.array(loop))
    return loops


class SectionArtists:
    """The section of a run drawn on ``axes``, whose data are millimetres of the world.

    Parameters
    ----------
    axes
        where to draw; limits are the caller's.
    first
        any snapshot of the run: its undeformed section is drawn, and where contact is known.
    shown
        what tissue is coloured by, one of :data:`scenarios.views.shown.SHOWN`.
    limits
        how far the colours reach: of ``shown`` in its unit, and of the pressure in kPa.
    band_mm
        how far the highest pressure of the colours stands off the skin.
    theme
        colours of what lies under the section.
    """

    def __init__(
        self,
        axes: Axes,
        first: Snapshot,
        shown: Shown,
        limits: tuple[float, float],
        *,
        band_mm: float = BAND_MM,
        theme: Theme = LIGHT,
    ) -> None:
        model = first.model
        self._theme = theme
        self._axes = axes
        self._model = model
        self._shown = shown
        self._head = Affine2D()
        self._neck = Affine2D()
        self._in_head = self._head + axes.transData
        self._in_neck = self._neck + self._in_head
        self._jaw = Affine2D()
        self._in_jaw = self._jaw + self._in_head
        self.artists: list[Artist] = []
        self._add_rigid_parts()
        names = np.array(model.region_names)[model.region]
        self._tissue = shown.tissue(model)
        self._bulk_loops = _loops_by_region(model, names, "bulk")
        self._all_loops = _loops_by_region(model, names, "dermis") + self._bulk_loops
        self._skin = {
            lip: SkinLine(model, model.skin[lip], arc_mm) for lip, arc_mm in first.arc_mm.items()
        }
        self._bulk = _area([], BULK, "none")
        self._edges = _area([], "none", SKIN_EDGE, width=0.8)
        self._elements = PolyCollection(
            [],
            cmap=shown.colours,
            norm=shown.norm(limits[0]),
            edgecolors="face",
            linewidths=0.2,
        )
        self._pressure = LineCollection(
            [],
            cmap=pressure_colours(theme).with_extremes(under=(0, 0, 0, 0)),
            norm=Normalize(0.01 * limits[1], limits[1]),
            linewidths=4.5,
            capstyle="round",
        )
        self._mm_per_kpa = band_mm / limits[1]
        self._band = PolyCollection(
            [],
            cmap=self._pressure.get_cmap(),
            norm=self._pressure.norm,
            edgecolors="face",
            linewidths=0.4,
        )
        for artist, order in (
            (self._bulk, 3),
            (self._elements, 4),
            (self._edges, 5),
            (self._band, 7),
            (self._pressure, 8),
        ):
            self._add(artist, self._in_head, order)
        self.artists.sort(key=lambda artist: artist.get_zorder())

    @property
    def element_colours(self) -> PolyCollection:
        """What the colour bar of the dermis belongs to."""
        return self._elements

    @property
    def pressure_colours(self) -> LineCollection:
        """What the colour bar of the pressure belongs to."""
        return self._pressure

    def fade(self) -> None:
        """Let what lies below be seen."""
        for artist in self.artists:
            if artist not in (self._elements, self._band, self._pressure):
                artist.set_alpha(FADED)

    def show(self, snapshot: Snapshot, head: RigidPlacement) -> None:
        """Move everything to where it is in a snapshot, with the head at ``head`` in the world."""
        _set_placement(self._head, head)
        _set_placement(self._neck, snapshot.placement)
        _set_placement(self._jaw, snapshot.jaw)
        positions = self._model.nodes + snapshot.displacement
        self._bulk.set_path(_closed([positions[loop] for loop in self._bulk_loops]))
        self._edges.set_path(_closed([positions[loop] for loop in self._all_loops]))
        corners = self._model.triangles[self._tissue][:, AROUND]
        # An array is set many times faster than the list that the annotation asks for.
        self._elements.set_verts(cast(Any, positions[corners]))
        values = snapshot.element[self._shown.field][self._tissue]
        self._elements.set_array(self._shown.values(values))
        segments, pressures, bands = [], [], []
        for lip, line in self._skin.items():
            points, pressure = line.points(positions), 1e3 * snapshot.pressure_mpa[lip]
            between = (pressure[:-1] + pressure[1:]) / 2
            pressed = between > 0
            bands.append(line.band(points, self._mm_per_kpa * pressure)[pressed])
            segments.append(np.stack([points[:-1], points[1:]], axis=1)[pressed])
            pressures.append(between[pressed])
        self._pressure.set_segments(list(np.concatenate(segments)))
        self._pressure.set_array(np.concatenate(pressures))
        # An array is set many times faster than the list that the annotation asks for.
        self._band.set_verts(cast(Any, np.concatenate(bands)))
        self._band.set_array(np.concatenate(pressures))

    def _add_rigid_parts(self) -> None:
        outlines = self._model.outlines
        for name, face, edge, order in RIGID_PARTS:
            if name in outlines:
                transform = self._in_neck if name in IN_NECK_FRAME else self._in_head
                transform = self._in_jaw if name in WITH_JAW else transform
                fill = face or self._theme.package
                self._add(_area([outlines[name]], fill, edge), transform, order)
        for points in _outside(outlines.get("profile"), self._model):
            line = Line2D(*points.T, color=self._theme.quiet, lw=1.4, solid_capstyle="round")
            self._add(line, self._in_head, 1)

    def _add(self, artist: Artist, transform: Transform, order: int) -> None:
        artist.set_zorder(order)
        artist.set_transform(transform)
        self._axes.add_artist(artist)
        artist.set_clip_path(self._axes.patch)
        self.artists.append(artist)


def _set_placement(transform: Affine2D, place: RigidPlacement) -> None:
    transform.clear().rotate(place.angle_rad).translate(*place.shift_mm)


def _area(polygons: list[Array], face: str, edge: str, width: float = 1.0) -> PathPatch:
    return PathPatch(
        _closed(polygons), facecolor=face, edgecolor=edge, linewidth=width, joinstyle="round"
    )


def _closed(polygons: list[Array]) -> Curve:
    """Return one compound path of closed polygons."""
    paths = [Curve(np.vstack([points, points[:1]]), closed=True) for points in polygons]
    return Curve.make_compound_path(*paths)


def _loops_by_region(model: SectionModel, names: NDArray[np.str_], ending: str) -> list[Integers]:
    return [
        loop
        for name in model.region_names
        if name.endswith(ending) and (names == name).any()
        for loop in boundary_loops(model.triangles[names == name])
    ]


def _outside(profile: Array | None, model: SectionModel, distance_mm: float = 1.0) -> list[Array]:
    """Return the face's profile above and below the lips' skin, not the way across the mouth."""
    if profile is None:
        return []
    skin = np.vstack([model.nodes[edges].reshape(-1, 2) for edges in model.skin.values()])
    fine = _refined(profile, distance_mm / 2)
    away = np.array([np.hypot(*(skin - point).T).min() > distance_mm for point in fine])
    changes = np.flatnonzero(np.diff(away.astype(int))) + 1
    bounds = [0, *changes, len(fine)]
    ends = [(a, b) for a, b in pairwise(bounds) if away[a] and (a == 0 or b == len(fine))]
    return [fine[a:b] for a, b in ends]


def _refined(line: Array, spacing_mm: float) -> Array:
    """Return a polyline (n, 2) with points no farther apart than ``spacing_mm``."""
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    fine = np.linspace(0.0, arc[-1], int(np.ceil(arc[-1] / spacing_mm)) + 1)
    return np.column_stack([np.interp(fine, arc, line[:, axis]) for axis in (0, 1)])
