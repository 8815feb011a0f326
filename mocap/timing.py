"""What the frames of a video say about their own times: gaps, repeated and blended frames."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

# Every n-th pixel each way is enough to see whether two pictures are the same.
STRIDE = 7
# A repeated frame changes this much less than its neighbours do.
REPEAT_RATIO = 0.1
# Share of the change across a frame that a mixture of its neighbours leaves unexplained: at most
# this in a blended frame, at least that in the frames around it (else the motion is too slow for
# the middle picture of three to differ from a mixture), and the former clearly below the latter.
BLEND_RATIO = 0.1
MOVING_RATIO = 0.15
BLEND_CONTRAST = 0.3
# Intervals may differ by this share before the rate is called variable.
RATE_TOLERANCE = 0.02
# Mean change of brightness below which nothing moves and no judgement is possible.
STILL = 0.05


@dataclass(frozen=True)
class Timing:
    """Findings about the frames that were read; frame numbers are those of the file.

    ``repeated`` frames show what the frame before showed, ``blended`` ones a mixture of both
    neighbours; ``dropped`` are (frame after the gap, frames missing before it).
    """

    frames: int
    first_s: float
    last_s: float
    median_interval_s: float
    variable_rate: bool
    repeated: tuple[int, ...]
    blended: tuple[int, ...]
    dropped: tuple[tuple[int, int], ...]

    @property
    def distrusted(self) -> frozenset[int]:
        """Frames whose picture does not show what was there at their time."""
        return frozenset(self.repeated) | frozenset(self.blended)

    def warnings(self) -> list[str]:
        """Return one sentence for each finding a reader must know."""
        sentences = []
        if self.repeated:
            sentences.append(
                f"{len(self.repeated)} frames repeat the one before them ({_listed(self.repeated)})"
                ": their markers are bridged, not used"
            )
        if self.blended:
            sentences.append(
                f"{len(self.blended)} frames are mixtures of their neighbours "
                f"({_listed(self.blended)}): their markers are bridged, not used"
            )
        if self.dropped:
            missing = sum(count for _, count in self.dropped)
            sentences.append(
                f"{missing} frames are missing before frames "
                f"{_listed([index for index, _ in self.dropped])}"
            )
        if self.variable_rate:
            sentences.append("the frame rate varies: every frame's own time is used")
        return sentences


@dataclass
class TimingMonitor:
    """Collects times and coarse pictures while a video is read, in memory of three pictures."""

    _indices: list[int] = field(default_factory=list)
    _times: list[float] = field(default_factory=list)
    _changes: list[float] = field(default_factory=list)
    _mixtures: list[float] = field(default_factory=list)
    _recent: list[NDArray[np.float32]] = field(default_factory=list)

    def see(self, index: int, time_s: float, image: NDArray[np.uint8]) -> None:
        """Take note of one frame: its number, its time (s) and its picture."""
        coarse = image[::STRIDE, ::STRIDE].astype(np.float32)
        self._indices.append(index)
        self._times.append(time_s)
        self._recent.append(coarse)
        if len(self._recent) > 1:
            self._changes.append(float(np.abs(coarse - self._recent[-2]).mean()))
        if len(self._recent) == 3:
            self._mixtures.append(_unexplained_by_mixture(*self._recent))
            self._recent.pop(0)

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
        )

    def _repeated(self) -> list[int]:
        change = np.array(self._changes)
        found = []
        for k in range(1, change.size - 1):
            around = min(change[k - 1], change[k + 1])
            if around > STILL and change[k] < REPEAT_RATIO * around:
                found.append(self._indices[k + 1])
        return found

    def _blended(self) -> list[int]:
        left = self._mixtures
        found = []
        for k in range(1, len(left) - 1):
            around = min(left[k - 1], left[k + 1])
            if around > MOVING_RATIO and left[k] < min(BLEND_RATIO, BLEND_CONTRAST * around):
                found.append(self._indices[k + 1])
        return found


def _unexplained_by_mixture(
    before: NDArray[np.float32], middle: NDArray[np.float32], after: NDArray[np.float32]
) -> float:
    """Return the share of the change across ``middle`` that no mixture of its neighbours explains.

    Only pixels that change clearly are judged; 1 where there are too few of them or where the best
    mixture is one of the neighbours itself.
    """
    change = after - before
    moving = np.abs(change) > 12
    if moving.sum() < 20:
        return 1.0
    d, m = change[moving], (middle - before)[moving]
    share = float(d @ m / (d @ d))
    if not 0.2 < share < 0.8:
        return 1.0
    left = m - share * d
    return float(left @ left / (d @ d))


def _listed(numbers: list[int] | tuple[int, ...]) -> str:
    shown = ", ".join(str(number) for number in numbers[:5])
    return shown + (", …" if len(numbers) > 5 else "")
