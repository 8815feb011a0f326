"""The base of all errors."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class DrinksimError(ValueError):
    """An input that cannot be used, or a computation that cannot go on.

    The message names culprit, value and remedy.
    """


@contextmanager
def naming(culprit: object) -> Iterator[None]:
    """Put a culprit, such as a file, before the message of an error that does not name it.

    >>> with naming("sip.toml"):
    ...     raise DrinksimError("friction = -1: at least 0")
    Traceback (most recent call last):
    geometry2d.foundation.errors.DrinksimError: sip.toml: friction = -1: at least 0
    """
    try:
        yield
    except DrinksimError as error:
        if str(culprit) in str(error):
            raise
        raise type(error)(f"{culprit}: {error}") from error
