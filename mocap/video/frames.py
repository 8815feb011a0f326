"""Frames of a video in display order, with their times. Only this module reads videos.

A file is decoded from its first frame on, without seeking: seeking lands on the wrong frame in many
real files. Times are the container's presentation times; where its clock is coarse, those of the
announced rate that it rounds. An image is the 8-bit luminance, in which
markers are detected, rotated as the file's rotation flag asks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import av
import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from mocap.video.channels import Pixels
from mocap.video.info import VideoInfo
from mocap.video.times import Timing, TimingMonitor

Image: TypeAlias = NDArray[np.uint8]

CONTAINERS = (
    *("mov", "mp4", "matroska", "webm", "avi", "gif", "mpegts", "mpeg", "mpegvideo", "m4v", "dv"),
    *("asf", "flv", "ogg", "mxf", "mjpeg", "h264", "hevc", "obu", "ivf", "nut", "vc1", "wtv", "rm"),
)
"""Formats of films, by FFmpeg's names; not lists of other files or addresses."""

MOST_PIXELS = 8192 * 4352
"""Of a picture: 8K, as wide as cinemas have it."""

MOST_FRAMES = 2_000_000
MOST_PIXELS_PER_BYTE = 20_000
PIXELS_OF_ANY_FILE = 1e9
"""A film of a camera has a byte for a thousand pixels or so; what has hardly any was made to fill
the memory or the day of who opens it. Short clips of flat pictures are let through."""


class VideoError(DrinksimError):
    """A video that cannot be used."""


@dataclass(frozen=True)
class Frame:
    """One picture of a video.

    Attributes
    ----------
    index
        Number of the frame in the file.
    time_s
        Presentation time, s.
    image
        (height, width) luminance, 8 bit.
    colour
        Returns the picture in colour: (height, width, 3), blue, green, red.
    """

    index: int
    time_s: float
    image: Image
    colour: Callable[[], Image]

    @property
    def picture(self) -> Pixels:
        """The picture in grey levels, and in colour contrasts where these are looked at."""
        return Pixels(self.image, self.colour)


class Video:
    """A video file whose first frame can be decoded.

    Parameters
    ----------
    path
        The file.
    fps
        Capture rate of the camera, frames/s, for a file that plays slower, as in slow motion. Times
        are scaled by the file's own rate over this one. None: the file's times.

    Raises
    ------
    VideoError
        If the file is missing, or holds no picture that can be decoded.
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
        self._missing_s: float | None = None
        self._unshown: list[int] = []
        self._interval_s = 0.0

    @property
    def key_frames(self) -> frozenset[int]:
        """Frames read so far that are compressed without reference to other frames."""
        return frozenset(self._key_frames)

    @property
    def timing(self) -> Timing:
        """Timing of the frames read so far: missing, repeated, blended and interlaced frames."""
        return replace(
            self._monitor.timing(),
            frames_in_file=self._frames_in_file,
            missing_s=self._missing_s,
            unshown=tuple(self._unshown),
        )

    def share(self, end_s: float | None = None) -> float:
        """Return the share of the film until ``end_s`` that is decoded; 0 if no end is known."""
        announced = self.info.declared_end_s or np.inf
        whole = min(np.inf if end_s is None else end_s, announced) - self._first_time
        done = self._last_time - self._first_time
        return float(np.clip(done / whole, 0.0, 1.0)) if 0 < whole < np.inf else 0.0

    def frames(
        self, *, start_s: float | None = None, end_s: float | None = None
    ) -> Iterator[Frame]:
        """Yield the frames from ``start_s`` to ``end_s``, s on the file's own clock.

        Raises
        ------
        VideoError
            If the file is cut short, times do not increase, or no frame lies in the interval.
        """
        self._monitor = TimingMonitor()
        self._key_frames.clear()
        self._unshown.clear()
        self.decoded = 0
        self._frames_in_file = self._missing_s = None
        first = self._first_time
        stretch = self._time_stretch()
        used, last, even_s = 0, -np.inf, -np.inf
        for index, shown_s, picture in self._decoded_pictures():
            self.decoded = index + 1
            if start_s is not None and shown_s < start_s - 1e-9:
                continue
            if end_s is not None and shown_s > end_s + 1e-9:
                break
            if abs(shown_s - last) < 0.5 * self.info.tick_s:
                self._unshown.append(index)
                continue
            if shown_s <= last:
                raise VideoError(
                    f"{self.path}: frame {index} is shown at {shown_s:.6f} s, not after the "
                    f"previous frame ({last:.6f} s): write the file again with increasing "
                    f"times{self._or_before(last)}"
                )
            last = shown_s
            even_s = self.info.even_time(shown_s, first, even_s)
            frame = self._frame(index, first + (even_s - first) * stretch, picture)
            self._monitor.see(index, frame.time_s, frame.image)
            if picture.key_frame:
                self._key_frames.add(index)
            used += 1
            yield frame
        else:
            self._missing_s = self.info.missing_s(self._last_time, self._interval_s)
            self._check_complete(self._missing_s)
            self._frames_in_file = self.decoded
        if used == 0:
            asked = [f"--start {start_s:g}"] if start_s is not None else []
            asked += [f"--end {end_s:g}"] if end_s is not None else []
            raise VideoError(
                f"{self.path}: no frame lies within {' and '.join(asked) or 'it'}; the video runs "
                f"from {first:.3f} s to {max(self._last_time, first):.3f} s"
            )

    def _probe(self) -> VideoInfo:
        """Open the file, decode one frame and return the picture format."""
        with self._opened() as container:
            stream = self._picture_stream(container)
            self._refuse_size(stream.codec_context.width, stream.codec_context.height)
            if stream.frames > MOST_FRAMES:
                raise VideoError(
                    f"{self.path}: announces {stream.frames} frames, more than {MOST_FRAMES}: cut "
                    "out what is to be used"
                )
            try:
                picture = next(container.decode(stream), None)
            except av.error.FFmpegError as error:
                raise VideoError(
                    f"{self.path}: its {stream.codec_context.name} picture cannot be decoded "
                    f"({error.strerror}): the file is damaged or cut short; copy it again, or "
                    "convert it to H.264, for example with 'ffmpeg -i IN -c:v libx264 OUT.mp4'"
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
                    f"{self.path}: its rotation flag is {turned}°; only multiples of 90° are "
                    "supported: write the file again with an upright picture"
                )
            self._refuse_size(picture.width, picture.height)
            width, height = picture.width, picture.height
            aspect = float(stream.sample_aspect_ratio or 1)
            if turned in (90, 270):
                width, height, aspect = height, width, 1 / aspect
            self._first_time = float(picture.time or 0.0)
            self._last_time = self._first_time
            self._timed = picture.time is not None
            duration = stream.duration * stream.time_base if stream.duration else 0
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
                declared_end_s=float(duration or (container.duration or 0) / av.time_base),
                tick_s=float(stream.time_base or 0),
            )

    def _opened(self) -> Any:
        """Return the open container.

        Raises
        ------
        VideoError
            If the file is missing, empty or no video.
        """
        if not self.path.exists():
            raise VideoError(f"{self.path}: no such video; check the path")
        if self.path.is_dir():
            raise VideoError(f"{self.path}: is a folder; name the video file in it")
        if self.path.stat().st_size == 0:
            raise VideoError(f"{self.path}: is empty (0 bytes); copy it from the camera again")
        try:
            # A name such as http:x.mp4 is that of a file, and a file is no list of others.
            options = {"format_whitelist": ",".join(CONTAINERS), "protocol_whitelist": "file"}
            return av.open(f"file:{self.path}", options=options)
        except (av.error.FFmpegError, UnicodeError, ValueError) as error:
            reason = getattr(error, "strerror", "") or "its name is none"
            raise VideoError(
                f"{self.path}: is not a video that can be read ({reason}); a file that was "
                "cut short while copying looks like this: copy it again"
            ) from None

    def _picture_stream(self, container: Any) -> Any:
        """Return the picture stream.

        Raises
        ------
        VideoError
            If the file holds no picture stream or its codec is unknown.
        """
        if not container.streams.video:
            held = sorted({str(stream.type) for stream in container.streams})
            if not held:
                raise VideoError(
                    f"{self.path}: is an empty container without any frame, as a camera leaves "
                    "behind if it is stopped at once; copy or record it again"
                )
            raise VideoError(f"{self.path}: holds no picture, only {' and '.join(held)}")
        stream = container.streams.video[0]
        if stream.codec_context is None:
            raise VideoError(
                f"{self.path}: the codec of its picture is unknown; convert it to H.264, for "
                "example with 'ffmpeg -i IN -c:v libx264 OUT.mp4'"
            )
        stream.thread_type = "AUTO"
        stream.codec_context.options = {"max_pixels": str(MOST_PIXELS)}
        return stream

    def _refuse_size(self, width: int, height: int) -> None:
        """Refuse pictures that would fill the memory, before one is decoded."""
        if width * height > MOST_PIXELS:
            raise VideoError(
                f"{self.path}: its pictures are {width} x {height} px, more than "
                f"{MOST_PIXELS // 10**6} million; make them smaller, for instance with "
                "'ffmpeg -i IN -vf scale=1920:-2 OUT.mp4'"
            )

    @staticmethod
    def _progressive(stream: Any, container: Any) -> Iterator[Any]:
        """Yield progressive pictures; an interlaced frame becomes two, one for each field."""
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
            index, decoded = -1, 0
            most = max(PIXELS_OF_ANY_FILE, MOST_PIXELS_PER_BYTE * self.path.stat().st_size)
            try:
                for index, picture in enumerate(self._progressive(stream, container)):
                    self._refuse_other_size(index, picture)
                    decoded += picture.width * picture.height
                    if decoded > most:
                        raise VideoError(
                            f"{self.path}: unfolds to more than {most:.1e} pixels until frame "
                            f"{index}, which no film of its size does: write it anew"
                        )
                    shown = float(picture.time) if self._timed else index / (self.fps or 1.0)
                    self._interval_s, self._last_time = shown - self._last_time, shown
                    yield index, shown, picture
            except av.error.FFmpegError as error:
                raise VideoError(
                    f"{self.path}: cannot be decoded after frame {index} ({error.strerror}); copy "
                    f"the file again{self._or_before(self._last_time)}"
                ) from None

    def _refuse_other_size(self, index: int, picture: Any) -> None:
        """Refuse a picture of another size than the first one."""
        size = [self.info.width, self.info.height]
        if self.info.rotation_deg in (90, 270):
            size.reverse()
        if [picture.width, picture.height] != size:
            raise VideoError(
                f"{self.path}: frame {index} is {picture.width} x {picture.height} px, the frames "
                f"before it {size[0]} x {size[1]}: write the video anew in one "
                f"size{self._or_before(self._last_time)}"
            )

    def _check_complete(self, missing_s: float) -> None:
        """Raise VideoError if the file ends well before the frames and the time it announces."""
        if self.info.is_cut_short(self.decoded, missing_s):
            raise VideoError(
                f"{self.path}: announces {self.info.announced_frames} frames but ends after "
                f"{self.decoded} ({self._last_time:.2f} s): it was cut short; copy it "
                f"again{self._or_before(self._last_time)}"
            )

    def _or_before(self, time_s: float) -> str:
        """Return the advice to end before a time, s; nothing where no two frames are before it.

        The frame shown at that time is left out: reading ends with it, before what lies behind it.
        """
        end_s = math.ceil(1000 * time_s - 1e-6) / 1000 - 1e-3
        before = end_s - self._first_time >= self._interval_s > 0
        return f", or use --end {end_s:.3f}" if before else ""

    def _time_stretch(self) -> float:
        """Return seconds of real time per second on the file's clock."""
        if self.fps is None or not self._timed:
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
    """Return the luminance (height, width), 8 bit, of a decoded picture; a view where possible."""
    name = picture.format.name
    if name.startswith(("yuv", "nv", "gray")) and picture.format.components[0].bits == 8:
        plane = picture.planes[0]
        if plane.line_size >= picture.width and name not in ("yuyv422", "yvyu422"):
            rows = np.frombuffer(plane, np.uint8, count=plane.line_size * picture.height)
            return rows.reshape(picture.height, plane.line_size)[:, : picture.width]
    grey: Image = picture.to_ndarray(format="gray")
    return grey


def _pulled(graph: Any) -> Iterator[Any]:
    """Yield the pictures that a filter graph has finished."""
    while True:
        try:
            yield graph.pull()
        except (av.error.BlockingIOError, av.error.EOFError):
            return
