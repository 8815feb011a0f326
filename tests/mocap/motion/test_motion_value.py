"""The motion as one value: what it holds, how it changes, and that its file holds all of it."""

from __future__ import annotations

import csv
import io
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from geometry2d.rigid import RigidMotion, rotated
from mocap.motion.errors import MotionError
from mocap.motion.motion import MarkedBody, Motion
from mocap.motion.motion_file import COLUMNS, KEYS
from mocap.motion.picture import PictureScale
from tests.support.made_up_motion import made_up_motion


def motion() -> Motion:
    return made_up_motion(
        np.linspace(0.1, 2.0, 40),
        head_body=MarkedBody("face", ("ear", "nose"), 0.2143),
        package_body=MarkedBody("cup", ("package_lower", "package_upper"), 2.1957),
        picture=PictureScale((90.123456789, 80.25), 1.4567890123, mirrored=True),
        rendered=True,
    )


def test_its_file_alone_gives_the_motion_back(tmp_path: Path) -> None:
    file = tmp_path / "motion.csv"
    motion().write(file)
    again = Motion.read(file)
    assert again == motion().rounded()
    assert again.rounded() == again
    again.write(tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == file.read_bytes()
    assert again.head_body.name == "face" and again.package_body.markers[1] == "package_upper"
    np.testing.assert_allclose(again.relative_rad, motion().relative_rad, rtol=0, atol=1e-8)
    np.testing.assert_allclose(again.relative_mm, motion().relative_mm, rtol=0, atol=5.1e-7)


def test_every_key_of_the_header_is_written(tmp_path: Path) -> None:
    motion().write(tmp_path / "motion.csv")
    lines = (tmp_path / "motion.csv").read_text(encoding="utf-8").splitlines()
    header = [line for line in lines if line.startswith("#")]
    assert [line.split()[1] for line in header[1:]] == list(KEYS)
    assert lines[len(header)] == ",".join(COLUMNS)


def bare(file: Path, folder: Path) -> Path:
    """The file without its header, as older versions wrote it."""
    folder.mkdir()
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    old = folder / "motion.csv"
    old.write_text("".join(line for line in lines if line[0] != "#"), encoding="utf-8")
    return old


def test_a_file_without_header_takes_the_directions_from_the_summary(tmp_path: Path) -> None:
    motion().write(tmp_path / "motion.csv")
    old = bare(tmp_path / "motion.csv", tmp_path / "old")
    found = Motion.read(old)
    assert found.head_body == MarkedBody("head") and found.picture is None
    axes = {"head_axis_deg": 12.5, "package_axis_deg": 125.0}
    old.with_name("summary.json").write_text(json.dumps({"first_frame": axes}))
    found = Motion.read(old)
    assert found.head_body.axis_rad == np.radians(12.5)
    assert found.package_body.axis_rad == np.radians(125.0)
    assert np.array_equal(found.relative_mm, motion().rounded().relative_mm)
    old.with_name("summary.json").write_text('{"first_frame": 3}')
    assert Motion.read(old).head_body.axis_rad is None


def test_the_relative_columns_are_enough(tmp_path: Path) -> None:
    file = tmp_path / "motion.csv"
    file.write_text(
        "# made by hand\ntime_s,rel_theta_deg,rel_x_mm,rel_y_mm\n0,0,100,-50\n1,90,90,-40\n"
    )
    found = Motion.read(file)
    assert found.relative_rad[1] == np.pi / 2
    assert found.at(1.0).shift_mm == pytest.approx((90, -40))
    assert not found.in_world
    with pytest.raises(MotionError, match=r"no place of the head in the world.*head_x_mm"):
        _ = found.head
    found.write(tmp_path / "again.csv")
    assert Motion.read(tmp_path / "again.csv") == found
    assert len(found.plot().axes) == 6


HEADER = "time_s,rel_x_mm,rel_y_mm,rel_theta_deg\n"
SOUND = HEADER + "0.00,1.50,2.50,3.50\n0.04,1.25,2.50,3.50\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s,rel_x_mm\n0,1\n", "header lacks rel_y_mm, rel_theta_deg"),
        ("", "is empty; a motion file begins with time_s,rel_x_mm"),
        (HEADER + "0,1,2,3\n", "1 instants"),
        (
            HEADER + "0,1,2,3\n1,1,2\n",
            "line 3: has 3 cells and the header 4",
        ),
        (
            HEADER + "0,1,2,3\n1,a,2,3\n",
            "line 3: rel_x_mm = 'a' is not a",
        ),
        (
            HEADER + "0,1,2,3\n1,1,nan,3\n",
            "line 3: rel_y_mm = 'nan' is not",
        ),
        (HEADER + "1,1,2,3\n1,1,2,3\n", "do not increase after 1 s"),
        (f"# head_axis_deg = wide\n{SOUND}", "'# head_axis_deg = wide' is no number"),
        (f"# head_axis_deg = {'9' * 5000}\n{SOUND}", "is no number"),
        (f"# head_axis_deg = nan\n{SOUND}", "is no number"),
        (f"# rendered = 1\n{SOUND}", "is no true or false"),
        (f"# head_markers = [1]\n{SOUND}", "is no list of texts"),
        (f"# head_markers = {'[' * 5000}\n{SOUND}", "is no list of texts"),
        (f"# {'x' * 200_000}\n{SOUND}", "a line of its header has 200002 characters"),
        (SOUND[:-3], "line 3: was cut short in its last row"),
        (SOUND.replace(",", ";").replace("1.25", "1,25"), "decimal points and decimal commas"),
    ],
)
def test_a_broken_file_is_named_with_what_is_wrong(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "motion.csv"
    file.write_text(text)
    with pytest.raises(MotionError, match=words) as caught:
        Motion.read(file)
    assert str(file) in str(caught.value) and "\n" not in str(caught.value)


def test_another_encoding_is_named(tmp_path: Path) -> None:
    file = tmp_path / "motion.csv"
    file.write_bytes(f"# frèd\n{SOUND}".encode("latin-1"))
    with pytest.raises(MotionError, match=r"motion\.csv line 1: byte 0xe8 is not UTF-8.*Latin-1"):
        Motion.read(file)


def saved_by_a_spreadsheet(file: Path, separator: str, decimal: str) -> None:
    """Write a file anew as spreadsheets do: all rows equally wide, text in quotes if need be."""
    lines = file.read_text(encoding="utf-8").splitlines()
    stream = io.StringIO()
    writer = csv.writer(stream, delimiter=separator, lineterminator="\r\n")
    for line in lines:
        cells = line.split(",")
        if decimal == "," and "#" not in line and "time_s" not in line:
            cells = [cell.replace(".", ",") for cell in cells]
        elif decimal == "," and "_deg = " in line:
            cells = [line.replace(".", ",")]
        elif separator != "," and line.startswith("#"):
            cells = [line]
        writer.writerow(cells + [""] * (len(COLUMNS) - len(cells)))
    stated = f"sep={separator}\r\n" if separator == ";" else ""
    file.write_bytes(b"\xef\xbb\xbf" + (stated + stream.getvalue()).encode())


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", ","), (";", "."), ("\t", ",")]
)
def test_a_spreadsheet_may_have_written_the_file(
    tmp_path: Path, separator: str, decimal: str
) -> None:
    file = tmp_path / "motion.csv"
    motion().write(file)
    sound = Motion.read(file)
    saved_by_a_spreadsheet(file, separator, decimal)
    again = Motion.read(file)
    assert again.head_body == sound.head_body and again.package_body == sound.package_body
    np.testing.assert_array_equal(again.relative_mm, sound.relative_mm)
    assert again.rendered == sound.rendered


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 4), min_size=2, max_size=9),
    st.text(min_size=1),
    st.lists(st.text(), max_size=3),
    st.floats(-180, 180),
    st.booleans(),
)
@example([(0.0, 0.0, 0.0, 0.0)] * 2, "\x7f\u2028", ['"', "#", ","], 0.1, True)
def test_any_motion_comes_back_from_its_file(
    tmp_path: Path, rows: list[tuple[float, ...]], name: str, markers: list[str], axis: float,
    rendered: bool,
) -> None:  # fmt: skip
    table = np.array(rows)
    time = np.arange(len(rows)) * 0.04
    body = MarkedBody(name, tuple(markers), float(np.radians(axis)))
    whole = Motion.of(time, table[:, :2], table[:, 2], head_body=body, rendered=rendered)
    whole.write(tmp_path / "motion.csv")
    assert Motion.read(tmp_path / "motion.csv") == whole.rounded()


def test_a_missing_file_is_named() -> None:
    with pytest.raises(MotionError, match=r"no motion file .*none\.csv: make one with drinksim"):
        Motion.read("none.csv")


def test_the_package_in_the_world_is_head_and_relative_motion_together() -> None:
    m = motion()
    head = RigidMotion(m.time_s, m.head_rad, m.head_mm)
    together = head @ RigidMotion(m.time_s, m.relative_rad, m.relative_mm)
    assert np.ptp(m.head_rad) > 0.05 and np.ptp(m.relative_rad) > 0.1
    np.testing.assert_allclose(m.package_mm, together.shift_mm, atol=1e-12)
    np.testing.assert_allclose(m.package.apply(m.package_mm[0])[:, 0], m.package_mm, atol=1e-12)
    np.testing.assert_allclose(m.package.seen_from(m.head).apply(m.package_mm[0])[:, 0],
                               m.relative_mm, atol=1e-12)  # fmt: skip


def test_changes_give_new_motions_and_keep_the_bodies_together() -> None:
    m = motion()
    held = m.shifted(x_mm=2.0, y_mm=-1.0, turn_deg=10.0)
    assert np.array_equal(held.relative_mm, m.relative_mm + np.array([2.0, -1.0]))
    assert held.package_body.axis_rad == m.package_body.axis_rad + np.radians(10.0)
    np.testing.assert_allclose(
        held.package_mm - m.package_mm, rotated([2.0, -1.0], m.head_rad), atol=1e-12
    )
    still = m.with_(head_rad=np.zeros(40), head_mm=np.zeros((40, 2)))
    assert np.array_equal(still.package_mm, m.relative_mm)
    given = m.with_(package_mm=m.package_mm + 1, relative_mm=m.relative_mm + 1)
    assert np.array_equal(given.package_mm, m.package_mm + 1)
    assert m == motion() != held and m != "motion"
    with pytest.raises(MotionError, match="no relativ_mm: known are time_s, relative_mm"):
        m.with_(relativ_mm=0)
    with pytest.raises(MotionError, match="direction of cup is not known"):
        m.with_(package_body=MarkedBody("cup")).shifted(turn_deg=1.0)
    with pytest.raises(MotionError, match=r"head_rad has shape \(3,\): 40 times need \(40,\)"):
        m.with_(head_rad=np.zeros(3))


def test_arrays_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        motion().relative_mm[0] = 0


def test_it_is_described_in_one_line() -> None:
    assert repr(motion()) == (
        "Motion(cup seen from face, 40 instants, 0.10 to 2.00 s, σ 0.09 mm 0.06°)"
    )
    assert "σ" not in repr(replace(motion(), sigma=np.full((40, 3), np.nan)))


def test_it_rests_before_and_after() -> None:
    m = motion()
    assert m.at(-1.0).shift_mm == pytest.approx(m.relative_mm[0])
    assert m.at(9.0).angle_rad == pytest.approx(m.relative_rad[-1])
    assert m.at(m.time_s[7]).shift_mm == pytest.approx(m.relative_mm[7])


def test_its_table(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    motion().write(tmp_path / "motion.csv")
    with (tmp_path / "motion.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(line for line in stream if line[0] != "#"))
    for name, column in motion().columns().items():
        np.testing.assert_allclose([float(row[name]) for row in rows], column, atol=6e-7)
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MotionError, match=r"pip install 'drinksim\[notebook\]'"):
        motion().to_dataframe()


def test_as_a_pandas_table() -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    frame = motion().to_dataframe()
    assert list(frame.columns) == list(COLUMNS) and len(frame) == 40


def test_the_picture_scale_is_fitted_where_the_places_spread() -> None:
    scale = motion().picture
    assert scale is not None
    places = motion().package_mm
    found = PictureScale.fitted(scale.pixels(places), places)
    assert found is not None
    assert found.px_per_mm == pytest.approx(scale.px_per_mm)
    assert found.origin_px == pytest.approx(scale.origin_px)
    assert PictureScale.fitted(scale.pixels(places[:1]), places[:1]) is None
    close = places[0] + 0.1 * np.random.default_rng(0).normal(size=(30, 2))
    assert PictureScale.fitted(scale.pixels(close), close) is None
