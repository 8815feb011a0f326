"""A person who faces left moves as one who faces right does, and is told to be mirrored."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mocap.convert import ConvertResult, convert
from mocap.motion.motion import Motion
from mocap.motion.picture import PictureScale
from mocap.plausible import doubts
from mocap.tracking.marker_file import read_markers
from scenarios.views.filmed import pictures_at
from tests.support.clips import Clip

LEFT = Clip(
    width=480, height=300, px_per_mm=1.45, frames=24, jaw=False, faces_left=True,
    lens=(-0.08, 0.0), head_depth_mm=40.0,
)  # fmt: skip
CODED = replace(
    LEFT, width=1280, height=720, px_per_mm=3.0, frames=30, lens=(0.0, 0.0),
    stickers=("ear", "nose", "package_lower", "package_upper"),
)  # fmt: skip


def errors(clip: Clip, result: ConvertResult, truths: list) -> np.ndarray:
    places, turns = clip.relative_truth(truths)
    motion = result.motion
    return np.column_stack([motion.relative_mm - places, motion.relative_rad - (turns - turns[0])])


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> tuple[ConvertResult, list, Path]:
    video, markers, truths = LEFT.write(tmp_path_factory.mktemp("left"))
    assert list(doubts(read_markers(markers))) == []
    return convert(video, markers), truths, video


def test_the_motion_is_that_of_a_person_who_faces_right(left) -> None:
    result, truths, _ = left
    found = errors(LEFT, result, truths)
    assert np.abs(found[:, :2]).max() < 0.3
    assert np.abs(np.degrees(found[:, 2])).max() < 0.7
    assert (result.motion.relative_mm[:, 0] > 0).all()


def test_it_is_said_and_the_tracks_are_the_films(left) -> None:
    result, truths, _ = left
    assert any("faces left" in warning for warning in result.warnings)
    assert result.summary["recording"]["mirrored"] is True
    ear = truths[5].markers["ear"]
    assert result.tracks.of("ear")[0][5] == pytest.approx((ear.x_px, ear.y_px), abs=0.2)


def test_the_picture_is_shown_mirrored_with_the_world_in_its_place(left, tmp_path: Path) -> None:
    result, truths, video = left
    result.motion.write(tmp_path / "motion.csv")
    motion = Motion.read(tmp_path / "motion.csv")
    assert motion.picture == PictureScale(motion.picture.origin_px, motion.picture.px_per_mm, True)
    shown = motion.picture.pixels(motion.package_mm[8:9])[0]
    lower = truths[8].markers["package_lower"]
    assert shown == pytest.approx((LEFT.width - 1 - lower.x_px, lower.y_px), abs=2.0)
    (plain,) = pictures_at(video, [0.1])
    (mirrored,) = pictures_at(video, [0.1], mirrored=True)
    np.testing.assert_array_equal(mirrored, plain[:, ::-1])


def test_a_film_to_the_right_is_not_mirrored(tmp_path: Path) -> None:
    video, markers, _ = replace(LEFT, faces_left=False, frames=6).write(tmp_path)
    result = convert(video, markers)
    assert result.summary["recording"]["mirrored"] is False
    result.motion.write(tmp_path / "motion.csv")
    assert "mirrored" not in (tmp_path / "motion.csv").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("stickers", [CODED.stickers, ("ear", "package_lower")])
def test_stickers_are_read_as_filmed_and_measured_mirrored(tmp_path: Path, stickers) -> None:
    clip = replace(CODED, stickers=stickers, tilt_deg=(0.0, 8.0))
    video, _, truths = clip.write(tmp_path)
    result = convert(video)
    found = errors(clip, result, truths)
    assert np.sqrt(np.mean(found[:, :2] ** 2, axis=0)).max() < 0.3
    assert np.degrees(np.sqrt(np.mean(found[:, 2] ** 2))) < 0.3
