"""Timing of the frames of a video: missing, repeated and blended frames, undeclared interlacing.

Undeclared interlacing shows two instants in one picture, which appears combed: where something
moves, rows of different fields differ more than rows of the same field. Let ``a`` and ``b`` be the
differences of a row from the rows above and below it. The rows above and below belong to the same
field and differ by ``a − b``. The ratio

    C = Σ (a² + b²)/2 / Σ (a − b)²

over the moving pixels is 1/4 on smooth shades and edges, 1 in white noise and at a single bright
row. It is larger only where rows alternate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

# Every STRIDE-th row and column is enough to compare two pictures.
STRIDE = 7
# A repeated frame changes less than the frames around it by this factor.
REPEAT_RATIO = 0.1
# Most repetitions of one picture in a row; a longer run may show a scene at rest.
LONGEST_REPEAT = 3
# Share of the change across a frame that the best mixture of its neighbours leaves unexplained. It
# is at most BLEND_RATIO in a blended frame and at least MOVING_RATIO in the frames around it; in a
# slower motion every frame is nearly a mixture of its neighbours. The former is also smaller than
# the latter by the factor BLEND_CONTRAST: with noise of two grey levels it is so by 0.02 in blended
# frames, and where a motion of a pixel changes its pace by more than 0.05.
BLEND_RATIO = 0.1
MOVING_RATIO = 0.15
BLEND_CONTRAST = 0.04
# A pixel moves if its grey level, as a mean of four rows, changes by COMB_CHANGE. The comb ratio
# needs COMB_PIXELS moving pixels among every STRIDE-th column.
COMB_CHANGE = 12
COMB_PIXELS = 100
# A picture is combed if C exceeds COMBED; noise alone reaches 1. A clip is combed if this share of
# its moving pictures is, and at least COMBED_LEAST. Telecine combs two of five.
COMBED = 1.2
COMBED_SHARE = 0.1
COMBED_LEAST = 3
# Relative difference of intervals from which the frame rate is variable.
RATE_TOLERANCE = 0.02
# Mean change of the grey level below which nothing moves and repetition cannot be judged.
STILL = 0.05


@dataclass(frozen=True)
class Timing:
    """Timing of the frames that were read; frame numbers are those of the file.

    Attributes
    ----------
    frames
        Number of frames.
    first_s, last_s, median_interval_s
        Times of the first and last frame and the median interval, s.
    variable_rate
        Whether the intervals vary.
    repeated
        Frames that show the previous frame's picture.
    blended
        Frames that show a mixture of their two neighbours.
    dropped
        Pairs: the frame after missing frames, and how many are missing before it.
    combed
        Frames that show two instants in alternate rows; empty unless the clip as a whole is combed.
    frames_in_file
        Number of frames in the file; None unless the file was read to its end.
    missing_s
        How much earlier than announced the file ends, s on its own clock; None likewise.
    unshown
        Frames that the file shows at the same time as the one before: they are left out.
    """

    frames: int
    first_s: float
    last_s: float
    median_interval_s: float
    variable_rate: bool
    repeated: tuple[int, ...]
    blended: tuple[int, ...]
    dropped: tuple[tuple[int, int], ...]
    combed: tuple[int, ...]
    frames_in_file: int | None = None
    missing_s: float | None = None
    unshown: tuple[int, ...] = ()

    @property
    def distrusted(self) -> frozenset[int]:
        """Frames whose picture does not show the scene at their time."""
        return frozenset(self.repeated) | frozenset(self.blended)

    def warnings(self) -> list[str]:
        """Return one sentence for each finding."""
        sentences = []
        if self.repeated:
            sentences.append(
                f"{_counted(self.repeated, 'repeats', 'repeat')} the previous picture: markers "
                "are interpolated there"
            )
        if self.blended:
            sentences.append(
                f"{_counted(self.blended, 'is a mixture', 'are mixtures')} of the neighbouring "
                "frames: markers are interpolated there"
            )
        if self.dropped:
            missing = sum(count for _, count in self.dropped)
            sentences.append(
                f"{missing} {'frame is' if missing == 1 else 'frames are'} missing before "
                f"{_listed([index for index, _ in self.dropped])}"
            )
        if self.combed:
            sentences.append(
                f"{_counted(self.combed, 'shows', 'show')} two instants in alternate rows: the "
                "picture is interlaced and the file does not say so; the errors of moving markers "
                "are larger than stated. Separate the fields first, for example with "
                "'ffmpeg -i IN -vf bwdif=mode=send_field OUT.mp4'"
            )
        if self.unshown:
            sentences.append(
                f"{_counted(self.unshown, 'has', 'have')} the time of the frame before: left out"
            )
        if self.variable_rate:
            sentences.append("the frame rate varies: every frame's own time is used")
        return sentences


@dataclass
class TimingMonitor:
    """Collects the timing while a video is read; it keeps a few pictures in memory."""

    _indices: list[int] = field(default_factory=list)
    _times: list[float] = field(default_factory=list)
    _changes: list[float] = field(default_factory=list)
    _mixtures: list[_Mixture] = field(default_factory=list)
    _combs: list[float] = field(default_factory=list)
    _recent: list[NDArray[np.float32]] = field(default_factory=list)
    _columns: NDArray[np.int16] | None = None

    def see(self, index: int, time_s: float, image: NDArray[np.uint8]) -> None:
        """Record one frame: its number, time (s) and picture (height, width)."""
        coarse = image[::STRIDE, ::STRIDE].astype(np.float32)
        self._indices.append(index)
        self._times.append(time_s)
        self._recent.append(coarse)
        if len(self._recent) > 1:
            self._changes.append(float(np.abs(coarse - self._recent[-2]).mean()))
        if len(self._recent) == 3:
            self._mixtures.append(_mixture(*self._recent))
            self._recent.pop(0)
        columns = image[:, ::STRIDE].astype(np.int16)
        if self._columns is not None:
            self._combs.append(_comb(self._columns, columns))
        self._columns = columns

    def timing(self) -> Timing:
        """Return the timing of the frames recorded so far."""
        times = np.array(self._times)
        intervals = np.diff(times)
        typical = float(np.median(intervals)) if intervals.size else float("nan")
        dropped = []
        regular = np.ones(intervals.size, bool)
        for k, interval in enumerate(intervals):
            if interval > 1.6 * typical and round(interval / typical) >= 2:
                dropped.append((self._indices[k + 1], round(interval / typical) - 1))
                regular[k] = False
        variable = bool(np.any(np.abs(intervals[regular] - typical) > RATE_TOLERANCE * typical))
        return Timing(
            frames=times.size,
            first_s=float(times[0]) if times.size else float("nan"),
            last_s=float(times[-1]) if times.size else float("nan"),
            median_interval_s=typical,
            variable_rate=variable,
            repeated=tuple(self._repeated()),
            blended=tuple(self._blended()),
            dropped=tuple(dropped),
            combed=tuple(self._combed()),
        )

    def _repeated(self) -> list[int]:
        change = np.array(self._changes)
        found: set[int] = set()
        for first in range(1, change.size - 1):
            for after in range(first + 1, min(first + LONGEST_REPEAT + 1, change.size)):
                around = min(change[first - 1], change[after])
                if around > STILL and change[first:after].max() < REPEAT_RATIO * around:
                    found.update(self._indices[first + 1 : after + 1])
        return sorted(found)

    def _blended(self) -> list[int]:
        found = []
        for k in range(1, len(self._mixtures) - 1):
            before, middle, after = self._mixtures[k - 1 : k + 2]
            around = min(before.left, after.left)
            between = 0.2 < middle.share < 0.8
            limit = min(BLEND_RATIO, BLEND_CONTRAST * around)
            if around > MOVING_RATIO and between and middle.left < limit:
                found.append(self._indices[k + 1])
        return found

    def _combed(self) -> list[int]:
        combs = np.array(self._combs)
        combed = np.flatnonzero(combs > COMBED)
        enough = max(COMBED_LEAST, COMBED_SHARE * np.count_nonzero(np.isfinite(combs)))
        return [self._indices[k + 1] for k in combed] if combed.size >= enough else []


@dataclass(frozen=True)
class _Mixture:
    """The mixture of a frame's neighbours that comes nearest to it.

    ``share`` is the share of the later neighbour. ``left`` is the share of the change across the
    frame that the mixture leaves unexplained, 0 if too little moves.
    """

    share: float
    left: float


def _mixture(
    before: NDArray[np.float32], middle: NDArray[np.float32], after: NDArray[np.float32]
) -> _Mixture:
    """Return the best mixture for ``middle``, fitted to the pixels that change clearly."""
    change = after - before
    moving = np.abs(change) > 12
    if moving.sum() < 20:
        return _Mixture(0.0, 0.0)
    d, m = change[moving], (middle - before)[moving]
    share = float(d @ m / (d @ d))
    left = m - share * d
    return _Mixture(share, float(left @ left / (d @ d)))


def _comb(before: NDArray[np.int16], now: NDArray[np.int16]) -> float:
    """Return the ratio C of the module docstring for some columns; nan if too little moves.

    A pixel moves if the mean of four rows changes, two of each field: noise does not select it.
    """
    if now.shape[0] < 4:
        return math.nan
    change = now - before
    together = change[:-3] + change[1:-2] + change[2:-1] + change[3:]
    moving = np.abs(together) > 4 * COMB_CHANGE
    if np.count_nonzero(moving) < COMB_PIXELS:
        return math.nan
    row = now[1:-2]
    above = (row - now[:-3])[moving].astype(np.float64)
    below = (row - now[2:-1])[moving].astype(np.float64)
    same_field = above - below
    return float(0.5 * (above @ above + below @ below) / max(same_field @ same_field, 1.0))


def _counted(frames: Sequence[int], singular: str, plural: str) -> str:
    if len(frames) == 1:
        return f"frame {frames[0]} {singular}"
    return f"{len(frames)} frames ({_listed(frames)}) {plural}"


def _listed(numbers: Sequence[int]) -> str:
    shown = ", ".join(str(number) for number in numbers[:5])
    return shown + (", …" if len(numbers) > 5 else "")
