"""``drinksim element``: one cube of a material."""

from __future__ import annotations

from argparse import Namespace

from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_out, add_settings, given_settings, settings_of
from scenarios.cli.parser import Parser, complain
from scenarios.studies.element import ElementOptions

SETTINGS = ElementOptions


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument(
        "material", metavar="MATERIAL", nargs="?", help="a library name or a material file"
    )
    add_out(parser)
    add_settings(parser, SETTINGS)
    parser.add_argument(
        "--thesis", action="store_true", help="redo the thesis' Figures 3.7 to 3.9 instead"
    )


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.studies.element import element_study, thesis_figures

    with progress_line("element") as progress:
        if options.thesis:
            ineffective = given_settings(SETTINGS, options)
            ineffective += ["MATERIAL"] if options.material is not None else []
            if ineffective:
                return complain(f"{ineffective[0]} has no effect beside --thesis: leave it out")
            result = thesis_figures(options.out, progress=progress)
        elif options.material is None:
            return complain("no MATERIAL given: name one, or redo the thesis' figures: --thesis")
        else:
            chosen = settings_of(SETTINGS, options)
            result = element_study(options.material, options.out, chosen)
    pictures = ", ".join(sorted(path.name for path in result.folder.glob("*.png")))
    print("\n".join([f"{result.folder}: {pictures}, and the curves as CSV", *result.messages]))
    return 0
