"""A virtual camera: drawn videos whose markers and motions are known exactly.

Whoever tests a tracker needs pictures with a known answer. A `Scene` holds bodies made of flat
coloured polygons and markers, each moved by a `RigidMotion` of the world plane. A `Camera` with a
`Lens` projects them in perspective, each polygon at its own depth; a `Sensor` adds what real
cameras add: blur during the exposure, shading towards the corners, shot and read noise, gamma.
`render` yields frames with their truth; `write_recording` compresses them with H.264.

World: mm, x right, y up, z towards the camera (`depth_mm`); z = 0 is the plane of the package.
Picture: px, x right, y down, integers at pixel centres. A frame's time is the middle of its
exposure.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.rigid import RigidMotion, RigidPlacement
from mocap.raster import coverage

Array = NDArray[np.float64]
Image = NDArray[np.float32]
Frame = NDArray[np.uint8]
Colour = tuple[float, float, float]

BLACK: Colour = (0.04, 0.04, 0.05)
WHITE: Colour = (0.93, 0.93, 0.91)

# Finer sampling of the exposure than this changes no pixel of a drawn marker by a grey level.
_STEP_PX = 0.5
_MOST_INSTANTS = 24


class SyntheticError(ValueError):
    """A scene or camera was described that cannot be drawn."""


@dataclass(frozen=True)
class Lens:
    """Distortion and sharpness of a lens.

    Parameters
    ----------
    k1, k2, p1, p2, k3
        OpenCV's coefficients: radial k1, k2, k3, tangential p1, p2.
    blur_px
        Standard deviation of the point spread function, px.
    vignetting
        Fraction of the light that is lost in the corners of the picture.
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    blur_px: float = 0.0
    vignetting: float = 0.0

    def distorted(self, normalised: ArrayLike) -> Array:
        """Return where ideal normalised image points (..., 2) appear, also normalised.

        Brown's model in OpenCV's convention (calib3d, "Detailed description").
        """
        point = np.asarray(normalised, float)
        x, y = point[..., 0], point[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return np.stack(
            [
                x * radial + 2 * self.p1 * x * y + self.p2 * (r2 + 2 * x * x),
                y * radial + self.p1 * (r2 + 2 * y * y) + 2 * self.p2 * x * y,
            ],
            axis=-1,
        )


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with a lens, looking at the world plane.

    Parameters
    ----------
    width, height
        Size of the picture, px.
    focal_px
        Focal lengths fx, fy, px; different when pixels are not square.
    distance_mm
        From the camera to the point it aims at.
    aim_mm
        Point (x, y) of the plane z = 0 on the optical axis, mm.
    fps
        Frames per second.
    exposure_s
        How long the shutter is open for each frame, s.
    principal_px
        Where the optical axis meets the picture, px; None: the picture's centre.
    turn_deg
        Rotation of the camera about the point it aims at, degrees, as an axis-angle vector in the
        camera's own axes (x right, y down, z forward); zero looks along the normal of the plane.
    lens
        Its distortion and blur.
    """

    width: int
    height: int
    focal_px: tuple[float, float]
    distance_mm: float
    aim_mm: tuple[float, float]
    fps: float = 25.0
    exposure_s: float = 0.0
    principal_px: tuple[float, float] | None = None
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lens: Lens = field(default_factory=Lens)

    def __post_init__(self) -> None:
        positive = {
            "width": self.width,
            "height": self.height,
            "focal_px[0]": self.focal_px[0],
            "focal_px[1]": self.focal_px[1],
            "distance_mm": self.distance_mm,
            "fps": self.fps,
        }
        for name, value in positive.items():
            if not value > 0:
                raise SyntheticError(f"camera {name} is {value}: give a number above zero")
        if not 0 <= self.exposure_s <= 1 / self.fps:
            raise SyntheticError(
                f"camera exposure_s is {self.exposure_s}, but a frame lasts {1 / self.fps:.4g} s: "
                "give a time between zero and that"
            )

    @property
    def matrix(self) -> Array:
        """Camera matrix (3, 3) in OpenCV's form."""
        cx, cy = self.principal_px or ((self.width - 1) / 2, (self.height - 1) / 2)
        return np.array([[self.focal_px[0], 0, cx], [0, self.focal_px[1], cy], [0, 0, 1.0]])

    @property
    def rotation(self) -> Array:
        """Matrix (3, 3) from world axes (x right, y up, z to the camera) to camera axes."""
        return _axis_angle_matrix(np.radians(self.turn_deg)) @ np.diag([1.0, -1.0, -1.0])

    def project(self, points_mm: ArrayLike, depth_mm: ArrayLike = 0.0) -> Array:
        """Return px (..., 2) of world points (..., 2) at depth z (towards the camera).

        Raises
        ------
        SyntheticError
            If a point lies behind the camera.
        """
        points = np.asarray(points_mm, float) - np.asarray(self.aim_mm)
        depth = np.broadcast_to(np.asarray(depth_mm, float), points.shape[:-1])
        seen = np.concatenate([points, depth[..., None]], axis=-1) @ self.rotation.T
        distance = seen[..., 2] + self.distance_mm
        if np.any(distance <= 0):
            raise SyntheticError(
                f"a point lies {-distance.min():.1f} mm behind the camera: lessen its depth_mm"
            )
        normalised = self.lens.distorted(seen[..., :2] / distance[..., None])
        matrix = self.matrix
        return normalised * np.diag(matrix)[:2] + matrix[:2, 2]

    def pixels_per_mm(self, depth_mm: float = 0.0) -> float:
        """Return the scale in the picture's centre at a depth, px per mm (horizontally)."""
        return self.focal_px[0] / (self.distance_mm - depth_mm)


@dataclass(frozen=True)
class Sensor:
    """What turns light into grey levels.

    Parameters
    ----------
    full_well_e
        Electrons in a pixel that is just white: shot noise of a pixel with N electrons is √N.
        Infinite: no shot noise.
    read_noise_e
        Standard deviation of the read noise, electrons.
    gamma
        Exponent of the display: grey level = 255 × light^(1/gamma).
    seed
        Of the noise; each frame has its own stream, so frames can be drawn in any order.
    """

    full_well_e: float = np.inf
    read_noise_e: float = 0.0
    gamma: float = 2.2
    seed: int = 0

    def __post_init__(self) -> None:
        if not (self.full_well_e > 0 and self.read_noise_e >= 0 and self.gamma > 0):
            raise SyntheticError(
                f"sensor full_well_e {self.full_well_e}, read_noise_e {self.read_noise_e}, gamma "
                f"{self.gamma}: full well and gamma must be above zero, read noise not below"
            )
        if np.isinf(self.full_well_e) and self.read_noise_e > 0:
            raise SyntheticError(
                f"sensor read_noise_e is {self.read_noise_e} electrons, but full_well_e is "
                "infinite: give the full well, which says how bright an electron is"
            )

    def read_out(self, light: Image, frame: int) -> Frame:
        """Return grey levels 0...255 for linear light (rows, columns, 3), 1 being white."""
        if np.isfinite(self.full_well_e):
            generator = np.random.default_rng([self.seed, frame])
            variance = np.maximum(light, 0) / np.float32(self.full_well_e)
            variance += np.float32((self.read_noise_e / self.full_well_e) ** 2)
            noise = generator.standard_normal(light.shape, dtype=np.float32)
            light = light + noise * np.sqrt(variance)
        levels = 255 * np.clip(light, 0, 1) ** np.float32(1 / self.gamma)
        return np.asarray(np.rint(levels), np.uint8)

    def linear(self, colour: Colour) -> NDArray[np.float32]:
        """Return the light (3,) that shows as a colour given as displayed values 0...1."""
        return np.asarray(colour, np.float32) ** np.float32(self.gamma)


@dataclass(frozen=True)
class Shape:
    """A flat coloured polygon of a body.

    Parameters
    ----------
    corners_mm
        (n, 2) corners in the body's own coordinates, mm; simple polygon, either orientation.
    colour
        Red, green, blue as displayed, 0...1.
    opacity
        1 covers what is behind it, 0 is invisible.
    softness_mm
        Standard deviation of a softening of the edge, mm: for shades, not for markers.
    depth_mm
        Height above the world plane, towards the camera, mm.
    name, inside
        A shape may be confined to an earlier shape of its body, which it names.
    """

    corners_mm: Array
    colour: Colour
    opacity: float = 1.0
    softness_mm: float = 0.0
    depth_mm: float = 0.0
    name: str = ""
    inside: str | None = None

    def __post_init__(self) -> None:
        corners = np.array(self.corners_mm, float)
        if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
            raise SyntheticError(
                f"shape {self.name!r} has corners of shape {corners.shape}: give at least three "
                "corners as (n, 2)"
            )
        if not np.isfinite(corners).all():
            raise SyntheticError(f"shape {self.name!r} has a corner that is not a finite number")
        corners.setflags(write=False)
        object.__setattr__(self, "corners_mm", corners)


@dataclass(frozen=True)
class Marker:
    """A named point of a body and the shapes that make it visible.

    The classmethods draw the usual kinds; `at_mm` is the point a tracker should find.
    """

    name: str
    at_mm: tuple[float, float]
    shapes: tuple[Shape, ...]
    depth_mm: float = 0.0

    @classmethod
    def dot(
        cls,
        name: str,
        at_mm: tuple[float, float],
        *,
        radius_mm: float,
        colour: Colour = BLACK,
        depth_mm: float = 0.0,
    ) -> Marker:
        """Return a bare disc."""
        return cls(name, at_mm, (disc(at_mm, radius_mm, colour, depth_mm),), depth_mm)

    @classmethod
    def ring(
        cls,
        name: str,
        at_mm: tuple[float, float],
        *,
        radii_mm: tuple[float, float],
        colours: tuple[Colour, Colour] = (BLACK, WHITE),
        depth_mm: float = 0.0,
    ) -> Marker:
        """Return a disc of the outer radius with a disc of the inner radius in the other colour."""
        outer = disc(at_mm, radii_mm[0], colours[0], depth_mm)
        inner = disc(at_mm, radii_mm[1], colours[1], depth_mm)
        return cls(name, at_mm, (outer, inner), depth_mm)

    @classmethod
    def patch(
        cls,
        name: str,
        at_mm: tuple[float, float],
        *,
        side_mm: float = 10.0,
        radius_mm: float = 2.5,
        turn_deg: float = 0.0,
        colours: tuple[Colour, Colour] = (WHITE, BLACK),
        depth_mm: float = 0.0,
    ) -> Marker:
        """Return a square sticker, turned by an angle, with a dot in its centre."""
        angle = np.radians(turn_deg + 45 + 90 * np.arange(4))
        square = np.column_stack([np.cos(angle), np.sin(angle)]) * side_mm / np.sqrt(2) + at_mm
        sticker = Shape(square, colours[0], depth_mm=depth_mm)
        return cls(name, at_mm, (sticker, disc(at_mm, radius_mm, colours[1], depth_mm)), depth_mm)


@dataclass(frozen=True)
class Body:
    """Shapes and markers that move together; later ones are drawn over earlier ones."""

    name: str
    motion: RigidMotion
    shapes: tuple[Shape, ...] = ()
    markers: tuple[Marker, ...] = ()

    def drawn(self) -> tuple[Shape, ...]:
        """Return all shapes in drawing order, the markers' last."""
        return self.shapes + tuple(s for marker in self.markers for s in marker.shapes)


@dataclass(frozen=True)
class Light:
    """Uneven and flickering light.

    Parameters
    ----------
    slope
        Relative change of the light from one border of the picture to the other (right, down).
    flicker, flicker_hz
        Relative amplitude and frequency of a sinusoidal flicker (mains light: 100 or 120 Hz).
    """

    slope: tuple[float, float] = (0.0, 0.0)
    flicker: float = 0.0
    flicker_hz: float = 100.0


@dataclass(frozen=True)
class Scene:
    """Bodies in drawing order (an occluder is a body that comes late) before a background."""

    bodies: tuple[Body, ...]
    background: Colour = (0.72, 0.75, 0.77)
    light: Light = field(default_factory=Light)

    def __post_init__(self) -> None:
        names = [marker.name for body in self.bodies for marker in body.markers]
        doubled = sorted({name for name in names if names.count(name) > 1})
        if doubled:
            raise SyntheticError(f"marker {doubled[0]!r} occurs twice: give every marker one name")


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


def disc(
    centre_mm: tuple[float, float], radius_mm: float, colour: Colour, depth_mm: float = 0.0
) -> Shape:
    """Return a disc as a polygon of 96 corners with the area of the circle."""
    angle = 2 * np.pi * np.arange(96) / 96
    radius = radius_mm * np.sqrt(2 * np.pi / (96 * np.sin(2 * np.pi / 96)))
    corners = np.column_stack([np.cos(angle), np.sin(angle)]) * radius + centre_mm
    return Shape(corners, colour, depth_mm=depth_mm)


def frame_times(camera: Camera, duration_s: float) -> Array:
    """Return the times (s) of the frames of a recording that starts at zero.

    >>> frame_times(Camera(64, 48, (100, 100), 1000, (0, 0), fps=25), 0.16).tolist()
    [0.0, 0.04, 0.08, 0.12]
    """
    return np.arange(round(duration_s * camera.fps)) / camera.fps


def render(
    scene: Scene, camera: Camera, sensor: Sensor, times_s: ArrayLike
) -> Iterator[tuple[Frame, Truth]]:
    """Yield for each time (s) the frame (rows, columns, 3) uint8 RGB and its truth.

    Frames are drawn one by one as they are asked for, so memory does not grow with the length.
    """
    for index, time in enumerate(np.asarray(times_s, float)):
        light = exposed(scene, camera, sensor, float(time))
        yield sensor.read_out(light, index), truth_at(scene, camera, float(time), index)


def exposed(scene: Scene, camera: Camera, sensor: Sensor, time_s: float) -> Image:
    """Return the linear light (rows, columns, 3), 1 being white, that one exposure collects."""
    instants = exposure_instants(scene, camera, time_s)
    total: Image = np.zeros((camera.height, camera.width, 3), np.float32)
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
    """Return instants (s) that sample the exposure: as many as the fastest corner moves half px."""
    half = camera.exposure_s / 2
    path = 0.0
    for body in scene.bodies:
        before, after = body.motion.at(time_s - half), body.motion.at(time_s + half)
        for shape in body.drawn():
            moved = camera.project(after.apply(shape.corners_mm), shape.depth_mm)
            moved = moved - camera.project(before.apply(shape.corners_mm), shape.depth_mm)
            path = max(path, float(np.hypot(*moved.T).max()))
    number = int(np.clip(np.ceil(path / _STEP_PX), 1, _MOST_INSTANTS))
    return time_s - half + camera.exposure_s * (np.arange(number) + 0.5) / number


def truth_at(scene: Scene, camera: Camera, time_s: float, frame: int) -> Truth:
    """Return where markers and bodies are in the exposure around a time (s)."""
    instants = exposure_instants(scene, camera, time_s)
    markers: dict[str, MarkerTruth] = {}
    for number, body in enumerate(scene.bodies):
        places = [body.motion.at(float(t)) for t in instants]
        for marker in body.markers:
            path = np.array([p.apply(marker.at_mm) for p in places])
            x, y = camera.project(path, marker.depth_mm).mean(axis=0)
            seen = _visible_fraction(scene, camera, time_s, number, marker)
            markers[marker.name] = MarkerTruth(float(x), float(y), seen)
    placements = {body.name: body.motion.at(time_s) for body in scene.bodies}
    return Truth(frame, time_s, markers, placements)


def write_recording(
    path: Path,
    frames: Iterable[Frame],
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


def _drawn(scene: Scene, camera: Camera, sensor: Sensor, time_s: float) -> Image:
    picture: Image = np.empty((camera.height, camera.width, 3), np.float32)
    picture[:] = sensor.linear(scene.background)
    for body in scene.bodies:
        placement = body.motion.at(time_s)
        named: dict[str, tuple[_Window, NDArray[np.float32]]] = {}
        for shape in body.drawn():
            corners = _projected(shape, placement, camera)
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
    shape: Shape, body: Body, named: Mapping[str, tuple[_Window, NDArray[np.float32]]]
) -> tuple[_Window, NDArray[np.float32]]:
    """Return the window and coverage of the earlier shape that a shape is confined to."""
    if shape.inside is None or shape.inside not in named:
        raise SyntheticError(
            f"a shape of body {body.name!r} is to lie inside {shape.inside!r}, which is not drawn "
            f"before it: named before it are {', '.join(sorted(named)) or 'none'}"
        )
    return named[shape.inside]


def _projected(shape: Shape, placement: RigidPlacement, camera: Camera) -> Array:
    return camera.project(placement.apply(shape.corners_mm), shape.depth_mm)


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


def _illumination(light: Light, camera: Camera) -> Image:
    """Relative light (rows, columns): slope across the picture and the lens' vignetting."""
    x = np.linspace(-1, 1, camera.width, dtype=np.float32)[None]
    y = np.linspace(-1, 1, camera.height, dtype=np.float32)[:, None]
    slope = 1 + np.float32(light.slope[0] / 2) * x + np.float32(light.slope[1] / 2) * y
    aspect = np.float32(camera.height / camera.width)
    radius2 = (x * x + (aspect * y) ** 2) / (1 + aspect**2)
    return np.asarray(slope * (1 - np.float32(camera.lens.vignetting) * radius2), np.float32)


def _visible_fraction(
    scene: Scene, camera: Camera, time_s: float, number: int, marker: Marker
) -> float:
    """Fraction of a marker that is in the picture and not covered by later bodies."""
    place = scene.bodies[number].motion.at(time_s)
    outline = _projected(marker.shapes[0], place, camera)
    whole = _polygon_area(outline)
    window = _Window.around(outline, 0, camera)
    if 0 in window.shape:
        return 0.0
    seen = window.covered(outline)
    for later in scene.bodies[number + 1 :]:
        placement = later.motion.at(time_s)
        for shape in later.drawn():
            if shape.softness_mm == 0:
                corners = _projected(shape, placement, camera)
                seen = seen * (1 - np.float32(shape.opacity) * window.covered(corners))
    return float(np.clip(seen.sum() / whole, 0, 1))


def _polygon_area(corners: Array) -> float:
    x, y = corners.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def _axis_angle_matrix(vector: Array) -> Array:
    """Rotation matrix (3, 3) of an axis-angle vector (rad), Rodrigues' formula."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = np.asarray(vector) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
