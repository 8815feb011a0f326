"""Text tables of marker positions: DeepLabCut, Kinovea and Tracker."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.formats.marker_table import ExchangeError, MarkerTable, checked_table, text_of

Array: TypeAlias = NDArray[np.float64]

# Detections that DeepLabCut itself calls less likely than this are left out.
LEAST_LIKELIHOOD = 0.6


def read_deeplabcut(path: Path | str, *, fps: float | None = None) -> MarkerTable:
    """Return the points of a DeepLabCut CSV (rows scorer, bodyparts, coords), px.

    Parameters
    ----------
    path
        The file. Its rows are frames: it holds no times.
    fps
        The video's rate; 1 if None, so that times are frame numbers.

    Raises
    ------
    ExchangeError
        If header or rows are broken. Points of several animals are refused.
    """
    file = Path(path)
    rows = _delimited(file, ",")
    kinds = [row[1][0].lower() for row in rows[:4]]
    if kinds[:3] != ["scorer", "bodyparts", "coords"]:
        if "individuals" in kinds:
            raise ExchangeError(f"{file}: holds several animals; export one individual")
        raise ExchangeError(f"{file}: has no DeepLabCut header (scorer, bodyparts, coords)")
    parts, coordinates = rows[1][1][1:], [c.lower() for c in rows[2][1][1:]]
    names = list(dict.fromkeys(parts))
    data, first = [], []
    for line, cells in rows[3:]:
        first.append(_number(file, line, 1, re.sub(r"\D*(\d+)\.\w+$", r"\1", cells[0])))
        data.append([_number(file, line, k + 2, cell) for k, cell in enumerate(cells[1:])])
    _same_width(file, data, len(parts), rows[3:])
    values = np.array(data).reshape(len(data), len(parts))
    positions = np.full((len(data), len(names), 3), np.nan)
    for k, name in enumerate(names):
        for axis, letter in enumerate("xy"):
            at = [i for i, part in enumerate(parts) if part == name and coordinates[i] == letter]
            if len(at) != 1:
                raise ExchangeError(f"{file}: {name!r} has {len(at)} columns {letter}, not one")
            positions[:, k, axis] = values[:, at[0]]
        likely = [
            i for i, part in enumerate(parts) if part == name and coordinates[i] == "likelihood"
        ]
        if likely:
            positions[values[:, likely[0]] < LEAST_LIKELIHOOD, k] = np.nan
    positions[..., 2] = np.where(np.isfinite(positions[..., 0]), 0.0, np.nan)
    return checked_table(file, np.array(first) / (fps or 1.0), names, positions, "px")


def read_kinovea(path: Path | str) -> MarkerTable:
    """Return the points of a table from Kinovea's kinematics dialogue.

    The first column is the time, in ms if its heading says so; the others are named after the
    object with X or Y at their end, a unit in brackets possibly after it.

    Raises
    ------
    ExchangeError
        If the header names no positions or a row is broken.
    """
    file = Path(path)
    head = text_of(file).splitlines()[0] if text_of(file).strip() else ""
    separator = max(";\t,", key=head.count)
    rows = _delimited(file, separator)
    header = rows[0][1]
    scale = 1e-3 if "ms" in header[0].lower() else 1.0
    columns: dict[str, dict[str, int]] = {}
    units = set()
    for at, title in enumerate(header[1:], start=1):
        match = re.fullmatch(r"(.*?)[\s/.:_-]*([xXyY])\s*(?:[(\[](.*?)[)\]])?", title)
        if match:
            columns.setdefault(match[1].strip(" /.:_-") or "point", {})[match[2].upper()] = at
            units.add((match[3] or "").strip().lower())
    names = [name for name, axes in columns.items() if set(axes) == {"X", "Y"}]
    if not names:
        raise ExchangeError(f"{file}: no columns X and Y of one object in its header {header[:5]}")
    data = [
        [_number(file, line, k + 1, cell, separator) for k, cell in enumerate(cells)]
        for line, cells in rows[1:]
    ]
    _same_width(file, data, len(header), rows[1:])
    values = np.array(data).reshape(len(data), len(header))
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
    blocks: dict[str, dict[float, tuple[float, float]]] = {}
    name = "point"
    for line, text in enumerate(text_of(file).splitlines(), start=1):
        stripped = text.strip()
        if stripped.startswith("#"):
            title = stripped.lstrip("# ").strip()
            if title and not title.startswith("Kinovea") and title != "T X Y":
                name = title
            continue
        if not stripped:
            continue
        cells = stripped.split()
        if len(cells) != 3:
            raise ExchangeError(f"{file} line {line}: is {stripped!r}, not the three numbers T X Y")
        t, x, y = (_number(file, line, k + 1, cell, " ") for k, cell in enumerate(cells))
        block = blocks.setdefault(name, {})
        if t in block:
            raise ExchangeError(f"{file} line {line}: time {t:g} of {name!r} is there twice")
        block[t] = (x, y)
    times = sorted({t for block in blocks.values() for t in block})
    positions = np.full((len(times), len(blocks), 3), np.nan)
    for k, block in enumerate(blocks.values()):
        for i, t in enumerate(times):
            if t in block:
                positions[i, k] = (*block[t], 0.0)
    # The text export counts time in ms.
    return checked_table(file, 1e-3 * np.array(times), list(blocks), positions, "")


def read_tracker(path: Path | str) -> MarkerTable:
    """Return the point masses of a text export of Tracker (Open Source Physics).

    A line with the tracks' names, a line with column names 't x y …', then numbers; separated by
    tabs, commas, semicolons or blanks. Lengths are in the unit of Tracker's calibration.

    Raises
    ------
    ExchangeError
        If there are no columns t, x and y, or a row is broken.
    """
    file = Path(path)
    lines = [line for line in text_of(file).splitlines() if line.strip()]
    at = next((i for i, line in enumerate(lines) if re.match(r"\s*t\b", line)), None)
    if at is None:
        raise ExchangeError(f"{file}: has no header line of columns 't x y'")
    separator = next((s for s in "\t;," if s in lines[at]), None)
    titles = [cell.strip() for cell in lines[at].split(separator)]
    masses = [cell.strip() for cell in lines[at - 1].split(separator)] if at else []
    masses = [name for name in masses if name]
    pairs = [
        (i, titles.index("y", i)) for i, t in enumerate(titles) if t == "x" and "y" in titles[i:]
    ]
    if not pairs:
        raise ExchangeError(f"{file}: has no columns x and y, only {', '.join(titles)}")
    names = [masses[k] if k < len(masses) else f"mass_{k + 1}" for k in range(len(pairs))]
    data = []
    for line, text in enumerate(lines[at + 1 :], start=at + 2):
        cells = [cell.strip() for cell in text.split(separator)]
        data.append([_number(file, line, k + 1, c, separator or " ") for k, c in enumerate(cells)])
    _same_width(file, data, len(titles), [(at + 2 + i, []) for i in range(len(data))])
    values = np.array(data).reshape(len(data), len(titles))
    return checked_table(file, values[:, titles.index("t")], names, _flat(values, pairs), "")


def _flat(values: Array, pairs: list[tuple[int, int]]) -> Array:
    """Return positions (n, m, 3) from columns of x and y, z 0."""
    positions = np.zeros((values.shape[0], len(pairs), 3))
    for k, (x, y) in enumerate(pairs):
        positions[:, k, 0], positions[:, k, 1] = values[:, x], values[:, y]
    positions[~np.isfinite(positions[..., :2]).all(axis=-1)] = np.nan
    return positions


def _delimited(file: Path, separator: str) -> list[tuple[int, list[str]]]:
    reader = csv.reader(text_of(file).splitlines(), delimiter=separator)
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(row)]
    except csv.Error as error:
        raise ExchangeError(f"{file}: is no table ({error})") from None
    if len(rows) < 2:
        raise ExchangeError(f"{file}: holds no rows below its header")
    return rows


def _number(file: Path, line: int, column: int, cell: str, separator: str = ",") -> float:
    """Return the number in a cell; an empty cell is nan, a decimal comma is understood."""
    text = cell.strip().strip('"')
    if separator != ",":
        text = text.replace(",", ".")
    if text.lower() in ("", "nan", "na"):
        return math.nan
    try:
        value = float(text)
    except ValueError:
        raise ExchangeError(
            f"{file} line {line}: column {column} is {cell!r}, not a number"
        ) from None
    if math.isinf(value):
        raise ExchangeError(f"{file} line {line}: column {column} is not finite")
    return value


def _same_width(
    file: Path, data: list[list[float]], width: int, rows: list[tuple[int, list[str]]]
) -> None:
    for values, (line, _) in zip(data, rows, strict=True):
        if len(values) != width:
            raise ExchangeError(
                f"{file} line {line}: has {len(values)} columns, the header {width}"
            )


def _one_unit(units: set[str]) -> str:
    named = {unit for unit in units if unit}
    return named.pop() if len(named) == 1 else ""
