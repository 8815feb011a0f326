"""Tables of named settings: a frozen dataclass is the one source of keys, units, ranges and help.

Every field of a table says in its metadata what it is (``description``, ``unit``, ``source``) and
what it may be (``minimum``, ``maximum``, ``choices``). Reading TOML, checking, ``--set``, the
listing on screen and the resolved file are all derived from that, so none of them can disagree.
"""

from __future__ import annotations

import dataclasses
import difflib
import json
import tomllib
import types
import typing
from collections.abc import Iterable, Mapping
from typing import Any, Literal, TypeVar

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import in_unit, range_error

Table = TypeVar("Table")
Value = object


class SettingError(DrinksimError):
    """A setting is unknown, of the wrong kind or out of its range."""


def nearest(word: str, words: Iterable[str]) -> str:
    """Return a remedy: the word that was probably meant, or else all that could have been.

    >>> nearest("fricton", ["friction", "teeth_friction"])
    "did you mean 'friction'?"
    """
    known = sorted(words)
    match = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    if match:
        return f"did you mean {match[0]!r}?"
    return "known: " + ", ".join(known)


def table_from(
    kind: type[Table], values: Mapping[str, Value], *, where: str, base: Table | None = None
) -> Table:
    """Return a table of type ``kind`` with ``values`` laid over ``base`` or over the defaults.

    Raises :class:`SettingError` naming the key (``where`` is the table's name, empty if it has
    none), the value and the remedy if a key is unknown or missing or a value is of the wrong type
    or out of its range.
    """
    prefix = f"{where}." if where else ""
    if not isinstance(values, Mapping):
        raise SettingError(f"[{where}] is {values!r}: write it as a table of key = value lines")
    fields = {f.name: f for f in _fields(kind)}
    hints = typing.get_type_hints(kind)
    for key in values:
        if key not in fields:
            raise SettingError(f"unknown key {prefix}{key}: {nearest(key, fields)}")
    checked = {
        key: _checked(value, hints[key], fields[key], f"{prefix}{key}")
        for key, value in values.items()
    }
    if base is not None:
        return typing.cast(Table, dataclasses.replace(typing.cast(Any, base), **checked))
    for name, field in fields.items():
        if name not in checked and not _has_default(field):
            about = field.metadata.get("description", "")
            raise SettingError(f"{prefix}{name} is missing: {about or 'it has no default'}")
    return kind(**checked)


def split_override(text: str) -> tuple[list[str], Value]:
    """Return the key path and the value of one ``table.key=value`` of the command line.

    The value is read as TOML, and as plain text where that is not TOML.

    >>> split_override("contact.friction=0.5"), split_override("solver.plane=strain")
    ((['contact', 'friction'], 0.5), (['solver', 'plane'], 'strain'))
    """
    key, equals, value = text.partition("=")
    path = [part.strip() for part in key.split(".")]
    if not equals or not all(path):
        raise SettingError(f"--set {text!r} is not table.key=value, e.g. contact.friction=0.5")
    try:
        return path, tomllib.loads(f"value = {value.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        return path, value.strip()


def toml_lines(table: object) -> list[str]:
    """Return one ``key = value  # unit: description`` line per field; no value, only a comment."""
    lines = []
    for field in _fields(type(table)):
        value = getattr(table, field.name)
        given = value is not None
        assignment = f"{field.name} = {toml_value(value)}" if given else f"# {field.name} ="
        note = about(field)
        lines.append(f"{assignment:<38} # {note}" if note else assignment)
    return lines


def toml_value(value: Value) -> str:
    """Return a value as TOML that reads back to the same value.

    >>> toml_value(0.1), toml_value("A38"), toml_value((1.0, 2.0)), toml_value(True)
    ('0.1', '"A38"', '[1.0, 2.0]', 'true')
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # JSON escapes what TOML wants escaped, except the delete character.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return repr(float(value)) if isinstance(value, float) else repr(value)


def about(field: dataclasses.Field[Any]) -> str:
    """Return what a field is, its unit and its source, in one line."""
    unit = field.metadata.get("unit") or ""
    description = field.metadata.get("description") or ""
    source = field.metadata.get("source") or ""
    head = f"{unit}: {description}" if unit and description else unit or description
    return f"{head} [{source}]" if source else head


def _fields(kind: type[object]) -> tuple[dataclasses.Field[Any], ...]:
    return dataclasses.fields(typing.cast(Any, kind))


def _has_default(field: dataclasses.Field[Any]) -> bool:
    missing = dataclasses.MISSING
    return field.default is not missing or field.default_factory is not missing


def _checked(value: Value, hint: Any, field: dataclasses.Field[Any], where: str) -> Value:
    checked = _of_type(value, hint, field, where)
    choices = field.metadata.get("choices")
    if choices and checked not in choices:
        raise SettingError(f"{where} = {value!r} is not a choice: {nearest(str(value), choices)}")
    numbers = checked if isinstance(checked, tuple) else (checked,)
    for number in numbers:
        if isinstance(number, (int, float)) and not isinstance(number, bool):
            _check_range(number, field, where)
    return checked


def _of_type(value: Value, hint: Any, field: dataclasses.Field[Any], where: str) -> Value:
    """Return ``value`` as the annotated type, or refuse it; whole numbers pass as floats."""
    for kind in _alternatives(hint):
        if typing.get_origin(kind) is Literal and value in typing.get_args(kind):
            return value
        if kind is float and isinstance(value, (int, float)) and not isinstance(value, bool):
            return float(value)
        if kind in (int, str, bool) and type(value) is kind:
            return value
        if typing.get_origin(kind) is tuple and isinstance(value, (list, tuple)):
            item = typing.get_args(kind)[0]
            return tuple(_of_type(entry, item, field, where) for entry in value)
    raise SettingError(f"{where} = {value!r}: give {_wanted(hint, field)}")


def _check_range(number: float, field: dataclasses.Field[Any], where: str) -> None:
    wrong = range_error(number, field.metadata)
    if wrong is not None:
        raise SettingError(f"{where} = {in_unit(number, field.metadata)} {wrong}")


def _alternatives(hint: Any) -> tuple[Any, ...]:
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return typing.get_args(hint)
    return (hint,)


def _wanted(hint: Any, field: dataclasses.Field[Any]) -> str:
    names = {
        float: "a number",
        int: "a whole number",
        str: "a text in quotes",
        bool: "true or false",
    }
    wanted = []
    for kind in _alternatives(hint):
        if typing.get_origin(kind) is Literal:
            wanted += [repr(option) for option in typing.get_args(kind)]
        elif typing.get_origin(kind) is tuple:
            wanted.append("a list of numbers")
        elif kind is not type(None):
            wanted.append(names.get(kind, kind.__name__))
    unit = field.metadata.get("unit") or ""
    return " or ".join(wanted) + (f" ({unit})" if unit else "")
