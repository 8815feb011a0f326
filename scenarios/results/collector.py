"""Collecting a replay in memory, increment by increment, as the writer does on disk."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from scenarios.results.increment import Increment, SectionModel
from scenarios.results.solution import Solution
from scenarios.results.summary import run_summary
from scenarios.settings.scenario import Scenario


class SolutionCollector:
    """Collects the undeformed section and the increments of a replay."""

    def __init__(self) -> None:
        self._started = time.monotonic()
        self._model: SectionModel | None = None
        self._increments: list[Increment] = []

    @property
    def count(self) -> int:
        """How many increments there are."""
        return len(self._increments)

    def model(self, model: SectionModel) -> None:
        """Keep the undeformed section; once, before the first increment."""
        self._model = model

    def commit(self, increment: Increment) -> None:
        """Add a committed increment; its checkpoint, which nobody resumes from, is dropped."""
        self._increments.append(replace(increment, checkpoint={}))

    def finish(
        self, scenario: Scenario, *, finished: bool, message: str, about: Mapping[str, Any]
    ) -> Solution:
        """Return the solution; the arguments are those of the writer. There must be an increment.

        Parameters
        ----------
        scenario
            What was replayed.
        finished, message, about
            Whether the whole motion was replayed, how it ended, and further numbers.
        """
        assert self._model is not None
        summary = run_summary(
            [increment.row() for increment in self._increments],
            finished=finished,
            message=message,
            wall_s=time.monotonic() - self._started,
            about={"scenario": scenario.name, **about},
        )
        return Solution.of(scenario, self._model, self._increments, summary)
