"""Settings as TOML with comments, which reads back to the same values."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from geometry2d.foundation.settings import in_unit
from scenarios.settings.tables import (
    Key,
    SubTable,
    Value,
    parts_of,
    preset_tables,
    replaced_in,
)

COMMENT_COLUMN = 38
"""Where comments begin, unless a line is longer."""


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
    if isinstance(value, tuple | list):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return repr(float(value)) if isinstance(value, float) else repr(value)


def about(field: dataclasses.Field[Any]) -> str:
    """Return what a field is: unit, description, spread among people, source of its default."""
    source = field.metadata.get("source") or ""
    return f"{_meaning(field)} [{source}]" if source else _meaning(field)


def _meaning(field: dataclasses.Field[Any]) -> str:
    metadata = field.metadata
    unit = metadata.get("unit") or ""
    description = metadata.get("description") or ""
    text = f"{unit}: {description}" if unit and description else unit or description
    if metadata.get("spread") is not None:
        text += f"; ± {in_unit(metadata['spread'], metadata)} among people"
    return text


@dataclass(frozen=True)
class Usual:
    """What a table is where nothing is said: its values, and who says so if not its defaults."""

    values: object
    source: str = ""


def toml_lines(
    table: object, *, name: str = "", omit: tuple[str, ...] = (), usual: Usual | None = None
) -> list[str]:
    """Return a table as lines of key, value and comment, then the tables inside it.

    Parameters
    ----------
    table
        The dataclass.
    name
        Its name, for the headings of the tables inside it.
    omit
        Keys that are left out, because they are no keys or have no effect.
    usual
        What the table usually is, if not its dataclass' defaults.
    """
    keys, tables = [], []
    omit = (*omit, *replaced_in(table))
    for part in parts_of(type(table), omit=omit):
        value = getattr(table, part.field.name)
        if isinstance(part, Key):
            keys.append(_line(part, value, usual))
            continue
        inside = _usual(part, table)
        if part.inline:
            keys += toml_lines(value, omit=(*part.omit, *omit), usual=inside)
        else:
            inner = f"{name}.{part.field.name}" if name else part.field.name
            tables += ["", *_table_lines(part, value, inner, inside)]
    return [*keys, *tables]


def _usual(part: SubTable, table: object) -> Usual | None:
    """Return what a table inside a table usually is: what a preset or the field's default says."""
    for sibling in dataclasses.fields(table):  # type: ignore[arg-type]
        chosen = getattr(table, sibling.name)
        tables = preset_tables(sibling, chosen)
        if part.field.name in tables:
            source = sibling.metadata.get("sources", {}).get(chosen, f"{sibling.name} {chosen}")
            return Usual(tables[part.field.name], source)
    default = part.field.default
    return None if default in (None, dataclasses.MISSING) else Usual(default)


def _table_lines(
    part: SubTable, value: object | None, name: str, usual: Usual | None
) -> Iterator[str]:
    description = part.field.metadata.get("description") or ""
    if value is None:
        yield f"# [{name}]{' ' * (COMMENT_COLUMN - len(name) - 4)} # absent: {description}"
        return
    if not isinstance(value, part.kind):
        yield f"# [{name}]{' ' * (COMMENT_COLUMN - len(name) - 4)} # in memory: {value!r}"
        return
    heading = f"[{name}]"
    yield f"{heading:<{COMMENT_COLUMN}} # {description}" if description else heading
    yield from toml_lines(value, name=name, omit=part.omit, usual=usual)


def _line(key: Key, value: Value, usual: Usual | None) -> str:
    name = key.field.name
    assignment = f"# {name} =" if value is None else f"{name} = {toml_value(value)}"
    note = _meaning(key.field)
    if key.choices:
        note += f" ({', '.join(key.choices)})"
    note += _origin(key, value, usual)
    return f"{assignment:<{COMMENT_COLUMN}} # {note}" if note else assignment


def _origin(key: Key, value: Value, usual: Usual | None) -> str:
    """Return where a value comes from: its source, or what it is usually."""
    default = key.field.default
    expected = default if usual is None else getattr(usual.values, key.field.name)
    if value == default or value is None:
        source = key.field.metadata.get("source") or ""
    elif value == expected and usual is not None:
        source = usual.source
    else:
        known = expected not in (None, "", dataclasses.MISSING)
        return f" (changed from {toml_value(expected)})" if known else ""
    return f" [{source}]" if source else ""
