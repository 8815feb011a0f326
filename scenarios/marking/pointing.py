"""What a person points at and says of a film: positions, lengths, first contacts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from geometry2d.foundation.errors import DrinksimError

Point: TypeAlias = tuple[float, float]

POINTING_SIGMA_PX = 0.5
"""Standard error of a coordinate of a place that was pointed at and shows no spot."""

LEAST_RULER_PX = 10.0
LONGEST_RULER_MM = 5000.0


class MarkingError(DrinksimError):
    """Something that cannot be said about this film."""


@dataclass(frozen=True)
class SpotLook:
    """How a round spot looks.

    Attributes
    ----------
    radius_px, contrast
        Its radius, px, and its contrast, grey levels; negative for dark on light.
    blur_px
        Standard deviation of the blur of its edge, px.
    """

    radius_px: float
    contrast: float
    blur_px: float


@dataclass(frozen=True)
class PlacedPoint:
    """A position given by hand.

    Attributes
    ----------
    at, sigma_px
        The position and the standard error of a coordinate, px.
    look
        The look of the round spot whose centre this is; None where no spot was found.
    """

    at: Point
    sigma_px: float = POINTING_SIGMA_PX
    look: SpotLook | None = None


@dataclass(frozen=True)
class Length:
    """A distance between two marks and its standard error, mm."""

    mm: float
    sigma_mm: float = 0.0


@dataclass(frozen=True)
class Ruler:
    """Two points of known distance at a body's depth.

    Attributes
    ----------
    frame
        The frame that shows them.
    ends
        The points, px.
    length_mm
        Their distance, mm.
    """

    frame: int
    ends: tuple[Point, Point]
    length_mm: float


@dataclass(frozen=True)
class Touch:
    """The first contact of a lip: the frame, and where it is seen, px."""

    frame: int
    at: Point


def length_by_ruler(ruler_px: ArrayLike, marks_px: ArrayLike, length_mm: float) -> Length:
    """Return the distance between two marks that lie as deep in the picture as a ruler.

    Parameters
    ----------
    ruler_px, marks_px
        (2, 2) ends of the ruler and the marks, px, corrected for the lens.
    length_mm
        Distance between the ends of the ruler, mm.

    Raises
    ------
    MarkingError
        If the ruler is too short in the picture, or its length makes no sense.
    """
    ruler, marks = (float(np.hypot(*np.subtract(*np.asarray(p, float)))) for p in
                    (ruler_px, marks_px))  # fmt: skip
    if not 0 < length_mm <= LONGEST_RULER_MM:
        raise MarkingError(f"the ruler's length {length_mm:g} mm: give it in mm, more than 0")
    if ruler < LEAST_RULER_PX:
        raise MarkingError(
            f"the ruler's ends are {ruler:.0f} px apart: point at two that are farther apart"
        )
    share = POINTING_SIGMA_PX * math.sqrt(2.0) / ruler
    mm = length_mm * marks / ruler
    return Length(mm, mm * share)
