"""From pixels to millimetres: the scale of each body at its own depth.

Without distortion, a point of a body at depth Z appears at x = c + f X/Z. All points of a body in a
plane parallel to the sensor therefore have the same scale m = f/Z (px/mm), and lie at

    X = (x − c_x)/m,   Y = −(y − c_y)/m      (mm, from the camera's axis, y up).

Bodies at different depths have different m. Division of both by the same m displaces one against
the other by (x − c)(1/m₁ − 1/m₂), the largest error of the thesis' measurement.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.motion.turning import (
    CLEAR_CHANGE,
    LEAST_TILT,
    Cause,
    Flattening,
    MarkedPair,
    with_shared_cause,
)
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

# Relative difference of a pair's distance from its scale that is reported.
FORESHORTENED = 0.02
# A body that turns gets its scale from the frames in which it is foreshortened less than this (8°).
LEAST_TURNED = 0.01
# Highest degree of the polynomial in time of a scale.
HIGHEST_DEGREE = 3
# A scale is constant if it changes less than this share over the clip, or less than CLEAR_CHANGE
# standard errors of the fitted curve: more would add noise.
LEAST_CHANGE = 0.003
# Number of frames over which errors are correlated: the encoder copies blocks.
CORRELATED_FRAMES = 8


@dataclass(frozen=True)
class BodyScale:
    """Scale of a body in the picture.

    Parameters
    ----------
    px_per_mm
        (n,) scale in each frame.
    relative_sigma
        Relative standard error of the scale over the clip.
    source
        The body whose marks give the scale.
    change
        Relative change of the scale over the clip.
    foreshortened, enlarged
        Rows of the frames in which the pair appears more than 2 % shorter, or longer, than by its
        scale.
    flattening
        Regression of the dots' shape on their distance.
    tilt_rad
        (n,) turn out of the picture's plane by which the marks appear closer together, rad; empty
        if there is none.
    tilt_may_be_depth
        Whether that may as well be a motion in depth.
    """

    px_per_mm: Array
    relative_sigma: float
    source: str
    change: float
    foreshortened: tuple[int, ...]
    enlarged: tuple[int, ...]
    flattening: Flattening
    tilt_rad: Array = field(default_factory=lambda: np.empty(0))
    tilt_may_be_depth: bool = False


def body_scales(
    tracks: Tracks,
    markers: MarkerFile,
    flat: Array,
    coded: Mapping[str, BodyScale] = MappingProxyType({}),
    *,
    larger: float = 1.0,
) -> dict[str, BodyScale]:
    """Return the scale of every body from marks of known distance.

    Parameters
    ----------
    tracks
        The tracks, for times and errors.
    markers
        The marker file, for distances in mm.
    flat
        (n, m, 2) corrected marker positions, px.
    coded
        Scales of the bodies that carry coded stickers.
    larger
        How many times larger than the moving body the reference body appears, if it has no scale
        of its own.

    Raises
    ------
    ScaleError
        If the marks of a pair coincide or are never detected together.
    """
    pairs = {
        body: MarkedPair.of(tracks, flat, markers, body)
        for body in markers.scale_mm
        if body not in coded
    }
    own = {
        body: _scale_of_pair(pair, body) for body, pair in with_shared_cause(pairs).items()
    } | dict(coded)
    # Other bodies, such as the jaw, are about as deep as the reference body.
    deep = own.get(markers.reference)
    if deep is None:
        moving = own[markers.moving]
        deep = replace(moving, px_per_mm=larger * moving.px_per_mm, tilt_rad=np.empty(0))
    return {body: own.get(body, deep) for body in markers.bodies}


def _scale_of_pair(pair: MarkedPair, body: str) -> BodyScale:
    distance, sigma, seen = pair.distance_px, pair.sigma_px, pair.seen
    fitted, fit_sigma = _slow_trend(pair.time_s, distance, np.maximum(sigma, 1e-4), seen)
    relative = np.hypot(fit_sigma / float(np.mean(fitted)), pair.length_sigma_mm / pair.length_mm)
    tilt = np.empty(0)
    if pair.cause is Cause.TURNING:
        turns = pair.changes()
        start = pair.quick_px.max() if turns else fitted.max()
        level = _unturned(distance, sigma, seen, start, LEAST_TILT if turns else LEAST_TURNED)
        fitted = np.full_like(fitted, level)
        tilt = pair.tilt(level) if turns else tilt
    elif pair.cause is Cause.DEPTH and pair.changes(besides=fitted, least=LEAST_CHANGE):
        fitted = pair.quick_px
    elif pair.cause is Cause.UNKNOWN and pair.changes():
        tilt = pair.tilt(pair.quick_px.max())
    differs = FORESHORTENED * fitted + 3 * sigma
    return BodyScale(
        px_per_mm=fitted / pair.length_mm,
        relative_sigma=float(relative),
        source=body,
        change=float(np.ptp(fitted) / np.mean(fitted)),
        foreshortened=tuple(int(i) for i in np.flatnonzero(seen & (distance < fitted - differs))),
        enlarged=tuple(int(i) for i in np.flatnonzero(seen & (distance > fitted + differs))),
        flattening=pair.flattening,
        tilt_rad=tilt,
        tilt_may_be_depth=pair.cause is Cause.UNKNOWN,
    )


def _unturned(
    distance: Array, sigma: Array, use: NDArray[np.bool_], start: float, least: float
) -> float:
    """Return the distance of a pair at its smallest rotation, px.

    This is the weighted mean of the samples that are not shorter by clearly more than the share
    ``least``, iterated from ``start``.
    """
    level = float(start)
    for _ in range(20):
        kept = use & (distance > (1 - least) * level - 2 * sigma)
        if not kept.any():
            break
        weight = 1 / np.maximum(sigma[kept], 1e-4) ** 2
        before, level = level, float(weight @ distance[kept] / weight.sum())
        if abs(level - before) < 1e-6 * level:
            break
    return level


def _slow_trend(
    time: Array, distance: Array, sigma: Array, use: NDArray[np.bool_]
) -> tuple[Array, float]:
    """Return a polynomial in time fitted to an apparent distance (n,), px, and its standard error.

    The degree is that of least BIC. A polynomial that changes less than ``LEAST_CHANGE`` over the
    clip is replaced by the weighted mean. The weights are Huber's.
    """
    span = max(float(np.ptp(time)), 1e-9)
    s = 2 * (time - time[0]) / span - 1
    best: tuple[float, Array, float] | None = None
    for degree in range(min(HIGHEST_DEGREE, max(int(use.sum()) // 8, 0)) + 1):
        basis = np.polynomial.chebyshev.chebvander(s, degree)
        weight = 1 / sigma[use]
        robust = np.ones_like(weight)
        for _ in range(5):
            scaled = basis[use] * (weight * robust)[:, None]
            coefficients = np.linalg.lstsq(scaled, distance[use] * weight * robust)[0]
            residual = np.abs(distance[use] - basis[use] @ coefficients) * weight
            typical = 1.4826 * max(float(np.median(residual)), 1e-9)
            robust = np.sqrt(np.minimum(1.0, 2.5 * typical / np.maximum(residual, 1e-12)))
        curve = basis @ coefficients
        misfit = float(np.sum((residual * robust) ** 2)) + 1e-12
        count = int(use.sum())
        freedom = max(count - degree - 1, 1)
        inverse = np.linalg.pinv(scaled.T @ scaled) * misfit / freedom
        spread = float(np.sqrt(np.mean(np.einsum("ij,jk,ik->i", basis, inverse, basis))))
        score = count * float(np.log(misfit / count)) + (degree + 1) * float(np.log(count))
        spread *= inflation((distance[use] - basis[use] @ coefficients) * weight * robust)
        least = max(LEAST_CHANGE * float(np.mean(curve[use])), CLEAR_CHANGE * spread)
        if degree and np.ptp(curve[use]) < least:
            continue
        if best is None or score < best[0] - 6.0:
            best = (score, curve, spread)
    assert best is not None
    return best[1], best[2]


def inflation(residual: Array) -> float:
    """Return the factor by which correlation of a residual increases a mean's standard error."""
    total = float(residual @ residual)
    together = 0.0
    for lag in range(1, min(CORRELATED_FRAMES, residual.size - 1) + 1):
        shared = float(residual[lag:] @ residual[:-lag]) / max(total, 1e-30)
        if shared <= 0:
            break
        together += shared
    # A fitted mean lowers the correlation of the residual by about 1/n at each lag.
    return float(np.sqrt(1 + 2 * together + 2.0 * CORRELATED_FRAMES / residual.size))


def positions_mm(
    flat: Array,
    names: tuple[str, ...],
    markers: MarkerFile,
    scales: Mapping[str, BodyScale],
    centre: Array,
) -> Array:
    """Return marker positions (n, m, 2), mm from the camera's axis, y up.

    Parameters
    ----------
    flat
        (n, m, 2) corrected positions, px.
    names
        The m markers.
    markers, scales
        The marker file, for the bodies, and their scales.
    centre
        (2,) corrected position of the camera's axis, px.
    """
    world = np.full_like(flat, np.nan)
    for k, name in enumerate(names):
        body = markers.body_of(name)
        assert body is not None
        scale = scales[body].px_per_mm[:, None]
        world[:, k] = (flat[:, k] - centre) / scale * np.array([1.0, -1.0])
    return world
