"""``drinksim report``: one page about one run or several."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.progress import progress_line
from scenarios.cli.parser import Parser


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument("runs", metavar="DIR", type=Path, nargs="+", help="run directories")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="ending in .html")


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.views.page.report import write_report

    with progress_line("report") as progress:
        write_report(options.runs, options.out, progress=progress)
    print(options.out)
    return 0
