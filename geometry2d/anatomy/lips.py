"""The two deformable lips of a closed face, each as one smooth curve.

Bone, free inner side, lip margin and skin follow one another without a corner: there is no singular
point at which a refined mesh would diverge. Where the tie to the bone ends, the boundary continues
at a small distance in front of the teeth. All coordinates are relative to subnasale, mm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from geometry2d.anatomy.anthropometry import HeadError, HeadMeasurements
from geometry2d.anatomy.closed_face import INSIDE_RISE_MM, ClosedFace, shift
from geometry2d.anatomy.lip_section import lip_section
from geometry2d.anatomy.teeth import lower_tooth, upper_tooth
from geometry2d.curves import (
    arc_lengths,
    at_arc_lengths,
    heading_deg,
    left_normals,
    nearest_arc_length,
    resampled,
    smoothed,
    stretch,
    through_landmarks,
)
from geometry2d.outline import Outline
from geometry2d.regions import Section
from geometry2d.rigid import rotated

Array = NDArray[np.float64]
Placing = Callable[[ArrayLike], Array]
"""Maps points (n, 2) of the closed face, relative to subnasale, into the head."""

POLYLINE_SPACING_MM = 0.1
SMOOTHING_WIDTH_MM = 0.6
"""Gaussian width that smooths the curvature, mm; moves a lip margin of radius 5 mm by 0.04 mm."""
DERMIS_BLEND_MM = 3.0
"""Arc length over which the thickness of the dermis changes from skin to vermilion, mm."""
INSIDE_HEADING_DEG = 68.0
"""Slope of a lip's inner side where the lip is thickest."""
ANGLE_CORRECTIONS = 3
FOLD_HEADING_DEG = 86.0
"""Direction of the skin at the labiomental fold, upwards."""
FOLD_TO_BONE_MM = 3.5
"""Least distance of the fold between lip and jaw from the hollows A and B of the bone, mm."""
SUBMENTAL_LENGTH_MM = 22.0
"""Distance behind menton at which the lower section is cut off, mm."""

DERMIS_PLACES: Mapping[str, str] = {
    "a_point": "philtrum_dermis_mm",
    "pronasale": "nose_dermis_mm",
    "sulcus": "fold_dermis_mm",
    "pogonion": "chin_dermis_mm",
    "menton": "submental_dermis_mm",
}
"""Landmarks at which the dermis may be measured; between two of them it is monotonic."""


@dataclass(frozen=True)
class Lip:
    """One lip of the closed face: its boundary as one smooth curve, relative to subnasale.

    Attributes
    ----------
    chain
        (n, 2) boundary, mm, with the tissue on its left: bone, inner side, lip margin and skin of
        the upper lip; the reverse order for the lower lip.
    bone_first
        Whether this is the upper lip.
    fornix, margin, border
        Arc lengths, mm, of the fold between lip and jaw, of the lip's edge, and of the border
        between skin and vermilion.
    tooth
        The incisor and the jaw behind the lip.
    landmarks
        Named points (2,) on the chain.
    """

    chain: Array
    bone_first: bool
    fornix: float
    margin: float
    border: float
    tooth: Outline
    landmarks: Mapping[str, Array]

    def section(self, name: str, m: HeadMeasurements, placed: Placing) -> Section:
        """Return the lip as named curves and regions; ``placed`` maps it into the head.

        Raises
        ------
        HeadError
            If the dermis leaves no free inner side.
        RegionError
            If the dermis is thicker than the skin's curvature allows.
        """
        along = arc_lengths(self.chain)
        sign = 1.0 if self.bone_first else -1.0
        dermis_end = self.margin - sign * m.dermis_wrap_mm
        inner_length = sign * (dermis_end - self.fornix)
        if inner_length < 1.0:
            raise HeadError(
                f"the {name} lip's dermis leaves {inner_length:.1f} mm of free inner side before "
                "the bone, at least 1 mm is needed: use a smaller dermis_wrap_mm or a larger "
                "vestibule_depth_mm"
            )
        low, high = (dermis_end, along[-1]) if self.bone_first else (0.0, dermis_end)
        skin = stretch(self.chain, low, high)
        s = low + arc_lengths(skin)
        interface = skin + left_normals(skin) * self._thickness(s, m)[:, None]
        if self.bone_first:
            bone = stretch(self.chain, 0.0, self.fornix)
            inner = stretch(self.chain, self.fornix, dermis_end)
        else:
            inner = stretch(self.chain, dermis_end, self.fornix)
            bone = stretch(self.chain, self.fornix, along[-1])
        return lip_section(
            name,
            skin=placed(skin),
            interface=placed(interface),
            inner=placed(inner),
            bone=placed(bone),
            margin=self.margin - low,
        )

    def _thickness(self, s: Array, m: HeadMeasurements) -> Array:
        """Return the thickness of the dermis (n,), mm, at arc lengths (n,), mm."""
        outwards = (s - self.border) if self.bone_first else (self.border - s)
        t = np.clip(0.5 + outwards / DERMIS_BLEND_MM, 0.0, 1.0)
        blend: Array = t * t * (3 - 2 * t)
        return m.vermilion_thickness_mm + blend * (self._skin(s, m) - m.vermilion_thickness_mm)

    def _skin(self, s: Array, m: HeadMeasurements) -> Array:
        """Return the thickness of the dermis (n,), mm, of a lip without vermilion."""
        measured = {
            nearest_arc_length(self.chain, self.landmarks[place]): getattr(m, name)
            for place, name in DERMIS_PLACES.items()
            if place in self.landmarks
        }
        along = sorted(measured)
        thickness = [m.dermis_thickness_mm if measured[a] is None else measured[a] for a in along]
        between: Array = PchipInterpolator(along, thickness)(np.clip(s, along[0], along[-1]))
        return between


def upper_lip(m: HeadMeasurements, face: ClosedFace) -> Lip:
    """Return the upper lip with the base and tip of the nose."""
    columella_deg = (
        np.rad2deg(np.arctan2(face.upper_lip[1], face.upper_lip[0])) + m.nasolabial_angle_deg
    )
    columella = rotated([0.5 * m.nose_projection_mm, 0.0], np.deg2rad(columella_deg))
    supratip = face.nose_tip + shift(-0.19 * m.nose_projection_mm, 0.42 * m.nose_projection_mm)
    dorsum_deg = float(np.rad2deg(np.arctan2(*(face.nasion - supratip)[::-1])))
    cut = supratip + 0.13 * (face.nasion - supratip)
    inwards = rotated([1.0, 0.0], np.deg2rad(dorsum_deg + 90.0))
    bone_top = cut + m.nose_thickness_mm * inwards
    a_height = 0.25 * -m.upper_lip_length_mm
    a_bone = np.array([m.a_point_projection_mm - m.a_point_thickness_mm, a_height])
    spine = np.array([-0.8 * m.a_point_thickness_mm, 2.5])
    tooth = upper_tooth(m, face, a_bone)
    front = _in_front_of(
        tooth,
        m.tooth_clearance_mm,
        start_height=min(
            face.upper_incisor[1] + m.upper_crown_mm + m.vestibule_depth_mm,
            a_height - FOLD_TO_BONE_MM,
        ),
        end_height=face.upper_inside[1] + INSIDE_RISE_MM,
    )
    bone = through_landmarks(
        [bone_top, spine, a_bone + shift(0.3, 0.0), front[0]],
        [dorsum_deg + 105.0, 255.0, 275.0, heading_deg(front[:2])],
    )
    lip_deg = float(np.rad2deg(np.arctan2(-face.upper_lip[1], -face.upper_lip[0])))
    skin = through_landmarks(
        [
            front[-1],
            face.upper_inside,
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
            heading_deg(front[-2:]),
            -INSIDE_HEADING_DEG,
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
    return Lip(
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
            a_point=np.array([m.a_point_projection_mm, a_height]),
            upper_lip=face.upper_lip,
            labrale_superius=face.upper_border,
            stomion_upper=face.stomion_upper,
        ),
    )


def lower_lip(m: HeadMeasurements, face: ClosedFace) -> Lip:
    """Return the lower lip with the chin and the start of the neck."""
    b_bone = face.sulcus - [m.sulcus_thickness_mm, 0.0]
    tooth = lower_tooth(m, face, b_bone)
    front = _in_front_of(
        tooth,
        m.tooth_clearance_mm,
        start_height=face.lower_inside[1] - INSIDE_RISE_MM,
        end_height=max(
            face.lower_incisor[1] - m.lower_crown_mm - m.vestibule_depth_mm,
            face.sulcus[1] + FOLD_TO_BONE_MM,
        ),
    )
    behind = np.array([-SUBMENTAL_LENGTH_MM, 1.5])
    cut = face.menton + behind
    bone_end = cut + shift(-0.5, m.menton_thickness_mm + 2.0)
    bone = through_landmarks(
        [
            front[-1],
            b_bone + shift(0.3, 0.0),
            face.pogonion - [m.pogonion_thickness_mm, 0.0],
            face.menton + shift(-2.0, m.menton_thickness_mm),
            bone_end,
        ],
        [heading_deg(front[-2:]), 271.0, 268.0, 190.0, 176.0],
    )

    def drawn(lip_deg: float) -> Array:
        skin = through_landmarks(
            [
                cut,
                face.menton,
                face.pogonion,
                face.sulcus,
                face.lower_border,
                face.lower_lip,
                face.stomion_lower,
                face.lower_inside,
                front[0],
            ],
            [
                -4.0,
                0.0,
                90.0,
                FOLD_HEADING_DEG,
                lip_deg,
                90.0,
                180.0,
                180.0 + INSIDE_HEADING_DEG,
                heading_deg(front[:2]),
            ],
        )
        return smoothed(
            resampled(np.concatenate([skin[:-1], front, bone[1:]]), POLYLINE_SPACING_MM),
            SMOOTHING_WIDTH_MM,
        )

    # Smoothing rotates the tangent slightly: the angle is corrected by its measured error.
    lip_deg = m.mentolabial_angle_deg - 67.0
    for _ in range(ANGLE_CORRECTIONS):
        lip_deg += m.mentolabial_angle_deg - _mentolabial_angle_deg(drawn(lip_deg), face)
    chain = drawn(lip_deg)
    return Lip(
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


def _mentolabial_angle_deg(chain: Array, face: ClosedFace) -> float:
    """Return the angle between the tangent at the vermilion border and the chin's steepest one."""
    border, fold, chin = (
        nearest_arc_length(chain, point)
        for point in (face.lower_border, face.sulcus, face.pogonion)
    )
    lip_deg = heading_deg(at_arc_lengths(chain, [border - 0.5, border + 0.5]))
    step = np.diff(stretch(chain, chin, fold), axis=0)
    chin_deg = float(np.rad2deg(np.max(np.arctan2(step[:, 1], step[:, 0]))))
    return 180.0 - (chin_deg - lip_deg)


def _in_front_of(
    tooth: Outline, clearance: float, *, start_height: float, end_height: float
) -> Array:
    """Return points (n, 2), mm, ``clearance`` in front of a tooth between two heights."""
    points = tooth.sampled(POLYLINE_SPACING_MM)
    projection = tooth.project(points)
    front = (
        points[projection.normal[:, 0] > 0.5]
        + clearance * (projection.normal[projection.normal[:, 0] > 0.5])
    )
    front = front[np.argsort(front[:, 1], kind="stable")]
    # The inner side of either lip is travelled downwards.
    low, high = end_height, start_height
    if not front[0, 1] < low < high < front[-1, 1]:
        raise HeadError(
            f"the lip's free inner side would run from {low:.1f} to {high:.1f} mm (from "
            f"subnasale) but the tooth's front only from {front[0, 1]:.1f} to "
            f"{front[-1, 1]:.1f} mm: change crown lengths, lip lengths or vestibule_depth_mm"
        )
    height = np.linspace(start_height, end_height, 1 + int((high - low) / POLYLINE_SPACING_MM))
    return np.column_stack([np.interp(height, front[:, 1], front[:, 0]), height])


def _on_chain(chain: Array, **points: Array) -> dict[str, Array]:
    return {
        name: at_arc_lengths(chain, nearest_arc_length(chain, point))
        for name, point in points.items()
    }
