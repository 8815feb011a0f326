"""Tables of other programs: dialects that are read, and files that cost time or memory or lie."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from mocap.convert import given_tracks
from mocap.formats.c3d import read_c3d, write_c3d
from mocap.formats.exchange import read_positions
from mocap.formats.marker_table import ExchangeError, MarkerTable
from mocap.formats.trc import read_trc, write_trc

FUZZ = settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
LETTERS = st.characters(exclude_categories=["C", "Z"])
NAMES = st.lists(st.text(LETTERS, min_size=1, max_size=20), min_size=1, max_size=6, unique=True)
PLACES = st.floats(-1e6, 1e6) | st.just(np.nan)


def table(names: list[str], places: list[float]) -> MarkerTable:
    """A table of five frames; a marker with a coordinate that is missing is missing."""
    positions = np.resize(np.array(places), (5, len(names), 3))
    positions[np.isnan(positions).any(axis=2)] = np.nan
    return MarkerTable(np.arange(5) / 50, tuple(names), positions, "mm")


@FUZZ
@given(NAMES, st.lists(PLACES, min_size=1, max_size=40))
@example(["=1+1", "'=1", "+", "-a", "@b"], [1.5])
def test_any_table_comes_back_from_trc(tmp_path: Path, names: list[str], places: list[float]):
    written = table(names, places)
    write_trc(written, tmp_path / "m.trc")
    again = read_trc(tmp_path / "m.trc")
    assert again.names == written.names
    np.testing.assert_allclose(again.positions, written.positions, rtol=0, atol=5e-7)
    cells = (tmp_path / "m.trc").read_text(encoding="utf-8").splitlines()[3].split("\t")
    assert not [cell for cell in cells if cell.startswith(("=", "+", "-", "@"))]


@pytest.mark.slow
@settings(FUZZ, max_examples=12)
@given(NAMES, st.lists(PLACES, min_size=1, max_size=40))
def test_any_table_comes_back_from_c3d(tmp_path: Path, names: list[str], places: list[float]):
    written = table(names, places)
    write_c3d(written, tmp_path / "m.c3d")
    again = read_c3d(tmp_path / "m.c3d")
    assert again.names == written.names
    np.testing.assert_allclose(again.positions, written.positions, rtol=1e-6, atol=1e-30)


@pytest.mark.parametrize("name", ["a\tb", "a\n", " a", "", "\x00"])
def test_names_that_a_file_cannot_hold_are_refused(tmp_path: Path, name: str):
    with pytest.raises(ExchangeError, match=r"m\.trc: TRC cannot hold a marker called"):
        write_trc(table([name], [1.0]), tmp_path / "m.trc")
    with pytest.raises(ExchangeError, match=r"m\.c3d: C3D cannot hold a marker called"):
        write_c3d(table([f" {name}"], [1.0]), tmp_path / "m.c3d")


# --- dialects ---

TIMES = "0;10,5;20,5\n40;11,5;21,5\n"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("k.csv", "\ufeffTime (ms);ear X;ear Y\r\n0;10,5;20,5\r\n40;11,5;21,5\r\n"),
        ("k.csv", f"sep=;\nTime (ms);ear X;ear Y\n{TIMES}"),
        ("k.csv", f'"Time (ms)";"ear/X (px)";"ear/Y (px)"\n\n{TIMES}'),
        ("k.txt", "\ufeff\tear\t\nt\tx\ty\n0\t10,5\t20,5\n0,04\t11,5\t21,5\n"),
        ("k.txt", ";ear;\nt;x;y\n0;10.5;20.5\n0.04;11.5;21.5"),
        ("k.txt", "ear\nt x y\n0 10.5 20.5\n 0.04 11.5  21.5\n"),
        ("k.txt", "#Kinovea Trajectory data export\n# ear\n0 10,5 20,5\n40 11,5 21,5\n"),
    ],
)
def test_spreadsheets_in_their_dialects(tmp_path: Path, name: str, text: str):
    (tmp_path / name).write_bytes(text.encode())
    found = read_positions(tmp_path / name)
    assert found.names == ("ear",)
    np.testing.assert_allclose(found.time_s, [0, 0.04])
    np.testing.assert_allclose(found.positions[:, 0, :2], [[10.5, 20.5], [11.5, 21.5]])


def test_names_with_accents_are_read_in_the_code_page_that_kinovea_writes(tmp_path: Path):
    text = "Time (ms),mâchoire X,mâchoire Y\n0,1,2\n40,1,2\n"
    for encoding in ("utf-8", "cp1252"):
        (tmp_path / "k.csv").write_bytes(text.encode(encoding))
        assert read_positions(tmp_path / "k.csv").names == ("mâchoire",)
    (tmp_path / "k.csv").write_bytes(text.encode("utf-16"))
    with pytest.raises(ExchangeError, match=r"k\.csv: is written in UTF-16: save"):
        read_positions(tmp_path / "k.csv")


def test_deeplabcut_numbers_its_frames_by_the_names_of_pictures(tmp_path: Path):
    rows = "".join(f"labeled-data/sip2/img{k:04d}.png,{k}.5,1\n" for k in (3, 4, 9))
    (tmp_path / "d.csv").write_text(f"scorer,n,n\nbodyparts,a,a\ncoords,x,y\n{rows}")
    np.testing.assert_array_equal(read_positions(tmp_path / "d.csv").time_s, [3, 4, 9])


# --- what costs time or memory, or lies ---

KINOVEA = "Time (ms),a/X,a/Y\n"
DLC = "scorer,n,n\nbodyparts,a,a\ncoords,x,y\n"


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", f"Time (ms),{'x' * 130_000}/X,{' ' * 100_000}\n0,1,2\n", "no columns X and Y"),
        ("a.csv", f"Time (ms),{'(' * 100_000}X (px)\n0,1\n", "no columns X and Y"),
        ("a.csv", f"{KINOVEA}0,{'1' * 100_000},2\n", "column 2 is '1{40}…', not a finite number"),
        ("a.csv", f"{KINOVEA}0,{'m' * 200_000},2\n", "a cell has more than 131072 characters"),
        ("a.csv", f"{KINOVEA}0,1_0,2\n", "column 2 is '1_0', not a finite number"),
        ("a.csv", f"{KINOVEA}0,1,1e10\n", "a position is 1e.10, too large"),
        ("a.csv", f"{KINOVEA}0,1,2\n1e-9,1,2\n", "sooner than any camera"),
        ("a.csv", f"{KINOVEA}0,1,2.25\n40,1,2.50\n80,1,2.", "line 4: was cut short"),
        ("a.csv", "Time (ms);a X;a Y\n0;1,5;2\n40;1.5;2\n", "column 2 is '1.5', and others have"),
        ("a.csv", f"{DLC}{'1' * 100_000}.png,1,2\n", "not the number of a frame"),
        ("a.csv", f"{DLC}{'1' * 100_000},1,2\n", "not the number of a frame"),
        ("a.csv", "scorer,n,n\nbodyparts,a,a\ncoords,x\n0,1,2\n", "line 3: has 2 cells"),
        ("a.csv", "scorer,n,n,n\nbodyparts,a,a,a\ncoords,x,x,y\n0,1,2,3\n", "2 columns x, not one"),
        ("a.txt", f"t\t{'x' * 9}{chr(9)}y\n0\t1\t2\n", "has no columns x and y"),
        ("a.txt", f"{' ' * 900_000}z\n", "has no header line"),
        (
            "a.txt",
            "#Kinovea Trajectory data export\n" + "".join(f"#m{k}\n{k} 1 2\n" for k in range(9000)),
            "names 9000 markers in 9000 frames and holds 27000 numbers",
        ),
        ("a.txt", "#Kinovea Trajectory data export\n# a\n0 1 2\n0 1 2\n", "time 0 of 'a' is there"),
        ("a.txt", "t\tx\ty\n0\t1\t2\n0.1\t1", "line 3: was cut short in its last row"),
    ],
    ids=range(18),
)
def test_costly_and_wrong_tables_are_refused(tmp_path: Path, name: str, text: str, words: str):
    (tmp_path / name).write_text(text)
    with pytest.raises(ExchangeError, match=words) as caught:
        read_positions(tmp_path / name)
    assert name in str(caught.value) and len(str(caught.value)) < 500


@pytest.mark.slow
def test_many_columns_are_paired_in_time(tmp_path: Path):
    count = 60_000
    columns = "\t".join(["x"] * count + ["y"])
    (tmp_path / "a.txt").write_text(f"t\t{columns}\n0" + "\t1" * (count + 1) + "\n")
    assert len(read_positions(tmp_path / "a.txt").names) == count
    parts = ",".join(f"m{k},m{k}" for k in range(count))
    numbers = ",1" * 2 * count
    (tmp_path / "d.csv").write_text(
        f"scorer{numbers}\nbodyparts,{parts}\ncoords{',x,y' * count}\n0{numbers}\n"
    )
    assert len(read_positions(tmp_path / "d.csv").names) == count


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("NumFrames", "NumFrame", "no number NumFrames: it is missing"),
        ("\t7\t3\t", f"\t{'9' * 5000}\t3\t", "no number NumFrames: it says '9{40}…'"),
        ("\t7\t3\t", "\t7\t-3\t", "no number NumMarkers: it says '-3'"),
        ("\t7\t3\t", "\t7\t3.5\t", "no number NumMarkers"),
        ("ear\t", "e\x0bar\t", r"a marker is called 'e\\x0bar'"),
        ("nose\t", "ear\t", "marker 'ear' is there twice"),
        ("0.020000\t", "0.02_0\t", "line 8: column 2 is '0.02_0'"),
        ("0.020000\t", "\t", "row 2 has no time"),
        ("0.020000\t", "1e12\t", "a time is 1e.12, too large"),
        ("DataRate", "Datarate", None),
        ("\n50\t", "\n1e-320\t", None),
        ("\n50\t", "\nnan\t", None),
    ],
)
def test_trc_headers_are_checked(tmp_path: Path, old: str, new: str, words: str | None):
    path = tmp_path / "m.trc"
    positions = np.ones((7, 3, 3))
    write_trc(MarkerTable(np.arange(7) / 50, ("ear", "nose", "jaw"), positions, "mm"), path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    if words is None:
        np.testing.assert_allclose(read_trc(path).time_s, np.arange(7) / 50)
        return
    with pytest.raises(ExchangeError, match=words):
        read_trc(path)


def test_a_trc_file_may_not_announce_more_than_it_holds(tmp_path: Path):
    names = "\t\t\t".join(f"m{k}" for k in range(40_000))
    rows = "".join(f"{k}\t{k}\n" for k in range(40_000))
    (tmp_path / "m.trc").write_text(
        "PathFileType\t4\t(X/Y/Z)\tm.trc\nNumFrames\tNumMarkers\n40000\t40000\n"
        f"Frame#\tTime\t{names}\n\t\tX1\n{rows}"
    )
    with pytest.raises(ExchangeError, match="names 40000 markers in 40000 frames and holds 80000"):
        read_positions(tmp_path / "m.trc")


def test_lengths_are_no_tracks_and_the_file_is_named(tmp_path: Path):
    (tmp_path / "k.csv").write_text("Time (ms),a/X (mm),a/Y (mm)\n0,1,2\n40,1,2\n")
    with pytest.raises(ExchangeError, match=r"k\.csv: positions are in mm: tracks need px"):
        given_tracks(tmp_path / "k.csv")


# --- C3D ---


def c3d(folder: Path) -> bytearray:
    write_c3d(table(["ear", "nose"], [1.0, 2.0, 3.0]), folder / "sound.c3d")
    return bytearray((folder / "sound.c3d").read_bytes())


def set_header(data: bytearray, word: int, value: int) -> None:
    struct.pack_into("<H", data, 2 * (word - 1), value)


def set_parameter(data: bytearray, name: bytes, at: int, new: bytes) -> None:
    """Overwrite bytes of a parameter, counted from behind its name."""
    start = data.index(name) + len(name) + at
    data[start : start + len(new)] = new


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: set_header(d, 2, 9), "header has 9 points in a frame and POINT:USED says 2"),
        (lambda d: set_header(d, 4, 60), "announces frames 60 to"),
        (lambda d: set_header(d, 5, 60_000), "announces frames for .*: it was cut short"),
        (lambda d: set_header(d, 9, 60_000), "announces frames for .*: it was cut short"),
        (lambda d: d.__setitem__(0, 200), "cut short in its parameters"),
        (lambda d: d.__setitem__(1, 0), "is no C3D file"),
        (lambda d: d.__setitem__(515, 7), "the processor 7, which is none of C3D"),
        (lambda d: set_parameter(d, b"\x01LABELS", 2, b"\x09"), "'LABELS' is damaged: type 9"),
        (lambda d: set_parameter(d, b"\x01LABELS", 4, b"\xff\xff"), "'LABELS' is damaged"),
        (lambda d: set_parameter(d, b"\x01LABELS", 0, b"\xff\xff"), "leads out of the file"),
        (lambda d: set_parameter(d, b"\x01USE", 0, b"X"), "no parameter POINT:USED"),
        (lambda d: set_parameter(d, b"\x01RATE", 4, struct.pack("<f", -1)), "frame rate|damaged"),
    ],
)
def test_the_header_of_c3d_is_checked_before_it_is_read(tmp_path: Path, change, words: str):
    data = c3d(tmp_path)
    change(data)
    (tmp_path / "m.c3d").write_bytes(data)
    with pytest.raises(ExchangeError, match=rf"m\.c3d.*(?:{words})"):
        read_positions(tmp_path / "m.c3d")


@pytest.mark.slow
def test_what_ends_or_overflows_the_library_is_an_error_like_any_other(tmp_path: Path, monkeypatch):
    (tmp_path / "m.c3d").write_bytes(c3d(tmp_path))
    for child in (
        "import os, signal\nos.kill(os.getpid(), signal.SIGKILL)",
        "print('no arrays')",
        "import sys\nsys.exit(1)",
        "import sys, runpy\nsys.argv[2] = '1000'\nrunpy.run_path({!r}, run_name='__main__')",
        "import resource, sys\nresource.setrlimit(resource.RLIMIT_CPU, (1, 1))\nwhile True: pass",
    ):
        from mocap.formats import c3d as module

        script = tmp_path / "child.py"
        script.write_text(child.format(str(module.__file__).replace("c3d.py", "c3d_child.py")))
        with monkeypatch.context() as patch:
            patch.setattr(module, "CHILD", script)
            with pytest.raises(ExchangeError, match=r"m\.c3d: is damaged and cannot be read"):
                read_positions(tmp_path / "m.c3d")
    assert read_positions(tmp_path / "m.c3d").names == ("ear", "nose")


@pytest.mark.slow
@settings(FUZZ, max_examples=60)
@given(st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=30))
def test_c3d_with_any_bytes_changed_is_read_or_refused(tmp_path: Path, changes):
    data = c3d(tmp_path)
    for place, value in changes:
        data[int(place * (len(data) - 1))] = value
    (tmp_path / "m.c3d").write_bytes(data)
    try:
        found = read_positions(tmp_path / "m.c3d")
    except ExchangeError as error:
        assert "m.c3d" in str(error)
    else:
        assert found.positions.shape == (found.time_s.size, len(found.names), 3)
