"""history.csv: a line an increment, to nine significant digits."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from scenarios.results.increment import SolutionError
from scenarios.results.quantities import HISTORY

Array = NDArray[np.float64]

HISTORY_FILE = "history.csv"
COLUMNS = tuple(quantity.name for quantity in HISTORY)
WHOLE_NUMBERS = ("newton_iterations", "cutbacks")


def as_written(row: Mapping[str, float]) -> list[str]:
    """Return the entries of a line, in the order of the columns."""
    return [
        str(int(row[name])) if name in WHOLE_NUMBERS else f"{row[name]:.9g}" for name in COLUMNS
    ]


def write_history(stream: TextIO, rows: Iterable[Mapping[str, float]]) -> None:
    """Write the header and the lines of a history; ``stream`` is open with ``newline=""``."""
    writer = csv.writer(stream)
    writer.writerow(COLUMNS)
    writer.writerows(as_written(row) for row in rows)


def read_history(file: Path) -> dict[str, Array]:
    """Return the columns (k,) of a history by name.

    Raises
    ------
    SolutionError
        If the file is not a history: other columns, a cell that is no number, times that do not
        increase.
    """
    damaged = f"{file} is damaged: replay the run again"
    try:
        filled = [line for line in file.read_text("utf-8").splitlines() if line.strip()]
    except UnicodeDecodeError:
        raise SolutionError(f"{damaged} (it is no text)") from None
    if len(filled) < 2:
        raise SolutionError(f"{damaged} (it holds no increment)")
    names, *lines = filled
    try:
        rows = np.loadtxt(lines, delimiter=",", ndmin=2)
    except ValueError:
        raise SolutionError(f"{damaged} (a cell is no number, or a row is cut)") from None
    if tuple(names.split(",")) != COLUMNS or rows.shape[1] != len(COLUMNS):
        raise SolutionError(f"{file} does not have the columns of a history: {','.join(COLUMNS)}")
    columns = {name: rows[:, column] for column, name in enumerate(COLUMNS)}
    if not np.isfinite(rows).all():
        raise SolutionError(
            f"{file} is damaged: a number is none, or infinite; replay the run again"
        )
    if not np.all(np.diff(columns["time_s"]) > 0):
        raise SolutionError(f"{file} is damaged: its times do not increase; replay the run again")
    return columns
