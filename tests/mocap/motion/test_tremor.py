"""A hand's tremor is motion: it is kept, and told from noise by what a body's marks share."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geometry2d.rigid import rotated
from mocap.measurement import Measurement, measure
from mocap.motion.projection import PictureFormat
from mocap.motion.smooth import removes_motion, smoothed
from mocap.tracking.follow import follow
from mocap.tracking.marker_file import read_markers
from mocap.tracking.markers import MarkerFile
from mocap.tracking.noise import camera_shakes, with_temporal_noise
from mocap.tracking.tracks import Tracks
from mocap.video.frames import Video
from tests.support.clips import EAR, LOWER, NOSE, TREMOR_HZ, UPPER, Clip, trembling

Array = np.ndarray

TREMOR = Clip(width=1280, height=720, px_per_mm=2.6, tremor_mm=0.25, jaw=False, frames=60)
NOISE_PX = 0.03


def marker_file(folder: Path) -> MarkerFile:
    path = folder / "markers.toml"
    head = np.hypot(*np.subtract(NOSE, EAR))
    path.write_text(f"[scale]\npackage = 14.0\nhead = {head}\n[markers]\n")
    return read_markers(path)


def made_up(clip: Clip, noise_px: float = NOISE_PX) -> tuple[Tracks, Array]:
    """Tracks of a clip that is not drawn, their noise white; and the relative position, mm."""
    head, package = clip.motions()
    times = clip.times()
    at = {"ear": (head, EAR), "nose": (head, NOSE)}
    at |= {"package_lower": (package, LOWER), "package_upper": (package, UPPER)}
    world = np.array([[motion.at(t).apply(place) for motion, place in at.values()] for t in times])
    rng = np.random.default_rng([clip.seed, 9])
    middle = np.array([0.5 * (clip.width - 1), 0.5 * (clip.height - 1)])
    pixels = middle + world * [clip.px_per_mm, -clip.px_per_mm]
    pixels = pixels + noise_px * rng.standard_normal(pixels.shape)
    tracks = Tracks(
        frame=np.arange(times.size),
        time_s=times,
        names=tuple(at),
        position_px=pixels,
        sigma_px=np.full(pixels.shape[:2], noise_px),
        status=np.full(pixels.shape[:2], "seen", dtype="<U9"),
    )
    turn = np.array([head.at(t).angle_rad for t in times])
    return tracks, rotated(world[:, 2] - world[:, 0], -(turn - turn[0]))


def measured(
    tracks: Tracks, markers: MarkerFile, clip: Clip, *, told: bool = True
) -> tuple[Tracks, Measurement]:
    bodies = markers.rigid_bodies if told else ()
    noisy = with_temporal_noise(tracks, bodies=bodies).interpolated()
    return noisy, measure(noisy, markers, PictureFormat(clip.width, clip.height))


def kept(found: Array, true: Array, time_s: Array) -> Array:
    """Return the tremor's amplitude in x and y in a motion over the true motion's."""
    share = []
    for k, frequency in enumerate(TREMOR_HZ):
        window = np.hanning(time_s.size) * np.exp(-2j * np.pi * frequency * time_s)
        share.append(abs(window @ found[:, k]) / abs(window @ true[:, k]))
    return np.array(share)


@pytest.mark.slow
@pytest.mark.parametrize("fps", [25.0, 30.0, 60.0])
def test_tremor_is_kept_and_errors_are_true(tmp_path: Path, fps: float) -> None:
    markers = marker_file(tmp_path)
    shares, scores = [], []
    for seed in range(12):
        clip = replace(TREMOR, seed=seed, fps=fps, frames=int(2.4 * fps))
        tracks, true = made_up(clip)
        noisy, found = measured(tracks, markers, clip)
        motion = found.motion
        shares.append(kept(motion.relative_mm, true, motion.time_s))
        scores.append((motion.relative_mm - true) / motion.sigma[:, :2])
        assert np.sqrt(np.mean((motion.relative_mm - true) ** 2)) < 0.1
        # The tremor of 0.65 px is not taken for noise of the marks.
        assert np.median(noisy.sigma_px) < 2 * NOISE_PX
    assert np.abs(np.array(shares) - 1).max() < 0.2
    score = np.abs(np.concatenate(scores))
    assert 0.55 < (score < 1).mean() < 0.8
    assert (score < 3).mean() > 0.95


@pytest.mark.slow
@pytest.mark.parametrize("noise_px", [0.02, 0.08])
def test_without_tremor_nothing_changes(tmp_path: Path, noise_px: float) -> None:
    """What the marks' distances tell changes no bit of a motion that holds no tremor."""
    markers = marker_file(tmp_path)
    for seed in range(12):
        clip = replace(TREMOR, seed=seed, tremor_mm=0.0)
        tracks, true = made_up(clip, noise_px)
        noisy, found = measured(tracks, markers, clip)
        np.testing.assert_array_equal(noisy.sigma_px, with_temporal_noise(tracks).sigma_px)
        score = (found.motion.relative_mm - true) / found.motion.sigma[:, :2]
        assert np.sqrt(np.mean(score**2)) < 2.0
        for body, pose in found.capture.poses.items():
            error = np.sqrt(pose.covariance[:, 0, 0])
            alone = smoothed(found.motion.time_s, pose.position_mm[:, 0], error)
            chosen = found.capture.smoothing[f"{body}_x_mm"]
            np.testing.assert_array_equal(chosen.values, alone.values)


def test_noise_that_a_body_does_not_share_is_no_tremor(tmp_path: Path) -> None:
    """Marks that tremble each for itself, as under a wandering gloss, do not move the body."""
    markers = marker_file(tmp_path)
    clip = replace(TREMOR, tremor_mm=0.0)
    tracks, true = made_up(clip)
    shaken = tracks.position_px.copy()
    shaken[:, 2] += 0.6 * trembling(tracks.time_s)
    shaken[:, 3] -= 0.6 * trembling(tracks.time_s)
    noisy, found = measured(replace(tracks, position_px=shaken), markers, clip)
    assert np.median(noisy.sigma_px[:, 2:]) > 0.2
    trembled = true + 0.25 * trembling(tracks.time_s)
    assert kept(found.motion.relative_mm, trembled, tracks.time_s).max() < 0.5


def test_what_trembles_in_both_bodies_is_the_camera(tmp_path: Path) -> None:
    markers = marker_file(tmp_path)
    still, _ = made_up(replace(TREMOR, tremor_mm=0.0))
    hand, _ = made_up(TREMOR)
    shake = 2.0 * trembling(still.time_s)[:, None]
    held = replace(still, position_px=still.position_px + shake)
    for tracks, shakes in ((still, False), (hand, False), (held, True)):
        noisy = with_temporal_noise(tracks, bodies=markers.rigid_bodies)
        assert camera_shakes(noisy, "ear", "package_lower") is shakes


def test_what_is_removed_is_compared_with_what_noise_loses() -> None:
    rng = np.random.default_rng(2)
    time = np.arange(120) / 30
    noise, error = rng.normal(0, 0.02, (2, 120)), np.full(120, 0.02)
    still = smoothed(time, noise[0], error, cutoff_hz=2.0)
    quick = 0.05 * np.sin(2 * np.pi * 6 * time)
    assert removes_motion(smoothed(time, noise[1] + quick, error, cutoff_hz=2.0), still)
    assert not removes_motion(smoothed(time, noise[1], error, cutoff_hz=2.0), still)
    few = smoothed(time[:9], (noise[1] + quick)[:9], error[:9], cutoff_hz=2.0)
    assert not removes_motion(few, still)


@pytest.mark.slow
def test_tremor_in_a_drawn_clip(tmp_path: Path) -> None:
    clip = Clip(seed=7, fps=30, tremor_mm=0.25, exposure_s=1 / 125, full_well_e=4000, crf=20)
    video, markers, truths = clip.write(tmp_path)
    film, file = Video(video), read_markers(markers)
    tracks = with_temporal_noise(
        follow(film, file), bodies=file.rigid_bodies, key_frames=film.key_frames
    ).interpolated()
    motion = measure(tracks, file, PictureFormat(clip.width, clip.height)).motion
    true, _ = clip.relative_truth(truths)
    assert np.abs(kept(motion.relative_mm, true, motion.time_s) - 1).max() < 0.2
    assert np.sqrt(np.mean((motion.relative_mm - true) ** 2)) < 0.15
    score = np.abs((motion.relative_mm - true) / motion.sigma[:, :2])
    assert (score < 3).mean() > 0.95
