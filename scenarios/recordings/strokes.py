"""Outlines to draw with: ellipses, smooth curves and strokes as polygons (n, 2), mm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


def pair(point: ArrayLike) -> tuple[float, float]:
    """Return a point (2,) as two floats."""
    x, y = np.asarray(point, float)
    return float(x), float(y)


def ellipse(centre: ArrayLike, radii: tuple[float, float], turn_deg: float) -> Array:
    """Return an ellipse with half axes ``radii`` (mm), turned counter-clockwise (degrees)."""
    angle = 2 * np.pi * np.arange(48) / 48
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    own: Array = np.column_stack([radii[0] * np.cos(angle), radii[1] * np.sin(angle)])
    return np.asarray(own @ np.array([[c, s], [-s, c]]) + np.asarray(centre))


def arc(centre: ArrayLike, radius: float, from_deg: float, to_deg: float) -> Array:
    """Return an open arc between two directions (degrees, from the x axis)."""
    angle = np.radians(np.linspace(from_deg, to_deg, 24))
    unit: Array = np.column_stack([np.cos(angle), np.sin(angle)])
    on_circle: Array = radius * unit + np.asarray(centre, float)
    return on_circle


def smooth(corners: Sequence[ArrayLike]) -> Array:
    """Return a smooth closed curve through some points."""
    points = np.array([*corners, corners[0]], float)
    return _spline(points, "periodic")[:-1]


def smooth_line(points: Sequence[ArrayLike]) -> Array:
    """Return a smooth open curve through some points."""
    return _spline(np.array(points, float), "natural")


def _spline(points: Array, ends: str) -> Array:
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    curve = CubicSpline(length, points, bc_type=ends)
    return np.asarray(curve(np.linspace(0, length[-1], 12 * len(points))))


def stroke(line: Array, width_mm: float) -> Array:
    """Return the outline of a line of some width with round ends."""
    outline = shapely.LineString(line).buffer(width_mm / 2, quad_segs=6)
    return np.asarray(outline.exterior.coords)[:-1]


def shifted(points: ArrayLike, x: float, y: float) -> Array:
    """Return points (..., 2) moved by (x, y), mm."""
    moved: Array = np.asarray(points, float) + np.array([x, y])
    return moved


def band(from_x: float, to_x: float, y: float, half_height: float) -> Array:
    """Return a rectangle between two x, centred at y."""
    low, high = y - half_height, y + half_height
    return np.array([(from_x, low), (to_x, low), (to_x, high), (from_x, high)])
