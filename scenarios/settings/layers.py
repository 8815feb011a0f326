"""Settings laid over one another: a base, a file, ``--set``; what a later one says, holds.

A layer is a document (tables of keys) with the folder that its relative paths mean. What becomes
of a key of an earlier layer:

* the same key of a later layer replaces it;
* a later layer that names a preset (a library neck, a resolution) or a drawing replaces all that
  those stand for, so that ``--set package.neck=DC`` changes a file that has every measurement;
* ``false`` in place of a table that may be absent removes it;
* a number removes the table that may stand in its place.

A key beside another that makes it ineffective, in its own layer or an earlier one, is an error.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import Field, dataclass, fields
from pathlib import Path, PurePath
from typing import Any, cast

from geometry2d.foundation.text import short
from geometry2d.foundation.toml import shown
from scenarios.settings.legacy import upgraded
from scenarios.settings.names import nearest_key
from scenarios.settings.tables import (
    Key,
    SettingError,
    SubTable,
    Value,
    joined,
    keys_of,
    parts_of,
    preset_keys,
)


@dataclass(frozen=True)
class SettingsLayer:
    """One document of settings.

    Attributes
    ----------
    document
        Values by key, tables by name; None resets a key or a table.
    folder
        What its relative paths start from.
    name
        What it is called in front of a message; empty if that goes without saying.
    same_sip
        Whether a motion in it is of the sip that earlier layers describe, so that a neck in it is
        another one than the filmed one.
    """

    document: Mapping[str, Value]
    folder: Path
    name: str = ""
    same_sip: bool = False


@dataclass(frozen=True)
class Given:
    """A value and the number of the layer that gives it; None where that layer resets it."""

    value: Value
    layer: int


@dataclass(frozen=True)
class Shape:
    """All keys and tables of a kind of document, and which keys replace which.

    Attributes
    ----------
    keys, tables
        By path.
    presets
        By path of a key that names a preset: the keys that the preset gives values.
    drawings
        By path of a key that replaces others: those others.
    tabled
        By path of a key that may be a table instead of a number: that table.
    """

    keys: Mapping[str, Key]
    tables: Mapping[str, SubTable]
    presets: Mapping[str, frozenset[str]]
    drawings: Mapping[str, frozenset[str]]
    tabled: Mapping[str, str]

    @classmethod
    def of(cls, kind: type[object]) -> Shape:
        """Return the shape of the documents of a dataclass."""
        parts = list(_parts_below(kind, ""))
        keys = {part.path: part for _, part in parts if isinstance(part, Key)}
        tables = {
            joined(where, part.field.name): part
            for where, part in parts
            if isinstance(part, SubTable)
        }
        presets, drawings = {}, {}
        for where, part in parts:
            metadata = part.field.metadata
            if "of" in metadata:
                given = _given_by_presets(part.field, where, tables)
                presets[joined(where, part.field.name)] = frozenset(given)
            if "replaces" in metadata:
                replaced = frozenset(joined(where, name) for name in metadata["replaces"])
                drawings[joined(where, part.field.name)] = replaced
        tabled = {
            joined(where, part.field.metadata["tables"]): joined(where, part.field.name)
            for where, part in parts
            if "tables" in part.field.metadata
        }
        return cls(keys, tables, presets, drawings, tabled)


def laid_over(shape: Shape, layers: Sequence[SettingsLayer]) -> dict[str, Given]:
    """Return the values of all layers by path, those of later layers over those of earlier ones.

    Raises
    ------
    SettingError
        If a key is unknown, its value cannot be used, or another key makes it ineffective.
    """
    given: dict[str, Given] = {}
    for number, layer in enumerate(layers):
        try:
            own, reset = _flattened(shape, layer)
            given = {path: each for path, each in given.items() if not _lies_in(path, reset)}
            given = _without_replaced(shape, given, own)
        except SettingError as error:
            raise SettingError(f"{layer.name}: {error}" if layer.name else str(error)) from error
        given |= {path: Given(None, number) for path in reset}
        given |= {path: Given(value, number) for path, value in own.items()}
    return given


def nested(given: Mapping[str, Given]) -> dict[str, Any]:
    """Return values by path as tables of keys."""
    document: dict[str, Any] = {}
    for path, each in given.items():
        if each.value is None:
            continue
        *tables, name = path.split(".")
        place = document
        for table in tables:
            place = place.setdefault(table, {})
        place[name] = each.value
    return document


def document_of(table: object) -> dict[str, Any]:
    """Return a table as a document that reads back to it: without keys that have no value.

    Keys that another one replaces are left out, and so is what no file holds.
    """
    document: dict[str, Any] = {}
    silent = {
        name
        for field in fields(cast(Any, table))
        if getattr(table, field.name) is not None
        for name in field.metadata.get("replaces", ())
    }
    for part in parts_of(type(table)):
        value = getattr(table, part.field.name)
        if value is None or part.field.name in silent:
            continue
        if isinstance(part, Key):
            document[part.field.name] = value
            continue
        if not isinstance(value, part.kind):
            continue
        inner = document_of(value)
        inner = {name: each for name, each in inner.items() if name not in part.omit}
        if part.inline:
            document |= {name: each for name, each in inner.items() if name not in silent}
        else:
            document[part.field.name] = inner
    return document


def values_by_path(table: object) -> dict[str, Value]:
    """Return the values of a table by path: those of :func:`document_of`."""
    return dict(_flat(document_of(table), ""))


def _flat(document: Mapping[str, Value], where: str) -> Iterator[tuple[str, Value]]:
    for name, value in document.items():
        path = joined(where, name)
        if isinstance(value, Mapping):
            yield from _flat(value, path)
        else:
            yield path, value


def _parts_below(kind: type[object], where: str) -> Iterator[tuple[str, Key | SubTable]]:
    """Yield the keys and tables of a kind, each with the path of the table that it stands in."""
    yield from _below(parts_of(kind, where=where), where)


def _below(parts: Iterator[Key | SubTable], where: str) -> Iterator[tuple[str, Key | SubTable]]:
    for part in parts:
        yield where, part
        if isinstance(part, SubTable):
            inside = where if part.inline else joined(where, part.field.name)
            yield from _below(parts_of(part.kind, where=inside, omit=part.omit), inside)


def _given_by_presets(
    field: Field[Any], where: str, tables: Mapping[str, SubTable]
) -> Iterator[str]:
    """Yield the paths of the keys that the presets of a field stand for."""
    for name, decided in preset_keys(field).items():
        target = tables[joined(where, name)]
        inside = where if target.inline else joined(where, name)
        for key in keys_of(target.kind, where=inside, omit=target.omit):
            if key.field.name in decided:
                yield key.path


def _flattened(shape: Shape, layer: SettingsLayer) -> tuple[dict[str, Value], list[str]]:
    """Return the checked values of a layer by path, and the paths of what it resets."""
    values: dict[str, Value] = {}
    reset: list[str] = []

    def visit(where: str, document: Mapping[str, Value]) -> None:
        for name, value in document.items():
            path = joined(where, name)
            table = shape.tabled.get(path)
            beside = table is not None and table.rpartition(".")[2] in document
            if table is not None and isinstance(value, Mapping):
                if beside:
                    raise SettingError(f"{path} and {table} are the same table: give one of them")
                visit(table, value)
            elif path in shape.keys:
                if value is None:
                    reset.append(path)
                else:
                    values[path] = _checked(shape.keys[path], value, layer.folder)
                    if table is not None and not beside:
                        reset.append(table)
            elif path in shape.tables and not shape.tables[path].inline:
                if value is None or (value is False and shape.tables[path].optional):
                    reset.append(path)
                elif isinstance(value, Mapping):
                    visit(path, value)
                else:
                    raise SettingError(f"{path} = {shown(value)}: write it as a table, [{path}]")
            else:
                known = list(shape.keys)
                raise SettingError(f"unknown key {short(path)}: {nearest_key(path, known)}")

    visit("", upgraded(layer.document))
    return values, reset


def _checked(key: Key, value: Value, folder: Path) -> Value:
    if isinstance(value, PurePath):
        value = str(value)
    checked = key.checked(value)
    if key.field.metadata.get("file"):
        return str(folder / str(checked))
    return checked


def _lies_in(path: str, tables: Sequence[str]) -> bool:
    return any(path == table or path.startswith(f"{table}.") for table in tables)


def _without_replaced(
    shape: Shape, earlier: Mapping[str, Given], own: Mapping[str, Value]
) -> dict[str, Given]:
    """Return what is left of earlier values beside those of a layer."""
    gone = {path for preset in shape.presets.keys() & own.keys() for path in shape.presets[preset]}
    for drawing, replaced in shape.drawings.items():
        if drawing in own:
            gone |= replaced
            _refuse_beside(drawing, replaced & own.keys())
        elif drawing in earlier:
            if shape.presets.keys() & replaced & own.keys():
                gone.add(drawing)
            else:
                _refuse_beside(drawing, replaced & own.keys())
    return {path: each for path, each in earlier.items() if path not in gone}


def _refuse_beside(drawing: str, ineffective: frozenset[str] | set[str]) -> None:
    if ineffective:
        raise SettingError(
            f"{min(ineffective)} says nothing beside {drawing}, which replaces it: give one of them"
        )
