"""``drinksim sensitivity``: layers, parameters or mesh of the suction test varied."""

from __future__ import annotations

from argparse import Namespace

from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_configuration, add_out, add_settings, settings_of
from scenarios.cli.parser import Parser
from scenarios.studies.sensitivity import KINDS
from scenarios.studies.suction_curve import CurveOptions

SETTINGS = CurveOptions


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    add_configuration(parser)
    parser.add_argument("--of", choices=KINDS, required=True, help="what is varied")
    add_out(parser)
    add_settings(parser, SETTINGS)


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.studies.sensitivity import sensitivity_study

    chosen = settings_of(SETTINGS, options)
    with progress_line(f"sensitivity to {options.of}") as progress:
        result = sensitivity_study(
            options.configuration, options.of, options.out, chosen, progress=progress
        )
    print("\n".join([f"{result.folder}:", *result.messages]))
    return 0
