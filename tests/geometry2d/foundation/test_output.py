"""Results appear whole or not at all, one process at a time, and nothing foreign is removed."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from geometry2d.foundation.output import (
    MARK,
    OutputBusyError,
    OutputError,
    claimed,
    directory_at_once,
    file_at_once,
    partial_directory,
    put_in_place,
    remove_directory,
)

HOLD = """
import sys
from pathlib import Path
from geometry2d.foundation.output import claimed
with claimed(Path(sys.argv[1])) as draft:
    (draft / "theirs").write_text("half")
    print("held", flush=True)
    sys.stdin.read()
"""


@contextmanager
def another_process_fills(out: Path) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(out)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        try:
            yield process
        finally:
            process.kill()


def filled(out: Path, text: str) -> None:
    with directory_at_once(out) as draft:
        (draft / "result").write_text(text)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_result_replaces_the_one_before(tmp_path):
    out = tmp_path / "out"
    filled(out, "first")
    filled(out, "second")
    assert (out / "result").read_text() == "second"
    assert names(tmp_path) == {"out"}


def test_a_failure_leaves_the_result_before(tmp_path):
    out = tmp_path / "out"
    filled(out, "first")
    with pytest.raises(ZeroDivisionError), directory_at_once(out) as draft:
        (draft / "result").write_text("second")
        raise ZeroDivisionError
    assert (out / "result").read_text() == "first"
    assert names(tmp_path) == {"out"}


def test_two_processes_do_not_fill_one_place(tmp_path):
    out = tmp_path / "out"
    with another_process_fills(out):
        with pytest.raises(OutputBusyError, match="another process is writing"):
            filled(out, "mine")
        assert (partial_directory(out) / "theirs").read_text() == "half"
    filled(out, "mine")  # a dead owner keeps no lock
    assert names(out) == {MARK, "result"}


def test_a_draft_outlives_its_killed_process(tmp_path):
    out = tmp_path / "out"
    with another_process_fills(out) as process:
        process.kill()
        process.wait()
    with claimed(out) as draft:
        assert (draft / "theirs").read_text() == "half"


@pytest.mark.parametrize("name", ["out", "out.partial", "out.outdated"])
def test_what_is_not_ours_is_left_alone(tmp_path, name):
    theirs = tmp_path / name
    theirs.mkdir()
    (theirs / "diary").write_text("mine")
    with pytest.raises(OutputError):
        filled(tmp_path / "out", "result")
    remove_directory(theirs)
    assert (theirs / "diary").read_text() == "mine"
    assert names(tmp_path) == {name}


@pytest.mark.parametrize("replaced", ["moved aside", "in place"])
def test_killed_while_names_change(tmp_path, monkeypatch, replaced):
    """Whatever rename is the last one, the next claim finds the new result, or the old one."""
    out = tmp_path / "out"
    filled(out, "first")

    class Killed(BaseException):
        pass

    rename = Path.rename

    def killed_after(self: Path, target: Path) -> Path:
        moved = rename(self, target)
        if (target.name == "out.outdated") == (replaced == "moved aside"):
            raise Killed
        return moved

    with claimed(out) as draft:
        (draft / "result").write_text("second")
        monkeypatch.setattr(Path, "rename", killed_after)
        with pytest.raises(Killed):
            put_in_place(draft, out)
        monkeypatch.undo()
    with claimed(out) as draft:
        assert names(draft) == {MARK}
        assert (out / "result").read_text() == "second"
        remove_directory(draft)
    assert names(tmp_path) == {"out"}


def test_a_rename_that_fails_brings_the_old_result_back(tmp_path, monkeypatch):
    out = tmp_path / "out"
    filled(out, "first")
    rename = Path.rename

    def refused(self: Path, target: Path) -> Path:
        if self.name == "out.partial":
            raise OSError("no space left on device")
        return rename(self, target)

    with pytest.raises(OSError, match="no space"), directory_at_once(out) as draft:
        (draft / "result").write_text("second")
        monkeypatch.setattr(Path, "rename", refused)
    monkeypatch.undo()
    assert (out / "result").read_text() == "first"
    assert names(tmp_path) == {"out"}


def test_a_link_to_a_directory_stays_a_link(tmp_path):
    target = tmp_path / "elsewhere" / "target"
    filled(target, "first")
    out = tmp_path / "out"
    out.symlink_to(target)
    filled(out, "second")
    assert out.is_symlink()
    assert (target / "result").read_text() == "second"


def test_a_link_to_a_file_stays_a_link(tmp_path):
    target, out = tmp_path / "target.txt", tmp_path / "out.txt"
    target.write_text("first")
    out.symlink_to(target)
    with file_at_once(out) as draft:
        draft.write_text("second")
    assert out.is_symlink()
    assert target.read_text() == "second"


def test_drafts_of_dead_processes_go(tmp_path):
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    dead = tmp_path / f".page.partial-{ended.pid}.html"
    living = tmp_path / f".page.partial-{os.getppid()}.html"
    foreign = tmp_path / ".page.partial-notes.html"
    for file in (dead, living, foreign):
        file.write_text("half")
    with file_at_once(tmp_path / "page.html") as draft:
        draft.write_text("whole")
    assert names(tmp_path) == {living.name, foreign.name, "page.html"}
