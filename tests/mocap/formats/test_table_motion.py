"""Positions in space, as other systems measure them, become the motion of head and package."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geometry2d.rigid import rotated
from mocap.formats.c3d import write_c3d
from mocap.formats.marker_table import ExchangeError, MarkerTable
from mocap.formats.table_motion import (
    PositionOptions,
    motion_in_plane,
)
from mocap.formats.trc import write_trc
from mocap.motion.motion import Motion
from scenarios.cli.main import main

TIME = np.arange(150) / 100
NOISE_MM = 0.05
NAMES = ("ear", "nose", "package_lower", "package_upper")


def sip(*, noise_mm: float = NOISE_MM, across_mm: float = 0.0) -> tuple[MarkerTable, np.ndarray]:
    """A sip in the plane of x and y, mm, and the package's motion (n, 3) from the head."""
    s = np.sin(np.pi * TIME / TIME[-1]) ** 2
    head, angle = np.column_stack([4 * s, -2 * s]), np.radians(8) * s
    away = np.column_stack([175 - 60 * s, -45 + 20 * s])
    turn = np.radians(-45) * s
    ear, lower = head, head + rotated(away, angle)
    plane = np.stack(
        [
            ear,
            ear + rotated(np.array([102.0, 12.0]), angle),
            lower,
            lower + rotated(np.array([0.0, 14.0]), angle + turn),
        ],
        axis=1,
    )
    z = across_mm * s[:, None, None] * np.array([0, 0, 1, 1])[None, :, None]
    places = np.concatenate([plane, z], axis=2)
    places += np.random.default_rng(2).normal(0, noise_mm, places.shape)
    return MarkerTable(TIME, NAMES, places, "mm"), np.column_stack([away, turn])


def errors(motion: Motion, right: np.ndarray) -> np.ndarray:
    turn = motion.relative_rad - (right[:, 2] - right[0, 2])
    return np.column_stack([motion.relative_mm - right[:, :2], turn])


def test_the_motion_is_found_with_honest_errors() -> None:
    table, right = sip()
    found = motion_in_plane(table, PositionOptions())
    off = errors(found.motion, right)
    assert np.sqrt(np.mean(off[:, :2] ** 2)) < 0.06
    assert np.mean(np.abs(off[1:]) < 3 * found.motion.sigma[1:]) > 0.95
    assert np.median(found.motion.sigma[:, 0]) < 4 * NOISE_MM
    assert found.warnings == ()


@pytest.mark.parametrize(("right", "up"), [("Z", "Y"), ("-Z", "+X"), ("Y", "-Z")])
def test_any_two_axes_span_the_plane(right: str, up: str) -> None:
    table, truth = sip()
    columns = {"XYZ".index(axis[-1]): (k, -1 if axis[0] == "-" else 1)
               for k, axis in enumerate((right, up))}  # fmt: skip
    (other,) = {0, 1, 2} - columns.keys()
    turned = np.empty_like(table.positions)
    turned[..., other] = table.positions[..., 2]
    for column, (k, sign) in columns.items():
        turned[..., column] = sign * table.positions[..., k]
    found = motion_in_plane(replace(table, positions=turned), PositionOptions(right=right, up=up))
    assert np.abs(errors(found.motion, truth)[:, :2]).max() < 0.3


def test_a_person_who_faces_left_is_mirrored_and_told() -> None:
    table, right = sip()
    found = motion_in_plane(
        replace(table, positions=table.positions * [-1.0, 1.0, 1.0]), PositionOptions()
    )
    assert np.abs(errors(found.motion, right)[:, :2]).max() < 0.3
    assert "faces left" in found.warnings[0]


def test_a_way_across_the_plane_is_told() -> None:
    table, _ = sip(across_mm=30.0)
    (warning,) = motion_in_plane(table, PositionOptions()).warnings
    assert "30 mm along Z" in warning


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"head": "ear,chin"}, "no marker 'chin'.*among ear, nose"),
        ({"up": "X"}, "are one axis"),
        ({"right": "W"}, "axis 'W'"),
    ],
)
def test_what_makes_no_sense_is_refused(change, message: str) -> None:
    with pytest.raises(ExchangeError, match=message):
        motion_in_plane(sip()[0], replace(PositionOptions(), **change))


@pytest.mark.parametrize("ending", ["c3d", "trc"])
def test_from_the_command_line(tmp_path: Path, ending: str, capsys) -> None:
    table, right = sip()
    renamed = replace(table, names=("R.EAR", "NOSE tip", "low", "up"))
    file = tmp_path / f"sip.{ending}"
    {"c3d": write_c3d, "trc": write_trc}[ending](renamed, file)
    out = tmp_path / "out"
    options = ["--head", "R.EAR,NOSE tip", "--package", "low,up", "--end", "1.2", "--out", str(out)]
    assert main(["convert", str(file), *options]) == 0
    motion = Motion.read(out / "motion.csv")
    assert motion.time_s[-1] == pytest.approx(1.2, abs=0.02)
    assert np.abs(errors(motion, right[: motion.time_s.size])[:, :2]).max() < 0.3
    assert motion.head_body.markers == ("R.EAR", "NOSE tip")
    assert (out / "boundary_conditions" / "relative_u1.txt").is_file()


BVH = """HIERARCHY
ROOT Head
{
  OFFSET 0 0 0
  CHANNELS 3 Xposition Yposition Zposition
  JOINT Right Hand
  {
    OFFSET 17 -4 0
    CHANNELS 3 Xposition Yposition Zposition
  }
}
MOTION
"""


def test_a_skeleton_needs_its_unit(tmp_path: Path, capsys) -> None:
    s = np.sin(np.pi * np.arange(80) / 79) ** 2
    rows = [f"0 0 0 {-6 * a:.6f} {2 * a:.6f} 0" for a in s]
    file = tmp_path / "drink.bvh"
    file.write_text(f"{BVH}Frames: 80\nFrame Time: 0.0125\n" + "\n".join(rows) + "\n")
    options = ["--head", "Head", "--package", "Right Hand", "--out", str(tmp_path / "out")]
    assert main(["convert", str(file), *options]) == 2
    assert "no unit" in capsys.readouterr().err
    assert main(["convert", str(file), *options, "--unit", "cm"]) == 0
    motion = Motion.read(tmp_path / "out" / "motion.csv")
    assert np.ptp(motion.relative_mm[:, 0]) == pytest.approx(60, abs=0.5)


def test_options_of_films_and_of_positions_are_not_mixed(tmp_path: Path, capsys) -> None:
    out = str(tmp_path / "out")
    assert main(["convert", "a.mp4", "--head", "ear", "--out", out]) == 2
    assert "for positions in space" in capsys.readouterr().err
    assert main(["convert", "a.trc", "--fps", "30", "--out", out]) == 2
    assert "is for films" in capsys.readouterr().err
