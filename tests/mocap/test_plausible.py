"""Markers that cannot be where they are said to be are named, before or after tracking."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

import pytest

from mocap.convert import convert
from mocap.plausible import doubts
from mocap.tracking.marker_file import read_markers
from mocap.tracking.markers import MarkerFileError

LIBRARY = Path(str(files("scenarios") / "library"))
FILM = LIBRARY / "A38-F" / "recording.mp4"
MARKERS = (LIBRARY / "A38-F" / "markers.toml").read_text(encoding="utf-8")
LAST_S = 0.3


def exchanged(one: str, other: str) -> str:
    """Return the marker file with the positions of two markers exchanged."""
    places = [re.search(rf"^{name} = .*$", MARKERS, re.MULTILINE) for name in (one, other)]
    lines = [place[0] for place in places if place]
    swapped = [lines[1].replace(other, one), lines[0].replace(one, other)]
    return MARKERS.replace(lines[0], swapped[0]).replace(lines[1], swapped[1])


def changed(old: str, new: str) -> str:
    assert old in MARKERS
    return MARKERS.replace(old, new)


@pytest.mark.parametrize("name", ["A38-F", "A38-AE", "DC-F", "DC-AE"])
def test_the_library_gives_no_doubts(name: str) -> None:
    assert not list(doubts(read_markers(LIBRARY / name / "markers.toml")))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "doubt", "error"),
    [
        (
            exchanged("package_lower", "package_upper"),
            r"neck looks away.*exchange the positions of package_lower and package_upper",
            r"package_lower and package_upper are mixed up; exchange",
        ),
        (
            exchanged("ear", "nose"),
            r"behind the ear: exchange the positions of ear and nose",
            r"ear and nose are mixed up; exchange",
        ),
        (changed("package = 14 ", "package = 20 "), "", r"package = 20 .* 1\.5 times as far away"),
        (
            changed("package = 14 ", "package = 30 ").replace("head = 104.3", "# no head"),
            r"package = 30 ear and nose are",
            r"by \[scale\] package = 30 ear and nose are .* mm apart",
        ),
    ],
)
def test_markers_that_contradict_a_film_are_refused(
    tmp_path: Path, text: str, doubt: str, error: str
) -> None:
    file = tmp_path / "marks.toml"
    file.write_text(text, encoding="utf-8")
    doubted = list(doubts(read_markers(file)))
    assert len(doubted) == bool(doubt) and re.search(doubt, "".join(doubted))
    with pytest.raises(MarkerFileError, match=rf"marks\.toml: .*{error}"):
        convert(FILM, file, end_s=LAST_S)


@pytest.mark.parametrize(
    ("text", "doubt"),
    [
        (changed("package = 14 ", "package = 38 "), r"package = 38 .* times as far away"),
        (changed("head = 104.3", "head = 190"), r"head = 190 .* times as far away"),
    ],
)
def test_lengths_that_no_camera_sees_are_doubted_at_once(
    tmp_path: Path, text: str, doubt: str
) -> None:
    file = tmp_path / "marks.toml"
    file.write_text(text, encoding="utf-8")
    (doubted,) = doubts(read_markers(file))
    assert re.search(doubt, doubted)


def test_a_focal_length_in_mm_is_refused_before_tracking(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("the film was tracked")

    monkeypatch.setattr("mocap.convert.follow", never)
    file = tmp_path / "marks.toml"
    file.write_text(changed("fx = 4400", "fx = 35"), encoding="utf-8")
    with pytest.raises(MarkerFileError, match=r"marks\.toml: .*fx = 35 .*in px, not in mm"):
        convert(FILM, file)
