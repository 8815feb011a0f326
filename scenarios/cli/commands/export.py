"""``drinksim export``: a run for other programs."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.progress import progress_line
from scenarios.cli.parser import Parser

WHAT = {
    "vtk": "run.pvd for ParaView, and its increments",
    "abaqus": "input deck for Abaqus/Standard",
    "imprint": "a table of pressure along the neck's contour",
    "pictures": "PNG pictures for slides",
}
"""Formats, and what each leaves."""


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.add_argument("run", metavar="DIR", type=Path, help="a run directory")
    parser.add_argument(
        "--format",
        choices=tuple(WHAT),
        required=True,
        help="; ".join(f"{name}: {what}" for name, what in WHAT.items()),
    )
    parser.add_argument(
        "--out",
        metavar="OUT",
        type=Path,
        required=True,
        help="directory for vtk and pictures, file for abaqus (run.inp) and imprint (.csv, "
        ".parquet)",
    )


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.export.abaqus import export_abaqus
    from scenarios.export.imprint import export_imprint
    from scenarios.export.pictures import export_pictures
    from scenarios.export.vtk import export_vtk

    exports = {
        "vtk": export_vtk,
        "abaqus": export_abaqus,
        "imprint": export_imprint,
        "pictures": export_pictures,
    }
    with progress_line("export") as progress:
        exports[options.format](options.run, options.out, progress=progress)
    print(f"{options.out}: {WHAT[options.format]}")
    return 0
