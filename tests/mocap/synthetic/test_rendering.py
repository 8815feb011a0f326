"""The virtual camera: its truth must be truer than any tracker that is judged by it."""

from __future__ import annotations

import os
import subprocess
import sys

import cv2
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry2d.rigid import RigidMotion
from mocap.synthetic.camera import Camera, Lens, Sensor, SyntheticError
from mocap.synthetic.raster import coverage
from mocap.synthetic.recording_file import frame_times, write_recording
from mocap.synthetic.rendering import exposed, render, truth_at
from mocap.synthetic.scene import BLACK, WHITE, Light, Marker, Scene, SceneBody, ScenePolygon
from mocap.synthetic.truth import write_truth

LENS = Lens(k1=-0.21, k2=0.07, p1=1.2e-3, p2=-0.8e-3, k3=0.02)
CAMERA = Camera(160, 120, (900.0, 880.0), 300.0, (3.0, -2.0))


def resting(at=(0.0, 0.0), angle=0.0) -> RigidMotion:
    return RigidMotion(np.array([0.0]), np.array([angle]), np.array([at]))


def flying(velocity, *, until=1.0) -> RigidMotion:
    time = np.linspace(-until, until, 9)
    return RigidMotion(time, 0 * time, time[:, None] * np.asarray(velocity))


def centroid(image, background):
    """Centroid x, y of what differs from the background."""
    weight = np.asarray(image, float) - background
    rows, columns = np.indices(weight.shape)
    return np.array([(weight * columns).sum(), (weight * rows).sum()]) / weight.sum()


@given(
    x=st.floats(-1.0, 7.0),
    y=st.floats(-1.0, 6.0),
    angle=st.floats(0, 6.3),
    width=st.floats(0.05, 5.0),
)
@settings(max_examples=40, deadline=None)
def test_coverage_is_the_area_shared_by_polygon_and_pixel(x, y, angle, width):
    half = np.array([[-1.0, -1], [1, -1], [0.2, 0], [1, 1], [-1, 1]]) * [width / 2, 0.7]
    c, s = np.cos(angle), np.sin(angle)
    corners = half @ [[c, s], [-s, c]] + [x, y]
    polygon = shapely.Polygon(corners)
    expected = [
        [
            polygon.intersection(shapely.box(i - 0.5, j - 0.5, i + 0.5, j + 0.5)).area
            for i in range(7)
        ]
        for j in range(6)
    ]
    assert coverage(corners, (6, 7)) == pytest.approx(np.array(expected), abs=1e-9)


def test_coverage_of_a_pixel_cut_by_a_diagonal_is_known():
    triangle = np.array([[-0.5, -0.5], [1.5, -0.5], [-0.5, 1.5]])
    assert coverage(triangle, (2, 2)).tolist() == [[1.0, 0.5], [0.5, 0.0]]


def test_coverage_is_cut_at_the_picture_and_ignores_orientation():
    square = np.array([[-7.0, -9], [40, -9], [40, 50], [-7, 50]])
    assert (coverage(square, (6, 5)) == 1).all()
    assert (coverage(square[::-1] - [60, 0], (6, 5)) == 0).all()


@given(st.lists(st.floats(-0.4, 0.4), min_size=2, max_size=2))
def test_distortion_is_that_of_opencv(point):
    ideal = np.array([[*point, 1.0]])
    coefficients = np.array([LENS.k1, LENS.k2, LENS.p1, LENS.p2, LENS.k3])
    expected, _ = cv2.projectPoints(ideal, np.zeros(3), np.zeros(3), np.eye(3), coefficients)
    assert LENS.distorted(point) == pytest.approx(expected.ravel(), abs=1e-14)


def test_projection_is_that_of_opencv_for_a_turned_camera():
    camera = Camera(
        640, 480, (1500.0, 1450.0), 900.0, (30.0, -20.0), turn_deg=(4.0, -9.0, 2.0), lens=LENS
    )
    rng = np.random.default_rng(4)
    points, depth = rng.uniform(-120, 120, (40, 2)), rng.uniform(-60, 80, 40)
    rotation = cv2.Rodrigues(np.radians(camera.turn_deg))[0] @ np.diag([1.0, -1, -1])
    world = np.column_stack([points, depth]) - [*camera.aim_mm, 0.0]
    coefficients = np.array([LENS.k1, LENS.k2, LENS.p1, LENS.p2, LENS.k3])
    expected, _ = cv2.projectPoints(
        world,
        cv2.Rodrigues(rotation)[0],
        np.array([0.0, 0, camera.distance_mm]),
        camera.matrix,
        coefficients,
    )
    assert camera.project(points, depth) == pytest.approx(expected[:, 0], abs=1e-9)


def test_nearer_bodies_look_larger_and_up_is_up():
    low, high = CAMERA.project([[3.0, -2.0], [4.0, 3.0]])
    assert low == pytest.approx([79.5, 59.5])
    assert high[0] > low[0] and high[1] < low[1]
    near = CAMERA.project([4.0, 3.0], 100.0) - low
    assert near == pytest.approx(1.5 * (high - low))


@pytest.mark.parametrize("phase", [(0.0, 0.0), (0.31, 0.77), (0.5, 0.5), (0.93, 0.12)])
@pytest.mark.parametrize("depth", [0.0, 40.0])
def test_a_dot_is_drawn_where_the_truth_says(phase, depth):
    at = np.array([5.0, 3.0]) + np.array(phase) / 3
    dot = Marker.dot("m", (0.0, 0.0), radius_mm=1.7, depth_mm=depth)
    scene = Scene((SceneBody("b", resting(at), markers=(dot,)),), background=WHITE)
    camera = Camera(160, 120, (900.0, 880.0), 300.0, (3.0, -2.0), lens=Lens(k1=-0.1, blur_px=0.8))
    sensor = Sensor(gamma=1.0)
    truth = truth_at(scene, camera, 0.0, 0).markers["m"]
    light = exposed(scene, camera, sensor, 0.0)[..., 1]
    assert centroid(light, light[0, 0]) == pytest.approx([truth.x_px, truth.y_px], abs=3e-3)
    frame, _ = next(render(scene, camera, sensor, [0.0]))
    assert centroid(frame[..., 1], frame[0, 0, 1]) == pytest.approx(
        [truth.x_px, truth.y_px], abs=0.01
    )


def test_display_gamma_moves_a_dot_by_less_than_a_hundredth_of_a_pixel():
    errors = []
    for phase in np.linspace(0, 1, 7):
        dot = Marker.dot("m", (0.0, 0.0), radius_mm=1.7)
        scene = Scene((SceneBody("b", resting((5 + phase / 3, 3.0)), markers=(dot,)),), WHITE)
        camera = Camera(160, 120, (900.0, 900.0), 300.0, (3.0, -2.0), lens=Lens(blur_px=0.7))
        frame, truth = next(render(scene, camera, Sensor(), [0.0]))
        found = centroid(frame[..., 0], frame[0, 0, 0])
        errors.append(found - [truth.markers["m"].x_px, truth.markers["m"].y_px])
    assert np.abs(errors).max() < 0.01


def test_a_moving_dot_is_smeared_by_speed_times_exposure():
    """Variance along the motion grows by (v T)²/12, across it not at all; the centroid stays."""
    speed, exposure = 240.0, 0.02
    dot = Marker.dot("m", (0.0, 0.0), radius_mm=1.5)

    def moments(exposure_s):
        camera = Camera(160, 120, (900.0, 900.0), 300.0, (0.0, 0.0), exposure_s=exposure_s)
        scene = Scene((SceneBody("b", flying((speed, 0.0)), markers=(dot,)),), WHITE)
        light = exposed(scene, camera, Sensor(gamma=1.0), 0.011)[..., 0].astype(float)
        weight = light[0, 0] - light
        centre = centroid(light, light[0, 0])
        rows, columns = np.indices(weight.shape)
        spread = [
            (weight * (index - c) ** 2).sum() / weight.sum()
            for index, c in ((columns, centre[0]), (rows, centre[1]))
        ]
        true = truth_at(scene, camera, 0.011, 0).markers["m"]
        return np.array(spread), centre - [true.x_px, true.y_px]

    still, _ = moments(0.0)
    moved, offset = moments(exposure)
    length = speed * exposure * 3.0
    assert moved[0] - still[0] == pytest.approx(length**2 / 12, rel=0.01)
    assert moved[1] == pytest.approx(still[1], rel=1e-4)
    assert np.abs(offset).max() < 1e-3


@pytest.mark.parametrize("level", [0.2, 0.5])
def test_noise_has_the_stated_size(level):
    """Linear sensor: variance = N + read² electrons, plus 1/12 grey level² of rounding."""
    sensor = Sensor(full_well_e=8000.0, read_noise_e=12.0, gamma=1.0, seed=3)
    scene = Scene((), background=(level, level, level))
    frame, _ = next(render(scene, CAMERA, sensor, [0.0]))
    electrons = 8000 * float(sensor.linear((level,) * 3)[0])
    expected = (electrons + 12.0**2) * (255 / 8000) ** 2 + 1 / 12
    assert np.var(frame) == pytest.approx(expected, rel=0.03)
    assert np.mean(frame) == pytest.approx(255 * level, abs=0.05)


def scene_with_everything() -> Scene:
    square = np.array([[-20.0, -20], [20, -20], [20, 20], [-20, 20]])
    body = SceneBody(
        "head",
        flying((60.0, -20.0)),
        (
            ScenePolygon(square, (0.8, 0.6, 0.5), name="skin"),
            ScenePolygon(square * 0.6 + 9, (0.5, 0.3, 0.2), 0.5, softness_mm=3.0, inside="skin"),
        ),
        (
            Marker.patch("a", (-9.0, 3.0), turn_deg=8),
            Marker.ring("b", (6.0, -8.0), radii_mm=(3, 1)),
        ),
    )
    bar = SceneBody("bar", resting((-9.0, 3.0)), (ScenePolygon(square / 8, (0.1, 0.1, 0.4)),))
    return Scene((body, bar), light=Light(slope=(0.2, -0.1), flicker=0.02, flicker_hz=9.0))


def test_same_seed_same_bytes_and_other_seed_other_noise(tmp_path):
    camera = Camera(160, 120, (900, 900), 300.0, (0, 0), exposure_s=0.01, lens=Lens(vignetting=0.2))
    scene, times = scene_with_everything(), frame_times(camera, 0.2)
    for name, seed in (("one", 5), ("two", 5), ("other", 6)):
        drawn = list(render(scene, camera, Sensor(5000.0, 4.0, seed=seed), times))
        write_recording(tmp_path / f"{name}.mp4", (frame for frame, _ in drawn), times)
        write_truth(
            tmp_path / f"{name}.csv", tmp_path / f"{name}-bodies.csv", (truth for _, truth in drawn)
        )
    read = {name: (tmp_path / f"{name}.mp4").read_bytes() for name in ("one", "two", "other")}
    assert read["one"] == read["two"]
    assert read["one"] != read["other"]
    lines = (tmp_path / "one.csv").read_text().splitlines()
    assert lines[0] == "frame,time_s,marker,x_px,y_px,visible"
    assert len(lines) == 1 + 5 * 2
    assert len((tmp_path / "one-bodies.csv").read_text().splitlines()) == 1 + 5 * 2


ENCODE = """
import hashlib, pathlib, sys
import numpy as np
from mocap.synthetic.recording_file import write_recording
noise = np.random.default_rng(1).integers(90, 130, (9, 118, 212, 3)).astype(np.uint8)
for k, frame in enumerate(noise):
    frame[30:60, 10 * k : 10 * k + 40] = 220
write_recording(pathlib.Path(sys.argv[1]), noise, np.arange(9) / 25)
print(hashlib.sha256(pathlib.Path(sys.argv[1]).read_bytes()).hexdigest())
"""


@pytest.mark.slow
def test_bytes_do_not_depend_on_what_the_memory_held_before(tmp_path):
    """The C library fills fresh memory with a pattern (glibc; elsewhere the test is weaker)."""
    hashes = {
        subprocess.run(
            [sys.executable, "-c", ENCODE, str(tmp_path / f"{pattern}.mp4")],
            env={**os.environ, "MALLOC_PERTURB_": pattern},
            check=True,
            capture_output=True,
        ).stdout
        for pattern in ("1", "77", "200")
    }
    assert len(hashes) == 1


def test_a_recording_keeps_uneven_times(tmp_path):
    import av

    times = np.array([0.0, 0.04, 0.081, 0.2, 0.21])
    scene = Scene((), background=(0.5, 0.5, 0.5))
    frames = (frame for frame, _ in render(scene, CAMERA, Sensor(), times))
    write_recording(tmp_path / "uneven.mp4", frames, times)
    with av.open(str(tmp_path / "uneven.mp4")) as container:
        read = [float(frame.pts * frame.time_base) for frame in container.decode(video=0)]
    assert read == pytest.approx(times, abs=1e-4)


def test_an_occluded_marker_and_one_outside_are_known_to_be_so():
    camera = Camera(160, 120, (900, 900), 300.0, (0, 0))
    truth = truth_at(scene_with_everything(), camera, 0.0, 0)
    assert truth.markers["a"].visible == pytest.approx(1 - 25 / 100, abs=0.02)
    assert truth.markers["b"].visible == pytest.approx(1, abs=1e-6)
    assert truth_at(scene_with_everything(), camera, 0.9, 0).markers["b"].visible == 0


def test_soft_shapes_stay_inside_the_shape_they_name():
    scene = scene_with_everything()
    camera = Camera(160, 120, (600, 600), 300.0, (0, 0))
    light = exposed(scene, camera, Sensor(), 0.0)
    body = Scene((), light=scene.light)
    empty = exposed(body, camera, Sensor(), 0.0)
    outside = np.ones((120, 160), bool)
    outside[18:102, 38:122] = False
    assert np.array_equal(light[outside], empty[outside])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: Camera(0, 10, (1, 1), 1, (0, 0)), "width is 0"),
        (lambda: Camera(9, 9, (1, 1), 1, (0, 0), exposure_s=0.05), "exposure_s is 0.05"),
        (lambda: Sensor(read_noise_e=3.0), "full_well_e is infinite"),
        (lambda: Sensor(gamma=0.0), "gamma 0.0"),
        (lambda: ScenePolygon(np.zeros((2, 2)), BLACK), "at least three"),
        (lambda: ScenePolygon(np.full((3, 2), np.nan), BLACK), "not a finite"),
        (lambda: CAMERA.project([0.0, 0.0], 400.0), "behind the camera"),
        (
            lambda: Scene((SceneBody("b", resting(), markers=(Marker.patch("a", (0, 0)),) * 2),)),
            "'a' occurs twice",
        ),
    ],
)
def test_what_cannot_be_drawn_is_refused_by_name(wrong, words):
    with pytest.raises(SyntheticError, match=words):
        wrong()


def test_files_that_cannot_be_written_are_refused(tmp_path):
    scene = Scene(())
    odd = Camera(15, 11, (9, 9), 100.0, (0, 0))
    frames = [next(render(scene, odd, Sensor(), [0.0]))[0]]
    with pytest.raises(SyntheticError, match="15×11"):
        write_recording(tmp_path / "odd.mp4", frames, [0.0])
    with pytest.raises(SyntheticError, match="do not increase"):
        write_recording(tmp_path / "back.mp4", frames * 2, [0.1, 0.0])
