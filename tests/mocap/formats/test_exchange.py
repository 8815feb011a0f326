"""Other programs' files: read as they are found, written and read back, refused when broken."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mocap.formats.c3d import read_c3d, write_c3d
from mocap.formats.exchange import (
    read_positions,
    table_from,
    tracks_from,
)
from mocap.formats.marker_table import ExchangeError, MarkerTable, plane_positions
from mocap.formats.trc import read_trc, write_trc

FUZZ = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def table(frames: int = 7, unit: str = "mm") -> MarkerTable:
    rng = np.random.default_rng(2)
    positions = rng.uniform(-500, 500, (frames, 3, 3)).round(4)
    positions[2, 1] = np.nan
    return MarkerTable(np.arange(frames) / 50, ("ear", "nose", "package_lower"), positions, unit)


def test_round_trip_through_trc(tmp_path: Path) -> None:
    path = tmp_path / "m.trc"
    write_trc(table(), path)
    again = read_positions(path)
    assert again.names == table().names and again.unit == "mm"
    np.testing.assert_allclose(again.time_s, table().time_s, atol=1e-9)
    np.testing.assert_allclose(again.positions, table().positions, atol=1e-6)


def test_round_trip_through_c3d(tmp_path: Path) -> None:
    path = tmp_path / "m.c3d"
    write_c3d(table(), path)
    again = read_positions(path)
    assert again.names == table().names and again.unit == "mm"
    np.testing.assert_allclose(again.time_s, table().time_s, atol=1e-9)
    # C3D keeps single precision.
    np.testing.assert_allclose(again.positions, table().positions, rtol=1e-6)


def test_c3d_needs_an_even_rate(tmp_path: Path) -> None:
    uneven = MarkerTable(np.array([0, 0.02, 0.05]), ("a",), np.zeros((3, 1, 3)), "mm")
    with pytest.raises(ExchangeError, match=r"even rate.*0\.02 to 0\.03 s"):
        write_c3d(uneven, tmp_path / "m.c3d")


def test_analogue_channels_beside_the_points_of_a_c3d_file_are_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "m.c3d"
    write_c3d(table(12), path)
    content = ezc3d.c3d(str(path))
    content["parameters"]["ANALOG"]["LABELS"]["value"] = ["force plate", "muscle"]
    content["parameters"]["ANALOG"]["RATE"]["value"] = [500.0]  # ten samples a frame
    content["data"]["analogs"] = np.random.default_rng(3).normal(size=(1, 2, 120))
    content.write(str(path))
    np.testing.assert_allclose(read_c3d(path).positions, table(12).positions, rtol=1e-6)


def test_a_real_c3d_file(tmp_path: Path, recorded: Callable[[str], Path]) -> None:
    found = read_positions(recorded("formats/markers_analogs.c3d"))
    assert found.positions.shape == (580, 51, 3)
    assert found.names[0] == "boite:gauche_ext"
    np.testing.assert_allclose(
        found.positions[0, 0], [44.16278839, -276.86193848, 675.69683838], rtol=1e-6
    )
    assert found.rate_hz == pytest.approx(100)
    write_trc(found, tmp_path / "m.trc")
    np.testing.assert_allclose(read_trc(tmp_path / "m.trc").positions, found.positions, atol=1e-6)


def test_a_comma_separated_trc_that_was_cut(tmp_path: Path) -> None:
    path = tmp_path / "m.trc"
    write_trc(table(9), path)
    lines = path.read_text().replace("\t", ",").splitlines(keepends=True)
    path.write_text("".join(lines[:-2]))
    with pytest.raises(ExchangeError, match="announces 9 frames and holds 7"):
        read_positions(path)
    found = read_trc(path, partial=True)
    np.testing.assert_allclose(found.positions, table(9).positions[:7], atol=1e-6)


def test_a_real_comma_separated_trc_that_was_cut(
    tmp_path: Path, recorded: Callable[[str], Path]
) -> None:
    path = recorded("formats/markers.trc")
    with pytest.raises(ExchangeError, match="announces 652 frames and holds 93"):
        read_positions(path)
    found = read_trc(path, partial=True)
    assert found.positions.shape == (93, 51, 3)
    np.testing.assert_allclose(found.of("ASISl")[0], [733.7041, 80.9832, 191.8668])
    write_c3d(found, tmp_path / "m.c3d")
    np.testing.assert_allclose(read_c3d(tmp_path / "m.c3d").positions, found.positions, rtol=1e-6)


def test_the_plane_is_that_of_two_axes_of_the_file() -> None:
    metres = table(unit="m")
    x, y, z = np.moveaxis(1000 * metres.positions, -1, 0)
    np.testing.assert_array_equal(
        plane_positions(metres, right="-Z", up="-X"), np.stack([-z, -x], axis=-1)
    )
    np.testing.assert_array_equal(
        plane_positions(metres, right="+X", up="Y"), np.stack([x, y], axis=-1)
    )
    with pytest.raises(ExchangeError, match="axis 'W'"):
        plane_positions(metres, right="W", up="X")


def test_a_real_drinking_task_in_the_plane_of_the_face(recorded: Callable[[str], Path]) -> None:
    found = read_positions(recorded("idrink/S240501-1155_P07_T01_0-394_filt_butterworth.trc"))
    assert found.positions.shape == (394, 13, 3) and found.unit == "m"
    assert found.rate_hz == pytest.approx(60)
    plane = plane_positions(found, right="-Z", up="-X")
    nose, ear = (plane[:, found.names.index(name)] for name in ("Nose", "REar"))
    # The nose lies in front of the ear, by about the size of a head.
    assert np.all((nose - ear)[:, 0] > 60)
    assert np.all(np.hypot(*(nose - ear).T) < 250)


def test_a_real_tracker_export(recorded: Callable[[str], Path]) -> None:
    found = read_positions(recorded("projectile/massa_A.txt"))
    assert found.names == ("massa_A",)
    np.testing.assert_allclose(found.positions[1, 0], [0.947, -0.999, 0.0])


def test_tracker_with_two_masses_and_commas(tmp_path: Path) -> None:
    path = tmp_path / "t.txt"
    path.write_text(",A,,B,\nt,x,y,x,y\n0,1,2,3,4\n0.1,1.5,2.5,,\n")
    found = read_positions(path)
    assert found.names == ("A", "B")
    np.testing.assert_allclose(found.positions[:, 0, :2], [[1, 2], [1.5, 2.5]])
    assert np.isnan(found.positions[1, 1]).all()


def test_deeplabcut(tmp_path: Path) -> None:
    path = tmp_path / "d.csv"
    path.write_text(
        "scorer,net,net,net,net,net,net\n"
        "bodyparts,ear,ear,ear,nose,nose,nose\n"
        "coords,x,y,likelihood,x,y,likelihood\n"
        "0,1.5,2.5,0.99,3.5,4.5,0.9\n"
        "1,1.6,2.6,0.99,9.9,9.9,0.1\n"
    )
    found = read_positions(path)
    assert found.names == ("ear", "nose") and found.unit == "px"
    np.testing.assert_allclose(found.positions[0, :, :2], [[1.5, 2.5], [3.5, 4.5]])
    assert np.isnan(found.positions[1, 1]).all()
    tracks = tracks_from(found)
    assert list(tracks.status[:, 1]) == ["seen", "lost"]
    np.testing.assert_array_equal(tracks.frame, [0, 1])


@pytest.mark.parametrize(
    "text",
    [
        '"Time (ms)","ear/X (px)","ear/Y (px)"\n0,10.5,20.5\n40,11.5,21.5\n',
        "Time (ms);ear X;ear Y\n0;10,5;20,5\n40;11,5;21,5\n",
        "Time (s)\tear:x\tear:y\n0\t10.5\t20.5\n0.04\t11.5\t21.5\n",
    ],
)
def test_kinovea_tables(tmp_path: Path, text: str) -> None:
    path = tmp_path / "k.csv"
    path.write_text(text)
    found = read_positions(path)
    assert found.names == ("ear",)
    np.testing.assert_allclose(found.time_s, [0, 0.04])
    np.testing.assert_allclose(found.positions[:, 0, :2], [[10.5, 20.5], [11.5, 21.5]])


def test_kinovea_trajectories(tmp_path: Path) -> None:
    path = tmp_path / "k.txt"
    path.write_text(
        "#Kinovea Trajectory data export\n#T X Y\n\n# ear\n0 1 2\n40 1.5 2.5\n\n# nose\n40 7 8\n"
    )
    found = read_positions(path)
    assert found.names == ("ear", "nose")
    np.testing.assert_allclose(found.time_s, [0, 0.04])
    assert np.isnan(found.positions[0, 1]).all()
    np.testing.assert_allclose(found.positions[1, 1], [7, 8, 0])


def test_pixel_origins_differ_by_half_a_pixel() -> None:
    px = table(unit="px")
    centre, corner = tracks_from(px), tracks_from(px, corner_origin=True)
    np.testing.assert_allclose((centre.position_px - corner.position_px)[0], 0.5)
    upward = tracks_from(px, height_px=720)
    np.testing.assert_allclose(upward.position_px[..., 1], 720 - px.positions[..., 1])
    np.testing.assert_allclose(table_from(centre).positions[..., :2], px.positions[..., :2])
    with pytest.raises(ExchangeError, match="positions are in mm"):
        tracks_from(table())


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.xyz", "1 2 3", "ending .xyz is not known"),
        ("a.trc", "nothing", "is no TRC file"),
        ("a.c3d", "nothing", "is no C3D file"),
        ("a.csv", "", "has no header line"),
        ("a.csv", "scorer,n\nbodyparts,a\ncoords,x\n0,1\n", "0 columns y"),
        ("a.csv", "scorer,n,n\nindividuals,i,i\nbodyparts,a,a\ncoords,x,y\n", "holds no frame"),
        ("a.csv", "Time (ms),speed\n0,1\n", "no columns X and Y"),
        ("a.csv", "Time (ms),a/X,a/Y\n0,1,2\n0,1,2\n", "not after the one before"),
        ("a.csv", "Time (ms),a/X,a/Y\n0,1\n40,1,2\n", "line 2: has 2 cells"),
        ("a.csv", "Time (ms),a/X,a/Y\n0,1,inf\n", "'inf', not a finite number"),
        ("a.txt", "t\tx\ty\n0\t1\tmany\n", "line 2: column 3 is 'many'"),
        ("a.txt", "#Kinovea Trajectory data export\n0 1\n", "line 2"),
    ],
)
def test_broken_files_are_named(tmp_path: Path, name: str, text: str, words: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(ExchangeError) as caught:
        read_positions(path)
    assert words in str(caught.value) and name in str(caught.value)


def test_missing_and_doubled_rows_of_trc_are_found(tmp_path: Path) -> None:
    path = tmp_path / "m.trc"
    write_trc(table(), path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:8] + lines[9:]) + "\n")
    with pytest.raises(ExchangeError, match="announces 7 frames and holds 6"):
        read_positions(path)
    path.write_text("\n".join(lines[:8] + lines[7:8] + lines[9:]) + "\n")
    with pytest.raises(ExchangeError, match="not after the one before"):
        read_positions(path)


@FUZZ
@given(cut=st.integers(0, 100_000), kind=st.sampled_from(["m.trc", "m.c3d"]))
def test_files_cut_short_are_refused(tmp_path: Path, cut: int, kind: str) -> None:
    whole = tmp_path / f"whole_{kind}"
    if not whole.exists():
        (write_trc if kind.endswith("trc") else write_c3d)(table(12), whole)
    data = whole.read_bytes()
    # Without its last line a TRC file lacks a frame; C3D may be padded at its end by 512 bytes.
    at = cut % (len(data) - (80 if kind.endswith("trc") else 512))
    path = tmp_path / kind
    path.write_bytes(data[:at])
    with pytest.raises(ExchangeError) as caught:
        read_positions(path)
    assert kind in str(caught.value)


@FUZZ
@given(
    kind=st.sampled_from(["m.trc", "k.csv", "d.csv", "t.txt"]),
    at=st.integers(0, 500),
    removed=st.integers(0, 30),
    inserted=st.text(max_size=8),
)
def test_damaged_text_is_read_or_refused_but_never_crashes(
    tmp_path: Path, kind: str, at: int, removed: int, inserted: str
) -> None:
    texts = {
        "k.csv": "Time (ms),ear/X,ear/Y\n" + "".join(f"{40 * k},{k},{2 * k}\n" for k in range(9)),
        "d.csv": "scorer,n,n\nbodyparts,a,a\ncoords,x,y\n"
        + "".join(f"{k},{k}.5,1\n" for k in range(9)),
        "t.txt": "\tA\t\nt\tx\ty\n" + "".join(f"{k}\t{k}\t1\n" for k in range(9)),
    }
    if kind == "m.trc":
        write_trc(table(), tmp_path / "good.trc")
        text = (tmp_path / "good.trc").read_text()
    else:
        text = texts[kind]
    path = tmp_path / kind
    path.write_text(text[:at] + inserted + text[at + removed :], encoding="utf-8", newline="")
    try:
        found = read_positions(path)
    except ExchangeError as error:
        assert kind in str(error)
    else:
        assert np.all(np.diff(found.time_s) > 0)
        assert found.positions.shape == (found.time_s.size, len(found.names), 3)
