"""``drinksim aspirate``: suction at layered tissue."""

from __future__ import annotations

from argparse import Namespace

from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_configuration, add_out, add_settings, settings_of
from scenarios.cli.parser import NOT_FINISHED, Parser, complain
from scenarios.studies.suction_curve import AspirationOptions

SETTINGS = AspirationOptions


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    add_configuration(parser, optional=True)
    add_out(parser)
    add_settings(parser, SETTINGS)
    parser.add_argument(
        "--thesis", action="store_true", help="compare the thesis' four, also at high suction"
    )


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.studies.aspiration import aspiration_study, thesis_comparison

    chosen = settings_of(SETTINGS, options)
    with progress_line("aspirate") as progress:
        if options.thesis:
            if options.configuration is not None:
                return complain("CONFIG has no effect beside --thesis: leave it out")
            result = thesis_comparison(options.out, chosen, progress=progress)
            files = "aspiration-*.csv, high-*.csv, comparison.png"
        elif options.configuration is None:
            return complain("no CONFIG given: name one, or compare the thesis' with --thesis")
        else:
            result = aspiration_study(options.configuration, options.out, chosen, progress=progress)
            files = "aspiration.csv, aspiration.png, field.png"
    print("\n".join([f"{result.folder}: {files}", *result.messages]))
    return 0 if result.complete else complain(result.messages[-1], NOT_FINISHED)
