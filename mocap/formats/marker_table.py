"""Tables of marker positions over time, and the checks that all formats share."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.text import WINDOWS, quoted
from geometry2d.foundation.text import text_of as text_of_file

Array: TypeAlias = NDArray[np.float64]

MM_PER = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
AXES = {"X": 0, "Y": 1, "Z": 2}

MISSING = ("", "nan", "na")
"""Cells of a missing marker, in lower case."""

LONGEST_NAME = 200
LARGEST = 1e9
"""Bounds of a marker's name, and of a time and a position in any unit."""

LEAST_INTERVAL_S = 1e-6
"""No camera is faster."""

MOST_POSITIONS = 2_000_000
"""Largest number of frames times markers, unless the file holds at least as many numbers.

Without this bound a format with optional cells, or joints without numbers, could announce more
positions than fit into memory.
"""


class ExchangeError(DrinksimError):
    """A file of marker positions that cannot be used."""


@dataclass(frozen=True)
class MarkerTable:
    """Marker positions over time.

    Parameters
    ----------
    time_s
        (n,) increasing times, s.
    names
        The m markers, each name once.
    positions
        (n, m, 3) positions in ``unit``; nan where a marker is missing. Picture positions have z 0
        and y down.
    unit
        "mm", "cm", "m" or "px"; "" if it is not known.
    frame
        (n,) numbers of the frames, if the file has them; its times then mean nothing.
    """

    time_s: Array
    names: tuple[str, ...]
    positions: Array
    unit: str
    frame: NDArray[np.int_] | None = None

    @property
    def rate_hz(self) -> float:
        """Mean rate, frames/s; 1 for a single frame."""
        if self.time_s.size < 2:
            return 1.0
        return float((self.time_s.size - 1) / (self.time_s[-1] - self.time_s[0]))

    @property
    def even(self) -> bool:
        """Whether the intervals between frames agree within 1 %."""
        intervals = np.diff(self.time_s)
        return intervals.size == 0 or bool(np.ptp(intervals) <= 0.01 * np.median(intervals))

    def in_mm(self) -> MarkerTable:
        """Return the table with positions in mm.

        Raises
        ------
        ExchangeError
            If the unit is no length.
        """
        if self.unit not in MM_PER:
            raise ExchangeError(f"positions in {self.unit or 'no unit'} are not lengths in mm")
        return replace(self, positions=self.positions * MM_PER[self.unit], unit="mm")

    def of(self, name: str) -> Array:
        """Return the positions (n, 3) of one marker."""
        if name not in self.names:
            raise ExchangeError(f"no marker {name!r}; there are {', '.join(self.names)}")
        return self.positions[:, self.names.index(name)]


def plane_positions(table: MarkerTable, *, right: str, up: str) -> Array:
    """Return positions (n, m, 2), mm, in the plane of two axes of a table.

    Parameters
    ----------
    table
        In a unit of length.
    right, up
        The axes of the file that point right and up, with a sign: "-Z", "+X".
    """
    parts = []
    for axis in (right, up):
        letter = axis.lstrip("+-").upper()
        if letter not in AXES:
            raise ExchangeError(f"axis {axis!r}: write X, Y or Z, with - in front to turn it round")
        parts.append(
            (-1.0 if axis.startswith("-") else 1.0) * table.in_mm().positions[..., AXES[letter]]
        )
    return np.stack(parts, axis=-1)


def text_of(file: Path) -> str:
    """Return the text of a table of another program.

    A text that is not UTF-8 is read in the Windows code page, which some programs use for names
    with accents.

    Raises
    ------
    ExchangeError
        If the file cannot be read, is too large for a table, or is no text.
    """
    return text_of_file(file, what="marker table", error=ExchangeError, also=WINDOWS)


def refuse_size(file: Path, frames: int, markers: int, numbers: int) -> None:
    """Raise ExchangeError if a file announces more positions than its ``numbers`` can describe."""
    if frames * markers > max(MOST_POSITIONS, numbers):
        raise ExchangeError(
            f"{file}: names {markers} markers in {frames} frames and holds {numbers} numbers: most "
            "positions are missing; export it again"
        )


def checked_table(
    file: Path,
    time: Array,
    names: list[str],
    positions: Array,
    unit: str,
    frame: NDArray[np.int_] | None = None,
) -> MarkerTable:
    """Return a table that passes the checks that all formats share.

    Raises
    ------
    ExchangeError
        If there is no frame, a marker's name is unusable or occurs twice, times do not increase, or
        a number is too large.
    """
    if time.size == 0:
        raise ExchangeError(f"{file}: holds no frame; export it again")
    _check_names(file, names)
    if not np.isfinite(time).all():
        row = int(np.argmin(np.isfinite(time))) + 1
        raise ExchangeError(f"{file}: row {row} has no time; write it")
    for what, values in (("time", time), ("position", positions)):
        if np.any(np.abs(values) > LARGEST):
            worst = float(values.flat[np.nanargmax(np.abs(values))])
            raise ExchangeError(f"{file}: a {what} is {worst:g}, too large; check the unit")
    if np.any(np.diff(time) <= 0):
        row = int(np.argmax(np.diff(time) <= 0)) + 2
        raise ExchangeError(
            f"{file}: the time of row {row} ({time[row - 1]:g} s) is not after the one before "
            f"({time[row - 2]:g} s); rows are doubled or out of order"
        )
    if time.size > 1 and np.min(np.diff(time)) < LEAST_INTERVAL_S:
        raise ExchangeError(
            f"{file}: two rows are {np.min(np.diff(time)):.3g} s apart, sooner than any camera; "
            "check the unit of time"
        )
    return MarkerTable(time, tuple(names), positions, unit, frame)


def _check_names(file: Path, names: list[str]) -> None:
    for name in names:
        if not name.strip() or not name.isprintable() or len(name) > LONGEST_NAME:
            raise ExchangeError(
                f"{file}: a marker is called {quoted(name)}: give it a name of letters, digits and "
                f"signs, at most {LONGEST_NAME}"
            )
    doubled = [name for name, count in Counter(names).items() if count > 1]
    if doubled:
        raise ExchangeError(f"{file}: marker {quoted(doubled[0])} is there twice; rename one")
