"""Correction of picture points for lens distortion, pixel shape and an oblique view."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from mocap.motion.errors import ScaleError
from mocap.tracking.markers import Intrinsics, MarkerFile, PlanePoints

Array: TypeAlias = NDArray[np.float64]

LEAST_FOR_SPLINE = 4
"""Frames from which the motion between two of them is known."""


@dataclass(frozen=True)
class PictureFormat:
    """How pictures are measured.

    Attributes
    ----------
    width, height
        Size, px.
    pixel_aspect
        Width of a pixel over its height.
    mirrored
        Whether left and right are exchanged, so that a person who faces left faces right.
    """

    width: int
    height: int
    pixel_aspect: float = 1.0
    mirrored: bool = False

    @property
    def sides(self) -> Array:
        """Factors (2,) of x and y, from the camera's axis, in the picture that is measured."""
        return np.array([-1.0 if self.mirrored else 1.0, 1.0])


def axis_px(lens: Intrinsics, picture: PictureFormat) -> Array:
    """Return the point (2,), px, where the camera's axis meets the picture."""
    middle = (0.5 * (picture.width - 1), 0.5 * (picture.height - 1))
    return np.array(
        [
            middle[0] if lens.cx is None else lens.cx,
            middle[1] if lens.cy is None else lens.cy,
        ]
    )


def undistorted(points_px: ArrayLike, lens: Intrinsics, picture: PictureFormat) -> Array:
    """Return picture points (..., 2), px, without distortion and for square pixels.

    In a mirrored picture they are mirrored about the camera's axis. Newton iterations with a
    finite-difference Jacobian invert the distortion (Brown 1966, in OpenCV's convention) to 1e-9 of
    the focal length.
    """
    points = np.asarray(points_px, float)
    centre = axis_px(lens, picture)
    if not lens.is_distorting:
        ratio = picture.pixel_aspect if lens.fx is None or lens.fy is None else lens.fy / lens.fx
        flat: Array = centre + (points - centre) * np.array([ratio, 1.0]) * picture.sides
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
    straight: Array = centre + guess * lens.fy * picture.sides
    return straight


def corrected(points_px: ArrayLike, markers: MarkerFile, picture: PictureFormat) -> Array:
    """Return picture points (..., 2) corrected for lens, pixel shape and oblique view.

    They are in px, or in mm with y down if the marker file has a ``[plane]``.
    """
    if markers.plane is None:
        return undistorted(points_px, markers.lens, picture)
    as_filmed = undistorted(points_px, markers.lens, replace(picture, mirrored=False))
    flat: Array = rectified(as_filmed, markers.plane) * picture.sides
    return flat


def at_frame_times(position_px: Array, time_s: Array, readout_s: float, height: int) -> Array:
    """Return where marks were when the first row of each frame was exposed, px.

    A rolling shutter exposes row y later by y/height of the readout. A cubic spline through the
    positions at their own times is read at those of the frames.

    Parameters
    ----------
    position_px
        (n, m, 2) positions in the film, px; nan where a mark is lost.
    time_s
        (n,) times of the frames' first rows, s.
    readout_s, height
        Time from the first row to the last, s, and the number of rows.
    """
    moved = position_px.copy()
    for k in range(position_px.shape[1]):
        known = np.isfinite(position_px[:, k, 0])
        if np.count_nonzero(known) < LEAST_FOR_SPLINE:
            continue
        place, time = position_px[known, k], time_s[known]
        exposed = time + readout_s * place[:, 1] / height
        moved[known, k] = CubicSpline(exposed, place)(time)
    return moved


def rectified(points_px: Array, plane: PlanePoints) -> Array:
    """Return points (..., 2) in the plane of four known points, mm, y **down**.

    The homography follows from the four pairs (Hartley and Zisserman 2004, §4.1).
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
