"""Incisors with the jaw behind the lips, as rigid outlines relative to subnasale, mm."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.anthropometry import HeadError, HeadMeasurements
from geometry2d.anatomy.closed_face import CROWN_BULGE_MM, ClosedFace, shift
from geometry2d.outline import Outline, OutlineError
from geometry2d.rigid import rotated

Array = NDArray[np.float64]


def upper_tooth(m: HeadMeasurements, face: ClosedFace, a_bone: Array) -> Outline:
    """Return the upper incisor with the jaw above it up to A, counter-clockwise from its edge."""
    up = rotated([0.0, 1.0], np.deg2rad(m.upper_crown_slope_deg))
    edge, crown, depth = face.upper_incisor, m.upper_crown_mm, m.upper_crown_depth_mm
    gum = edge + crown * up
    top = a_bone - [m.tooth_clearance_mm, 0.0]
    corners = [
        edge,
        edge + 0.45 * crown * up + shift(CROWN_BULGE_MM, 0.0),
        gum + shift(0.1, 0.0),
        top,
        top + shift(-depth - 1.0, 0.5),
        gum + shift(-depth, 1.5),
        edge + 0.38 * crown * up + shift(-1.75, 0.0),  # the hollow in which the lower incisor bites
        edge + shift(-1.7, 0.5),
    ]
    return _rounded_tooth("upper", corners, [0.7, 12.0, 8.0, 1.5, 1.5, 3.0, 5.0, 0.6])


def lower_tooth(m: HeadMeasurements, face: ClosedFace, b_bone: Array) -> Outline:
    """Return the lower incisor with the jaw below it down to B, counter-clockwise from below."""
    down = rotated([0.0, -1.0], -np.deg2rad(m.lower_crown_slope_deg))
    edge, crown, depth = face.lower_incisor, m.lower_crown_mm, m.lower_crown_depth_mm
    gum = edge + crown * down
    bottom = b_bone - [m.tooth_clearance_mm, 0.0]
    corners = [
        bottom,
        gum + shift(0.1, 0.0),
        edge + 0.45 * crown * down + shift(CROWN_BULGE_MM, 0.0),
        edge,
        edge + shift(-1.6, -0.5),
        gum + shift(-depth, -1.5),
        bottom + shift(-depth - 1.0, -0.5),
    ]
    return _rounded_tooth("lower", corners, [1.5, 8.0, 12.0, 0.7, 0.6, 3.0, 1.5])


def _rounded_tooth(name: str, corners: list[Array], radii: list[float]) -> Outline:
    try:
        return Outline.from_corners(corners, radii)
    except OutlineError as error:
        raise HeadError(
            f"the {name} incisor and the jaw behind the lip do not form one body ({error}): bring "
            f"{name}_lip_thickness_mm and the thickness over the bone closer together"
        ) from error
