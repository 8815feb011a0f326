"""From pixels to millimetres: lens, pixel shape, plane of motion, and the depth of each body.

A point of a body at depth Z appears at x = c + f X/Z. After the lens is undone a body therefore has
one scale m = f/Z (px/mm), the same for all its points while it stays in a plane parallel to the
sensor, and lies at

    X = (x − c_x)/m,   Y = −(y − c_y)/m      (mm, from the camera's axis, y up).

Two bodies at different depths have different m. Dividing both by the same m, as is usual, displaces
one against the other by (x − c)(1/m₁ − 1/m₂): the largest error of the work this program follows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.foundation.errors import DrinksimError
from mocap.motion.turning import Cause, Flattening, flattening
from mocap.tracking.markers import Intrinsics, MarkerFile, PlanePoints
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

# Marks whose distance differs by this share are turned out of the plane or moved in depth.
FORESHORTENED = 0.02
# Marks of a body that turns count for its scale while it is turned less than by this share (8°).
LEAST_TURNED = 0.01
# Highest degree of the polynomial in time that a scale may follow.
HIGHEST_DEGREE = 3
# A change of scale over the clip below this share is not followed: it would only add noise.
LEAST_CHANGE = 0.003
# ... and so is one of fewer standard errors of the fitted curve than this.
CLEAR_CHANGE = 8.0
# Frames over which errors may go together: compressed pictures repeat themselves.
CORRELATED_FRAMES = 8


class ScaleError(DrinksimError):
    """Marks from which no scale can be had."""


@dataclass(frozen=True)
class PictureFormat:
    """Size of the picture (px) and the width of a pixel over its height."""

    width: int
    height: int
    pixel_aspect: float = 1.0


@dataclass(frozen=True)
class BodyScale:
    """How large a body appears.

    Parameters
    ----------
    px_per_mm
        (n,) scale in each frame.
    relative_sigma
        Standard error of the scale over the scale, the same throughout the clip.
    source
        The body whose marks gave it.
    change
        Share by which the scale varies over the clip.
    foreshortened, enlarged
        Frame rows in which the pair appears shorter, or longer, than its scale says by more than
        2 %.
    flattening
        What the dots' shape says about why the distance changes.
    """

    px_per_mm: Array
    relative_sigma: float
    source: str
    change: float
    foreshortened: tuple[int, ...]
    enlarged: tuple[int, ...]
    flattening: Flattening


def axis_px(lens: Intrinsics, picture: PictureFormat) -> Array:
    """Return where the camera's axis meets the picture (2,), px."""
    middle = (0.5 * (picture.width - 1), 0.5 * (picture.height - 1))
    return np.array(
        [
            middle[0] if lens.cx is None else lens.cx,
            middle[1] if lens.cy is None else lens.cy,
        ]
    )


def undistorted(points_px: ArrayLike, lens: Intrinsics, picture: PictureFormat) -> Array:
    """Return picture points (..., 2) as a perfect lens and square pixels would show them.

    The polynomial of Brown (1966) as OpenCV writes it is inverted by Newton iterations with a
    Jacobian from finite differences, to 1e-9 of the focal length.
    """
    points = np.asarray(points_px, float)
    centre = axis_px(lens, picture)
    if not lens.is_distorting:
        ratio = picture.pixel_aspect if lens.fx is None or lens.fy is None else lens.fy / lens.fx
        flat: Array = centre + (points - centre) * np.array([ratio, 1.0])
        return flat
    assert lens.fx is not None and lens.fy is not None
    focal = np.array([lens.fx, lens.fy])
    target = (points - centre) / focal
    guess = target.copy()
    step = 1e-6
    along = step * np.eye(2)
    for _ in range(20):
        error = lens.distorted(guess) - target
        along_x = (lens.distorted(guess + along[0]) - lens.distorted(guess)) / step
        along_y = (lens.distorted(guess + along[1]) - lens.distorted(guess)) / step
        determinant = along_x[..., 0] * along_y[..., 1] - along_y[..., 0] * along_x[..., 1]
        dx = (error[..., 0] * along_y[..., 1] - error[..., 1] * along_y[..., 0]) / determinant
        dy = (along_x[..., 0] * error[..., 1] - along_x[..., 1] * error[..., 0]) / determinant
        guess = guess - np.stack([dx, dy], axis=-1)
        if np.nanmax(np.abs(error), initial=0.0) < 1e-9:
            break
    straight: Array = centre + guess * lens.fy
    return straight


def flattened(points_px: ArrayLike, markers: MarkerFile, picture: PictureFormat) -> Array:
    """Return picture points (..., 2) without errors of lens, pixel shape and slanted view.

    They stay px, or with ``[plane]`` become mm with y down.
    """
    flat = undistorted(points_px, markers.lens, picture)
    return flat if markers.plane is None else rectified(flat, markers.plane)


def rectified(points_px: Array, plane: PlanePoints) -> Array:
    """Return points (..., 2) seen square on, in mm with y **down**, from four points of a plane.

    The homography is solved from the four pairs (Hartley and Zisserman 2004, §4.1).
    """
    image = np.array(plane.image_px)
    world = np.array(plane.world_mm) * [1.0, -1.0]
    rows, right = [], []
    for (x, y), (u, v) in zip(image, world, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
        right += [u, v]
    try:
        h = np.append(np.linalg.solve(np.array(rows), np.array(right)), 1.0).reshape(3, 3)
    except np.linalg.LinAlgError:
        raise ScaleError("[plane]: three of the four points lie on a line") from None
    homogeneous = np.concatenate([points_px, np.ones((*points_px.shape[:-1], 1))], axis=-1) @ h.T
    mapped: Array = homogeneous[..., :2] / homogeneous[..., 2:]
    return mapped


def body_scales(tracks: Tracks, markers: MarkerFile, flat: Array) -> dict[str, BodyScale]:
    """Return the scale of every body from the marks whose distance is known.

    Parameters
    ----------
    tracks
        The tracks, for times and errors.
    markers
        The distances in mm.
    flat
        (n, m, 2) marker positions without lens errors, px.

    Raises
    ------
    ScaleError
        If the marks of a pair coincide or are never seen together.
    """
    own = {
        body: _scale_of_pair(tracks, flat, markers.bodies[body][:2], length, markers, body)
        for body, length in markers.scale_mm.items()
    }
    # Whatever else is marked, such as the jaw, lies about as deep as the reference body.
    deep = own.get(markers.reference) or own[markers.moving]
    return {body: own.get(body, deep) for body in markers.bodies}


def _scale_of_pair(
    tracks: Tracks,
    flat: Array,
    pair: tuple[str, ...],
    length_mm: float,
    markers: MarkerFile,
    body: str,
) -> BodyScale:
    first, second = (tracks.names.index(name) for name in pair)
    both = tracks.known(pair[0]) & tracks.known(pair[1])
    if not both.any():
        raise ScaleError(
            f"{pair[0]} and {pair[1]} are never seen in the same frame, so {body} has no scale"
        )
    distance = np.hypot(*(flat[:, first] - flat[:, second]).T)
    if np.median(distance[both]) < 4.0:
        raise ScaleError(
            f"{pair[0]} and {pair[1]} coincide ({np.median(distance[both]):.1f} px apart): one of "
            "them has a wrong position in the marker file"
        )
    sigma = np.hypot(tracks.sigma_px[:, first], tracks.sigma_px[:, second])
    time = tracks.time_s
    fitted, fit_sigma = _slow_trend(time, distance, np.maximum(sigma, 1e-4), both)
    change = float(np.ptp(fitted) / np.mean(fitted))
    relative = np.hypot(
        fit_sigma / float(np.mean(fitted)), markers.scale_sigma_mm[body] / length_mm
    )
    flat_dots = Flattening(np.nan, np.nan)
    if tracks.ellipse is not None:
        pair_at = [first, second]
        flat_dots = flattening(
            time[both], tracks.position_px[both][:, pair_at], tracks.ellipse[both][:, pair_at]
        )
    if flat_dots.cause is Cause.TURNING:
        fitted, change = np.full_like(fitted, _unturned(distance, sigma, both, fitted.max())), 0.0
    differs = FORESHORTENED * fitted + 3 * sigma
    return BodyScale(
        px_per_mm=fitted / length_mm,
        relative_sigma=float(relative),
        source=body,
        change=change,
        foreshortened=tuple(int(i) for i in np.flatnonzero(both & (distance < fitted - differs))),
        enlarged=tuple(int(i) for i in np.flatnonzero(both & (distance > fitted + differs))),
        flattening=flat_dots,
    )


def _unturned(distance: Array, sigma: Array, use: NDArray[np.bool_], start: float) -> float:
    """Return the distance of a pair when it is turned least: what turns keeps its scale.

    The weighted mean of the samples that are not clearly shorter than it, from ``start`` on.
    """
    level = float(start)
    for _ in range(20):
        kept = use & (distance > (1 - LEAST_TURNED) * level - 2 * sigma)
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
    """Return a polynomial in time through an apparent distance (n,) and its standard error (px).

    The degree is the one of least BIC; a polynomial that changes less than ``LEAST_CHANGE`` over
    the clip gives way to the weighted mean. Outliers weigh less (Huber).
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
        spread *= _inflation((distance[use] - basis[use] @ coefficients) * weight * robust)
        least = max(LEAST_CHANGE * float(np.mean(curve[use])), CLEAR_CHANGE * spread)
        if degree and np.ptp(curve[use]) < least:
            continue
        if best is None or score < best[0] - 6.0:
            best = (score, curve, spread)
    assert best is not None
    return best[1], best[2]


def _inflation(residual: Array) -> float:
    """Return by what factor a mean is less certain because neighbouring residuals go together."""
    total = float(residual @ residual)
    together = 0.0
    for lag in range(1, min(CORRELATED_FRAMES, residual.size - 1) + 1):
        shared = float(residual[lag:] @ residual[:-lag]) / max(total, 1e-30)
        if shared <= 0:
            break
        together += shared
    # A fitted mean takes its own share out of the residual's correlation: about 1/n at each lag.
    return float(np.sqrt(1 + 2 * together + 2.0 * CORRELATED_FRAMES / residual.size))


def positions_mm(
    flat: Array,
    names: tuple[str, ...],
    markers: MarkerFile,
    scales: Mapping[str, BodyScale],
    centre: Array,
) -> Array:
    """Return marker positions (n, m, 2), mm from the camera's axis, y up, at their body's depth."""
    world = np.full_like(flat, np.nan)
    for k, name in enumerate(names):
        body = markers.body_of(name)
        assert body is not None
        scale = scales[body].px_per_mm[:, None]
        world[:, k] = (flat[:, k] - centre) / scale * np.array([1.0, -1.0])
    return world
