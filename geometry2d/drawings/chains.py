"""Curves as they come out of files: open or closed chains of lines and arcs, joined to outlines.

Free curves (splines, ellipses, Bézier curves) become pairs of arcs that share their tangent, so an
outline stays smooth where its drawing was: a contact sees no facets that nobody drew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.text import quoted
from geometry2d.outline import Outline, OutlineError

Array = NDArray[np.float64]
Curve = Callable[[float], tuple[Array, Array]]
"""Point (2,) and derivative (2,) at a parameter in 0 ... 1."""

JOIN_MM = 1e-3
"""Ends nearer than this are one point: files print their numbers rounded."""

FIT_MM = 2e-3
"""Largest distance between a free curve and the arcs that stand for it."""

LARGEST_MM = 1e4
"""Nothing in a head or on a package is larger: whoever draws so has chosen the wrong unit."""

LONGEST_MM = 5e3
"""No curve of a head or a neck is longer: it goes to and fro."""

SMALLEST = 1e-9
"""Radii and scales below this leave nothing of a curve, in whatever unit."""

FULLEST_TURN = 1e-4
"""An arc between two points turns by so much less than a full circle, rad, at least."""

MOST_PIECES = 30_000
FITTED_COUNTS = 3
"""Lines and arcs of a drawing; one that is fitted to a free curve takes the time of three."""

DEEPEST = 14
"""A free curve is halved at most so often before a straight line takes its place (at a cusp)."""


class DrawingError(DrinksimError):
    """A drawing or a surface cannot be read, or does not give closed curves."""


class PieceCount:
    """Counts the lines and arcs of a drawing as it is read and refuses too many.

    Parameters
    ----------
    file
        Name of the drawing, for the message.
    """

    def __init__(self, file: str) -> None:
        self._file, self._count = file, 0

    def counted(self, chain: Chain, *, fitted: bool = False) -> Chain:
        """Return the chain, counted; ``fitted`` says whether it stands for a free curve.

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
    """Lines and arcs end to end.

    Parameters
    ----------
    name
        What the file calls it.
    points
        (n + 1, 2) where the pieces start and end, mm.
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

        The turn is less than a full one. The arc is split so that no part exceeds a quarter.

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
                f"{quoted(name)} has an arc at {_place(first)} that turns by a full circle and "
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
            raise DrawingError(f"{quoted(name)} has an arc of radius zero at {_place(first)}")
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
        """Return arcs within ``tolerance_mm`` of a free curve, smooth wherever it is smooth."""
        pieces: list[tuple[Array, float]] = []
        for first in range(4):
            _fit(curve, first / 4, (first + 1) / 4, tolerance_mm, 0, pieces)
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
        """Return parts that follow one another as one chain; each starts where the last ended."""
        if not parts:
            return cls(name, np.zeros((0, 2)), np.zeros(0))
        points = np.concatenate([*(part.points[:-1] for part in parts), parts[-1].points[-1:]])
        return cls(name, points, np.concatenate([part.curvature for part in parts]))

    def sampled(self, spacing_mm: float) -> Array:
        """Return points (m, 2) along the chain, all joints among them, ``spacing_mm`` apart."""
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
        """Return the chain travelled from its end to its start."""
        return Chain(self.name, self.points[::-1], -self.curvature[::-1])

    def mapped(self, matrix: ArrayLike, *, tolerance_mm: float = FIT_MM) -> Chain:
        """Return the chain under an affine map (2, 3); circles stay circles if the map lets them.

        Where the map makes ellipses of circles, ``tolerance_mm`` bounds what is lost.
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
        alike = np.allclose(linear.T @ linear, scale**2 * np.eye(2), rtol=0, atol=1e-9 * scale**2)
        if alike or not np.any(self.curvature):
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


class NamedOutline(NamedTuple):
    """A closed curve of a drawing, counter-clockwise in whatever sense it was drawn, mm."""

    name: str
    outline: Outline


def closed_outlines(chains: Iterable[Chain], *, join_mm: float = JOIN_MM) -> list[NamedOutline]:
    """Return the outlines that chains form; those of one name are put together end to end.

    Raises
    ------
    DrawingError
        If a curve is open (with its gap and place), branches, crosses itself or is too large.
    """
    by_name: dict[str, list[Chain]] = {}
    for chain in chains:
        if len(chain.curvature):
            _refuse_size(chain)
            by_name.setdefault(chain.name, []).append(chain)
    return [
        NamedOutline(name, _outline(ring, join_mm))
        for name, parts in by_name.items()
        for ring in _rings(name, parts, join_mm)
    ]


def open_curve(name: str, parts: Sequence[Chain], *, join_mm: float = JOIN_MM) -> Chain:
    """Return the one open curve that chains form, put together end to end.

    Raises
    ------
    DrawingError
        If they form a closed curve, none, or several pieces, or branch.
    """
    parts = [part for part in parts if len(part.curvature)]
    for part in parts:
        _refuse_size(part)
    ends = np.array([p for part in parts for p in (part.points[0], part.points[-1])])
    partner = _meetings(name, ends, join_mm)
    loose = [i for i, other in enumerate(partner) if other is None]
    if len(loose) != 2:
        raise DrawingError(
            f"{quoted(name)} has {len(loose)} loose ends where one open curve has two: "
            "draw it as a single line that is not closed"
        )
    ordered: list[Chain] = []
    entry: int | None = loose[0]
    while entry is not None:
        part = parts[entry // 2]
        ordered.append(part if entry % 2 == 0 else part.backwards())
        entry = partner[entry ^ 1]
    if len(ordered) < len(parts):
        raise DrawingError(f"{quoted(name)} has a closed curve beside the open one: delete it")
    return Chain.of(name, ordered)


def outline_through(points: ArrayLike, name: str) -> Outline:
    """Return the counter-clockwise polygon through points (n, 2), mm; errors carry ``name``."""
    p = np.asarray(points, float)
    return _outline(Chain.through(name, np.concatenate([p, p[:1]])), 0.0)


def _rings(name: str, parts: list[Chain], join_mm: float) -> list[Chain]:
    """Return closed chains, each put together from chains whose ends meet."""
    rings = [part for part in parts if _closed(part, join_mm)]
    loose = [part for part in parts if not _closed(part, join_mm)]
    ends = np.array([p for part in loose for p in (part.points[0], part.points[-1])])
    partner = _partners(name, ends, join_mm)
    used = np.zeros(len(loose), bool)
    for first in range(len(loose)):
        if used[first]:
            continue
        ring: list[Chain] = []
        entry = 2 * first
        while not used[entry // 2]:
            used[entry // 2] = True
            part = loose[entry // 2]
            ring.append(part if entry % 2 == 0 else part.backwards())
            entry = partner[entry ^ 1]
        rings.append(Chain.of(name, ring))
    return rings


def _meetings(name: str, ends: Array, join_mm: float) -> list[int | None]:
    """Return for each of the ends (n, 2) the one that meets it, if any."""
    if len(ends) == 0:
        return []
    # A third end that is as near as the second, or nearer, makes a branch: no more are needed.
    near = cKDTree(ends).query(ends, k=range(1, 5), distance_upper_bound=2 * join_mm)[1]
    partner: list[int | None] = []
    for i, candidates in enumerate(near):
        others = candidates[(candidates != i) & (candidates < len(ends))]
        met = others[np.hypot(*(ends[others] - ends[i]).T) <= join_mm]
        if len(met) > 1:
            count = np.count_nonzero(np.hypot(*(ends - ends[i]).T) <= join_mm)
            raise DrawingError(
                f"{quoted(name)} branches at {_place(ends[i])}: {count} ends meet there; delete "
                "the pieces that do not belong to the outline, or put them on their own layer"
            )
        partner.append(int(met[0]) if len(met) else None)
    return partner


def _partners(name: str, ends: Array, join_mm: float) -> list[int]:
    """Return for each of the ends (n, 2) the one that meets it, or refuse an open curve."""
    partners: list[int] = []
    for i, met in enumerate(_meetings(name, ends, join_mm)):
        if met is None:
            distance = np.hypot(*(ends - ends[i]).T)
            distance[i] = np.inf
            nearest = int(np.argmin(distance))
            raise DrawingError(
                f"{quoted(name)} is open: its end at {_place(ends[i])} is "
                f"{distance[nearest]:.4g} mm from the next, at {_place(ends[nearest])}; close the "
                "curve in the drawing"
            )
        partners.append(met)
    return partners


def _closed(chain: Chain, join_mm: float) -> bool:
    return bool(np.hypot(*(chain.points[-1] - chain.points[0])) <= join_mm)


def _outline(ring: Chain, join_mm: float) -> Outline:
    start = ring.points[:-1]
    step = np.roll(start, -1, axis=0) - start
    kept = np.hypot(step[:, 0], step[:, 1]) > join_mm
    start, curvature = start[kept], ring.curvature[kept]
    if len(start) < 2 or (len(start) == 2 and not np.any(curvature)):
        raise DrawingError(
            f"{quoted(ring.name)} at {_place(ring.points[0])} encloses nothing: delete it, or draw "
            "it as a closed curve"
        )
    try:
        if _signed_area(start, curvature) < 0:
            start, curvature = np.roll(start[::-1], 1, axis=0), -curvature[::-1]
        return Outline(start, curvature)
    except OutlineError as error:
        where = shapely.is_valid_reason(shapely.Polygon(start)) if len(start) > 2 else ""
        raise DrawingError(f"{quoted(ring.name)}: {error} ({where})") from error


def _signed_area(start: Array, curvature: Array) -> float:
    x, y = start.T
    chord = np.hypot(*(np.roll(start, -1, axis=0) - start).T)
    half = np.arcsin(np.clip(0.5 * chord * curvature, -1, 1))
    bent = curvature != 0
    caps = (half[bent] - 0.5 * np.sin(2 * half[bent])) / curvature[bent] ** 2
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) + np.sum(caps))


def _refuse_size(chain: Chain) -> None:
    if not np.all(np.abs(chain.points) <= LARGEST_MM) or not np.all(np.isfinite(chain.curvature)):
        raise DrawingError(
            f"{quoted(chain.name)} reaches farther than {LARGEST_MM:g} mm from the origin: check "
            "the unit of the file and move the drawing to the origin"
        )
    chord = np.hypot(*np.diff(chain.points, axis=0).T)
    half = np.arcsin(np.clip(0.5 * chord * np.abs(chain.curvature), 0, 1))
    arc = np.divide(2 * half, np.abs(chain.curvature), out=chord, where=chain.curvature != 0)
    if float(np.sum(arc)) > LONGEST_MM:
        raise DrawingError(
            f"{quoted(chain.name)} is {1e-3 * np.sum(arc):.3g} m long: check the unit of the file, "
            "or simplify the curve"
        )


def _fit(
    curve: Curve, low: float, high: float, tolerance: float, depth: int,
    pieces: list[tuple[Array, float]],
) -> None:  # fmt: skip
    """Append the end point and curvature of the arcs that follow a curve between parameters."""
    start, end = curve(low)[0], curve(high)[0]
    samples = np.array([curve(low + (high - low) * k / 6)[0] for k in range(1, 6)])
    if np.all(np.abs(np.array([*samples, end]) - start) < 0.1 * tolerance):
        pieces.append((end, 0.0))
        return
    pair = _biarc(start, _direction(curve, low, +1), end, _direction(curve, high, -1))
    if pair is not None and pair.largest_distance(samples) <= tolerance:
        pieces += [(pair.joint, pair.first), (end, pair.second)]
        return
    if depth >= DEEPEST:
        pieces.append((end, 0.0))
        return
    middle = 0.5 * (low + high)
    _fit(curve, low, middle, tolerance, depth + 1, pieces)
    _fit(curve, middle, high, tolerance, depth + 1, pieces)


def _direction(curve: Curve, at: float, towards: int) -> Array:
    """Return the unit tangent (2,); where control points coincide, that of a point close by."""
    for inwards in (0.0, 1e-6, 1e-4):
        tangent = curve(at + towards * inwards)[1]
        size = float(np.hypot(*tangent))
        if size > 1e-9:
            unit: Array = tangent / size
            return unit
    return np.zeros(2)


class _Biarc(NamedTuple):
    """Two arcs with one tangent where they meet, and the tangents they were asked to have."""

    start: Array
    leaving: Array
    joint: Array
    middle: Array
    end: Array
    arriving: Array
    first: float
    second: float

    def largest_distance(self, points: Array) -> float:
        """Distance of points (n, 2) near the arcs from them, mm, to first order."""
        before = (points - self.joint) @ self.middle < 0
        from_start, from_end = points - self.start, points - self.end
        first = _cross(self.leaving, from_start) - 0.5 * self.first * np.sum(from_start**2, axis=1)
        last = _cross(self.arriving, from_end) - 0.5 * self.second * np.sum(from_end**2, axis=1)
        return float(np.max(np.abs(np.where(before, first, last))))


def _biarc(start: Array, leaving: Array, end: Array, arriving: Array) -> _Biarc | None:
    """Return the two arcs with given ends and tangents whose control legs are equally long.

    With v = end − start and legs d: v·v = 2 d v·(t₀ + t₁) + 2 d² (1 − t₀·t₁). None where there are
    no two arcs of at most a quarter turn each.
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
    return _Biarc(start, leaving, joint, along / size, end, arriving, straight[0], straight[1])


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
    """Cross product of vectors (..., 2): positive if ``b`` points to the left of ``a``."""
    product: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def _place(point: Array) -> str:
    return f"({point[0]:.4g}, {point[1]:.4g}) mm"
