"""Closed curves of straight lines and circular arcs, with exact signed distance.

An outline is the boundary of a solid. It runs counter-clockwise: the solid is on its left, and the
outward normal points to the right of the direction of travel. The signed distance ``d`` is negative
inside. Its gradient is the normal ``n``. Its second derivative is ``∇∇d = h t tᵀ``, where ``t`` is
the tangent and ``h`` the curvature of the level set through the point: ``1/|x − c|`` beside a
convex arc of centre ``c``, ``−1/|x − c|`` beside a concave one, 0 beside a line and ``1/d`` beside
a corner. Contact needs these three quantities. An arc is exact, without facets.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry2d.compiled import compiled
from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import rotated

Array = NDArray[np.float64]

SMOOTH_TURN_RAD = 1e-7
"""A joint of two pieces at a smaller angle than this is smooth, not a corner."""


class OutlineError(DrinksimError):
    """A curve that is not the boundary of a solid."""


class Projection(NamedTuple):
    """Signed distance of points from an outline, with its derivatives.

    Attributes
    ----------
    distance
        (m,) signed distance, mm, negative inside.
    normal
        (m, 2) outward unit normal, the gradient of the distance.
    level_curvature
        (m,) curvature of the level set through the point, 1/mm.
    arc_length
        (m,) arc length of the nearest point of the outline from its start, mm.
    """

    distance: Array
    normal: Array
    level_curvature: Array
    arc_length: Array


@dataclass(frozen=True)
class Outline:
    """A closed, simple, counter-clockwise curve of lines and arcs.

    Parameters
    ----------
    start
        (n, 2) start point of each piece, mm; a piece ends where the next one starts.
    curvature
        (n,) signed curvature of each piece, 1/mm: 0 for a line, positive for an arc that bends to
        the left (convex solid), negative for one that bends to the right. An arc spans at most
        half a circle.

    Raises
    ------
    OutlineError
        If an arc does not reach its end, or the curve crosses itself or runs clockwise.
    """

    start: Array
    curvature: Array
    centre: Array = field(init=False, repr=False, compare=False)
    breaks: Array = field(init=False, repr=False, compare=False)
    """(n + 1,) arc length at the start of each piece, and the total length, mm."""

    def __post_init__(self) -> None:
        start = np.ascontiguousarray(self.start, float)
        curvature = np.ascontiguousarray(self.curvature, float)
        if start.ndim != 2 or start.shape[1] != 2 or curvature.shape != (len(start),):
            raise OutlineError(
                f"shapes of start points {start.shape} and curvatures {curvature.shape} differ: "
                "give (n, 2) and (n,)"
            )
        if len(start) < 2 or not (np.isfinite(start).all() and np.isfinite(curvature).all()):
            raise OutlineError("an outline needs at least two pieces, all of them finite")
        chord = np.roll(start, -1, axis=0) - start
        chord_length = np.hypot(chord[:, 0], chord[:, 1])
        if np.any(chord_length == 0):
            at = int(np.argmin(chord_length))
            raise OutlineError(f"piece {at} at {start[at].tolist()} has no length: drop it")
        half_sine = 0.5 * chord_length * curvature
        if np.any(np.abs(half_sine) > 1 + 1e-9):
            at = int(np.argmax(np.abs(half_sine)))
            raise OutlineError(
                f"the arc that starts at {start[at].tolist()} has radius "
                f"{1 / abs(curvature[at]):.4g} mm, too small for its chord of "
                f"{chord_length[at]:.4g} mm: enlarge the radius or split the arc"
            )
        turn = 2 * np.arcsin(np.clip(half_sine, -1, 1))
        left = np.column_stack([-chord[:, 1], chord[:, 0]]) / chord_length[:, None]
        is_arc = curvature != 0
        radius = np.divide(1.0, curvature, out=np.zeros_like(curvature), where=is_arc)
        centre = start + 0.5 * chord + left * (radius * np.cos(0.5 * turn))[:, None]
        length = np.where(is_arc, turn * radius, chord_length)
        breaks = np.concatenate([[0.0], np.cumsum(length)])
        for name, array in (
            ("start", start),
            ("curvature", curvature),
            ("centre", centre),
            ("breaks", breaks),
        ):
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        self._refuse_invalid()

    @classmethod
    def from_corners(cls, corners: ArrayLike, radii: ArrayLike | float) -> Outline:
        """Return the polygon with ``corners`` (n, 2), each rounded by its radius (n,), mm.

        A radius of zero keeps the corner sharp.

        Raises
        ------
        OutlineError
            If two neighbouring roundings are longer than the side between them.
        """
        corner = np.asarray(corners, float)
        radius = np.broadcast_to(np.asarray(radii, float), (len(corner),))
        side = np.roll(corner, -1, axis=0) - corner
        side_length = np.hypot(side[:, 0], side[:, 1])
        if np.any(side_length == 0):
            at = int(np.argmin(side_length))
            raise OutlineError(f"corner {at} at {corner[at].tolist()} is doubled: drop one")
        direction = side / side_length[:, None]
        before = np.roll(direction, 1, axis=0)
        turn = np.arctan2(
            before[:, 0] * direction[:, 1] - before[:, 1] * direction[:, 0],
            np.sum(before * direction, axis=1),
        )
        setback = radius * np.abs(np.tan(0.5 * turn))
        room = side_length - setback - np.roll(setback, -1)
        if np.any(room < -1e-9):
            at = int(np.argmin(room))
            raise OutlineError(
                f"the roundings of corners {at} and {(at + 1) % len(corner)} need "
                f"{side_length[at] - room[at]:.4g} mm but the side between them is "
                f"{side_length[at]:.4g} mm long: use smaller radii"
            )
        start: list[Array] = []
        curvature: list[float] = []
        for i in range(len(corner)):
            leaving = corner[i] + direction[i] * setback[i]
            if setback[i] > 0:
                start.append(corner[i] - before[i] * setback[i])
                curvature.append(float(np.sign(turn[i]) / radius[i]))
            if room[i] > 1e-9:
                start.append(leaving)
                curvature.append(0.0)
        return cls(np.array(start), np.array(curvature))

    @classmethod
    def circle(cls, centre: ArrayLike, radius: float) -> Outline:
        """Return a full circle about ``centre`` (2,), mm."""
        quarter = 0.5 * np.pi * np.arange(4)
        start = np.asarray(centre, float) + radius * np.column_stack(
            [np.cos(quarter), np.sin(quarter)]
        )
        return cls(start, np.full(4, 1.0 / radius))

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, lower, right and upper bound of the outline, mm; they may not be tight."""
        chord = np.roll(self.start, -1, axis=0) - self.start
        bulge = np.where(self.curvature != 0, 0.5 * np.hypot(chord[:, 0], chord[:, 1]), 0.0)
        middle = self.start + 0.5 * chord
        low = np.minimum(self.start.min(axis=0), (middle - bulge[:, None]).min(axis=0))
        high = np.maximum(self.start.max(axis=0), (middle + bulge[:, None]).max(axis=0))
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    @property
    def length(self) -> float:
        """Total arc length, mm."""
        return float(self.breaks[-1])

    @property
    def area(self) -> float:
        """Enclosed area, mm²: the polygon of the joints and the segments of the arcs."""
        x, y = self.start.T
        polygon = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
        turn = self.curvature * np.diff(self.breaks)
        arcs = self.curvature != 0
        cut = 0.5 * (turn[arcs] - np.sin(turn[arcs])) / self.curvature[arcs] ** 2
        return polygon + float(np.sum(cut))

    @property
    def smallest_radius(self) -> float:
        """Smallest radius of an arc, mm; 0 if there is a sharp corner, inf if there is no arc."""
        if np.any(np.abs(self._corner_turns()) > SMOOTH_TURN_RAD):
            return 0.0
        largest = float(np.max(np.abs(self.curvature)))
        return np.inf if largest == 0 else 1.0 / largest

    def moved(self, angle_rad: float, shift_mm: ArrayLike) -> Outline:
        """Return the outline rotated about the origin by ``angle_rad``, then shifted (2,), mm."""
        return Outline(rotated(self.start, angle_rad) + np.asarray(shift_mm, float), self.curvature)

    def point_at(self, arc_length: ArrayLike) -> tuple[Array, Array]:
        """Return points (m, 2), mm, and outward normals (m, 2) at arc lengths (m,), mm."""
        s = np.mod(np.atleast_1d(np.asarray(arc_length, float)), self.length)
        piece = np.clip(np.searchsorted(self.breaks, s, side="right") - 1, 0, len(self.start) - 1)
        return self._points_on(piece, s - self.breaks[piece])

    def sampled(self, spacing_mm: float) -> Array:
        """Return points (m, 2) along the outline, at most ``spacing_mm`` apart, with all joints."""
        points: list[Array] = []
        for piece, length in enumerate(np.diff(self.breaks)):
            count = max(1, int(np.ceil(length / spacing_mm)))
            local = length * np.arange(count) / count
            points.append(self._points_on(np.full(count, piece), local)[0])
        return np.concatenate(points)

    def project(self, points: ArrayLike) -> Projection:
        """Return the projection of points (m, 2), mm, on the outline."""
        p = np.ascontiguousarray(np.atleast_2d(np.asarray(points, float)))
        return Projection(*project_points(p, self.start, self.curvature, self.centre, self.breaks))

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return for each point (m, 2) whether it lies strictly inside."""
        return self.project(points).distance < 0

    def _points_on(self, piece: NDArray[np.intp], local: Array) -> tuple[Array, Array]:
        nxt = (piece + 1) % len(self.start)
        chord = self.start[nxt] - self.start[piece]
        kappa = self.curvature[piece]
        half_turn = 0.5 * kappa * np.diff(self.breaks)[piece]
        chord_angle = np.arctan2(chord[:, 1], chord[:, 0])
        angle = chord_angle - half_turn + kappa * local
        straight = np.column_stack([np.cos(chord_angle), np.sin(chord_angle)]) * local[:, None]
        safe = np.where(kappa == 0, 1.0, kappa)
        first = chord_angle - half_turn
        bent = (
            np.column_stack([np.sin(angle) - np.sin(first), np.cos(first) - np.cos(angle)])
            / safe[:, None]
        )
        point = self.start[piece] + np.where((kappa == 0)[:, None], straight, bent)
        return point, np.column_stack([np.sin(angle), -np.cos(angle)])

    def _corner_turns(self) -> Array:
        """Return the jump of direction (n,), rad, at the start of each piece."""
        chord = np.roll(self.start, -1, axis=0) - self.start
        chord_angle = np.arctan2(chord[:, 1], chord[:, 0])
        half_turn = 0.5 * self.curvature * np.diff(self.breaks)
        jump = (chord_angle - half_turn) - np.roll(chord_angle + half_turn, 1)
        wrapped: Array = (jump + np.pi) % (2 * np.pi) - np.pi
        return wrapped

    def _refuse_invalid(self) -> None:
        ring = shapely.LinearRing(self.sampled(max(self.length / 400, 1e-6)))
        if not ring.is_simple:
            raise OutlineError(
                "the outline crosses or touches itself: check the order of its points"
            )
        if self.area <= 0:
            raise OutlineError("the outline runs clockwise: reverse the order of its points")


@compiled
def project_points(
    points: Array, start: Array, curvature: Array, centre: Array, breaks: Array
) -> tuple[Array, Array, Array, Array]:
    """Project points (m, 2) on the pieces of an outline; the arrays are those of `Outline`."""
    m = points.shape[0]
    distance = np.empty(m)
    normal = np.empty((m, 2))
    level = np.empty(m)
    arc_length = np.empty(m)
    for i in range(m):
        distance[i], normal[i, 0], normal[i, 1], level[i], arc_length[i] = project_point(
            points[i, 0], points[i, 1], start, curvature, centre, breaks
        )
    return distance, normal, level, arc_length


@compiled
def project_point(
    x: float, y: float, start: Array, curvature: Array, centre: Array, breaks: Array
) -> tuple[float, float, float, float, float]:
    """Return signed distance, normal (2), level-set curvature and arc length for one point."""
    n = start.shape[0]
    nearest = np.inf
    result = (np.inf, 1.0, 0.0, 0.0, 0.0)
    for k in range(n):
        nxt = k + 1 if k + 1 < n else 0
        ax, ay = start[k, 0], start[k, 1]
        kappa = curvature[k]
        length = breaks[k + 1] - breaks[k]
        if kappa == 0.0:
            tx, ty = (start[nxt, 0] - ax) / length, (start[nxt, 1] - ay) / length
            along = (x - ax) * tx + (y - ay) * ty
            if -1e-10 * length <= along <= length * (1 + 1e-10):
                d = (x - ax) * ty - (y - ay) * tx
                if abs(d) < nearest:
                    nearest = abs(d)
                    result = (d, ty, -tx, 0.0, breaks[k] + along)
        else:
            rx, ry = x - centre[k, 0], y - centre[k, 1]
            r = np.hypot(rx, ry)
            sx, sy = ax - centre[k, 0], ay - centre[k, 1]
            if r > 0.0:
                side = 1.0 if kappa > 0 else -1.0
                swept = side * np.arctan2(sx * ry - sy * rx, sx * rx + sy * ry)
                turn = abs(kappa) * length
                if swept < -1e-10:
                    swept += 2 * np.pi
                if swept <= turn + 1e-10:
                    d = side * (r - 1.0 / abs(kappa))
                    if abs(d) < nearest:
                        nearest = abs(d)
                        result = (
                            d, side * rx / r, side * ry / r, side / r,
                            breaks[k] + swept / abs(kappa),
                        )  # fmt: skip
        # The joint: only a corner is strictly nearer than both its pieces.
        dx, dy = x - ax, y - ay
        d = np.hypot(dx, dy)
        if d < nearest * (1 - 1e-9):
            px, py = _corner_normal(k, start, curvature, centre)
            sign = 1.0 if dx * px + dy * py >= 0 else -1.0
            nearest = d
            if d > 1e-12:
                result = (sign * d, sign * dx / d, sign * dy / d, sign / d, breaks[k])
            else:
                result = (0.0, px, py, 0.0, breaks[k])
    return result


@compiled
def _corner_normal(k: int, start: Array, curvature: Array, centre: Array) -> tuple[float, float]:
    """Return the unit vector between the outward normals of the pieces that meet at ``k``."""
    n = start.shape[0]
    before = k - 1 if k > 0 else n - 1
    sx, sy = 0.0, 0.0
    for piece in (before, k):
        nxt = piece + 1 if piece + 1 < n else 0
        if curvature[piece] == 0.0:
            tx, ty = start[nxt, 0] - start[piece, 0], start[nxt, 1] - start[piece, 1]
            length = np.hypot(tx, ty)
            sx += ty / length
            sy -= tx / length
        else:
            side = 1.0 if curvature[piece] > 0 else -1.0
            rx, ry = start[k, 0] - centre[piece, 0], start[k, 1] - centre[piece, 1]
            r = np.hypot(rx, ry)
            sx += side * rx / r
            sy += side * ry / r
    length = np.hypot(sx, sy)
    return sx / length, sy / length
