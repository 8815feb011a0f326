"""Drawn clips for the benchmarks of tracking: each seed its own person, package, camera and light.

None of them is the bundled recording's. What varies: the picture's size and shape, its scale, the
frame rate, blur, exposure, lens, noise, compression, sloping and flickering light, the face, the
package (bottle or carton, dark marks on light or light on dark), dots or rings, depth of the head,
and whether a hand with dark spots of its own passes in front of nose, jaw and package.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.rigid import RigidMotion, rotated
from mocap.synthetic.camera import Camera, Colour, Image, Lens, Sensor
from mocap.synthetic.recording_file import write_recording
from mocap.synthetic.rendering import render
from mocap.synthetic.scene import WHITE, Light, Marker, Scene, SceneBody, ScenePolygon
from mocap.synthetic.truth import Truth

Array = NDArray[np.float64]

SIZES = ((640, 400), (1280, 720), (560, 420), (480, 360), (400, 600), (720, 404), (720, 1280))
RATES = (24.0, 25.0, 30.0, 50.0, 60.0)
MARK_MM = 14.0
HEAD_LEVEL_MM = 75.0
# Markers are pasted on by hand and clicked: the start is off by as much, px.
CLICK_PX = 4.0
# A hand hides markers for at least as many frames.
HIDDEN_FRAMES = 12
HAND_SPOTS = ((100.0, -20.0), (128.0, 8.0), (150.0, -40.0), (185.0, -30.0))


@dataclass(frozen=True)
class Take:
    """One drawn clip; everything that varies is drawn at random from the seed."""

    seed: int
    camera: Camera
    sensor: Sensor
    light: Light
    crf: float
    frames: int
    head_depth_mm: float
    nose_mm: tuple[float, float]
    dot_mm: float
    bottle: bool
    rings: bool
    hand: bool

    @classmethod
    def of(cls, seed: int) -> Take:
        """Return the clip of a seed; every fourth is clean: no noise, no blur by motion."""
        rng = np.random.default_rng([seed, 0])
        width, height = SIZES[seed % len(SIZES)]
        rate = RATES[seed % len(RATES)]
        distance = float(rng.uniform(1100, 2200))
        focal = distance * min(width, height) / float(rng.uniform(240, 300))
        bend = float(rng.uniform(-0.2, 0.05)) if seed % 3 == 2 else 0.0
        lens = Lens(k1=bend, k2=-0.3 * bend, blur_px=float(rng.uniform(0.4, 0.9)), vignetting=0.1)
        exposure = float(rng.choice([0.0, 0.004, 0.01]))
        wells = float(rng.choice([2500.0, 5000.0, 10000.0]))
        clean = seed % 4 == 0
        sensor = Sensor(full_well_e=wells, read_noise_e=8.0, seed=seed)
        return cls(
            seed=seed,
            camera=Camera(
                width,
                height,
                (focal, focal),
                distance,
                (75.0, -20.0),
                fps=rate,
                exposure_s=0.0 if clean else exposure,
                lens=lens,
            ),
            sensor=Sensor(seed=seed) if clean else sensor,
            light=Light(
                slope=(float(rng.uniform(-0.3, 0.3)), float(rng.uniform(-0.3, 0.3))),
                flicker=float(rng.choice([0.0, 0.03])),
            ),
            crf=12.0 if clean else float(rng.choice([12.0, 18.0, 23.0])),
            frames=int(1.6 * rate),
            head_depth_mm=float(rng.uniform(0, 80)) if seed % 2 else 0.0,
            nose_mm=(float(rng.uniform(90, 115)), float(rng.uniform(-10, 20))),
            dot_mm=float(rng.uniform(2.2, 3.0)),
            bottle=bool(rng.random() < 0.5),
            rings=seed % 9 == 7,
            hand=seed % 3 == 1,
        )

    @property
    def clean(self) -> bool:
        """Whether neither noise nor motion blurs the pictures."""
        return bool(np.isinf(self.sensor.full_well_e)) and self.camera.exposure_s == 0

    def motions(self) -> tuple[RigidMotion, RigidMotion]:
        """Return the motions of head and package: there, a tilt, and back, with sway."""
        rng = np.random.default_rng([self.seed, 1])
        span = self.frames / self.camera.fps
        time = np.linspace(-0.1 * span - 0.1, 1.1 * span + 0.1, 400)
        s = np.clip(time / span, 0, 1)
        there = np.sin(np.pi * s) ** 2
        phase, amount = rng.uniform(0, 2 * np.pi, 6), rng.uniform(0.6, 1.4, 6)
        sway = np.sin(2 * np.pi * s[:, None] * (1 + np.arange(6) % 2) + phase)
        head_turn = np.radians(8 * amount[0] * there + 2 * sway[:, 0])
        head = RigidMotion(time, head_turn, sway[:, 1:3] * [4 * amount[1], 3 * amount[2]])
        turn = np.radians(-40 * amount[3] * there + 4 * sway[:, 3])
        away = np.column_stack([172 - 45 * there, -45 + 20 * amount[4] * there])
        return head, RigidMotion.of_reference_point(time, turn, away + 3 * sway[:, 4:6], (0.0, 0.0))

    def scene(self) -> Scene:
        """Return a face and a package of the seed's own shape and colours."""
        rng = np.random.default_rng([self.seed, 2])
        head_motion, package_motion = self.motions()
        around = np.linspace(0, 2 * np.pi, 40, endpoint=False)
        ripple = sum(rng.normal(0, 2.5) * np.cos(k * around + rng.uniform(0, 6)) for k in (2, 3, 5))
        radius = HEAD_LEVEL_MM + ripple
        face = np.column_stack([30 + 1.1 * radius * np.cos(around), 1.2 * radius * np.sin(around)])
        skin: Colour = tuple(rng.uniform([0.45, 0.32, 0.25], [0.9, 0.72, 0.62]))
        depth = self.head_depth_mm
        head_marks = (
            self._sticker("ear", (0.0, 0.0), rng),
            self._sticker("nose", self.nose_mm, rng),
        )
        head = SceneBody(
            "head", head_motion, (ScenePolygon(face, skin, depth_mm=depth),), head_marks
        )
        package = SceneBody("package", package_motion, *self._package(rng))
        slide = np.column_stack([np.sin(4 * head_motion.time_s), np.cos(5 * head_motion.time_s)])
        jaw_motion = RigidMotion(
            head_motion.time_s, head_motion.angle_rad, head_motion.shift_mm + slide
        )
        jaw_marks = tuple(
            self._sticker(name, (x + rng.uniform(-4, 4), y + rng.uniform(-4, 4)), rng)
            for name, (x, y) in {"jaw_front": (70.0, -62.0), "jaw_back": (44.0, -60.0)}.items()
        )
        bodies = [head, SceneBody("jaw", jaw_motion, (), jaw_marks), package]
        if self.hand:
            bodies.append(self._hand(rng))
        return Scene(tuple(bodies), light=self.light)

    def _sticker(self, name: str, at: tuple[float, float], rng: np.random.Generator) -> Marker:
        """Return a square of paper with a dot or a ring in its middle."""
        depth, radius = self.head_depth_mm, self.dot_mm
        square = Marker.patch(
            name,
            at,
            side_mm=4.6 * radius if self.rings else 4 * radius,
            radius_mm=radius,
            depth_mm=depth,
            turn_deg=float(rng.uniform(0, 90)),
        )
        if not self.rings:
            return square
        ring = Marker.ring(name, at, radii_mm=(1.3 * radius, 0.65 * radius), depth_mm=depth)
        return Marker(name, at, (square.shapes[0], *ring.shapes), depth)

    def _package(
        self, rng: np.random.Generator
    ) -> tuple[tuple[ScenePolygon, ...], tuple[Marker, ...]]:
        """Return a bottle or a carton, with dark marks on light or light ones on dark."""
        light_marks = bool(rng.random() < 0.3) and not self.rings
        body: Colour = (0.12, 0.2, 0.42) if light_marks else (0.9, 0.92, 0.94)
        mark: Colour = (0.96, 0.96, 0.95) if light_marks else (0.05, 0.05, 0.06)
        shoulder = float(rng.uniform(30, 60))
        wide = shoulder * (1.0 if self.bottle else 0.5)
        upper = [[-14, 23], [30, 23], [60, 7 + wide], [160, 7 + wide]]
        lower = [[160, 7 - wide], [60, 7 - wide], [30, -9], [-14, -9]]
        outline = ScenePolygon(np.array([*upper, *lower], float), body)
        places = {"package_lower": (0.0, 0.0), "package_upper": (0.0, MARK_MM)}
        radius = 0.85 * self.dot_mm
        if self.rings:
            radii, colours = (1.15 * radius, 0.55 * radius), (mark, WHITE)
            marks = [
                Marker.ring(n, at, radii_mm=radii, colours=colours) for n, at in places.items()
            ]
        else:
            marks = [Marker.dot(n, at, radius_mm=radius, colour=mark) for n, at in places.items()]
        return (outline,), tuple(marks)

    def _hand(self, rng: np.random.Generator) -> SceneBody:
        """Return a hand that comes up before face and package, stays a while, and goes down."""
        rate, span = self.camera.fps, self.frames / self.camera.fps
        begin = float(rng.uniform(0.2, 0.35)) * span
        stays = (HIDDEN_FRAMES + 1) / rate
        time = np.linspace(-0.2, span + 0.5, 600)
        moves = 0.12
        up = _eased((time - begin) / moves) - _eased((time - begin - moves - stays) / moves)
        shift = np.column_stack([3 * np.sin(6 * time), -420 * (1 - up)])
        corners = np.array([[60, -95], [215, -95], [220, 45], [70, 45]], float)
        skin: Colour = tuple(rng.uniform([0.5, 0.35, 0.28], [0.8, 0.6, 0.5]))
        spots = tuple(
            Marker.dot(f"spot_{k}", at, radius_mm=2.2, colour=(0.2, 0.12, 0.1), depth_mm=80.0)
            for k, at in enumerate(HAND_SPOTS)
        )
        motion = RigidMotion(time, np.zeros(time.size), shift)
        return SceneBody("hand", motion, (ScenePolygon(corners, skin, depth_mm=80.0),), spots)

    def marker_file(self, first: Truth, *, head_scale: bool = True) -> str:
        """Return what a user would write who knows the lens and both lengths."""
        rng = np.random.default_rng([self.seed, 3])
        lens = self.camera.lens
        lines = ["[scale]", f"package = {MARK_MM}"]
        if head_scale:
            lines.append(f"head = {np.hypot(*self.nose_mm):.6f}")
        if lens.k1:
            lines += ["[lens]", *(f"f{axis} = {self.camera.focal_px[0]}" for axis in "xy")]
            lines += [f"k1 = {lens.k1}", f"k2 = {lens.k2}"]
        if self.rings:
            lines += ["[tracking]", 'polarity = "ring"']
        lines.append("[markers]")
        for name, marker in first.markers.items():
            if name.startswith("spot_"):
                continue
            x, y = np.array([marker.x_px, marker.y_px]) + rng.uniform(-CLICK_PX, CLICK_PX, 2)
            lines.append(f"{name} = [{x:.1f}, {y:.1f}]")
        return "\n".join(lines) + "\n"

    def write(self, folder: Path) -> tuple[Path, Path, list[Truth]]:
        """Write video and marker file; return both paths and the truth of every frame."""
        times = np.arange(self.frames) / self.camera.fps
        truths: list[Truth] = []

        def pictures() -> Iterator[Image]:
            for picture, truth in render(self.scene(), self.camera, self.sensor, times):
                truths.append(truth)
                yield picture

        video, markers = folder / "clip.mp4", folder / "markers.toml"
        write_recording(video, pictures(), times, crf=self.crf, preset="veryfast")
        markers.write_text(self.marker_file(truths[0]), encoding="utf-8")
        return video, markers, truths

    def __str__(self) -> str:
        """Return the settings in one line."""
        camera = self.camera
        scale = camera.pixels_per_mm()
        extra = ("hand " if self.hand else "     ") + ("rings" if self.rings else "     ")
        return (
            f"{self.seed:4d} {camera.width:4d}x{camera.height:<4d}{scale:5.2f} {camera.fps:4.0f} "
            f"{camera.lens.blur_px:5.2f} {camera.lens.k1:6.2f} {self.sensor.full_well_e:6.0f} "
            f"{1000 * camera.exposure_s:3.0f} {self.crf:4.0f} {self.head_depth_mm:4.0f} {extra}"
        )


HEADINGS = "seed size     px/mm  fps  blur     k1   well  ms  crf depth"


def relative_truth(truths: list[Truth]) -> tuple[Array, Array]:
    """Return the package's position (n, 2) mm and turn (n,) rad in the head frame."""
    start, places, turns = truths[0].placements, [], []
    origin = np.zeros(2)
    for truth in truths:
        head, package = truth.placements["head"], truth.placements["package"]
        head_turn = head.angle_rad - start["head"].angle_rad
        places.append(rotated(package.apply(origin) - head.apply(origin), -head_turn))
        turns.append(package.angle_rad - start["package"].angle_rad - head_turn)
    return np.array(places), np.array(turns)


def _eased(s: Array) -> Array:
    """Return a step from 0 to 1 without jumps of speed (minimum jerk)."""
    s = np.clip(s, 0, 1)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))
