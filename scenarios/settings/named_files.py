"""The files that the settings of a table name, and the table with others in their place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar, cast

from scenarios.settings.tables import Key, joined, parts_of

Table = TypeVar("Table")


def named_files(table: object, where: str = "") -> dict[str, str]:
    """Return the files that a table and the tables in it name, by the path of the setting."""
    files: dict[str, str] = {}
    for part in parts_of(type(table), where=where):
        value = getattr(table, part.field.name)
        if isinstance(part, Key):
            if part.field.metadata.get("file") and value is not None:
                files[part.path] = value
        elif isinstance(value, part.kind):
            inside = where if part.inline else joined(where, part.field.name)
            files |= named_files(value, inside)
    return files


def with_files(table: Table, files: Mapping[str, str], where: str = "") -> Table:
    """Return a table that names other files, given by the path of the setting."""
    changes: dict[str, Any] = {}
    for part in parts_of(type(table), where=where):
        value = getattr(table, part.field.name)
        if isinstance(part, Key):
            if part.path in files:
                changes[part.field.name] = files[part.path]
        elif isinstance(value, part.kind):
            inside = where if part.inline else joined(where, part.field.name)
            changes[part.field.name] = with_files(value, files, inside)
    return cast(Table, replace(cast(Any, table), **changes))
