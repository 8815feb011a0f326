"""What a file says of its pictures: their size and number, when they end, how its clock ticks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

TRUNCATED_SHARE = 0.1
"""A file that holds less than it announces by more than this share was cut short."""

COARSE_TICK = 0.005
"""A clock is coarse if its tick is a larger share of the time between two frames."""


@dataclass(frozen=True)
class VideoInfo:
    """Picture format of a file.

    Attributes
    ----------
    path
        The file.
    width, height
        Size of the displayed picture, px.
    codec
        Name of the codec.
    declared_frames
        Number of frames that the container announces; 0 if it announces none. Of a film trimmed on
        a phone it counts those, too, that the edit list hides.
    declared_rate
        Frame rate that the container announces, frames/s; 0 if it announces none.
    rotation_deg
        Rotation of the stored picture for display, counter-clockwise, degrees.
    pixel_aspect
        Width of a pixel over its height.
    interlaced
        Whether the file declares its pictures as interlaced.
    declared_end_s
        Length of what is shown, by the container, s; 0 if it announces none.
    tick_s
        The unit in which the file writes times, s: 1 ms in Matroska, 10 ms in GIF.
    """

    path: Path
    width: int
    height: int
    codec: str
    declared_frames: int
    declared_rate: float
    rotation_deg: int
    pixel_aspect: float
    interlaced: bool
    declared_end_s: float = 0.0
    tick_s: float = 0.0

    @property
    def announced_frames(self) -> int:
        """Number of frames that the file announces, each field counted as one; 0 if none."""
        return self.declared_frames * (2 if self.interlaced else 1)

    def even_time(self, shown_s: float, first_s: float, last_s: float) -> float:
        """Return the time of a frame, s, that a coarse clock rounds to ``shown_s``.

        That is the next one at the announced rate if it differs by less than both roundings
        together, of this frame's time and of the first one's. Increasing times stay increasing.

        Parameters
        ----------
        shown_s, first_s
            Times of this and of the first frame in the file, s.
        last_s
            Time returned for the frame before, s; minus infinity if there is none.
        """
        rate = self.declared_rate
        if self.tick_s * rate <= COARSE_TICK:
            return shown_s
        even = first_s + round((shown_s - first_s) * rate) / rate
        rounded = abs(even - shown_s) < 0.999 * self.tick_s
        return even if rounded and even - last_s > 0.5 / rate else shown_s

    def missing_s(self, last_s: float, interval_s: float) -> float:
        """Return how much earlier than announced a file ends, s; 0 if it announces no end.

        Parameters
        ----------
        last_s, interval_s
            When the last frame is shown, and how long after the frame before it, s.
        """
        return self.declared_end_s - (last_s + interval_s) if self.declared_end_s else 0.0

    def is_cut_short(self, frames: int, missing_s: float) -> bool:
        """Whether a file that ends after so many frames lacks a part of what it announces.

        Both the number and the time have to be short: an edit list hides frames and announces what
        is left; a last picture may be shown for long.
        """
        few = frames < (1 - TRUNCATED_SHARE) * self.announced_frames
        return few and self.ends_early(missing_s)

    def ends_early(self, missing_s: float) -> bool:
        """Whether a file ends well before the time that it announces."""
        return missing_s > TRUNCATED_SHARE * self.declared_end_s > 0
