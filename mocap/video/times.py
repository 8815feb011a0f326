"""What the frames of a video say about their own times.

Gaps, repeated and blended frames, and two instants in one picture (interlacing that the file does
not announce). The last shows as a comb: where something moves, rows of alternate fields differ
more than rows of the same field. With ``a`` and ``b`` the differences of a row from the rows above
and below it, the rows of the same field differ by ``a − b``, and

    C = Σ (a² + b²)/2 / Σ (a − b)²

over the moving pixels is 1/4 on smooth shades and edges, 1 in white noise and for a lone bright
row, and larger only for what alternates from row to row.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

# Every n-th pixel each way is enough to see whether two pictures are the same.
STRIDE = 7
# Repeated frames change this much less than those around them.
REPEAT_RATIO = 0.1
# The same picture is shown this often again at most; longer, and the scene may stand still.
LONGEST_REPEAT = 3
# Share of the change across a frame that a mixture of its neighbours leaves unexplained: at most
# this in a blended frame, at least that in the frames around it (else the motion is too slow for
# the middle picture of three to differ from a mixture), and the former clearly below the latter.
BLEND_RATIO = 0.1
MOVING_RATIO = 0.15
BLEND_CONTRAST = 0.3
# Brightness (grey levels, mean of four rows) has to change by this where something moves, and at
# this many of the looked-at pixels, for a comb to be looked for: every STRIDE-th column is.
COMB_CHANGE = 12
COMB_PIXELS = 100
# A picture is combed from this C on; noise alone reaches 1. A clip is, from this share of the
# pictures in which something moves on (two of five are where films were made into television).
COMBED = 1.2
COMBED_SHARE = 0.1
COMBED_LEAST = 3
# Intervals may differ by this share before the rate is called variable.
RATE_TOLERANCE = 0.02
# Mean change of brightness below which nothing moves and no judgement is possible.
STILL = 0.05


@dataclass(frozen=True)
class Timing:
    """Findings about the frames that were read; frame numbers are those of the file.

    ``repeated`` frames show what the frame before showed, ``blended`` ones a mixture of both
    neighbours; ``dropped`` are (frame after the gap, frames missing before it). ``combed`` frames
    show two instants in alternate rows; none are listed unless the clip as a whole is combed.
    ``frames_in_file`` is None unless the file was read to its end.
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

    @property
    def distrusted(self) -> frozenset[int]:
        """Frames whose picture does not show what was there at their time."""
        return frozenset(self.repeated) | frozenset(self.blended)

    def warnings(self) -> list[str]:
        """Return one sentence for each finding a reader must know."""
        sentences = []
        if self.repeated:
            sentences.append(
                f"{_counted(self.repeated, 'repeats', 'repeat')} what was shown before: "
                "markers are bridged there, not used"
            )
        if self.blended:
            sentences.append(
                f"{_counted(self.blended, 'mixes its', 'mix their')} neighbours: markers are "
                "bridged there, not used"
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
                "picture is interlaced and the file does not say so; markers that move are less "
                "sure than stated. Separate the fields first, for instance with "
                "'ffmpeg -i IN -vf bwdif=mode=send_field OUT.mp4'"
            )
        if self.variable_rate:
            sentences.append("the frame rate varies: every frame's own time is used")
        return sentences


@dataclass
class TimingMonitor:
    """Collects times and coarse pictures while a video is read, in memory of a few pictures."""

    _indices: list[int] = field(default_factory=list)
    _times: list[float] = field(default_factory=list)
    _changes: list[float] = field(default_factory=list)
    _mixtures: list[_Mixture] = field(default_factory=list)
    _combs: list[float] = field(default_factory=list)
    _recent: list[NDArray[np.float32]] = field(default_factory=list)
    _columns: NDArray[np.int16] | None = None

    def see(self, index: int, time_s: float, image: NDArray[np.uint8]) -> None:
        """Take note of one frame: its number, its time (s) and its picture."""
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
        """Return the findings about the frames seen so far."""
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
    """How well a frame is a mixture of its neighbours.

    ``share`` is that of the later one in the best mixture; ``left`` the part of the change across
    the frame that it leaves unexplained, 0 where too little moves to say.
    """

    share: float
    left: float


def _mixture(
    before: NDArray[np.float32], middle: NDArray[np.float32], after: NDArray[np.float32]
) -> _Mixture:
    """Return how well ``middle`` is a mixture, judged where the picture changes clearly."""
    change = after - before
    moving = np.abs(change) > 12
    if moving.sum() < 20:
        return _Mixture(0.0, 0.0)
    d, m = change[moving], (middle - before)[moving]
    share = float(d @ m / (d @ d))
    left = m - share * d
    return _Mixture(share, float(left @ left / (d @ d)))


def _comb(before: NDArray[np.int16], now: NDArray[np.int16]) -> float:
    """Return C of the module's formula for a picture's columns; nan where too little moves.

    What moves is told from four rows together, two of each field, lest noise choose the pixels.
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
