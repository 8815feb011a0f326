"""Scales, poses and smoothing: exact where they can be, and their errors honest."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry2d.rigid import rotated
from mocap.motion.errors import MotionError, ScaleError
from mocap.motion.poses import body_poses
from mocap.motion.projection import PictureFormat, axis_px, rectified, undistorted
from mocap.motion.scale import BodyScale, body_scales
from mocap.motion.smooth import SmoothingError, inverse_band, smoothed
from mocap.synthetic.camera import Camera, Lens
from mocap.tracking.marker_file import read_markers
from mocap.tracking.markers import Intrinsics, PlanePoints
from mocap.tracking.tracks import Tracks

SHAPE = np.array([[0.0, 0.0], [102.0, 12.0], [40.0, -55.0]])


@settings(max_examples=50, deadline=None)
@given(
    angles=st.lists(st.floats(-2.5, 2.5), min_size=2, max_size=6),
    shift=st.tuples(st.floats(-300, 300), st.floats(-300, 300)),
    markers=st.integers(2, 3),
)
def test_poses_without_noise_are_exact(
    angles: list[float], shift: tuple[float, float], markers: int
) -> None:
    angle = np.array([0.0, *angles])
    shifts = np.outer(np.arange(angle.size), shift)
    points = np.stack([rotated(SHAPE[:markers], a) for a in angle]) + shifts[:, None]
    poses = body_poses("head", ("a", "b", "c")[:markers], points, np.full(points.shape[:2], 0.1))
    np.testing.assert_allclose(np.exp(1j * poses.angle_rad), np.exp(1j * angle), atol=1e-9)
    np.testing.assert_allclose(poses.position_mm, points[:, 0], atol=1e-8)
    assert poses.residual_mm.max() < 1e-8
    assert poses.rigid


def test_pose_errors_are_those_of_the_formula() -> None:
    """Two markers at distance d: the angle's error is √2 σ/d."""
    rng = np.random.default_rng(0)
    clean = np.tile(SHAPE[:2], (4000, 1, 1))
    sigma = 0.5
    noisy = clean + sigma * rng.standard_normal(clean.shape)
    poses = body_poses("head", ("a", "b"), noisy, np.full((4000, 2), sigma))
    expected = np.sqrt(2) * sigma / np.hypot(*(SHAPE[1] - SHAPE[0]))
    assert np.std(poses.angle_rad) == pytest.approx(expected, rel=0.05)
    assert np.sqrt(poses.covariance[0, 2, 2]) == pytest.approx(expected, rel=0.02)
    spread = np.std(poses.position_mm - clean[:, 0], axis=0)
    stated = np.sqrt(np.diag(poses.covariance[0])[:2])
    np.testing.assert_allclose(spread, stated, rtol=0.06)


def test_a_body_that_is_not_rigid_is_flagged() -> None:
    points = np.tile(SHAPE, (50, 1, 1))
    points[:, 2, 0] += np.linspace(0, 6, 50)
    poses = body_poses("jaw", ("a", "b", "c"), points, np.full((50, 3), 0.02))
    assert not poses.rigid
    assert poses.residual_rms_mm > 0.5


def test_an_interpolated_marker_does_not_make_a_body_unrigid() -> None:
    points = np.tile(SHAPE, (50, 1, 1))
    points[20:30, 1] += 5.0
    sigma = np.full((50, 3), 0.02)
    sigma[20:30, 1] = 3.0
    poses = body_poses("head", ("a", "b", "c"), points, sigma)
    assert poses.rigid
    assert np.isnan(poses.residual_mm[20:30]).all() and poses.residual_rms_mm < 0.02
    sigma[:] = 0.02
    assert not body_poses("head", ("a", "b", "c"), points, sigma).rigid


@pytest.mark.parametrize("lens", [(-0.2, 0.05, 0.001, -0.002), (0.1, 0.0, 0.0, 0.0)])
def test_undistortion_agrees_with_opencv_and_with_the_camera_that_draws(
    lens: tuple[float, float, float, float],
) -> None:
    k1, k2, p1, p2 = lens
    ours = Intrinsics(fx=1500.0, fy=1480.0, cx=640.0, cy=350.0, k1=k1, k2=k2, p1=p1, p2=p2)
    points = np.random.default_rng(0).uniform([20, 20], [1260, 700], (40, 2))
    found = undistorted(points, ours, PictureFormat(1280, 720))
    matrix = np.array([[1500.0, 0, 640], [0, 1480, 350], [0, 0, 1]])
    # OpenCV's own inversion stops early unless told otherwise.
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    theirs = cv2.undistortPoints(
        points[:, None], matrix, np.array([k1, k2, p1, p2]), criteria=criteria
    )[:, 0]
    np.testing.assert_allclose(found, [640.0, 350.0] + theirs * 1480.0, atol=1e-5)
    drawn = Camera(
        1280, 720, (1500.0, 1480.0), 1500.0, (0, 0), principal_px=(640.0, 350.0),
        lens=Lens(k1=k1, k2=k2, p1=p1, p2=p2),
    )  # fmt: skip
    world = np.array([[-300.0, 120.0], [250.0, -160.0]])
    straight = undistorted(drawn.project(world), ours, PictureFormat(1280, 720))
    expected = [640.0, 350.0] + world * [1, -1] * 1480.0 / 1500.0
    np.testing.assert_allclose(straight, expected, atol=1e-6)


def test_the_axis_is_the_middle_of_the_picture_unless_told() -> None:
    np.testing.assert_allclose(axis_px(Intrinsics(), PictureFormat(1280, 720)), [639.5, 359.5])
    np.testing.assert_allclose(
        axis_px(Intrinsics(cx=600.0), PictureFormat(1280, 720)), [600.0, 359.5]
    )
    wide = undistorted(
        np.array([[649.5, 369.5]]), Intrinsics(), PictureFormat(1280, 720, pixel_aspect=1.5)
    )
    np.testing.assert_allclose(wide, [[654.5, 369.5]])


def test_a_plane_seen_askew_is_set_right() -> None:
    camera = Camera(1280, 720, (3000.0, 3000.0), 1500.0, (0, 0), turn_deg=(12.0, -20.0, 3.0))
    corners = np.array([[-150.0, 80.0], [150, 80], [150, -80], [-150, -80]])
    plane = PlanePoints(
        image_px=tuple((float(x), float(y)) for x, y in camera.project(corners)),
        world_mm=tuple((float(x), float(y)) for x, y in corners),
    )
    points = np.random.default_rng(1).uniform([-140, -70], [140, 70], (30, 2))
    np.testing.assert_allclose(
        rectified(camera.project(points), plane), points * [1, -1], atol=1e-8
    )
    line = PlanePoints(image_px=((0, 0), (1, 1), (2, 2), (3, 3)), world_mm=plane.world_mm)
    with pytest.raises(ScaleError, match="lie on a line"):
        rectified(points, line)


def test_band_of_the_inverse_is_exact() -> None:
    rng = np.random.default_rng(0)
    lower = np.tril(rng.uniform(0.1, 1, (9, 9))) + 2 * np.eye(9)
    lower = np.tril(np.triu(lower, -3))
    factor = np.array([np.append(np.diag(lower, -k), np.zeros(k)) for k in range(4)])
    inverse = np.linalg.inv(lower @ lower.T)
    band = inverse_band(factor)
    for k in range(4):
        np.testing.assert_allclose(band[k, : 9 - k], np.diag(inverse, -k), atol=1e-12)


def test_smoothing_has_the_stated_cutoff_and_no_lag() -> None:
    time = np.arange(600) / 100
    for frequency, expected in ((2.0, 0.99998), (10.0, 1 / np.sqrt(2)), (30.0, 0.0033)):
        wave = np.sin(2 * np.pi * frequency * time)
        result = smoothed(time, wave, np.ones(600), cutoff_hz=10.0)
        inner = slice(150, 450)
        gain = (result.values[inner] @ wave[inner]) / (wave[inner] @ wave[inner])
        assert gain == pytest.approx(expected, abs=0.01)
        quarter = np.cos(2 * np.pi * frequency * time)
        assert abs(result.values[inner] @ quarter[inner]) / 150 < 0.01


@pytest.mark.parametrize("uneven", [False, True])
def test_the_cutoff_follows_the_noise_and_errors_are_honest(uneven: bool) -> None:
    rng = np.random.default_rng(5)
    scores, better, noise_factors = [], [], []
    for _ in range(40):
        time = np.sort(rng.uniform(0, 4, 160)) if uneven else np.arange(160) / 40
        time = time + 1e-3 * np.arange(160)
        phase = rng.uniform(0, 6, 2)
        clean = 20 * np.sin(2 * np.pi * 0.6 * time + phase[0]) + 3 * np.sin(9 * time + phase[1])
        sigma = rng.uniform(0.1, 0.3, 160)
        noise = sigma * rng.standard_normal(160)
        result = smoothed(time, clean + noise, sigma)
        scores.append((result.values - clean) / result.sigma)
        better.append(np.std(result.values - clean) / np.std(noise))
        assert 1.5 < result.cutoff_hz < 15
        noise_factors.append(result.noise_factor)
    size = np.abs(np.concatenate(scores))
    assert 0.60 < np.mean(size < 1) < 0.78
    assert 0.90 < np.mean(size < 2) < 0.985
    assert np.mean(better) < 0.45
    assert np.median(noise_factors) == pytest.approx(1.0, abs=0.05)
    assert np.std(noise_factors) < 0.12


def test_ends_and_gaps_are_carried_by_the_curve() -> None:
    time = np.arange(100) / 50
    signal = 5 * time**2 - 3 * time + 1
    sigma = np.full(100, 0.01)
    sigma[40:52] = 5.0
    broken = signal.copy()
    broken[40:52] += 4.0
    result = smoothed(time, broken, sigma, cutoff_hz=3.0)
    np.testing.assert_allclose(result.values, signal, atol=1e-4)
    np.testing.assert_allclose(result.rate, 10 * time - 3, atol=1e-2)
    assert result.sigma[46] > 2 * result.sigma[20]
    assert result.sigma_since_first[0] < 1e-8


def test_signals_with_holes_are_refused() -> None:
    time = np.arange(20) / 10
    with pytest.raises(SmoothingError, match="not finite"):
        smoothed(time, np.where(time > 1, np.nan, time), np.ones(20))
    with pytest.raises(SmoothingError, match="shape"):
        smoothed(time, time[1:], np.ones(20))
    assert np.array_equal(smoothed(time[:4], time[:4], np.ones(4)).values, time[:4])


def pair_of_marks(distance_px: np.ndarray, sigma_px: float = 0.05) -> Tracks:
    """Tracks of ear, nose and two package marks this far apart, with noise."""
    n = distance_px.size
    rng = np.random.default_rng(3)
    names = ("ear", "nose", "package_lower", "package_upper")
    position = np.zeros((n, 4, 2))
    position[:, 1, 0] = 300.0
    position[:, 2] = [400.0, 200.0]
    position[:, 3] = position[:, 2] + np.column_stack([np.zeros(n), -distance_px])
    position += sigma_px * rng.standard_normal(position.shape)
    return Tracks(
        frame=np.arange(n),
        time_s=np.arange(n) / 25,
        names=names,
        position_px=position,
        sigma_px=np.full((n, 4), sigma_px),
        status=np.full((n, 4), "seen", dtype="<U9"),
    )


def package_scale(tmp_path: Path, tracks: Tracks) -> BodyScale:
    path = tmp_path / "markers.toml"
    path.write_text("[scale]\npackage = 14.0\n[markers]\n")
    return body_scales(tracks, read_markers(path), tracks.position_px)["package"]


def test_a_signal_of_known_noise_is_followed_where_it_is_noisy() -> None:
    rng = np.random.default_rng(8)
    time = np.arange(90) / 30
    signal = 60 / (1 + np.exp(-12 * (time - 1.0)))
    error = np.where(np.abs(time - 1.0) < 0.25, 0.3, 0.02)
    found = smoothed(time, signal + error * rng.normal(size=90), error, noise_known=True)
    assert np.abs(found.values - signal).max() < 1.0
    assert np.mean(np.abs(found.values - signal) < 3 * found.sigma) > 0.95


def test_any_two_of_three_marks_carry_a_body() -> None:
    rng = np.random.default_rng(4)
    shape = np.array([0, 14, 6 + 20j])
    angle = np.linspace(0, 0.8, 60)
    place = np.column_stack([np.linspace(0, 30, 60), np.sin(angle)])
    complexes = (place[:, 0] + 1j * place[:, 1])[:, None] + shape * np.exp(1j * angle)[:, None]
    points = np.stack([complexes.real, complexes.imag], axis=-1)
    points = points + rng.normal(0, 0.02, points.shape)
    sigma = np.full((60, 3), 0.02)
    for hidden, frames in ((0, slice(0, 20)), (1, slice(25, 40)), (2, slice(45, 60))):
        points[frames, hidden] = sigma[frames, hidden] = np.nan
    poses = body_poses("package", ("a", "b", "c"), points, sigma)
    off = poses.position_mm - place
    assert np.sqrt(np.mean(off**2)) < 0.05
    assert np.abs(poses.angle_rad - angle).max() < 0.01
    z = off[:, 0] / np.sqrt(poses.covariance[:, 0, 0])
    assert 0.7 < np.sqrt(np.mean(z**2)) < 1.4
    points[:, 0] = np.nan
    with pytest.raises(MotionError, match="no frame shows a, b, c together"):
        body_poses("package", ("a", "b", "c"), points, sigma)


def test_a_steady_scale_is_one_number_with_its_error(tmp_path: Path) -> None:
    found = package_scale(tmp_path, pair_of_marks(np.full(120, 42.0)))
    assert found.change == 0.0
    assert found.px_per_mm[0] == pytest.approx(3.0, rel=3 * found.relative_sigma)
    assert found.relative_sigma == pytest.approx(0.05 * np.sqrt(2 / 120) / 42, rel=0.4)
    assert found.foreshortened == ()


def test_a_package_that_comes_nearer_is_followed(tmp_path: Path) -> None:
    distance = 42.0 * (1 + 0.04 * np.linspace(0, 1, 120))
    found = package_scale(tmp_path, pair_of_marks(distance))
    np.testing.assert_allclose(found.px_per_mm, distance / 14.0, rtol=2e-3)
    assert found.change == pytest.approx(0.04, abs=0.005)


def test_marks_that_turn_out_of_the_plane_are_reported(tmp_path: Path) -> None:
    distance = np.full(120, 42.0)
    distance[50:60] *= np.cos(np.radians(25))
    found = package_scale(tmp_path, pair_of_marks(distance))
    assert found.foreshortened == tuple(range(50, 60))
    assert found.px_per_mm[0] == pytest.approx(3.0, rel=0.003)


def test_marks_in_one_place_give_no_scale(tmp_path: Path) -> None:
    with pytest.raises(ScaleError, match="package_lower and package_upper coincide"):
        package_scale(tmp_path, pair_of_marks(np.full(20, 1.0)))
