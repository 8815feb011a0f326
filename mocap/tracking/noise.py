"""Noise of tracks, estimated from their variation in time.

The fit of one picture does not show what compression did to it: a block that the encoder copied
from the previous frame fits well and is displaced. Such errors appear in time. The linear
combination of five neighbouring samples that vanishes for every cubic contains noise only
(Winter 2009, §3.4.5, does the same with residuals of filters). Its robust standard deviation is the
noise of the track. The variance by which it exceeds the fit's own is added to that.

At a marker at rest the encoder repeats the picture with its error: there is no variation in time,
but there is an error. Such intervals are left out of the estimate, and count as one measurement
when the track is smoothed.

A hand trembles at 5 to 12 Hz, fast enough to look like noise in such a combination. The marks of a
rigid body share its motion and not their noise: the same combination of the distance between two
marks holds the noise alone. Where the marks' own combinations are clearly larger than those of
their distances let expect, the distances tell the noise.

A key frame is compressed without reference to other frames: nothing in it is copied, and it is
quantised more finely. The first frame is one, and all angles count from it. The error of other
frames would overstate the error of every angle.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

NEIGHBOURS = 5
# Number of combinations at which a marker's own estimate has the same weight as the whole clip's.
ENOUGH = 20
# Movement between frames, px, above which the encoder encodes a marker again, and below which it
# copies it.
MOVING_PX = 0.3
STILL_PX = 0.06
# Variance that compression adds in a key frame over that in other frames: 0.29 ± 0.07 in H.264
# (twenty rendered clips; checked on those of benchmarks/tracking_accuracy.py).
KEY_FRAME_SHARE = 0.3
# A body trembles if its marks vary in time by more than so many times what their distances let
# expect, with three standard errors of that factor: without tremor it is 0.8 to 1.4 (drawn clips).
TREMBLES = 1.5
CLEARLY = 3.0
# A camera shakes if markers of both bodies vary by so many times their noise, and so much alike.
SHAKES = 3.0
ALIKE = 0.5
# Median of the absolute value of a standard normal variable, and the efficiency of the standard
# deviation that it gives.
NORMAL_MEDIAN = 0.6744897501960817
MEDIAN_EFFICIENCY = 0.37


@dataclass(frozen=True)
class _Variation:
    """Standard deviation of a track's noise, px, and the number of combinations that tell it."""

    spread_px: float
    count: int


def with_temporal_noise(
    tracks: Tracks,
    *,
    bodies: Iterable[Sequence[str]] = (),
    key_frames: Collection[int] = (),
) -> Tracks:
    """Return the tracks with standard errors that include the noise in time.

    Parameters
    ----------
    tracks
        With the standard errors of the fits; points set by hand keep theirs.
    bodies
        Markers of each rigid body, which tell its tremor from their noise.
    key_frames
        Frames compressed without reference to others. If most frames are, as in Motion JPEG, the
        noise is their own, and they are treated like all others.
    """
    found = {name: _own_variation(tracks, k) for k, name in enumerate(tracks.names)}
    for body in bodies:
        found |= _without_tremor(tracks, {name: found[name] for name in body if name in found})
    seen = tracks.status == "seen"
    excess = np.zeros(len(tracks.names))
    weights = np.array([found[name].count for name in tracks.names], float)
    if weights.sum() == 0:
        return tracks
    for k, name in enumerate(tracks.names):
        if found[name].count:
            fitted = float(np.median(tracks.sigma_px[seen[:, k], k] ** 2))
            excess[k] = found[name].spread_px ** 2 - fitted
    common = float(np.sum(weights * excess) / weights.sum())
    own = (weights * excess + ENOUGH * common) / (weights + ENOUGH)
    added = np.maximum(own, 0.0)
    key = np.isin(tracks.frame, list(key_frames))
    share = np.where(key & (2 * key.sum() < key.size), KEY_FRAME_SHARE, 1.0)
    sigma = np.where(seen, np.sqrt(tracks.sigma_px**2 + share[:, None] * added), tracks.sigma_px)
    return replace(tracks, sigma_px=sigma)


def _own_variation(tracks: Tracks, k: int) -> _Variation:
    """Return how a marker varies in time from one frame to the next."""
    seen, position = tracks.status[:, k] == "seen", tracks.position_px[:, k]
    left = cubic_residuals(tracks.time_s, position, seen & moving(position))
    if left.shape[0] < ENOUGH:
        left = cubic_residuals(tracks.time_s, position, seen)
    return _Variation(_spread(left), left.shape[0])


def _without_tremor(tracks: Tracks, own: dict[str, _Variation]) -> dict[str, _Variation]:
    """Return the noise of a body's marks: their own variation, or that of their distances.

    The latter if it is clearly smaller, and told by enough frames.
    """
    apart = [_variation_apart(tracks, pair) for pair in itertools.combinations(own, 2)]
    count = min((each.count for each in apart), default=0)
    if count < ENOUGH:
        return own
    # A distance has the noise of both its marks along one line.
    inner = float(np.sqrt(np.mean([each.spread_px**2 for each in apart]) / 2))
    together = float(np.sqrt(np.mean([each.spread_px**2 for each in own.values()])))
    uncertain = 1 / np.sqrt(2 * MEDIAN_EFFICIENCY * count)
    if together <= TREMBLES * np.exp(CLEARLY * uncertain) * inner:
        return own
    return dict.fromkeys(own, _Variation(inner, count))


def _variation_apart(tracks: Tracks, pair: tuple[str, str]) -> _Variation:
    """Return how the distance of two markers varies from one frame to the next."""
    (first, _), (second, _) = (tracks.of(name) for name in pair)
    seen = np.all([tracks.status[:, tracks.names.index(n)] == "seen" for n in pair], axis=0)
    distance = np.hypot(*(first - second).T)[:, None]
    left = cubic_residuals(tracks.time_s, distance, seen & (moving(first) | moving(second)))
    if left.shape[0] < ENOUGH:
        left = cubic_residuals(tracks.time_s, distance, seen)
    return _Variation(_spread(left), left.shape[0])


def _spread(left: Array) -> float:
    """Return the robust standard deviation of combinations."""
    return float(np.median(np.abs(left))) / NORMAL_MEDIAN if left.size else 0.0


def camera_shakes(tracks: Tracks, first: str, second: str) -> bool:
    """Whether two markers of different bodies tremble alike, which only the camera can do.

    ``tracks`` have standard errors that include the noise in time.
    """
    seen = tracks.known(first) & tracks.known(second)
    left = [cubic_residuals(tracks.time_s, tracks.of(name)[0], seen) for name in (first, second)]
    if len(left[0]) < ENOUGH:
        return False
    trembles = [
        _spread(own) > SHAKES * float(np.median(tracks.of(name)[1][seen]))
        for own, name in zip(left, (first, second), strict=True)
    ]
    product = float(np.sum(left[0] * left[1]))
    alike = product > ALIKE * float(np.sqrt(np.sum(left[0] ** 2) * np.sum(left[1] ** 2)))
    return alike and all(trembles)


def moving(position: Array) -> NDArray[np.bool_]:
    """Return (n,) whether a marker at ``position`` (n, 2) px moves from its neighbouring frames."""
    step = np.hypot(*np.diff(position, axis=0).T)
    quiet = np.nan_to_num(step, nan=np.inf) < MOVING_PX
    both: NDArray[np.bool_] = np.append(quiet, False) & np.append(False, quiet)
    return ~both


def repeats(positions: Array) -> Array:
    """Return (n,) the number of frames that show the same picture of markers at rest.

    ``positions`` are (n, m, 2), px. In an interval of L frames in which no marker moves the number
    is L; elsewhere it is 1.
    """
    step = np.hypot(*np.moveaxis(np.diff(positions, axis=0), -1, 0)).max(axis=1)
    still = np.nan_to_num(step, nan=np.inf) < STILL_PX
    count = np.ones(positions.shape[0])
    first = 0
    for i in range(positions.shape[0]):
        if i == positions.shape[0] - 1 or not still[i]:
            count[first : i + 1] = i + 1 - first
            first = i + 1
    return count


def cubic_residuals(time: Array, position: Array, seen: NDArray[np.bool_]) -> Array:
    """Return combinations (m, k), px, of five samples that vanish for cubics and keep the noise.

    White noise has the same standard deviation in them as in the samples.

    Parameters
    ----------
    time, position, seen
        (n,) times, s, (n, k) coordinates, px, and (n,) where they were measured.
    """
    n = NEIGHBOURS
    rows = [i for i in range(time.size - n + 1) if seen[i : i + n].all()]
    if not rows:
        return np.empty((0, position.shape[1]))
    index = np.array(rows)[:, None] + np.arange(n)
    t = time[index]
    apart = t[:, :, None] - t[:, None, :] + np.eye(n)
    combination = 1 / apart.prod(axis=2)
    combination /= np.linalg.norm(combination, axis=1, keepdims=True)
    return np.asarray(np.einsum("mi,mik->mk", combination, position[index]))
