"""Which end of a neck is its rim, told from where its thread is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from geometry2d.neck import NeckSection

Array = NDArray[np.float64]

SPACING_MM = 0.05
"""Distance of the points of a wall that are looked at."""

COLUMN_MM = 0.2
"""Length of the pieces of a wall whose largest radius is taken."""

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
