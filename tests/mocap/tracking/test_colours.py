"""Coloured marks that are as light as their ground: no grey level shows them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mocap.convert import convert
from mocap.tracking.follow import follow
from mocap.tracking.locate import fit_near, locate_markers
from mocap.tracking.marker_file import read_markers
from mocap.tracking.noise import with_temporal_noise
from mocap.video.channels import COLOURS, Pixels
from mocap.video.frames import Video
from tests.support.clips import Clip

# Ground and mark, displayed levels 0 to 1, of the same luma (BT.709).
STICKERS = {
    "orange": ((0.80, 0.62, 0.52), (1.0, 0.58, 0.10)),
    "green": ((0.80, 0.62, 0.52), (0.30, 0.78, 0.35)),
    "blue": ((0.40, 0.40, 0.40), (0.20, 0.40, 1.0)),
}
PACKAGE = ("package_lower", "package_upper")


def clip(colour: str, seed: int = 3, **others: object) -> Clip:
    ground, mark = STICKERS[colour]
    usual = Clip(seed=seed, frames=24, px_per_mm=3.0, width=960, height=600, jaw=False)
    return replace(usual, package_colour=ground, mark_colour=mark, **others)  # type: ignore[arg-type]


@pytest.mark.slow
def test_coloured_marks_are_followed_with_stated_errors(tmp_path: Path) -> None:
    squared, ratios = [], []
    for colour in STICKERS:
        noisy = clip(colour, full_well_e=6000.0, crf=18.0)
        video, markers, truths = noisy.write(tmp_path / colour)
        film = Video(video)
        raw = follow(film, read_markers(markers))
        tracks = with_temporal_noise(raw, key_frames=film.key_frames)
        columns = [tracks.names.index(name) for name in PACKAGE]
        seen = tracks.status[:, columns] == "seen"
        assert seen.mean() >= 0.97
        truth = [[[t.markers[n].x_px, t.markers[n].y_px] for n in PACKAGE] for t in truths]
        error = (tracks.position_px[:, columns] - truth)[seen]
        squared.append(np.mean(error**2))
        ratios.append(np.abs(error) / tracks.sigma_px[:, columns][seen][:, None])
    assert np.sqrt(squared).max() < 0.2
    ratio = np.concatenate(ratios)
    assert 0.55 < np.mean(ratio < 1) < 0.80
    assert np.mean(ratio < 3) >= 0.95


@pytest.mark.slow
def test_a_film_with_coloured_marks_becomes_a_motion(tmp_path: Path) -> None:
    drawn = clip("orange")
    video, markers, truths = drawn.write(tmp_path)
    motion = convert(video, markers).motion
    places, turns = drawn.relative_truth(truths)
    assert np.abs(motion.relative_mm - places).max() < 0.3
    assert np.degrees(np.abs(motion.relative_rad - turns)).max() < 1.5


def test_what_grey_levels_show_is_seen_in_grey_levels(tmp_path: Path) -> None:
    video, markers, _ = Clip(frames=2).write(tmp_path)
    first = next(Video(video).frames())
    found = locate_markers(first.picture, read_markers(markers), 0)
    assert {spot.channel for spot in found.values()} == {"grey"}


def test_a_sticker_is_taken_and_not_the_dark_spot_beside_it() -> None:
    import cv2

    picture = np.empty((200, 640, 3), np.uint8)
    picture[:] = np.round(255 * np.array(STICKERS["orange"][0][::-1]))
    cv2.circle(picture, (150, 100), 9, np.multiply(255, STICKERS["orange"][1][::-1]), -1)
    cv2.circle(picture, (172, 108), 5, (60, 60, 60), -1)
    picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    shown = Pixels(grey, lambda: picture)
    sticker = fit_near(shown, (153.0, 97.0), "auto", None)
    assert sticker is not None
    assert sticker.channel in COLOURS
    assert (sticker.x, sticker.y) == pytest.approx((150, 100), abs=0.05)
    dark = fit_near(shown, (171.0, 107.0), "auto", None)
    assert dark is not None
    assert dark.channel == "grey"
    assert (dark.x, dark.y) == pytest.approx((172, 108), abs=0.1)
    hidden = replace(dark, channel="grey")
    again = fit_near(shown, (150.0, 100.0), "auto", hidden)
    assert again is None or again.channel == "grey"


def test_a_picture_without_colour_has_no_contrast_of_colours() -> None:
    grey = np.arange(256, dtype=np.uint8).reshape(16, 16)
    shown = Pixels(grey, lambda: np.repeat(grey[..., None], 3, axis=2))
    for channel in COLOURS:
        assert (shown.seen_in(channel) == 128).all()
    pure = np.zeros((4, 4, 3), np.uint8)
    pure[..., 0] = 200
    assert (Pixels(grey, lambda: pure).seen_in("blue") == 255).all()
    assert (Pixels(grey, lambda: pure).seen_in("red") == 58).all()
