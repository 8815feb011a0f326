"""The necks of a study, each with a name: of the library, drawn, or given by measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geometry2d.foundation.toml import shown
from geometry2d.neck import NECKS
from scenarios.campaign.variation import StudyError
from scenarios.settings.names import nearest
from scenarios.settings.tables import Value

DRAWINGS = (".dxf", ".svg")


@dataclass(frozen=True)
class NamedNeck:
    """A neck of a study: its name in tables, and its keys of ``[package]``; none keep the base."""

    name: str
    package: Mapping[str, Value]


def named_necks(
    entries: Sequence[str | Mapping[str, Any]], folder: Path, *, base: str
) -> tuple[NamedNeck, ...]:
    """Return the necks of a list.

    Parameters
    ----------
    entries
        Names of the library, paths of drawings, or tables of measurements with a ``name`` and, as
        ``neck``, the library's neck that they change.
    folder
        What relative paths start from.
    base
        Name of the base scenario's neck, which an empty list stands for.

    Raises
    ------
    StudyError
        If an entry is no neck, or two have the same name.
    """
    if not entries:
        return (NamedNeck(base, {}),)
    necks = [_named(entry, folder) for entry in entries]
    names = [neck.name for neck in necks]
    for name in names:
        if names.count(name) > 1:
            raise StudyError(
                f"necks.list holds two necks called {name!r}: give them names, e.g. "
                '{name = "thin rim", neck = "A38", rim_radius_mm = 0.5}'
            )
    return tuple(necks)


def _named(entry: str | Mapping[str, Any], folder: Path) -> NamedNeck:
    if isinstance(entry, str):
        if entry in NECKS:
            return NamedNeck(entry, {"neck": entry})
        file = folder / entry
        if file.suffix.lower() not in DRAWINGS:
            raise StudyError(
                f"necks.list: no neck {entry!r}: {nearest(entry, NECKS)} (or give the path of a "
                "drawing, DXF or SVG)"
            )
        if not file.is_file():
            raise StudyError(f"necks.list: no drawing {file}: check the path")
        return NamedNeck(file.stem, {"outline": str(file)})
    package = {str(key): value for key, value in entry.items() if key != "name"}
    name = entry.get("name", _described(package))
    if not isinstance(name, str) or not name:
        raise StudyError(f"necks.list: name = {shown(name)}: give a text in quotes")
    if "outline" in package:
        package["outline"] = str(folder / str(package["outline"]))
    return NamedNeck(name, package)


def _described(package: Mapping[str, Any]) -> str:
    """Return a name made of measurements, such as ``A38 rim_radius_mm=0.5``."""
    changed = [f"{key}={value}" for key, value in package.items() if key != "neck"]
    return " ".join([str(package.get("neck", "A38")), *changed])
