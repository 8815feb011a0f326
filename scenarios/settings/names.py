"""What was probably meant by a name that is not known."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence

CLOSE = 0.6
"""Similarity from which on two words are taken for one that was mistyped."""


def nearest(word: str, words: Iterable[str]) -> str:
    """Return a remedy: the word that was probably meant, or else all that could have been.

    >>> nearest("fricton", ["friction", "teeth_friction"])
    "did you mean 'friction'?"
    """
    known = sorted(words)
    match = difflib.get_close_matches(word, known, n=1, cutoff=CLOSE)
    if match:
        return f"did you mean {match[0]!r}?"
    return "known: " + ", ".join(known)


def nearest_key(path: str, keys: Sequence[str]) -> str:
    """Return a remedy for a key that is not known, looking into all tables.

    Parameters
    ----------
    path
        The key with its tables, joined by dots.
    keys
        All keys that are known, likewise.

    Examples
    --------
    >>> nearest_key("friction", ["contact.friction", "skin.configuration"])
    'did you mean contact.friction?'
    >>> nearest_key("contact.frictoin", ["contact.friction", "skin.configuration"])
    'did you mean contact.friction?'
    """
    table, _, word = path.rpartition(".")
    in_table = {key.rpartition(".")[2]: [key] for key in keys if key.rpartition(".")[0] == table}
    anywhere: dict[str, list[str]] = {}
    for key in keys:
        anywhere.setdefault(key.rpartition(".")[2], []).append(key)
        if "." in key:
            anywhere[key.split(".")[0]] = [f"the table [{key.split('.')[0]}]"]
    meant = (
        (_closest(word, in_table) if table else [])
        or anywhere.get(word, [])
        or _closest(word, anywhere)
    )
    if meant:
        return f"did you mean {' or '.join(meant)}?"
    known = in_table if table and in_table else {key.split(".")[0] for key in keys}
    return "known: " + ", ".join(sorted(known))


def _closest(word: str, meanings: Mapping[str, list[str]]) -> list[str]:
    """Return what is meant by the name nearest to a word; nothing if none is near."""
    match = difflib.get_close_matches(word, sorted(meanings), n=1, cutoff=CLOSE)
    return meanings[match[0]] if match else []
