"""``drinksim animate``: a run as a film or as frames."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.progress import progress_line
from scenarios.cli.parser import Parser
from scenarios.results.quantities import ELEMENT_FIELDS
from scenarios.views.themes import THEMES


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument("run", metavar="DIR", type=Path, help="a run directory")
    parser.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="ending in .mp4, .gif or .png"
    )
    parser.add_argument(
        "--beside-video", action="store_true", help="put the recording next to the model"
    )
    parser.add_argument(
        "--over-video", action="store_true", help="lay the model over the recording"
    )
    parser.add_argument(
        "--at", metavar="SHARE", type=float, help="this instant alone, 0 to 1 of the sip, as .png"
    )
    parser.add_argument(
        "--field",
        choices=[quantity.name for quantity in ELEMENT_FIELDS],
        default="von_mises_mpa",
        help="what tissue is coloured by (default: %(default)s)",
    )
    parser.add_argument(
        "--theme",
        choices=tuple(THEMES),
        default=next(iter(THEMES)),
        help="paper under the pictures; dark for a dim room (default: %(default)s)",
    )


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.views.animation import animate

    with progress_line("animate") as progress:
        animate(
            options.run,
            options.out,
            beside_video=options.beside_video,
            over_video=options.over_video,
            at=options.at,
            field=options.field,
            theme=options.theme,
            progress=progress,
        )
    print(options.out)
    return 0
