"""A marking is a value: each change returns a new one, and files say what it says."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mocap.tracking.marker_file import EXAMPLE, read_markers
from mocap.tracking.markers import MarkerFile
from scenarios.marking.document import marker_file_text, scenario_text
from scenarios.marking.marking import Marking, plain_markers
from scenarios.marking.pointing import (
    POINTING_SIGMA_PX,
    Length,
    MarkingError,
    PlacedPoint,
    Ruler,
    Touch,
    length_by_ruler,
)
from scenarios.settings.scenario import load_scenario

EMPTY = Marking.of(plain_markers(), first_frame=3)
FOUR = {"ear": (100.0, 90.0), "nose": (300.0, 95.0),
        "package_lower": (400.0, 200.0), "package_upper": (420.0, 185.0)}  # fmt: skip


def four_placed() -> Marking:
    marking = EMPTY
    for name, at in FOUR.items():
        marking = marking.with_marker(name, 3, PlacedPoint(at))
    return marking


def put(marking: Marking, name: str, at: tuple[float, float]) -> Marking:
    return marking.with_marker(name, 3, PlacedPoint(at))


def reread(markers: MarkerFile, folder: Path) -> MarkerFile:
    file = folder / "markers.toml"
    file.write_text(marker_file_text(markers), encoding="utf-8")
    return replace(read_markers(file), path=markers.path)


def test_nothing_is_known_at_first() -> None:
    assert EMPTY.lacking() == tuple(FOUR)
    assert EMPTY.needs_length() == "package"
    assert EMPTY.names[-1] == "jaw_back"


def test_a_change_leaves_the_marking_before_as_it_was() -> None:
    before = four_placed()
    places = {name: dict(at) for name, at in before.placed.items()}
    after = (
        before.with_marker("nose", 7, PlacedPoint((310.0, 99.0)))
        .with_length("package", Length(14.0))
        .with_style("upper_lip", (5.0, 6.0))
        .with_touch("lower", Touch(9, (1.0, 2.0)))
        .without_marker("ear", 3)
    )
    assert {name: dict(at) for name, at in before.placed.items()} == places
    assert not before.lengths
    assert not before.style
    assert after.lacking() == ("ear",)
    assert after.placed["nose"][7].at == (310.0, 99.0)


def test_without_its_first_position_a_marker_has_none() -> None:
    marking = four_placed().with_marker("nose", 8, PlacedPoint((1.0, 1.0)))
    assert list(marking.without_marker("nose", 8).placed["nose"]) == [3]
    assert "nose" not in marking.without_marker("nose", 3).placed


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda m: put(m, "chin", (1.0, 1.0)),
            "'chin' is none of ear, nose",
        ),
        (lambda m: put(m, "nose", (101.0, 90.0)), "ear is at this place"),
        (
            lambda m: put(m, "nose", (math.nan, 0.0)),
            "is no place in a picture",
        ),
        (lambda m: m.with_marker("jaw_front", 4, PlacedPoint((1.0, 1.0))), "in the first frame"),
        (lambda m: m.without_marker("nose", 4), "nothing was set by hand in frame 4"),
        (lambda m: m.with_length("head", Length(14.0)), "60 to 200 mm apart, not 14 mm"),
        (lambda m: m.with_length("jaw", Length(14.0)), "'jaw' has no two marks"),
        (lambda m: m.with_style("chin", (0.0, 0.0)), "'chin' is none of upper_lip"),
        (lambda m: m.with_touch("middle", None), "'middle' is no lip"),
        (lambda m: m.with_polarity("blue"), "'blue' is none of auto"),
    ],
)
def test_what_makes_no_sense_is_refused_in_words(change, message: str) -> None:
    with pytest.raises(MarkingError, match=message):
        change(four_placed())


@given(
    mm=st.floats(5.0, 200.0), share=st.floats(0.05, 0.9), turn=st.floats(0, 2 * np.pi),
    px_per_mm=st.floats(1.0, 20.0),
)  # fmt: skip
def test_a_ruler_gives_the_length_between_marks(mm, share, turn, px_per_mm) -> None:
    along = px_per_mm * mm * np.array([np.cos(turn), np.sin(turn)])
    assume(np.hypot(*along) > 20)
    ruler = np.add([5.0, 7.0], [[0.0, 0.0], along])
    marks = np.add([50.0, 40.0], [[0.0, 0.0], share * along[::-1]])
    found = length_by_ruler(ruler, marks, mm)
    assert found.mm == pytest.approx(share * mm)
    rng = np.random.default_rng(1)
    moved = ruler + POINTING_SIGMA_PX * rng.normal(size=(4000, 2, 2))
    spread = np.std([length_by_ruler(one, marks, mm).mm for one in moved[::40]])
    assert spread == pytest.approx(found.sigma_mm, rel=0.5)


def test_a_ruler_that_is_a_point_is_refused() -> None:
    with pytest.raises(MarkingError, match="0 px apart"):
        length_by_ruler([[1, 1], [1, 1]], [[1, 1], [9, 9]], 100.0)


def test_the_marker_file_says_what_the_marking_says(tmp_path: Path) -> None:
    marking = four_placed().with_marker("jaw_front", 3, PlacedPoint((250.25, 300.5)))
    marking = marking.with_length("package", Length(14.0, 0.05)).with_polarity("dark")
    for name, at in {
        "upper_lip": (9.0, 8.0),
        "rim_lower": (7.0, 6.0),
        "rim_upper": (1.0, 2.0),
    }.items():
        marking = marking.with_style(name, at)
    markers = marking.marker_file(tmp_path / "m.toml")
    again = reread(markers, tmp_path)
    assert again == markers
    assert again.positions_px["jaw_front"] == (250.25, 300.5)
    assert "jaw_back" not in again.positions_px


def test_what_a_given_marker_file_says_beyond_is_kept(tmp_path: Path) -> None:
    text = f"""{EXAMPLE}
[lens]
fx = 4400
fy = 4400
cx = 0.0
k1 = -0.12
[recording]
rendered = true
[tracking]
polarity = "ring"
"""
    file = tmp_path / "given.toml"
    file.write_text(text, encoding="utf-8")
    given = read_markers(file)
    again = reread(Marking.of(given, 0).marker_file(given.path), tmp_path)
    assert again == replace(given, positions_px=again.positions_px)
    assert again.positions_px == given.positions_px
    assert again.lens.cx == 0.0


def test_bodies_of_ones_own_and_stickers_are_kept(tmp_path: Path) -> None:
    file = tmp_path / "given.toml"
    file.write_text(
        "[scale]\nwall = 800.0\n[markers]\nleft = [10, 20]\nright = [300, 20]\nball = [50, 60]\n"
        '[bodies]\nwall = ["left", "right"]\nball = ["ball"]\nmoving = "ball"\nreference = "wall"\n'
    )
    given = read_markers(file)
    assert reread(Marking.of(given, 0).marker_file(given.path), tmp_path) == given
    file.write_text('[markers]\near = "sticker"\nnose = "sticker"\npackage_lower = "sticker"\n'
                    'package_upper = [5, 9]\n[stickers]\nbar_mm = 99.5\n')  # fmt: skip
    given = read_markers(file)
    marking = Marking.of(given, 0)
    assert marking.lacking() == ()
    assert marking.needs_length() is None
    assert reread(marking.marker_file(given.path), tmp_path) == given


def test_the_scenario_says_when_lips_are_touched(tmp_path: Path) -> None:
    (tmp_path / "film.mp4").touch()
    (tmp_path / "markers.toml").write_text(marker_file_text(four_placed().marker_file(tmp_path)))
    (tmp_path / "motion").mkdir()
    (tmp_path / "motion" / "motion.csv").touch()
    marking = four_placed().with_touch("lower", Touch(26, (1.0, 2.0)))
    text = scenario_text(marking, {26: 1.04}, name='a "film"', video=tmp_path / "film.mp4")
    file = tmp_path / "scenario.toml"
    file.write_text(text, encoding="utf-8")
    scenario = load_scenario(str(file))
    assert scenario.name == 'a "film"'
    assert scenario.first_contact.lower_time_s == 1.04
    assert scenario.first_contact.upper_time_s is None
    assert scenario.recording is not None
    assert scenario.recording.video == str(tmp_path / "film.mp4")


def test_a_ruler_is_remembered_until_a_length_is_typed() -> None:
    ruler = Ruler(3, ((0.0, 0.0), (50.0, 0.0)), 50.0)
    marking = four_placed().with_length("package", Length(14.0, 0.2), ruler)
    assert marking.rulers == {"package": ruler}
    assert marking.with_length("package", Length(14.0)).rulers == {}
    assert marking.without_length("package").needs_length() == "package"
