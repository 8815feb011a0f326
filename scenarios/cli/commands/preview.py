"""``drinksim preview``: head and neck at three instants, before anything is computed."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_scenario, add_set, chosen_scenario
from scenarios.cli.parser import Parser, complain


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    add_scenario(parser)
    parser.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="picture: .png, .svg or .pdf"
    )
    add_set(parser)


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.sip.findings import Severity
    from scenarios.views.preview import write_preview

    with progress_line("preview") as progress:
        found = write_preview(chosen_scenario(options), options.out, progress=progress)
    errors = [finding for finding in found if finding.severity is Severity.ERROR]
    for finding in found:
        if finding.severity is Severity.WARNING:
            print(f"warning: {finding}")
    if errors:
        return complain("; ".join(str(finding) for finding in errors))
    print(f"{options.out}: head and neck at first contact, half way and at last contact")
    return 0
