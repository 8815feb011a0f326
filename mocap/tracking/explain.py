"""What a plain disc does not explain of a marker: its streak, and light that passes over it.

A plain disc, fitted to a marker on which a highlight's edge lies, has its centre up to a pixel off,
and its residual does not show it. A disc whose contrast changes across it is about a third as far
off, on the other side (rendered films). What that is, is told by how far the two centres are apart.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.tracking.detect import Detection, Image, refit
from mocap.tracking.spot import CONTRAST, INNER, LEVEL, STREAK_X, STREAK_Y, TINT_X

Array: TypeAlias = NDArray[np.float64]

# A tint is taken if the RMS residual with it is less than this share of that without: chance takes
# less away with two parameters more. A streak, which is expected of a marker on its way, and does
# not move the centre, at the second share.
TINT_EXPLAINS = 0.7
STREAK_EXPLAINS = 0.9
# Half a streak of this many radii and less leaves the centre of a plain disc where it is.
SHORT = 0.6
# A marker is smeared if its path between two frames exceeds this share of its radius.
LEAST_PATH = 0.3
# Lengths of the half streak from which fits start, as shares of the path between two frames: the
# shutter is open for half of the time, or for all of it. They end with a misfit below this one.
HALF_STREAKS = (0.25, 0.5)
ENOUGH = 0.05
# Least share of the usual contrast of what stands out.
STANDS_OUT = 0.3
# Standard error of a tinted marker's centre, in radii, where the contrast at the edge is twice that
# at the centre.
TINT_ERROR = 0.1


def explained(
    image: Image, plain: Detection | None, expected: Array, path_px: Array, *, believed: bool
) -> Detection | None:
    """Return a fit that explains a marker clearly better than a plain disc; None if none does.

    Parameters
    ----------
    image
        (height, width) grey levels.
    plain
        The fit of a plain disc, if there is one.
    expected
        (15,) parameters that are expected, from which fits start.
    path_px
        (2,) the marker's way since the frame before, px.
    believed
        Whether the plain fit could be the marker. If not, it need not be surpassed by a streak.
    """
    radius, best = _radius(expected), plain
    path = float(np.hypot(*path_px))
    if path > LEAST_PATH * radius:
        streak = _streaked(image, plain, expected, path_px)
        if streak is not None:
            streak = _with_error(streak, _bend(streak, expected, path))
            if plain is None or not believed or _surpasses(streak, plain):
                best = streak
    tint = _tinted(image, expected if best is None else best.parameters)
    if tint is not None and (best is None or _rms(tint) < TINT_EXPLAINS * _rms(best)):
        best = _with_error(tint, _tint_error(tint))
    return None if best is plain else best


def _streaked(
    image: Image, plain: Detection | None, start: Array, path_px: Array
) -> Detection | None:
    """Return the best fit with a streak.

    A fit ends far from the marker if it starts half a streak beside it. It starts where a plain
    disc was found, at the start's centre, or at that of what stands out there.
    """
    ring = bool(start[INNER] > 0)
    centres = [start[:2]] if plain is None else [plain.parameters[:2], start[:2]]
    if not ring:
        centres.append(_centre_of_contrast(image, start, float(np.hypot(*path_px))))
    best: Detection | None = None
    for centre, share in itertools.product(centres, HALF_STREAKS):
        smeared = start.copy()
        smeared[:2] = centre
        smeared[STREAK_X : STREAK_Y + 1] = share * path_px
        found = refit(image, smeared, ring=ring, streaked=True)
        if found is not None and (best is None or _rms(found) < _rms(best)):
            best = found
        if best is not None and best.misfit < ENOUGH:
            return best
    return best


def _surpasses(streak: Detection, plain: Detection) -> bool:
    """Whether a streak is long enough to matter and explains a marker better than a disc."""
    half = float(np.hypot(*streak.parameters[STREAK_X : STREAK_Y + 1]))
    return half > SHORT * streak.radius and _rms(streak) < STREAK_EXPLAINS * _rms(plain)


def _centre_of_contrast(image: Image, start: Array, reach: float) -> Array:
    """Return the mean place (2,), px, of what is darker, or lighter, than the surroundings."""
    half = round(_radius(start) + reach / 2)
    column, row = round(start[0]), round(start[1])
    left, top = max(column - half, 0), max(row - half, 0)
    part = image[top : row + half + 1, left : column + half + 1].astype(float)
    if part.size == 0:
        return start[:2]
    share = np.clip((part - start[LEVEL]) / start[CONTRAST], 0.0, 1.0)
    share[share < STANDS_OUT] = 0.0
    if share.sum() == 0.0:
        return start[:2]
    rows, columns = np.mgrid[top : top + part.shape[0], left : left + part.shape[1]]
    return np.asarray(np.array([(share * columns).sum(), (share * rows).sum()]) / share.sum())


def _tinted(image: Image, start: Array) -> Detection | None:
    """Return a fit with a tint, and with a streak if the start has one."""
    streaked = bool(np.any(start[STREAK_X : STREAK_Y + 1]))
    return refit(image, start, ring=start[INNER] > 0, streaked=streaked, tinted=True)


def _bend(streak: Detection, expected: Array, path: float) -> float:
    """Return how far, px, the middle of a streak may be from the mean of its exposure.

    At an acceleration a the middle of the path in an exposure of length T is up to a T²/12 from the
    mean place. The distance from the place that was expected is a times the interval squared.
    """
    exposure = min(2 * float(np.hypot(*streak.parameters[STREAK_X : STREAK_Y + 1])) / path, 1.0)
    return math.hypot(streak.x - expected[0], streak.y - expected[1]) * exposure**2 / 12


def _tint_error(tint: Detection) -> float:
    """Return the standard error of a coordinate of a tinted marker's centre, px."""
    change = math.hypot(*tint.parameters[TINT_X:]) * tint.radius / abs(tint.contrast)
    return TINT_ERROR * change * tint.radius


def _with_error(found: Detection, sigma_px: float) -> Detection:
    """Return a fit whose centre has an error in addition."""
    return replace(found, covariance=found.covariance + sigma_px**2 * np.eye(2))


def _radius(parameters: Array) -> float:
    return 1 / math.sqrt(float(parameters[2] * parameters[4] - parameters[3] ** 2))


def _rms(found: Detection) -> float:
    """Return the RMS residual, grey levels."""
    return found.misfit * abs(found.contrast)
