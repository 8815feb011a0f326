"""What is said about a contact in one number: pressure over elements and windows, length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WINDOW_MM = 0.5
"""Length of deformed lip over which the window pressure is averaged (DESIGN, files)."""


@dataclass(frozen=True)
class ContactLine:
    """Normal load along a surface: edges with integration points, in order along the surface.

    Attributes
    ----------
    load
        (m, q) normal force per thickness that each point carries, N/mm.
    length
        (m, q) deformed length that each point stands for, mm.
    place
        (m, q) where each point lies along the deformed surface, mm, ascending.
    """

    load: Array
    length: Array
    place: Array

    def top_two_edges(self) -> float:
        """Return the mean pressure, MPa, of the two edges with the highest mean pressure.

        This is the measure of the thesis (Figures 4.16 and 4.17). It rises as edges get shorter.
        """
        pressure = np.sort(self.load.sum(axis=1) / self.length.sum(axis=1))
        return float(np.mean(pressure[-2:]))

    def highest_window(self, window_mm: float = WINDOW_MM) -> float:
        """Return the highest mean pressure, MPa, over any ``window_mm`` of the deformed surface.

        The pressure is constant over the length that a point stands for, so the load up to a place
        is piecewise linear and the highest window starts or ends where two points meet.
        """
        ends = np.concatenate([[0.0], np.cumsum(self.length.ravel())])
        load = np.concatenate([[0.0], np.cumsum(self.load.ravel())])
        if ends[-1] <= window_mm:
            return float(load[-1] / ends[-1])
        starts = np.concatenate([ends, ends - window_mm])
        starts = starts[(starts >= 0) & (starts <= ends[-1] - window_mm)]
        within = np.interp(starts + window_mm, ends, load) - np.interp(starts, ends, load)
        return float(np.max(within)) / window_mm

    def contact_length(self) -> float:
        """Return the deformed length that carries load, mm.

        Where contact ends, pressure falls like the root of the distance, and its square is a
        parabola if the contact is Hertz's: that through the last three points is followed to zero,
        but not past the first free point. A count of loaded points alone would jump by what one of
        them stands for.
        """
        place, point = np.unique(self.place, return_inverse=True)  # edges may share their ends
        length, load = (
            np.bincount(point.ravel(), values.ravel()).astype(float)
            for values in (self.length, self.load)
        )
        squared = (load / length) ** 2
        loaded = np.concatenate([[False], squared > 0, [False]])
        firsts = np.flatnonzero(loaded[1:] & ~loaded[:-1])
        lasts = np.flatnonzero(loaded[:-1] & ~loaded[1:]) - 1
        total = 0.0
        for first, last in zip(firsts, lasts, strict=True):
            total += float(place[last] - place[first])
            for end, outwards in ((first, -1), (last, 1)):
                total += _beyond(place, length, squared, int(end), outwards, alone=first == last)
        return total


def _beyond(
    place: Array, length: Array, squared: Array, end: int, outwards: int, *, alone: bool
) -> float:
    """Return how far contact reaches beyond its last loaded point, mm."""
    outside = end + outwards
    if not 0 <= outside < place.size:
        return float(0.5 * length[end])
    room = abs(place[outside] - place[end])
    if alone:
        return float(0.5 * room)
    inside, deeper = end - outwards, end - 2 * outwards
    step = abs(place[end] - place[inside])
    slope = (squared[inside] - squared[end]) / step
    if slope <= 0:
        return float(room)
    bend = 0.0  # half of the second derivative; less than none is no contact's end
    if 0 <= deeper < place.size and squared[deeper] > 0:
        before = (squared[deeper] - squared[inside]) / abs(place[inside] - place[deeper])
        bend = max(0.0, (slope - before) / abs(place[end] - place[deeper]))
    # p² = p²(end) − (slope + bend step) d − bend d² at the distance d beyond the last point
    falling = slope + bend * step
    root = np.sqrt(falling**2 + 4 * bend * squared[end])
    return float(min(room, 2 * squared[end] / (falling + root)))
