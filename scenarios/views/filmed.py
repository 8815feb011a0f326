"""The recording behind a run: its pictures by time, and where the world is in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidMotion
from mocap.tracking.tracks import read_tracks
from mocap.video.frames import Video

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

HEAD_COLUMNS = ("head_x_mm", "head_y_mm", "head_theta_deg")
PACKAGE_COLUMNS = ("package_x_mm", "package_y_mm", "package_theta_deg")


SHOWN_SHARE = 0.85
"""How much of the recording's height is shown where the mouth's place in it is known."""


class FilmedError(DrinksimError):
    """A run lacks what its recording would have supplied."""


@dataclass(frozen=True)
class PictureScale:
    """Where a point of the world is in the picture: ``px = origin + px_per_mm · (x, −y)``."""

    origin_px: tuple[float, float]
    px_per_mm: float

    def pixels(self, points_mm: Array) -> Array:
        """Return (n, 2) px, y down, of world points (n, 2), mm, y up."""
        return np.asarray(self.origin_px) + self.px_per_mm * points_mm * [1.0, -1.0]


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


def read_pose(motion_file: Path, columns: tuple[str, str, str]) -> RigidMotion:
    """Return one body's motion (its x, y and angle columns) of a ``motion.csv``."""
    try:
        with motion_file.open(encoding="utf-8") as stream:
            names = stream.readline().strip().split(",")
            rows = np.genfromtxt(stream, delimiter=",", ndmin=2)
    except FileNotFoundError:
        raise FilmedError(f"no motion file {motion_file}") from None
    except ValueError as error:
        raise FilmedError(f"{motion_file} is not a table of numbers: {error}") from None
    wanted = ("time_s", *columns)
    missing = [name for name in wanted if name not in names]
    if missing:
        raise FilmedError(f"{motion_file}: column {missing[0]} is missing")
    time, x, y, angle = (rows[:, names.index(name)] for name in wanted)
    known = np.isfinite(x) & np.isfinite(y) & np.isfinite(angle)
    return RigidMotion(time[known], np.radians(angle[known]), np.column_stack([x, y])[known])


def picture_scale(tracks_file: Path, motion_file: Path) -> PictureScale:
    """Return the scale at the package's depth, by least squares from its tracked lower mark."""
    tracks = read_tracks(tracks_file)
    marker = "package_lower"
    if marker not in tracks.names:
        raise FilmedError(f"{tracks_file}: no marker {marker}")
    known = tracks.known(marker)
    pixels = tracks.of(marker)[0][known]
    motion = read_pose(motion_file, PACKAGE_COLUMNS)
    places = np.array([motion.at(float(t)).shift_mm for t in tracks.time_s[known]]) * [1.0, -1.0]
    about = places - places.mean(axis=0)
    scale = float((about * (pixels - pixels.mean(axis=0))).sum() / (about**2).sum())
    origin = pixels.mean(axis=0) - scale * places.mean(axis=0)
    return PictureScale((float(origin[0]), float(origin[1])), scale)


def pictures_at(video: Path, times_s: Iterable[float]) -> Iterator[Image]:
    """Yield the picture (rows, columns, 3), RGB, shown nearest to each of increasing times, s."""
    frames = iter(Video(video).frames())
    shown = following = next(frames)
    for time in times_s:
        while abs(following.time_s - time) <= abs(shown.time_s - time):
            shown = following
            try:
                following = next(frames)
            except StopIteration:
                break
        yield np.ascontiguousarray(shown.colour()[..., ::-1])
