"""Reading of TOML within bounds of size, nesting and number length."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.text import SHOWN, short, text_of

MOST_BYTES = 1_000_000
DEEPEST = 32
"""Largest depth of nested tables and lists, and largest number of parts of a dotted key."""

LARGEST_INTEGER = 2**63
"""Bound of TOML's integers, which have 64 bits."""

TOKEN = re.compile(
    r"""\"{3}(?:[^"\\]|\\.|"(?!""))*+(?:"{3})?+|'{3}(?:[^']|'(?!''))*+(?:'{3})?+|\#[^\n]*+"""
    r"""|(?P<part>[A-Za-z0-9_-]++|"(?:[^"\\\n]|\\.)*+"?+|'[^'\n]*+'?+)|(?P<dot>\.)|[ \t]++|.""",
    re.DOTALL,
)
"""A long string, a comment, a part of a key or a value, a dot, space, or any other character.

Every text is a sequence of these, without backtracking: the time is proportional to its length.
"""


def read_toml(file: Path, *, what: str, error: type[DrinksimError]) -> dict[str, Any]:
    """Return the tables of a TOML file.

    Parameters
    ----------
    file
        The file, in UTF-8.
    what
        What it is, for messages: "marker file".
    error
        What to raise.

    Raises
    ------
    DrinksimError
        An ``error`` if the file cannot be read, is not TOML, or exceeds a bound of this module.
    """
    text = text_of(file, what=what, error=error, most_bytes=MOST_BYTES)
    return parsed_toml(text, where=str(file), error=error)


def parsed_toml(text: str, *, where: str, error: type[DrinksimError]) -> dict[str, Any]:
    """Return the tables of a TOML text; ``where`` is the start of every message."""
    if _longest_key(text) > DEEPEST:
        raise error(f"{where}: a key has more than {DEEPEST} parts; write fewer dots")
    try:
        tables = tomllib.loads(text)
    except RecursionError:
        raise error(_too_deep(where)) from None
    except tomllib.TOMLDecodeError as problem:
        raise error(f"{where} is not valid TOML: {_in_words(problem)}") from None
    except ValueError:  # a whole number of more digits than Python converts
        raise error(f"{where}: a number has too many digits; write it with fewer") from None
    for key, value, depth in _values(tables):
        if depth > DEEPEST:
            raise error(_too_deep(where))
        if isinstance(value, int) and not -LARGEST_INTEGER <= value < LARGEST_INTEGER:
            raise error(f"{where}: {key} is a number of too many digits; write it with fewer")
    return tables


def shown(value: object) -> str:
    """Return a value for a message: as TOML, on one line, shortened.

    >>> shown(True), shown("a"), shown([1, 2.5]), shown({"a": "b"})
    ('true', '"a"', '[1, 2.5]', '{a = "b"}')
    """
    text = "".join(_pieces(value, SHOWN + 1))
    text = text if text.isprintable() else short(text)
    return text if len(text) <= SHOWN else text[:SHOWN] + "…"


def _pieces(value: object, room: int) -> Iterator[str]:
    """Yield at most ``room`` parts of the text of a value."""
    if isinstance(value, bool):
        yield "true" if value else "false"
    elif isinstance(value, str):
        yield json.dumps(value[: SHOWN + 1], ensure_ascii=False)
    elif isinstance(value, (list, tuple)):
        items = [list(_pieces(item, room // 2)) for item in value[:room]]
        yield "[" + ", ".join("".join(item) for item in items) + "]"
    elif isinstance(value, Mapping):
        items = [[f"{key} = ", *_pieces(value[key], room // 2)] for key in list(value)[:room]]
        yield "{" + ", ".join("".join(item) for item in items) + "}"
    else:
        yield "nothing" if value is None else str(value)


def _longest_key(text: str) -> int:
    """Return the number of parts of the longest dotted key.

    The library's time and memory grow with the square of it.
    """
    if max(line.count(".") for line in text.split("\n")) < DEEPEST:
        return 1
    longest, parts, joined = 1, 0, False
    for token in TOKEN.finditer(text):
        kind = token.lastgroup
        if kind == "part":
            parts = parts + 1 if joined else 1
            longest = max(longest, parts)
        if token.group().isspace() and kind is None:
            continue
        joined = kind == "dot"
    return longest


def _in_words(problem: tomllib.TOMLDecodeError) -> str:
    """Return the library's message without the key, which it does not show as written."""
    return re.sub(
        r"(Cannot declare|Cannot mutate immutable namespace|Cannot redefine namespace)"
        r" \(.*\)(?: twice)? (?=\(at )",
        "a table or key is defined twice ",
        str(problem),
        flags=re.DOTALL,
    )


def _values(tables: Mapping[str, Any]) -> Iterator[tuple[str, Any, int]]:
    """Yield key, value and depth of all values in tables and lists, without recursion."""
    pending: list[tuple[str, Any, int]] = [(key, value, 1) for key, value in tables.items()]
    while pending:
        key, value, depth = pending.pop()
        yield key, value, depth
        if isinstance(value, dict):
            pending += [(inner, item, depth + 1) for inner, item in value.items()]
        elif isinstance(value, list):
            pending += [(key, item, depth + 1) for item in value]


def _too_deep(where: str) -> str:
    return f"{where}: is nested more than {DEEPEST} deep; write fewer brackets within one another"
