"""The video with markers, trails, body axes, time and relative motion drawn on it."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.progress import Progress
from mocap.motion.capture import Capture
from mocap.motion.motion import Motion
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import Tracks
from mocap.video.frames import Video

Image: TypeAlias = NDArray[np.uint8]
Colour: TypeAlias = tuple[int, int, int]

# Blue, green, red.
SEEN: Colour = (80, 220, 60)
FIXED: Colour = (230, 190, 40)
PREDICTED: Colour = (0, 170, 255)
LOST: Colour = (60, 60, 255)
REFERENCE: Colour = (255, 200, 90)
MOVING: Colour = (120, 120, 255)
WHITE: Colour = (255, 255, 255)
BLACK: Colour = (0, 0, 0)
STATUS_COLOURS = {"seen": SEEN, "fixed": FIXED, "predicted": PREDICTED, "lost": LOST}
TRAIL_FRAMES = 20
# Binary digits of a pixel's fraction in OpenCV's coordinates.
SHIFT = 4
# Largest frame rate of the written file, frames/s.
RATE_LIMIT = 1000


def write_overlay(
    video: Video,
    tracks: Tracks,
    captured: Capture,
    markers: MarkerFile,
    out: Path,
    *,
    progress: Progress | None = None,
) -> None:
    """Write the frames of ``tracks`` with markers, trails and body axes as an H.264 file.

    Parameters
    ----------
    video
        The recording, read again from its start.
    tracks, captured, markers
        Tracks, motion and marker file.
    out
        The file to write; it plays in a browser.
    progress
        Called with the share of the frames that is written.
    """
    row_of = {int(frame): i for i, frame in enumerate(tracks.frame)}
    motion_row = {int(frame): i for i, frame in enumerate(captured.frame)}
    last = max(row_of)
    with _Writer(out, video.info.width, video.info.height, _rate(tracks)) as writer:
        for frame in video.frames():
            if frame.index > last:
                break
            row = row_of.get(frame.index)
            if row is None:
                continue
            picture = draw_frame(
                frame.colour(), tracks, row, captured.motion, motion_row.get(frame.index), markers
            )
            writer.write(picture, frame.time_s - tracks.time_s[0])
            if progress is not None:
                progress((row + 1) / len(tracks.frame), "drawing the overlay")


def draw_frame(
    picture: Image,
    tracks: Tracks,
    row: int,
    motion: Motion,
    motion_row: int | None,
    markers: MarkerFile,
) -> Image:
    """Return one picture (height, width, 3; blue, green, red) with all overlays.

    Parameters
    ----------
    picture
        The frame; it may be changed.
    tracks, row
        The tracks and the row of the frame.
    motion, motion_row
        The motion and its row, None if the frame has none.
    markers
        The marker file.
    """
    canvas = np.ascontiguousarray(picture)
    size = max(min(canvas.shape[0] / 720.0, canvas.shape[1] / 1150.0), 0.45)
    _draw_bodies(canvas, tracks, row, markers, size)
    for k in range(len(tracks.names)):
        _draw_trail(canvas, tracks, row, k, size)
    for k, name in enumerate(tracks.names):
        below = _is_lowest(tracks, row, k, markers.bodies.get(markers.body_of(name) or "", ()))
        _draw_marker(canvas, tracks, row, k, below, size)
    _draw_panel(canvas, tracks, row, motion, motion_row, markers, size)
    return canvas


def _is_lowest(tracks: Tracks, row: int, k: int, mates: tuple[str, ...]) -> bool:
    """Whether a marker is the lowest of several of its body; its name is then written below it."""
    heights = [tracks.position_px[row, tracks.names.index(name), 1] for name in mates]
    own = tracks.position_px[row, k, 1]
    return len(mates) > 1 and bool(np.isfinite(own)) and bool(own >= np.nanmax(heights))


def _draw_marker(canvas: Image, tracks: Tracks, row: int, k: int, below: bool, size: float) -> None:
    """Draw a cross around a marker; its middle is open, so that the marker stays visible."""
    x, y = tracks.position_px[row, k]
    if not np.isfinite(x):
        return
    colour = STATUS_COLOURS[str(tracks.status[row, k])]
    inner, outer = 4.0 * size, 14.0 * size
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        start = (x + inner * dx, y + inner * dy)
        end = (x + outer * dx, y + outer * dy)
        _line(canvas, start, end, BLACK, round(3 * size) + 1)
        _line(canvas, start, end, colour, max(round(1.5 * size), 1))
    words = tracks.names[k].replace("_", " ")
    at = (x + 13 * size, y + (26 if below else -13) * size)
    put_text(canvas, words, at, 0.62 * size, colour)


def _draw_trail(canvas: Image, tracks: Tracks, row: int, k: int, size: float) -> None:
    """Draw the recent path of a marker; it fades towards the past."""
    first = max(row - TRAIL_FRAMES, 0)
    points = tracks.position_px[first : row + 1, k]
    for i in range(len(points) - 1):
        if np.isfinite(points[i : i + 2]).all():
            fade = (i + 1) / len(points)
            status = str(tracks.status[first + i + 1, k])
            colour = tuple(int(fade * c + (1 - fade) * 90) for c in STATUS_COLOURS[status])
            _line(canvas, points[i], points[i + 1], colour, max(round(2 * size * fade), 1))


def _draw_bodies(canvas: Image, tracks: Tracks, row: int, markers: MarkerFile, size: float) -> None:
    """Draw the line through the first two markers of each body, and axes that turn with it."""
    for body, colour in ((markers.reference, REFERENCE), (markers.moving, MOVING)):
        columns = [tracks.names.index(name) for name in markers.bodies[body]]
        points = tracks.position_px[row, columns]
        if not np.isfinite(points).all():
            continue
        angle = 0.0
        if len(columns) > 1:
            _line(canvas, points[0], points[1], colour, max(round(size), 1))
            first = tracks.position_px[:, columns[:2]]
            known = first[np.isfinite(first).all(axis=(1, 2))][0]
            angle = _direction(points[:2]) - _direction(known)
        for turn, length in ((0.0, 60.0), (-0.5 * np.pi, 60.0)):
            tip = points[0] + size * length * np.array([np.cos(angle + turn), np.sin(angle + turn)])
            _arrow(canvas, points[0], tip, colour, size)


def _direction(pair: NDArray[np.float64]) -> float:
    return float(np.arctan2(pair[1, 1] - pair[0, 1], pair[1, 0] - pair[0, 0]))


def _draw_panel(
    canvas: Image,
    tracks: Tracks,
    row: int,
    motion: Motion,
    motion_row: int | None,
    markers: MarkerFile,
    size: float,
) -> None:
    """Write time and relative motion on a dark strip, and the legend of the colours below."""
    texts = [f"t = {tracks.time_s[row]:6.3f} s   frame {tracks.frame[row]}"]
    if motion_row is not None:
        x, y = motion.relative_mm[motion_row]
        sx, sy, st = motion.sigma[motion_row]
        words = f"{markers.moving} from {markers.reference}: "
        words += f"x {x:.2f}+/-{sx:.2f}  y {y:.2f}+/-{sy:.2f} mm"
        if motion.package_body.axis_rad is not None:
            angle = np.degrees(motion.relative_rad[motion_row])
            words += f"  turn {angle:.2f}+/-{np.degrees(st):.2f} deg"
        texts.append(words)
    in_one = "   ".join(texts)
    room = canvas.shape[1] - 24 * size
    lines = [in_one] if _text_width(in_one, 0.62 * size) <= room else texts
    height = round((34 + 24 * (len(lines) - 1)) * size)
    # The strip is opaque over a rendered recording: it covers that recording's own caption.
    transparency = 0.0 if markers.rendered else 0.35
    canvas[:height] = (transparency * canvas[:height]).astype(np.uint8)
    for number, line in enumerate(lines):
        put_text(canvas, line, (12 * size, (23 + 24 * number) * size), 0.62 * size, WHITE)
    x = 12 * size
    bottom = canvas.shape[0] - 12 * size
    for status in dict.fromkeys(["seen", "predicted", *map(str, tracks.status[row])]):
        x += put_text(canvas, status, (x, bottom), 0.62 * size, STATUS_COLOURS[status]) + 14 * size
    for body, colour in ((markers.reference, REFERENCE), (markers.moving, MOVING)):
        x += put_text(canvas, f"axes: {body}", (x, bottom), 0.62 * size, colour) + 14 * size
    if markers.rendered:
        width = _text_width("rendered", 0.7 * size)
        put_text(
            canvas, "rendered", (canvas.shape[1] - width - 12 * size, bottom), 0.7 * size, WHITE
        )


def _fixed(point: Any) -> tuple[int, int]:
    return round(float(point[0]) * (1 << SHIFT)), round(float(point[1]) * (1 << SHIFT))


def _line(canvas: Image, start: Any, end: Any, colour: Any, thickness: int) -> None:
    import cv2

    cv2.line(canvas, _fixed(start), _fixed(end), colour, thickness, cv2.LINE_AA, SHIFT)


def _arrow(canvas: Image, start: Any, end: Any, colour: Colour, size: float) -> None:
    thickness = max(round(2 * size), 1)
    _line(canvas, start, end, BLACK, thickness + 2)
    _line(canvas, start, end, colour, thickness)
    along = (np.asarray(end) - np.asarray(start)) / max(np.hypot(*(end - start)), 1e-9)
    across = np.array([-along[1], along[0]])
    for side in (-1, 1):
        barb = end - 9 * size * along + 5 * size * side * across
        _line(canvas, end, barb, colour, thickness)


def put_text(canvas: Image, words: str, at: Any, scale: float, colour: Colour) -> float:
    """Write words with a dark outline, inside the picture; return their width, px."""
    import cv2

    width = _text_width(words, scale)
    x = int(min(max(float(at[0]), 2), max(canvas.shape[1] - width - 2, 2)))
    y = int(min(max(float(at[1]), 16 * scale), canvas.shape[0] - 4))
    font = cv2.FONT_HERSHEY_SIMPLEX
    weight = _weight(scale)
    # Copies of the same weight all around make the outline; a heavier text would be wider.
    for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1), (1, 1)):
        cv2.putText(canvas, words, (x + dx, y + dy), font, scale, BLACK, weight, cv2.LINE_AA)
    cv2.putText(canvas, words, (x, y), font, scale, colour, weight, cv2.LINE_AA)
    return width


def _text_width(words: str, scale: float) -> float:
    import cv2

    (width, _), _ = cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, scale, _weight(scale))
    return float(width)


def _weight(scale: float) -> int:
    return max(round(2.4 * scale), 1)


def _rate(tracks: Tracks) -> float:
    if tracks.time_s.size < 2:
        return 25.0
    return float(np.clip(1 / np.median(np.diff(tracks.time_s)), 1, RATE_LIMIT))


class _Writer:
    """Writer of an H.264 file in which each picture has its own time.

    A second thread compresses a picture while the next one is drawn.
    """

    def __init__(self, path: Path, width: int, height: int, rate: float) -> None:
        from fractions import Fraction

        import av

        self._even = (height // 2 * 2, width // 2 * 2)
        self._base = Fraction(1, 90000)
        self._container = av.open(str(path), "w", options={"movflags": "faststart"})
        stream: Any = self._container.add_stream(
            "libx264", rate=Fraction(rate).limit_denominator(1001)
        )
        stream.width, stream.height = self._even[1], self._even[0]
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = self._base
        stream.options = {"crf": "21", "preset": "veryfast"}
        self._stream = stream
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="encoder")
        self._last: Future[None] | None = None

    def __enter__(self) -> _Writer:
        return self

    def write(self, picture: Image, time_s: float) -> None:
        """Add one picture (height, width, 3; blue, green, red) shown at ``time_s``.

        The picture must not be changed afterwards.
        """
        import av

        frame = av.VideoFrame.from_ndarray(
            np.ascontiguousarray(picture[: self._even[0], : self._even[1]]), format="bgr24"
        )
        frame.pts = round(time_s / self._base)
        frame.time_base = self._base
        self._finish_last()
        self._last = self._thread.submit(self._compress, frame)

    def _compress(self, frame: Any) -> None:
        self._container.mux(self._stream.encode(frame))

    def _finish_last(self) -> None:
        """Wait for the previous picture; raise the error that its compression raised."""
        if self._last is not None:
            last, self._last = self._last, None
            last.result()

    def __exit__(self, *_: object) -> None:
        try:
            self._finish_last()
            self._compress(None)
        finally:
            self._thread.shutdown()
            self._container.close()
