"""Marks at other depths than assumed, and turns out of the plane: corrected, or in the errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from mocap.measurement import Measurement, measure
from mocap.motion.perspective import Perspective, stated_ratio
from mocap.motion.projection import at_frame_times
from mocap.tracking.marker_file import read_markers
from mocap.tracking.markers import MarkerFile, MarkerFileError
from mocap.tracking.noise import with_temporal_noise
from mocap.views.depths import depth_effect, depth_warnings
from tests.support.solid_bodies import SolidSip

PROJECTED = float(np.hypot(*SolidSip.nose))


def marker_file(folder: Path, head: float | None = PROJECTED, more: str = "") -> MarkerFile:
    path = folder / "markers.toml"
    scale = "" if head is None else f"head = {head}\n"
    path.write_text(f"[scale]\npackage = {SolidSip.apart}\n{scale}{more}\n[markers]\n")
    return read_markers(path)


def measured(sip: SolidSip, markers: MarkerFile) -> tuple[Measurement, str]:
    tracks = with_temporal_noise(sip.tracks(), bodies=markers.rigid_bodies).interpolated()
    found = measure(tracks, markers, sip.picture)
    said = depth_effect(found, markers)["warnings"] + depth_warnings(found, markers)
    return found, " | ".join(said)


def errors(sip: SolidSip, found: Measurement) -> tuple[float, float]:
    """RMS error of a coordinate, mm, and the least share of frames within 3σ of x, y and angle."""
    place, angle = sip.truth()
    off = np.column_stack([found.motion.relative_mm - place, found.motion.relative_rad - angle])
    within = np.abs(off[1:]) <= 3 * found.motion.sigma[1:]
    return float(np.sqrt(np.mean(off[:, :2] ** 2))), float(within.mean(axis=0).min())


@pytest.mark.parametrize(("ear", "nose"), [(60.0, 0.0), (70.0, 20.0), (-40.0, 0.0)])
def test_an_ear_nearer_than_the_nose_is_told_by_the_film(
    tmp_path: Path, ear: float, nose: float
) -> None:
    sip = SolidSip(ear_nearer=ear, nose_nearer=nose)
    found, said = measured(sip, marker_file(tmp_path))
    off, within = errors(sip, found)
    assert off < 0.15
    assert within > 0.95
    told = found.perspective.ratios["head"]
    true = np.log((sip.distance - nose) / (sip.distance - ear))
    assert told.source == "film" and told.log_ratio == pytest.approx(true, abs=3 * told.sigma)
    assert f"head: {'nose' if ear > nose else 'ear'} is" in said and "this is corrected" in said


def test_marks_at_one_depth_change_nothing(tmp_path: Path) -> None:
    for seed in range(8):
        found, said = measured(SolidSip(seed=seed), marker_file(tmp_path))
        assert {ratio.log_ratio for ratio in found.perspective.ratios.values()} == {0.0}
        assert all(not scale.tilt_rad.size for scale in found.scales.values())
        assert not said
        off, within = errors(SolidSip(seed=seed), found)
        assert off < 0.15
        assert within > 0.95
        assert np.median(found.motion.sigma[:, :2]) < 0.1


def test_a_head_at_rest_does_not_tell_depths_and_its_errors_say_so(tmp_path: Path) -> None:
    sip = SolidSip(ear_nearer=50.0, nod=0.0, sway=0.1)
    found, said = measured(sip, marker_file(tmp_path))
    off, within = errors(sip, found)
    assert off < 0.5
    assert within > 0.95
    assert 0.3 < np.median(found.motion.sigma[:, 0]) < 3.0
    assert "hardly tells whether ear and nose are equally far" in said


def test_stated_depths_need_no_distance_of_ear_and_nose(tmp_path: Path) -> None:
    sip = SolidSip(ear_nearer=65.0, nose_nearer=15.0)
    depth = "[depth]\ncamera = 1530\near = 62\nnose = 17\n"
    found, said = measured(sip, marker_file(tmp_path, None, depth))
    off, within = errors(sip, found)
    assert off < 0.5
    assert within > 0.95
    assert not said
    blind, _ = measured(sip, marker_file(tmp_path, None))
    assert errors(sip, blind)[0] > 2.0
    assert errors(sip, blind)[1] > 0.95


def test_a_third_mark_of_stated_depth_is_levelled_too(tmp_path: Path) -> None:
    path = tmp_path / "markers.toml"
    path.write_text(
        "[scale]\npackage = 20\n[depth]\ncamera = 1000\near = 60\nnose = 10\nbrow = 30\n"
        '[bodies]\nhead = ["ear", "nose", "brow"]\npackage = ["low", "high"]\n[markers]\n'
    )
    markers = read_markers(path)
    depths = 1000.0 - np.array([60, 10, 30])
    assert markers.depth is not None
    told = stated_ratio(markers.depth, ("ear", "nose"))
    tracks = replace(SolidSip().tracks(), names=("ear", "nose", "brow", "low"))
    places = np.array([[100.0, 20], [-40, 60], [10, -70], [5, 5]])
    filmed = 50 + np.concatenate([places[:3] / depths[:, None], places[3:]])[None]
    level = Perspective({"head": told}).level(filmed, tracks, markers, np.array([50.0, 50.0]))
    mean = np.sqrt(depths[0] * depths[1])
    np.testing.assert_allclose(level[0, :3], 50 + places[:3] / mean, rtol=1e-12)
    np.testing.assert_array_equal(level[0, 3], filmed[0, 3])


def test_a_distance_through_space_is_told_from_one_in_the_picture(tmp_path: Path) -> None:
    """Callipers on ear and nose measure 120 mm where the camera sees 104: 20 mm of error."""
    sip = SolidSip(ear_nearer=60.0)
    straight = float(np.hypot(PROJECTED, 60.0))
    found, said = measured(sip, marker_file(tmp_path, straight))
    off, within = errors(sip, found)
    assert off > 5.0
    assert within > 0.95
    assert "parallel to the picture, not straight through space" in said


@pytest.mark.parametrize("yaw", [10.0, -10.0])
def test_a_turn_out_of_the_plane_is_in_the_errors(tmp_path: Path, yaw: float) -> None:
    sip = SolidSip(head_yaw=yaw, package_yaw=yaw, distance=700.0, focal=1500.0)
    found, said = measured(sip, marker_file(tmp_path))
    off, within = errors(sip, found)
    assert off > 0.3
    assert within > 0.95
    assert "turns out of the picture's plane" in said


def test_a_focus_that_breathes_is_followed(tmp_path: Path) -> None:
    sip = SolidSip(zoom=0.015)
    found, _ = measured(sip, marker_file(tmp_path))
    off, within = errors(sip, found)
    assert off < 0.15
    assert within > 0.95


def test_a_rolling_shutter_is_undone() -> None:
    """A hand that holds the camera shakes it by 6 px at 3 Hz; rows are exposed one by one."""
    sip = SolidSip()
    time = sip.time
    still = CubicSpline(time, replace(sip, noise=0.0).tracks().position_px[:, 2])

    def shaken(at: np.ndarray) -> np.ndarray:
        shake = 6 * np.column_stack([np.sin(18 * at), np.cos(13 * at)])
        return np.asarray(still(at) + shake)

    readout, height = 0.02, sip.picture.height
    exposed = time.copy()
    for _ in range(20):
        exposed = time + readout * shaken(exposed)[:, 1] / height
    filmed = shaken(exposed)[:, None]
    filmed[40] = np.nan
    undone = at_frame_times(filmed, time, readout, height)
    inside = np.isfinite(filmed[:, 0, 0]) & (time > 0.1) & (time < time[-1] - 0.1)
    assert np.isnan(undone[40]).all()
    assert np.abs(filmed[inside, 0] - shaken(time)[inside]).max() > 2.0
    assert np.sqrt(np.mean((undone[inside, 0] - shaken(time)[inside]) ** 2)) < 0.1


@pytest.mark.parametrize(
    ("depth", "words"),
    [
        ("camera = 1500\near = 50", "lacks nose"),
        ("ear = 50\nnose = 10", "lacks camera"),
        ("camera = 15\near = 50\nnose = 10", "camera = 15"),
        ("camera = 1500\near = 900\nnose = 10", "ear = 900"),
        ("camera = 1500\near = 50\nnose = 10\nsigma = -1", "negative"),
        ("camera = 1500\near = 50\nnose = 10\nchin = 1", "no key 'chin'"),
    ],
)
def test_depths_that_make_no_sense_are_refused(tmp_path: Path, depth: str, words: str) -> None:
    with pytest.raises(MarkerFileError, match=words):
        marker_file(tmp_path, more=f"[depth]\n{depth}\n")


def test_a_readout_that_no_camera_has_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MarkerFileError, match="readout_s = 20"):
        marker_file(tmp_path, more="[lens]\nreadout_s = 20\n")
    path = tmp_path / "stickers.toml"
    path.write_text('[lens]\nreadout_s = 0.02\n[markers]\near = "sticker"\n')
    with pytest.raises(MarkerFileError, match="undone for dots only"):
        read_markers(path)
