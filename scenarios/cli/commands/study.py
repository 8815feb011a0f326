"""``drinksim study``: many sips, their differences, and how sure these are."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_out
from scenarios.cli.parser import NOT_FINISHED, Parser, complain


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument("study", metavar="STUDY", type=Path, help="a study file (TOML)")
    add_out(parser)
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        metavar="N",
        type=int,
        help="processes of one thread each on this machine (default: all in this process)",
    )
    where.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="a Dask scheduler, e.g. tcp://host:8786, whose workers see the same files",
    )
    parser.add_argument(
        "--resume",
        action="store_true",
        help="go on with an unfinished study in --out, or use what it has of another one",
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="say how many sips and how long, show each neck, and compute nothing",
    )


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.campaign.run import dry_run, dry_run_message, run_study, study_message

    if options.workers is not None and options.workers < 1:
        return complain(f"--workers {options.workers}: give at least 1, or leave it out")
    if options.dry_run:
        with progress_line("study") as progress:
            found = dry_run(options.study, options.out, workers=options.workers, progress=progress)
        print(dry_run_message(found, options.workers))
        return 0
    result = run_study(
        options.study,
        options.out,
        workers=options.workers,
        scheduler=options.scheduler,
        resume=options.resume,
        progress=True,
    )
    print(study_message(result))
    if not any(row["status"] == "whole" for row in result.rows):
        return complain("no sip was replayed to its end: study.html says why", NOT_FINISHED)
    return 0
