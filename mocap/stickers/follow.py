"""Stickers followed through a film: the fit of one frame starts from that of the frame before."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.stickers.detect import Sticker, centre_of, find_stickers, refit_sticker

Image: TypeAlias = NDArray[np.uint8]
Array: TypeAlias = NDArray[np.float64]

# A sticker is searched for within this many of its sides around its expected place ...
REACH_SIDES = 2.5
# ... and in the whole picture every so many frames while one is missing.
WHOLE_PICTURE_EVERY = 5
# The refitted sticker lies within this many sides of its expected place.
GATE_SIDES = 0.8


@dataclass(frozen=True)
class StickerTracks:
    """Corners of stickers over the frames of a clip.

    Attributes
    ----------
    names
        The k markers.
    side_mm
        (k,) sides of their black squares as drawn, mm.
    corners_px
        (n, k, 4, 2) corners, from each sticker's own top left clockwise; nan where not seen.
    covariance_px2
        (n, k, 8, 8) covariance of the corners.
    """

    names: tuple[str, ...]
    side_mm: Array
    corners_px: Array
    covariance_px2: Array

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(n, k) whether a sticker is seen in a frame."""
        return np.asarray(np.isfinite(self.corners_px[:, :, 0, 0]))

    def centres(self, name: str) -> tuple[Array, Array]:
        """Return centre (n, 2) and its standard error (n,) of a sticker, px; nan if not seen."""
        k = self.names.index(name)
        centre, sigma = np.full((len(self.corners_px), 2), np.nan), np.full(len(self.seen), np.nan)
        for row in np.flatnonzero(self.seen[:, k]):
            centre[row], sigma[row] = centre_of(
                self.corners_px[row, k], self.covariance_px2[row, k]
            )
        return centre, sigma


@dataclass
class StickerTracker:
    """Follows stickers: :meth:`process` the frames in order, then ask for :meth:`tracks`.

    Parameters
    ----------
    names
        The markers to follow; stickers of other markers are left out.
    """

    names: tuple[str, ...]
    _last: dict[str, Sticker] = field(default_factory=dict)
    _speed: dict[str, Array] = field(default_factory=dict)
    _seen_at: dict[str, float] = field(default_factory=dict)
    _frames: list[dict[str, Sticker]] = field(default_factory=list)
    _time_s: float = math.nan

    def process(self, time_s: float, image: Image) -> dict[str, Sticker]:
        """Return the stickers seen in the next frame, by marker."""
        interval = time_s - self._time_s if self._frames else 0.0
        found: dict[str, Sticker] = {}
        for name in self._last:
            if self._seen_at[name] == self._time_s:
                near = self._near(image, name, interval)
                if near is not None:
                    found[name] = near
        for name in self._last:
            if name not in found:
                found |= self._around(image, name, time_s, found)
        if len(found) < len(self.names) and len(self._frames) % WHOLE_PICTURE_EVERY == 0:
            new = find_stickers(image)
            found |= {name: new[name] for name in self.names if name in new and name not in found}
        self._remember(found, time_s, interval)
        return found

    def tracks(self) -> StickerTracks:
        """Return what was seen so far."""
        n, k = len(self._frames), len(self.names)
        corners = np.full((n, k, 4, 2), np.nan)
        covariance = np.full((n, k, 8, 8), np.nan)
        side = np.full(k, np.nan)
        for column, name in enumerate(self.names):
            for row, found in enumerate(self._frames):
                if name in found:
                    corners[row, column] = found[name].corners
                    covariance[row, column] = found[name].covariance
                    side[column] = found[name].code.side_mm
        return StickerTracks(self.names, side, corners, covariance)

    def _near(self, image: Image, name: str, interval_s: float) -> Sticker | None:
        """Return a sticker refitted where its motion has carried it."""
        last = self._last[name]
        moved = self._speed[name] * interval_s
        near = refit_sticker(image, last, moved)
        if near is None:
            return None
        away = float(np.hypot(*(near.centre - last.centre - moved)))
        return near if away < GATE_SIDES * last.side_px else None

    def _around(
        self, image: Image, name: str, time_s: float, found: dict[str, Sticker]
    ) -> dict[str, Sticker]:
        """Return the wanted stickers found around the expected place of one that is missing."""
        last = self._last[name]
        gone_s = time_s - self._seen_at[name]
        at = last.centre + self._speed[name] * min(gone_s, 0.1)
        reach = REACH_SIDES * last.side_px * (1 + 4 * min(gone_s, 1.0))
        left, top = (max(int(v - reach), 0) for v in at)
        part = image[top : int(at[1] + reach) + 1, left : int(at[0] + reach) + 1]
        if min(part.shape) < 16:
            return {}
        new = find_stickers(np.ascontiguousarray(part), offset=(left, top))
        return {key: new[key] for key in self.names if key in new and key not in found}

    def _remember(self, found: dict[str, Sticker], time_s: float, interval_s: float) -> None:
        for name, sticker in found.items():
            follows = name in self._last and self._seen_at[name] == self._time_s and interval_s > 0
            moved = sticker.centre - self._last[name].centre if follows else np.zeros(2)
            self._speed[name] = moved / interval_s if follows else np.zeros(2)
            self._last[name] = sticker
            self._seen_at[name] = time_s
        self._frames.append(found)
        self._time_s = time_s
