"""Tables of points that a trained network found in pictures: DeepLabCut and SLEAP.

Every row names its frame; the number is kept, whatever frames are left out.
Sources: the projects' documentation of their CSV files.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.delimited import TableRow, refuse_other_width
from geometry2d.foundation.text import number, quoted
from mocap.formats.marker_table import ExchangeError, MarkerTable, checked_table, refuse_size
from mocap.formats.spreadsheets import numbers_of, rows_of_file

Array: TypeAlias = NDArray[np.float64]

# Points that a network states to be less likely than this are missing.
LEAST_LIKELIHOOD = 0.6


def read_deeplabcut(path: Path | str) -> MarkerTable:
    """Return the points of a DeepLabCut CSV, px.

    Its header has rows scorer, bodyparts, coords, and individuals if there are several animals,
    whose name then stands before that of the point. The first column, or the last of the three
    first ones, is the frame: a number, or a picture's file with the number in its name.

    Raises
    ------
    ExchangeError
        If header or rows are broken, or a row names no frame.
    """
    file = Path(path)
    found = rows_of_file(file)
    kinds = [row.cells[0].lower() for row in found.rows[:4]]
    depth = 4 if "individuals" in kinds else 3
    expected = ["scorer", *(["individuals"] if depth == 4 else []), "bodyparts", "coords"]
    if kinds[:depth] != expected:
        raise ExchangeError(f"{file}: has no DeepLabCut header ({', '.join(expected)})")
    header, data = found.rows[:depth], found.rows[depth:]
    refuse_other_width(found, header, len(header[0].cells), ExchangeError)
    titles = [cell.lower() for cell in header[-1].cells]
    first = next((k for k, title in enumerate(titles) if title in ("x", "y")), 1)
    parts = header[-2].cells[first:]
    if depth == 4:
        animals = header[1].cells[first:]
        if len(set(animals)) > 1:
            parts = [f"{animal}_{part}" for animal, part in zip(animals, parts, strict=True)]
    frames = np.array([_frame_number(file, row, first - 1) for row in data], int)
    values = numbers_of(found, data, len(titles), first=first)
    names, positions = points_of_columns(file, parts, titles[first:], values)
    return checked_table(file, frames * 1.0, names, positions, "px", frame=frames)


def read_sleap(path: Path | str) -> MarkerTable:
    """Return the points of a SLEAP analysis CSV, px.

    Its columns are track, frame_idx, instance.score, and x, y and score of each node. With several
    tracks, the track's name stands before that of the node.

    Raises
    ------
    ExchangeError
        If header or rows are broken, or a track has a frame twice.
    """
    file = Path(path)
    found = rows_of_file(file)
    header, data = found.rows[0].cells, found.rows[1:]
    titles = [title.lower() for title in header]
    at = titles.index("frame_idx")
    nodes = [title.rpartition(".")[0] for title in header if title.lower().endswith(".x")]
    tracks = [row.cells[titles.index("track")] if "track" in titles else "" for row in data]
    several = sorted(set(tracks)) if len(set(tracks)) > 1 else [""]
    numeric = [TableRow(row.line, ["", *row.cells[1:]]) for row in data]
    values = numbers_of(found, numeric, len(header))
    numbers = [_frame_number(file, row, at) for row in data]
    frames = np.array(sorted(set(numbers)), int)
    refuse_size(file, frames.size, len(nodes) * len(several), values.size)
    row_of = {frame: k for k, frame in enumerate(frames.tolist())}
    positions = np.full((frames.size, len(several) * len(nodes), 3), np.nan)
    taken: set[tuple[int, str]] = set()
    for k, (frame, track) in enumerate(zip(numbers, tracks, strict=True)):
        if (frame, track) in taken:
            raise ExchangeError(
                f"{file} line {data[k].line}: frame {frame} is there twice; export one instance"
            )
        taken.add((frame, track))
        start = len(nodes) * (several.index(track) if len(several) > 1 else 0)
        for node, name in enumerate(nodes):
            for axis, letter in enumerate("xy"):
                column = titles.index(f"{name}.{letter}".lower())
                positions[row_of[frame], start + node, axis] = values[k, column]
    positions[..., 2] = np.where(np.isfinite(positions[..., 0]), 0.0, np.nan)
    names = [f"{track}_{node}" if track else node for track in several for node in nodes]
    return checked_table(file, frames * 1.0, names, positions, "px", frame=frames)


def points_of_columns(
    file: Path, parts: list[str], titles: list[str], values: Array
) -> tuple[list[str], Array]:
    """Return names and positions (n, m, 3) from columns x, y and likelihood of each part.

    Parameters
    ----------
    file
        For messages.
    parts, titles
        Name of the point, and "x", "y" or "likelihood", of each column.
    values
        (n, columns) numbers.
    """
    column_of: dict[tuple[str, str], list[int]] = {}
    for k, key in enumerate(zip(parts, titles, strict=True)):
        column_of.setdefault(key, []).append(k)
    names = list(dict.fromkeys(parts))
    refuse_size(file, len(values), len(names), values.size)
    positions = np.full((len(values), len(names), 3), np.nan)
    for k, name in enumerate(names):
        for axis, letter in enumerate("xy"):
            at = column_of.get((name, letter), [])
            if len(at) != 1:
                raise ExchangeError(
                    f"{file}: {quoted(name)} has {len(at)} columns {letter}, not one; export again"
                )
            positions[:, k, axis] = values[:, at[0]]
        likely = column_of.get((name, "likelihood"), [])
        if likely:
            positions[values[:, likely[0]] < LEAST_LIKELIHOOD, k] = np.nan
    positions[..., 2] = np.where(np.isfinite(positions[..., 0]), 0.0, np.nan)
    return names, positions


def _frame_number(file: Path, row: TableRow, column: int) -> int:
    """Return the frame of a row: a whole number, or the digits at the end of a file's name."""
    cell = row.cells[column] if column < len(row.cells) else ""
    frame = frame_of_name(cell)
    if frame is None:
        raise ExchangeError(
            f"{file} line {row.line}: column {column + 1} is {quoted(cell)}, not the number of a "
            "frame"
        )
    return frame


def frame_of_name(text: str) -> int | None:
    """Return the frame that a text names: a whole number, or the digits that end a file's name."""
    value = number(text)
    if value is None:
        stem = text.rpartition(".")[0]
        value = number(stem[len(stem.rstrip("0123456789")) :])
    return None if value is None or value != int(value) or value < 0 else int(value)


def label_parts(labels: Sequence[tuple[str, ...]]) -> list[str]:
    """Return the point that each column of DeepLabCut belongs to, with its animal if several are.

    A label is scorer, animal (if there are any), point, and coordinate.
    """
    several = len({label[1] for label in labels if len(label) == 4}) > 1
    return [f"{label[1]}_{label[2]}" if several else label[-2] for label in labels]
