"""How noisy tracks really are, from how they tremble in time.

The fit of one picture cannot know what compression did to it: a block that the encoder copied from
the frame before fits well and is displaced. Such errors show in time. Of any five neighbouring
samples the combination that vanishes for every cubic leaves only noise (Winter 2009, §3.4.5 does
the same with residuals of filters); its spread, robustly taken, is the noise of the track. What it
exceeds the fit's own standard error by is added to that.

Where a marker stands still the encoder repeats its picture and the error with it: nothing trembles,
yet the error is there. Such stretches are left out of the estimate, and count as one measurement
when the track is smoothed.

A key frame is compressed without reference to others: nothing in it is copied, and it is quantised
more finely. The first frame is one, and all angles count from it; holding it for as bad as the
others would overstate every angle's error.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

NEIGHBOURS = 5
# A marker's own estimate counts as much as the whole clip's from this many combinations on.
ENOUGH = 20
# Movement (px) between frames from which on the encoder draws a marker anew, and below which it
# repeats it.
MOVING_PX = 0.3
STILL_PX = 0.06
# Variance that compression adds in a key frame over that in other frames: 0.29 ± 0.07 in H.264
# (twenty drawn clips; those of benchmarks/tracking_accuracy.py serve as the check).
KEY_FRAME_SHARE = 0.3
# From the median of absolute values of a normal variable to its standard deviation.
NORMAL_MEDIAN = 0.6744897501960817


def with_noise_in_time(tracks: Tracks, *, key_frames: Collection[int] = ()) -> Tracks:
    """Return the tracks with standard errors that cover what trembles in time.

    Parameters
    ----------
    tracks
        With the standard errors of the fits; hand-set points keep theirs.
    key_frames
        Frames compressed without reference to others. Where most are, as in Motion JPEG, the noise
        found is their own and they are treated like all others.
    """
    excess: list[float] = []
    counts: list[int] = []
    for k in range(len(tracks.names)):
        seen = tracks.status[:, k] == "seen"
        position = tracks.position_px[:, k]
        left = cubic_free(tracks.time_s, position, seen & moving(position))
        if left.shape[0] < ENOUGH:
            left = cubic_free(tracks.time_s, position, seen)
        fitted = float(np.median(tracks.sigma_px[seen, k] ** 2)) if seen.any() else 0.0
        counts.append(left.shape[0])
        spread = float(np.median(np.abs(left))) / NORMAL_MEDIAN if left.size else 0.0
        excess.append(spread**2 - fitted if left.size else 0.0)
    weights = np.array(counts, float)
    if weights.sum() == 0:
        return tracks
    common = float(np.sum(weights * excess) / weights.sum())
    own = (weights * excess + ENOUGH * common) / (weights + ENOUGH)
    added = np.maximum(own, 0.0)
    seen = tracks.status == "seen"
    key = np.isin(tracks.frame, list(key_frames))
    share = np.where(key & (2 * key.sum() < key.size), KEY_FRAME_SHARE, 1.0)
    sigma = np.where(seen, np.sqrt(tracks.sigma_px**2 + share[:, None] * added), tracks.sigma_px)
    return replace(tracks, sigma_px=sigma)


def moving(position: Array) -> NDArray[np.bool_]:
    """Return (n,) whether a marker at ``position`` (n, 2) px moves from its neighbouring frames."""
    step = np.hypot(*np.diff(position, axis=0).T)
    quiet = np.nan_to_num(step, nan=np.inf) < MOVING_PX
    both: NDArray[np.bool_] = np.append(quiet, False) & np.append(False, quiet)
    return ~both


def repeats(positions: Array) -> Array:
    """Return (n,) how many frames share each one's picture, markers (n, m, 2) px standing still.

    1 where anything moves; in a stretch of L frames in which nothing does, L.
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


def cubic_free(time: Array, position: Array, seen: NDArray[np.bool_]) -> Array:
    """Return what is left (m, 2) of five seen samples after any cubic, noise at its own size.

    Parameters
    ----------
    time, position, seen
        (n,) times, (n, 2) positions, and where they were measured.
    """
    n = NEIGHBOURS
    rows = [i for i in range(time.size - n + 1) if seen[i : i + n].all()]
    if not rows:
        return np.empty((0, 2))
    index = np.array(rows)[:, None] + np.arange(n)
    t = time[index]
    apart = t[:, :, None] - t[:, None, :] + np.eye(n)
    combination = 1 / apart.prod(axis=2)
    combination /= np.linalg.norm(combination, axis=1, keepdims=True)
    return np.asarray(np.einsum("mi,mik->mk", combination, position[index]))
