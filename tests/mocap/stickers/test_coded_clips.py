"""Whole drawn clips with coded stickers: no marker file, depth and tilt, dots beside stickers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mocap.convert import ConvertResult, convert
from mocap.tracking.follow import stickers_in
from mocap.tracking.markers import MarkerFileError
from mocap.video.frames import Video
from tests.support.clips import Clip

CODED = Clip(
    width=720,
    height=420,
    px_per_mm=2.6,
    distance_mm=700.0,
    frames=24,
    stickers=("ear", "nose", "package_lower", "package_upper"),
    jaw=False,
    full_well_e=4000,
    exposure_s=0.01,
    crf=18,
)


SHORT = replace(CODED, frames=12)


@pytest.fixture(scope="module")
def short_video(tmp_path_factory) -> Path:
    return SHORT.write(tmp_path_factory.mktemp("short"))[0]


def converted(video: Path, folder: Path, markers: str) -> ConvertResult:
    """Convert with a marker file of one's own."""
    (folder / "own.toml").write_text(markers)
    return convert(video, folder / "own.toml")


def relative_errors(clip: Clip, result: ConvertResult, truths: list) -> np.ndarray:
    places, turns = clip.relative_truth(truths)
    rows = [int(frame) for frame in result.measured.capture.frame]
    motion = result.motion
    turn = motion.relative_rad - (turns[rows] - turns[rows[0]])
    return np.column_stack([motion.relative_mm - places[rows], turn])


def assert_honest(errors: np.ndarray, sigma: np.ndarray) -> None:
    assert np.mean(np.abs(errors[1:]) <= 3 * sigma[1:] + 1e-9) > 0.95


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (8.0, -18.0)])
def test_stickers_need_no_marker_file(tmp_path, tilt) -> None:
    clip = replace(CODED, tilt_deg=tilt, head_depth_mm=70.0)
    video, _, truths = clip.write(tmp_path)
    result = convert(video)
    assert set(result.tracks.names) == set(CODED.stickers)
    assert np.mean(result.tracks.status == "seen") > 0.98
    errors = relative_errors(clip, result, truths)
    assert np.sqrt(np.mean(errors[:, :2] ** 2, axis=0)).max() < 0.3
    assert_honest(errors, result.motion.sigma)
    there = np.sin(np.pi * np.arange(clip.frames) / clip.frames) ** 2
    # The package's small stickers stand close together, which tells a tilt less well.
    for body, limit in (("head", 1.0), ("package", 3.0)):
        pose = result.measured.capture.out_of_plane[body]
        off = np.degrees(pose.tilt_rad) - there[:, None] * np.array(tilt)
        assert np.sqrt(np.mean(off**2, axis=0)).max() < limit


@pytest.mark.slow
def test_one_sticker_carries_a_body_and_dots_stand_beside_stickers(tmp_path) -> None:
    clip = replace(CODED, stickers=("ear", "package_lower"), tilt_deg=(0.0, 10.0))
    video, _, truths = clip.write(tmp_path / "drawn")
    places = {name: [m.x_px, m.y_px] for name, m in truths[0].markers.items()}
    dots = f"nose = {places['nose']}\npackage_upper = {places['package_upper']}\n"
    focal = clip.px_per_mm * clip.distance_mm
    lens = f"[lens]\nfx = {focal}\nfy = {focal}\n"
    text = lens + '[markers]\near = "sticker"\npackage_lower = "sticker"\n' + dots
    result = converted(video, tmp_path, text)
    assert np.all(result.tracks.status == "seen")
    errors = relative_errors(clip, result, truths)
    assert np.sqrt(np.mean(errors[:, :2] ** 2, axis=0)).max() < 0.3
    assert_honest(errors, result.motion.sigma)
    alone = convert(video)
    assert alone.motion.head_body.markers == ("ear",)
    assert alone.motion.head_body.axis_rad == pytest.approx(np.radians(90), abs=0.05)
    lone = relative_errors(clip, alone, truths)
    assert np.sqrt(np.mean(lone[:, :2] ** 2, axis=0)).max() < 0.5
    assert_honest(lone, alone.motion.sigma)


@pytest.mark.slow
def test_a_film_without_stickers_says_what_to_do(tmp_path) -> None:
    clip = replace(CODED, stickers=(), frames=12)
    video, _, _ = clip.write(tmp_path)
    assert stickers_in(Video(video)) == frozenset()
    with pytest.raises(MarkerFileError, match="--markers"):
        convert(video)


@pytest.mark.slow
def test_the_printed_bar_stretches_all_lengths(short_video: Path, tmp_path: Path) -> None:
    names = "".join(f'{name} = "sticker"\n' for name in CODED.stickers)
    plain = converted(short_video, tmp_path, f"[markers]\n{names}")
    bar = "[stickers]\nbar_mm = 102.0\n"
    wide = converted(short_video, tmp_path, f"{bar}[markers]\n{names}")
    assert wide.motion.relative_mm == pytest.approx(1.02 * plain.motion.relative_mm, rel=1e-4)
    assert wide.motion.relative_rad == pytest.approx(plain.motion.relative_rad, abs=1e-5)


@pytest.mark.slow
def test_depth_and_tilt_are_written(short_video: Path, tmp_path: Path) -> None:
    convert(short_video, out=tmp_path / "out")
    lines = (tmp_path / "out" / "out_of_plane.csv").read_text().splitlines()
    assert lines[0].startswith("frame,time_s,body,depth_mm,tilt_x_deg")
    assert len(lines) == 1 + 2 * 12
