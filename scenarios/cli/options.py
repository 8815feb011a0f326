"""Options that several commands share, and the values that they stand for."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import fields
from pathlib import Path

from scenarios.cli.parser import Parser
from scenarios.settings.files import split_setting
from scenarios.settings.scenario import Scenario, load_scenario
from scenarios.settings.tables import SettingError, Table, keys_of, table_from
from scenarios.settings.writing import about, toml_value


def settings_of(table: type[Table], options: Namespace) -> Table:
    """Return the table of the options that :func:`add_settings` added, checked."""
    names = [key.field.name for key in keys_of(table)]
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    values = {name: split_setting(f"{name}={text}")[1] for name, text in given.items()}
    return table_from(table, values, where="")


def given_settings(table: type[object], options: Namespace) -> list[str]:
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


def add_settings(parser: Parser, table: type[object]) -> None:
    """Add one option for every setting of a table."""
    for key in keys_of(table):
        parser.add_argument(
            option_of(key.field.name),
            metavar=None if key.choices else "VALUE",
            choices=key.choices or None,
            help=f"{about(key.field)} (default: {key.field.default})".replace("%", "%%"),
        )


def add_scenario(parser: Parser) -> None:
    """Add the scenario and the motion that may take the place of its own."""
    parser.add_argument(
        "scenario",
        metavar="SCENARIO",
        help="a library name (see drinksim scenarios) or a scenario file",
    )
    parser.add_argument(
        "--motion", metavar="FILE", type=Path, help="motion.csv to use instead of the scenario's"
    )


def add_configuration(parser: Parser, *, optional: bool = False) -> None:
    """Add the configuration of layered tissue."""
    parser.add_argument(
        "configuration",
        metavar="CONFIG",
        nargs="?" if optional else None,
        help="L1, L2-GOH, L2-Ogden, L3, or a TOML file with one table a layer",
    )


def add_out(parser: Parser) -> None:
    """Add the directory of the results."""
    parser.add_argument(
        "--out", metavar="DIR", type=Path, required=True, help="directory for the results"
    )


def add_interval(parser: Parser) -> None:
    """Add which part of a film is used, and at which rate its camera took it."""
    from mocap.convert import ConvertOptions

    what = {field.name: about(field) for field in fields(ConvertOptions)}
    parser.add_argument("--start", metavar="S", type=float, help=what["start_s"])
    parser.add_argument("--end", metavar="S", type=float, help=what["end_s"])
    parser.add_argument("--fps", metavar="RATE", type=float, help=what["fps"])


def add_workers(parser: Parser) -> None:
    """Add where many sips are computed."""
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


def check_workers(options: Namespace) -> None:
    """Raise :class:`SettingError` for a number of workers that is none."""
    if options.workers is not None and options.workers < 1:
        raise SettingError(f"--workers {options.workers}: give at least 1, or leave it out")


def add_set(parser: Parser) -> None:
    """Add the option that changes a setting of a scenario."""
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="change a setting, e.g. contact.friction=0.5; may be repeated (drinksim scenarios NAME"
        " lists all); relative paths start from the current directory, those in a scenario file "
        "from the directory of the file",
    )


def chosen_scenario(options: Namespace) -> Scenario:
    """Return the scenario with what the options change."""
    settings = list(options.set)
    for name in ("plane", "resolution"):
        if getattr(options, name, None) is not None:
            settings.append(f"numerics.{name}={getattr(options, name)}")
    if options.motion is not None:
        settings.append(f"motion.file={toml_value(str(options.motion))}")
    return load_scenario(options.scenario, settings)
