"""TRC, the marker format of Motion Analysis that OpenSim, Mokka and Pose2Sim share."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.delimited import TableRow, plain_cell, refuse_cut, safe_cell
from geometry2d.foundation.text import number, quoted
from mocap.formats.marker_table import (
    LEAST_INTERVAL_S,
    MISSING,
    ExchangeError,
    MarkerTable,
    checked_table,
    refuse_size,
    text_of,
)

Array: TypeAlias = NDArray[np.float64]


# Times that differ from an even rate by this, s, or less are rounded and mean that rate.
ROUNDING_S = 6e-4
LONGEST_INTERVAL_S = 1e6
"""Longest interval of a valid rate, s; the shortest is `LEAST_INTERVAL_S`."""


def read_trc(path: Path | str, *, partial: bool = False) -> MarkerTable:
    """Return the markers of a TRC file, tab- or comma-separated.

    Parameters
    ----------
    path
        The file.
    partial
        Whether to accept a file that holds fewer frames than it announces.

    Raises
    ------
    ExchangeError
        If it has no header, a row is short or holds no number, or rows are missing or doubled.
    """
    file = Path(path)
    text = text_of(file)
    lines = text.split("\n")
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise ExchangeError(
            f"{file}: is no TRC file, or was cut short in its header (first line 'PathFileType')"
        )
    separator = next((sign for sign in "\t," if sign in lines[2]), None)
    header = dict(zip(_cells(lines[1], separator), _cells(lines[2], separator), strict=False))
    declared = _count(file, header, "NumFrames")
    count = _count(file, header, "NumMarkers")
    names = [plain_cell(name) for name in _cells(lines[3], separator)[2:] if name]
    if separator is None and lines[3].split()[:2] != ["Frame#", "Time"]:
        raise ExchangeError(f"{file}: its fourth line does not begin with 'Frame# Time'")
    rows = [
        TableRow(number, _cells(line, separator))
        for number, line in enumerate(lines[4:], start=5)
        if "".join(_cells(line, separator))
    ]
    if rows and rows[0].cells[0] in ("", "X1"):
        rows = rows[1:]
    if len(rows) > declared or (len(rows) < declared and not partial):
        raise ExchangeError(
            f"{file}: announces {declared} frames and holds {len(rows)}: it was cut short, or rows "
            "are missing or doubled"
        )
    if len(names) != count:
        # Cortex counts its real markers and writes virtual ones too.
        if len(names) < count or any(len(row.cells) < 2 + 3 * len(names) for row in rows):
            raise ExchangeError(f"{file}: announces {count} markers and names {len(names)}")
        count = len(names)
    width = 2 + 3 * count
    if separator is None and any(len(row.cells) != width for row in rows):
        raise ExchangeError(
            f"{file}: is separated by blanks, and a row has not {width} numbers: a missing marker "
            "cannot be told from another; export it with tabs"
        )
    refuse_cut(file, rows, width, complete=text.endswith("\n"), error=ExchangeError)
    refuse_size(file, len(rows), count, sum(len(row.cells) for row in rows))
    table = np.array([_numbers(file, row, width) for row in rows]).reshape(len(rows), width)
    positions = table[:, 2:].reshape(len(rows), count, 3)
    time = _even(table[:, 1], header.get("DataRate", ""))
    return checked_table(file, time, names, positions, header.get("Units", "").strip())


def write_trc(table: MarkerTable, path: Path) -> None:
    """Write a table as TRC, tab-separated, version 4; missing markers are empty cells.

    Raises
    ------
    ExchangeError
        If a name cannot stand in a cell.
    """
    for name in table.names:
        if not name.isprintable() or name.strip() != name or not name:
            raise ExchangeError(
                f"{path}: TRC cannot hold a marker called {quoted(name)}: rename the marker"
            )
    names = [safe_cell(name) for name in table.names]
    rate = f"{table.rate_hz:.6g}"
    count, markers = len(table.time_s), len(table.names)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        f"{rate}\t{rate}\t{count}\t{markers}\t{table.unit}\t{rate}\t1\t{count}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(markers) for axis in "XYZ"),
        "",
    ]
    for i, time in enumerate(table.time_s):
        cells = ["" if np.isnan(v) else f"{v:.6f}" for v in table.positions[i].ravel()]
        lines.append(f"{i + 1}\t{time:.6f}\t" + "\t".join(cells))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _even(time: Array, rate: str) -> Array:
    """Return the times of the header's rate if the rounded times agree with it."""
    hertz = number(rate)
    if hertz is None or not 1 / LONGEST_INTERVAL_S <= hertz <= 1 / LEAST_INTERVAL_S:
        return time
    interval = 1 / hertz
    even = time[:1] + interval * np.arange(time.size)
    offset = float(np.median(time - even)) if time.size else 0.0
    fits = bool(np.all(np.abs(time - even - offset) < ROUNDING_S))
    return even + offset if fits else time


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip() for cell in line.split(separator)]


def _count(file: Path, header: dict[str, str], key: str) -> int:
    found = number(header.get(key, ""))
    if found is None or found != int(found) or found < 0:
        stated = f"it says {quoted(header[key])}" if key in header else "it is missing"
        raise ExchangeError(f"{file}: its header has no number {key}: {stated}; export it again")
    return int(found)


def _numbers(file: Path, row: TableRow, count: int) -> list[float]:
    """Return the numbers of a row; empty cells, and missing ones at its end, are nan."""
    where = f"{file} line {row.line}"
    if len(row.cells) < 2:
        raise ExchangeError(f"{where}: has {len(row.cells)} columns instead of {count}")
    if any(row.cells[count:]):
        raise ExchangeError(f"{where}: has more than {count} columns")
    values = []
    for column, cell in enumerate(row.cells[:count], start=1):
        value = math.nan if cell.lower() in MISSING else number(cell)
        if value is None:
            raise ExchangeError(f"{where}: column {column} is {quoted(cell)}, not a finite number")
        values.append(value)
    return values + [math.nan] * (count - len(values))
