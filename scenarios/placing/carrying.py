"""A neck that was not filmed, carried in place of the one that was.

The recording shows where the filmed neck's marks are. Another neck has other threads and other
marks, and nobody holds it by its marks: a person brings its rim to the lips. So it is carried by an
edge of its rim, which takes the place that the filmed neck's has at every instant; axes stay
parallel. Threads, marks and lengths then change what they are and move nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from geometry2d.neck import NeckSection
from geometry2d.rigid import RigidMotion

Array = NDArray[np.float64]

Anchor = Literal["lower_rim", "rim_centre", "marks"]
"""What of the neck is where it was on the filmed one."""


@dataclass(frozen=True)
class CarriedNeck:
    """A neck in place of the filmed one.

    Attributes
    ----------
    motion
        Of its frame, in the frame that the filmed neck's motion was given in.
    shift_mm
        (2,) along and across the filmed neck's axis, from its lower mark to that of this neck.
    anchor
        What of it is where it was on the filmed neck.
    """

    motion: RigidMotion
    shift_mm: tuple[float, float]
    anchor: Anchor

    def about(self) -> dict[str, object]:
        """Return the numbers for the summary."""
        along, across = self.shift_mm
        return {
            "anchor": self.anchor,
            "shift_along_axis_mm": along,
            "shift_across_axis_mm": across,
        }


def anchor_point(neck: NeckSection, anchor: Anchor) -> Array:
    """Return the point (2,) of a neck, in its own frame, that an anchor holds, mm."""
    if anchor == "marks":
        return np.asarray(neck.lower_mark, float)
    lower = neck.rim_edge("lower")
    if anchor == "lower_rim":
        return lower
    middle: Array = 0.5 * (lower + neck.rim_edge("upper"))
    return middle


def carried(
    motion: RigidMotion, filmed: NeckSection, neck: NeckSection, anchor: Anchor
) -> CarriedNeck:
    """Return another neck carried as the filmed one was.

    Parameters
    ----------
    motion
        Of the filmed neck's frame.
    filmed, neck
        The neck that was filmed, and the one that takes its place; the same one is not moved.
    anchor
        What of them coincides at every instant.
    """
    offset = anchor_point(filmed, anchor) - anchor_point(neck, anchor)
    if not offset.any():
        return CarriedNeck(motion, (0.0, 0.0), anchor)
    along, across = offset.tolist()
    cosine, sine = np.cos(motion.angle_rad), np.sin(motion.angle_rad)
    turned = np.column_stack([cosine * along - sine * across, sine * along + cosine * across])
    moved = RigidMotion(motion.time_s, motion.angle_rad, motion.shift_mm + turned)
    return CarriedNeck(moved, (along, across), anchor)
