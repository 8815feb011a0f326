"""Where it is not sure which spot is which marker, a numbered picture shows them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mocap.convert import convert
from mocap.tracking.errors import UnnamedSpotsError
from mocap.views.spots import numbered_spots
from scenarios.cli.main import main
from tests.support.clips import Clip

CLIP = Clip(width=480, height=300, px_per_mm=1.45, frames=14, jaw=False)
LEFT = replace(CLIP, faces_left=True)
"""``auto`` knows faces to the right only, so that it is never sure of this one."""


@pytest.fixture
def unnamed(tmp_path: Path) -> tuple[Path, Path, list]:
    video, markers, truths = LEFT.write(tmp_path)
    markers.write_text(LEFT.marker_file(truths[0], positions=False))
    return video, markers, truths


def test_the_picture_shows_all_spots_and_the_message_how_to_name_them(unnamed, tmp_path) -> None:
    video, markers, truths = unnamed
    out = tmp_path / "out"
    with pytest.raises(UnnamedSpotsError, match=r"out/spots\.png shows them: write") as caught:
        convert(video, markers, out=out)
    assert sorted(path.name for path in out.iterdir()) == [".drinksim", "spots.png"]
    picture = np.asarray(Image.open(out / "spots.png"))
    assert picture.shape == (CLIP.height, CLIP.width, 3)
    places = dict(enumerate(caught.value.places_px, 1))
    named = {}
    for name, marker in truths[0].markers.items():
        number = min(
            places, key=lambda k: np.hypot(places[k][0] - marker.x_px, places[k][1] - marker.y_px)
        )
        named[name] = re.search(rf"\b{number} (\[\d+, \d+\])", str(caught.value))[1]
    text = markers.read_text() + "".join(f"{name} = {at}\n" for name, at in named.items())
    markers.write_text(re.sub(r"(\[recording\]\nrendered = true\n)(.*)", r"\2\1", text, flags=re.S))
    convert(video, markers, out=out)
    assert not (out / "spots.png").exists()
    assert (out / "motion.csv").is_file()


@pytest.mark.slow
def test_an_earlier_result_stays(unnamed, tmp_path) -> None:
    video, markers, truths = unnamed
    unsure = markers.read_text()
    markers.write_text(LEFT.marker_file(truths[0]))
    convert(video, markers, out=tmp_path / "out")
    before = (tmp_path / "out" / "motion.csv").read_bytes()
    markers.write_text(unsure)
    with pytest.raises(UnnamedSpotsError):
        convert(video, markers, out=tmp_path / "out")
    assert (tmp_path / "out" / "motion.csv").read_bytes() == before
    assert (tmp_path / "out" / "spots.png").is_file()


def test_in_memory_nothing_is_written(unnamed, tmp_path, monkeypatch) -> None:
    video, markers, _ = unnamed
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(UnnamedSpotsError) as caught:
        convert(video, markers)
    assert "spots.png" not in str(caught.value)
    assert sorted(tmp_path.rglob("*")) == before


def test_each_place_has_a_circle(tmp_path) -> None:
    plain = np.full((200, 300, 3), 128, np.uint8)
    drawn = numbered_spots(plain, [(60.0, 70.0), (200.0, 120.0)])
    assert (plain == 128).all()
    changed = np.any(drawn != 128, axis=2)
    for x, y in ((60, 70), (200, 120)):
        assert changed[y - 25 : y + 26, x - 25 : x + 60].sum() > 60
        assert not changed[y, x], "the spot itself stays visible"
    assert changed.sum() < 2000


def test_the_command_says_it_in_one_line(unnamed, tmp_path, capsys) -> None:
    video, markers, _ = unnamed
    out = tmp_path / "out"
    assert main(["convert", str(video), "--markers", str(markers), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "spots.png" in said


def test_the_command_needs_no_marker_file_to_say_that_there_are_no_stickers(
    tmp_path, capsys
) -> None:
    video, _, _ = CLIP.write(tmp_path)
    assert main(["convert", str(video), "--out", str(tmp_path / "out")]) == 2
    assert "no coded sticker" in capsys.readouterr().err
