"""What a run's recording leaves open: histories of sampled motions, beside the run or in a study.

A study's directory holds ``results.csv``, and the run of a sip in ``runs/…/run``.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenarios.results.history_file import HISTORY_FILE, read_history

Array = NDArray[np.float64]

DOUBT_FOLDER = "doubt"
"""Folder of a run directory with a study of the same sip with sampled motions."""

STUDY_TABLE, DRAW, FIRST_RESULT = "results.csv", "draw", "status"
"""The table of a study, its column of draws, and the first column of what came out."""

RUN_FOLDER = "run"
"""Folder of a sip of a study with its run, where runs are kept."""

SHARE = 0.9
"""Of the samples that a band holds."""


@dataclass(frozen=True)
class Doubt:
    """Histories of one sip with sampled motions: columns (k,) by name, each with its own k."""

    histories: tuple[Mapping[str, Array], ...]

    @classmethod
    def of(cls, run: Path | None) -> Doubt | None:
        """Return what is beside a run, or in the study that it is part of; None if nothing is.

        In a study those are the same sip's with other draws of the doubt, its own among them.
        """
        if run is None:
            return None
        files = sorted((run / DOUBT_FOLDER).glob(f"runs/*/{HISTORY_FILE}")) or _other_draws(run)
        return cls(tuple(read_history(file) for file in files)) if files else None

    @property
    def count(self) -> int:
        """How many samples there are."""
        return len(self.histories)

    @cached_property
    def _tail(self) -> list[float]:
        return [0.5 * (1 - SHARE), 0.5 * (1 + SHARE)]

    def band(self, name: str, relative_time: Array) -> tuple[Array, Array]:
        """Return between which values `SHARE` of the samples lie, (k,) each.

        Parameters
        ----------
        name
            A column of a history.
        relative_time
            (k,) 0…1.
        """
        return self._band([history[name] for history in self.histories], relative_time)

    def band_of_force(self, axis: str, relative_time: Array) -> tuple[Array, Array]:
        """Return the band of the force of both lips on the neck along x or y, N."""
        both = [
            h[f"upper_lip_force_{axis}_n"] + h[f"lower_lip_force_{axis}_n"] for h in self.histories
        ]
        return self._band(both, relative_time)

    def _band(self, columns: list[Array], relative_time: Array) -> tuple[Array, Array]:
        sampled = [
            np.interp(relative_time, history["relative_time"], column)
            for history, column in zip(self.histories, columns, strict=True)
        ]
        low, high = np.quantile(sampled, self._tail, axis=0)
        return low, high

    def peak(self, name: str) -> tuple[float, float]:
        """Return between which values the largest value of a column lies."""
        peaks = [float(history[name].max()) for history in self.histories]
        low, high = np.quantile(peaks, self._tail)
        return float(low), float(high)


def _other_draws(run: Path) -> list[Path]:
    """Return histories of the sips of a study that differ from a run's in their draw alone."""
    sip = run.resolve().parent
    study = sip.parent.parent
    table = study / STUDY_TABLE
    if not table.is_file():
        return []
    with table.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    if not rows or DRAW not in rows[0]:
        return []
    choices = [name for name in _choices(list(rows[0])) if name != DRAW]
    mine = next((row for row in rows if study / row["run"] == sip), None)
    if mine is None:
        return []
    same = [row for row in rows if all(row[name] == mine[name] for name in choices)]
    there = (
        study / row["run"] / place / HISTORY_FILE for row in same for place in (".", RUN_FOLDER)
    )
    found = sorted(file for file in there if file.is_file())
    return found if len(found) > 1 else []


def _choices(columns: Sequence[str]) -> Sequence[str]:
    """Return the columns of a study's table that say which sip a row is."""
    return columns[: columns.index(FIRST_RESULT)] if FIRST_RESULT in columns else columns
