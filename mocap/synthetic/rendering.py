"""A virtual camera: rendered videos whose markers and motions are known exactly.

Tests of a tracker need pictures with a known answer. A `Scene` holds bodies made of flat coloured
polygons and markers; a `RigidMotion` of the world plane moves each body. A `Camera` with a `Lens`
projects them in perspective, each polygon at its own depth. A `Sensor` adds the effects of real
cameras: motion blur, vignetting, shot and read noise, gamma. `render` yields frames with their
truth; `write_recording` compresses them with H.264.

The time of a frame is the middle of its exposure. The position of a marker in a frame is its mean
over the exposure.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mocap.synthetic.camera import Camera, Image, LinearImage, Sensor, SyntheticError
from mocap.synthetic.scene import Light, Scene, SceneBody, ScenePolygon
from mocap.synthetic.truth import MarkerTruth, Truth
from mocap.synthetic.window import PixelWindow, softened

Array = NDArray[np.float64]

# Motion between two instants of an exposure, px: pixels and lens blur by about as much.
_STEP_PX = 1.0
_MOST_INSTANTS = 24


def render(
    scene: Scene,
    camera: Camera,
    sensor: Sensor,
    times_s: ArrayLike,
    frames: Iterable[int] | None = None,
) -> Iterator[tuple[Image, Truth]]:
    """Yield frames (rows, columns, 3) uint8 RGB with their truth.

    Each frame is rendered when it is requested: memory does not grow with the number of frames.

    Parameters
    ----------
    scene, camera, sensor
        The scene, and the camera and sensor that record it.
    times_s
        (n,) times of all frames of the recording, s.
    frames
        Numbers of the frames to render; None: all. A frame does not depend on the others.
    """
    times = np.asarray(times_s, float)
    for index in range(len(times)) if frames is None else frames:
        time = float(times[index])
        light = exposed(scene, camera, sensor, time)
        yield sensor.read_out(light, index), truth_at(scene, camera, time, index)


def exposed(scene: Scene, camera: Camera, sensor: Sensor, time_s: float) -> LinearImage:
    """Return the linear light (rows, columns, 3) of one exposure; 1 is white."""
    instants = exposure_instants(scene, camera, time_s)
    total: LinearImage = np.zeros((camera.height, camera.width, 3), np.float32)
    for instant in instants:
        total += _light_at(scene, camera, sensor, float(instant))
    total *= np.float32(
        (1 + scene.light.flicker * np.sin(2 * np.pi * scene.light.flicker_hz * time_s))
        / len(instants)
    )
    if camera.lens.blur_px > 0:
        import cv2

        total = np.asarray(cv2.GaussianBlur(total, (0, 0), camera.lens.blur_px), np.float32)
    return total * _illumination(scene.light, camera)[..., None]


def exposure_instants(scene: Scene, camera: Camera, time_s: float) -> Array:
    """Return instants, s, that sample the exposure: one per pixel of the fastest corner's path."""
    half = camera.exposure_s / 2
    path = 0.0
    for body in scene.bodies:
        if not body.all_shapes():
            continue
        ends = [_projected(body, time_s + sign * half, camera)[0] for sign in (-1, 1)]
        moved = ends[1] - ends[0]
        path = max(path, float(np.hypot(*moved.T).max()))
    number = int(np.clip(np.ceil(path / _STEP_PX), 1, _MOST_INSTANTS))
    return time_s - half + camera.exposure_s * (np.arange(number) + 0.5) / number


def truth_at(scene: Scene, camera: Camera, time_s: float, frame: int) -> Truth:
    """Return the positions of markers and bodies in the exposure around a time, s."""
    instants = exposure_instants(scene, camera, time_s)
    outlines = [_outlines(body, time_s, camera) for body in scene.bodies]
    markers: dict[str, MarkerTruth] = {}
    for number, body in enumerate(scene.bodies):
        covers = [pair for later in outlines[number + 1 :] for pair in later]
        base = dict(outlines[number])
        for marker in body.markers:
            places = [body.placed([marker.at_mm], marker.depth_mm, float(t)) for t in instants]
            x, y = np.mean([camera.project(*place)[0] for place in places], axis=0)
            seen = _visible_fraction(base[marker.shapes[0]], covers, camera)
            markers[marker.name] = MarkerTruth(float(x), float(y), seen)
    placements = {body.name: body.motion.at(time_s) for body in scene.bodies}
    return Truth(frame, time_s, markers, placements)


def _light_at(scene: Scene, camera: Camera, sensor: Sensor, time_s: float) -> LinearImage:
    picture: LinearImage = np.empty((camera.height, camera.width, 3), np.float32)
    picture[:] = sensor.linear(scene.background)
    for body in scene.bodies:
        named: dict[str, tuple[PixelWindow, NDArray[np.float32]]] = {}
        for shape, corners in _outlines(body, time_s, camera):
            softness = shape.softness_mm * camera.pixels_per_mm(shape.depth_mm)
            window = PixelWindow.around(corners, 3 * softness, camera)
            if shape.inside is not None:
                frame, within = _named(shape, body, named)
                window = window.cut_to(frame)
            if 0 in window.shape and not shape.name:
                continue
            alpha = softened(window, corners, softness)
            if shape.inside is not None:
                alpha = alpha * within[window.seen_from(frame)]
            if shape.name:
                named[shape.name] = window, alpha
            part = picture[window.slices]
            opaque = alpha[..., None] * np.float32(shape.opacity)
            part += opaque * (sensor.linear(shape.colour) - part)
    return picture


def _named(
    shape: ScenePolygon,
    body: SceneBody,
    named: Mapping[str, tuple[PixelWindow, NDArray[np.float32]]],
) -> tuple[PixelWindow, NDArray[np.float32]]:
    """Return window and coverage of the earlier shape that confines a shape."""
    if shape.inside is None or shape.inside not in named:
        raise SyntheticError(
            f"a shape of body {body.name!r} is inside {shape.inside!r}, which is no earlier shape "
            f"of that body: earlier ones are {', '.join(sorted(named)) or 'none'}"
        )
    return named[shape.inside]


def _outlines(body: SceneBody, time_s: float, camera: Camera) -> list[tuple[ScenePolygon, Array]]:
    """Return the body's shapes in order with their corners in the picture, px."""
    if not body.all_shapes():
        return []
    corners, ends = _projected(body, time_s, camera)
    return list(zip(body.all_shapes(), np.split(corners, ends[:-1]), strict=True))


def _projected(body: SceneBody, time_s: float, camera: Camera) -> tuple[Array, NDArray[np.intp]]:
    """Return the concatenated corners of all shapes, px, and the end of each shape in them."""
    shapes = body.all_shapes()
    sizes = [len(shape.corners_mm) for shape in shapes]
    corners = np.concatenate([shape.corners_mm for shape in shapes])
    depth = np.repeat([shape.depth_mm for shape in shapes], sizes)
    return camera.project(*body.placed(corners, depth, time_s)), np.cumsum(sizes)


def _illumination(light: Light, camera: Camera) -> LinearImage:
    """Return the relative light (rows, columns): slope across the picture and vignetting."""
    x = np.linspace(-1, 1, camera.width, dtype=np.float32)[None]
    y = np.linspace(-1, 1, camera.height, dtype=np.float32)[:, None]
    slope = 1 + np.float32(light.slope[0] / 2) * x + np.float32(light.slope[1] / 2) * y
    aspect = np.float32(camera.height / camera.width)
    radius2 = (x * x + (aspect * y) ** 2) / (1 + aspect**2)
    return np.asarray(slope * (1 - np.float32(camera.lens.vignetting) * radius2), np.float32)


def _visible_fraction(
    outline_px: Array, covers: list[tuple[ScenePolygon, Array]], camera: Camera
) -> float:
    """Return the fraction of a marker's outline inside the picture and under no later shape."""
    window = PixelWindow.around(outline_px, 0, camera)
    if 0 in window.shape:
        return 0.0
    seen = window.covered(outline_px)
    for shape, corners in covers:
        over = PixelWindow.around(corners, 0, camera).cut_to(window)
        if shape.softness_mm == 0 and 0 not in over.shape:
            seen = seen * (1 - np.float32(shape.opacity) * window.covered(corners))
    return float(np.clip(seen.sum() / _polygon_area(outline_px), 0, 1))


def _polygon_area(corners: Array) -> float:
    x, y = corners.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)
