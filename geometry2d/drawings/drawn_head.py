"""A head from a drawing, or from cuts through surfaces, in place of the measured one.

Each lip is drawn as three connected open curves: ``upper_bone`` where tissue is tied to bone,
``upper_inner`` where it is free in front of the teeth, and ``upper_skin`` from the end of the
dermis inside the mouth to the cut of the section; likewise ``lower_...``. A straight cut joins the
ends of skin and bone. ``upper_tooth`` and ``lower_tooth`` are closed curves; ``ear_mark`` and
``nose_mark`` are circles at the marks of the recording. The head faces right, its jaw is open as
just before contact, and it may lie anywhere on the sheet.

Four more open curves are optional: ``upper_interface`` and ``lower_interface`` are the inner side
of the dermis, which is otherwise an offset of the skin; ``forehead`` and ``throat`` continue the
profile beyond the skin, for pictures only. The mesh is finest around the edge of each lip: the
upper lip's lowest point and the lower lip's highest one, or circles ``upper_edge_mark`` and
``lower_edge_mark``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry2d.anatomy.head import HeadSection
from geometry2d.anatomy.lip_section import lip_section
from geometry2d.anatomy.lips import POLYLINE_SPACING_MM
from geometry2d.curves import arc_lengths, at_arc_lengths, left_normals, nearest_arc_length
from geometry2d.drawings.chains import Chain, DrawingError
from geometry2d.drawings.cut_lips import LIP_CURVES
from geometry2d.drawings.drawing_file import drawn_chains, naming
from geometry2d.drawings.joined import JOIN_MM, NamedOutline, centre_of, closed_outlines, open_curve
from geometry2d.outline import Outline
from geometry2d.regions import RegionError, Section

Array = NDArray[np.float64]

LIPS = ("upper", "lower")
OPEN = tuple(f"{lip}_{curve}" for lip in LIPS for curve in LIP_CURVES)
OPTIONAL = ("upper_interface", "lower_interface", "forehead", "throat")
TEETH = tuple(f"{lip}_tooth" for lip in LIPS)
MARKS = ("ear_mark", "nose_mark")
EDGE_MARKS = tuple(f"{lip}_edge_mark" for lip in LIPS)
JAW_MM = 6.0
"""Thickness of the bone behind a drawn lip in pictures, mm; the model has its surface only."""


@dataclass(frozen=True)
class HeadDrawing:
    """Curves of a drawing of a head, mm, y up, anywhere on the sheet.

    Parameters
    ----------
    curves
        Open polylines (n, 2) by name, in either direction: all of `OPEN`, and any of `OPTIONAL`.
    teeth
        Rigid outlines by name: both of `TEETH`.
    marks
        Points (2,) by name: both of `MARKS`, and any of `EDGE_MARKS`.
    """

    curves: Mapping[str, Array]
    teeth: Mapping[str, Outline]
    marks: Mapping[str, ArrayLike]

    @classmethod
    def read(cls, file: Path, *, unit_mm: float | None = None) -> HeadDrawing:
        """Return the drawing in an SVG or DXF file; other curves in it are ignored.

        Raises
        ------
        DrawingError
            If the file cannot be read, or a curve is missing, in parts, or wrongly open or closed.
        """
        names = (*OPEN, *OPTIONAL, *TEETH, *MARKS, *EDGE_MARKS)
        chains: dict[str, list[Chain]] = {name: [] for name in names}
        for chain in drawn_chains(file, unit_mm=unit_mm, names=chains):
            chains[chain.name.lower()].append(chain)
        missing = [name for name in (*OPEN, *TEETH, *MARKS) if not chains[name]]
        if missing:
            raise DrawingError(
                f"{file.name} has nothing named {', '.join(missing)} (id or label in SVG, layer in "
                "DXF): a head needs " + ", ".join((*OPEN, *TEETH, *MARKS))
            )
        return cls(
            curves={
                name: open_curve(name, chains[name]).sampled(POLYLINE_SPACING_MM)
                for name in (*OPEN, *OPTIONAL)
                if chains[name]
            },
            teeth={name: _only_closed(name, chains[name]) for name in TEETH},
            marks={
                name: centre_of(_only_closed(name, chains[name]))
                for name in (*MARKS, *EDGE_MARKS)
                if chains[name]
            },
        )

    @classmethod
    def of(cls, head: HeadSection) -> HeadDrawing:
        """Return a head as a drawing, for editing or comparison."""
        sections = {"upper": head.upper, "lower": head.lower}
        skin_ends = head.upper.curves["skin"][-1], head.lower.curves["skin"][0]
        cut = [int(np.argmin(np.hypot(*(head.profile - end).T))) for end in skin_ends]
        return cls(
            curves={
                f"{lip}_{curve}": section.curves[curve]
                for lip, section in sections.items()
                for curve in (*LIP_CURVES, "interface")
            }
            | {"forehead": head.profile[: cut[0] + 1], "throat": head.profile[cut[1] :]},
            teeth={"upper_tooth": head.upper_tooth, "lower_tooth": head.lower_tooth},
            marks={
                "ear_mark": head.landmarks["ear"],
                "nose_mark": head.landmarks["nose"],
                "upper_edge_mark": head.landmarks["stomion_upper"],
                "lower_edge_mark": head.landmarks["stomion_lower"],
            },
        )

    @property
    def ear(self) -> Array:
        """The ear mark (2,), origin of the head section."""
        return np.asarray(self.marks["ear_mark"], float)

    def head(self, *, dermis_mm: float, tie_fade_mm: float) -> HeadSection:
        """Return the head section with the ear mark at its origin.

        Parameters
        ----------
        dermis_mm
            Thickness of the dermis where its inner side is not drawn, mm.
        tie_fade_mm
            Arc length along the bone over which the tie fades in, mm.

        Raises
        ------
        DrawingError
            If the curves of a lip are not connected, cross, or leave no room for the dermis; if the
            head faces left, or its lips or a lip and its tooth overlap.
        """
        nose = np.asarray(self.marks["nose_mark"], float) - self.ear
        if nose[0] <= 0:
            raise DrawingError(
                "nose_mark lies left of ear_mark: mirror the drawing so that the head looks right"
            )
        lips = {lip: self._lip(lip, dermis_mm) for lip in LIPS}
        teeth = {name: tooth.moved(0.0, -self.ear) for name, tooth in self.teeth.items()}
        _refuse_overlap(lips, teeth)
        upper, lower = (section.curves for section in lips.values())
        edge = {lip: self._edge(lip, section.curves["skin"]) for lip, section in lips.items()}
        above, nose_side = _parted(upper["skin"], edge["upper"])
        chin_side, below = _parted(lower["skin"], edge["lower"])
        return HeadSection(
            upper=lips["upper"],
            lower=lips["lower"],
            upper_tooth=teeth["upper_tooth"],
            lower_tooth=teeth["lower_tooth"],
            upper_jaw=_strip(upper["bone"]),
            lower_jaw=_strip(lower["bone"]),
            mouth=np.concatenate(
                [above[::-1], upper["inner"][::-1], lower["inner"][::-1], below[::-1]]
            ),
            profile=np.concatenate(
                [
                    self._away_from(upper["skin"][-1], "forehead")[:0:-1],
                    nose_side[::-1],
                    chin_side[::-1],
                    self._away_from(lower["skin"][0], "throat")[1:],
                ]
            ),
            landmarks={
                "ear": np.zeros(2),
                "nose": nose,
                "stomion_upper": above[-1],
                "stomion_lower": below[0],
            },
            tie_fade_mm=tie_fade_mm,
        )

    def svg(self) -> str:
        """Return the drawing as SVG, with user units of 1 mm and numbers to 1e-9 mm."""
        paths = {name: _polyline(points) for name, points in self.curves.items()}
        paths |= {name: _arcs(tooth) for name, tooth in self.teeth.items()}
        marks = {name: np.asarray(point, float) for name, point in self.marks.items()}
        everything = np.concatenate([*self.curves.values(), np.array([*marks.values()])])
        left, top = np.floor(everything[:, 0].min()) - 10, np.ceil(everything[:, 1].max()) + 10
        width = np.ceil(everything[:, 0].max()) + 10 - left
        height = top - np.floor(everything[:, 1].min()) + 10
        lines = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm" '
            f'viewBox="{left:g} {-top:g} {width:g} {height:g}">',
            '<g fill="none" stroke="black" stroke-width="0.2">',
            *(f'<path id="{name}" d="{data}"/>' for name, data in paths.items()),
            *(
                f'<circle id="{name}" cx="{x:.9f}" cy="{-y:.9f}" r="1"/>'
                for name, (x, y) in marks.items()
            ),
            "</g>",
            "</svg>",
        ]
        return "\n".join(lines) + "\n"

    def _lip(self, lip: str, dermis_mm: float) -> Section:
        skin, inner, bone = self._in_order(lip)
        if f"{lip}_interface" in self.curves:
            interface = self._away_from(skin[0], f"{lip}_interface")
        else:
            interface = skin + dermis_mm * left_normals(skin)
        try:
            return lip_section(
                lip,
                skin=skin,
                interface=interface,
                inner=inner,
                bone=bone,
                margin=self._edge(lip, skin),
            )
        except RegionError as error:
            remedy = (
                f"the dermis there is {dermis_mm:g} mm thick: draw {lip}_skin rounder, make the "
                f"dermis thinner, or draw {lip}_interface"
                if "'dermis'" in str(error)
                else f"do {lip}_bone, {lip}_inner and the straight cut stay behind the skin?"
            )
            raise DrawingError(f"{error}; {remedy}") from error

    def _edge(self, lip: str, skin: Array) -> float:
        """Return the arc length, mm, of the edge of a lip on its skin (n, 2)."""
        if f"{lip}_edge_mark" in self.marks:
            mark = np.asarray(self.marks[f"{lip}_edge_mark"], float)
            return nearest_arc_length(skin, mark - self.ear)
        extreme = np.argmin(skin[:, 1]) if lip == "upper" else np.argmax(skin[:, 1])
        return float(arc_lengths(skin)[extreme])

    def _away_from(self, point: Array, name: str) -> Array:
        """Return an optional curve from its end nearer to ``point`` (2,), empty if not drawn."""
        if name not in self.curves:
            return np.zeros((0, 2))
        curve = self.curves[name] - self.ear
        first, last = np.hypot(*(curve[[0, -1]] - point).T)
        return curve if first <= last else curve[::-1]

    def _in_order(self, lip: str) -> tuple[Array, Array, Array]:
        """Return skin, inner side and bone of a lip, connected, with the tissue on their left."""
        names = [f"{lip}_{curve}" for curve in LIP_CURVES]
        skin, inner, bone = (self.curves[name] - self.ear for name in names)
        inner = _from_end_nearest(inner, names[1], skin, names[0])
        bone = _from_end_nearest(bone, names[2], inner[-1:], names[1])
        skin = skin if np.hypot(*(skin[-1] - inner[0])) <= JOIN_MM else skin[::-1]
        inner = np.concatenate([skin[-1:], inner[1:-1], bone[:1]])
        loop = np.concatenate([skin, inner[1:], bone[1:]])
        # In this order the lower lip runs counter-clockwise, the upper one clockwise.
        if shapely.LinearRing(loop).is_ccw != (lip == "lower"):
            raise DrawingError(
                f"the {lip} lip is drawn inside out: of {names[0]}, {names[1]} and {names[2]} the "
                "skin must face right and the bone lie behind it; are upper and lower exchanged?"
            )
        if lip == "lower":
            return skin, inner, bone
        return skin[::-1], inner[::-1], bone[::-1]


def drawn_head(
    file: Path, *, unit_mm: float | None = None, dermis_mm: float, tie_fade_mm: float
) -> HeadSection:
    """Return the head of an SVG or DXF drawing with the curves of the module docstring.

    Parameters
    ----------
    file
        The drawing.
    unit_mm
        Unit of the drawing, mm, if the file does not state it.
    dermis_mm, tie_fade_mm
        As in `HeadDrawing.head`.

    Raises
    ------
    DrawingError
        If the drawing cannot be read, or shows no head.
    """
    with naming(file):
        return HeadDrawing.read(file, unit_mm=unit_mm).head(
            dermis_mm=dermis_mm, tie_fade_mm=tie_fade_mm
        )


def _only_closed(name: str, chains: Iterable[Chain]) -> Outline:
    outlines: list[NamedOutline] = closed_outlines(chains)
    if len(outlines) != 1:
        raise DrawingError(
            f"there are {len(outlines)} closed curves named {name!r}, not one: delete the others"
        )
    return outlines[0].outline


def _from_end_nearest(curve: Array, name: str, before: Array, before_name: str) -> Array:
    """Return a curve in the direction that starts at an end of the previous curve."""
    ends = before[[0, -1]]
    gaps = [float(np.min(np.hypot(*(ends - end).T))) for end in (curve[0], curve[-1])]
    if min(gaps) > JOIN_MM:
        raise DrawingError(
            f"{name} does not begin where {before_name} ends: {min(gaps):.4g} mm are between "
            f"them near {np.round(curve[-int(np.argmin(gaps))], 2).tolist()} mm from the ear"
        )
    return curve if gaps[0] <= gaps[1] else curve[::-1]


def _parted(points: Array, arc_length: float) -> tuple[Array, Array]:
    """Return a polyline as two that meet at an arc length, mm."""
    at, along = at_arc_lengths(points, [arc_length]), arc_lengths(points)
    return (
        np.concatenate([points[along < arc_length - JOIN_MM], at]),
        np.concatenate([at, points[along > arc_length + JOIN_MM]]),
    )


def _strip(bone: Array) -> Array:
    behind = bone - JAW_MM * left_normals(bone)
    return np.concatenate([bone, behind[::-1]])


def _refuse_overlap(lips: Mapping[str, Section], teeth: Mapping[str, Outline]) -> None:
    tissue = {
        lip: shapely.union_all([shapely.Polygon(p) for p in section.regions.values()])
        for lip, section in lips.items()
    }
    if tissue["upper"].intersects(tissue["lower"]):
        raise DrawingError("the lips overlap: draw them parted, as just before contact")
    for lip, section in lips.items():
        depth = -float(teeth[f"{lip}_tooth"].project(section.curves["inner"]).distance.min())
        if depth > 0:
            raise DrawingError(
                f"{lip}_inner lies up to {depth:.3g} mm inside {lip}_tooth: draw it in front"
            )


def _polyline(points: Array) -> str:
    return "M " + " L ".join(f"{x:.9f} {-y:.9f}" for x, y in points)


def _arcs(outline: Outline) -> str:
    """Return the path data of an outline; y points down on the sheet."""
    ends = np.roll(outline.start, -1, axis=0)
    steps = [f"M {outline.start[0, 0]:.9f} {-outline.start[0, 1]:.9f}"]
    for (x, y), bend in zip(ends, outline.curvature, strict=True):
        radius = f"A {1 / abs(bend):.9f} {1 / abs(bend):.9f} 0 0 {int(bend < 0)} " if bend else "L "
        steps.append(f"{radius}{x:.9f} {-y:.9f}")
    return " ".join([*steps, "Z"])
