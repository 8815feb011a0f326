"""Points that were labelled by hand in DeepLabCut: ``CollectedData_*.h5``.

A pandas frame in the format "fixed": columns and rows are numbered through levels
(``axis0_level0``, ``axis0_label0``, …), and columns of one type of number form a block. A row is a
picture's file, as one text or as folder, film and file. Source: pandas, "HDF5 (PyTables)", and
DeepLabCut's "Standardized data format".
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.formats.marker_table import ExchangeError, MarkerTable, checked_table, refuse_size
from mocap.formats.pose_tables import frame_of_name, label_parts, points_of_columns

Array: TypeAlias = NDArray[np.float64]
Label: TypeAlias = tuple[str, ...]

COLUMNS, ROWS, BLOCK_VALUES = "axis0", "axis1", "block0_values"


def read_hand_labels(file: Path, group: Any) -> MarkerTable:
    """Return the points of a pandas frame, px.

    Raises
    ------
    ExchangeError
        If a row names no frame, a frame is there twice, or columns are not those of points.
    """
    labels, rows = _labels(file, group, COLUMNS), _labels(file, group, ROWS)
    if not all(len(label) in (3, 4) for label in labels):
        raise ExchangeError(f"{file}: its columns are not scorer, point and x or y")
    blocks = list(_blocks(group))
    held = sum(group[f"{name}_values"].id.get_storage_size() for name in blocks)
    refuse_size(file, len(rows), len(labels), held)
    values = np.full((len(rows), len(labels)), np.nan)
    column_of = {label: k for k, label in enumerate(labels)}
    for name in blocks:
        columns = [column_of[label] for label in _labels(file, group, f"{name}_items")]
        values[:, columns] = np.asarray(group[f"{name}_values"][:], np.float64)
    frames = np.array([_frame(file, row[-1]) for row in rows], int)
    order = np.argsort(frames, kind="stable")
    titles = [label[-1].lower() for label in labels]
    names, positions = points_of_columns(file, label_parts(labels), titles, values[order])
    return checked_table(
        file, frames[order] * 1.0, names, positions, "px", frame=frames[order].astype(int)
    )


def _blocks(group: Any) -> itertools.takewhile[str]:
    names = (f"block{k}" for k in itertools.count())
    return itertools.takewhile(lambda name: f"{name}_values" in group, names)


def _labels(file: Path, group: Any, axis: str) -> list[Label]:
    """Return the labels along an axis; those of one level are stored as they are."""
    if axis in group:
        return [(_text(label),) for label in _held(file, group[axis])]
    columns = []
    for level in itertools.takewhile(lambda k: f"{axis}_level{k}" in group, itertools.count()):
        names = [_text(name) for name in _held(file, group[f"{axis}_level{level}"])]
        # An empty label has the number -1.
        columns.append(
            [names[k] if k >= 0 else "" for k in _held(file, group[f"{axis}_label{level}"])]
        )
    return list(zip(*columns, strict=True))


def _held(file: Path, data: Any) -> Any:
    """Return what a data set holds; one that was never filled announces any size."""
    refuse_size(file, data.shape[0], 1, data.id.get_storage_size())
    return data[:]


def _frame(file: Path, name: str) -> int:
    frame = frame_of_name(name)
    if frame is None:
        raise ExchangeError(f"{file}: the row {name!r} names no frame: its file ends in no number")
    return frame


def _text(name: Any) -> str:
    return name.decode("utf-8") if isinstance(name, bytes) else str(name)
