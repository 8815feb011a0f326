"""Marks that turn out of the plane told from marks that move in depth, on drawn clips."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from geometry2d.rigid import RigidMotion, RigidPlacement
from mocap.measurement import Measurement, measure
from mocap.motion.projection import PictureFormat
from mocap.motion.turning import Cause, Flattening, flattening
from mocap.synthetic.scene import Scene, SceneBody
from mocap.tracking.follow import follow
from mocap.tracking.marker_file import read_markers
from mocap.tracking.noise import with_temporal_noise
from mocap.video.frames import Video
from mocap.views.summary import summary
from tests.support.clips import Clip

Array = NDArray[np.float64]
AIM = np.array([80.0, -15.0])
# The axis of the neck lies midway between the marks.
AXIS_MM = 7.0


@dataclass(frozen=True)
class Tilted(RigidPlacement):
    """A placement of a flat body that is turned out of the plane or nearer than drawn."""

    flattened: float = 1.0
    enlarged: float = 1.0

    def apply(self, points: ArrayLike) -> Array:
        flat = np.asarray(points, float) * [1.0, self.flattened]
        flat[..., 1] += AXIS_MM * (1 - self.flattened)
        return np.asarray((super().apply(flat) - AIM) * self.enlarged + AIM)


@dataclass(frozen=True)
class Tilting(RigidMotion):
    """A motion that turns out of the plane (deg) or grows (share) with time."""

    turn_deg: Callable[[float], float] = lambda _: 0.0
    growth: Callable[[float], float] = lambda _: 0.0

    def at(self, time_s: float) -> Tilted:
        flat = super().at(time_s)
        shortened = float(np.cos(np.radians(self.turn_deg(time_s))))
        return Tilted(flat.angle_rad, flat.shift_mm, shortened, 1 + self.growth(time_s))


@dataclass(frozen=True)
class TiltingClip(Clip):
    turn_deg: Callable[[float], float] = lambda _: 0.0
    growth: Callable[[float], float] = lambda _: 0.0

    def scene(self) -> Scene:
        scene = super().scene()
        bodies = []
        for body in scene.bodies:
            motion = body.motion
            if body.name == "package":
                motion = Tilting(
                    motion.time_s, motion.angle_rad, motion.shift_mm, self.turn_deg, self.growth
                )
            bodies.append(SceneBody(body.name, motion, body.shapes, body.markers))
        return Scene(tuple(bodies), light=scene.light)


def for_a_while(most: float, start: float, end: float) -> Callable[[float], float]:
    return lambda t: most * float(np.sin(np.pi * np.clip((t - start) / (end - start), 0, 1)) ** 2)


def measured(folder: Path, **changes: Callable[[float], float]) -> tuple[Measurement, str, Array]:
    """Return the measurement, the warnings, and the true relative positions."""
    clip = TiltingClip(
        3,
        640,
        400,
        1.9,
        frames=40,
        full_well_e=4000,
        crf=20,
        exposure_s=0.004,
        jaw=False,
        **changes,
    )
    video, markers, truths = clip.write(folder)
    file, film = read_markers(markers), Video(video)
    tracks = with_temporal_noise(
        follow(film, file), bodies=file.rigid_bodies, key_frames=film.key_frames
    ).interpolated()
    picture = PictureFormat(clip.width, clip.height)
    found = measure(tracks, file, picture)
    report = summary(film.info, film.timing, file, found, picture)
    about = " ".join(line for line in report["warnings"] if line.startswith("package:"))
    return found, about, clip.relative_truth(truths)[0]


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.slow
def test_a_package_that_turns_out_of_the_plane_for_a_moment(tmp_path: Path) -> None:
    found, about, place = measured(tmp_path, turn_deg=for_a_while(25, 0.4, 1.2))
    scale = found.scales["package"]
    assert scale.change == 0
    assert scale.px_per_mm[0] == pytest.approx(1.9, rel=0.01)
    # 2 % are 11.5 degrees; three standard errors of the distance are as much again.
    turned = [for_a_while(25, 0.4, 1.2)(k / 25) for k in range(40)]
    assert set(np.flatnonzero(np.array(turned) > 20)) <= set(scale.foreshortened)
    assert max(turned[k] for k in range(40) if k not in scale.foreshortened) < 21
    assert min(turned[k] for k in scale.foreshortened) > 10
    assert scale.flattening.cause is Cause.TURNING
    assert "too close together" in about and "rotation out of the plane" in about
    assert rms(found.motion.relative_mm - place) < 0.3


@pytest.mark.slow
def test_a_small_turn_is_too_little_to_decide(tmp_path: Path) -> None:
    """12 degrees shorten by 2.2 %, about as much as the marks' shapes are uncertain."""
    found, _, _ = measured(tmp_path, turn_deg=for_a_while(12, 0.4, 1.2))
    told = found.scales["package"].flattening
    assert told.cause is Cause.UNKNOWN
    assert told.share == pytest.approx(1.0, abs=3 * told.sigma)
    assert 0.1 < told.sigma < 0.4


@pytest.mark.slow
def test_a_package_that_turns_slowly_is_not_followed_as_depth(tmp_path: Path) -> None:
    """Followed, 25° would be taken for a tenth of the distance and displace it by centimetres."""
    found, about, place = measured(tmp_path, turn_deg=lambda t: 25 * t / 1.6)
    scale = found.scales["package"]
    assert scale.flattening.share == pytest.approx(1.0, abs=3 * scale.flattening.sigma)
    assert scale.change == 0
    assert scale.px_per_mm[-1] == pytest.approx(1.9, rel=0.015)
    assert len(scale.foreshortened) > 12
    assert "rotation out of the plane" in about
    assert rms(found.motion.relative_mm - place) < 1.0


@pytest.mark.slow
def test_a_package_that_comes_nearer_for_a_moment_is_not_said_to_turn(tmp_path: Path) -> None:
    growth = for_a_while(0.06, 0.4, 1.2)
    found, about, _ = measured(tmp_path, growth=growth)
    scale = found.scales["package"]
    assert scale.flattening.cause is Cause.DEPTH
    assert not scale.enlarged and not scale.foreshortened and not scale.tilt_rad.size
    true = 1.9 * np.array([1 + growth(k / 25) for k in range(40)])
    np.testing.assert_allclose(scale.px_per_mm, true, rtol=0.012)
    assert "followed as depth" in about and "motion in depth" in about


@pytest.mark.slow
def test_a_package_that_comes_nearer_slowly_is_followed(tmp_path: Path) -> None:
    found, about, _ = measured(tmp_path, growth=lambda t: 0.08 * t / 1.6)
    scale = found.scales["package"]
    assert scale.change == pytest.approx(0.08, abs=0.012)
    assert scale.px_per_mm[-1] / scale.px_per_mm[0] == pytest.approx(1.08, abs=0.012)
    assert scale.flattening.cause is not Cause.TURNING
    assert "followed as depth" in about


@pytest.mark.slow
def test_a_package_that_stays_in_its_plane_is_not_accused(tmp_path: Path) -> None:
    found, about, _ = measured(tmp_path)
    assert about == ""
    assert found.scales["package"].flattening.cause is Cause.UNKNOWN


def dots(line: Array, shortened: Array, grown: Array, tilt: Array) -> tuple[Array, Array]:
    """Positions and ellipses of two dots of radius 5 px whose line has a direction (rad)."""
    direction = np.column_stack([np.cos(tilt), np.sin(tilt)])
    positions = np.stack([0 * direction, line[:, None] * direction], axis=1)
    along = np.einsum("ni,nj->nij", direction, direction)
    g = along / (5 * grown * shortened)[:, None, None]
    g = g + (np.eye(2) - along) / (5 * grown)[:, None, None]
    entries = np.stack([g[:, 0, 0], g[:, 0, 1], g[:, 1, 1]], axis=-1)
    return positions, np.stack([entries, entries], axis=1)


@pytest.mark.parametrize(
    ("turning", "share", "cause"), [(True, 1.0, Cause.TURNING), (False, 0.0, Cause.DEPTH)]
)
def test_the_share_is_exact_without_noise(turning: bool, share: float, cause: Cause) -> None:
    time = np.arange(30) / 25
    change = 1 - 0.08 * np.sin(3 * time) ** 2
    one = np.ones(30)
    shortened, grown = (change, one) if turning else (one, change)
    positions, ellipses = dots(40 * change, shortened, grown, 0.3 + time)
    found = flattening(time, positions, ellipses)
    assert found.share == pytest.approx(share, abs=1e-6)
    assert found.cause is cause


def test_too_few_frames_or_no_shapes_tell_nothing() -> None:
    assert Flattening(np.nan, np.nan).cause is Cause.UNKNOWN
    time = np.arange(30) / 25
    positions, ellipses = dots(40 + time, 1 + 0 * time, 1 + 0 * time, time)
    assert flattening(time[:5], positions[:5], ellipses[:5]).cause is Cause.UNKNOWN
    assert np.isnan(flattening(time, positions, np.full_like(ellipses, np.nan)).share)
