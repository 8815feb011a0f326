"""Atomic output: results appear on disk complete or not at all; other files are never removed.

A result directory is filled beside its final place, under a name that ends in ``.partial``, and
renamed when it is complete. Every directory made here holds the file `MARK`; only marked
directories are replaced or removed. The process that fills a directory holds a lock on its mark,
which the operating system releases when the process ends for any reason. Data are flushed to the
disk before a name changes: a name never stands for data that a crash can destroy.

The next claim of a place repairs the remains of a killed process. An incomplete draft is kept, to
be resumed or discarded. If the earlier result was already moved aside, the draft was complete, and
it is moved into place. Drafts of single files carry their process number and are removed when that
process has ended.
"""

from __future__ import annotations

import glob
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from geometry2d.foundation.errors import DrinksimError

PARTIAL = ".partial"
OUTDATED = ".outdated"

MARK = ".drinksim"
"""Every directory made here holds this file; its lock is held while the directory is filled."""

RESULT_MARK = "summary.json"
"""The summary of a result."""


class OutputError(DrinksimError):
    """A place for a result that cannot be used."""


class OutputBusyError(OutputError):
    """Another process is filling the place for a result."""


def place_of(out: Path) -> Path:
    """Return the directory of ``out``; if ``out`` is a link, its target."""
    return out.resolve() if out.is_symlink() else out


def partial_directory(out: Path) -> Path:
    """Return the name of the draft directory of ``out``."""
    place = place_of(out)
    return place.with_name(place.name + PARTIAL)


def check_replaceable(out: Path) -> None:
    """Raise :class:`OutputError` if a directory cannot be written or was not made here."""
    place = place_of(out)
    if not place.name:
        raise OutputError(f"--out {str(out)!r} names no directory of its own: give a new name")
    if place.is_file():
        raise OutputError(f"--out {out} is a file: give a directory")
    if place.is_dir() and any(place.iterdir()) and not _is_ours(place):
        raise OutputError(f"--out {out} holds files that are not results: give another directory")
    for beside in (partial_directory(out), _outdated_directory(place)):
        if beside.exists() and not _is_ours(beside):
            raise OutputError(
                f"{beside} is in the way and was not made by drinksim: rename it, or give another "
                "--out"
            )
    check_writable(place)


def check_writable(out: Path) -> None:
    """Raise :class:`OutputError` if a place cannot be written to."""
    there = next(place for place in out.absolute().parents if place.exists())
    if not there.is_dir():
        raise OutputError(f"--out {out} cannot be written: {there} is a file; choose another place")
    if not os.access(there, os.W_OK):
        raise OutputError(f"--out {out} cannot be written: no permission in {there}")


@contextmanager
def claimed(out: Path) -> Iterator[Path]:
    """Yield the draft directory of ``out``, locked for this process; it is made if it is missing.

    The remains of a killed process are repaired first; an incomplete draft is yielded unchanged.

    Raises
    ------
    OutputError
        If ``out`` may not be replaced.
    OutputBusyError
        If another process is filling it.
    """
    check_replaceable(out)
    partial = partial_directory(out)
    while True:
        partial.mkdir(parents=True, exist_ok=True)
        lock = FileLock(partial / MARK, blocking=False)
        try:
            lock.acquire()
        except Timeout:
            raise OutputBusyError(
                f"another process is writing {out}: wait until it has ended, or give another --out"
            ) from None
        # A process that finished between the two lines above has moved its draft.
        if (partial / MARK).exists():
            break
        lock.release()
    try:
        if _repaired(partial, place_of(out)):
            partial.mkdir(exist_ok=True)
            (partial / MARK).touch()
        yield partial
    finally:
        lock.release()


def put_in_place(partial: Path, out: Path) -> None:
    """Move a complete directory to ``out``; an earlier result is replaced at the last moment."""
    check_replaceable(out)
    place = place_of(out)
    (partial / MARK).touch()
    _sync(partial)
    outdated = _outdated_directory(place)
    remove_directory(outdated)
    if place.exists():
        place.rename(outdated)
    try:
        partial.rename(place)
    except OSError:
        if outdated.exists():
            outdated.rename(place)
        raise
    _sync_names(place.parent)
    remove_directory(outdated)


def remove_directory(folder: Path) -> None:
    """Remove a directory that was made here; others are not changed."""
    if _is_ours(folder):
        # The mark is removed last: after an interrupted removal the directory is still marked.
        empty_directory(folder)
        (folder / MARK).unlink(missing_ok=True)
        folder.rmdir()


def empty_directory(folder: Path) -> None:
    """Remove everything in a directory except its mark."""
    for inside in folder.iterdir():
        if inside.is_dir() and not inside.is_symlink():
            shutil.rmtree(inside)
        elif inside.name != MARK:
            inside.unlink()


@contextmanager
def directory_at_once(out: Path) -> Iterator[Path]:
    """Yield a new directory; it becomes ``out`` if the block succeeds, otherwise it is removed.

    Raises :class:`OutputError`, before the block is entered, if ``out`` may not be replaced.
    """
    with claimed(out) as partial:
        empty_directory(partial)
        try:
            yield partial
            put_in_place(partial, out)
        finally:
            remove_directory(partial)


def copy_directory(source: Path, out: Path) -> None:
    """Copy a directory that was made here; the copy appears complete or not at all."""
    with directory_at_once(out) as partial:
        shutil.copytree(source, partial, ignore=shutil.ignore_patterns(MARK), dirs_exist_ok=True)


@contextmanager
def file_at_once(out: Path) -> Iterator[Path]:
    """Yield the name of a draft file (same ending); it becomes ``out`` if the block succeeds.

    A link is followed: the file that it names is replaced, not the link.
    """
    if out.is_dir():
        raise OutputError(f"--out {out} is a directory: give a file name")
    place = place_of(out)
    check_writable(place)
    place.parent.mkdir(parents=True, exist_ok=True)
    _remove_dead_drafts(place)
    partial = place.with_name(f".{place.stem}{PARTIAL}-{os.getpid()}{place.suffix}")
    try:
        yield partial
        _sync(partial)
        partial.replace(place)
        _sync_names(place.parent)
    finally:
        partial.unlink(missing_ok=True)


def _outdated_directory(place: Path) -> Path:
    return place.with_name(place.name + OUTDATED)


def _is_ours(folder: Path) -> bool:
    return folder.is_dir() and ((folder / MARK).is_file() or not any(folder.iterdir()))


def _repaired(partial: Path, place: Path) -> bool:
    """Restore the names after a killed process; return whether the draft was put in place."""
    outdated = _outdated_directory(place)
    complete = outdated.is_dir() and any(inside.name != MARK for inside in partial.iterdir())
    if outdated.is_dir() and not place.exists():
        (partial if complete else outdated).rename(place)
    remove_directory(outdated)
    return not partial.exists()


def _remove_dead_drafts(place: Path) -> None:
    """Remove drafts of a file whose processes have ended."""
    for draft in place.parent.glob(f".{glob.escape(place.stem)}{PARTIAL}-*{place.suffix}"):
        number = draft.name.removesuffix(place.suffix).rpartition("-")[2]
        if number.isdecimal() and not _is_alive(int(number)):
            draft.unlink(missing_ok=True)


def _is_alive(process: int) -> bool:
    """Whether a process runs; True on systems where asking would end it."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _sync(there: Path) -> None:
    """Write a file, or a directory and all that is in it, to the disk."""
    if there.is_dir():
        for inside in there.iterdir():
            _sync(inside)
        _sync_names(there)
    elif not there.is_symlink():
        # Some systems do not sync a descriptor that is only readable.
        with there.open("rb+") as stream:
            os.fsync(stream.fileno())


def _sync_names(folder: Path) -> None:
    """Flush the names in a directory to the disk, where the system supports it."""
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
