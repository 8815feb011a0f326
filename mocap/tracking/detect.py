"""Detection of markers: sub-pixel centres with their standard errors.

A marker is fitted as a blurred elliptical disc, or ring, on a plane background:

    I(x) = b0 + b·(x − c) + A [Φ(w (1 − ρ)) − Φ(w (q − ρ))],   ρ = |G (x − c)|

with centre c, symmetric G (semi-axes and direction of the ellipse), edge sharpness w, contrast A
(negative for dark markers), inner radius q relative to the outer one (absent for a disc) and the
cumulative normal distribution Φ. The model is symmetric about c, and so are its usual errors
(another blur, a nonlinear response of the camera, motion during the exposure), which therefore do
not move the centre. The standard error comes from the part of the residual that is antisymmetric
about c, with its correlation between neighbouring pixels: the noise of compression is not white.

Least squares by Levenberg–Marquardt with the exact Jacobian (Marquardt 1963).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.tracking.fit import centre_covariance, fit_disc
from mocap.tracking.spot import (
    CONTRAST,
    INNER,
    PARAMETERS,
    PLAIN,
    SHARPNESS,
    STREAK_X,
    STREAK_Y,
    TINT_X,
    TINT_Y,
)
from mocap.video.channels import GREY

Image: TypeAlias = NDArray[np.uint8]
Array: TypeAlias = NDArray[np.float64]

# Limits of a marker: RMS residual over contrast, ratio of the semi-axes, contrast (grey levels) and
# radius (px).
MISFIT_LIMIT = 0.16
LONGEST_SHAPE = 2.6
LEAST_CONTRAST = 14.0
SMALLEST_RADIUS = 1.2
# Largest relative change of the contrast from the centre to the edge, by light that passes over it.
MOST_TINT = 1.2
# Range of a ring's inner radius over its outer one; outside it the fit is a disc or a thin line.
HOLE = (0.15, 0.92)


@dataclass(frozen=True)
class Detection:
    """A fitted marker.

    Attributes
    ----------
    x, y
        Its centre, px.
    covariance
        (2, 2) covariance of the centre, px².
    radius, aspect
        Geometric mean of the semi-axes, px, and their ratio.
    contrast
        Grey levels; negative for dark on light.
    misfit
        RMS residual over the contrast.
    ring
        Whether the marker is a ring.
    parameters
        (15,) parameters of the model, from which the fit of the next frame starts.
    channel
        What the marker is seen in: grey levels or a colour contrast.
    """

    x: float
    y: float
    covariance: Array
    radius: float
    aspect: float
    contrast: float
    misfit: float
    ring: bool
    parameters: Array
    channel: str = GREY

    @property
    def sigma_px(self) -> float:
        """Standard error of either coordinate, px."""
        return math.sqrt(0.5 * float(np.trace(self.covariance)))


@dataclass(frozen=True)
class Blob:
    """A candidate for a marker: approximate centre and radius, px, and contrast, grey levels."""

    x: float
    y: float
    radius: float
    contrast: float
    hollow: bool = False


def fit_blob(image: Image, blob: Blob, *, ring: bool = False) -> Detection | None:
    """Return the marker near a candidate, or None if there is none.

    Parameters
    ----------
    image
        (height, width) grey levels.
    blob
        The candidate; its radius is right within a factor of about 1.5.
    ring
        Whether the marker is a ring.
    """
    start = np.zeros(PARAMETERS)
    start[:6] = blob.x, blob.y, 1 / blob.radius, 0.0, 1 / blob.radius, max(2.0, blob.radius)
    start[CONTRAST] = blob.contrast
    start[CONTRAST + 1] = _level_around(image, blob)
    start[INNER] = 0.5 if ring else 0.0
    return refit(image, start, ring=ring)


def refit(
    image: Image,
    start: Array,
    *,
    ring: bool = False,
    streaked: bool = False,
    tinted: bool = False,
) -> Detection | None:
    """Return the marker fitted from starting parameters (15,), such as the previous frame's.

    Parameters
    ----------
    image, start
        (height, width) grey levels, and the parameters, in the picture's coordinates.
    ring
        Whether the marker is a ring.
    streaked, tinted
        Whether its streak and its tint (:mod:`mocap.tracking.spot`) are fitted, from those of the
        start, or are zero.
    """
    parameters = np.array(start, float)
    if not streaked:
        parameters[STREAK_X : STREAK_Y + 1] = 0.0
    if not tinted:
        parameters[TINT_X : TINT_Y + 1] = 0.0
    free = _free(ring, streaked, tinted)
    for _ in range(3):
        radius = _radius(parameters)
        if not SMALLEST_RADIUS <= radius <= 0.25 * min(image.shape):
            return None
        window = _window(image, parameters[0], parameters[1], _reach(parameters))
        if window is None:
            return None
        pixels, left, top = window
        local = parameters.copy()
        local[0] -= left
        local[1] -= top
        before = local[:2].copy()
        reach = _reach(parameters)
        fitted, residual, normal, converged = fit_disc(pixels, local, reach, ring, free)
        if not converged or not np.isfinite(fitted).all():
            return None
        moved = float(np.hypot(*(fitted[:2] - before)))
        parameters = fitted.copy()
        parameters[0] += left
        parameters[1] += top
        same_window = moved < 0.75 and abs(_reach(parameters) - reach) < 1.0
        if same_window:
            break
    covariance = centre_covariance(fitted, residual, normal, ring, free)
    if not np.isfinite(covariance).all():
        return None  # in flat surroundings several parameters do the same
    return _detection(parameters, residual, covariance, ring)


def tinted(found: Detection) -> bool:
    """Whether light passes over a marker that was found."""
    return bool(np.any(found.parameters[TINT_X:]))


@lru_cache
def _free(ring: bool, streaked: bool, tinted: bool) -> NDArray[np.int_]:
    """Return the indices of the parameters that are fitted."""
    free = [*range(PLAIN)]
    free += [INNER] if ring else []
    free += [STREAK_X, STREAK_Y] if streaked else []
    free += [TINT_X, TINT_Y] if tinted else []
    return np.array(free)


def unseen_at(at: tuple[float, float]) -> Detection:
    """Return a stand-in for a marker at a position, px, where no spot is; nothing resembles it."""
    parameters = np.zeros(PARAMETERS)
    parameters[:6] = at[0], at[1], 1 / SMALLEST_RADIUS, 0.0, 1 / SMALLEST_RADIUS, 2.0
    return Detection(
        x=at[0],
        y=at[1],
        covariance=np.eye(2),
        radius=SMALLEST_RADIUS,
        aspect=1.0,
        contrast=math.copysign(math.inf, -1),
        misfit=0.0,
        ring=False,
        parameters=parameters,
    )


def find_blobs(
    image: Image,
    *,
    polarity: str,
    offset: tuple[int, int] = (0, 0),
    radius_px: float | None = None,
) -> list[Blob]:
    """Return the round spots of a picture that contrast with their surroundings.

    Parameters
    ----------
    image
        (height, width) grey levels; may be part of a picture.
    polarity
        "dark", "light" or "auto" for both; "ring" for rings of either kind.
    offset
        Column and row (px) of the part in the whole picture, added to the positions returned.
    radius_px
        Radius of the spots that are wanted; the rough radius returned is between half of it and
        twice as much. None: of any radius.
    """
    found: list[Blob] = []
    signs = {"dark": (-1,), "light": (1,)}.get(polarity, (-1, 1))
    smooth = _blurred(image, 3)
    for block in (11, 21, 41, 81):
        if block > 2 * min(image.shape):
            break
        if radius_px is not None and block < radius_px:
            continue
        surround = _blurred(image, block)
        for sign in signs:
            stands_out = (sign * (smooth - surround) > 0.35 * LEAST_CONTRAST).astype(np.uint8)
            found += _round_components(stands_out, smooth, sign, block, offset)
    if radius_px is not None:
        found = [blob for blob in found if 0.5 < blob.radius / radius_px < 2.0]
    return _without_doubles(found)


def detect(
    image: Image,
    *,
    polarity: str,
    offset: tuple[int, int] = (0, 0),
    radius_px: float | None = None,
) -> list[Detection]:
    """Return all markers in a picture; arguments as for :func:`find_blobs`."""
    ring = polarity == "ring"
    detections: list[Detection] = []
    for blob in find_blobs(image, polarity=polarity, radius_px=radius_px):
        found = fit_blob(image, blob, ring=ring)
        if found is None or any(_same_place(found, other) for other in detections):
            continue
        detections.append(_shifted(found, offset))
    return detections


def _detection(
    parameters: Array, residual: Array, covariance: Array, ring: bool
) -> Detection | None:
    """Return the fit as a detection, or None if it is not within the limits of a marker."""
    contrast = float(parameters[CONTRAST])
    a, b, c = (float(value) for value in parameters[2:5])
    # Eigenvalues of the symmetric [[a, b], [b, c]].
    middle, half = 0.5 * (a + c), math.hypot(0.5 * (a - c), b)
    if middle - half <= 0 or not np.isfinite(covariance).all():
        return None
    aspect = (middle + half) / (middle - half)
    inside = residual[np.isfinite(residual)]
    misfit = math.sqrt(float(inside @ inside) / inside.size) / max(abs(contrast), 1e-9)
    if (
        abs(contrast) < LEAST_CONTRAST
        or misfit > MISFIT_LIMIT
        or aspect > LONGEST_SHAPE
        or parameters[SHARPNESS] < 0.8
        or math.hypot(*parameters[TINT_X:]) * _radius(parameters) > MOST_TINT * abs(contrast)
        or (ring and not HOLE[0] < parameters[INNER] < HOLE[1])
    ):
        return None
    return Detection(
        x=float(parameters[0]),
        y=float(parameters[1]),
        covariance=covariance,
        radius=_radius(parameters),
        aspect=aspect,
        contrast=contrast,
        misfit=misfit,
        ring=ring,
        parameters=parameters,
    )


def _shifted(found: Detection, offset: tuple[int, int]) -> Detection:
    parameters = found.parameters.copy()
    parameters[0] += offset[0]
    parameters[1] += offset[1]
    return replace(found, x=found.x + offset[0], y=found.y + offset[1], parameters=parameters)


def _radius(parameters: Array) -> float:
    determinant = float(parameters[2] * parameters[4] - parameters[3] ** 2)
    return 1 / math.sqrt(determinant) if determinant > 0 else math.inf


def _reach(parameters: Array) -> float:
    """Return the radius of the window, px: the marker, a margin in its white square, its streak."""
    radius = _radius(parameters)
    streak = math.hypot(*parameters[STREAK_X : STREAK_Y + 1])
    return radius + min(max(0.6 * radius, 2.5), 6.0) + streak


def _window(
    image: Image, x: float, y: float, reach: float
) -> tuple[NDArray[np.uint8], int, int] | None:
    """Return the square of pixels around a point, or None if it leaves the picture."""
    half = math.ceil(reach) + 1
    if not (math.isfinite(x) and math.isfinite(y)):
        return None
    left, top = round(x) - half, round(y) - half
    right, bottom = left + 2 * half + 1, top + 2 * half + 1
    if left < 0 or top < 0 or right > image.shape[1] or bottom > image.shape[0]:
        return None
    return image[top:bottom, left:right], left, top


def _level_around(image: Image, blob: Blob) -> float:
    """Return the grey level of the surroundings of a blob."""
    half = math.ceil(1.5 * blob.radius) + 2
    row, column = round(blob.y), round(blob.x)
    patch = image[max(row - half, 0) : row + half + 1, max(column - half, 0) : column + half + 1]
    return float(np.percentile(patch, 80 if blob.contrast < 0 else 20)) if patch.size else 128.0


def _blurred(image: Image, size: int) -> NDArray[np.float32]:
    import cv2

    return np.asarray(cv2.blur(image.astype(np.float32), (size, size)), np.float32)


def _round_components(
    mask: NDArray[np.uint8],
    smooth: NDArray[np.float32],
    sign: int,
    block: int,
    offset: tuple[int, int],
) -> list[Blob]:
    """Return the connected, about round spots of a mask that are smaller than the block."""
    import cv2

    count, labels, stats, centres = cv2.connectedComponentsWithStats(mask, connectivity=4)
    blobs = []
    for k in range(1, count):
        left, top, width, height, area = (int(value) for value in stats[k])
        if area < 5 or max(width, height) > block or max(width, height) > 2.6 * min(width, height):
            continue
        touches_edge = left == 0 or top == 0
        touches_edge |= left + width == mask.shape[1] or top + height == mask.shape[0]
        if touches_edge or area < 0.35 * width * height:
            continue
        region = smooth[top : top + height, left : left + width]
        own = region[labels[top : top + height, left : left + width] == k]
        around = smooth[max(top - 3, 0) : top + height + 3, max(left - 3, 0) : left + width + 3]
        outside = np.percentile(around, 85 if sign < 0 else 15)
        contrast = float(np.percentile(own, 15 if sign < 0 else 85) - outside)
        if sign * contrast < LEAST_CONTRAST:
            continue
        blobs.append(
            Blob(
                x=float(centres[k][0]) + offset[0],
                y=float(centres[k][1]) + offset[1],
                radius=max(math.sqrt(0.25 * width * height), 1.5),
                contrast=contrast,
            )
        )
    return blobs


def _without_doubles(blobs: list[Blob]) -> list[Blob]:
    """Return the blobs; of several at one place, only the one of highest contrast."""
    kept: list[Blob] = []
    for blob in sorted(blobs, key=lambda b: -abs(b.contrast)):
        close = (
            math.hypot(blob.x - other.x, blob.y - other.y) < 0.5 * min(blob.radius, other.radius)
            and blob.contrast * other.contrast > 0
            and 0.6 < blob.radius / other.radius < 1.6
            for other in kept
        )
        if not any(close):
            kept.append(blob)
    return kept


def _same_place(one: Detection, other: Detection) -> bool:
    apart = math.hypot(one.x - other.x, one.y - other.y)
    return apart < 0.5 * max(one.radius, other.radius)
