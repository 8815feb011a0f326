"""What a run's recording leaves open: histories of sampled motions, kept beside the run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenarios.results.history_file import HISTORY_FILE, read_history

Array = NDArray[np.float64]

DOUBT_FOLDER = "doubt"
"""Folder of a run directory with a study of the same sip with sampled motions."""

SHARE = 0.9
"""Of the samples that a band holds."""


@dataclass(frozen=True)
class Doubt:
    """Histories of one sip with sampled motions: columns (k,) by name, each with its own k."""

    histories: tuple[Mapping[str, Array], ...]

    @classmethod
    def of(cls, run: Path | None) -> Doubt | None:
        """Return what is beside a run; None if there is nothing."""
        if run is None:
            return None
        files = sorted((run / DOUBT_FOLDER).glob(f"runs/*/{HISTORY_FILE}"))
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
