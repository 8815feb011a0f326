"""The skin of a lip as a line, on which places are told by their distance from the margin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.head import HeadSection
from geometry2d.curves import nearest_arc_length

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LipSkin:
    """The skin of a lip as a line, on which places are told by their distance from the margin.

    Attributes
    ----------
    points
        (n, 2) undeformed skin in the head section's frame, the tissue on its left, mm.
    margin_mm
        Arc length of the lip's margin (stomion) on it, mm.
    outwards
        1 where arc length grows from the mouth to the face, −1 where it shrinks.
    """

    points: Array
    margin_mm: float
    outwards: int

    @classmethod
    def of(cls, head: HeadSection, lip: str) -> LipSkin:
        """Return the skin of the "upper" or the "lower" lip of a head."""
        points = getattr(head, lip).curves["skin"]
        margin = nearest_arc_length(points, head.landmarks[f"stomion_{lip}"])
        return cls(points, margin, 1 if lip == "upper" else -1)

    def arc_mm(self, place_mm: float) -> float:
        """Return the arc length of a place, mm from the margin and positive towards the face."""
        return self.margin_mm + self.outwards * place_mm

    def place_mm(self, arc_mm: float) -> float:
        """Return the place of an arc length, the inverse of :meth:`arc_mm`."""
        return self.outwards * (arc_mm - self.margin_mm)
