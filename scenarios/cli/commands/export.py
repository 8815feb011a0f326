"""``drinksim export``: a run for other programs."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.progress import progress_line
from scenarios.cli.parser import Parser


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument("run", metavar="DIR", type=Path, help="a run directory")
    parser.add_argument(
        "--format",
        choices=("vtk", "abaqus"),
        required=True,
        help="vtk: a time series for ParaView; abaqus: an input deck of the model",
    )
    parser.add_argument(
        "--out",
        metavar="OUT",
        type=Path,
        required=True,
        help="directory for vtk, file for abaqus (run.inp)",
    )


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.export.abaqus import export_abaqus
    from scenarios.export.vtk import export_vtk

    with progress_line("export") as progress:
        if options.format == "abaqus":
            export_abaqus(options.run, options.out, progress=progress)
        else:
            export_vtk(options.run, options.out, progress=progress)
    what = {
        "abaqus": "input deck for Abaqus/Standard",
        "vtk": "run.pvd for ParaView, and its increments",
    }
    print(f"{options.out}: {what[options.format]}")
    return 0
