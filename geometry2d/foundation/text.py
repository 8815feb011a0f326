"""Reading of text files within bounds and in a known encoding, and of the numbers in them.

All readers of users' files use this module: a file that is missing, too large, no text, or in
another encoding gives the same message everywhere.
"""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Sequence
from pathlib import Path

from geometry2d.foundation.errors import DrinksimError

MOST_BYTES = 500_000_000
"""Largest size of a table, drawing or list of settings."""

LONGEST_NUMBER = 100
"""Largest number of characters of a number; any double has fewer."""

SHOWN = 40
"""Largest number of characters of a file's text in a message."""

NUMBER = re.compile(r"[-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?+")
"""A decimal number in ASCII; possessive quantifiers exclude backtracking."""

PLAIN_WORD = re.compile(r"[A-Za-z0-9_-]++")
"""A word that stands in a message without quotes."""

OTHER_ENCODINGS = (
    (codecs.BOM_UTF32_LE, "UTF-32"),
    (codecs.BOM_UTF32_BE, "UTF-32"),
    (codecs.BOM_UTF16_LE, "UTF-16"),
    (codecs.BOM_UTF16_BE, "UTF-16"),
)
"""Byte order marks, longer ones first: UTF-32 starts like UTF-16."""

WINDOWS = "cp1252"
"""Encoding of programs on Windows in Western Europe that do not write UTF-8."""


def bytes_of(
    file: Path, *, what: str, error: type[DrinksimError], most_bytes: int = MOST_BYTES
) -> bytes:
    """Return the content of a file.

    Parameters
    ----------
    file
        The file.
    what
        What it is, for messages: "marker file".
    error
        What to raise.
    most_bytes
        Largest size; a larger file is not read.

    Raises
    ------
    DrinksimError
        An ``error`` if the file is missing, cannot be read or is too large.
    """
    try:
        with file.open("rb") as stream:
            data = stream.read(most_bytes + 1)
    except FileNotFoundError:
        raise error(f"{file}: no such {what}; check the path") from None
    except OSError as problem:
        raise error(f"{file}: cannot be read as a {what}: {problem.strerror}") from None
    if len(data) > most_bytes:
        raise error(f"{file}: is larger than {most_bytes / 1e6:g} MB, too large for a {what}")
    return data


def text_of(
    file: Path,
    *,
    what: str,
    error: type[DrinksimError],
    also: str = "",
    most_bytes: int = MOST_BYTES,
) -> str:
    """Return the text of a file in UTF-8, with line feeds as line ends.

    Parameters
    ----------
    file, what, error, most_bytes
        As for :func:`bytes_of`.
    also
        A second encoding (:data:`WINDOWS`) that programs use for this kind of file.

    Raises
    ------
    DrinksimError
        An ``error`` if the file cannot be read, is no text, or is in another encoding, which the
        message names.
    """
    data = bytes_of(file, what=what, error=error, most_bytes=most_bytes)
    for mark, name in OTHER_ENCODINGS:
        if data.startswith(mark):
            raise error(f"{file}: is written in {name}: save the {what} in UTF-8")
    if b"\0" in data:
        half = data.count(b"\0") > 0.2 * len(data)
        hint = "; it looks like UTF-16: save it in UTF-8" if half else f", not a {what}"
        raise error(f"{file}: holds zero bytes and is no text{hint}")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        text = _in_another_encoding(file, data, problem.start, what, error, also)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _in_another_encoding(
    file: Path, data: bytes, at: int, what: str, error: type[DrinksimError], also: str
) -> str:
    """Return the text in the second encoding, or raise an error that names its encoding."""
    if also:
        return data.decode(also, errors="replace")
    line = data.count(b"\n", 0, at) + 1
    try:
        word = data[max(at - 8, 0) : at + 8].decode(WINDOWS)
        guess = f"it looks like Windows-1252 or Latin-1 ({quoted(word)})"
    except UnicodeDecodeError:
        guess = "its encoding is not known"
    raise error(
        f"{file} line {line}: byte {data[at]:#04x} is not UTF-8, {guess}: save the {what} in UTF-8"
    )


def number(text: str) -> float | None:
    """Return the finite decimal number in a text, None if there is none.

    Only ASCII digits count, without Python's extensions.

    >>> number("-.5e1"), number("1_000"), number("nan"), number("1e999"), number("٣")
    (-5.0, None, None, None, None)
    """
    if len(text) > LONGEST_NUMBER or NUMBER.fullmatch(text) is None:
        return None
    value = float(text)
    return value if math.isfinite(value) else None


def short(text: str, most: int = SHOWN) -> str:
    r"""Return a name as messages show it: on one line, shortened.

    >>> short("a\tb"), short("x" * 99, most=5)
    ('a\\tb', 'xxxxx…')
    """
    return quoted(text, most)[1:-1]


def listed(words: Sequence[str], most: int | None = None) -> str:
    """Return a file's words for a message, in quotes where they are no plain words.

    >>> listed(["ear", "no()se", "jaw"], most=2)
    "ear, 'no()se', …"
    """
    shown = [word if PLAIN_WORD.fullmatch(word) else quoted(word) for word in words[:most]]
    return ", ".join([*shown, *(["…"] if len(words) > len(shown) else [])])


def counted(count: int, one: str, many: str) -> str:
    """Return a number with its noun.

    >>> counted(1, "person", "people"), counted(12, "person", "people")
    ('1 person', '12 people')
    """
    return f"{count} {one if count == 1 else many}"


def quoted(text: str, most: int = SHOWN) -> str:
    r"""Return a file's text for a message: in quotes, on one line, shortened.

    >>> quoted("a\tb"), quoted("x" * 99, most=5)
    ("'a\\tb'", "'xxxxx…'")
    """
    return repr(text if len(text) <= most else text[:most] + "…")
