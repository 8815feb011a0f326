"""Where layers of settings come from: the library, files with a base, and ``--set``."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.text import quoted
from geometry2d.foundation.toml import parsed_toml, read_toml, shown
from scenarios.settings.layers import SettingsLayer
from scenarios.settings.names import nearest
from scenarios.settings.tables import SettingError, Value

LIBRARY = Path(str(files("scenarios") / "library"))
"""Folder of the built-in scenarios, one folder each."""

SCENARIO_FILE = "scenario.toml"
"""The scenario in a folder of the library, of a run, of a marked film."""

BASE = "base"
"""Key of a file that names the scenario from which the file differs."""


class ScenarioError(DrinksimError):
    """A scenario cannot be found or read, or contradicts itself."""


def library_names() -> list[str]:
    """Return the names of the built-in scenarios, sorted."""
    return sorted(path.parent.name for path in LIBRARY.glob(f"*/{SCENARIO_FILE}"))


def recorded_names() -> list[str]:
    """Return the names of those built-in scenarios that have a recording of their own, sorted."""
    return sorted(path.parent.name for path in LIBRARY.glob("*/recording.toml"))


def file_layers(name_or_file: str, folder: Path) -> list[SettingsLayer]:
    """Return the layers of a built-in name or a file, those of its base first.

    Parameters
    ----------
    name_or_file
        A name of the library, or the path of a TOML file.
    folder
        What a relative path starts from.

    Raises
    ------
    ScenarioError
        If there is no such scenario, the file is not TOML, or bases run in a circle.
    """
    layers: list[SettingsLayer] = []
    seen: list[Path] = []
    following: str | None = name_or_file
    while following is not None:
        file = _scenario_file(following, folder)
        if file in seen:
            names = " is based on ".join(each.name for each in [*seen, file])
            raise ScenarioError(f"{seen[0]} is based on itself: {names}")
        seen.append(file)
        document = read_toml(file, what="scenario file", error=ScenarioError)
        base = document.pop(BASE, None)
        if base is not None and not (isinstance(base, str) and base):
            raise ScenarioError(
                f'{file}: {BASE} = {shown(base)}: give a name or a file, e.g. {BASE} = "A38-F"'
            )
        folder, following = file.parent, base
        layers.insert(0, SettingsLayer(document, folder, name="" if _built_in(file) else str(file)))
    return layers


def settings_layer(settings: Sequence[str], folder: Path) -> SettingsLayer:
    """Return the layer of texts ``table.key=value``; relative paths start from ``folder``.

    Raises
    ------
    SettingError
        If a text is none, or a key is given twice.
    """
    document = document_from([split_setting(text) for text in settings])
    return SettingsLayer(document, folder, same_sip=True)


def document_from(values: Sequence[tuple[str, Value]]) -> dict[str, Any]:
    """Return the document of values by path; :class:`SettingError` if one is given twice."""
    document: dict[str, Any] = {}
    for path, value in values:
        *tables, name = path.split(".")
        place = document
        for table in tables:
            inner = place.setdefault(table, {})
            if not isinstance(inner, dict):
                raise SettingError(
                    f"{path} is given beside {table} = {shown(inner)}: give one of them"
                )
            place = inner
        if name in place:
            raise SettingError(
                f"{path} is given twice, {shown(place[name])} and {shown(value)}: give one"
            )
        place[name] = value
    return document


def split_setting(text: str) -> tuple[str, Value]:
    """Return path and value of one ``table.key=value`` of the command line.

    The value is read as TOML, and as plain text where that is not TOML.

    >>> split_setting("contact.friction=0.5"), split_setting("numerics.plane=strain")
    (('contact.friction', 0.5), ('numerics.plane', 'strain'))
    """
    key, equals, value = text.partition("=")
    path = [part.strip() for part in key.split(".")]
    if not equals or not all(path):
        raise SettingError(
            f"--set {quoted(text)} is not table.key=value, e.g. contact.friction=0.5"
        )
    if path == [BASE]:
        raise SettingError(
            f"--set {quoted(text)}: a base belongs into a file, or is the scenario itself"
        )
    try:
        document = parsed_toml(f"value = {value.strip()}", where=key, error=SettingError)
        return ".".join(path), document["value"]
    except SettingError:
        return ".".join(path), value.strip()


def _built_in(file: Path) -> bool:
    return LIBRARY in file.parents


def _scenario_file(name_or_file: str, folder: Path) -> Path:
    if name_or_file in library_names():
        return LIBRARY / name_or_file / SCENARIO_FILE
    path = folder / name_or_file
    if path.is_file():
        return path.resolve()
    if path.suffix == ".toml" or len(Path(name_or_file).parts) > 1:
        raise ScenarioError(f"no scenario file {name_or_file} in {folder}: check the path")
    raise ScenarioError(
        f"no scenario {name_or_file!r}: {nearest(name_or_file, library_names())} "
        "(or give the path of a scenario file)"
    )
