"""Progress of long computations, as one line on a terminal or in a notebook."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[float, str], None]
"""A function of the share that is done (0…1) and of what is being done."""

ProgressOption = bool | Progress | None
"""Option of a long function: True for the line, a function, or None or False for nothing."""

Warn = Callable[[str], None]
"""A function of something odd, in words, that is told when it is found."""

BAR_WIDTH = 24
SECONDS_BETWEEN_UPDATES = 0.1


def no_progress(share: float, text: str) -> None:
    """Show progress to nobody."""


def silent(text: str) -> None:
    """Tell a warning to nobody."""


def each_once(warn: Warn) -> Warn:
    """Return what tells a warning only the first time.

    >>> told = each_once(print)
    >>> told("odd"), told("odd")
    odd
    (None, None)
    """
    said: set[str] = set()

    def tell(text: str) -> None:
        if text not in said:
            said.add(text)
            warn(text)

    return tell


@contextmanager
def chosen_progress(option: ProgressOption, title: str) -> Iterator[Progress]:
    """Yield the progress function of an option; ``title`` is the start of its line.

    >>> with chosen_progress(lambda share, text: print(f"{share:.0%} {text}"), "run") as show:
    ...     show(0.5, "half of it")
    50% half of it
    """
    if callable(option):
        yield option
    elif option:
        with progress_line(title) as show:
            yield show
    else:
        yield no_progress


def part_of(progress: Progress, start: float, end: float, *, title: str = "") -> Progress:
    """Return the progress of a part of the work between two shares of the whole.

    ``title`` stands before what is being done.

    >>> part_of(lambda share, text: print(f"{share:.0%} {text}"), 0.5, 1.0)(0.5, "half of half")
    75% half of half
    """
    before = f"{title}, " if title else ""
    return lambda share, text: progress(start + (end - start) * share, before + text)


@contextmanager
def progress_line(title: str) -> Iterator[Progress]:
    """Yield a function that shows progress on stderr if that is a terminal or a notebook."""
    if not (sys.stderr.isatty() or "ipykernel" in sys.modules):
        yield no_progress
        return
    shown_at = 0.0
    started = time.monotonic()

    def show(share: float, text: str) -> None:
        nonlocal shown_at
        now = time.monotonic()
        if now - shown_at < SECONDS_BETWEEN_UPDATES and share < 1.0:
            return
        shown_at = now
        sys.stderr.write("\r\x1b[K" + _line(title, share, text, now - started))
        sys.stderr.flush()

    try:
        yield show
    finally:
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()


def _line(title: str, share: float, text: str, elapsed_s: float) -> str:
    """Return the line, no longer than the terminal is wide."""
    share = min(max(share, 0.0), 1.0)
    filled = round(share * BAR_WIDTH)
    bar = "━" * filled + "╌" * (BAR_WIDTH - filled)
    line = f"{title} {bar} {share:4.0%} {elapsed_s:4.0f} s  {text}"
    return line[: shutil.get_terminal_size().columns - 1]
