"""A run's model as an input deck for Abaqus."""

from __future__ import annotations

from pathlib import Path

from fem2d.export.deck import abaqus_deck
from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.progress import Progress, no_progress
from scenarios.results.solution import Solution
from scenarios.settings.files import SCENARIO_FILE
from scenarios.settings.scenario import load_scenario
from scenarios.sip.replay import prepared


def export_abaqus(run: Path, out: Path, *, progress: Progress = no_progress) -> None:
    """Write the model of a run directory, meshed and driven as it was, into the file ``out``.

    Raises
    ------
    SolutionError
        If ``run`` is not a run directory.
    OutputError
        If ``out`` cannot be written.
    DeckError
        If the model holds something that a deck cannot say.
    """
    Solution.load(run)
    scenario = load_scenario(str(run / SCENARIO_FILE))
    ready = prepared(scenario, progress=progress)
    deck = abaqus_deck(
        ready.lips.fem_model,
        ready.motion,
        start_s=ready.start_s,
        end_s=ready.end_s,
        title=f"drinksim: {scenario.name}, {scenario.numerics.resolution}",
    )
    with file_at_once(out) as partial:
        partial.write_text(deck, encoding="ascii")
