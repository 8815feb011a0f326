"""Files of other programs, made here as these write them: HDF5, Kinovea's own, C3D, BVH."""

from __future__ import annotations

import pickle
from pathlib import Path

import ezc3d
import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mocap.convert import given_tracks
from mocap.formats.c3d import read_c3d, write_c3d
from mocap.formats.exchange import read_positions
from mocap.formats.marker_table import ExchangeError, MarkerTable
from tests.support.foreign_files import (
    FRAMES,
    KVA,
    NODES,
    PLACES,
    deeplabcut_h5,
    hand_labels_h5,
    sleap_h5,
)


@pytest.mark.parametrize("later", [False, True])
def test_sleap_analysis(tmp_path: Path, later: bool) -> None:
    table = read_positions(sleap_h5(tmp_path / "a.analysis.h5", later=later))
    assert table.names == NODES
    assert table.frame is not None
    assert table.frame.tolist() == list(range(FRAMES))
    np.testing.assert_allclose(table.positions[..., :2], PLACES)
    tracks = given_tracks(tmp_path / "a.analysis.h5")
    assert tracks.status[3].tolist() == ["seen", "lost"]


def test_sleap_with_several_tracks(tmp_path: Path) -> None:
    table = read_positions(sleap_h5(tmp_path / "two.h5", tracks=2))
    assert table.names == ("mouse0_ear", "mouse0_nose", "mouse1_ear", "mouse1_nose")
    np.testing.assert_allclose(table.of("mouse1_ear")[:, :2], PLACES[:, 0] + 100)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_deeplabcut(tmp_path: Path, protocol: int) -> None:
    table = read_positions(deeplabcut_h5(tmp_path / "dlc.h5", protocol=protocol))
    assert table.names == NODES
    assert table.frame is not None
    assert table.frame.tolist() == [0, 1, 2, 5, 9, 10]
    right = PLACES.copy()
    right[2] = np.nan
    np.testing.assert_allclose(table.positions[..., :2], right)


def test_deeplabcut_with_several_animals(tmp_path: Path) -> None:
    table = read_positions(deeplabcut_h5(tmp_path / "dlc.h5", animals=("a", "b")))
    assert table.names == ("a_ear", "a_nose", "b_ear", "b_nose")


@pytest.mark.parametrize("animal", ["", "a"])
@pytest.mark.parametrize("whole", [False, True])
def test_labels_set_by_hand_in_deeplabcut_keep_the_frames_of_their_pictures(
    tmp_path: Path, whole: bool, animal: str
) -> None:
    pictures = [("labeled-data", "clip2", f"img{k:04d}.png") for k in (12, 107, 3)]
    if whole:
        pictures = [("/".join(picture),) for picture in pictures]
    values = np.array([[1.5, 2, 3, 4], [np.nan, np.nan, 7, 8], [9, 10, 11, 12]])
    table = read_positions(
        hand_labels_h5(tmp_path / "CollectedData_me.h5", pictures, values, animal=animal)
    )
    assert table.names == NODES
    assert table.frame is not None
    assert table.frame.tolist() == [3, 12, 107]
    np.testing.assert_array_equal(table.positions[..., :2].reshape(3, 4), values[[2, 0, 1]])


def test_labels_of_pictures_without_a_number_are_refused(tmp_path: Path) -> None:
    file = hand_labels_h5(tmp_path / "c.h5", [("a", "b", "first.png")], np.ones((1, 4)))
    with pytest.raises(ExchangeError, match=r"'first\.png' names no frame"):
        read_positions(file)
    with h5py.File(file, "a") as data:
        data["df_with_missing/axis1_label2"][:] = 7
    with pytest.raises(ExchangeError, match=r"c\.h5"):
        read_positions(file)
    with h5py.File(file, "a") as data:
        del data["df_with_missing/axis1_label2"]
    with pytest.raises(ExchangeError, match=r"c\.h5"):
        read_positions(file)


def test_a_data_set_that_holds_less_than_it_announces_is_refused(tmp_path: Path) -> None:
    file = sleap_h5(tmp_path / "huge.h5")
    with h5py.File(file, "a") as data:
        del data["tracks"]
        data.create_dataset("tracks", (1, 2, len(NODES), 10**9), "f8", chunks=True)
    with pytest.raises(ExchangeError, match="holds 0 numbers"):
        read_positions(file)


class Harmful:
    """What a pickle that is run would run."""

    ran = False

    def __reduce__(self):
        return (setattr, (Harmful, "ran", True))


def test_no_pickle_is_run(tmp_path: Path) -> None:
    file = deeplabcut_h5(tmp_path / "dlc.h5")
    for protocol in (0, 4):
        with h5py.File(file, "a") as data:
            stored = np.void(pickle.dumps([("net", "ear", Harmful())], protocol))
            data["df_with_missing/table"].attrs["values_block_0_kind"] = stored
        with pytest.raises(ExchangeError, match="export the CSV"):
            read_positions(file)
    assert not Harmful.ran


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda file: file.write_bytes(b"no HDF5"), "cannot be read as HDF5"),
        (lambda file: h5py.File(file, "w").close(), "neither the tracks of a SLEAP"),
        (lambda file: h5py.File(file, "w").create_group("a").create_dataset("table", data=[1]),
         "cannot be read as HDF5"),
    ],
)  # fmt: skip
def test_other_hdf5_is_refused(tmp_path: Path, make, words: str) -> None:
    make(tmp_path / "other.h5")
    with pytest.raises(ExchangeError, match=words):
        read_positions(tmp_path / "other.h5")


@pytest.mark.parametrize("ending", ["kva", "xml"])
def test_kinovea_annotations(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"film.{ending}"
    file.write_text(KVA)
    table = read_positions(file)
    assert table.names == ("ear", "the nose")
    assert table.frame is not None
    assert table.frame.tolist() == [0, 1, 3]
    np.testing.assert_allclose(table.of("ear")[:, :2], [[100.5, 50.25], [101.5, 51], [103, 52]])
    assert np.isnan(table.of("the nose")[[0, 2]]).all()
    np.testing.assert_allclose(given_tracks(file).of("ear")[0][0], [100.5, 50.25])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<FormatVersion>2.0", "<FormatVersion>1.5", "save it again"),
        ("  <AverageTimeStampsPerFrame>512</AverageTimeStampsPerFrame>\n", "", "save it again"),
        (">512<", ">0<", "not above 0"),
        ("51;1536", "51;1700", "belongs to no frame"),
        ("52;2560", "52;1540", "two points in one frame"),
        ("101.5;51;1536", "101.5;51", "not x;y;t"),
        ("101.5;51;1536", "x;51;1536", "'x' is no finite number"),
        ("KinoveaVideoAnalysis", "Workbook", "first element is 'Workbook'"),
        ("</Tracks>", "", "not readable as XML"),
        ("TrackPoint>", "Point>", "holds no trajectory"),
        ('<?xml version="1.0" encoding="utf-8"?>',
         '<!DOCTYPE k [<!ENTITY a "aaaa">]>', "declares the entity"),
        ('name="ear"', 'name="the nose"', "is there twice"),
    ],
)  # fmt: skip
def test_broken_annotations_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in KVA
    (tmp_path / "film.kva").write_text(KVA.replace(old, new))
    with pytest.raises(ExchangeError, match=words):
        read_positions(tmp_path / "film.kva")


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(at=st.integers(0, len(KVA) - 1), byte=st.integers(1, 126), cut=st.booleans())
def test_damaged_annotations_never_crash_nor_shift_a_frame(
    tmp_path: Path, at: int, byte: int, cut: bool
) -> None:
    text = KVA[:at] if cut else KVA[:at] + chr(byte) + KVA[at + 1 :]
    (tmp_path / "film.kva").write_text(text)
    try:
        table = read_positions(tmp_path / "film.kva")
    except ExchangeError:
        return
    assert len(table.names) >= 1


def test_c3d_with_more_points_than_a_list_of_labels_holds(tmp_path: Path) -> None:
    count = 300
    places = np.random.default_rng(1).uniform(-500, 500, (4, count, 3))
    table = MarkerTable(np.arange(4) / 100, tuple(f"p{k}" for k in range(count)), places, "mm")
    write_c3d(table, tmp_path / "many.c3d")
    again = read_c3d(tmp_path / "many.c3d")
    assert again.names == table.names
    np.testing.assert_allclose(again.positions, places, rtol=1e-6)


def test_c3d_with_doubled_labels_numbers_them(tmp_path: Path) -> None:
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    content["parameters"]["POINT"]["UNITS"]["value"] = ("mm",)
    content["parameters"]["POINT"]["LABELS"]["value"] = ("A", "B", "A", "*1", "*1")
    points = np.ones((4, 5, 3))
    points[0] = np.arange(5)[:, None]
    content["data"]["points"] = points
    content.write(str(tmp_path / "doubled.c3d"))
    table = read_c3d(tmp_path / "doubled.c3d")
    assert table.names == ("A", "B", "A_2", "*1", "*1_2")
    np.testing.assert_allclose(table.positions[0, :, 0], np.arange(5))


def test_bvh_names_may_hold_blanks(tmp_path: Path) -> None:
    (tmp_path / "blanks.bvh").write_text(
        "HIERARCHY\nROOT Left Upper Arm\n{\n OFFSET 1 2 3\n"
        " CHANNELS 3 Xposition Yposition Zposition\n"
        " JOINT lower arm {\n OFFSET 0 1 0\n CHANNELS 0\n End Site\n {\n OFFSET 0 1 0\n }\n }\n}\n"
        "MOTION\nFrames: 2\nFrame Time: 0.04\n0 0 0\n1 0 0\n"
    )
    table = read_positions(tmp_path / "blanks.bvh")
    assert table.names == ("Left Upper Arm", "lower arm", "lower arm_end")
    np.testing.assert_allclose(table.of("lower arm_end")[1], [2, 4, 3])
