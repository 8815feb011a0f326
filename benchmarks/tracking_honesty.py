"""Whether stated errors are true: drawn clips, their errors over the stated standard errors.

Run with ``python -m benchmarks.tracking_honesty [CLIPS] [FIRST_SEED]`` (30 clips, about four
minutes of one core). Each seed draws its own person, package, motion, camera, light, noise and
compression; none is the bundled recording's. Of honest normal errors 0.683 lie within one standard
error and 0.954 within two. Pixels are independent from frame to frame; the scale and the smoothing
make a clip's motion errors go together, so that the clip, not the frame, is what is counted there.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.rigid import RigidMotion, rotated
from mocap.convert import Measurement, measure
from mocap.follow import follow
from mocap.markers import read_markers
from mocap.noise import with_noise_in_time
from mocap.scale import Picture
from mocap.synthetic import (
    Body,
    Camera,
    Colour,
    Lens,
    Light,
    Marker,
    Scene,
    Sensor,
    Shape,
    Truth,
    render,
    write_recording,
)
from mocap.video import Video

Array = NDArray[np.float64]

CLIPS = 30
SIZES = ((640, 400), (560, 420), (480, 360), (400, 600), (720, 404))
RATES = (24.0, 25.0, 30.0, 50.0)
MARK_MM = 14.0
HEAD_LEVEL_MM = 75.0
# Ear and nose are pasted on by hand and clicked: the start is off by as much, px.
CLICK_PX = 4.0


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

    @classmethod
    def of(cls, seed: int) -> Take:
        """Return the clip of a seed."""
        rng = np.random.default_rng([seed, 0])
        width, height = SIZES[seed % len(SIZES)]
        rate = RATES[seed % len(RATES)]
        distance = float(rng.uniform(1100, 2200))
        focal = distance * min(width, height) / float(rng.uniform(240, 300))
        bend = float(rng.uniform(-0.2, 0.05)) if seed % 3 == 2 else 0.0
        lens = Lens(k1=bend, k2=-0.3 * bend, blur_px=float(rng.uniform(0.4, 0.9)), vignetting=0.1)
        exposure = float(rng.choice([0.0, 0.004, 0.01]))
        wells = float(rng.choice([2500.0, 5000.0, 10000.0]))
        return cls(
            seed=seed,
            camera=Camera(
                width,
                height,
                (focal, focal),
                distance,
                (75.0, -20.0),
                fps=rate,
                exposure_s=min(exposure, 1 / rate),
                lens=lens,
            ),
            sensor=Sensor(full_well_e=wells, read_noise_e=8.0, seed=seed),
            light=Light(
                slope=(float(rng.uniform(-0.3, 0.3)), float(rng.uniform(-0.3, 0.3))),
                flicker=float(rng.choice([0.0, 0.03])),
            ),
            crf=float(rng.choice([12.0, 18.0, 23.0])),
            frames=int(1.6 * rate),
            head_depth_mm=float(rng.uniform(0, 80)) if seed % 2 else 0.0,
            nose_mm=(float(rng.uniform(90, 115)), float(rng.uniform(-10, 20))),
            dot_mm=float(rng.uniform(2.2, 3.0)),
            bottle=bool(rng.random() < 0.5),
        )

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
        places = {"ear": (0.0, 0.0), "nose": self.nose_mm}
        patches = tuple(
            Marker.patch(
                name,
                at,
                side_mm=4 * self.dot_mm,
                radius_mm=self.dot_mm,
                depth_mm=depth,
                turn_deg=float(rng.uniform(0, 90)),
            )
            for name, at in places.items()
        )
        head = Body("head", head_motion, (Shape(face, skin, depth_mm=depth),), patches)
        return Scene((head, Body("package", package_motion, *self._package(rng))), light=self.light)

    def _package(self, rng: np.random.Generator) -> tuple[tuple[Shape, ...], tuple[Marker, ...]]:
        """Return a bottle or a carton, with dark marks on light or light ones on dark."""
        light_marks = bool(rng.random() < 0.3)
        body: Colour = (0.12, 0.2, 0.42) if light_marks else (0.9, 0.92, 0.94)
        mark: Colour = (0.96, 0.96, 0.95) if light_marks else (0.05, 0.05, 0.06)
        shoulder = float(rng.uniform(30, 60))
        wide = shoulder * (1.0 if self.bottle else 0.5)
        upper = [[-14, 23], [30, 23], [60, 7 + wide], [160, 7 + wide]]
        lower = [[160, 7 - wide], [60, 7 - wide], [30, -9], [-14, -9]]
        outline = Shape(np.array([*upper, *lower], float), body)
        marks = {"package_lower": (0.0, 0.0), "package_upper": (0.0, MARK_MM)}
        radius = 0.85 * self.dot_mm
        dots = (Marker.dot(n, at, radius_mm=radius, colour=mark) for n, at in marks.items())
        return (outline,), tuple(dots)

    def marker_file(self, first: Truth) -> str:
        """Return what a user would write who knows the lens and both lengths."""
        rng = np.random.default_rng([self.seed, 3])
        lens = self.camera.lens
        lines = ["[scale]", f"package = {MARK_MM}", f"head = {np.hypot(*self.nose_mm):.6f}"]
        if lens.k1:
            lines += ["[lens]", *(f"f{axis} = {self.camera.focal_px[0]}" for axis in "xy")]
            lines += [f"k1 = {lens.k1}", f"k2 = {lens.k2}"]
        lines.append("[markers]")
        for name, marker in first.markers.items():
            x, y = np.array([marker.x_px, marker.y_px]) + rng.uniform(-CLICK_PX, CLICK_PX, 2)
            lines.append(f"{name} = [{x:.1f}, {y:.1f}]")
        return "\n".join(lines) + "\n"

    def tracked(self, folder: Path) -> tuple[Measurement, list[Truth]]:
        """Draw the clip into a folder and measure it; return that and the truth."""
        times = np.arange(self.frames) / self.camera.fps
        frames, truths = zip(*render(self.scene(), self.camera, self.sensor, times), strict=True)
        video, markers = folder / "clip.mp4", folder / "markers.toml"
        write_recording(video, frames, times, crf=self.crf, preset="veryfast")
        markers.write_text(self.marker_file(truths[0]), encoding="utf-8")
        file = read_markers(markers)
        film = Video(video)
        raw = follow(film, file)
        tracks = with_noise_in_time(raw, key_frames=film.key_frames).bridged()
        picture = Picture(self.camera.width, self.camera.height)
        return measure(tracks, file, picture), list(truths)

    def __str__(self) -> str:
        """Return the settings in one line."""
        camera = self.camera
        scale = camera.pixels_per_mm()
        return (
            f"{self.seed:4d} {camera.width:4d}x{camera.height:<4d}{scale:5.2f} {camera.fps:4.0f} "
            f"{camera.lens.blur_px:5.2f} {camera.lens.k1:6.2f} {self.sensor.full_well_e:6.0f} "
            f"{1000 * camera.exposure_s:3.0f} {self.crf:4.0f} {self.head_depth_mm:4.0f}"
        )


HEADINGS = "seed size     px/mm fps  blur     k1   well  ms  crf depth"


def errors(measured: Measurement, truths: list[Truth]) -> dict[str, tuple[Array, Array]]:
    """Return true errors and stated standard errors, flat arrays, by quantity (px, mm, rad)."""
    tracks, motion = measured.tracks, measured.motion
    seen = tracks.status == "seen"
    right = np.array(
        [[(t.markers[n].x_px, t.markers[n].y_px) for n in tracks.names] for t in truths]
    )
    off = (tracks.position_px - right)[seen]
    pixel_sigma = np.repeat(tracks.sigma_px[seen], 2)
    start, places, turns = truths[0].placements, [], []
    for truth in truths:
        head, package = truth.placements["head"], truth.placements["package"]
        head_turn = head.angle_rad - start["head"].angle_rad
        origin = np.zeros(2)
        places.append(rotated(package.apply(origin) - head.apply(origin), -head_turn))
        turns.append(package.angle_rad - start["package"].angle_rad - head_turn)
    wrong = motion.relative_mm - np.array(places)
    return {
        "pixels": (off.ravel(), pixel_sigma),
        "x": (wrong[:, 0], motion.sigma[:, 0]),
        "y": (wrong[:, 1], motion.sigma[:, 1]),
        # The first frame's angle is zero by definition.
        "theta": ((motion.relative_rad - np.array(turns))[1:], motion.sigma[1:, 2]),
    }


def main() -> None:
    """Print each clip's RMS errors over the stated ones, then the fractions over all clips."""
    clips = int(sys.argv[1]) if len(sys.argv) > 1 else CLIPS
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    scores: dict[str, list[Array]] = {}
    print(f"{HEADINGS} | RMS px | RMS of error/stated: px x y theta")
    for seed in range(first, first + clips):
        take = Take.of(seed)
        with tempfile.TemporaryDirectory() as folder:
            found = errors(*take.tracked(Path(folder)))
        for name, (error, sigma) in found.items():
            scores.setdefault(name, []).append(error / sigma)
        ratios = " ".join(f"{np.sqrt(np.mean(s[-1] ** 2)):5.2f}" for s in scores.values())
        rms_px = np.sqrt(np.mean(found["pixels"][0] ** 2))
        print(f"{take} | {rms_px:.3f} | {ratios}", flush=True)
    print("\nquantity | within 1 sigma | within 2 sigma | samples")
    for name, parts in scores.items():
        score = np.abs(np.concatenate(parts))
        print(f"{name:8} | {np.mean(score < 1):.3f} | {np.mean(score < 2):.3f} | {score.size}")


if __name__ == "__main__":
    main()
