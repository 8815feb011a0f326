"""``drinksim optimise``: the best dimensions of a neck for a panel of people."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from scenarios.cli.options import add_out, add_workers, check_workers
from scenarios.cli.parser import NOT_FINISHED, Parser, complain


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument("optimum", metavar="FILE", type=Path, help="an optimisation file (TOML)")
    add_out(parser)
    add_workers(parser)
    parser.add_argument(
        "--resume", action="store_true", help="go on with an unfinished search in --out"
    )


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.optimum.found import optimum_message
    from scenarios.optimum.optimise import optimise

    check_workers(options)
    found = optimise(
        options.optimum,
        options.out,
        workers=options.workers,
        scheduler=options.scheduler,
        resume=options.resume,
        progress=True,
    )
    if not found.best:
        return complain(optimum_message(found), NOT_FINISHED)
    print(optimum_message(found))
    return 0
