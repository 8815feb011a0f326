"""Approximation of free curves by pairs of arcs with a common tangent."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Curve = Callable[[float], tuple[Array, Array]]
"""Maps a parameter in 0 ... 1 to point (2,) and derivative (2,)."""

DEEPEST = 14
"""Largest number of bisections of a free curve; then a line replaces it, as at a cusp."""


def append_arcs(
    curve: Curve, low: float, high: float, tolerance: float, depth: int,
    pieces: list[tuple[Array, float]],
) -> None:  # fmt: skip
    """Append end points and curvatures of the arcs that approximate a part of a curve."""
    start, end = curve(low)[0], curve(high)[0]
    samples = np.array([curve(low + (high - low) * k / 6)[0] for k in range(1, 6)])
    if np.all(np.abs(np.array([*samples, end]) - start) < 0.1 * tolerance):
        pieces.append((end, 0.0))
        return
    pair = biarc(start, _direction(curve, low, +1), end, _direction(curve, high, -1))
    if pair is not None and pair.largest_distance(samples) <= tolerance:
        pieces += [(pair.joint, pair.first), (end, pair.second)]
        return
    if depth >= DEEPEST:
        pieces.append((end, 0.0))
        return
    middle = 0.5 * (low + high)
    append_arcs(curve, low, middle, tolerance, depth + 1, pieces)
    append_arcs(curve, middle, high, tolerance, depth + 1, pieces)


def _direction(curve: Curve, at: float, towards: int) -> Array:
    """Return the unit tangent (2,); at coinciding control points that of a near point."""
    for inwards in (0.0, 1e-6, 1e-4):
        tangent = curve(at + towards * inwards)[1]
        size = float(np.hypot(*tangent))
        if size > 1e-9:
            unit: Array = tangent / size
            return unit
    return np.zeros(2)


class Biarc(NamedTuple):
    """Two arcs with a common tangent at their joint and given tangents at their ends."""

    start: Array
    leaving: Array
    joint: Array
    middle: Array
    end: Array
    arriving: Array
    first: float
    second: float

    def largest_distance(self, points: Array) -> float:
        """Return the largest distance, mm, of near points (n, 2) from the arcs, to first order."""
        before = (points - self.joint) @ self.middle < 0
        from_start, from_end = points - self.start, points - self.end
        first = _cross(self.leaving, from_start) - 0.5 * self.first * np.sum(from_start**2, axis=1)
        last = _cross(self.arriving, from_end) - 0.5 * self.second * np.sum(from_end**2, axis=1)
        return float(np.max(np.abs(np.where(before, first, last))))


def biarc(start: Array, leaving: Array, end: Array, arriving: Array) -> Biarc | None:
    """Return the two arcs with given ends and tangents and with control legs of equal length.

    With v = end − start and legs d: v·v = 2 d v·(t₀ + t₁) + 2 d² (1 − t₀·t₁). None if an arc would
    exceed a quarter turn.
    """
    v = end - start
    a, b, c = 2 * (1 - leaving @ arriving), v @ (leaving + arriving), v @ v
    below = b + np.sqrt(b * b + a * c)
    if c == 0 or below <= 1e-3 * np.sqrt(c):
        return None
    leg = c / below
    joint = 0.5 * (start + leg * leaving + end - leg * arriving)
    along = end - leg * arriving - start - leg * leaving
    first, last = joint - start, end - joint
    size = float(np.hypot(*along))
    if size == 0 or leaving @ first <= 0 or arriving @ last <= 0:
        return None
    bends = (
        float(2 * _cross(leaving, first) / (first @ first)),
        float(2 * _cross(last, arriving) / (last @ last)),
    )
    for bend, chord in zip(bends, (first, last), strict=True):
        if abs(bend) * np.hypot(*chord) > np.sqrt(2):
            return None
    straight = [
        0.0 if abs(bend) * (chord @ chord) < 1e-9 else bend
        for bend, chord in zip(bends, (first, last), strict=True)
    ]
    return Biarc(start, leaving, joint, along / size, end, arriving, straight[0], straight[1])


def bezier(control: ArrayLike) -> Curve:
    """Return the Bézier curve of control points (n, 2)."""
    points = np.asarray(control, float)

    def curve(t: float) -> tuple[Array, Array]:
        level, before = points, points
        while len(level) > 1:
            before, level = level, (1 - t) * level[:-1] + t * level[1:]
        return level[0], (len(points) - 1) * (before[-1] - before[0])

    return curve


def _cross(a: Array, b: Array) -> Array:
    """Return the cross product of vectors (..., 2): positive if ``b`` is to the left of ``a``."""
    product: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product
