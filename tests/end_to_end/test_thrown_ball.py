"""A ball thrown before a wall with two marks, drawn by a camera that drifts: its fall is known."""

from __future__ import annotations

import numpy as np
import pytest

from geometry2d.rigid import RigidMotion
from mocap.convert import ConvertResult, convert
from mocap.synthetic.camera import Camera, Sensor
from mocap.synthetic.recording_file import write_recording
from mocap.synthetic.rendering import exposed, truth_at
from mocap.synthetic.scene import Marker, Scene, SceneBody, ScenePolygon

pytestmark = pytest.mark.slow

GRAVITY_MM_PER_S2 = 9810.0
FPS, FRAMES = 60.0, 46
LEFT, RIGHT = (-400.0, 300.0), (400.0, 300.0)
START, VELOCITY = (-350.0, -350.0), (800.0, 3600.0)
DRIFT_MM = (25.0, 15.0)
"""How far the picture moves over the wall while it is filmed."""


def fall(time_s: np.ndarray) -> np.ndarray:
    """Return places of the ball (n, 2), mm, in front of the wall."""
    x, y = (np.outer(time_s, VELOCITY) + START).T
    return np.column_stack([x, y - 0.5 * GRAVITY_MM_PER_S2 * time_s**2])


def scene() -> Scene:
    time = np.linspace(-0.1, 1.0, 300)
    drift = np.outer(np.sin(2 * time), DRIFT_MM)
    still = np.zeros(time.size)
    square = np.array([[-900, -900], [900, -900], [900, 900], [-900, 900]], float)
    light = (0.95, 0.95, 0.9)
    wall = SceneBody(
        "wall",
        RigidMotion(time, still, drift),
        (ScenePolygon(square, (0.3, 0.32, 0.35)),),
        (
            Marker.dot("left_mark", LEFT, radius_mm=14.0, colour=light),
            Marker.dot("right_mark", RIGHT, radius_mm=14.0, colour=light),
        ),
    )
    marks = (Marker.dot("ball", (0.0, 0.0), radius_mm=18.0, colour=light),)
    return Scene((wall, SceneBody("ball", RigidMotion(time, still, fall(time) + drift), (), marks)))


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> ConvertResult:
    folder = tmp_path_factory.mktemp("ball")
    camera = Camera(400, 480, (800.0, 800.0), 2000.0, (0.0, 0.0), fps=FPS)
    times, sensor = np.arange(FRAMES) / FPS, Sensor(full_well_e=20000.0, read_noise_e=6.0, seed=1)
    drawn = scene()
    frames = (
        sensor.read_out(exposed(drawn, camera, sensor, float(t)), k) for k, t in enumerate(times)
    )
    write_recording(folder / "ball.mp4", frames, times)
    first = truth_at(drawn, camera, 0.0, 0).markers
    places = "\n".join(f"{name} = [{m.x_px:.0f}, {m.y_px:.0f}]" for name, m in first.items())
    (folder / "markers.toml").write_text(
        f"""[scale]
wall = {RIGHT[0] - LEFT[0]}
[markers]
{places}
[bodies]
wall = ["left_mark", "right_mark"]
ball = ["ball"]
moving = "ball"
reference = "wall"
[tracking]
polarity = "light"
""",
        encoding="utf-8",
    )
    return convert(folder / "ball.mp4", folder / "markers.toml")


def test_the_ball_falls_as_it_was_thrown(ball: ConvertResult) -> None:
    """A pixel is 2.5 mm wide."""
    time = ball.motion.time_s
    np.testing.assert_allclose(time, np.arange(FRAMES) / FPS, atol=1e-4)
    truth = fall(time) - LEFT
    error = ball.motion.relative_mm - truth
    assert np.sqrt(np.mean(error**2)) < 0.25
    parabola = np.polyfit(time, ball.motion.relative_mm[:, 1], 2)
    assert -2 * parabola[0] == pytest.approx(GRAVITY_MM_PER_S2, rel=0.002)


def test_marks_on_the_wall_are_followed_while_the_camera_drifts(ball: ConvertResult) -> None:
    left, _ = ball.tracks.of("left_mark")
    right, _ = ball.tracks.of("right_mark")
    assert np.ptp(left, axis=0).max() > 4.0
    assert np.abs(np.hypot(*(right - left).T) - 320.0).max() < 0.2


def test_a_body_of_one_marker_does_not_turn(ball: ConvertResult) -> None:
    assert np.all(ball.motion.package.angle_rad == 0)
    assert any("one marker" in warning for warning in ball.summary["warnings"])
