"""Work that a value offers as a method and that is done in a room above the value's own.

A scenario can be solved and a solution drawn by rooms that know scenarios and solutions, and so
cannot be known by them. The value's module declares the function that it needs; the front door,
which knows all rooms, provides it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from geometry2d.foundation.errors import DrinksimError

Function = TypeVar("Function", bound=Callable[..., Any])


class Provided(Generic[Function]):
    """A function that is declared where it is called, and provided by a room above.

    Parameters
    ----------
    method
        The method that calls it, for the message if nothing provides it.

    Examples
    --------
    >>> twice: Provided[Callable[[int], int]] = Provided("Value.twice")
    >>> @twice.loaded_by
    ... def load():
    ...     return lambda number: 2 * number
    >>> twice.function(21)
    42
    """

    def __init__(self, method: str) -> None:
        self._method = method
        self._load: Callable[[], Function] | None = None

    def loaded_by(self, load: Callable[[], Function]) -> Callable[[], Function]:
        """Take what returns the function; it is called when the function is first needed."""
        self._load = load
        return load

    @property
    def function(self) -> Function:
        """The function.

        Raises
        ------
        DrinksimError
            If nothing provides it.
        """
        if self._load is None:
            raise DrinksimError(
                f"{self._method} needs drinksim's front door: import drinksim.values first"
            )
        return self._load()
