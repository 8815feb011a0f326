"""Skeletons in BVH: positions against rotations done by hand, and files that are broken."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mocap.formats.exchange import ExchangeError, MarkerTable, read_positions

ARM = """HIERARCHY
ROOT shoulder
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  JOINT elbow
  {
    OFFSET 10 0 0
    CHANNELS 3 Xrotation Yrotation Zrotation
    End Site
    {
      OFFSET 0 5 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.04
0 0 0 0 0 0 0 0 0
0 0 0 90 90 0 90 0 0
4 0 0 0 0 90 0 0 90
"""


def skeleton(folder: Path, text: str) -> MarkerTable:
    path = folder / "arm.bvh"
    path.write_text(text)
    return read_positions(path)


def test_rotations_are_applied_in_the_order_of_the_channels(tmp_path: Path) -> None:
    table = skeleton(tmp_path, ARM)
    assert table.names == ("shoulder", "elbow", "elbow_end")
    np.testing.assert_allclose(table.time_s, [0, 0.04, 0.08])
    arm = table.positions - table.of("shoulder")[:, None]
    np.testing.assert_allclose(table.of("shoulder"), [[1, 2, 3], [1, 2, 3], [5, 2, 3]])
    np.testing.assert_allclose(arm[0, 1:], [[10, 0, 0], [10, 5, 0]], atol=1e-12)
    # About z, then about the new y, which points to -x: the upper arm points to -z. The forearm,
    # turned about the upper arm, goes from y to z of the elbow: from -x to y.
    np.testing.assert_allclose(arm[1, 1:], [[0, 0, -10], [0, 5, -10]], atol=1e-12)
    # About x the upper arm stays; the forearm turns in the plane of the turned x and y: to -x.
    np.testing.assert_allclose(arm[2, 1:], [[10, 0, 0], [5, 0, 0]], atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("HIERARCHY", "SKELETON", "no BVH file"),
        ("MOTION", "", "cut short"),
        ("OFFSET 10 0 0", "OFFSET 10 0", "broken at joint 'elbow'"),
        ("Xrotation Yrotation Zrotation\n", "Xrotation Yrotation Wrotation\n", "'Wrotation'"),
        ("Frames: 3", "Frames: 4", "announces 4 frames and holds 3"),
        ("4 0 0 0 0 90 0 0 90", "4 0 0 0 0 90", "frame 3 holds 6 values for 9 channels"),
        ("4 0 0 0 0 90 0 0 90", "4 0 0 0 x 90 0 0 90", "line 21: 'x' is no finite number"),
        ("4 0 0 0 0 90 0 0 90", "nan 0 0 0 0 90 0 0 90", "'nan' is no finite"),
        ("4 0 0 0 0 90 0 0 90", "1e10 0 0 0 0 90 0 0 90", "a value of MOTION is 1e.10, too large"),
        ("Frames: 3", f"Frames: {'9' * 5000}", "a number each"),
        ("CHANNELS 3", f"CHANNELS {'9' * 5000}", "broken at joint 'elbow'"),
        ("OFFSET 10 0 0", "OFFSET 10 1_0 0", "broken at joint 'elbow'"),
        (
            "End Site",
            "End Site { OFFSET 0 0 0 " * 90,
            "elbow_end_end_.*…' is one of more",
        ),
        ("End Site", "JOINT a { OFFSET 0 0 0 } " * 6000, "'a' is one of more than 5000"),
        ("JOINT elbow", "JOINT el\x07bow", r"a marker is called 'el\\x07bow'"),
        ("Frame Time: 0.04", "Frame Time: 0", "above zero"),
    ],
)
def test_broken_files_are_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(ExchangeError, match=message):
        skeleton(tmp_path, ARM.replace(old, new, 1))


@given(length=st.integers(0, len(ARM) - 4))
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_file_cut_short_is_refused(tmp_path: Path, length: int) -> None:
    with pytest.raises(ExchangeError):
        skeleton(tmp_path, ARM[:length])
