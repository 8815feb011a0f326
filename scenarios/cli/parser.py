"""What can be typed: every command with its arguments, options, help and example."""

from __future__ import annotations

import argparse
import dataclasses
import importlib.metadata
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from textwrap import indent
from typing import NoReturn

from mocap.convert import ConvertOptions
from mocap.tracking.marker_file import EXAMPLE
from scenarios.results.quantities import ELEMENT_FIELDS
from scenarios.settings.files import split_setting
from scenarios.settings.scenario import Numerics
from scenarios.settings.tables import Table, keys_of, table_from
from scenarios.settings.writing import about
from scenarios.studies.element import ElementOptions
from scenarios.studies.fit import CalibrationOptions
from scenarios.studies.press import PressOptions
from scenarios.studies.sensitivity import KINDS
from scenarios.studies.suction_curve import AspirationOptions, CurveOptions

WRONG_INPUT = 2

SETTINGS_OF = {
    "element": ElementOptions,
    "aspirate": AspirationOptions,
    "calibrate": CalibrationOptions,
    "sensitivity": CurveOptions,
    "press": PressOptions,
}
"""Tables whose settings are options of a command."""


def complain(message: str, code: int = WRONG_INPUT) -> int:
    """Write one line to the standard error and return the exit code."""
    print(f"drinksim: {' '.join(message.split())}", file=sys.stderr)
    return code


class Parser(argparse.ArgumentParser):
    """Complains about wrong usage in one line that says where help is."""

    def error(self, message: str) -> NoReturn:
        """Write the line and leave with the exit code of wrong input."""
        self.exit(complain(f"{message} (see {self.prog} --help)"))


class Help(argparse.RawDescriptionHelpFormatter):
    """Leaves examples on one line, and gives names room."""

    def __init__(self, prog: str) -> None:
        columns = shutil.get_terminal_size().columns
        super().__init__(prog, max_help_position=24, width=min(columns, 100) - 2)


Adding = Callable[[str, str, str], Parser]
"""Takes the name of a command, what it does and an example, and returns its parser."""


def drinksim_parser() -> Parser:
    """Return the parser; what it parses holds the name of the command as ``command``."""
    parser = Parser(
        prog="drinksim",
        formatter_class=Help,
        description="A virtual consumer: how a package opening feels on the lips.",
    )
    version = f"%(prog)s {importlib.metadata.version('drinksim')}"
    parser.add_argument("--version", action="version", version=version)
    # The list of commands is written by hand: argparse gives long names a line of their own.
    commands = parser.add_subparsers(
        metavar="COMMAND", required=True, parser_class=Parser, help=argparse.SUPPRESS
    )
    listed = ["commands:"]

    def add(name: str, does: str, example: str) -> Parser:
        listed.append(f"  {name:<13}{does}")
        added: Parser = commands.add_parser(
            name,
            description=f"{does[0].upper()}{does[1:]}.",
            epilog=f"example: {example}",
            formatter_class=Help,
        )
        added.set_defaults(command=name)
        return added

    for declare in (_film_commands, _sip_commands, _run_commands, _study_commands):
        declare(add)
    parser.epilog = "\n".join([*listed, "", "example: drinksim demo --out demo"])
    return parser


def settings_of(table: type[Table], options: argparse.Namespace) -> Table:
    """Return the table of the options that :func:`_add_settings` added, checked."""
    names = [key.field.name for key in keys_of(table)]
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    values = {name: split_setting(f"{name}={text}")[1] for name, text in given.items()}
    return table_from(table, values, where="")


def given_settings(table: type[object], options: argparse.Namespace) -> list[str]:
    """Return the options of a table that were typed."""
    return [
        option_of(key.field.name)
        for key in keys_of(table)
        if getattr(options, key.field.name) is not None
    ]


def option_of(name: str) -> str:
    """Return the option that sets a field.

    >>> option_of("from_mm")
    '--from-mm'
    """
    return "--" + name.replace("_", "-")


def _film_commands(add: Adding) -> None:
    demo = add("demo", "the whole chain on the bundled A38-F recording", "drinksim demo --out demo")
    _add_out(demo)

    convert = add(
        "convert",
        "turn a video into motions of head and package and boundary-condition tables",
        "drinksim convert sip.mp4 --markers markers.toml --out sip",
    )
    convert.epilog = f"{convert.epilog}\n\na marker file:\n\n{indent(EXAMPLE, '  ')}"
    convert.add_argument("video", metavar="VIDEO", type=Path, help="the recording, side view")
    convert.add_argument(
        "--markers", metavar="FILE", type=Path, required=True, help="marker file (TOML)"
    )
    _add_out(convert)
    what = {field.name: about(field) for field in dataclasses.fields(ConvertOptions)}
    convert.add_argument("--start", metavar="S", type=float, help=what["start_s"])
    convert.add_argument("--end", metavar="S", type=float, help=what["end_s"])
    convert.add_argument("--tracks", metavar="FILE", type=Path, help=what["tracks"])
    convert.add_argument("--fps", metavar="RATE", type=float, help=what["fps"])


def _sip_commands(add: Adding) -> None:
    scenarios = add(
        "scenarios",
        "list the scenarios, or print one as a file with every setting, its unit and its source",
        "drinksim scenarios A38-F > mine.toml",
    )
    scenarios.add_argument("name", metavar="NAME", nargs="?", help="a library name or a file")
    scenarios.add_argument(
        "--redraw", metavar="DIR", type=Path, help="render a library recording anew, bit for bit"
    )
    _add_set(scenarios)

    preview = add(
        "preview",
        "show head and neck at three instants, and what is odd, before anything is computed",
        "drinksim preview A38-F --set package.crests=1 --out preview.png",
    )
    _add_scenario(preview)
    preview.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="picture: .png, .svg or .pdf"
    )
    _add_set(preview)

    replay = add(
        "replay",
        "replay a recorded sip on the model of the lips",
        "drinksim replay A38-F --out run --resolution coarse --set contact.friction=0.5",
    )
    _add_scenario(replay)
    _add_out(replay)
    for key in keys_of(Numerics, where="numerics"):
        if key.choices and key.path.count(".") == 1:
            replay.add_argument(
                f"--{key.field.name}",
                choices=key.choices,
                help=f"{about(key.field)} (default: the scenario's {key.path})",
            )
    left = replay.add_mutually_exclusive_group()
    left.add_argument(
        "--resume", action="store_true", help="go on with the unfinished run in --out, if any"
    )
    left.add_argument(
        "--overwrite", action="store_true", help="discard what an earlier run left in --out"
    )
    _add_set(replay)


def _run_commands(add: Adding) -> None:
    animate = add(
        "animate",
        "show a run as a film (.mp4, .gif) or as six frames (.png)",
        "drinksim animate run --out sip.mp4 --beside-video",
    )
    animate.add_argument("run", metavar="DIR", type=Path, help="a run directory")
    animate.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="ending in .mp4, .gif or .png"
    )
    animate.add_argument(
        "--beside-video", action="store_true", help="put the recording next to the model"
    )
    animate.add_argument(
        "--field",
        choices=[quantity.name for quantity in ELEMENT_FIELDS],
        default="von_mises_mpa",
        help="what the dermis is coloured by (default: %(default)s)",
    )

    report = add(
        "report",
        "write one page about one run, or comparing several",
        "drinksim report a38-f dc-f --out report.html",
    )
    report.add_argument("runs", metavar="DIR", type=Path, nargs="+", help="run directories")
    report.add_argument("--out", metavar="FILE", type=Path, required=True, help="ending in .html")

    export = add(
        "export",
        "write a run for other programs",
        "drinksim export run --format vtk --out paraview",
    )
    export.add_argument("run", metavar="DIR", type=Path, help="a run directory")
    export.add_argument(
        "--format",
        choices=("vtk", "abaqus"),
        required=True,
        help="vtk: a time series for ParaView; abaqus: an input deck of the model",
    )
    export.add_argument(
        "--out",
        metavar="OUT",
        type=Path,
        required=True,
        help="directory for vtk, file for abaqus (run.inp)",
    )


def _study_commands(add: Adding) -> None:
    element = add(
        "element",
        "pull and press one cube of a material, as in the thesis' section 3.1.1",
        "drinksim element L2-Ogden/dermis --mode uniaxial --out cube",
    )
    element.add_argument(
        "material", metavar="MATERIAL", nargs="?", help="a library name or a material file"
    )
    _add_out(element)
    _add_settings(element, SETTINGS_OF["element"])
    element.add_argument(
        "--thesis", action="store_true", help="redo the thesis' Figures 3.7 to 3.9 instead"
    )

    aspirate = add(
        "aspirate",
        "suck at layered tissue with a cup, as in the thesis' section 3.1.2",
        "drinksim aspirate L2-Ogden --out aspiration",
    )
    _add_configuration(aspirate, optional=True)
    _add_out(aspirate)
    _add_settings(aspirate, SETTINGS_OF["aspirate"])
    aspirate.add_argument(
        "--thesis", action="store_true", help="compare the thesis' four, also at high suction"
    )

    calibrate = add(
        "calibrate",
        "fit a configuration to a suction curve",
        "drinksim calibrate L2-Ogden --target aspiration/aspiration.csv --out fit",
    )
    _add_configuration(calibrate)
    calibrate.add_argument(
        "--target",
        metavar="FILE",
        type=Path,
        required=True,
        help="CSV file with columns pressure_kpa and apex_mm",
    )
    _add_out(calibrate)
    _add_settings(calibrate, SETTINGS_OF["calibrate"])

    sensitivity = add(
        "sensitivity",
        "vary layers, parameters or mesh of the suction test",
        "drinksim sensitivity L2-Ogden --of thickness --out thickness",
    )
    _add_configuration(sensitivity)
    sensitivity.add_argument("--of", choices=KINDS, required=True, help="what is varied")
    _add_out(sensitivity)
    _add_settings(sensitivity, SETTINGS_OF["sensitivity"])

    press = add(
        "press",
        "press a threaded neck into a lip, as in the thesis' section 3.1.3",
        "drinksim press L2-Ogden --force 0.3 --neck A38 --out press",
    )
    _add_configuration(press)
    _add_out(press)
    _add_settings(press, SETTINGS_OF["press"])


def _add_settings(parser: Parser, table: type[object]) -> None:
    """Add one option for every setting of a table."""
    for key in keys_of(table):
        parser.add_argument(
            option_of(key.field.name),
            metavar=None if key.choices else "VALUE",
            choices=key.choices or None,
            help=f"{about(key.field)} (default: {key.field.default})".replace("%", "%%"),
        )


def _add_scenario(parser: Parser) -> None:
    parser.add_argument(
        "scenario",
        metavar="SCENARIO",
        help="a library name (see drinksim scenarios) or a scenario file",
    )
    parser.add_argument(
        "--motion", metavar="FILE", type=Path, help="motion.csv to use instead of the scenario's"
    )


def _add_configuration(parser: Parser, *, optional: bool = False) -> None:
    parser.add_argument(
        "configuration",
        metavar="CONFIG",
        nargs="?" if optional else None,
        help="L1, L2-GOH, L2-Ogden, L3, or a TOML file with one table a layer",
    )


def _add_out(parser: Parser) -> None:
    parser.add_argument(
        "--out", metavar="DIR", type=Path, required=True, help="directory for the results"
    )


def _add_set(parser: Parser) -> None:
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="change a setting, e.g. contact.friction=0.5; may be repeated (drinksim scenarios NAME"
        " lists all); relative paths start from the current directory, those in a scenario file "
        "from the directory of the file",
    )
