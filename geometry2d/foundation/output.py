"""Results appear on disk whole or not at all.

Work is done beside the wanted place, under a name that ends in ``.partial``, and moved there when
it is complete. What a killed run leaves behind cannot be taken for a result.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from geometry2d.foundation.errors import DrinksimError

PARTIAL = ".partial"
RESULT_MARK = "summary.json"
"""Every finished output directory holds this file; only such a directory is ever replaced."""


class OutputError(DrinksimError):
    """The place for a result cannot be used."""


def partial_directory(out: Path) -> Path:
    """Return the name under which the directory ``out`` is worked on until it is complete."""
    return out.with_name(out.name + PARTIAL)


def check_replaceable(out: Path) -> None:
    """Refuse, with an :class:`OutputError`, a directory that cannot be written or is not ours."""
    if not out.name:
        raise OutputError(f"--out {str(out)!r} names no directory of its own: give a new name")
    if out.is_file():
        raise OutputError(f"--out {out} is a file: give a directory")
    if out.is_dir() and any(out.iterdir()) and not (out / RESULT_MARK).is_file():
        raise OutputError(f"--out {out} holds files that are not results: give another directory")
    check_writable(out)


def check_writable(out: Path) -> None:
    """Refuse, with an :class:`OutputError`, a place that could not be written to."""
    there = next(place for place in out.absolute().parents if place.exists())
    if not there.is_dir():
        raise OutputError(f"--out {out} cannot be written: {there} is a file; choose another place")
    if not os.access(there, os.W_OK):
        raise OutputError(f"--out {out} cannot be written: no permission in {there}")


def put_in_place(partial: Path, out: Path) -> None:
    """Move a complete directory to ``out``; an earlier result gives way at the last moment."""
    check_replaceable(out)
    if out.exists():
        outdated = out.with_name(out.name + ".outdated")
        shutil.rmtree(outdated, ignore_errors=True)
        out.rename(outdated)
        partial.rename(out)
        shutil.rmtree(outdated)
    else:
        partial.rename(out)


@contextmanager
def directory_at_once(out: Path) -> Iterator[Path]:
    """Yield a new directory to fill; it becomes ``out`` if the block succeeds and else disappears.

    Raises :class:`OutputError`, before the block is entered, if ``out`` may not be replaced.
    """
    check_replaceable(out)
    partial = partial_directory(out)
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    try:
        yield partial
        put_in_place(partial, out)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


@contextmanager
def file_at_once(out: Path) -> Iterator[Path]:
    """Yield the name of a file to write (same ending); it becomes ``out`` if the block succeeds."""
    if out.is_dir():
        raise OutputError(f"--out {out} is a directory: give a file name")
    check_writable(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    partial = out.with_name(f".{out.stem}{PARTIAL}{out.suffix}")
    try:
        yield partial
        partial.replace(out)
    finally:
        partial.unlink(missing_ok=True)
