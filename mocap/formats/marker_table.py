"""Marker positions over time, as other programs keep them, and the checks all formats share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError

Array: TypeAlias = NDArray[np.float64]

MM_PER = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
AXES = {"X": 0, "Y": 1, "Z": 2}
MOST_BYTES = 500_000_000


class ExchangeError(DrinksimError):
    """A file of marker positions that cannot be used."""


@dataclass(frozen=True)
class MarkerTable:
    """Marker positions over time, as other programs keep them.

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
        "mm", "cm", "m" or "px"; "" if the file does not say.
    """

    time_s: Array
    names: tuple[str, ...]
    positions: Array
    unit: str

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
        Which axis of the file points right and which up, with a sign: "-Z", "+X".
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
    """Return the text of a file.

    Raises
    ------
    ExchangeError
        If it cannot be read, is too large for a table, or is not text.
    """
    try:
        if file.stat().st_size > MOST_BYTES:
            raise ExchangeError(f"{file}: is larger than {MOST_BYTES // 10**6} MB, no marker table")
        data = file.read_bytes()
    except OSError as error:
        raise ExchangeError(f"{file}: cannot be read ({error.strerror})") from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        # Programs on Windows write names with accents in the old code page.
        text = data.decode("cp1252", errors="replace")
    if "\x00" in text:
        raise ExchangeError(f"{file}: is not text")
    return text


def checked_table(
    file: Path, time: Array, names: list[str], positions: Array, unit: str
) -> MarkerTable:
    """Return a table after the checks that all formats share.

    Raises
    ------
    ExchangeError
        If there is no frame, a marker is there twice, or times do not increase.
    """
    if time.size == 0:
        raise ExchangeError(f"{file}: holds no frame")
    doubled = [name for name in names if names.count(name) > 1]
    if doubled:
        raise ExchangeError(f"{file}: marker {doubled[0]!r} is there twice; rename one")
    if not np.isfinite(time).all():
        raise ExchangeError(f"{file}: row {int(np.argmin(np.isfinite(time))) + 1} has no time")
    if np.any(np.diff(time) <= 0):
        row = int(np.argmax(np.diff(time) <= 0)) + 2
        raise ExchangeError(
            f"{file}: the time of row {row} ({time[row - 1]:g} s) is not after the one before "
            f"({time[row - 2]:g} s); rows are doubled or out of order"
        )
    return MarkerTable(time, tuple(names), positions, unit)
