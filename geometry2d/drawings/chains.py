"""Curves of drawings as chains of lines and arcs.

Free curves (splines, ellipses, Bézier curves) are approximated by pairs of arcs with a common
tangent: an outline is smooth where its drawing is, without facets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.drawings.biarcs import Curve, append_arcs, bezier
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.text import quoted

Array = NDArray[np.float64]

FIT_MM = 2e-3
"""Largest distance between a free curve and its arcs, mm."""

LARGEST_MM = 1e4
"""Largest coordinate of a drawing, mm; a larger one means a wrong unit."""


SMALLEST = 1e-9
"""Smallest radius and scale of a curve, in any unit."""

FULLEST_TURN = 1e-4
"""Least difference of an arc between two points from a full circle, rad."""

MOST_PIECES = 30_000
FITTED_COUNTS = 3
"""Largest number of lines and arcs of a drawing; one of a fitted free curve counts three times."""


class DrawingError(DrinksimError):
    """A drawing or a surface that cannot be read or used."""


class PieceCount:
    """Counter of the lines and arcs of a drawing, which limits their number.

    Parameters
    ----------
    file
        Name of the drawing, for the message.
    """

    def __init__(self, file: str) -> None:
        self._file, self._count = file, 0

    def counted(self, chain: Chain, *, fitted: bool = False) -> Chain:
        """Return the chain and count it; ``fitted``: it approximates a free curve.

        Raises
        ------
        DrawingError
            If the drawing has more than ``MOST_PIECES``.
        """
        self._count += len(chain.curvature) * (FITTED_COUNTS if fitted else 1)
        if self._count > MOST_PIECES:
            raise DrawingError(
                f"{self._file}: {quoted(chain.name)} and what stands before it need more than "
                f"{MOST_PIECES} lines and arcs: simplify the curve, or delete what is not needed"
            )
        return chain


@dataclass(frozen=True)
class Chain:
    """A connected sequence of lines and arcs.

    Parameters
    ----------
    name
        Its name in the file.
    points
        (n + 1, 2) start and end points of the pieces, mm.
    curvature
        (n,) signed curvature of each piece, 1/mm, 0 for a line, positive if it bends to the left;
        an arc spans at most half a circle.
    """

    name: str
    points: Array
    curvature: Array

    @classmethod
    def through(cls, name: str, points: ArrayLike) -> Chain:
        """Return the polyline through points (n, 2)."""
        p = np.asarray(points, float).reshape(-1, 2)
        return cls(name, p, np.zeros(max(0, len(p) - 1)))

    @classmethod
    def arc(cls, name: str, start: ArrayLike, end: ArrayLike, turn_rad: float) -> Chain:
        """Return the arc from ``start`` to ``end`` whose direction turns left by ``turn_rad``.

        The turn is less than a full circle. The arc is split into parts of at most a quarter.

        Raises
        ------
        DrawingError
            If the turn is a full one.
        """
        first, last = (np.asarray(p, float) for p in (start, end))
        chord = last - first
        if abs(turn_rad) < 1e-9 or not np.any(chord):
            return cls.through(name, [first, last])
        if not abs(turn_rad) <= 2 * np.pi - FULLEST_TURN:
            raise DrawingError(
                f"{quoted(name)} has an arc at {spot(first)} that turns by a full circle and "
                "ends elsewhere: draw it anew"
            )
        half = 0.5 * turn_rad
        left = np.array([-chord[1], chord[0]])
        centre = 0.5 * (first + last) + 0.5 * left / np.tan(half)
        return cls.about(name, centre, first, turn_rad, end=last)

    @classmethod
    def about(
        cls,
        name: str,
        centre: ArrayLike,
        start: ArrayLike,
        turn_rad: float,
        *,
        end: Array | None = None,
    ) -> Chain:
        """Return the arc about ``centre`` from ``start``, a full circle if ``turn_rad`` is 2π."""
        middle, first = np.asarray(centre, float), np.asarray(start, float)
        radius = float(np.hypot(*(first - middle)))
        if radius < SMALLEST:
            raise DrawingError(f"{quoted(name)} has an arc of radius zero at {spot(first)}")
        count = max(1, int(np.ceil(abs(turn_rad) / (0.5 * np.pi) - 1e-9)))
        angle = np.arctan2(*(first - middle)[::-1]) + turn_rad * np.arange(count + 1) / count
        points = middle + radius * np.column_stack([np.cos(angle), np.sin(angle)])
        points[0] = first
        if end is not None:
            points[-1] = end
        elif abs(abs(turn_rad) - 2 * np.pi) < 1e-9:
            points[-1] = first
        return cls(name, points, np.full(count, np.sign(turn_rad) / radius))

    @classmethod
    def fitted(cls, name: str, curve: Curve, *, tolerance_mm: float = FIT_MM) -> Chain:
        """Return arcs within ``tolerance_mm`` of a free curve, smooth where it is smooth."""
        pieces: list[tuple[Array, float]] = []
        for first in range(4):
            append_arcs(curve, first / 4, (first + 1) / 4, tolerance_mm, 0, pieces)
        start = curve(0.0)[0]
        points = np.array([start, *(point for point, _ in pieces)])
        return cls(name, points, np.array([curvature for _, curvature in pieces]))

    @classmethod
    def free(cls, name: str, control: ArrayLike) -> Chain:
        """Return arcs near the Bézier curve of control points (n, 2), mm.

        A curve that leaves `LARGEST_MM` is not followed. Its control points stand for it: whoever
        wants it is told, and nobody waits for a curve that nobody wants.
        """
        points = np.asarray(control, float)
        if not np.all(np.abs(points) <= LARGEST_MM):
            return cls.through(name, points)
        return cls.fitted(name, bezier(points))

    @classmethod
    def of(cls, name: str, parts: Sequence[Chain]) -> Chain:
        """Return connected parts as one chain; each starts at the end of the previous one."""
        if not parts:
            return cls(name, np.zeros((0, 2)), np.zeros(0))
        points = np.concatenate([*(part.points[:-1] for part in parts), parts[-1].points[-1:]])
        return cls(name, points, np.concatenate([part.curvature for part in parts]))

    def sampled(self, spacing_mm: float) -> Array:
        """Return points (m, 2) along the chain, at most ``spacing_mm`` apart, with all joints."""
        points = [self.points[:1]]
        for first, last, bend in zip(
            self.points[:-1], self.points[1:], self.curvature, strict=True
        ):
            chord = last - first
            half = float(np.arcsin(np.clip(0.5 * np.hypot(*chord) * bend, -1, 1)))
            length = 2 * half / bend if bend else float(np.hypot(*chord))
            count = max(1, int(np.ceil(length / spacing_mm - 1e-6)))
            share = np.arange(1, count + 1) / count
            along = np.sin(share * half) / np.sin(half) if half else share
            turn = (share - 1) * half
            c, s = along * np.cos(turn), along * np.sin(turn)
            points.append(
                first + np.column_stack([c * chord[0] - s * chord[1], s * chord[0] + c * chord[1]])
            )
        return np.concatenate(points)

    def backwards(self) -> Chain:
        """Return the chain in the opposite direction."""
        return Chain(self.name, self.points[::-1], -self.curvature[::-1])

    def mapped(self, matrix: ArrayLike, *, tolerance_mm: float = FIT_MM) -> Chain:
        """Return the chain under an affine map (2, 3).

        A similarity maps arcs to arcs. Otherwise an arc becomes part of an ellipse, which is
        approximated by arcs within ``tolerance_mm``.
        """
        m = np.asarray(matrix, float)
        linear, shift = m[:, :2], m[:, 2]
        determinant = float(np.linalg.det(linear))
        scale = float(np.sqrt(abs(determinant)))
        if scale < SMALLEST:
            raise DrawingError(
                f"{quoted(self.name)} is flattened by its transform: no area is left"
            )
        points = self.points @ linear.T + shift
        if not np.any(self.curvature) or _is_similarity(linear, scale):
            return Chain(self.name, points, self.curvature * np.sign(determinant) / scale)
        if not np.all(np.abs(points) <= LARGEST_MM):
            return Chain.through(self.name, points)
        parts: list[Chain] = []
        for k, bend in enumerate(self.curvature):
            ends = self.points[k : k + 2]
            if bend == 0:
                parts.append(Chain.through(self.name, ends @ linear.T + shift))
                continue
            parts.append(
                Chain.fitted(
                    self.name, _mapped_arc(ends, bend, linear, shift), tolerance_mm=tolerance_mm
                )
            )
        return Chain.of(self.name, parts)


def _is_similarity(linear: Array, scale: float) -> bool:
    """Return whether a linear map (2, 2) keeps angles; ``scale``² is its change of area."""
    square = scale**2
    return np.allclose(linear.T @ linear, square * np.eye(2), rtol=0, atol=1e-9 * square)


def _mapped_arc(ends: Array, bend: float, linear: Array, shift: Array) -> Curve:
    chord = ends[1] - ends[0]
    length = float(np.hypot(*chord))
    half = float(np.arcsin(np.clip(0.5 * length * bend, -1, 1)))
    first = float(np.arctan2(chord[1], chord[0])) - half

    def curve(t: float) -> tuple[Array, Array]:
        angle = first + 2 * half * t
        step = np.array([np.sin(angle) - np.sin(first), np.cos(first) - np.cos(angle)]) / bend
        tangent = np.array([np.cos(angle), np.sin(angle)]) * 2 * half / bend
        return linear @ (ends[0] + step) + shift, linear @ tangent

    return curve


def spot(point: Array) -> str:
    """Return a point (2,), mm, as a message writes it."""
    return f"({point[0]:.4g}, {point[1]:.4g}) mm"
