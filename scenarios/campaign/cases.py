"""The sips of a study as cases, each known by the content of all that it depends on."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from scenarios.results.integrity import checksum
from scenarios.settings.layers import values_by_path
from scenarios.settings.scenario import SHAPE, Scenario
from scenarios.settings.tables import Value
from scenarios.settings.writing import toml_value

IDENTITY_DIGITS = 20

NOT_COMPUTED_WITH = ("name", "description")
"""Settings that change no result."""

FACTORS = ("neck", "person", "motion", "draw")
"""Columns that say which sip it is, before those of the varied settings."""


@dataclass(frozen=True)
class Case:
    """One sip that is to be computed.

    Attributes
    ----------
    identity
        Hash of the resolved scenario, with the content of its files, and the product's version.
    factors
        Values of `FACTORS` and of the varied settings, by column.
    scenario_toml
        The scenario, its paths relative to the case's directory.
    """

    identity: str
    factors: Mapping[str, Value]
    scenario_toml: str


def case_of(
    scenario: Scenario,
    factors: Mapping[str, Value],
    runs: Path,
    known: Mapping[str, str] | None = None,
) -> Case:
    """Return the case of a scenario.

    Parameters
    ----------
    scenario
        What is computed.
    factors
        Which sip of the study it is.
    runs
        Folder in which it is computed, in a directory called like the case.
    known
        What stands for the content of files and directories that are yet to be made, by path.
    """
    values = values_by_path(scenario)
    identity = identity_of(values, known)
    lines: dict[str, list[str]] = {}
    for path, value in values.items():
        table, _, key = path.rpartition(".")
        shown = os.path.relpath(str(value), runs / identity) if is_file(path) else value
        lines.setdefault(table, []).append(f"{key} = {toml_value(shown)}")
    text = "\n".join(
        "\n".join([*([f"[{table}]"] if table else []), *entries, ""])
        for table, entries in sorted(lines.items())
    )
    return Case(identity, dict(factors), text)


def is_file(path: str) -> bool:
    """Whether a setting holds the path of a file."""
    return path in SHAPE.keys and bool(SHAPE.keys[path].field.metadata.get("file"))


def identity_of(values: Mapping[str, Value], known: Mapping[str, str] | None = None) -> str:
    """Return the hash of a scenario's values by path; files count by their content.

    ``known`` is as for :func:`case_of`.
    """
    contents = known or {}
    content = {
        path: contents.get(str(value)) or content_of(Path(str(value))) if is_file(path) else value
        for path, value in values.items()
        if path not in NOT_COMPUTED_WITH and not path.startswith("recording.")
    }
    content["version"] = version("drinksim")
    text = json.dumps(content, sort_keys=True, default=list)
    return hashlib.sha256(text.encode()).hexdigest()[:IDENTITY_DIGITS]


def content_of(there: Path) -> str:
    """Return the checksum of a file; of a run directory, that of its history."""
    return checksum(there / "history.csv") if there.is_dir() else checksum(there)
