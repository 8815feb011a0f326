"""``drinksim stickers``: a sheet of coded stickers to print."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from scenarios.cli.parser import Parser


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="sheet: .pdf, .svg or .png"
    )


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from mocap.stickers.sheet import write_sheet

    write_sheet(options.out)
    print(f"{options.out}: print it at 100 % and measure its bar")
    return 0
