"""Regions and fibre directions of the muscles in a section through the lips.

Orbicularis oris runs across the section. Its peripheral part is a sheet between mucosa and skin
from the lip's free edge to beyond the fold between lip and jaw. Its marginal part is a bundle under
the vermilion. Both close the mouth, because their fibres are curved: backwards around the dental
arch, and towards the opening, between whose corners they are arched. Mentalis, levator and
depressor run in the section, straight from bone to skin.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry2d.anatomy.anthropometry import HeadError
from geometry2d.anatomy.head import HeadSection
from geometry2d.anatomy.muscle_measurements import MuscleMeasurements
from geometry2d.curves import (
    arc_lengths,
    at_arc_lengths,
    left_normals,
    nearest_arc_length,
    resampled,
    stretch,
)
from geometry2d.regions import Section

Array = NDArray[np.float64]
Lip = Literal["upper", "lower"]

SPACING_MM = 0.1
BEYOND_MM = 6.0
"""Length beyond both ends of a straight muscle before it is clipped to the tissue, mm."""


@dataclass(frozen=True)
class FibresAroundMouth:
    """Fibres across the section, arched from one corner of the mouth to the other.

    Attributes
    ----------
    radius_mm
        Their radius in a horizontal plane, around the dental arch, mm.
    mouth_width_mm
        Distance of the corners, mm.
    corner_height_mm
        Height of the corners in the section, mm.
    """

    radius_mm: float
    mouth_width_mm: float
    corner_height_mm: float

    def curvature(self, points: ArrayLike) -> Array:
        """Return the curvature vectors (..., 2), 1/mm, towards the centre, at points (..., 2), mm.

        The component backwards is ``1/R_h``. The component towards the opening is ``1/R_v``: a
        circle through both corners with the rise ``s`` has ``R_v = (w²/4 + s²)/(2 s)``. At the
        height of the corners it is zero.
        """
        above = np.asarray(points, float)[..., 1] - self.corner_height_mm
        vertical = 2 * above / (0.25 * self.mouth_width_mm**2 + above**2)
        return np.stack([np.full_like(above, -1 / self.radius_mm), -vertical], axis=-1)


@dataclass(frozen=True)
class StraightFibres:
    """Fibres in the section, all in one direction.

    Attributes
    ----------
    towards_bone
        Unit vector from skin to bone.
    """

    towards_bone: tuple[float, float]

    def direction(self, points: ArrayLike) -> Array:
        """Return the direction (..., 2) at points (..., 2)."""
        return np.broadcast_to(self.towards_bone, np.shape(points)).astype(float)


@dataclass(frozen=True)
class MuscleRegion:
    """A muscle in a section.

    Attributes
    ----------
    name
        "upper_peripheral", "upper_marginal", "lower_peripheral", "lower_marginal", "mentalis",
        "levator" or "depressor".
    lip
        Its lip.
    polygon
        (n, 2) its region, mm, in the head section's frame.
    fibres
        Its fibres.
    edge_mm
        Distance on both sides of its edge over which its share of the tissue changes from 1 to 0,
        mm.
    """

    name: str
    lip: Lip
    polygon: Array
    fibres: FibresAroundMouth | StraightFibres
    edge_mm: float

    @property
    def area_mm2(self) -> float:
        """Area in the section, mm²."""
        return float(shapely.Polygon(self.polygon).area)

    def share(self, points: ArrayLike) -> Array:
        """Return the share (0…1) of this muscle in the tissue at points (..., 2), mm.

        It changes at the edge with a continuous slope: integrals depend little on how elements cut
        the edge.
        """
        at = np.asarray(points, float)
        flat = at.reshape(-1, 2)
        low, high = self.polygon.min(axis=0) - self.edge_mm, self.polygon.max(axis=0) + self.edge_mm
        near = np.all((flat >= low) & (flat <= high), axis=1)
        polygon = shapely.Polygon(self.polygon)
        shapely.prepare(polygon)
        spots = shapely.points(flat[near])
        away = shapely.distance(polygon.exterior, spots)
        depth = np.where(shapely.contains(polygon, spots), away, -away)
        ramp = np.clip(0.5 * (depth / self.edge_mm + 1), 0.0, 1.0)
        share = np.zeros(len(flat))
        share[near] = ramp**2 * (3 - 2 * ramp)
        return share.reshape(at.shape[:-1])


def muscle_regions(
    head: HeadSection, measurements: MuscleMeasurements | None = None
) -> dict[str, MuscleRegion]:
    """Return the muscles of a head's lips, by name.

    Raises
    ------
    HeadError
        If a muscle would leave the tissue; the message names the measurements that decide it.
    """
    m = MuscleMeasurements() if measurements is None else measurements
    lips = {"upper": LipLines.of(head, "upper"), "lower": LipLines.of(head, "lower")}
    corners = 0.5 * (head.landmarks["stomion_upper"] + head.landmarks["stomion_lower"])
    regions = []
    for lip, lines in lips.items():
        for part, polygon in (("peripheral", _sheet(lines, m)), ("marginal", _bundle(lines, m))):
            radius = getattr(m, f"{lip}_{part}_radius_mm")
            fibres = FibresAroundMouth(radius, m.mouth_width_mm, float(corners[1]))
            regions.append(MuscleRegion(f"{lip}_{part}", lines.lip, polygon, fibres, m.edge_mm))
    for name, lip in STRAIGHT.items():
        regions.append(_straight(name, lips[lip], m))
    return {region.name: region for region in regions}


STRAIGHT: Mapping[str, Lip] = {"mentalis": "lower", "levator": "upper", "depressor": "lower"}
"""The muscles in the plane of the section, with their lips."""


@dataclass(frozen=True)
class LipLines:
    """The boundary of a lip, by arc lengths from its margin.

    Attributes
    ----------
    lip
        "upper" or "lower".
    tissue
        The deep layer, which holds the muscles.
    outside
        (n, 2) inner side of the dermis, mm, from the margin outwards.
    inside
        (n, 2) skin, inner side and bone, mm, from the margin inwards.
    fold_mm
        Arc length along ``inside`` of the fold between lip and jaw, where the bone begins.
    """

    lip: Lip
    tissue: shapely.Polygon
    outside: Array
    inside: Array
    fold_mm: float

    @classmethod
    def of(cls, head: HeadSection, lip: Lip) -> LipLines:
        """Return the lines of a head's upper or lower lip."""
        section: Section = getattr(head, lip)
        margin = head.landmarks[f"stomion_{lip}"]
        curves = {name: resampled(section.curves[name], SPACING_MM) for name in NEEDED_CURVES}
        if lip == "upper":  # its curves run from bone to skin
            chain = [curves["skin"][::-1], curves["inner"][::-1], curves["bone"][::-1]]
            interface = curves["interface"]
        else:
            chain = [curves["skin"], curves["inner"], curves["bone"]]
            interface = curves["interface"][::-1]
        whole = np.concatenate([chain[0], chain[1][1:], chain[2][1:]])
        at, end = nearest_arc_length(whole, margin), float(arc_lengths(whole)[-1])
        below = nearest_arc_length(interface, margin)
        return cls(
            lip,
            shapely.Polygon(section.regions["bulk"]),
            stretch(interface, below, float(arc_lengths(interface)[-1])),
            stretch(whole, at, end),
            end - at - float(arc_lengths(curves["bone"])[-1]),
        )

    def inwards(self, curve: Array) -> Array:
        """Return unit normals (n, 2) of a curve that starts at the margin, into the tissue."""
        along_boundary = self.lip == "lower"
        if curve is self.outside:
            along_boundary = not along_boundary
        return left_normals(curve) * (1.0 if along_boundary else -1.0)

    def point_on(self, curve: Array, place_mm: float, key: str) -> Array:
        """Return the point (2,) at an arc length; ``key`` names it if the curve is shorter."""
        length = float(arc_lengths(curve)[-1])
        if place_mm > length:
            raise HeadError(
                f"{key} is {place_mm:g}: the {self.lip} lip's curve ends after {length:.1f} mm"
            )
        return at_arc_lengths(curve, place_mm)


NEEDED_CURVES = ("skin", "inner", "bone", "interface")


def _sheet(lines: LipLines, m: MuscleMeasurements) -> Array:
    """Return the peripheral part (n, 2) of orbicularis: a layer below the inner side."""
    prefix = f"{lines.lip}_peripheral"
    start = getattr(m, f"{prefix}_start_mm")
    end = lines.fold_mm + getattr(m, f"{prefix}_beyond_fold_mm")
    lines.point_on(lines.inside, end, f"{prefix}_beyond_fold_mm")
    if start >= end:
        raise HeadError(
            f"{prefix}_start_mm is {start:g}: the muscle would begin beyond its end, {end:.1f} mm "
            "from the margin"
        )
    return _layer(lines, lines.inside, start, end, prefix, m)


def _bundle(lines: LipLines, m: MuscleMeasurements) -> Array:
    """Return the marginal part (n, 2) of orbicularis: a layer below the dermis of the red."""
    prefix = f"{lines.lip}_marginal"
    start, length = (getattr(m, f"{prefix}_{name}_mm") for name in ("start", "length"))
    lines.point_on(lines.outside, start + length, f"{prefix}_length_mm")
    return _layer(lines, lines.outside, start, start + length, prefix, m)


def _layer(
    lines: LipLines, curve: Array, start: float, end: float, name: str, m: MuscleMeasurements
) -> Array:
    """Return the region (n, 2), mm, of a layer at its depth below a part of the boundary.

    Raises
    ------
    HeadError
        If the lip is too thin for it.
    """
    keys = f"{name}_depth_mm", f"{name}_thickness_mm"
    depth, thickness = (getattr(m, key) for key in keys)
    along = arc_lengths(curve)
    chosen = (along >= start) & (along <= end)
    farthest = (curve + (depth + thickness) * lines.inwards(curve))[chosen]
    near, far = (
        shapely.LineString(curve).buffer(depth),
        shapely.LineString(curve[chosen]).buffer(depth + thickness, cap_style="flat"),
    )
    layer = far.difference(near).intersection(lines.tissue)
    if not (shapely.contains(lines.tissue, shapely.points(farthest)).all() and layer.area > 0):
        raise HeadError(
            f"{name} would reach beyond the {lines.lip} lip's deep layer: {keys[0]} is {depth:g} "
            f"and {keys[1]} {thickness:g}, reduce one of them"
        )
    polygon = max(shapely.get_parts(layer), key=shapely.area)
    return np.asarray(polygon.exterior.coords)[:-1]


def _straight(name: str, lines: LipLines, m: MuscleMeasurements) -> MuscleRegion:
    """Return a straight muscle from skin to bone, clipped by both."""
    keys = f"{name}_skin_mm", f"{name}_bone_mm"
    skin_mm, bone_mm = (getattr(m, key) for key in keys)
    on_skin = lines.point_on(lines.outside, skin_mm, keys[0])
    on_bone = lines.point_on(lines.inside, lines.fold_mm + bone_mm, keys[1])
    along = (on_bone - on_skin) / float(np.hypot(*(on_bone - on_skin)))
    half = 0.5 * getattr(m, f"{name}_thickness_mm") * np.array([-along[1], along[0]])
    ends = on_skin - BEYOND_MM * along, on_bone + BEYOND_MM * along
    band = shapely.Polygon([ends[0] - half, ends[1] - half, ends[1] + half, ends[0] + half])
    for piece in shapely.get_parts(band.intersection(lines.tissue)):
        reached = shapely.distance(piece, shapely.points([on_skin, on_bone]))
        if np.all(reached < SPACING_MM):
            fibres = StraightFibres((float(along[0]), float(along[1])))
            outline = np.asarray(piece.exterior.coords)[:-1]
            return MuscleRegion(name, lines.lip, outline, fibres, m.edge_mm)
    raise HeadError(
        f"{name} would leave the {lines.lip} lip between skin and bone: change {keys[0]} "
        f"({skin_mm:g}) or {keys[1]} ({bone_mm:g})"
    )
