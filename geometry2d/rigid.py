"""Rigid motions of the plane: an angle and a shift against time.

A motion maps a point ``X`` of the body frame to ``x(t) = R(angle(t)) X + shift(t)``. Angles are in
rad, counter-clockwise positive; lengths in mm; times in s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]


class RigidMotionError(DrinksimError):
    """Arrays that form no rigid motion."""


def rotation_matrix(angle_rad: float) -> Array:
    """Return the matrix (2, 2) that rotates a column vector counter-clockwise by ``angle_rad``.

    >>> rotation_matrix(np.pi / 2).round(12).tolist()
    [[0.0, -1.0], [1.0, 0.0]]
    """
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s], [s, c]])


def rotated(points: ArrayLike, angle_rad: ArrayLike) -> Array:
    """Return ``points`` (..., 2) rotated about the origin by one angle, rad, or by one each."""
    p = np.asarray(points, float)
    angle = np.asarray(angle_rad, float)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * p[..., 0] - s * p[..., 1], s * p[..., 0] + c * p[..., 1]], axis=-1)


@dataclass(frozen=True)
class RigidPlacement:
    """Placement of a rigid body at one instant: ``x = R(angle_rad) X + shift_mm``."""

    angle_rad: float
    shift_mm: tuple[float, float]

    @classmethod
    def turned_about(cls, point: ArrayLike, angle_rad: float) -> RigidPlacement:
        """Return the placement of a body that is turned about a point (2,), mm.

        >>> RigidPlacement.turned_about([1.0, 0.0], np.pi).apply([1.0, 0.0]).tolist()
        [1.0, 0.0]
        """
        here = np.asarray(point, float)
        x, y = (here - rotated(here, angle_rad)).tolist()
        return cls(angle_rad, (x, y))

    def apply(self, points: ArrayLike) -> Array:
        """Return the positions of body points (..., 2), mm."""
        placed: Array = rotated(points, self.angle_rad) + np.asarray(self.shift_mm)
        return placed

    def pull_back(self, points: ArrayLike) -> Array:
        """Return the body points whose positions are ``points`` (..., 2), mm."""
        return rotated(np.asarray(points, float) - np.asarray(self.shift_mm), -self.angle_rad)


UNMOVED = RigidPlacement(0.0, (0.0, 0.0))
"""Placement of a body at rest in its own frame."""


@dataclass(frozen=True)
class RigidMotion:
    """A rigid motion sampled at increasing times, interpolated by cubic splines.

    Parameters
    ----------
    time_s
        (n,) increasing times, s; n ≥ 1.
    angle_rad
        (n,) angles, rad, continuous (no jumps of 2π).
    shift_mm
        (n, 2) shifts, mm.
    """

    time_s: Array
    angle_rad: Array
    shift_mm: Array

    def __post_init__(self) -> None:
        time = np.atleast_1d(np.asarray(self.time_s, float))
        angle = np.atleast_1d(np.asarray(self.angle_rad, float))
        shift = np.atleast_2d(np.asarray(self.shift_mm, float))
        if time.ndim != 1 or angle.shape != time.shape or shift.shape != (*time.shape, 2):
            raise RigidMotionError(
                f"shapes of time {time.shape}, angle {angle.shape} and shift {shift.shape} differ: "
                "give n times, n angles and (n, 2) shifts"
            )
        if not (np.isfinite(time).all() and np.isfinite(angle).all() and np.isfinite(shift).all()):
            raise RigidMotionError(
                "the motion holds a number that is not finite: interpolate dropouts first"
            )
        if np.any(np.diff(time) <= 0):
            at = int(np.argmax(np.diff(time) <= 0))
            raise RigidMotionError(
                f"times do not increase after {time[at]} s (sample {at}): sort them, drop doubles"
            )
        for array in (time, angle, shift):
            array.setflags(write=False)
        object.__setattr__(self, "time_s", time)
        object.__setattr__(self, "angle_rad", angle)
        object.__setattr__(self, "shift_mm", shift)

    @classmethod
    def of_reference_point(
        cls,
        time_s: ArrayLike,
        angle_rad: ArrayLike,
        position_mm: ArrayLike,
        reference_mm: ArrayLike,
    ) -> RigidMotion:
        """Return the motion with the positions (n, 2), mm, of body point ``reference_mm`` (2,)."""
        shift = np.asarray(position_mm, float) - rotated(reference_mm, angle_rad)
        return cls(np.asarray(time_s, float), np.asarray(angle_rad, float), shift)

    def at(self, time_s: float) -> RigidPlacement:
        """Return the placement at a time, s; outside the samples that of the nearest one."""
        t = float(np.clip(time_s, self.time_s[0], self.time_s[-1]))
        if self.time_s.size == 1:
            row = np.concatenate([self.angle_rad, self.shift_mm[0]])
        else:
            row = self._spline()(t)
        return RigidPlacement(float(row[0]), (float(row[1]), float(row[2])))

    def resampled(self, time_s: ArrayLike) -> RigidMotion:
        """Return the same motion sampled at other times (n,), s."""
        places = [self.at(t) for t in np.asarray(time_s, float)]
        return RigidMotion(
            np.asarray(time_s, float),
            np.array([p.angle_rad for p in places]),
            np.array([p.shift_mm for p in places]),
        )

    def apply(self, points: ArrayLike) -> Array:
        """Return body points (m, 2) at every sample: (n, m, 2), mm."""
        p = np.atleast_2d(np.asarray(points, float))
        return rotated(p[None], self.angle_rad[:, None]) + self.shift_mm[:, None]

    def inverse(self) -> RigidMotion:
        """Return the inverse motion, sample by sample."""
        return RigidMotion(self.time_s, -self.angle_rad, rotated(-self.shift_mm, -self.angle_rad))

    def __matmul__(self, other: RigidMotion) -> RigidMotion:
        """Return the composition ``self`` after ``other``; both have the same times."""
        if not np.array_equal(self.time_s, other.time_s):
            raise RigidMotionError(
                f"motions with different times ({self.time_s.size} and {other.time_s.size} "
                "samples) cannot be composed: resample one of them"
            )
        return RigidMotion(
            self.time_s,
            self.angle_rad + other.angle_rad,
            rotated(other.shift_mm, self.angle_rad) + self.shift_mm,
        )

    def seen_from(self, other: RigidMotion) -> RigidMotion:
        """Return this motion relative to the body that moves with ``other``."""
        return other.inverse() @ self

    def _spline(self) -> CubicSpline:
        cached = self.__dict__.get("_cached_spline")
        if cached is None:
            rows = np.column_stack([self.angle_rad, self.shift_mm])
            cached = CubicSpline(self.time_s, rows, bc_type="natural")
            object.__setattr__(self, "_cached_spline", cached)
        return cached
