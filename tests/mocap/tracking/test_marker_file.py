"""The marker file: what is accepted, and that everything else is refused in helpful words."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mocap.tracking.marker_file import EXAMPLE, read_markers
from mocap.tracking.markers import MarkerFileError

GOOD = """
[scale]
package = 14.0
head = 104.3
[lens]
fx = 4000
fy = 4000
k1 = -0.05
[markers]
ear = [460.0, 300.0]
nose = [700.0, 268.0]
package_lower = [752.0, 374.0]
package_upper = [733.0, 348.0]
"""


def read(tmp_path: Path, text: str):
    path = tmp_path / "markers.toml"
    path.write_text(text, encoding="utf-8")
    return read_markers(path)


def test_a_usual_file(tmp_path: Path) -> None:
    markers = read(tmp_path, GOOD)
    assert markers.names == ("ear", "nose", "package_lower", "package_upper")
    assert markers.scale_mm == {"package": 14.0, "head": 104.3}
    assert markers.body_of("nose") == "head"
    assert markers.lens.is_distorting and markers.lens.cx is None
    assert not markers.rendered


def test_the_example_is_a_marker_file_with_and_without_what_is_optional(tmp_path: Path) -> None:
    markers = read(tmp_path, EXAMPLE)
    assert markers.scale_mm["head"] == 104.3 and markers.positions_px["nose"] is None
    assert markers.plane is None and markers.style is None and not markers.rendered
    everything = re.sub(r"^# (?=\[|\w+ = )", "", EXAMPLE, flags=re.MULTILINE)
    whole = read(tmp_path, everything)
    assert whole.plane is not None and whole.style is not None and whole.rendered
    assert whole.scale_sigma_mm["package"] == 0.05
    assert whole.bodies["jaw"] == ("jaw_front", "jaw_back")


def test_missing_standard_markers_are_to_be_looked_for(tmp_path: Path) -> None:
    markers = read(tmp_path, "[scale]\npackage = 14\n[markers]\near = [1, 2]\n")
    assert markers.positions_px["ear"] == (1.0, 2.0)
    assert markers.positions_px["package_upper"] is None
    assert "jaw_front" not in markers.names


STYLE = """
[style]
upper_lip = [613, 344]
rim_lower = [771, 543]
rim_upper = [828, 506]
"""


def test_lip_and_rim(tmp_path: Path) -> None:
    style = read(tmp_path, GOOD + STYLE).style
    assert style is not None and style.rim_upper == (828.0, 506.0)
    assert read(tmp_path, GOOD).style is None
    with pytest.raises(MarkerFileError, match=r"\[style\] lacks rim_lower: give all of upper_lip"):
        read(tmp_path, GOOD + STYLE.replace("rim_lower = [771, 543]", ""))
    with pytest.raises(MarkerFileError, match="did you mean 'upper_lip'"):
        read(tmp_path, GOOD + STYLE.replace("upper_lip", "uper_lip"))
    with pytest.raises(MarkerFileError, match="rim_lower and rim_upper coincide"):
        read(tmp_path, GOOD + STYLE.replace("[771, 543]", "[828, 506]"))


def test_own_bodies(tmp_path: Path) -> None:
    text = """
[scale]
wall = 800
[markers]
a = [1, 2]
b = [3, 4]
ball = [5, 6]
[bodies]
wall = ["a", "b"]
ball = ["ball"]
moving = "ball"
reference = "wall"
"""
    markers = read(tmp_path, text)
    assert (markers.moving, markers.reference) == ("ball", "wall")
    assert markers.scale_mm == {"wall": 800.0}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("package = 14.0", "pakage = 14.0", ["pakage", "did you mean 'package'"]),
        ("ear = [460.0, 300.0]", "eer = [460.0, 300.0]", ["eer", "did you mean 'ear'"]),
        ("[lens]", "[lense]", ["lense", "did you mean 'lens'"]),
        ("k1 = -0.05", "k9 = -0.05", ["k9", "known"]),
        ("package = 14.0", "package = -14.0", ["package = -14.0", "more than 0"]),
        ("package = 14.0", "package = nan", ["package", "finite"]),
        ("package = 14.0", 'package = "14"', ["package", "number"]),
        ("package = 14.0", "", ["[scale] lacks package", "measure"]),
        ("ear = [460.0, 300.0]", "ear = [460.0]", ["ear", "two numbers"]),
        ("ear = [460.0, 300.0]", "ear = [inf, 300.0]", ["ear", "finite"]),
        ("fx = 4000", "", ["fx and fy"]),
        ("fx = 4000", "fx = 0", ["fx = 0", "positive"]),
        ("[scale]", "[scale", ["TOML"]),
        ("[markers]", "[tracking]\npolarity = 'drak'\n[markers]", ["drak", "did you mean 'dark'"]),
        ("[markers]", "[recording]\nrendered = 1\n[markers]", ["rendered", "true or false"]),
        ("[markers]", "[plane]\nimage_px = [[1, 2]]\n[markers]", ["image_px", "four points"]),
        ("[markers]", "[bodies]\nhead = ['ear', 'ear']\n[markers]", ["listed twice"]),
        ("[markers]", "[bodies]\nmoving = 'hed'\n[markers]", ["hed", "did you mean 'head'"]),
        ("[markers]", "[bodies]\nmoving = ['head']\n[markers]", ['moving = ["head"]', "no body"]),
        ("[markers]", '[bodies]\nhead = ["e\\nar"]\n[markers]', [r"'e\nar' cannot be a name"]),
        ("[markers]", f"[bodies]\nhead = ['{'x' * 99}']\n[markers]", ["cannot be a name"]),
        ("[markers]", f"[bodies]\nhead = {list(map(str, range(500)))}\n[markers]", ["at most 200"]),
        ("[markers]", "[bodies]\nhead = true\n[markers]", ["head = true", "list of marker names"]),
        ("package = 14.0", "package = 1.4", ["package = 1.4", "3 to 300 mm", "give it in mm"]),
        ("head = 104.3", "head = 10.43", ["head = 10.43", "ear and nose are 60 to 200 mm"]),
        ("package = 14.0", f"package = {'9' * 5000}", ["too many digits"]),
        ("package = 14.0", "package = 1e300", ["package = 1e+300", "not so large"]),
        ("ear = [460.0, 300.0]", f"ear = {'[' * 900}{']' * 900}", ["nested more than"]),
        ("ear = [460.0, 300.0]", "ear = 1979-05-27", ["ear = 1979-05-27", "two numbers"]),
    ],
)
def test_mistakes_are_named_with_a_remedy(
    tmp_path: Path, old: str, new: str, words: list[str]
) -> None:
    assert old in GOOD
    with pytest.raises(MarkerFileError) as caught:
        read(tmp_path, GOOD.replace(old, new, 1))
    message = str(caught.value)
    assert "markers.toml" in message
    assert "\n" not in message.split("TOML", maxsplit=1)[0]
    for word in words:
        assert word in message


def test_another_encoding_is_named(tmp_path: Path) -> None:
    path = tmp_path / "markers.toml"
    path.write_bytes(f"# mètre\n{GOOD}".encode("latin-1"))
    with pytest.raises(MarkerFileError, match=r"line 1: byte 0xe8 is not UTF-8.*Latin-1"):
        read_markers(path)


@pytest.mark.slow
def test_many_bodies_are_refused_soon(tmp_path: Path) -> None:
    bodies = "".join(f"b{k} = ['m{k}']\n" for k in range(40_000))
    with pytest.raises(MarkerFileError, match="list at most 200"):
        read(tmp_path, GOOD + "[bodies]\n" + bodies)


def test_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(MarkerFileError, match="no such marker file"):
        read_markers(tmp_path / "none.toml")


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.text(max_size=60), st.integers(0, len(GOOD)), st.integers(0, 40))
def test_damaged_files_are_refused_and_never_crash(
    tmp_path: Path, inserted: str, at: int, removed: int
) -> None:
    text = GOOD[:at] + inserted + GOOD[at + removed :]
    try:
        read(tmp_path, text)
    except MarkerFileError as error:
        assert "markers.toml" in str(error)


def test_odd_names_of_markers_are_in_quotes_when_they_are_listed(tmp_path: Path) -> None:
    file = tmp_path / "marks.toml"
    file.write_text(
        '[scale]\npackage = 14\n[bodies]\nhead = ["ear", "no()se"]\n'
        'package = ["package_lower", "package_upper"]\n[markers]\nnose = [30, 4]\n'
    )
    with pytest.raises(MarkerFileError, match=r"known: ear, 'no\(\)se', package_lower"):
        read_markers(file)
