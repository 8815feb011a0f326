"""Short drawn clips of a head and a package with known motion, varied by seed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.rigid import RigidMotion, rotated
from mocap.synthetic.camera import Camera, Lens, Sensor
from mocap.synthetic.recording_file import write_recording
from mocap.synthetic.rendering import exposed, truth_at
from mocap.synthetic.scene import Light, Marker, OutOfPlane, Scene, SceneBody, ScenePolygon
from mocap.synthetic.truth import Truth

Array = NDArray[np.float64]

EAR, NOSE = (0.0, 0.0), (102.0, 12.0)
JAW_FRONT, JAW_BACK = (70.0, -62.0), (48.0, -60.0)
LOWER, UPPER = (0.0, 0.0), (0.0, 14.0)
TREMOR_HZ = (7.0, 6.2)
SKIN = (0.80, 0.62, 0.52)


def trembling(time_s: Array) -> Array:
    """Return a tremor (n, 2) of amplitude one in x and y."""
    phase = 2 * np.pi * np.outer(time_s, TREMOR_HZ)
    return np.column_stack([np.sin(phase[:, 0]), np.cos(phase[:, 1])])


@dataclass(frozen=True)
class Clip:
    """How a clip is drawn; lengths in mm, px and s as the names say."""

    seed: int = 0
    width: int = 640
    height: int = 400
    px_per_mm: float = 1.9
    fps: float = 25.0
    frames: int = 50
    distance_mm: float = 1500.0
    head_depth_mm: float = 0.0
    full_well_e: float = np.inf
    exposure_s: float = 0.0
    blur_px: float = 0.6
    crf: float = 12.0
    lens: tuple[float, float] = (0.0, 0.0)
    light: Light = Light()  # noqa: RUF009
    dot_radius_mm: float = 2.5
    mark_colour: tuple[float, float, float] = (0.05, 0.05, 0.05)
    package_colour: tuple[float, float, float] = (0.92, 0.93, 0.95)
    occluded: tuple[float, float] | None = None
    uneven_times: bool = False
    jaw: bool = True
    stickers: tuple[str, ...] = ()
    tilt_deg: tuple[float, float] = (0.0, 0.0)
    faces_left: bool = False
    tremor_mm: float = 0.0

    @property
    def sides(self) -> Array:
        """Factors of x and y of everything in the plane; turns have that of x."""
        return np.array([-1.0 if self.faces_left else 1.0, 1.0])

    def times(self) -> Array:
        times = np.arange(self.frames) / self.fps
        if self.uneven_times:
            times = times + np.random.default_rng(self.seed).uniform(0, 0.3 / self.fps, times.size)
        return times

    def camera(self) -> Camera:
        focal = self.px_per_mm * self.distance_mm
        return Camera(
            self.width,
            self.height,
            (focal, focal),
            self.distance_mm,
            (80.0 * self.sides[0], -15.0),
            fps=self.fps,
            exposure_s=self.exposure_s,
            lens=Lens(k1=self.lens[0], k2=self.lens[1], blur_px=self.blur_px, vignetting=0.1),
        )

    def motions(self) -> tuple[RigidMotion, RigidMotion]:
        """Motions of head and package over the clip: an approach, a tilt, and back again."""
        rng = np.random.default_rng([self.seed, 7])
        span = self.frames / self.fps
        time = np.linspace(-0.1 * span - 0.1, 1.1 * span + 0.1, 2000 if self.tremor_mm else 400)
        s = np.clip(time / span, 0, 1)
        there = np.sin(np.pi * s) ** 2
        phase = rng.uniform(0, 2 * np.pi, 6)
        amount = rng.uniform(0.6, 1.4, 6)
        sway = np.array([np.sin(2 * np.pi * s * (1 + k % 2) + phase[k]) for k in range(6)])
        head_angle = np.radians(8 * amount[0] * there + 2 * sway[0])
        head_shift = np.column_stack([4 * amount[1] * sway[1], 3 * amount[2] * sway[2]])
        angle = np.radians(-45 * amount[3] * there + 4 * sway[3])
        lower = np.column_stack(
            [175 - 48 * there + 3 * sway[4], -45 + 22 * amount[4] * there + 3 * sway[5]]
        )
        lower = lower + self.tremor_mm * trembling(time)
        side = self.sides[0]
        head = RigidMotion(time, side * head_angle, head_shift * self.sides)
        package = RigidMotion.of_reference_point(time, side * angle, lower * self.sides, LOWER)
        return head, package

    def scene(self) -> Scene:
        head_motion, package_motion = self.motions()
        z = self.head_depth_mm
        profile = np.array(
            [[-70, 90], [60, 95], [92, 60], [90, 25], [118, 2], [100, -8], [104, -30], [98, -70],
             [60, -95], [0, -80], [-60, -60]]
        )  # fmt: skip
        dots = {"ear": EAR, "nose": NOSE}
        if self.jaw:
            dots |= {"jaw_front": JAW_FRONT, "jaw_back": JAW_BACK}
        dots = {name: (self.sides[0] * x, y) for name, (x, y) in dots.items()}
        patches = tuple(
            Marker.coded(name, at, side_mm=12.0, depth_mm=z, turn_deg=10.0 * k)
            if name in self.stickers
            else Marker.patch(name, at, radius_mm=self.dot_radius_mm, depth_mm=z, turn_deg=10.0 * k)
            for k, (name, at) in enumerate(dots.items())
        )
        head = SceneBody(
            "head",
            head_motion,
            (ScenePolygon(profile * self.sides, SKIN, depth_mm=z),),
            patches,
            self.out_of_plane(EAR, z),
        )
        neck = np.array([[-14, -13], [40, -13], [70, -40], [160, -40], [160, 55], [70, 55],
                         [40, 27], [-14, 27]])  # fmt: skip
        marks = tuple(
            Marker.coded(name, at, side_mm=10.0, turn_deg=-15.0)
            if name in self.stickers
            else Marker.dot(name, at, radius_mm=0.8 * self.dot_radius_mm, colour=self.mark_colour)
            for name, at in (("package_lower", LOWER), ("package_upper", UPPER))
        )
        package = SceneBody(
            "package",
            package_motion,
            (ScenePolygon(neck * self.sides, self.package_colour),),
            marks,
            self.out_of_plane(LOWER, 0.0),
        )
        bodies = [head, package]
        if self.occluded is not None:
            bodies.append(self._hand(*self.occluded))
        return Scene(tuple(bodies), light=self.light)

    def out_of_plane(self, pivot: tuple[float, float], height: float) -> OutOfPlane | None:
        """A tilt about x and y that comes and goes about a point of the body."""
        if not any(self.tilt_deg):
            return None
        span = self.frames / self.fps
        time = np.linspace(0, span, 200)
        there = np.sin(np.pi * time / span) ** 2
        turn = there[:, None] * np.array(self.tilt_deg)
        return OutOfPlane(time, turn, np.zeros(time.size), (*pivot, height))

    def _hand(self, start_s: float, end_s: float) -> SceneBody:
        """A hand that hides the package marks and the nose from one instant to another."""
        time = np.array([-1.0, start_s - 1e-3, start_s, end_s, end_s + 1e-3, 10.0])
        shift = np.array([[0, -400], [0, -400], [0, 0], [0, 0], [0, -400], [0, -400]], float)
        corners = np.array([[85, -90], [210, -90], [215, 40], [80, 40]], float)
        spots = tuple(
            Marker.dot(f"spot_{k}", at, radius_mm=2.2, colour=(0.25, 0.15, 0.1), depth_mm=80.0)
            for k, at in enumerate([(100.0, -20.0), (128.0, 8.0), (150.0, -40.0), (185.0, -30.0)])
        )
        motion = _Stepwise(time, np.zeros(time.size), shift)
        return SceneBody(
            "hand", motion, (ScenePolygon(corners, (0.7, 0.5, 0.42), depth_mm=80.0),), spots
        )

    def write(self, folder: Path) -> tuple[Path, Path, list[Truth]]:
        """Write recording and marker file; return both paths and the truth of every frame."""
        scene, camera = self.scene(), self.camera()
        sensor = Sensor(
            full_well_e=self.full_well_e,
            read_noise_e=0.0 if np.isinf(self.full_well_e) else 6.0,
            seed=self.seed,
        )
        times = self.times()
        truths = [truth_at(scene, camera, float(t), k) for k, t in enumerate(times)]
        frames = (
            sensor.read_out(exposed(scene, camera, sensor, float(t)), k)
            for k, t in enumerate(times)
        )
        folder.mkdir(parents=True, exist_ok=True)
        video, markers = folder / "clip.mp4", folder / "markers.toml"
        write_recording(video, frames, times, crf=self.crf, preset="veryfast")
        markers.write_text(self.marker_file(truths[0]), encoding="utf-8")
        return video, markers, truths

    def marker_file(self, first: Truth, *, head_scale: bool = True, positions: bool = True) -> str:
        rng = np.random.default_rng([self.seed, 3])
        lines = ["[scale]", "package = 14.0"]
        if head_scale:
            lines.append(f"head = {np.hypot(*np.subtract(NOSE, EAR)):.6f}")
        if any(self.lens):
            focal = self.px_per_mm * self.distance_mm
            lines += ["[lens]", f"fx = {focal}", f"fy = {focal}"]
            lines += [f"k1 = {self.lens[0]}", f"k2 = {self.lens[1]}"]
        lines.append("[markers]")
        for name, marker in first.markers.items():
            if name.startswith("spot_"):
                continue
            x, y = np.array([marker.x_px, marker.y_px]) + rng.uniform(-5, 5, 2)
            if positions:
                lines.append(f"{name} = [{x:.1f}, {y:.1f}]")
            elif name.startswith("jaw"):
                lines.append(f'{name} = "auto"')
        lines += ["[recording]", "rendered = true"]
        return "\n".join(lines) + "\n"

    def relative_truth(self, truths: list[Truth]) -> tuple[Array, Array]:
        """Return the package's position (n, 2) mm and turn (n,) rad in the head frame.

        A person who faces left is mirrored.
        """
        places, turns = [], []
        start = truths[0].placements
        for truth in truths:
            head, package = truth.placements["head"], truth.placements["package"]
            apart = package.apply(LOWER) - head.apply(EAR)
            head_turn = head.angle_rad - start["head"].angle_rad
            places.append(rotated(apart, -head_turn))
            turns.append(package.angle_rad - start["package"].angle_rad - head_turn)
        return np.array(places) * self.sides, np.array(turns) * self.sides[0]


@dataclass(frozen=True)
class _Stepwise(RigidMotion):
    """A motion that jumps between its samples instead of passing smoothly."""

    def at(self, time_s: float):  # type: ignore[no-untyped-def]
        from geometry2d.rigid import RigidPlacement

        k = int(np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, None))
        return RigidPlacement(float(self.angle_rad[k]), tuple(self.shift_mm[k]))
