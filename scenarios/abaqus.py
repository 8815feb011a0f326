"""A run's model as an input deck for Abaqus."""

from __future__ import annotations

from pathlib import Path

from fem2d.deck import abaqus_deck
from scenarios.drinking import Lips, contact_period, observed
from scenarios.output import file_at_once
from scenarios.solution import Solution
from scenarios.spec import read_scenario


def export_abaqus(run: Path, out: Path) -> None:
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
    scenario = read_scenario(str(run / "scenario.toml"))
    neck, head = scenario.package.section(), scenario.head_section()
    seen = observed(scenario, neck, head)
    system = Lips(scenario, head, neck, seen.head_angle_rad).system
    start_s, end_s = contact_period(system, seen.neck)
    title = f"drinksim: {scenario.name}, {scenario.solver.resolution}"
    deck = abaqus_deck(system, seen.neck, start_s=start_s, end_s=end_s, title=title)
    with file_at_once(out) as partial:
        partial.write_text(deck, encoding="ascii")
