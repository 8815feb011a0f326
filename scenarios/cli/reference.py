"""The reference page of all settings and options, made from the dataclasses that hold them.

``python -m scenarios.cli.reference`` writes it to the standard output.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import MISSING

from geometry2d.foundation.settings import in_unit
from scenarios.cli.options import option_of
from scenarios.cli.parser import COMMANDS, module_of
from scenarios.settings.scenario import Scenario
from scenarios.settings.tables import (
    Key,
    SubTable,
    Value,
    joined,
    keys_of,
    parts_of,
    preset_keys,
    preset_tables,
)
from scenarios.settings.writing import toml_value

HEAD = """# Settings and options

<!-- Made by `python -m scenarios.cli.reference > docs/reference/settings.md`; a test compares. -->

Every number that a result depends on, with the default that the code has. `drinksim scenarios NAME`
prints the values of a scenario in the same order; `--set table.key=value` changes one. Relative
paths in a file start from the file's directory, those in `--set` from the current directory.

What a file says replaces what its `base` says, and `--set` what both say. A name that stands for
many values (`package.neck`, `numerics.resolution`) or a drawing replaces all of them; `false` in
place of `[recording]`, `[motion]`, `[filmed]` or `[muscle]` removes the table. A key that another
key makes ineffective is an error.
"""

COLUMNS = ("key", "unit", "default", "allowed", "is", "source of the default")


def settings_of_commands() -> dict[str, type[object]]:
    """Return the tables whose settings are options of a command, by its name."""
    tables = {
        command.name: getattr(module_of(command.name), "SETTINGS", None) for command in COMMANDS
    }
    return {name: table for name, table in tables.items() if table is not None}


def settings_page() -> str:
    """Return the page in Markdown."""
    lines = [HEAD]
    seen: set[type[object]] = set()
    lines += _table_of(Scenario, "", None, seen)
    for command, options in settings_of_commands().items():
        lines += ["", f"## `drinksim {command}`", "", *_rows(options, "", None, option=True)]
    return "\n".join(lines) + "\n"


def _table_of(
    kind: type[object],
    name: str,
    default: object | None,
    seen: set[type[object]],
    omit: tuple[str, ...] = (),
) -> Iterator[str]:
    """Yield the rows of a table's keys, then its tables."""
    yield from _rows(kind, name, default, omit=omit)
    for part in parts_of(kind):
        if isinstance(part, Key) or part.inline:
            continue
        inner = joined(name, part.field.name)
        yield from ("", f"## `[{inner}]`", "", _sentence(part))
        if part.kind in seen:
            yield f"Keys as of `[{part.kind.__name__.lower()}]`."
            continue
        seen.add(part.kind)
        yield ""
        yield from _table_of(part.kind, inner, _default_of(part, default), seen, part.omit)


def _sentence(part: SubTable) -> str:
    description = str(part.field.metadata["description"])
    absent = " May be absent." if part.optional else ""
    return f"{description[0].upper()}{description[1:]}.{absent}"


def _default_of(part: SubTable, default: object | None) -> object | None:
    """Return what a table inside a table is by default, None if it is absent."""
    if default is not None:
        value: object = getattr(default, part.field.name)
        return value
    return None if part.field.default is MISSING else part.field.default


def _rows(
    kind: type[object],
    name: str,
    default: object | None,
    *,
    option: bool = False,
    omit: tuple[str, ...] = (),
) -> Iterator[str]:
    """Yield a Markdown table of the keys that stand in a table itself."""
    keys = [
        (key, value) for key, value in _own_keys(kind, name, default) if key.field.name not in omit
    ]
    if not keys:
        return
    yield _row(COLUMNS)
    yield "|" + "---|" * len(COLUMNS)
    for key, value in keys:
        metadata = key.field.metadata
        shown = option_of(key.field.name) if option else key.field.name
        meaning = str(metadata.get("description") or "")
        if metadata.get("spread") is not None:
            meaning += f"; ± {in_unit(metadata['spread'], metadata)} among people"
        cells = (
            f"`{shown}`",
            metadata.get("unit") or "",
            _default_text(value),
            _allowed(key),
            meaning,
            metadata.get("source") or "",
        )
        yield _row(cells)
    for key, _ in keys:
        if "of" in key.field.metadata:
            yield from _presets(key)


def _presets(key: Key) -> Iterator[str]:
    """Yield a Markdown table of what the names that a key may have stand for."""
    presets = key.field.metadata["presets"]
    yield from ("", f"What `{key.field.name}` stands for:", "")
    yield _row(["", *presets])
    yield "|" + "---|" * (1 + len(presets))
    tables = [preset_tables(key.field, name) for name in presets]
    decided = preset_keys(key.field)
    for table, names in decided.items():
        for name in names:
            values = [getattr(each[table], name) for each in tables]
            if len(set(values)) > 1:
                shown = name if len(decided) == 1 else f"{table}.{name}"
                yield _row([f"`{shown}`", *map(_value_text, values)])


def _value_text(value: Value) -> str:
    return "–" if value is None else toml_value(value)


def _row(cells: Iterable[object]) -> str:
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"


def _own_keys(kind: type[object], name: str, default: object | None) -> Iterator[tuple[Key, Value]]:
    """Yield the keys of a table and of the tables inline in it, with their defaults."""
    for part in parts_of(kind, where=name):
        if isinstance(part, Key):
            value = part.field.default if default is None else getattr(default, part.field.name)
            yield part, value
        elif part.inline:
            inner = _default_of(part, default)
            for key in keys_of(part.kind, where=name, omit=part.omit):
                yield key, getattr(inner, key.field.name)


def _default_text(value: Value) -> str:
    if value is MISSING:
        return "required"
    return "absent" if value is None or value == "" else f"`{toml_value(value)}`"


def _allowed(key: Key) -> str:
    """Return what a value may be."""
    if key.choices:
        return ", ".join(key.choices)
    metadata = key.field.metadata
    low, above, high = (metadata.get(name) for name in ("minimum", "above", "maximum"))
    least = f"≥ {low:g}" if low is not None else f"> {above:g}" if above is not None else ""
    most = f"≤ {high:g}" if high is not None else ""
    words = [f'"{word}"' for word in key.words]
    return " or ".join([*filter(None, [", ".join(filter(None, [least, most]))]), *words])


if __name__ == "__main__":
    sys.stdout.write(settings_page())
