"""Level of the liquid in a tilted container from its volume.

A container is cut in the plane in which it tilts. Its inside is a row of convex parts. The depth of
a part across that plane gives it its volume: a square carton is as deep as it is wide, a bore of
radius ``r`` is ``π r/2`` deep, the shoulder between them has the mean of both. The volume below a
level is the sum of polygon areas times depths. The level of the liquid is the root of its volume.

The free surface is horizontal: it follows the tilt at once and does not slosh. Walls do not bulge,
and air replaces the liquid that flows out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from geometry2d.foundation.errors import DrinksimError
from geometry2d.neck import NeckMeasurements

Array = NDArray[np.float64]


class ContainerError(DrinksimError):
    """A volume or a direction that does not fit a container."""


@dataclass(frozen=True)
class ContainerPart:
    """A part of a container's inside.

    Attributes
    ----------
    polygon
        (n, 2) convex section, counter-clockwise, mm.
    depth_mm
        Depth across the section, mm.
    """

    polygon: Array
    depth_mm: float

    def volume_below(self, level_mm: float, up: Array) -> float:
        """Return the volume, mm³, of the points ``x`` with ``up·x`` below a level, mm."""
        height = self.polygon @ up - level_mm
        corners: list[Array] = []
        for a, b, ha, hb in zip(
            self.polygon, np.roll(self.polygon, -1, axis=0), height, np.roll(height, -1),
            strict=True,
        ):  # fmt: skip
            if ha <= 0:
                corners.append(a)
            if ha * hb < 0:
                corners.append(a + ha / (ha - hb) * (b - a))
        if len(corners) < 3:
            return 0.0
        x, y = np.array(corners).T
        return 0.5 * self.depth_mm * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


@dataclass(frozen=True)
class Container:
    """Inside of a container, cut in the plane in which it tilts.

    Attributes
    ----------
    parts
        Its parts; they share edges and do not overlap.
    """

    parts: tuple[ContainerPart, ...]
    capacity_mm3: float = field(init=False, compare=False)
    """Volume of the container, full to the rim, mm³."""

    def __post_init__(self) -> None:
        everywhere = (part.volume_below(math.inf, np.array([0.0, 1.0])) for part in self.parts)
        object.__setattr__(self, "capacity_mm3", sum(everywhere))

    def volume_below(self, level_mm: float, up: ArrayLike) -> float:
        """Return the volume, mm³, of the points ``x`` with ``up·x`` below a level, mm."""
        upwards = _unit(up)
        return sum(part.volume_below(level_mm, upwards) for part in self.parts)

    def level(self, volume_mm3: float, up: ArrayLike) -> float:
        """Return the level ``up·x`` of the free surface, mm, of a volume of liquid.

        Parameters
        ----------
        volume_mm3
            Volume of the liquid, mm³.
        up
            (2,) upward direction in the frame of the container.

        Raises
        ------
        ContainerError
            If the volume is negative, or larger than the container's.
        """
        if not 0 <= volume_mm3 <= self.capacity_mm3:
            raise ContainerError(
                f"a volume of {1e-3 * volume_mm3:g} ml does not fit into a container that holds "
                f"{1e-3 * self.capacity_mm3:.0f} ml: give 0 to that"
            )
        upwards = _unit(up)
        heights = np.concatenate([part.polygon @ upwards for part in self.parts])
        low, high = float(heights.min()), float(heights.max())
        if volume_mm3 == 0:
            return low
        if volume_mm3 == self.capacity_mm3:
            return high

        def missing(level: float) -> float:
            return self.volume_below(level, upwards) - volume_mm3

        return float(brentq(missing, low, high, xtol=1e-12 * (high - low), rtol=1e-14))


def carton(m: NeckMeasurements) -> Container:
    """Return the inside of a package in the neck frame, mm.

    Its parts from the rim along x are the bore, the shoulder and the carton, which is as deep as it
    is wide.
    """
    axis, bore = 0.5 * m.mark_distance_mm, 0.5 * m.root_diameter_mm - m.wall_thickness_mm
    half = 0.5 * m.package_width_mm
    rim = -m.mark_depth_mm
    shoulder = m.carton_from_mm
    body, end = shoulder + m.shoulder_mm, shoulder + m.package_height_mm
    widths = [(rim, bore), (shoulder, bore), (body, half), (end, half)]
    bore_depth = 0.5 * math.pi * bore
    depths = [bore_depth, 0.5 * (bore_depth + m.package_width_mm), m.package_width_mm]
    parts = []
    for (x0, r0), (x1, r1), depth in zip(widths[:-1], widths[1:], depths, strict=True):
        corners = [(x0, axis - r0), (x1, axis - r1), (x1, axis + r1), (x0, axis + r0)]
        parts.append(ContainerPart(np.array(corners), depth))
    return Container(tuple(parts))


def _unit(up: ArrayLike) -> Array:
    vector = np.asarray(up, float)
    length = float(np.hypot(*vector))
    if not (np.isfinite(length) and length > 0):
        raise ContainerError(
            f"up = {vector.tolist()} is no direction: give two numbers, not both 0"
        )
    unit: Array = vector / length
    return unit
