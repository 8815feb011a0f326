"""``drinksim press``: a neck pressed into a lip."""

from __future__ import annotations

from argparse import Namespace

from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_configuration, add_out, add_settings, settings_of
from scenarios.cli.parser import Parser
from scenarios.studies.press import PressOptions

SETTINGS = PressOptions


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    add_configuration(parser)
    add_out(parser)
    add_settings(parser, SETTINGS)


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.studies.press_study import press_study

    chosen = settings_of(SETTINGS, options)
    with progress_line("press") as progress:
        result = press_study(options.configuration, options.out, chosen, progress=progress)
    print("\n".join([f"{result.folder}: press.json, press.png", *result.messages]))
    return 0
