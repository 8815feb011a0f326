"""Films in other containers than the project's own, and films that a phone has trimmed."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]


def encoded(
    path: Path,
    pictures: Sequence[Image],
    rate: Fraction | int,
    *,
    codec: str = "libx264",
    times_s: Sequence[float] | None = None,
    options: dict[str, str] | None = None,
    contents_first: bool = False,
) -> Path:
    """Write pictures (height, width, 3) at a rate, frames/s, or at times in ms; return the path.

    An MP4 file may have its table of contents first, so that a part of it can be read.
    """
    layout = {"movflags": "faststart"} if contents_first else {}
    with av.open(str(path), "w", options=layout) as container:
        stream = container.add_stream(codec, rate=rate, options=options or {})
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = {"gif": "rgb8", "mjpeg": "yuvj420p"}.get(codec, "yuv420p")
        base = 1 / Fraction(rate) if times_s is None else Fraction(1, 1000)
        stream.codec_context.time_base = base
        for k, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame = frame.reformat(format=stream.pix_fmt)
            frame.pts = k if times_s is None else round(1000 * times_s[k])
            frame.time_base = base
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def trimmed(film: Path, to: Path, edits: Sequence[tuple[float, float]]) -> Path:
    """Write an MP4 file anew with another edit list, as a phone does that trims; return ``to``.

    Each edit has its duration and the time in the film at which it starts, s; a negative start
    shows nothing. Every picture stays in the file.
    """
    data = bytearray(film.read_bytes())
    header = _box(data, "moov", "mvhd")
    per_s = struct.unpack_from(">I", data, header + 20)[0]
    media = _box(data, "moov", "trak", "mdia", "mdhd")
    media_per_s = struct.unpack_from(">I", data, media + 20)[0]
    at = _box(data, "moov", "trak", "edts", "elst")
    (size,) = struct.unpack_from(">I", data, at)
    (start,) = struct.unpack_from(">i", data, at + 20)
    rows = b"".join(
        struct.pack(
            ">IiI",
            round(per_s * length_s),
            -1 if from_s < 0 else start + round(media_per_s * from_s),
            1 << 16,
        )
        for length_s, from_s in edits
    )
    new = struct.pack(">I4sII", 16 + len(rows), b"elst", 0, len(edits)) + rows
    data[at : at + size] = new
    for path in (("moov",), ("moov", "trak"), ("moov", "trak", "edts")):
        outer = _box(data, *path)
        (length,) = struct.unpack_from(">I", data, outer)
        struct.pack_into(">I", data, outer, length + len(new) - size)
    to.write_bytes(data)
    return to


def _box(data: bytearray, *path: str) -> int:
    """Return where a box of an MP4 file starts (ISO/IEC 14496-12, section 4.2)."""
    at, end = 0, len(data)
    for name in path:
        while True:
            size, kind = struct.unpack_from(">I4s", data, at)
            if kind == name.encode():
                end = at + size
                break
            at += size
            assert at < end, f"no {name}"
        if name != path[-1]:
            at += 8
    return at
