"""Which end of a neck is its rim, told from where its thread is and how its ends are rounded."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry2d.neck import NeckSection

Array = NDArray[np.float64]

SPACING_MM = 0.05
"""Distance of the points of a wall that are looked at."""

COLUMN_MM = 0.2
"""Length of the pieces of a wall whose largest radius is taken."""

NEAR_END_MM, BEHIND_END_MM = 0.2, 1.0
"""Depths at which an end's thickness is compared: within a rounding, and behind it."""

THREAD_MM = 0.4
"""Height over a wall's slimmest place from which on something stands out of it."""


def crests_behind_marks(neck: NeckSection) -> int:
    """Return how many crests both walls have on the package's side of the marks.

    A thread lies between the rim and the marks: 0 if anything stands out there.
    """
    walls = [neck.upper_wall.sampled(SPACING_MM), neck.lower_wall.sampled(SPACING_MM)]
    axis = 0.5 * (walls[0][:, 1].max() + walls[1][:, 1].min())
    return min(_crests_behind(wall, axis) for wall in walls)


def _crests_behind(wall: Array, axis: float) -> int:
    radius = np.abs(wall[:, 1] - axis)
    column = np.floor(wall[:, 0] / COLUMN_MM).astype(int)
    columns = np.unique(column)
    outside = np.array([radius[column == each].max() for each in columns])
    # The rounded ends are slimmer than the wall is between them.
    wall_radius = np.median(outside[outside < np.median(outside) + THREAD_MM])
    high = outside > wall_radius + THREAD_MM
    if (columns[high] < 0).any():
        return 0
    return int(np.count_nonzero(np.diff(high.astype(int), prepend=0) > 0))


def end_fullness(neck: NeckSection) -> tuple[float, float]:
    """Return how full the ends of the walls are: at the rim, and at the end by the package.

    Thickness `NEAR_END_MM` inside an end over that `BEHIND_END_MM` inside, the mean of both walls:
    1 for an end that is cut square, less for one that is rounded.
    """
    walls = [shapely.Polygon(w.sampled(SPACING_MM)) for w in (neck.upper_wall, neck.lower_wall)]
    ends = []
    for side in (1.0, -1.0):
        shares = []
        for wall in walls:
            left, _, right, _ = wall.bounds
            start = left if side > 0 else right
            near, behind = (
                _thickness(wall, start + side * depth) for depth in (NEAR_END_MM, BEHIND_END_MM)
            )
            shares.append(near / behind if behind > 0 else 1.0)
        ends.append(float(np.mean(shares)))
    return ends[0], ends[1]


def _thickness(wall: shapely.Polygon, x: float) -> float:
    """Return the length of a wall's cut across the axis at x, mm."""
    _, bottom, _, top = wall.bounds
    cut = shapely.LineString([(x, bottom - 1.0), (x, top + 1.0)])
    return float(wall.intersection(cut).length)
