"""A virtual camera: drawn videos whose markers and motions are known exactly.

Whoever tests a tracker needs pictures with a known answer. A `Scene` holds bodies made of flat
coloured polygons and markers, each moved by a `RigidMotion` of the world plane. A `Camera` with a
`Lens` projects them in perspective, each polygon at its own depth; a `Sensor` adds what real
cameras add: blur during the exposure, shading towards the corners, shot and read noise, gamma.
`render` yields frames with their truth; `write_recording` compresses them with H.264.

A frame's time is the middle of its exposure; where a marker is in a frame means where it is on
average during the exposure.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.rigid import RigidPlacement
from mocap.synthetic.camera import Camera, Colour, Image, Lens, LinearImage, Sensor, SyntheticError
from mocap.synthetic.raster import coverage
from mocap.synthetic.scene import BLACK, WHITE, Light, Marker, Scene, SceneBody, Shape, disc

__all__ = [
    "BLACK",
    "WHITE",
    "Camera",
    "Colour",
    "Image",
    "Lens",
    "Light",
    "Marker",
    "MarkerTruth",
    "Scene",
    "SceneBody",
    "Sensor",
    "Shape",
    "SyntheticError",
    "Truth",
    "disc",
    "exposed",
    "exposure_instants",
    "frame_times",
    "render",
    "truth_at",
    "write_recording",
    "write_truth",
]

Array = NDArray[np.float64]

# The pixels and the lens blur by about as much as this, so that finer steps would not be seen.
_STEP_PX = 1.0
_MOST_INSTANTS = 24


@dataclass(frozen=True)
class MarkerTruth:
    """Where a marker is: mean px over the exposure, and the fraction of it that can be seen."""

    x_px: float
    y_px: float
    visible: float


@dataclass(frozen=True)
class Truth:
    """What is known about a frame: index, time (s), each marker, each body's placement."""

    frame: int
    time_s: float
    markers: Mapping[str, MarkerTruth]
    placements: Mapping[str, RigidPlacement]


def frame_times(camera: Camera, duration_s: float) -> Array:
    """Return the times (s) of the frames of a recording that starts at zero.

    >>> frame_times(Camera(64, 48, (100, 100), 1000, (0, 0), fps=25), 0.16).tolist()
    [0.0, 0.04, 0.08, 0.12]
    """
    return np.arange(round(duration_s * camera.fps)) / camera.fps


def render(
    scene: Scene,
    camera: Camera,
    sensor: Sensor,
    times_s: ArrayLike,
    frames: Iterable[int] | None = None,
) -> Iterator[tuple[Image, Truth]]:
    """Yield frames (rows, columns, 3) uint8 RGB with their truth.

    Frames are drawn one by one as they are asked for, so memory does not grow with the length.

    Parameters
    ----------
    scene, camera, sensor
        What is drawn, and with what.
    times_s
        (n,) times of all frames of the recording, s.
    frames
        Which of them to draw; None: all. A frame is the same whichever others are drawn.
    """
    times = np.asarray(times_s, float)
    for index in range(len(times)) if frames is None else frames:
        time = float(times[index])
        light = exposed(scene, camera, sensor, time)
        yield sensor.read_out(light, index), truth_at(scene, camera, time, index)


def exposed(scene: Scene, camera: Camera, sensor: Sensor, time_s: float) -> LinearImage:
    """Return the linear light (rows, columns, 3), 1 being white, that one exposure collects."""
    instants = exposure_instants(scene, camera, time_s)
    total: LinearImage = np.zeros((camera.height, camera.width, 3), np.float32)
    for instant in instants:
        total += _drawn(scene, camera, sensor, float(instant))
    total *= np.float32(
        (1 + scene.light.flicker * np.sin(2 * np.pi * scene.light.flicker_hz * time_s))
        / len(instants)
    )
    if camera.lens.blur_px > 0:
        import cv2

        total = np.asarray(cv2.GaussianBlur(total, (0, 0), camera.lens.blur_px), np.float32)
    return total * _illumination(scene.light, camera)[..., None]


def exposure_instants(scene: Scene, camera: Camera, time_s: float) -> Array:
    """Return instants (s) that sample the exposure, one per px that the fastest corner moves."""
    half = camera.exposure_s / 2
    path = 0.0
    for body in scene.bodies:
        if not body.drawn():
            continue
        before, after = body.motion.at(time_s - half), body.motion.at(time_s + half)
        moved = _projected(body, after, camera)[0] - _projected(body, before, camera)[0]
        path = max(path, float(np.hypot(*moved.T).max()))
    number = int(np.clip(np.ceil(path / _STEP_PX), 1, _MOST_INSTANTS))
    return time_s - half + camera.exposure_s * (np.arange(number) + 0.5) / number


def truth_at(scene: Scene, camera: Camera, time_s: float, frame: int) -> Truth:
    """Return where markers and bodies are in the exposure around a time (s)."""
    instants = exposure_instants(scene, camera, time_s)
    outlines = [_outlines(body, body.motion.at(time_s), camera) for body in scene.bodies]
    markers: dict[str, MarkerTruth] = {}
    for number, body in enumerate(scene.bodies):
        places = [body.motion.at(float(t)) for t in instants]
        covers = [pair for later in outlines[number + 1 :] for pair in later]
        base = dict(outlines[number])
        for marker in body.markers:
            path = np.array([p.apply(marker.at_mm) for p in places])
            x, y = camera.project(path, marker.depth_mm).mean(axis=0)
            seen = _visible_fraction(base[marker.shapes[0]], covers, camera)
            markers[marker.name] = MarkerTruth(float(x), float(y), seen)
    placements = {body.name: body.motion.at(time_s) for body in scene.bodies}
    return Truth(frame, time_s, markers, placements)


def write_recording(
    path: Path,
    frames: Iterable[Image],
    times_s: ArrayLike,
    *,
    crf: float = 20.0,
    preset: str = "medium",
) -> None:
    """Write frames as H.264 (yuv420p, mp4) with the given presentation times (s).

    One thread and no timestamps of the writing: the same frames give the same bytes on the same
    machine and libraries.

    Parameters
    ----------
    path
        The file to write, ending in ``.mp4``.
    frames
        (rows, columns, 3) uint8 RGB each, as many as times; rows and columns even.
    times_s
        Increasing presentation times, s; unevenly spaced for a variable frame rate.
    crf, preset
        Of x264: quality (0 lossless ... 51) and how hard it tries.

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
            # Planning B-frames, x264 reads uninitialised memory beside pictures whose size is no
            # multiple of 16, and its choices, hence the bytes, differ from run to run.
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


def write_truth(markers_file: Path, bodies_file: Path, truths: Iterable[Truth]) -> None:
    """Write the truth of all frames as two tables.

    ``markers_file``: ``frame,time_s,marker,x_px,y_px,visible``. ``bodies_file``:
    ``frame,time_s,body,theta_deg,x_mm,y_mm``, the placement x = R(theta) X + (x_mm, y_mm) of body
    points X in the world plane.
    """
    with markers_file.open("w", newline="") as first, bodies_file.open("w", newline="") as second:
        markers, bodies = (csv.writer(f, lineterminator="\n") for f in (first, second))
        markers.writerow(["frame", "time_s", "marker", "x_px", "y_px", "visible"])
        bodies.writerow(["frame", "time_s", "body", "theta_deg", "x_mm", "y_mm"])
        for truth in truths:
            head = [truth.frame, f"{truth.time_s:.6f}"]
            for name, m in truth.markers.items():
                markers.writerow(
                    [*head, name, f"{m.x_px:.4f}", f"{m.y_px:.4f}", f"{m.visible:.3f}"]
                )
            for name, p in truth.placements.items():
                shift = [f"{value:.5f}" for value in p.shift_mm]
                bodies.writerow([*head, name, f"{np.degrees(p.angle_rad):.6f}", *shift])


@dataclass(frozen=True)
class _Window:
    """A rectangle of the picture: rows and columns, last ones exclusive."""

    top: int
    left: int
    bottom: int
    right: int

    @classmethod
    def around(cls, corners_px: Array, margin: float, camera: Camera) -> _Window:
        low = np.floor(corners_px.min(axis=0) - margin).astype(int)
        high = np.ceil(corners_px.max(axis=0) + margin).astype(int) + 1
        left, right = np.clip([low[0], high[0]], 0, camera.width)
        top, bottom = np.clip([low[1], high[1]], 0, camera.height)
        return cls(int(top), int(left), int(bottom), int(right))

    @property
    def shape(self) -> tuple[int, int]:
        return self.bottom - self.top, self.right - self.left

    def cut_to(self, other: _Window) -> _Window:
        """Return the part of this window that another one shares."""
        top, left = max(self.top, other.top), max(self.left, other.left)
        bottom, right = min(self.bottom, other.bottom), min(self.right, other.right)
        return _Window(top, left, max(bottom, top), max(right, left))

    def seen_from(self, other: _Window) -> tuple[slice, slice]:
        """Return the slices of this window in an array that covers a window around it."""
        rows = slice(self.top - other.top, self.bottom - other.top)
        return rows, slice(self.left - other.left, self.right - other.left)

    @property
    def slices(self) -> tuple[slice, slice]:
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def covered(self, corners_px: Array) -> NDArray[np.float32]:
        """Coverage (rows, columns) of a polygon on this window."""
        return coverage(corners_px - [self.left, self.top], self.shape).astype(np.float32)


def _drawn(scene: Scene, camera: Camera, sensor: Sensor, time_s: float) -> LinearImage:
    picture: LinearImage = np.empty((camera.height, camera.width, 3), np.float32)
    picture[:] = sensor.linear(scene.background)
    for body in scene.bodies:
        placement = body.motion.at(time_s)
        named: dict[str, tuple[_Window, NDArray[np.float32]]] = {}
        for shape, corners in _outlines(body, placement, camera):
            softness = shape.softness_mm * camera.pixels_per_mm(shape.depth_mm)
            window = _Window.around(corners, 3 * softness, camera)
            if shape.inside is not None:
                frame, within = _named(shape, body, named)
                window = window.cut_to(frame)
            if 0 in window.shape and not shape.name:
                continue
            alpha = _softened(window, corners, softness)
            if shape.inside is not None:
                alpha = alpha * within[window.seen_from(frame)]
            if shape.name:
                named[shape.name] = window, alpha
            part = picture[window.slices]
            opaque = alpha[..., None] * np.float32(shape.opacity)
            part += opaque * (sensor.linear(shape.colour) - part)
    return picture


def _named(
    shape: Shape, body: SceneBody, named: Mapping[str, tuple[_Window, NDArray[np.float32]]]
) -> tuple[_Window, NDArray[np.float32]]:
    """Return the window and coverage of the earlier shape that a shape is confined to."""
    if shape.inside is None or shape.inside not in named:
        raise SyntheticError(
            f"a shape of body {body.name!r} is to lie inside {shape.inside!r}, which is not drawn "
            f"before it: named before it are {', '.join(sorted(named)) or 'none'}"
        )
    return named[shape.inside]


def _outlines(
    body: SceneBody, placement: RigidPlacement, camera: Camera
) -> list[tuple[Shape, Array]]:
    """Return the body's shapes in drawing order with their corners in the picture, px."""
    if not body.drawn():
        return []
    corners, ends = _projected(body, placement, camera)
    return list(zip(body.drawn(), np.split(corners, ends[:-1]), strict=True))


def _projected(
    body: SceneBody, placement: RigidPlacement, camera: Camera
) -> tuple[Array, NDArray[np.intp]]:
    """Return the corners of all shapes, one after the other, in px, and where each shape ends."""
    shapes = body.drawn()
    sizes = [len(shape.corners_mm) for shape in shapes]
    corners = placement.apply(np.concatenate([shape.corners_mm for shape in shapes]))
    depth = np.repeat([shape.depth_mm for shape in shapes], sizes)
    return camera.project(corners, depth), np.cumsum(sizes)


def _softened(window: _Window, corners_px: Array, softness_px: float) -> NDArray[np.float32]:
    """Coverage with a softened edge; wide softening is done on a coarser grid, then enlarged."""
    if softness_px <= 0 or 0 in window.shape:
        return window.covered(corners_px)
    import cv2

    coarse = max(1, int(softness_px / 2))
    rows, columns = (-(-n // coarse) + 1 for n in window.shape)
    local = (corners_px - [window.left, window.top] + 0.5) / coarse - 0.5
    small = coverage(local, (rows, columns)).astype(np.float32)
    small = np.asarray(cv2.GaussianBlur(small, (0, 0), softness_px / coarse), np.float32)
    whole = cv2.resize(small, (columns * coarse, rows * coarse), interpolation=cv2.INTER_LINEAR)
    return np.asarray(whole[: window.shape[0], : window.shape[1]], np.float32)


def _illumination(light: Light, camera: Camera) -> LinearImage:
    """Relative light (rows, columns): slope across the picture and the lens' vignetting."""
    x = np.linspace(-1, 1, camera.width, dtype=np.float32)[None]
    y = np.linspace(-1, 1, camera.height, dtype=np.float32)[:, None]
    slope = 1 + np.float32(light.slope[0] / 2) * x + np.float32(light.slope[1] / 2) * y
    aspect = np.float32(camera.height / camera.width)
    radius2 = (x * x + (aspect * y) ** 2) / (1 + aspect**2)
    return np.asarray(slope * (1 - np.float32(camera.lens.vignetting) * radius2), np.float32)


def _visible_fraction(
    outline_px: Array, covers: list[tuple[Shape, Array]], camera: Camera
) -> float:
    """Fraction of a marker's outline that is in the picture and under no later shape."""
    window = _Window.around(outline_px, 0, camera)
    if 0 in window.shape:
        return 0.0
    seen = window.covered(outline_px)
    for shape, corners in covers:
        over = _Window.around(corners, 0, camera).cut_to(window)
        if shape.softness_mm == 0 and 0 not in over.shape:
            seen = seen * (1 - np.float32(shape.opacity) * window.covered(corners))
    return float(np.clip(seen.sum() / _polygon_area(outline_px), 0, 1))


def _polygon_area(corners: Array) -> float:
    x, y = corners.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)
