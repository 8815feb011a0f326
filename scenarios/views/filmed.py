"""The recording behind a run: its pictures by time, and where the world is in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from mocap.motion.motion import Motion
from mocap.motion.picture import PictureScale
from mocap.tracking.tracks import read_tracks
from mocap.video.frames import Video

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

SHOWN_SHARE = 0.85
"""How much of the recording's height is shown where the mouth's place in it is known."""


class FilmedError(DrinksimError):
    """A run lacks what its recording would have supplied."""


@dataclass(frozen=True)
class Crop:
    """A rectangle of a picture, px: left, top, width, height."""

    left: float
    top: float
    width: float
    height: float

    @classmethod
    def around(cls, focus: Crop | None, *, picture: tuple[int, int], aspect: float) -> Crop:
        """Return the part of a picture (width, height) to show: about ``focus``, and inside it.

        ``aspect`` is the width over the height of the part. Without a focus all of the picture is
        shown, and more if the aspect asks for it.
        """
        wide, high = picture
        if focus is None:
            height = max(high, wide / aspect)
            width = height * aspect
            return cls((wide - width) / 2, (high - height) / 2, width, height)
        height = min(SHOWN_SHARE * high, wide / aspect)
        width = height * aspect
        left = focus.left + (focus.width - width) / 2
        top = focus.top + (focus.height - height) / 2
        left = min(max(left, -0.5), wide - 0.5 - width)
        top = min(max(top, -0.5), high - 0.5 - height)
        return cls(left, top, width, height)

    def scaled(self, picture: Image, size: tuple[int, int]) -> Image:
        """Return this part of ``picture`` at ``size`` (width, height) px; grey beyond its edges."""
        step = (self.width / size[0], self.height / size[1])
        # Pixel centres are whole numbers in both pictures.
        to_picture = np.array(
            [
                [step[0], 0.0, self.left + (step[0] - 1) / 2],
                [0.0, step[1], self.top + (step[1] - 1) / 2],
            ]
        )
        smooth = cv2.GaussianBlur(picture, (0, 0), 0.4 * step[0]) if step[0] > 1.2 else picture
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return np.asarray(
            cv2.warpAffine(smooth, to_picture, size, flags=flags, borderValue=(235, 235, 235)),
            dtype=np.uint8,
        )


def picture_scale(motion: Motion, tracks_file: Path | None) -> PictureScale | None:
    """Return where the world is in the picture: as the motion says, or else fitted to the tracks.

    None if neither the motion nor tracks say it.
    """
    if motion.picture is not None or tracks_file is None or not tracks_file.is_file():
        return motion.picture
    tracks = read_tracks(tracks_file)
    marker = (*motion.package_body.markers, "package_lower")[0]
    if marker not in tracks.names:
        raise FilmedError(f"{tracks_file}: no marker {marker}")
    known = tracks.known(marker)
    start = motion.package_mm[0]
    places = [motion.package.at(float(t)).apply(start) for t in tracks.time_s[known]]
    return PictureScale.fitted(tracks.of(marker)[0][known], np.array(places))


def pictures_at(
    video: Path, times_s: Iterable[float], *, mirrored: bool = False
) -> Iterator[Image]:
    """Yield the picture (rows, columns, 3), RGB, shown nearest to each of increasing times, s.

    ``mirrored`` exchanges left and right, as the motion of a person who faces left does.
    """
    frames = iter(Video(video).frames())
    shown = following = next(frames)
    for time in times_s:
        while abs(following.time_s - time) <= abs(shown.time_s - time):
            shown = following
            try:
                following = next(frames)
            except StopIteration:
                break
        picture = shown.colour()[..., ::-1]
        yield np.ascontiguousarray(picture[:, ::-1] if mirrored else picture)
