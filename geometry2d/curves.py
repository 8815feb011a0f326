"""Smooth open curves through landmarks, as dense polylines (n, 2) in mm.

A few landmarks and the direction of the profile at each describe a face. Two landmarks are joined
by a cubic, which is close to a circular arc if the two directions allow one. A narrow Gaussian
average along the arc length then removes the jumps of curvature at the landmarks.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d

from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]


class CurveError(DrinksimError):
    """Landmarks or points that form no curve."""


def arc_lengths(points: ArrayLike) -> Array:
    """Return the arc length (n,), mm, of every point (n, 2) of a polyline, 0 at the first."""
    p = np.asarray(points, float)
    step = np.diff(p, axis=0)
    return np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))])


def at_arc_lengths(points: ArrayLike, arc_length: ArrayLike) -> Array:
    """Return the points (m, 2), mm, of a polyline (n, 2) at arc lengths (m,), mm."""
    p = np.asarray(points, float)
    along = arc_lengths(p)
    s = np.asarray(arc_length, float)
    return np.stack([np.interp(s, along, p[:, 0]), np.interp(s, along, p[:, 1])], axis=-1)


def nearest_arc_length(points: ArrayLike, point: ArrayLike) -> float:
    """Return the arc length, mm, of the point of a polyline (n, 2) nearest to ``point`` (2,)."""
    return float(
        shapely.line_locate_point(shapely.LineString(np.asarray(points)), shapely.Point(point))
    )


def left_normals(points: ArrayLike) -> Array:
    """Return unit normals (n, 2) of a polyline (n, 2), to the left of its direction of travel."""
    p = np.asarray(points, float)
    tangent = np.gradient(p, arc_lengths(p), axis=0, edge_order=2)
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    unit: Array = normal / np.hypot(normal[:, 0], normal[:, 1])[:, None]
    return unit


def through_landmarks(
    landmarks: ArrayLike, headings_deg: ArrayLike, *, spacing_mm: float = 0.1
) -> Array:
    """Return a curve through landmarks with given directions, continuous in direction.

    Parameters
    ----------
    landmarks
        (n, 2) points, mm, in order; n ≥ 2.
    headings_deg
        (n,) direction of travel at each point, degrees counter-clockwise from +x.
    spacing_mm
        Distance between points of the polyline returned.

    Raises
    ------
    CurveError
        If two successive landmarks coincide, or the curve would turn back on itself.
    """
    point = np.asarray(landmarks, float)
    heading = np.deg2rad(np.asarray(headings_deg, float))
    if point.ndim != 2 or heading.shape != (len(point),) or len(point) < 2:
        raise CurveError(
            f"shapes of landmarks {point.shape} and headings {heading.shape} differ: give (n, 2) "
            "and (n,) with n ≥ 2"
        )
    chord = np.diff(point, axis=0)
    length = np.hypot(chord[:, 0], chord[:, 1])
    if np.any(length < 1e-6):
        at = int(np.argmin(length))
        raise CurveError(f"landmarks {at} and {at + 1} coincide at {point[at].tolist()}: drop one")
    chord_angle = np.arctan2(chord[:, 1], chord[:, 0])
    leaving = _wrapped(heading[:-1] - chord_angle)
    arriving = _wrapped(heading[1:] - chord_angle)
    turned = np.maximum(np.abs(leaving), np.abs(arriving))
    if np.any(turned > np.deg2rad(150)):
        at = int(np.argmax(turned))
        raise CurveError(
            f"between landmarks {point[at].tolist()} and {point[at + 1].tolist()} the curve would "
            "turn back on itself: move one of them or its heading"
        )
    # With tangents of this length the cubic follows the circle through both ends.
    tangent = np.column_stack([np.cos(heading), np.sin(heading)])
    first = tangent[:-1] * (length / np.cos(0.5 * leaving) ** 2)[:, None]
    last = tangent[1:] * (length / np.cos(0.5 * arriving) ** 2)[:, None]
    pieces: list[Array] = []
    for k in range(len(length)):
        t = np.linspace(0.0, 1.0, max(8, int(np.ceil(2 * length[k] / spacing_mm))))[:-1, None]
        pieces.append(
            (1 + 2 * t) * (1 - t) ** 2 * point[k]
            + t * (1 - t) ** 2 * first[k]
            + t**2 * (3 - 2 * t) * point[k + 1]
            + t**2 * (t - 1) * last[k]
        )
    return resampled(np.concatenate([*pieces, point[-1:]]), spacing_mm)


def resampled(points: ArrayLike, spacing_mm: float) -> Array:
    """Return the polyline with equally spaced points, at most ``spacing_mm`` apart."""
    length = float(arc_lengths(points)[-1])
    count = max(2, int(np.ceil(length / spacing_mm)) + 1)
    return at_arc_lengths(points, np.linspace(0.0, length, count))


def stretch(points: ArrayLike, low: float, high: float, *, spacing_mm: float = 0.1) -> Array:
    """Return the part of a polyline between two arc lengths, mm, with a point at both ends."""
    count = max(2, int(np.ceil((high - low) / spacing_mm)) + 1)
    return at_arc_lengths(points, np.linspace(low, high, count))


def heading_deg(points: ArrayLike) -> float:
    """Return the direction from the first to the last of some points (n, 2), degrees."""
    p = np.asarray(points, float)
    step = p[-1] - p[0]
    return float(np.rad2deg(np.arctan2(step[1], step[0])))


def smoothed(points: ArrayLike, width_mm: float) -> Array:
    """Return an equally spaced polyline smoothed along its length by a Gaussian; its ends stay.

    A curve of radius ``r`` moves inwards by about ``width_mm² / 2r``.
    """
    p = np.asarray(points, float)
    spacing = float(arc_lengths(p)[-1]) / (len(p) - 1)
    reach = min(int(np.ceil(4 * width_mm / spacing)), len(p) - 1)
    before = 2 * p[0] - p[reach:0:-1]
    after = 2 * p[-1] - p[-2 : -2 - reach : -1]
    padded = np.concatenate([before, p, after])
    averaged: Array = gaussian_filter1d(padded, width_mm / spacing, axis=0, truncate=4.0)
    return averaged[reach : reach + len(p)]


def graded(points: ArrayLike, size: Callable[[Array], Array]) -> Array:
    """Return points (m, 2) along a polyline with the spacing of a size field; its ends stay.

    Parameters
    ----------
    points
        (n, 2) polyline, mm, dense compared with the spacing.
    size
        Maps points (k, 2), mm, to the spacing (k,) there, mm.
    """
    length = float(arc_lengths(points)[-1])
    fine = np.linspace(0.0, length, max(64, int(np.ceil(length / 0.05))))
    density = 1.0 / size(at_arc_lengths(points, fine))
    steps = 0.5 * (density[1:] + density[:-1]) * np.diff(fine)
    progress = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(1, int(np.rint(progress[-1])))
    s = np.interp(np.linspace(0.0, progress[-1], count + 1), progress, fine)
    return at_arc_lengths(points, s)


def _wrapped(angle_rad: Array) -> Array:
    wrapped: Array = (angle_rad + np.pi) % (2 * np.pi) - np.pi
    return wrapped
