"""``drinksim mark``: a page on this machine that marks a film."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_interval, add_out
from scenarios.cli.parser import Parser, complain


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument("video", metavar="VIDEO", type=Path, help="the recording, side view")
    parser.add_argument(
        "--markers",
        metavar="FILE",
        type=Path,
        help="marker file (TOML) to start from; what was marked in --out before is gone on with",
    )
    add_out(parser)
    add_interval(parser)
    parser.add_argument(
        "--no-browser", action="store_true", help="only print the address, open no browser"
    )


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.marking.serving import Asked, opened_session, serve

    asked = Asked(
        options.video, options.out, options.markers, options.fps, options.start, options.end
    )
    with progress_line("mark") as progress:
        session = opened_session(asked, progress)

    def tell(address: str) -> None:
        print(f"{address}\nopen this address in a browser; Ctrl-C ends", flush=True)

    try:
        serve(session, browser=not options.no_browser, tell=tell)
    except KeyboardInterrupt:
        if session.past and session.saved is not session.state:
            return complain("interrupted; what was marked since the last save is gone", 130)
    if session.saved is not None:
        print(f"{options.out}: markers.toml, tracks.csv, scenario.toml")
    return 0
