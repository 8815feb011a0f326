"""``drinksim study``: many sips, their differences, and how sure these are."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_out, add_workers, check_workers
from scenarios.cli.parser import NOT_FINISHED, Parser, complain


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument("study", metavar="STUDY", type=Path, help="a study file (TOML)")
    add_out(parser)
    add_workers(parser)
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
    from scenarios.decision.run import dry_run, dry_run_message, run_study, study_message

    check_workers(options)
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
