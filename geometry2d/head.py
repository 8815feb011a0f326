"""A mid-sagittal head from named soft-tissue measurements, as two deformable lips and rigid teeth.

The face is first drawn with the teeth closed and the lips relaxed, relative to subnasale (the point
where nose and lip meet), as cephalometry does: projections are horizontal distances from the true
vertical through subnasale. Everything below the lip gap is then turned about the jaw's hinge. The
defaults describe one adult man throughout, because the recorded person of the study was a man.

Section frame: origin at the ear marker (the tragus), x forward, y up, head in natural position, mm.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry2d.curves import (
    arc_lengths,
    at_arc_lengths,
    left_normals,
    nearest_arc_length,
    resampled,
    smoothed,
    through_landmarks,
)
from geometry2d.outline import Outline
from geometry2d.regions import Section
from geometry2d.rigid import rotated

Array = NDArray[np.float64]
_Placing = Callable[[ArrayLike], Array]

POLYLINE_SPACING_MM = 0.1
SMOOTHING_WIDTH_MM = 0.6
"""Gaussian width that evens out the curvature; moves a lip margin of radius 5 mm by 0.04 mm."""
DERMIS_BLEND_MM = 3.0
"""Arc length over which the dermis goes from its thickness on the skin to that on the vermilion."""
FOCUS_REACH_MM = 20.0
"""How far out from the lip margin a package may touch, along the skin."""

ARNETT = "Arnett 1999, men (as remembered; the table itself was not seen)"
CELEBI = "Celebi 2013, men"
ESTIMATE = "estimate for an adult man"


class HeadError(ValueError):
    """The measurements do not describe a head."""


def _measured(default: float, unit: str, source: str, description: str) -> float:
    value: float = field(
        default=default, metadata={"unit": unit, "source": source, "description": description}
    )
    return value


@dataclass(frozen=True)
class HeadMeasurements:
    """Named measurements of a head; the metadata of every field give unit, source and meaning."""

    # Where the face hangs on the jaw's hinge.
    hinge_forward_mm: float = _measured(
        11.5, "mm", "10-13 mm, general anatomy", "hinge axis of the jaw, from tragus to eye corner"
    )
    hinge_above_deg: float = _measured(
        10.0, "deg", ESTIMATE, "direction tragus to outer eye corner, above horizontal"
    )
    hinge_incisor_mm: float = _measured(
        90.9,
        "mm",
        "Bonwill triangle of side 105 mm, seen from the side: 105·√3/2",
        "hinge axis to the edge of the lower incisor",
    )
    hinge_incisor_below_deg: float = _measured(
        34.0,
        "deg",
        "Balkwill angle 22-26° and an occlusal plane falling forward by 10°",
        "direction hinge to lower incisor, below horizontal, teeth closed",
    )
    ear_nose_mm: float = _measured(
        104.3, "mm", "the recordings' [scale] head", "ear marker to the marker beside the nose tip"
    )
    # Profile, horizontal positions from the true vertical through subnasale.
    nose_projection_mm: float = _measured(17.4, "mm", ARNETT, "nose tip ahead of subnasale")
    nose_tip_height_mm: float = _measured(10.5, "mm", ESTIMATE, "nose tip above subnasale")
    nasolabial_angle_deg: float = _measured(
        105.7, "deg", CELEBI, "between columella and the line subnasale to upper lip"
    )
    nasion_height_mm: float = _measured(
        56.6, "mm", f"{ARNETT}: 137.7 - 81.1", "nasion above subnasale"
    )
    glabella_projection_mm: float = _measured(-8.0, "mm", ARNETT, "glabella ahead of subnasale")
    upper_lip_length_mm: float = _measured(
        24.4, "mm", ARNETT, "subnasale to the lower margin of the upper lip"
    )
    upper_lip_projection_mm: float = _measured(3.3, "mm", ARNETT, "upper lip ahead of subnasale")
    upper_lip_thickness_mm: float = _measured(
        14.8, "mm", ARNETT, "foremost point of the upper lip to its inner side"
    )
    upper_vermilion_mm: float = _measured(
        8.0, "mm", "7-9 mm in Europeans", "height of the upper lip's red part"
    )
    a_point_projection_mm: float = _measured(
        -0.3, "mm", ARNETT, "hollow of the upper lip (A') ahead of subnasale"
    )
    interlabial_gap_mm: float = _measured(
        2.4, "mm", ARNETT, "gap of the relaxed lips, teeth closed"
    )
    lower_lip_length_mm: float = _measured(
        54.3, "mm", ARNETT, "upper margin of the lower lip to menton"
    )
    lower_lip_projection_mm: float = _measured(1.0, "mm", ARNETT, "lower lip ahead of subnasale")
    lower_lip_thickness_mm: float = _measured(
        15.1, "mm", ARNETT, "foremost point of the lower lip to its inner side"
    )
    lower_vermilion_mm: float = _measured(
        10.0, "mm", "9-11 mm in Europeans", "height of the lower lip's red part"
    )
    sulcus_projection_mm: float = _measured(
        -7.1, "mm", ARNETT, "labiomental fold (B') ahead of subnasale"
    )
    sulcus_below_lip_mm: float = _measured(
        20.7, "mm", "anthropometry table, 2019", "lower lip's margin to the labiomental fold"
    )
    mentolabial_angle_deg: float = _measured(
        120.0, "deg", "most liked 107-118, accepted to 140 (2017)", "between lower lip and chin"
    )
    pogonion_projection_mm: float = _measured(
        -3.5, "mm", ARNETT, "foremost point of the chin ahead of subnasale"
    )
    pogonion_above_menton_mm: float = _measured(20.0, "mm", ESTIMATE, "pogonion above menton")
    menton_behind_pogonion_mm: float = _measured(
        16.0, "mm", ESTIMATE, "lowest point of the chin behind its foremost"
    )
    # Depth of the tissue over bone.
    a_point_thickness_mm: float = _measured(
        15.0, "mm", ESTIMATE, "tissue over the upper jaw at the hollow of the upper lip"
    )
    sulcus_thickness_mm: float = _measured(
        11.5, "mm", ESTIMATE, "tissue over the lower jaw at the labiomental fold"
    )
    pogonion_thickness_mm: float = _measured(13.5, "mm", ARNETT, "tissue over the chin, in front")
    menton_thickness_mm: float = _measured(8.8, "mm", ARNETT, "tissue under the chin")
    nose_thickness_mm: float = _measured(
        13.0, "mm", "bulk of 10-20 mm in the study", "tissue of the nose over cartilage"
    )
    dermis_thickness_mm: float = _measured(
        1.0, "mm", "about 1 mm in the study; 1.11-1.94 mm in men", "dermis of the skin"
    )
    vermilion_thickness_mm: float = _measured(
        1.0, "mm", "about 1 mm in the study", "dermis of the red part and of the lip's margin"
    )
    dermis_wrap_mm: float = _measured(
        6.0, "mm", ESTIMATE, "how far the dermis goes round the lip's margin to the inside"
    )
    # Teeth and jaw.
    incisor_exposure_mm: float = _measured(
        3.9, "mm", ARNETT, "edge of the upper incisor below the upper lip"
    )
    overbite_mm: float = _measured(3.2, "mm", ARNETT, "upper incisor's edge below the lower one's")
    upper_crown_mm: float = _measured(10.5, "mm", "Wheeler: 10-11 mm", "upper incisor's crown")
    upper_crown_depth_mm: float = _measured(7.0, "mm", "Wheeler", "upper incisor, front to back")
    upper_crown_slope_deg: float = _measured(
        2.0, "deg", "torque 7° less half the occlusal plane's 10°", "front face, edge forward"
    )
    lower_crown_mm: float = _measured(9.0, "mm", "Wheeler", "lower incisor's crown")
    lower_crown_depth_mm: float = _measured(6.0, "mm", "Wheeler", "lower incisor, front to back")
    lower_crown_slope_deg: float = _measured(
        9.0, "deg", "torque -1° and an occlusal plane of 10°", "front face, edge forward"
    )
    tooth_clearance_mm: float = _measured(
        0.3, "mm", "0.2-0.5 mm, moist lips lie close to the teeth", "lips to the front of the teeth"
    )
    vestibule_depth_mm: float = _measured(
        8.0, "mm", ESTIMATE, "how far above the crown the lips are free from the jaw"
    )
    tie_fade_mm: float = _measured(
        4.0, "mm", "so that no element sees the tie end", "arc length over which the tie fades in"
    )
    jaw_opening_deg: float = _measured(
        7.5, "deg", "lips parted as just before contact; 10.9° is pure hinge", "turn of the jaw"
    )

    def __post_init__(self) -> None:
        for entry in dataclasses.fields(self):
            value = getattr(self, entry.name)
            if not np.isfinite(value):
                raise HeadError(f"{entry.name} is {value}: give a finite number")
        for name in _POSITIVE:
            if getattr(self, name) <= 0:
                raise HeadError(f"{name} is {getattr(self, name)}: it must be greater than zero")
        for name, low, high in _RANGES:
            value = getattr(self, name)
            if not low <= value <= high:
                raise HeadError(f"{name} is {value}: it must lie between {low} and {high}")


_POSITIVE = tuple(
    entry.name
    for entry in dataclasses.fields(HeadMeasurements)
    if entry.name.endswith(("_thickness_mm", "_length_mm", "_vermilion_mm", "_crown_mm"))
    or entry.name in ("hinge_incisor_mm", "ear_nose_mm", "tooth_clearance_mm", "dermis_wrap_mm")
)
_RANGES = (
    ("jaw_opening_deg", 0.0, 25.0),
    ("nasolabial_angle_deg", 85.0, 125.0),
    ("mentolabial_angle_deg", 95.0, 150.0),
)


@dataclass(frozen=True)
class HeadSection:
    """What a head is for the simulation and for pictures; all in the section frame, mm.

    Attributes
    ----------
    upper, lower
        Upper lip with the base of the nose; lower lip with the chin. Regions "dermis" and "bulk",
        boundaries "skin", "inner", "bone" and "cut"; the tissue lies on the left of each curve.
    upper_tooth, lower_tooth
        Incisor and the jaw in front of which the lip is free, as rigid outlines.
    upper_jaw, lower_jaw
        (n, 2) polygons of the bones, for drawing.
    profile
        (n, 2) silhouette from the forehead through the lips to the neck, for drawing.
    landmarks
        Named points (2,).
    tie_fade_mm
        Arc length along "bone", from its end next to "inner", over which the tie fades in.
    """

    upper: Section
    lower: Section
    upper_tooth: Outline
    lower_tooth: Outline
    upper_jaw: Array
    lower_jaw: Array
    profile: Array
    landmarks: Mapping[str, Array]
    tie_fade_mm: float


def head_section(measurements: HeadMeasurements | None = None) -> HeadSection:
    """Return the head that the measurements describe, its jaw opened as they say.

    Raises
    ------
    HeadError
        If the measurements contradict one another, so that tissue would have no thickness.
    SectionError
        If they make a profile that crosses itself.
    """
    m = HeadMeasurements() if measurements is None else measurements
    face = _ClosedFace.of(m)
    upper = _upper_lip(m, face)
    lower = _lower_lip(m, face)
    hinge = _hinge(m)
    jaw_turn = -np.deg2rad(m.jaw_opening_deg)

    def in_head(points: ArrayLike) -> Array:
        return np.asarray(points, float) + face.subnasale

    def with_jaw(points: ArrayLike) -> Array:
        return rotated(in_head(points) - hinge, jaw_turn) + hinge

    landmarks = {
        "ear": np.zeros(2),
        "hinge": hinge,
        "nose": _nose_marker(m, in_head(face.nose_tip)),
        **{name: in_head(point) for name, point in upper.landmarks.items()},
        **{name: with_jaw(point) for name, point in lower.landmarks.items()},
        "jaw_front": with_jaw(face.pogonion + _by(-11.0, -1.0)),
        "jaw_back": with_jaw(face.pogonion + _by(-37.0, 10.0)),
        "upper_incisor": in_head(face.upper_incisor),
        "lower_incisor": with_jaw(face.lower_incisor),
    }
    section = HeadSection(
        upper=upper.section("upper", m, in_head),
        lower=lower.section("lower", m, with_jaw),
        upper_tooth=upper.tooth.moved(0.0, face.subnasale),
        lower_tooth=lower.tooth.moved(jaw_turn, rotated(face.subnasale - hinge, jaw_turn) + hinge),
        upper_jaw=in_head(_upper_jaw(upper)),
        lower_jaw=with_jaw(_lower_jaw(lower)),
        profile=_profile(m, face, upper, lower, in_head, with_jaw),
        landmarks=landmarks,
        tie_fade_mm=m.tie_fade_mm,
    )
    _refuse_overlap(section)
    return section


def _by(x: float, y: float) -> Array:
    return np.array([x, y])


def _hinge(m: HeadMeasurements) -> Array:
    return rotated([m.hinge_forward_mm, 0.0], np.deg2rad(m.hinge_above_deg))


def _nose_marker(m: HeadMeasurements, nose_tip: Array) -> Array:
    """Place the marker on the side of the nose, on the line from the ear to its tip."""
    reach = float(np.hypot(*nose_tip))
    if m.ear_nose_mm > reach:
        raise HeadError(
            f"ear_nose_mm is {m.ear_nose_mm} but the nose tip is only {reach:.1f} mm from the ear: "
            "use a smaller distance or a larger hinge_incisor_mm"
        )
    return nose_tip * (m.ear_nose_mm / reach)


@dataclass(frozen=True)
class _ClosedFace:
    """Landmarks relative to subnasale, teeth closed; ``subnasale`` itself relative to the ear."""

    subnasale: Array
    nose_tip: Array
    upper_lip: Array
    upper_border: Array
    stomion_upper: Array
    upper_inside: Array
    upper_incisor: Array
    stomion_lower: Array
    lower_lip: Array
    lower_border: Array
    lower_inside: Array
    lower_incisor: Array
    sulcus: Array
    pogonion: Array
    menton: Array

    @classmethod
    def of(cls, m: HeadMeasurements) -> _ClosedFace:
        upper_margin = -m.upper_lip_length_mm
        lower_margin = upper_margin - m.interlabial_gap_mm
        upper_lip = np.array(
            [m.upper_lip_projection_mm, upper_margin + 0.62 * m.upper_vermilion_mm]
        )
        lower_lip = np.array(
            [m.lower_lip_projection_mm, lower_margin - 0.46 * m.lower_vermilion_mm]
        )
        menton_height = lower_margin - m.lower_lip_length_mm
        pogonion = np.array([m.pogonion_projection_mm, menton_height + m.pogonion_above_menton_mm])
        upper_inside = upper_lip - [m.upper_lip_thickness_mm, 0.0]
        lower_inside = lower_lip - [m.lower_lip_thickness_mm, 0.0]
        upper_edge = upper_margin - m.incisor_exposure_mm
        upper_incisor = _incisor_edge(
            upper_inside, upper_edge, m.upper_crown_slope_deg, m.tooth_clearance_mm
        )
        lower_incisor = _incisor_edge(
            lower_inside, upper_edge + m.overbite_mm, m.lower_crown_slope_deg, m.tooth_clearance_mm
        )
        reach = rotated([m.hinge_incisor_mm, 0.0], -np.deg2rad(m.hinge_incisor_below_deg))
        return cls(
            subnasale=_hinge(m) + reach - lower_incisor,
            nose_tip=np.array([m.nose_projection_mm, m.nose_tip_height_mm]),
            upper_lip=upper_lip,
            upper_border=np.array(
                [m.upper_lip_projection_mm - 1.0, upper_margin + m.upper_vermilion_mm]
            ),
            stomion_upper=np.array([upper_lip[0] - 0.47 * m.upper_lip_thickness_mm, upper_margin]),
            upper_inside=upper_inside,
            upper_incisor=upper_incisor,
            stomion_lower=np.array([lower_lip[0] - 0.47 * m.lower_lip_thickness_mm, lower_margin]),
            lower_lip=lower_lip,
            lower_border=np.array(
                [m.lower_lip_projection_mm - 1.9, lower_margin - m.lower_vermilion_mm]
            ),
            lower_inside=lower_inside,
            lower_incisor=lower_incisor,
            sulcus=np.array([m.sulcus_projection_mm, lower_margin - m.sulcus_below_lip_mm]),
            pogonion=pogonion,
            menton=np.array([pogonion[0] - m.menton_behind_pogonion_mm, menton_height]),
        )


def _incisor_edge(inside: Array, edge_height: float, slope_deg: float, clearance: float) -> Array:
    """Edge of an incisor whose front face passes ``clearance`` behind the lip's inner point."""
    away = abs(edge_height - inside[1])
    return np.array(
        [inside[0] - clearance - CROWN_BULGE_MM + away * np.tan(np.deg2rad(slope_deg)), edge_height]
    )


CROWN_BULGE_MM = 0.4
"""How far the front face of a crown bulges ahead of the line from its edge to the gum."""


@dataclass(frozen=True)
class _Lip:
    """One lip relative to subnasale, teeth closed: its outer boundary as one smooth curve.

    ``chain`` runs counter-clockwise; the upper one bone, inner side, skin, the lower one reversed.
    ``fornix``, ``margin`` and the two borders of the vermilion are arc lengths on it.
    """

    chain: Array
    bone_first: bool
    fornix: float
    margin: float
    border: float
    tooth: Outline
    landmarks: Mapping[str, Array]

    def section(self, name: str, m: HeadMeasurements, placed: _Placing) -> Section:
        """Cut the chain into named curves, split off the dermis, and put both into the head."""
        along = arc_lengths(self.chain)
        sign = 1.0 if self.bone_first else -1.0
        dermis_end = self.margin - sign * m.dermis_wrap_mm
        inner_length = sign * (dermis_end - self.fornix)
        if inner_length < 1.0:
            raise HeadError(
                f"the {name} lip's dermis would reach {-inner_length:.1f} mm up to the bone: use a "
                "smaller dermis_wrap_mm or a larger vestibule_depth_mm"
            )
        low, high = (dermis_end, along[-1]) if self.bone_first else (0.0, dermis_end)
        skin = _stretch(self.chain, low, high)
        s = low + arc_lengths(skin)
        interface = skin + left_normals(skin) * self._thickness(s, m)[:, None]
        if self.bone_first:
            bone = _stretch(self.chain, 0.0, self.fornix)
            inner = _stretch(self.chain, self.fornix, dermis_end)
            wall_end, inner_end, nose_end = bone[0], 0, -1
        else:
            inner = _stretch(self.chain, dermis_end, self.fornix)
            bone = _stretch(self.chain, self.fornix, along[-1])
            wall_end, inner_end, nose_end = bone[-1], -1, 0
        curves = {
            "skin": skin,
            "inner": inner,
            "bone": bone,
            "interface": interface,
            "dermis_end": np.array([skin[inner_end], interface[inner_end]]),
            "cut_dermis": np.array([skin[nose_end], interface[nose_end]]),
            "cut_bulk": np.array([interface[nose_end], wall_end]),
        }
        if self.bone_first:
            loops = {
                "dermis": (
                    ("skin", True),
                    ("cut_dermis", True),
                    ("interface", False),
                    ("dermis_end", False),
                ),
                "bulk": (
                    ("interface", True),
                    ("cut_bulk", True),
                    ("bone", True),
                    ("inner", True),
                    ("dermis_end", True),
                ),
            }
        else:
            loops = {
                "dermis": (
                    ("skin", True),
                    ("dermis_end", True),
                    ("interface", False),
                    ("cut_dermis", False),
                ),
                "bulk": (
                    ("interface", True),
                    ("dermis_end", False),
                    ("inner", True),
                    ("bone", True),
                    ("cut_bulk", False),
                ),
            }
        return Section(
            name=name,
            curves={key: placed(points) for key, points in curves.items()},
            loops=loops,
            boundary_curves={
                "skin": ("skin",),
                "inner": ("inner",),
                "bone": ("bone",),
                "cut": ("cut_dermis", "cut_bulk"),
            },
            focus=placed(skin[np.abs(s - self.margin) <= FOCUS_REACH_MM]),
            layer_curves=("skin", "interface", "inner"),
        )

    def _thickness(self, s: Array, m: HeadMeasurements) -> Array:
        """Thickness of the dermis, mm, at arc lengths (n,): the skin's outside of the border."""
        outwards = (s - self.border) if self.bone_first else (self.border - s)
        t = np.clip(0.5 + outwards / DERMIS_BLEND_MM, 0.0, 1.0)
        blend: Array = t * t * (3 - 2 * t)
        return m.vermilion_thickness_mm + blend * (m.dermis_thickness_mm - m.vermilion_thickness_mm)


def _stretch(chain: Array, low: float, high: float) -> Array:
    """Part of a polyline between two arc lengths, with points of its own at both ends."""
    count = max(2, int(np.ceil((high - low) / POLYLINE_SPACING_MM)) + 1)
    return at_arc_lengths(chain, np.linspace(low, high, count))


def _upper_lip(m: HeadMeasurements, face: _ClosedFace) -> _Lip:
    columella_deg = (
        np.rad2deg(np.arctan2(face.upper_lip[1], face.upper_lip[0])) + m.nasolabial_angle_deg
    )
    columella = rotated([0.5 * m.nose_projection_mm, 0.0], np.deg2rad(columella_deg))
    nasion = _nasion(m)
    supratip = face.nose_tip + _by(-0.19 * m.nose_projection_mm, 0.42 * m.nose_projection_mm)
    dorsum_deg = float(np.rad2deg(np.arctan2(*(nasion - supratip)[::-1])))
    cut = supratip + 0.13 * (nasion - supratip)
    inwards = rotated([1.0, 0.0], np.deg2rad(dorsum_deg + 90.0))
    bone_top = cut + m.nose_thickness_mm * inwards
    a_height = 0.25 * -m.upper_lip_length_mm
    a_bone = np.array([m.a_point_projection_mm - m.a_point_thickness_mm, a_height])
    spine = np.array([-0.8 * m.a_point_thickness_mm, 2.5])
    tooth = _upper_tooth(m, face, a_bone)
    front = _in_front_of(
        tooth,
        m.tooth_clearance_mm,
        start_height=face.upper_incisor[1] + m.upper_crown_mm + m.vestibule_depth_mm,
        end_height=face.upper_inside[1],
    )
    bone = through_landmarks(
        [bone_top, spine, a_bone + _by(0.3, 0.0), front[0]],
        [dorsum_deg + 105.0, 255.0, 275.0, _heading(front[:2])],
    )
    lip_deg = float(np.rad2deg(np.arctan2(-face.upper_lip[1], -face.upper_lip[0])))
    skin = through_landmarks(
        [
            front[-1],
            face.stomion_upper,
            face.upper_lip,
            face.upper_border,
            [m.a_point_projection_mm, a_height],
            [0.0, 0.0],
            columella,
            face.nose_tip,
            supratip,
            cut,
        ],
        [
            _heading(front[-2:]),
            0.0,
            90.0,
            lip_deg + 12.0,
            93.0,
            0.5 * (95.0 + columella_deg),
            columella_deg,
            90.0,
            dorsum_deg + 4.0,
            dorsum_deg,
        ],
    )
    chain = smoothed(
        resampled(np.concatenate([bone[:-1], front, skin[1:]]), POLYLINE_SPACING_MM),
        SMOOTHING_WIDTH_MM,
    )
    return _Lip(
        chain=chain,
        bone_first=True,
        fornix=nearest_arc_length(chain, front[0]),
        margin=nearest_arc_length(chain, face.stomion_upper),
        border=nearest_arc_length(chain, face.upper_border),
        tooth=tooth,
        landmarks=_on_chain(
            chain,
            pronasale=face.nose_tip,
            subnasale=np.zeros(2),
            upper_lip=face.upper_lip,
            labrale_superius=face.upper_border,
            stomion_upper=face.stomion_upper,
        ),
    )


def _lower_lip(m: HeadMeasurements, face: _ClosedFace) -> _Lip:
    b_bone = face.sulcus - [m.sulcus_thickness_mm, 0.0]
    tooth = _lower_tooth(m, face, b_bone)
    front = _in_front_of(
        tooth,
        m.tooth_clearance_mm,
        start_height=face.lower_inside[1],
        end_height=face.lower_incisor[1] - m.lower_crown_mm - m.vestibule_depth_mm,
    )
    behind = np.array([-SUBMENTAL_LENGTH_MM, 1.5])
    cut = face.menton + behind
    bone_end = cut + _by(-0.5, m.menton_thickness_mm + 2.0)
    chin_deg = float(np.rad2deg(np.arctan2(*(face.sulcus - face.pogonion)[::-1]))) - 90.0
    lip_deg = 90.0 - (180.0 - m.mentolabial_angle_deg - 1.6 * chin_deg)
    skin = through_landmarks(
        [
            cut,
            face.menton,
            face.pogonion,
            face.sulcus,
            face.lower_border,
            face.lower_lip,
            face.stomion_lower,
            front[0],
        ],
        [-4.0, 0.0, 90.0, 86.0, lip_deg, 90.0, 180.0, _heading(front[:2])],
    )
    bone = through_landmarks(
        [
            front[-1],
            b_bone + _by(0.3, 0.0),
            face.pogonion - [m.pogonion_thickness_mm, 0.0],
            face.menton + _by(-2.0, m.menton_thickness_mm),
            bone_end,
        ],
        [_heading(front[-2:]), 271.0, 268.0, 190.0, 176.0],
    )
    chain = smoothed(
        resampled(np.concatenate([skin[:-1], front, bone[1:]]), POLYLINE_SPACING_MM),
        SMOOTHING_WIDTH_MM,
    )
    return _Lip(
        chain=chain,
        bone_first=False,
        fornix=nearest_arc_length(chain, front[-1]),
        margin=nearest_arc_length(chain, face.stomion_lower),
        border=nearest_arc_length(chain, face.lower_border),
        tooth=tooth,
        landmarks=_on_chain(
            chain,
            stomion_lower=face.stomion_lower,
            lower_lip=face.lower_lip,
            labrale_inferius=face.lower_border,
            sulcus=face.sulcus,
            pogonion=face.pogonion,
            menton=face.menton,
        ),
    )


SUBMENTAL_LENGTH_MM = 22.0
"""How far behind menton the lower section is cut off."""


def _upper_tooth(m: HeadMeasurements, face: _ClosedFace, a_bone: Array) -> Outline:
    """Upper incisor with the jaw above it up to A, counter-clockwise from its edge."""
    up = rotated([0.0, 1.0], np.deg2rad(m.upper_crown_slope_deg))
    edge, crown, depth = face.upper_incisor, m.upper_crown_mm, m.upper_crown_depth_mm
    gum = edge + crown * up
    top = a_bone - [m.tooth_clearance_mm, 0.0]
    corners = [
        edge,
        edge + 0.45 * crown * up + _by(CROWN_BULGE_MM, 0.0),
        gum + _by(0.1, 0.0),
        top,
        top + _by(-depth - 1.0, 0.5),
        gum + _by(-depth, 1.5),
        edge + _by(-1.7, 0.5),
    ]
    return Outline.from_corners(corners, [0.7, 12.0, 8.0, 1.5, 1.5, 3.0, 0.6])


def _lower_tooth(m: HeadMeasurements, face: _ClosedFace, b_bone: Array) -> Outline:
    """Lower incisor with the jaw below it down to B, counter-clockwise from below."""
    down = rotated([0.0, -1.0], -np.deg2rad(m.lower_crown_slope_deg))
    edge, crown, depth = face.lower_incisor, m.lower_crown_mm, m.lower_crown_depth_mm
    gum = edge + crown * down
    bottom = b_bone - [m.tooth_clearance_mm, 0.0]
    corners = [
        bottom,
        gum + _by(0.1, 0.0),
        edge + 0.45 * crown * down + _by(CROWN_BULGE_MM, 0.0),
        edge,
        edge + _by(-1.6, -0.5),
        gum + _by(-depth, -1.5),
        bottom + _by(-depth - 1.0, -0.5),
    ]
    return Outline.from_corners(corners, [1.5, 8.0, 12.0, 0.7, 0.6, 3.0, 1.5])


def _in_front_of(
    tooth: Outline, clearance: float, *, start_height: float, end_height: float
) -> Array:
    """Points ``clearance`` in front of a tooth's front face between two heights."""
    points = tooth.sampled(POLYLINE_SPACING_MM)
    projection = tooth.project(points)
    front = (
        points[projection.normal[:, 0] > 0.5]
        + clearance * (projection.normal[projection.normal[:, 0] > 0.5])
    )
    front = front[np.argsort(front[:, 1], kind="stable")]
    low, high = sorted((start_height, end_height))
    if not front[0, 1] < low < high < front[-1, 1]:
        raise HeadError(
            f"the lip's free inner side would run from {low:.1f} to {high:.1f} mm (from "
            f"subnasale) but the tooth's front only from {front[0, 1]:.1f} to "
            f"{front[-1, 1]:.1f} mm: change crown lengths, lip lengths or vestibule_depth_mm"
        )
    height = np.linspace(start_height, end_height, 1 + int((high - low) / POLYLINE_SPACING_MM))
    return np.column_stack([np.interp(height, front[:, 1], front[:, 0]), height])


def _heading(points: Array) -> float:
    step = points[-1] - points[0]
    return float(np.rad2deg(np.arctan2(step[1], step[0])))


def _on_chain(chain: Array, **points: Array) -> dict[str, Array]:
    return {
        name: at_arc_lengths(chain, nearest_arc_length(chain, point))
        for name, point in points.items()
    }


def _nasion(m: HeadMeasurements) -> Array:
    return np.array([m.glabella_projection_mm - 3.0, m.nasion_height_mm])


def _profile(
    m: HeadMeasurements,
    face: _ClosedFace,
    upper: _Lip,
    lower: _Lip,
    in_head: _Placing,
    with_jaw: _Placing,
) -> Array:
    """Silhouette from the forehead down; outside the sections it is only there to be seen."""
    nasion = _nasion(m)
    nose = _stretch(upper.chain, upper.margin, float(arc_lengths(upper.chain)[-1]))[::-1]
    dorsum_deg = _heading(nose[:2])
    glabella = np.array([m.glabella_projection_mm, nasion[1] + 12.0])
    forehead = in_head(
        through_landmarks(
            [
                glabella + _by(-26.0, 62.0),
                glabella + _by(-5.5, 28.0),
                glabella,
                nasion,
                nasion + 0.42 * (nose[0] - nasion) + _by(0.8, 0.3),
                nose[0],
            ],
            [-48.0, -76.0, -92.0, -88.0, dorsum_deg - 1.0, dorsum_deg],
        )
    )
    chin = with_jaw(_stretch(lower.chain, 0.0, lower.margin)[::-1])
    throat = chin[-1] + _by(-20.0, 4.5 - 0.3 * m.jaw_opening_deg)
    neck = through_landmarks(
        [chin[-1], throat, throat + _by(-14.0, -14.0), throat + _by(-9.0, -60.0)],
        [_heading(chin[-2:]), 186.0, 258.0, 284.0],
    )
    return np.concatenate([forehead[:-1], in_head(nose), chin, neck[1:]])


def _upper_jaw(lip: _Lip) -> Array:
    front = _stretch(lip.chain, 0.0, lip.fornix)
    top, bottom = front[0], front[-1]
    back = [
        bottom + _by(-9.0, 1.0),
        bottom + _by(-26.0, 3.0),
        [bottom[0] - 26.0, 2.0],
        top + _by(-9.0, 4.0),
    ]
    return np.concatenate([front, np.array(back)])


def _lower_jaw(lip: _Lip) -> Array:
    front = _stretch(lip.chain, lip.fornix, float(arc_lengths(lip.chain)[-1]))
    back = [front[-1] + _by(-3.0, 5.0), front[-1] + _by(4.0, 13.0), front[0] + _by(-13.0, -14.0)]
    return np.concatenate([front, np.array(back), [front[0] + _by(-10.0, 0.0)]])


def _refuse_overlap(section: HeadSection) -> None:
    upper, lower = (
        shapely.union_all([shapely.Polygon(p) for p in lip.regions.values()])
        for lip in (section.upper, section.lower)
    )
    if upper.intersects(lower):
        raise HeadError("the lips overlap: use a larger interlabial_gap_mm or jaw_opening_deg")
