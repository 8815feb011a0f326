"""A mid-sagittal head from named soft-tissue measurements, as two deformable lips and rigid teeth.

The face is first constructed with closed teeth and relaxed lips, relative to subnasale (the point
where nose and lip meet), as in cephalometry: projections are horizontal distances from the true
vertical through subnasale. Everything below the lip gap is then rotated about the jaw's hinge. All
defaults describe an adult man: the recorded person of the thesis is a man.

Section frame: origin at the ear marker (the tragus), x forward, y up, head in natural position, mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry2d.anatomy.anthropometry import HeadError, HeadMeasurements
from geometry2d.anatomy.closed_face import ClosedFace, hinge_from_ear, shift
from geometry2d.anatomy.likeness import face_profile, lower_jaw, mouth, upper_jaw
from geometry2d.anatomy.lips import lower_lip, upper_lip
from geometry2d.outline import Outline
from geometry2d.regions import Section
from geometry2d.rigid import rotated

Array = NDArray[np.float64]

__all__ = ["HeadError", "HeadMeasurements", "HeadSection", "head_section"]


@dataclass(frozen=True)
class HeadSection:
    """A head for the simulation and for pictures, in the section frame, mm.

    Attributes
    ----------
    upper, lower
        Upper lip with the base of the nose; lower lip with the chin. Regions "dermis" and "bulk",
        boundaries "skin", "inner", "bone" and "cut"; the tissue lies on the left of each curve.
    upper_tooth, lower_tooth
        Incisor with the jaw in front of which the lip is free, as a rigid outline.
    upper_jaw, lower_jaw
        (n, 2) polygons of the bones, for drawing.
    mouth
        (n, 2) polygon of the mouth's cavity, for drawing.
    profile
        (n, 2) silhouette from the forehead through the lips to the neck, for drawing.
    landmarks
        Named points (2,).
    tie_fade_mm
        Arc length along "bone", from its end next to "inner", over which the tie fades in, mm.
    """

    upper: Section
    lower: Section
    upper_tooth: Outline
    lower_tooth: Outline
    upper_jaw: Array
    lower_jaw: Array
    mouth: Array
    profile: Array
    landmarks: Mapping[str, Array]
    tie_fade_mm: float


def head_section(measurements: HeadMeasurements | None = None) -> HeadSection:
    """Return the head of some measurements, with its jaw opened.

    Raises
    ------
    HeadError
        If the measurements contradict one another, so that tissue would have no thickness.
    RegionError
        If the profile crosses itself.
    """
    m = HeadMeasurements() if measurements is None else measurements
    face = ClosedFace.of(m)
    upper = upper_lip(m, face)
    lower = lower_lip(m, face)
    hinge = hinge_from_ear(m)
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
        "jaw_front": with_jaw(face.pogonion + shift(-11.0, -1.0)),
        "jaw_back": with_jaw(face.pogonion + shift(-37.0, 10.0)),
        "upper_incisor": in_head(face.upper_incisor),
        "lower_incisor": with_jaw(face.lower_incisor),
    }
    section = HeadSection(
        upper=upper.section("upper", m, in_head),
        lower=lower.section("lower", m, with_jaw),
        upper_tooth=upper.tooth.moved(0.0, face.subnasale),
        lower_tooth=lower.tooth.moved(jaw_turn, rotated(face.subnasale - hinge, jaw_turn) + hinge),
        upper_jaw=in_head(upper_jaw(upper)),
        lower_jaw=with_jaw(lower_jaw(lower)),
        mouth=mouth(upper, lower, in_head, with_jaw),
        profile=face_profile(m, face, upper, lower, in_head, with_jaw),
        landmarks=landmarks,
        tie_fade_mm=m.tie_fade_mm,
    )
    _refuse_overlap(section)
    return section


def _nose_marker(m: HeadMeasurements, nose_tip: Array) -> Array:
    """Return the marker (2,) on the side of the nose, on the line from the ear to its tip."""
    reach = float(np.hypot(*nose_tip))
    if m.ear_nose_mm > reach:
        raise HeadError(
            f"ear_nose_mm is {m.ear_nose_mm} but the nose tip is only {reach:.1f} mm from the ear: "
            "use a smaller distance or a larger hinge_incisor_mm"
        )
    return nose_tip * (m.ear_nose_mm / reach)


def _refuse_overlap(section: HeadSection) -> None:
    upper, lower = (
        shapely.union_all([shapely.Polygon(p) for p in lip.regions.values()])
        for lip in (section.upper, section.lower)
    )
    if upper.intersects(lower):
        raise HeadError("the lips overlap: use a larger interlabial_gap_mm or jaw_opening_deg")
