"""The pictures of a film for a page: every used frame as a JPEG, in memory.

The film is decoded once, from its start. Pictures that are measured are decoded again, since a JPEG
is not what the camera saw.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from geometry2d.foundation.progress import Progress
from mocap.motion.projection import PictureFormat
from mocap.video.channels import Pixels
from mocap.video.frames import Image, Video
from mocap.video.times import Timing
from scenarios.marking.pointing import MarkingError

JPEG_QUALITY = 90
MOST_BYTES = 2_000_000_000
"""Of all pictures of a film, as JPEG: some minutes of what a telephone films."""

KEPT_LUMINANCES = 4


@dataclass(eq=False)
class Film:
    """The used frames of a video, with their pictures.

    Parameters
    ----------
    path
        The video.
    fps
        Capture rate of the camera, frames/s, as for :class:`Video`.
    start_s, end_s
        First and last used instant on the video's own clock, s.
    """

    path: Path
    fps: float | None = None
    start_s: float | None = None
    end_s: float | None = None
    frames: list[int] = field(default_factory=list, init=False)
    times_s: list[float] = field(default_factory=list, init=False)
    timing: Timing | None = field(default=None, init=False)
    key_frames: frozenset[int] = field(default=frozenset(), init=False)
    _pictures: list[bytes] = field(default_factory=list, init=False)
    _shown: Callable[[int], Pixels] = field(init=False)

    def __post_init__(self) -> None:
        info = self.video().info
        self.format = PictureFormat(info.width, info.height, info.pixel_aspect)
        self.info = info
        self._shown = lru_cache(KEPT_LUMINANCES)(self._decoded)

    def video(self) -> Video:
        """Return the video, to be decoded from its start."""
        return Video(self.path, fps=self.fps)

    def read(self, progress: Progress) -> None:
        """Decode the film and keep its pictures.

        Raises
        ------
        VideoError
            If the film cannot be read.
        MarkingError
            If its pictures take too much memory.
        """
        video, held = self.video(), 0
        for frame in video.frames(start_s=self.start_s, end_s=self.end_s):
            picture = _jpeg(frame.colour())
            held += len(picture)
            if held > MOST_BYTES:
                raise MarkingError(
                    f"{self.path}: the pictures until {frame.time_s:.1f} s fill "
                    f"{MOST_BYTES / 1e9:g} GB: choose the sip with --start and --end"
                )
            self._pictures.append(picture)
            self.times_s.append(frame.time_s)
            self.frames.append(frame.index)
            progress(video.share(self.end_s), "reading the film")
        self.timing, self.key_frames = video.timing, video.key_frames

    def picture(self, row: int) -> bytes | None:
        """Return a used frame as a JPEG; None if it is not read yet, or not there."""
        return self._pictures[row] if 0 <= row < len(self._pictures) else None

    def shown(self, frame: int) -> Pixels:
        """Return the picture of a frame, by its number.

        Raises
        ------
        MarkingError
            If the frame is not one of the used ones.
        """
        return self._shown(frame)

    def time_of(self) -> dict[int, float]:
        """Return the time of each used frame, s, by its number."""
        return dict(zip(self.frames, self.times_s, strict=True))

    def _decoded(self, number: int) -> Pixels:
        if number not in self.frames:
            raise MarkingError(f"frame {number} is not used")
        for frame in self.video().frames(start_s=self.start_s, end_s=self.end_s):
            if frame.index == number:
                return Pixels(np.array(frame.image), frame.colour)
        raise MarkingError(f"frame {number} cannot be read again")


def _jpeg(picture: Image) -> bytes:
    import cv2

    done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not done:
        raise MarkingError("a picture cannot be compressed")
    return data.tobytes()
