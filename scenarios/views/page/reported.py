"""The runs of a report: what each is called, and what is shown of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.neck import NeckSection
from scenarios.messages.verdict import Verdict
from scenarios.results.doubt import Doubt
from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution, loaded
from scenarios.settings.scenario import Scenario
from scenarios.views.plots import imprint
from scenarios.views.run_view import RunView

Array = NDArray[np.float64]


class ReportError(DrinksimError):
    """These runs cannot be reported together, or not there."""


@dataclass(frozen=True)
class Reported:
    """One run of a report: what it is called there, and what is shown of it."""

    label: str
    anchor: str
    run_view: RunView
    neck: NeckSection
    verdict: Verdict

    @property
    def solution(self) -> Solution:
        """The run's solution."""
        return self.run_view.solution

    @property
    def scenario(self) -> Scenario:
        """What was replayed."""
        return self.solution.scenario

    @property
    def relative_time(self) -> Array:
        """(k,) 0…1."""
        return self.solution["relative_time"].values

    def force(self, axis: str) -> Array:
        """Return the force of both lips on the neck along ``axis``, x or y: (k,) N per mm width."""
        both = sum(self.solution[f"{lip}_lip_force_{axis}_n"].values for lip in LIPS)
        return np.asarray(both) / self.scenario.numerics.thickness_mm

    @cached_property
    def doubt(self) -> Doubt | None:
        """What its recording leaves open, if that was computed."""
        return Doubt.of(self.solution.folder)

    def band(self, name: str) -> tuple[Array, Array] | None:
        """Return between which values an output lies, (k,) each; None if that is not known."""
        return None if self.doubt is None else self.doubt.band(name, self.relative_time)

    def band_of_force(self, axis: str, factor: float) -> tuple[Array, Array] | None:
        """Return the band of :meth:`force`, times a factor; None if it is not known."""
        if self.doubt is None:
            return None
        scale = factor / self.scenario.numerics.thickness_mm
        low, high = self.doubt.band_of_force(axis, self.relative_time)
        return scale * low, scale * high

    @property
    def touched_s(self) -> float:
        """How long either lip touches the neck, s."""
        touching = sum(self.solution[f"{lip}_lip_contact_mm"].values for lip in LIPS) > 0
        return float(np.trapezoid(np.asarray(touching, float), self.solution.time_s))

    def most_pressed(self, lip: str) -> str:
        """Return what is most pressed by a lip: the rim, a crest of the thread."""
        arc, pressure = imprint(self.solution, lip)
        highest = pressure.max(axis=0)
        if highest.max() <= 0:
            return "nothing"
        place = arc[highest.argmax()]
        stretches = getattr(self.neck, f"{lip}_stretches")
        names = (name for name, (start, end) in stretches.items() if start <= place <= end)
        return next(names, "bore").replace("_", " ")


def reported_runs(runs: Sequence[Solution | Path]) -> list[Reported]:
    """Return what is reported of each run, coloured alike: only that can be compared."""
    if not runs:
        raise ReportError("no run directory given: name one or several")
    solutions = [loaded(run) for run in runs]
    _refuse_doubles(solutions)
    views = [_view_of(solution) for solution in solutions]
    limits = max(view.limits[0] for view in views), max(view.limits[1] for view in views)
    folders = _told_apart(solutions)
    names = Counter(solution.scenario.name for solution in solutions)
    return [
        Reported(
            label=_label(solution.scenario.name, folders[number - 1], names),
            anchor=f"run-{number}",
            run_view=replace(view, limits=limits),
            neck=solution.scenario.package.section(),
            verdict=Verdict.of(solution.summary),
        )
        for number, (solution, view) in enumerate(zip(solutions, views, strict=True), start=1)
    ]


def _refuse_doubles(solutions: Sequence[Solution]) -> None:
    """Refuse a run directory or a solution that is given twice."""
    which = [id(s) if s.folder is None else s.folder.resolve() for s in solutions]
    for solution, same in zip(solutions, which, strict=True):
        if which.count(same) > 1:
            named = solution.folder or f"{solution!r}"
            raise ReportError(f"{named} is given more than once: name every run once")


def _label(name: str, folder: str, names: Mapping[str, int]) -> str:
    return name if names[name] == 1 or name == folder else f"{name} ({folder})"


def _told_apart(solutions: Sequence[Solution]) -> list[str]:
    """Return what tells runs of one scenario apart: their folders, as short as that can be."""
    names = ["" if s.folder is None else s.folder.resolve().name for s in solutions]
    return [
        str(number if solution.folder is None else solution.folder)
        if not name or names.count(name) > 1
        else name
        for number, (name, solution) in enumerate(zip(names, solutions, strict=True), start=1)
    ]


def _view_of(solution: Solution) -> RunView:
    """Return the view of a solution, with the recording wherever its file is still there."""
    recording = solution.scenario.recording
    there = recording is not None and all(
        Path(file).is_file() for file in (recording.video, recording.markers) if file is not None
    )
    return RunView.of(solution, field="von_mises_mpa", beside_video=there)
