"""Text of files, read within bounds and in an encoding that is named; numbers as files write them.

Whatever reads a user's file reads it here, so that a file that is missing, too large, no text, or
in another encoding is refused in the same words everywhere.
"""

from __future__ import annotations

import codecs
import math
import re
from pathlib import Path

from geometry2d.foundation.errors import DrinksimError

MOST_BYTES = 500_000_000
"""A larger file is no table, drawing or list of settings."""

LONGEST_NUMBER = 100
"""Characters of a number; a double is written exactly in fewer."""

SHOWN = 40
"""Characters of a file's own text that a message repeats."""

NUMBER = re.compile(r"[-+]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][-+]?[0-9]++)?+")
"""A decimal number in ASCII; possessive, so that no text makes the search go back."""

OTHER_ENCODINGS = (
    (codecs.BOM_UTF32_LE, "UTF-32"),
    (codecs.BOM_UTF32_BE, "UTF-32"),
    (codecs.BOM_UTF16_LE, "UTF-16"),
    (codecs.BOM_UTF16_BE, "UTF-16"),
)
"""Byte order marks, the longer ones first: UTF-32 begins like UTF-16."""

WINDOWS = "cp1252"
"""What programs on Windows in Western Europe write where they do not write UTF-8."""


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
        Size from which on the file is refused unread.

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
    """Return the text of a file in UTF-8, its lines ending in a line feed.

    Parameters
    ----------
    file, what, error, most_bytes
        As for :func:`bytes_of`.
    also
        A second encoding (:data:`WINDOWS`), where programs that write this kind of file are known
        to use it.

    Raises
    ------
    DrinksimError
        An ``error`` if the file cannot be read, is in another encoding, which is named, or is no
        text.
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
    """Return the text in the encoding that is allowed beside UTF-8, or refuse it by its name."""
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
    """Return the finite decimal number that a text is, None if it is none.

    Digits are those of ASCII; what only Python takes for a number is none.

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


def quoted(text: str, most: int = SHOWN) -> str:
    r"""Return a file's own text as messages show it: in quotes, on one line, shortened.

    >>> quoted("a\tb"), quoted("x" * 99, most=5)
    ("'a\\tb'", "'xxxxx…'")
    """
    return repr(text if len(text) <= most else text[:most] + "…")
