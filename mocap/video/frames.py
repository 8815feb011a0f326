"""Frames of a video in the order they are shown, with their times: the only reader of videos.

Files are decoded from the first frame on and never sought in, because seeking lands on the wrong
frame in many real files. Times are the container's presentation times. Images are turned as the
file's rotation flag says and are the luminance in 8 bit: that is what markers are found in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import av
import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from mocap.video.times import Timing, TimingMonitor

Image: TypeAlias = NDArray[np.uint8]

# A file that announces more frames than it holds by this share was cut short.
TRUNCATED_SHARE = 0.1


class VideoError(DrinksimError):
    """A video that cannot be used."""


@dataclass(frozen=True)
class VideoInfo:
    """What a file says about its picture, before any frame is decoded.

    ``width`` and ``height`` (px) are those of the picture as shown, ``rotation_deg`` how far it was
    turned counter-clockwise for that; ``pixel_aspect`` is the width of a pixel over its height;
    ``declared_frames`` is 0 where the container does not say.
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


@dataclass(frozen=True)
class Frame:
    """One picture: its number in the file, its time (s) and its luminance (height, width)."""

    index: int
    time_s: float
    image: Image
    colour: Callable[[], Image]


class Video:
    """A video file that was opened and whose first frame could be decoded.

    Parameters
    ----------
    path
        The file.
    fps
        The rate at which the camera captured (frames/s) where the file is played slower, as in slow
        motion; times are scaled by the file's own rate over this one. None: the file's times.

    Raises
    ------
    VideoError
        If there is no file, no picture in it, or none that can be decoded.
    """

    def __init__(self, path: Path | str, *, fps: float | None = None) -> None:
        if fps is not None and not (np.isfinite(fps) and fps > 0):
            raise VideoError(f"--fps {fps}: give the camera's capture rate as a positive number")
        self.path = Path(path)
        self.fps = fps
        self.info = self._probe()
        self.decoded = 0
        self._monitor = TimingMonitor()
        self._key_frames: set[int] = set()
        self._frames_in_file: int | None = None

    @property
    def key_frames(self) -> frozenset[int]:
        """Those of the used frames read so far that were compressed without reference to others."""
        return frozenset(self._key_frames)

    @property
    def timing(self) -> Timing:
        """What the frames read so far say about times: gaps, repeated and blended frames."""
        return replace(self._monitor.timing(), frames_in_file=self._frames_in_file)

    @property
    def announced_frames(self) -> int:
        """Number of frames that the file says it holds, fields counted singly; 0 if it does not."""
        return self.info.declared_frames * (2 if self.info.interlaced else 1)

    def frames(
        self, *, start_s: float | None = None, end_s: float | None = None
    ) -> Iterator[Frame]:
        """Yield the frames shown from ``start_s`` to ``end_s`` (s on the file's own clock).

        Raises
        ------
        VideoError
            If the file breaks off, if times do not increase, or if no frame lies in the interval.
        """
        self._monitor = TimingMonitor()
        self._key_frames.clear()
        self.decoded = 0
        self._frames_in_file = None
        first = self._first_time
        stretch = self._time_stretch()
        used, last = 0, -np.inf
        for index, shown_s, picture in self._decoded_pictures():
            self.decoded = index + 1
            if start_s is not None and shown_s < start_s - 1e-9:
                continue
            if end_s is not None and shown_s > end_s + 1e-9:
                break
            if shown_s <= last:
                raise VideoError(
                    f"{self.path}: frame {index} is shown at {shown_s:.6f} s, not after the frame "
                    f"before it ({last:.6f} s): write the file anew with increasing times"
                )
            last = shown_s
            frame = self._frame(index, first + (shown_s - first) * stretch, picture)
            self._monitor.see(index, frame.time_s, frame.image)
            if picture.key_frame:
                self._key_frames.add(index)
            used += 1
            yield frame
        else:
            self._check_complete()
            self._frames_in_file = self.decoded
        if used == 0:
            raise VideoError(
                f"{self.path}: no frame lies between --start {start_s} and --end {end_s}; the "
                f"video runs from {first:.3f} s to {max(self._last_time, first):.3f} s"
            )

    def _probe(self) -> VideoInfo:
        """Open the file, decode one frame and return what it says about itself."""
        with self._opened() as container:
            stream = self._picture_stream(container)
            try:
                picture = next(container.decode(stream), None)
            except av.error.FFmpegError as error:
                raise VideoError(
                    f"{self.path}: its {stream.codec_context.name} picture cannot be decoded "
                    f"({error.strerror}): the file is damaged or cut short; copy it again, or "
                    "write it anew as H.264, for instance with 'ffmpeg -i IN -c:v libx264 OUT.mp4'"
                ) from None
            if picture is None:
                raise VideoError(
                    f"{self.path}: holds a {stream.codec_context.name} stream without any frame"
                )
            if picture.time is None and self.fps is None:
                raise VideoError(f"{self.path}: its frames carry no times; give --fps")
            turned = picture.rotation % 360
            if turned % 90:
                raise VideoError(
                    f"{self.path}: is to be shown turned by {turned}°; only quarter turns are "
                    "supported: write the picture out upright"
                )
            width, height = picture.width, picture.height
            aspect = float(stream.sample_aspect_ratio or 1)
            if turned in (90, 270):
                width, height, aspect = height, width, 1 / aspect
            self._first_time = float(picture.time or 0.0)
            self._last_time = self._first_time
            return VideoInfo(
                path=self.path,
                width=width,
                height=height,
                codec=stream.codec_context.name,
                declared_frames=int(stream.frames),
                declared_rate=float(stream.average_rate or 0),
                rotation_deg=turned,
                pixel_aspect=aspect,
                interlaced=bool(picture.interlaced_frame),
            )

    def _opened(self) -> Any:
        """Open the container, in words that help if it cannot be."""
        if not self.path.exists():
            raise VideoError(f"{self.path}: no such video; check the path")
        if self.path.is_dir():
            raise VideoError(f"{self.path}: is a folder; name the video file in it")
        if self.path.stat().st_size == 0:
            raise VideoError(f"{self.path}: is empty (0 bytes); copy it from the camera again")
        try:
            return av.open(str(self.path))
        except av.error.FFmpegError as error:
            raise VideoError(
                f"{self.path}: is not a video that can be read ({error.strerror}); a recording cut "
                "short while copying looks like this: copy it again"
            ) from None

    def _picture_stream(self, container: Any) -> Any:
        """Return the picture stream, or say what the file holds instead."""
        if not container.streams.video:
            held = sorted({str(stream.type) for stream in container.streams})
            if not held:
                raise VideoError(
                    f"{self.path}: is an empty container without any frame, as a camera leaves "
                    "that was stopped at once; copy or record it again"
                )
            raise VideoError(f"{self.path}: holds no picture, only {' and '.join(held)}")
        stream = container.streams.video[0]
        if stream.codec_context is None:
            raise VideoError(
                f"{self.path}: its picture is in a codec that is not known here; write it anew as "
                "H.264, for instance with 'ffmpeg -i IN -c:v libx264 OUT.mp4'"
            )
        stream.thread_type = "AUTO"
        return stream

    @staticmethod
    def _progressive(stream: Any, container: Any) -> Iterator[Any]:
        """Yield whole pictures; an interlaced frame becomes two, one for each field."""
        graph = None
        for picture in container.decode(stream):
            if graph is None and picture.interlaced_frame:
                graph = av.filter.Graph()
                graph.link_nodes(
                    graph.add_buffer(template=stream),
                    graph.add("bwdif", "mode=send_field"),
                    graph.add("buffersink"),
                ).configure()
            if graph is None:
                yield picture
                continue
            graph.push(picture)
            yield from _pulled(graph)
        if graph is not None:
            graph.push(None)
            yield from _pulled(graph)

    def _decoded_pictures(self) -> Iterator[tuple[int, float, Any]]:
        """Yield number, presentation time (s) and picture of every frame."""
        with self._opened() as container:
            stream = self._picture_stream(container)
            index = -1
            try:
                for index, picture in enumerate(self._progressive(stream, container)):
                    shown = picture.time
                    if shown is None:
                        shown = index / (self.fps or 1.0)
                    self._last_time = float(shown)
                    yield index, float(shown), picture
            except av.error.FFmpegError as error:
                raise VideoError(
                    f"{self.path}: cannot be decoded after frame {index} ({error.strerror}); use "
                    f"--end {max(self._last_time, 0):.2f} or copy the file again"
                ) from None

    def _check_complete(self) -> None:
        """Refuse a file that ended well before the number of frames it announces."""
        declared = self.announced_frames
        if self.decoded < (1 - TRUNCATED_SHARE) * declared:
            raise VideoError(
                f"{self.path}: announces {declared} frames but ends after {self.decoded} "
                f"({self._last_time:.2f} s): it was cut short; copy it again, or use "
                f"--end {self._last_time - 1e-3:.2f}"
            )

    def _time_stretch(self) -> float:
        """Return seconds of real time per second of the file's clock."""
        if self.fps is None:
            return 1.0
        rate = self.info.declared_rate * (2 if self.info.interlaced else 1)
        return rate / self.fps if rate > 0 else 1.0

    def _frame(self, index: int, time_s: float, picture: Any) -> Frame:
        quarter_turns = self.info.rotation_deg // 90

        def colour() -> Image:
            whole: Image = picture.to_ndarray(format="bgr24")
            return np.ascontiguousarray(np.rot90(whole, quarter_turns))

        image = luminance(picture)
        if quarter_turns:
            image = np.ascontiguousarray(np.rot90(image, quarter_turns))
        return Frame(index, time_s, image, colour)


def luminance(picture: Any) -> Image:
    """Return the brightness (height, width) of a decoded picture, 8 bit, copied only if need be."""
    name = picture.format.name
    if name.startswith(("yuv", "nv", "gray")) and picture.format.components[0].bits == 8:
        plane = picture.planes[0]
        if plane.line_size >= picture.width and name not in ("yuyv422", "yvyu422"):
            rows = np.frombuffer(plane, np.uint8, count=plane.line_size * picture.height)
            return rows.reshape(picture.height, plane.line_size)[:, : picture.width]
    grey: Image = picture.to_ndarray(format="gray")
    return grey


def _pulled(graph: Any) -> Iterator[Any]:
    """Yield the pictures that a filter has ready."""
    while True:
        try:
            yield graph.pull()
        except (av.error.BlockingIOError, av.error.EOFError):
            return
