"""``drinksim calibrate``: a configuration fitted to a suction curve."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from geometry2d.foundation.progress import progress_line
from scenarios.cli.options import add_configuration, add_out, add_settings, settings_of
from scenarios.cli.parser import NOT_FINISHED, Parser, complain
from scenarios.studies.fit import CalibrationOptions

SETTINGS = CalibrationOptions


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    add_configuration(parser)
    parser.add_argument(
        "--target",
        metavar="FILE",
        type=Path,
        required=True,
        help="CSV file with columns pressure_kpa and apex_mm",
    )
    add_out(parser)
    add_settings(parser, SETTINGS)


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.studies.calibration import calibration_study
    from scenarios.studies.curve_gradient import CalibrationStopped

    chosen = settings_of(SETTINGS, options)
    with progress_line("calibrate") as progress:
        try:
            result = calibration_study(
                options.configuration, options.target, options.out, chosen, progress=progress
            )
        except CalibrationStopped as stopped:
            return complain(f"{stopped}; what was computed is kept", NOT_FINISHED)
    print("\n".join([f"{result.folder}: calibration.json, calibration.png", *result.messages]))
    return 0 if result.complete else complain(result.messages[0], NOT_FINISHED)
