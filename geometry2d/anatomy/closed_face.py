"""Landmarks of a closed face from the measurements of a head. All lengths in mm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.anthropometry import HeadMeasurements
from geometry2d.rigid import rotated

Array = NDArray[np.float64]

CROWN_BULGE_MM = 0.4
"""Largest distance of a crown's front face from the line between its edge and the gum, mm."""
INSIDE_RISE_MM = 4.5
INSIDE_LEAN_MM = 0.7
"""The inner side of a lip leaves the teeth this far above (below) the thickest height of the lip,
and is inclined by this distance."""
NASION_DEPTH_MM = 3.0
"""Distance of the root of the nose behind the glabella, mm."""


def shift(x: float, y: float) -> Array:
    """Return the vector (2,) of a step, mm."""
    return np.array([x, y])


def hinge_from_ear(m: HeadMeasurements) -> Array:
    """Return the jaw's hinge axis (2,), mm from the ear marker."""
    return rotated([m.hinge_forward_mm, 0.0], np.deg2rad(m.hinge_above_deg))


@dataclass(frozen=True)
class ClosedFace:
    """Landmarks relative to subnasale with closed teeth; ``subnasale`` is relative to the ear."""

    subnasale: Array
    nasion: Array
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
    def of(cls, m: HeadMeasurements) -> ClosedFace:
        """Return the landmarks of some measurements."""
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
            subnasale=hinge_from_ear(m) + reach - lower_incisor,
            nasion=np.array([m.glabella_projection_mm - NASION_DEPTH_MM, m.nasion_height_mm]),
            nose_tip=np.array([m.nose_projection_mm, m.nose_tip_height_mm]),
            upper_lip=upper_lip,
            upper_border=np.array(
                [m.upper_lip_projection_mm - 1.0, upper_margin + m.upper_vermilion_mm]
            ),
            stomion_upper=np.array([upper_lip[0] - 0.38 * m.upper_lip_thickness_mm, upper_margin]),
            upper_inside=upper_inside,
            upper_incisor=upper_incisor,
            stomion_lower=np.array([lower_lip[0] - 0.40 * m.lower_lip_thickness_mm, lower_margin]),
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
    """Return the edge (2,) of an incisor with its front ``clearance`` mm behind the lip."""
    away = abs(edge_height - inside[1])
    front = inside[0] - clearance - INSIDE_LEAN_MM - CROWN_BULGE_MM
    return np.array([front + away * np.tan(np.deg2rad(slope_deg)), edge_height])
