"""Dialects of other programs: their own frame numbers, several animals, odd separators, names.

Each text is of our own making, after the layout that the program's documentation describes.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mocap.convert import given_tracks
from mocap.formats.exchange import read_positions
from mocap.formats.marker_table import ExchangeError
from mocap.tracking.tracks import TracksError, placed_by_time
from tests.mocap.formats.test_exchange import table


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_deeplabcut_rows_keep_their_own_frames(tmp_path: Path) -> None:
    header = "scorer,n,n\nbodyparts,ear,ear\ncoords,x,y\n"
    path = written(tmp_path, "d.csv", header + "3,1,2\n4,1,2\n20,5,6\n21,5,6\n90,7,8\n")
    np.testing.assert_array_equal(given_tracks(path).frame, [3, 4, 20, 21, 90])
    with pytest.raises(ExchangeError, match=r"2\.5"):
        given_tracks(written(tmp_path, "half.csv", header + "2.5,1,2\n"))


def test_deeplabcut_labels_of_single_pictures(tmp_path: Path) -> None:
    text = (
        "scorer,,,me,me\nbodyparts,,,ear,ear\ncoords,,,x,y\n"
        "labeled-data,clip2,img0012.png,1,2\nlabeled-data,clip2,img0107.png,,\n"
    )
    found = given_tracks(written(tmp_path, "CollectedData_me.csv", text))
    np.testing.assert_array_equal(found.frame, [12, 107])
    assert found.status[:, 0].tolist() == ["seen", "lost"]
    joined = text.replace("labeled-data,clip2,img", "labeled-data/clip2/img").replace(",,,", ",")
    np.testing.assert_array_equal(given_tracks(written(tmp_path, "j.csv", joined)).frame, [12, 107])


def test_deeplabcut_with_several_animals(tmp_path: Path) -> None:
    text = (
        "scorer,n,n,n,n\nindividuals,a,a,b,b\nbodyparts,ear,ear,ear,ear\n"
        "coords,x,y,x,y\n0,1,2,3,4\n"
    )
    found = read_positions(written(tmp_path, "m.csv", text))
    assert found.names == ("a_ear", "b_ear")
    alone = text.replace("b,b", "a,a").replace("ear,ear,ear,ear", "ear,ear,nose,nose")
    assert read_positions(written(tmp_path, "a.csv", alone)).names == ("ear", "nose")


def test_sleap(tmp_path: Path) -> None:
    text = (
        "track,frame_idx,instance.score,ear.x,ear.y,ear.score,nose.x,nose.y,nose.score\n"
        ",7,0.9,1,2,0.9,3,4,0.9\n,9,0.9,1.5,2.5,0.9,,,\n"
    )
    found = given_tracks(written(tmp_path, "s.csv", text))
    assert found.names == ("ear", "nose")
    np.testing.assert_array_equal(found.frame, [7, 9])
    assert found.status[1].tolist() == ["seen", "lost"]
    two = text.replace("\n,7", "\nleft,7").replace("\n,9", "\nright,9")
    assert read_positions(written(tmp_path, "t.csv", two)).names == (
        "left_ear",
        "left_nose",
        "right_ear",
        "right_nose",
    )
    doubled = text.replace(",9,", ",7,")
    with pytest.raises(ExchangeError, match="frame 7 is there twice"):
        read_positions(written(tmp_path, "d.csv", doubled))


def test_kinovea_quotes_its_headings(tmp_path: Path) -> None:
    path = written(tmp_path, "k.csv", '"Time","ear X","ear Y"\n0.2,1,2\n0.24,3,4\n')
    found = read_positions(path)
    np.testing.assert_allclose(found.time_s, [0.2, 0.24])
    assert given_tracks(path).names == ("ear",)


@pytest.mark.parametrize("end", ["", "\t"])
def test_tracker_ends_its_lines_with_a_separator(tmp_path: Path, end: str) -> None:
    text = f"ear\t\t\t\t{end}\nt\tx\ty\tpixelx\tpixely{end}\n0.0\t.1\t.2\t101.5\t52.5{end}\n"
    found = given_tracks(written(tmp_path, "t.txt", text))
    assert found.names == ("ear",)
    np.testing.assert_allclose(found.position_px[0, 0], [101.0, 52.0])


def test_trc_separated_by_blanks_or_with_more_names_than_it_announces(tmp_path: Path) -> None:
    from mocap.formats.trc import write_trc

    whole = replace(table(), positions=np.nan_to_num(table().positions))
    write_trc(whole, tmp_path / "tabs.trc")
    tabs = (tmp_path / "tabs.trc").read_text()
    blanks = written(tmp_path, "blanks.trc", tabs.replace("\t\t\t", " ").replace("\t", " "))
    found = read_positions(blanks)
    assert found.names == whole.names
    known = np.isfinite(whole.positions)
    np.testing.assert_allclose(found.positions[known], whole.positions[known], atol=1e-6)
    count = len(whole.names)
    fewer = tabs.replace(f"\t{len(whole.time_s)}\t{count}\t", f"\t{len(whole.time_s)}\t1\t", 1)
    assert read_positions(written(tmp_path, "cortex.trc", fewer)).names == whole.names


def test_rows_with_times_are_placed_by_them_or_refused() -> None:
    from tests.support.made_up_tracks import seen_at

    frames, times = np.arange(40, 60), np.arange(40, 60) / 30 + 0.001
    given = seen_at(np.array([1.4333, 1.6, 1.6333]))
    placed = placed_by_time(given, frames, times)
    np.testing.assert_array_equal(placed.frame, [43, 48, 49])
    with pytest.raises(TracksError, match=r"1\.45"):
        placed_by_time(seen_at(np.array([1.4333, 1.45])), frames, times)
    with pytest.raises(TracksError, match="two rows"):
        placed_by_time(seen_at(np.array([1.4333, 1.4345])), frames, times)
