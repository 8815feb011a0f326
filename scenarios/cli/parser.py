"""What can be typed: the list of commands. Each declares its arguments when it is first used.

Importing this module and showing the list imports no command, so the help appears at once.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NoReturn, Protocol, cast

WRONG_INPUT = 2
NOT_FINISHED = 3


@dataclass(frozen=True)
class Command:
    """A line of the list of commands.

    Attributes
    ----------
    name
        What is typed.
    does
        What it does, as the list says it.
    example
        A line that works.
    """

    name: str
    does: str
    example: str


class CommandModule(Protocol):
    """The module of a command in `scenarios.cli.commands`.

    A module whose options are a table of settings names that table: ``SETTINGS``.
    """

    def arguments(self, parser: Parser) -> None:
        """Add what the command takes."""

    def run(self, options: argparse.Namespace) -> int:
        """Do it and return the exit code."""


COMMANDS = (
    Command(
        "demo",
        "the whole chain on the bundled A38-F recording",
        "drinksim demo --out demo",
    ),
    Command(
        "stickers",
        "print coded stickers, which convert finds and names by itself",
        "drinksim stickers --out sheet.pdf",
    ),
    Command(
        "mark",
        "mark a film in the browser: markers, scale, first contacts, corrections by dragging",
        "drinksim mark sip.mp4 --out marked",
    ),
    Command(
        "convert",
        "turn a video into motions of head and package and boundary-condition tables",
        "drinksim convert sip.mp4 --markers markers.toml --out sip",
    ),
    Command(
        "scenarios",
        "list the scenarios, or print one as a file with every setting, its unit and its source",
        "drinksim scenarios A38-F > mine.toml",
    ),
    Command(
        "preview",
        "show head and neck at three instants, and what is odd, before anything is computed",
        "drinksim preview A38-F --set package.crests=1 --out preview.png",
    ),
    Command(
        "replay",
        "replay a recorded sip on the model of the lips",
        "drinksim replay A38-F --out run --resolution coarse --set contact.friction=0.5",
    ),
    Command(
        "animate",
        "show a run as a film (.mp4, .gif) or as six frames (.png)",
        "drinksim animate run --out sip.mp4 --beside-video",
    ),
    Command(
        "report",
        "write one page about one run, or comparing several",
        "drinksim report a38-f dc-f --out report.html",
    ),
    Command(
        "export",
        "write a run for other programs",
        "drinksim export run --format vtk --out paraview",
    ),
    Command(
        "study",
        "compare necks on many people, with intervals, and say what matters",
        "drinksim study study.toml --out study --workers 2",
    ),
    Command(
        "optimise",
        "search the best dimensions of a neck for a panel of people",
        "drinksim optimise optimum.toml --out optimum --workers 2",
    ),
    Command(
        "element",
        "pull and press one cube of a material, as in the thesis' section 3.1.1",
        "drinksim element L2-Ogden/dermis --mode uniaxial --out cube",
    ),
    Command(
        "aspirate",
        "suck at layered tissue with a cup, as in the thesis' section 3.1.2",
        "drinksim aspirate L2-Ogden --out aspiration",
    ),
    Command(
        "calibrate",
        "fit a configuration to a suction curve",
        "drinksim calibrate L2-Ogden --target aspiration/aspiration.csv --out fit",
    ),
    Command(
        "sensitivity",
        "vary layers, parameters or mesh of the suction test",
        "drinksim sensitivity L2-Ogden --of thickness --out thickness",
    ),
    Command(
        "press",
        "press a threaded neck into a lip, as in the thesis' section 3.1.3",
        "drinksim press L2-Ogden --force 0.3 --neck A38 --out press",
    ),
)
"""Every command, in the order of the list. Its module in `scenarios.cli.commands` has its name."""


def module_of(name: str) -> CommandModule:
    """Import the module of a command."""
    return cast(CommandModule, import_module(f"scenarios.cli.commands.{name}"))


def complain(message: str, code: int = WRONG_INPUT) -> int:
    """Write one line to the standard error and return the exit code."""
    print(f"drinksim: {' '.join(message.split())}", file=sys.stderr)
    return code


def warn(message: str) -> None:
    """Write a warning to the standard error, in place of a line of progress."""
    clear = "\r\x1b[K" if sys.stderr.isatty() else ""
    print(f"{clear}drinksim: warning: {' '.join(message.split())}", file=sys.stderr, flush=True)


class Help(argparse.RawDescriptionHelpFormatter):
    """Leaves examples on one line, and gives names room."""

    def __init__(self, prog: str) -> None:
        columns = shutil.get_terminal_size().columns
        super().__init__(prog, max_help_position=24, width=min(columns, 100) - 2)


class Parser(argparse.ArgumentParser):
    """Complains about wrong usage in one line, and gets its arguments when it is first used."""

    declare: Callable[[Parser], None] | None = None
    """Adds the arguments; called once, before anything is parsed or shown."""

    def error(self, message: str) -> NoReturn:
        """Write the line and leave with the exit code of wrong input."""
        self.exit(complain(f"{message} (see {self.prog} --help)"))

    # argparse's own signature cannot be written without its private types.
    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; this also is what shows the help."""
        declare, self.declare = self.declare, None
        if declare is not None:
            declare(self)
        return super().parse_known_args(args, namespace)


class Version(argparse.Action):
    """Shows the version, which is looked up only then."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        """Print the version and leave."""
        from importlib.metadata import version

        print(f"drinksim {version('drinksim')}")
        parser.exit()


def drinksim_parser(commands: Sequence[Command] = COMMANDS) -> Parser:
    """Return the parser; what it parses holds the name of the command as ``command``."""
    # The list of commands is written by hand: argparse gives long names a line of their own.
    listed = "\n".join(f"  {command.name:<13}{command.does}" for command in commands)
    parser = Parser(
        prog="drinksim",
        usage="%(prog)s [-h] [--version] COMMAND ...",
        formatter_class=Help,
        description="A virtual consumer: how a package opening feels on the lips.",
        epilog=f"commands:\n{listed}\n\nexample: {commands[0].example}",
    )
    parser.add_argument("--version", action=Version, nargs=0, help="show the version and exit")
    added = parser.add_subparsers(
        prog="drinksim",
        metavar="COMMAND",
        dest="command",
        required=True,
        parser_class=Parser,
        help=argparse.SUPPRESS,
    )
    for command in commands:
        one: Parser = added.add_parser(
            command.name,
            description=f"{command.does[0].upper()}{command.does[1:]}.",
            epilog=f"example: {command.example}",
            formatter_class=Help,
        )
        one.declare = _declaring(command.name)
    return parser


def _declaring(name: str) -> Callable[[Parser], None]:
    """Return a function that adds the arguments of a command, importing its module only then."""
    return lambda parser: module_of(name).arguments(parser)
