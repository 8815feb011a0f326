"""Scenarios and solutions that solve and draw themselves.

Here their methods get the functions of the rooms above them; each room is imported when one of its
functions is first called.
"""

from __future__ import annotations

from scenarios.results.solution import (
    HISTORY_PLOT,
    NOTEBOOK_MARKUP,
    SNAPSHOT_PLOT,
    HistoryPlot,
    NotebookMarkup,
    SnapshotPlot,
)
from scenarios.results.solution import Solution as Solution
from scenarios.settings.scenario import SOLVER, Solver
from scenarios.settings.scenario import Scenario as Scenario
from scenarios.settings.scenario import library_names as library_names
from scenarios.settings.scenario import load_scenario as load_scenario


@SOLVER.loaded_by
def _solver() -> Solver:
    from scenarios.sip.run import solve

    return solve


@HISTORY_PLOT.loaded_by
def _history_plot() -> HistoryPlot:
    from scenarios.views.on_axes import plot_history

    return plot_history


@SNAPSHOT_PLOT.loaded_by
def _snapshot_plot() -> SnapshotPlot:
    from scenarios.views.on_axes import plot_snapshot

    return plot_snapshot


@NOTEBOOK_MARKUP.loaded_by
def _notebook_markup() -> NotebookMarkup:
    from scenarios.views.page.notebook import solution_markup

    return solution_markup
