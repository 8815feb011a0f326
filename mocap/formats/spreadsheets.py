"""Text tables of marker positions: Kinovea and Tracker."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.delimited import (
    Rows,
    TableRow,
    decimal_number,
    plain_cell,
    refuse_cut,
    refuse_other_width,
    rows_of,
)
from geometry2d.foundation.text import quoted
from mocap.formats.marker_table import (
    MISSING,
    ExchangeError,
    MarkerTable,
    checked_table,
    refuse_size,
    text_of,
)

Array: TypeAlias = NDArray[np.float64]

PIXEL_TITLES = ("pixelx", "pixely")
"""Headings of Tracker's columns in pixels; x and y are in the unit of its calibration."""

AROUND_NAMES = " /.:_-"
"""Characters between the name of an object and the axis in a heading of Kinovea."""


def read_kinovea(path: Path | str) -> MarkerTable:
    """Return the points of a table from Kinovea's kinematics dialogue.

    The first column is the time, in ms if its heading says so. The heading of any other column is
    the name of the object, X or Y, and optionally a unit in brackets.

    Raises
    ------
    ExchangeError
        If the header names no positions or a row is broken.
    """
    file = Path(path)
    found = rows_of_file(file)
    header, data = found.rows[0].cells, found.rows[1:]
    scale = 1e-3 if "ms" in header[0].lower() else 1.0
    columns: dict[str, dict[str, int]] = {}
    units = set()
    for at, title in enumerate(header[1:], start=1):
        name, axis, unit = _heading(title)
        if axis:
            columns.setdefault(name, {})[axis] = at
            units.add(unit)
    names = [name for name, axes in columns.items() if set(axes) == {"X", "Y"}]
    if not names:
        shown = ", ".join(quoted(title) for title in header[:5])
        raise ExchangeError(f"{file}: its header has no columns X and Y of one object: {shown}")
    values = numbers_of(found, data, len(header))
    positions = _flat(values, [(columns[n]["X"], columns[n]["Y"]) for n in names])
    return checked_table(file, scale * values[:, 0], names, positions, _one_unit(units))


def read_kinovea_text(path: Path | str) -> MarkerTable:
    """Return the trajectories of Kinovea's text export: blocks of lines 'T X Y' after '# name'.

    Raises
    ------
    ExchangeError
        If a line is not three numbers or trajectories have no time in common.
    """
    file = Path(path)
    text = text_of(file)
    entries: list[tuple[str, TableRow]] = []
    name = "point"
    for line, content in enumerate(text.split("\n"), start=1):
        stripped = content.strip()
        if stripped.startswith("#"):
            title = stripped.lstrip("# ").strip()
            if title and not title.startswith("Kinovea") and title != "T X Y":
                name = title
        elif stripped:
            entries.append((name, TableRow(line, stripped.split())))
    rows = [row for _, row in entries]
    refuse_cut(file, rows, 3, complete=text.endswith("\n"), error=ExchangeError)
    blocks: dict[str, dict[float, tuple[float, float]]] = {}
    decimals: set[str] = set()
    for name, row in entries:
        if len(row.cells) != 3:
            shown = quoted(" ".join(row.cells))
            raise ExchangeError(f"{file} line {row.line}: is {shown}, not the three numbers T X Y")
        t, x, y = (_number(file, row, k, " ", decimals) for k in range(3))
        block = blocks.setdefault(name, {})
        if t in block:
            raise ExchangeError(
                f"{file} line {row.line}: time {t:g} of {quoted(name)} is there twice; remove one"
            )
        block[t] = (x, y)
    times = sorted({t for block in blocks.values() for t in block})
    refuse_size(file, len(times), len(blocks), 3 * len(rows))
    row_of = {t: i for i, t in enumerate(times)}
    positions = np.full((len(times), len(blocks), 3), np.nan)
    for k, block in enumerate(blocks.values()):
        for t, (x, y) in block.items():
            positions[row_of[t], k] = (x, y, 0.0)
    # The text export counts time in ms.
    return checked_table(file, 1e-3 * np.array(times), list(blocks), positions, "")


def read_tracker(path: Path | str) -> MarkerTable:
    """Return the point masses of a text export of Tracker (Open Source Physics).

    The file has a line with the tracks' names, a line with column names 't x y …', and numbers,
    separated by tabs, commas, semicolons or blanks. Lengths are in the unit of Tracker's
    calibration.

    Raises
    ------
    ExchangeError
        If there are no columns t, x and y, or a row is broken.
    """
    file = Path(path)
    text = text_of(file)
    lines = [(k, line) for k, line in enumerate(text.split("\n"), start=1) if line.strip()]
    at = next((i for i, (_, line) in enumerate(lines) if re.match(r"\s*+t\b", line)), None)
    if at is None:
        raise ExchangeError(f"{file}: has no header line of columns 't x y'")
    separator = next((s for s in "\t;," if s in lines[at][1]), None)
    width = len(_without_end(lines[at][1].split(separator), 0))
    rows = [TableRow(k, _without_end(line.split(separator), width)) for k, line in lines]
    titles, data = rows[at].cells, rows[at + 1 :]
    masses = [name for name in rows[at - 1].cells if name] if at else []
    pairs = _pairs(titles)
    if not pairs:
        shown = quoted(", ".join(titles))
        raise ExchangeError(f"{file}: has no columns x and y, only {shown}; export them")
    names = [
        plain_cell(masses[k]) if k < len(masses) else f"mass_{k + 1}" for k in range(len(pairs))
    ]
    found = Rows(file, rows, separator or " ", text.endswith("\n"))
    values = numbers_of(found, data, len(titles))
    unit = "px" if titles[pairs[0][0]] == PIXEL_TITLES[0] else ""
    return checked_table(file, values[:, titles.index("t")], names, _flat(values, pairs), unit)


def _without_end(cells: list[str], width: int) -> list[str]:
    """Return cells without the blank ones beyond a width: lines may end with a separator."""
    stripped = [cell.strip() for cell in cells]
    while len(stripped) > width and not stripped[-1]:
        stripped.pop()
    return stripped


def rows_of_file(file: Path) -> Rows:
    """Return the rows of a file of another program: at least one below the header."""
    found = rows_of(file, text_of(file), error=ExchangeError)
    if len(found.rows) < 2:
        raise ExchangeError(f"{file}: holds no rows below its header")
    return found


def _heading(title: str) -> tuple[str, str, str]:
    """Return object, axis ("X", "Y" or "" if there is none) and unit of a heading of Kinovea."""
    unit = ""
    text = title.strip()
    if text.endswith((")", "]")):
        opened = max(text.rfind("("), text.rfind("["))
        text, unit = text[:opened].rstrip(), text[opened + 1 : -1].strip().lower()
    if text[-1:] not in ("x", "y", "X", "Y"):
        return "", "", unit
    return plain_cell(text[:-1].strip(AROUND_NAMES)) or "point", text[-1].upper(), unit


def _pairs(titles: list[str]) -> list[tuple[int, int]]:
    """Return pairs of columns: each column x and the next column y, in pixels if there are such."""
    right, down = PIXEL_TITLES if PIXEL_TITLES[0] in titles else ("x", "y")
    pairs: list[tuple[int, int]] = []
    following: int | None = None
    for k in reversed(range(len(titles))):
        if titles[k] == down:
            following = k
        elif titles[k] == right and following is not None:
            pairs.append((k, following))
    return pairs[::-1]


def _flat(values: Array, pairs: list[tuple[int, int]]) -> Array:
    """Return positions (n, m, 3) from columns of x and y, z 0."""
    positions = np.zeros((values.shape[0], len(pairs), 3))
    for k, (x, y) in enumerate(pairs):
        positions[:, k, 0], positions[:, k, 1] = values[:, x], values[:, y]
    positions[~np.isfinite(positions[..., :2]).all(axis=-1)] = np.nan
    return positions


def numbers_of(found: Rows, data: Sequence[TableRow], width: int, *, first: int = 0) -> Array:
    """Return the numbers (n, width - first) of rows, from the column ``first`` on."""
    refuse_cut(found.file, data, width, complete=found.complete, error=ExchangeError)
    refuse_other_width(found, data, width, ExchangeError)
    decimals: set[str] = set()
    table = [
        [_number(found.file, row, k, found.separator, decimals) for k in range(first, width)]
        for row in data
    ]
    return np.array(table, float).reshape(len(data), width - first)


def _number(file: Path, row: TableRow, k: int, separator: str, decimals: set[str]) -> float:
    """Return the number in a cell; one that is missing is nan."""
    cell = row.cells[k]
    if cell.lower() in MISSING:
        return math.nan
    value = decimal_number(cell, separator, decimals)
    if value is None or len(decimals) > 1:
        reason = "not a finite number" if value is None else "and others have another decimal mark"
        raise ExchangeError(f"{file} line {row.line}: column {k + 1} is {quoted(cell)}, {reason}")
    return value


def _one_unit(units: set[str]) -> str:
    named = {unit for unit in units if unit}
    return named.pop() if len(named) == 1 else ""
