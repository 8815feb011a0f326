"""A function that a room above provides is loaded when it is first called."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.provided import Provided

Double = Callable[[int], int]


def test_what_nobody_provides_says_whose_method_it_is_and_what_to_import() -> None:
    declared: Provided[Double] = Provided("Value.double")
    with pytest.raises(DrinksimError, match=r"Value\.double needs .*: import drinksim\.values"):
        _ = declared.function


def test_what_is_provided_is_loaded_only_when_it_is_asked_for() -> None:
    declared: Provided[Double] = Provided("Value.double")
    loads = []

    @declared.loaded_by
    def load() -> Double:
        loads.append(True)
        return lambda number: 2 * number

    assert loads == []
    assert declared.function(21) == 42
    assert loads == [True]
