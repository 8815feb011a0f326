"""TRC, the marker format of Motion Analysis that OpenSim, Mokka and Pose2Sim share."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.formats.marker_table import ExchangeError, MarkerTable, checked_table, text_of

Array: TypeAlias = NDArray[np.float64]


# Times written with this error (s) or less are taken to mean an even rate.
ROUNDING_S = 6e-4


def read_trc(path: Path | str, *, partial: bool = False) -> MarkerTable:
    """Return the markers of a TRC file, tab- or comma-separated.

    Parameters
    ----------
    path
        The file.
    partial
        Whether to take a file that holds fewer frames than it announces.

    Raises
    ------
    ExchangeError
        If its header is none, a row is short or holds no number, or rows are missing or doubled.
    """
    file = Path(path)
    text = text_of(file)
    lines = text.lstrip("\ufeff").splitlines()
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise ExchangeError(
            f"{file}: is no TRC file, or was cut short in its header (first line 'PathFileType')"
        )
    separator = "\t" if "\t" in lines[0] else ","
    header = dict(zip(_cells(lines[1], separator), _cells(lines[2], separator), strict=False))
    declared = _count(file, header, "NumFrames")
    count = _count(file, header, "NumMarkers")
    names = [name for name in _cells(lines[3], separator)[2:] if name]
    if len(names) != count:
        raise ExchangeError(f"{file}: announces {count} markers and names {len(names)}")
    rows = [
        (number, _cells(line, separator))
        for number, line in enumerate(lines[4:], start=5)
        if line.replace(separator, "").strip()
    ]
    if rows and rows[0][1][0] in ("", "X1"):
        rows = rows[1:]
    if len(rows) > declared or (len(rows) < declared and not partial):
        raise ExchangeError(
            f"{file}: announces {declared} frames and holds {len(rows)}: it was cut short, or rows "
            "are missing or doubled"
        )
    if rows and not text.endswith(("\n", "\r")) and len(rows[-1][1]) < 2 + 3 * count:
        raise ExchangeError(f"{file}: was cut short in its last row")
    table = np.array([_numbers(file, number, cells, 2 + 3 * count) for number, cells in rows])
    table = table.reshape(len(rows), 2 + 3 * count)
    positions = table[:, 2:].reshape(len(rows), count, 3)
    time = _even(table[:, 1], header.get("DataRate", ""))
    return checked_table(file, time, names, positions, header.get("Units", "").strip())


def write_trc(table: MarkerTable, path: Path) -> None:
    """Write a table as TRC, tab-separated, version 4; missing markers are empty cells."""
    rate = f"{table.rate_hz:.6g}"
    count, markers = len(table.time_s), len(table.names)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        f"{rate}\t{rate}\t{count}\t{markers}\t{table.unit}\t{rate}\t1\t{count}",
        "Frame#\tTime\t" + "\t\t\t".join(table.names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(markers) for axis in "XYZ"),
        "",
    ]
    for i, time in enumerate(table.time_s):
        cells = ["" if np.isnan(v) else f"{v:.6f}" for v in table.positions[i].ravel()]
        lines.append(f"{i + 1}\t{time:.6f}\t" + "\t".join(cells))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _even(time: Array, rate: str) -> Array:
    """Return the times without their rounding, where they fit the rate that the header gives."""
    try:
        interval = 1 / float(rate)
    except (ValueError, ZeroDivisionError):
        return time
    even = time[:1] + interval * np.arange(time.size)
    offset = float(np.median(time - even)) if time.size else 0.0
    fits = bool(np.all(np.abs(time - even - offset) < ROUNDING_S))
    return even + offset if fits else time


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip() for cell in line.split(separator)]


def _count(file: Path, header: dict[str, str], key: str) -> int:
    try:
        count = int(header[key])
    except (KeyError, ValueError):
        raise ExchangeError(
            f"{file}: its header has no number {key} (found {header.get(key)!r})"
        ) from None
    if count < 0:
        raise ExchangeError(f"{file}: {key} is {count}")
    return count


def _numbers(file: Path, line: int, cells: list[str], count: int) -> list[float]:
    """Return the numbers of a row; empty cells, and those left off at its end, are nan."""
    if len(cells) < 2:
        raise ExchangeError(f"{file} line {line}: has {len(cells)} columns instead of {count}")
    if any(cells[count:]):
        raise ExchangeError(f"{file} line {line}: has more than {count} columns")
    values = []
    for column, cell in enumerate((cells + [""] * count)[:count]):
        try:
            value = float(cell) if cell else math.nan
        except ValueError:
            raise ExchangeError(
                f"{file} line {line}: column {column + 1} is {cell!r}, not a number"
            ) from None
        if math.isinf(value):
            raise ExchangeError(f"{file} line {line}: column {column + 1} is not finite")
        values.append(value)
    return values
