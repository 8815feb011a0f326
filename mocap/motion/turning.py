"""Rotation out of the plane and motion in depth, told apart by the shape of the marks.

Both change the apparent distance d of a pair of marks. A body that moves in depth changes the size
of its dots equally in all directions. A body that turns out of the plane, about an axis across the
line through its marks, shortens the dots along that line by the same factor, cos φ, as the line.
Let a and b be the extents of the dots along and across the line. The regression over the frames

    log(a/b) = β log d + γ (v_a² − v_b²) + const

has β = 1 for a rotation and β = 0 for motion in depth. The second term is motion blur, which
stretches dots along their velocity v. The constant holds the shape of the dots at rest, such as
flattening on a curved neck.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.motion.errors import ScaleError
from mocap.motion.smooth import smoothed
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

# Least number of frames for the regression.
LEAST_FRAMES = 10
# Standard error of β from blur and from the model of a flat dot, added to that of the regression.
MODEL_SIGMA = 0.1
# Least distance of β from one half for a decision, in standard errors.
CLEARLY = 2.0

LEAST_TILT = 0.001
"""A turn is looked for where the distance changes by this share at least (2.6°)."""

CLEAR_CHANGE = 8.0
"""A distance changes if it does by so many standard errors."""

COINCIDE_PX = 4.0

SAME_CHANGE = 0.4
"""Changes of two bodies are one if their difference is below this share of them."""


class Cause(Enum):
    """Cause of a change of the apparent distance; the value is its description."""

    TURNING = "the dots flatten with it: it is a rotation out of the plane"
    DEPTH = "the dots change their size with it: it is a motion in depth"
    UNKNOWN = "a rotation out of the plane or a motion in depth: the dots do not decide"


@dataclass(frozen=True)
class Flattening:
    """β of the module's regression and its standard error; both nan if there are too few frames."""

    share: float
    sigma: float

    @property
    def cause(self) -> Cause:
        """Cause of the change of distance."""
        away = (self.share - 0.5) / self.sigma
        if away > CLEARLY:
            return Cause.TURNING
        return Cause.DEPTH if away < -CLEARLY else Cause.UNKNOWN


def flattening(time_s: Array, position_px: Array, ellipse: Array) -> Flattening:
    """Return the regression of the dots' flattening on the distance of two marks.

    Parameters
    ----------
    time_s
        (n,) times of the frames in which both marks are detected, s.
    position_px
        (n, 2, 2) positions of the two marks, px.
    ellipse
        (n, 2, 3) entries xx, xy, yy of the symmetric matrix G, 1/px; |G (x − c)| = 1 is a dot's
        edge.
    """
    known = np.isfinite(ellipse).all(axis=(1, 2))
    if np.count_nonzero(known) < LEAST_FRAMES:
        return Flattening(np.nan, np.nan)
    time, position = time_s[known], position_px[known]
    line = position[:, 1] - position[:, 0]
    distance = np.hypot(*line.T)
    along = line / distance[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    xx, xy, yy = np.moveaxis(ellipse[known], -1, 0)
    g = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)
    squared = np.linalg.inv(g @ g)
    ratio = np.zeros(time.size)
    for mark in (0, 1):
        a2 = np.einsum("ni,nij,nj->n", along, squared[:, mark], along)
        b2 = np.einsum("ni,nij,nj->n", across, squared[:, mark], across)
        ratio += 0.25 * np.log(a2 / b2)
    speed = np.gradient(position.mean(axis=1), time, axis=0)
    blur = np.sum(speed * along, axis=1) ** 2 - np.sum(speed * across, axis=1) ** 2
    logarithm = np.log(distance / distance.mean())
    terms = np.column_stack([logarithm, blur / max(np.abs(blur).max(), 1e-12), np.ones(time.size)])
    coefficients = np.linalg.lstsq(terms, ratio)[0]
    left = ratio - terms @ coefficients
    variance = float(left @ left) / (time.size - terms.shape[1])
    spread = variance * np.linalg.pinv(terms.T @ terms)[0, 0]
    return Flattening(float(coefficients[0]), float(np.sqrt(spread + MODEL_SIGMA**2)))


@dataclass(frozen=True)
class MarkedPair:
    """The first two marks of a body.

    Attributes
    ----------
    time_s
        (n,) times of the frames, s.
    distance_px, sigma_px
        (n,) their apparent distance and its standard error, px.
    seen
        (n,) frames in which both are seen.
    length_mm, length_sigma_mm
        Their given distance and its standard error, mm.
    flattening
        Regression of the dots' shape on their distance.
    cause
        Why the distance changes.
    quick_px, quick_sigma_px
        (n,) the distance without noise, px, and its usual standard error.
    """

    time_s: Array
    distance_px: Array
    sigma_px: Array
    seen: NDArray[np.bool_]
    length_mm: float
    length_sigma_mm: float
    flattening: Flattening
    cause: Cause
    quick_px: Array
    quick_sigma_px: float

    @classmethod
    def of(cls, tracks: Tracks, flat: Array, markers: MarkerFile, body: str) -> MarkedPair:
        """Return the pair of a body whose distance the marker file gives.

        Parameters
        ----------
        tracks, markers
            Tracks and marker file.
        flat
            (n, m, 2) corrected marker positions, px.
        body
            The body.

        Raises
        ------
        ScaleError
            If the marks coincide or are never detected together.
        """
        pair = markers.bodies[body][:2]
        columns = [tracks.names.index(name) for name in pair]
        seen = tracks.known(pair[0]) & tracks.known(pair[1])
        if not seen.any():
            raise ScaleError(
                f"{pair[0]} and {pair[1]} are never seen in the same frame, so {body} has no scale"
            )
        distance = np.hypot(*(flat[:, columns[0]] - flat[:, columns[1]]).T)
        usual = float(np.median(distance[seen]))
        if usual < COINCIDE_PX:
            raise ScaleError(
                f"{pair[0]} and {pair[1]} coincide ({usual:.1f} px apart): one of them has a wrong "
                "position in the marker file"
            )
        sigma = np.hypot(*tracks.sigma_px[:, columns].T)
        dots = Flattening(np.nan, np.nan)
        if tracks.ellipse is not None:
            dots = flattening(
                tracks.time_s[seen],
                tracks.position_px[seen][:, columns],
                tracks.ellipse[seen][:, columns],
            )
        curve = smoothed(tracks.time_s[seen], distance[seen], np.maximum(sigma[seen], 1e-4))
        known = not np.isnan(curve.cutoff_hz)
        return cls(
            time_s=tracks.time_s,
            distance_px=distance,
            sigma_px=sigma,
            seen=seen,
            length_mm=markers.scale_mm[body],
            length_sigma_mm=markers.scale_sigma_mm[body],
            flattening=dots,
            cause=dots.cause,
            quick_px=np.interp(tracks.time_s, tracks.time_s[seen], curve.values),
            quick_sigma_px=float(np.median(curve.sigma)) if known else np.inf,
        )

    @property
    def change(self) -> Array:
        """Relative change (n,) of the distance without noise from its mean."""
        return np.asarray(self.quick_px / self.quick_px.mean() - 1)

    def changes(self, *, besides: Array | float = 0.0, least: float = LEAST_TILT) -> bool:
        """Whether the distance clearly changes, by the share ``least`` at least.

        ``besides`` (n,), px, is a change that is known already.
        """
        clear = max(least * float(np.mean(self.quick_px)), CLEAR_CHANGE * self.quick_sigma_px)
        return bool(np.ptp(self.quick_px - besides) > clear)

    def tilt(self, level_px: float) -> Array:
        """Return the turn (n,) out of the plane, rad, that shortens the distance from a level."""
        return np.asarray(np.arccos(np.clip(self.quick_px / level_px, 0.5, 1.0)))


def with_shared_cause(pairs: Mapping[str, MarkedPair]) -> dict[str, MarkedPair]:
    """Return pairs whose cause is told by another body where that changes in the same way.

    Zoom and focus change the distances of all bodies by the same share. If the dots of one body
    tell that its marks do not turn out of the plane, the other's do not either.
    """
    told = dict(pairs)
    for body, pair in pairs.items():
        for other in pairs.values():
            if pair.cause is not Cause.UNKNOWN or other.cause is not Cause.DEPTH:
                continue
            apart = float(np.std(pair.change - other.change))
            if pair.changes() and apart < SAME_CHANGE * float(np.std(other.change)):
                told[body] = replace(pair, cause=Cause.DEPTH)
    return told
