"""A damaged run directory is named: never shown in silence, never a traceback."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest

from scenarios.cli.main import main
from scenarios.results.increment import SolutionError
from scenarios.results.solution import Solution
from scenarios.results.summary import SUMMARY_FILE
from tests.support.made_up_sip import resealed

FILES = ("history.csv", "fields.h5", "scenario.toml", "motion/motion.csv", SUMMARY_FILE)


@pytest.fixture
def run(run_directory: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(run_directory, tmp_path / "run"))


def cut(file: Path) -> None:
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2])


def flipped(file: Path) -> None:
    data = bytearray(file.read_bytes())
    data[len(data) // 3] ^= 16
    file.write_bytes(bytes(data))


def emptied(file: Path) -> None:
    file.write_bytes(b"")


def removed(file: Path) -> None:
    file.unlink()


def refused(run: Path, capsys: pytest.CaptureFixture[str], name: str) -> str:
    """Return the line with which commands refuse a run directory."""
    lines = set()
    for arguments in (
        ["report", run, "--out", run.parent / "page.html"],
        ["animate", run, "--out", run.parent / "frames.png"],
        ["export", run, "--format", "vtk", "--out", run.parent / "vtk"],
        ["export", run, "--format", "abaqus", "--out", run.parent / "run.inp"],
    ):
        assert main([str(word) for word in arguments]) == 2
        said = capsys.readouterr()
        assert said.out == "" and said.err.count("\n") == 1
        lines.add(said.err)
    assert {path.name for path in run.parent.iterdir()} == {"run"}
    (line,) = lines
    assert (name in line and "again" in line) or "missing" in line
    return line


@pytest.mark.parametrize("damage", [cut, flipped, emptied, removed])
@pytest.mark.parametrize("name", FILES)
def test_a_damaged_file_is_named_by_every_command(
    run: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
    damage: Callable[[Path], None],
) -> None:
    damage(run / name)
    refused(run, capsys, Path(name).name)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("1.1,", "n/a,"),
        ("1.1,", ","),
        ("1.1,", "0.9,"),
        ("1.1,", "nan,"),
        ("1.1,0.1,", "1.1,inf,"),
        ("1.1,0.1,", "1.1,nan,"),
    ],
)
def test_a_history_is_checked_although_its_checksum_fits(
    run: Path, capsys: pytest.CaptureFixture[str], old: str, new: str
) -> None:
    file = run / "history.csv"
    text = file.read_text(encoding="utf-8")
    assert f"\n{old}" in text
    file.write_text(text.replace(f"\n{old}", f"\n{new}", 1), encoding="utf-8")
    refused(resealed(run), capsys, "history.csv")


def test_fields_that_lack_a_dataset_are_damaged(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with h5py.File(run / "fields.h5", "r+") as store:
        del store["contact/upper/arc_mm"]
    refused(resealed(run), capsys, "fields.h5")


def test_a_history_of_another_length_is_damaged(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = run / "history.csv"
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text("".join(lines[:-1]), encoding="utf-8")
    refused(resealed(run), capsys, "different numbers of increments")


def test_another_summary_is_damaged(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = run / SUMMARY_FILE
    summary = json.loads(file.read_text(encoding="utf-8"))
    summary["upper_lip_window_kpa"] = 1.0
    file.write_text(json.dumps(summary), encoding="utf-8")
    refused(run, capsys, SUMMARY_FILE)


def made_by_another_version(run: Path) -> Path:
    file = run / SUMMARY_FILE
    summary = json.loads(file.read_text(encoding="utf-8"))
    file.write_text(json.dumps({**summary, "version": "0.1.7"}), encoding="utf-8")
    return resealed(run)


def test_settings_of_another_version_are_told_as_such(run: Path) -> None:
    file = run / "scenario.toml"
    text = file.read_text(encoding="utf-8")
    file.write_text(text + "[of_another_version]\nkey = 1\n", encoding="utf-8")
    with pytest.raises(SolutionError, match=r"made by drinksim 0\.1\.7.*of_another_version"):
        _ = Solution.load(made_by_another_version(run)).scenario


def test_a_history_of_another_version_is_told_as_such(run: Path) -> None:
    file = run / "history.csv"
    text = file.read_text(encoding="utf-8").replace("time_s,", "time,", 1)
    file.write_text(text, encoding="utf-8")
    with pytest.raises(SolutionError, match=r"made by drinksim 0\.1\.7, and drinksim .* replay it"):
        Solution.load(made_by_another_version(run))


@pytest.mark.parametrize("kept", [0, 1])
def test_a_history_without_an_increment_is_damaged(
    run: Path, capsys: pytest.CaptureFixture[str], kept: int
) -> None:
    file = run / "history.csv"
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text("".join(lines[:kept]), encoding="utf-8")
    assert "holds no increment" in refused(resealed(run), capsys, "history.csv")
