"""Stickers in a picture: found and named by their code, four corners each with their errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.stickers.codes import StickerCode, codes_by_number
from mocap.stickers.fit import (
    BLACK_LIGHT,
    BLUR_U,
    BLUR_V,
    CONTRAST_LIGHT,
    GAMMA,
    HALF,
    PARAMETERS,
    fit_code,
    noise_variance,
)

Image: TypeAlias = NDArray[np.uint8]
Array: TypeAlias = NDArray[np.float64]

CORNERS = HALF * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
"""Corners of the black square in cells from its centre: from the top left, clockwise."""

# Limits of a sticker: RMS residual over contrast, contrast (grey levels), side (px), and the ratio
# of its sides, that of a turn by 65° out of the plane.
MISFIT_LIMIT = 0.10
LEAST_CONTRAST = 25.0
SMALLEST_SIDE = 11.0
# Largest mean residual of a cell over the contrast: a cell that is dark in place of light leaves
# all of it where it is sharp, and half of it where it is blurred over its own width.
CELL_LIMIT = 0.3
LONGEST_SHAPE = 2.4
# Correlation of the cells' grey levels with a code from which its fit is tried.
LEAST_LIKENESS = 0.6
# Blur with which a fit starts, px.
START_BLUR_PX = 1.2


@dataclass(frozen=True)
class Sticker:
    """A fitted sticker.

    Attributes
    ----------
    code
        What its pattern says: marker and side.
    corners
        (4, 2) corners of the black square, px, from its own top left clockwise.
    covariance
        (8, 8) covariance of the corners x0, y0, x1, …, px².
    misfit
        RMS residual over the contrast.
    parameters
        (15,) parameters of the fit, from ``middle``, px.
    middle
        Column and row that the parameters count from.
    """

    code: StickerCode
    corners: Array
    covariance: Array
    misfit: float
    parameters: Array
    middle: tuple[float, float]

    @property
    def centre(self) -> Array:
        """Centre (2,) of the square in perspective, px: where its diagonals cross."""
        return centre_of(self.corners, self.covariance)[0]

    @property
    def centre_sigma_px(self) -> float:
        """Standard error of a coordinate of the centre, px."""
        return centre_of(self.corners, self.covariance)[1]

    @property
    def side_px(self) -> float:
        """Mean side of the square, px."""
        return float(np.hypot(*(self.corners - np.roll(self.corners, -1, axis=0)).T).mean())


def centre_of(corners: Array, covariance: Array) -> tuple[Array, float]:
    """Return the centre (2,) of corners (4, 2), px, and its standard error in a coordinate."""
    centre = _diagonals_cross(corners)
    jacobian = np.empty((2, 8))
    for k in range(8):
        moved = corners.copy()
        moved.flat[k] += 1e-4
        jacobian[:, k] = (_diagonals_cross(moved) - centre) / 1e-4
    return centre, math.sqrt(0.5 * float(np.trace(jacobian @ covariance @ jacobian.T)))


def _diagonals_cross(corners: Array) -> Array:
    """Return the point (2,) where the diagonals of four corners (4, 2) cross."""
    a, b = corners[2] - corners[0], corners[3] - corners[1]
    apart = corners[1] - corners[0]
    share = (apart[0] * b[1] - apart[1] * b[0]) / (a[0] * b[1] - a[1] * b[0])
    return np.asarray(corners[0] + share * a)


def find_stickers(image: Image, *, offset: tuple[int, int] = (0, 0)) -> dict[str, Sticker]:
    """Return the stickers in a picture by marker; of two with one name, the one that fits better.

    Parameters
    ----------
    image
        (height, width) grey levels; may be part of a picture.
    offset
        Column and row (px) of the part in the whole picture, added to the positions returned.
    """
    found: dict[str, Sticker] = {}
    named, _, unnamed = _detector(max(image.shape)).detectMarkers(image)
    outlines = [np.asarray(outline, float).reshape(4, 2) for outline in (*named, *unnamed)]
    for code, corners in _resembling(image, outlines):
        sticker = fit_sticker(image, code, corners, offset)
        best = found.get(code.marker)
        if sticker is not None and (best is None or sticker.misfit < best.misfit):
            found[code.marker] = sticker
    return found


def _resembling(image: Image, outlines: list[Array]) -> list[tuple[StickerCode, Array]]:
    """Return the code, and its corners in order, of each outline that resembles one.

    The grey levels in the middle of the cells are compared with all patterns in all directions.
    OpenCV's decoder reads each cell as black or white and gives up where an outline of 20 px is a
    pixel off.
    """
    if not outlines:
        return []
    import cv2

    cells = 2 * HALF
    middles = np.arange(cells) + 0.5 - HALF
    at = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 1, 2)
    patterns, owners = _patterns()
    similar = []
    for corners in outlines:
        to_picture = cv2.getPerspectiveTransform(
            CORNERS.astype(np.float32), corners.astype(np.float32)
        )
        x, y = np.moveaxis(cv2.perspectiveTransform(at, to_picture).astype(np.float32), -1, 0)
        levels = np.ravel(cv2.remap(image, x, y, cv2.INTER_LINEAR)).astype(float)
        spread = float(levels.std())
        if spread < 0.2 * LEAST_CONTRAST:
            continue
        likeness = patterns @ ((levels - levels.mean()) / spread)
        best = int(np.argmax(likeness))
        if likeness[best] > LEAST_LIKENESS:
            number, quarters = owners[best]
            code = codes_by_number()[number]
            similar.append((code, np.roll(corners, -quarters, axis=0)))
    return similar


@cache
def _patterns() -> tuple[Array, list[tuple[int, int]]]:
    """Return all codes in all directions (n, 36), scaled for correlation; number and turn."""
    rows, owners = [], []
    for number, code in codes_by_number().items():
        for quarters in range(4):
            levels = np.rot90(~code.dark, -quarters).ravel().astype(float)
            levels -= levels.mean()
            rows.append(levels / (np.linalg.norm(levels) * math.sqrt(levels.size)))
            owners.append((number, quarters))
    return np.array(rows), owners


def fit_sticker(
    image: Image, code: StickerCode, corners: Array, offset: tuple[int, int] = (0, 0)
) -> Sticker | None:
    """Return the sticker of a code fitted from approximate corners (4, 2), px, or None."""
    side = float(np.hypot(*(corners - np.roll(corners, -1, axis=0)).T).mean())
    if not SMALLEST_SIDE <= side <= 0.5 * min(image.shape):
        return None
    start = np.zeros(PARAMETERS)
    start[BLUR_U] = start[BLUR_V] = min(max(START_BLUR_PX * 2 * HALF / side, 0.05), 0.8)
    return _fitted(image, code, corners, start, offset)


def refit_sticker(image: Image, before: Sticker, moved_px: Array) -> Sticker | None:
    """Return a sticker at its last place moved by (2,) px; None if its pattern is not there."""
    return _fitted(image, before.code, before.corners + moved_px, before.parameters, (0, 0))


def _fitted(
    image: Image, code: StickerCode, corners: Array, start: Array, offset: tuple[int, int]
) -> Sticker | None:
    parameters = start.copy()
    for _ in range(3):
        window = _window(image, corners)
        if window is None:
            return None
        pixels, middle = window
        parameters[:8] = _to_cells(corners - middle)
        if parameters[CONTRAST_LIGHT] <= 0:
            parameters[BLACK_LIGHT], parameters[CONTRAST_LIGHT] = _light(pixels)
        before = corners
        fitted, residual, normal, converged = fit_code(pixels, code.dark, parameters)
        if not converged or not np.isfinite(fitted).all():
            return None
        parameters, corners = fitted.copy(), _corners(fitted) + middle
        if np.abs(corners - before).max() < 0.7:
            break
    return _sticker(code, corners, parameters, residual, normal, middle, offset)


def _sticker(
    code: StickerCode,
    corners: Array,
    parameters: Array,
    residual: Array,
    normal: Array,
    middle: Array,
    offset: tuple[int, int],
) -> Sticker | None:
    """Return the fit as a sticker, or None if it is not within the limits of one."""
    variance, widened = noise_variance(residual, PARAMETERS)
    black, white = (
        255 * float(np.clip(light, 0, 1)) ** (1 / GAMMA)
        for light in (
            parameters[BLACK_LIGHT],
            parameters[BLACK_LIGHT] + parameters[CONTRAST_LIGHT],
        )
    )
    contrast = white - black
    sides = np.hypot(*(corners - np.roll(corners, -1, axis=0)).T)
    if not (contrast > LEAST_CONTRAST and math.isfinite(variance)):
        return None
    misfit = math.sqrt(variance) / contrast
    if misfit > MISFIT_LIMIT or sides.min() < SMALLEST_SIDE / LONGEST_SHAPE:
        return None
    if sides.max() > LONGEST_SHAPE * sides.min():
        return None
    if _worst_cell(residual, corners - middle) > CELL_LIMIT * contrast:
        return None
    # Rounding to whole grey levels adds a variance of 1/12.
    inverse = np.linalg.pinv(normal, hermitian=True) * (variance * widened + 1 / 12)
    to_corners = _corner_jacobian(parameters)
    covariance = to_corners @ inverse[:8, :8] @ to_corners.T
    if not np.isfinite(covariance).all() or np.any(np.diag(covariance) <= 0):
        return None
    at = np.asarray(offset, float)
    place = (float(middle[0] + at[0]), float(middle[1] + at[1]))
    return Sticker(code, corners + at, covariance, misfit, parameters, place)


def _worst_cell(residual: Array, corners: Array) -> float:
    """Return the largest mean residual of a cell; ``corners``, px, count from the middle."""
    import cv2

    steps = np.arange(6 * HALF) / 3 + 1 / 6 - HALF
    at = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 1, 2)
    to_picture = cv2.getPerspectiveTransform(CORNERS.astype(np.float32), corners.astype(np.float32))
    places = cv2.perspectiveTransform(at, to_picture) + 0.5 * (np.array(residual.shape[::-1]) - 1)
    x, y = np.moveaxis(places.astype(np.float32), -1, 0)
    known = np.nan_to_num(residual).astype(np.float32)
    cells = cv2.remap(known, x, y, cv2.INTER_LINEAR).reshape(2 * HALF, 3, 2 * HALF, 3)
    return float(np.abs(cells.mean(axis=(1, 3))).max())


def _window(image: Image, corners: Array) -> tuple[Image, Array] | None:
    """Return the pixels around a square with its margin, and their middle; None off the picture."""
    centre = corners.mean(axis=0)
    reach = (corners - centre) * (1 + 1 / HALF)
    low = np.floor((centre + reach).min(axis=0)).astype(int)
    high = np.ceil((centre + reach).max(axis=0)).astype(int) + 1
    if np.any(low < 0) or high[0] > image.shape[1] or high[1] > image.shape[0]:
        return None
    pixels = np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]])
    return pixels, 0.5 * (low + high - 1)


def _light(pixels: Image) -> tuple[float, float]:
    """Return the light of black and its difference to white, 1 being the brightest white."""
    dark, bright = (float(v) / 255 for v in np.percentile(pixels, (8, 92)))
    black = max(dark, 0.01) ** GAMMA
    return black, max(bright**GAMMA - black, 0.01)


def _to_cells(corners: Array) -> Array:
    """Return the homography (8,) from picture points to cells that takes corners (4, 2) there."""
    rows, right = [], []
    for (x, y), (u, v) in zip(corners, CORNERS, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
        right += [u, v]
    return np.asarray(np.linalg.solve(np.array(rows), np.array(right)))


def _corners(parameters: Array) -> Array:
    """Return the corners (4, 2) of a homography (8,) from the middle of the window, px."""
    matrix = np.append(parameters[:8], 1.0).reshape(3, 3)
    back = np.linalg.inv(matrix)
    points = np.column_stack([CORNERS, np.ones(4)]) @ back.T
    return np.asarray(points[:, :2] / points[:, 2:])


def _corner_jacobian(parameters: Array) -> Array:
    """Return the derivatives (8, 8) of the corners by the homography."""
    jacobian = np.empty((8, 8))
    for k in range(8):
        step = 1e-6 * max(abs(float(parameters[k])), 1e-3)
        ends = []
        for sign in (1, -1):
            moved = parameters.copy()
            moved[k] += sign * step
            ends.append(_corners(moved))
        jacobian[:, k] = ((ends[0] - ends[1]) / (2 * step)).ravel()
    return jacobian


@cache
def _detector(longest_px: int) -> Any:
    """Return OpenCV's detector for pictures of a size; the fit tests what it proposes."""
    import cv2

    settings = cv2.aruco.DetectorParameters()
    settings.minMarkerPerimeterRate = 4 * SMALLEST_SIDE / longest_px
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    return cv2.aruco.ArucoDetector(dictionary, settings)
