"""Rendered frames as a video file."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mocap.synthetic.camera import Camera, Image, SyntheticError

Array = NDArray[np.float64]


def frame_times(camera: Camera, duration_s: float) -> Array:
    """Return the times (s) of the frames of a recording that starts at zero.

    >>> frame_times(Camera(64, 48, (100, 100), 1000, (0, 0), fps=25), 0.16).tolist()
    [0.0, 0.04, 0.08, 0.12]
    """
    return np.arange(round(duration_s * camera.fps)) / camera.fps


def write_recording(
    path: Path,
    frames: Iterable[Image],
    times_s: ArrayLike,
    *,
    crf: float = 20.0,
    preset: str = "medium",
) -> None:
    """Write frames as H.264 (yuv420p, mp4) with the given presentation times (s).

    The encoder uses one thread and writes no time stamps: the same frames give the same bytes with
    the same machine and libraries.

    Parameters
    ----------
    path
        The file to write, ending in ``.mp4``.
    frames
        (rows, columns, 3) uint8 RGB each, as many as times; rows and columns even.
    times_s
        Increasing presentation times, s; unevenly spaced for a variable frame rate.
    crf, preset
        Options of x264: quality (0 lossless ... 51) and effort.

    Raises
    ------
    SyntheticError
        If sizes are odd or times do not increase.
    """
    import av

    times = np.asarray(times_s, float)
    if times.ndim != 1 or times.size == 0 or np.any(np.diff(times) <= 0):
        raise SyntheticError("the frames' times do not increase: give increasing times in seconds")
    clock = 90000
    rate = 25.0 if times.size == 1 else 1 / float(np.median(np.diff(times)))
    bitexact = {"fflags": "+bitexact", "movflags": "+faststart"}
    with av.open(str(path), "w", format="mp4", options=bitexact) as container:
        stream = container.add_stream("libx264", rate=Fraction(rate).limit_denominator(1001))
        stream.pix_fmt = "yuv420p"
        stream.options = {
            "crf": str(crf),
            "preset": preset,
            "threads": "1",
            "flags": "+bitexact",
            # With B-frames x264 reads uninitialised memory beside pictures whose size is no
            # multiple of 16: its decisions, and the bytes, would differ from run to run.
            "x264-params": "bframes=0",
            "colorspace": "bt709",
            "color_primaries": "bt709",
            "color_trc": "bt709",
        }
        stream.time_base = Fraction(1, clock)
        stream.codec_context.time_base = Fraction(1, clock)
        for time, picture in zip(times, frames, strict=True):
            rows, columns = picture.shape[:2]
            if rows % 2 or columns % 2:
                raise SyntheticError(
                    f"a frame of {columns}×{rows} px cannot be stored as yuv420p: use even sizes"
                )
            if not stream.codec_context.is_open:
                stream.width, stream.height = columns, rows
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame = frame.reformat(format="yuv420p", dst_colorspace="ITU709")
            frame.pts = round(time * clock)
            frame.time_base = Fraction(1, clock)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
