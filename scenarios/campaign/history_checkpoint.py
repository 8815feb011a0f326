"""A replay of which only the history is kept, in one file from which it can go on.

A run directory keeps every field of every increment. Of a sip among hundreds only its history is
wanted. The file holds the rows so far and the last state, and is written again every few seconds.
"""

from __future__ import annotations

import time
import zlib
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.output import file_at_once
from geometry2d.rigid import UNMOVED
from scenarios.results.history_file import COLUMNS, as_written
from scenarios.results.increment import Increment

Array = NDArray[np.float64]

EVERY_S = 20.0
"""Seconds of computation that an interruption may cost."""

STATE = "state/"
"""Beginning of the names of the arrays of the last state."""


class HistoryCheckpoint:
    """Collects rows of a history and keeps them, with the last state, in a file.

    Parameters
    ----------
    file
        Ending in ``.npz``; what it holds is gone on with, unless it is damaged.
    every_s
        How often it is written, s.
    """

    def __init__(self, file: Path, *, every_s: float = EVERY_S) -> None:
        self._file, self._every_s = file, every_s
        self._rows: list[list[float]] = []
        self._written_at = time.monotonic()
        self.last = self._read()

    def commit(self, increment: Increment) -> None:
        """Add a committed increment."""
        # The digits of a history.csv: the same history comes out of a run directory.
        self._rows.append([float(entry) for entry in as_written(increment.row())])
        if time.monotonic() - self._written_at >= self._every_s:
            self._write(increment)
            self._written_at = time.monotonic()

    @property
    def history(self) -> dict[str, Array]:
        """Columns (k,) by name; k may be 0."""
        table = np.array(self._rows).reshape(-1, len(COLUMNS))
        return {name: table[:, column] for column, name in enumerate(COLUMNS)}

    def _write(self, increment: Increment) -> None:
        state = {f"{STATE}{name}": array for name, array in increment.checkpoint.items()}
        with file_at_once(self._file) as partial:
            np.savez(
                partial,
                rows=np.array(self._rows),
                time=np.array([increment.time_s, increment.relative_time]),
                **state,  # type: ignore[arg-type]
            )

    def _read(self) -> Increment | None:
        """Return the last increment that the file holds, with its state only."""
        try:
            with self._file.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
            rows, (time_s, relative_time) = arrays["rows"].tolist(), arrays["time"].tolist()
        except (OSError, ValueError, KeyError, EOFError, BadZipFile, zlib.error):
            return None
        self._rows = rows
        return Increment(
            time_s=time_s,
            relative_time=relative_time,
            placement=UNMOVED,
            displacement=np.empty((0, 2)),
            element={},
            contact={},
            history={},
            newton_iterations=0,
            cutbacks=0,
            checkpoint={
                name.removeprefix(STATE): array
                for name, array in arrays.items()
                if name.startswith(STATE)
            },
        )
