"""``drinksim scenarios``: list scenarios, print one as a file, render its recording anew."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_set
from scenarios.cli.parser import Parser, complain
from scenarios.settings.scenario import library_names, load_scenario, resolved_toml


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument("name", metavar="NAME", nargs="?", help="a library name or a file")
    parser.add_argument(
        "--redraw", metavar="DIR", type=Path, help="render a library recording anew, bit for bit"
    )
    add_set(parser)


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    if options.name is None:
        if options.set or options.redraw is not None:
            return complain("no NAME given: say which scenario --set or --redraw is about")
        for name in library_names():
            print(f"{name:<13}  {load_scenario(name).description}")
        return 0
    if options.redraw is not None:
        if options.set:
            return complain("--set has no effect beside --redraw: give one of them")
        return _redraw(options.name, options.redraw)
    sys.stdout.write(resolved_toml(load_scenario(options.name, options.set)))
    return 0


def _redraw(name: str, out: Path) -> int:
    from scenarios.recordings.rendering import redraw

    with progress_line("redraw") as progress, directory_at_once(out) as partial:
        progress(0.0, f"rendering the recording of {name}")
        redraw(name, partial)
    print(f"{out}: recording.mp4, markers.toml and the truth behind them")
    return 0
