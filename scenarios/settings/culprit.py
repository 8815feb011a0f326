"""Which measurement makes no head or neck, and up to where it would."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import in_unit
from scenarios.settings.tables import SettingError

Measured = TypeVar("Measured")
Section = TypeVar("Section")
Values = Mapping[str, Any]

HALVINGS = 16
"""Of the way from a value that makes a section to one that does not."""

DESCRIBED = {"head": "head", "package": "neck"}
"""What the measurements of a table describe."""


def built(
    build: Callable[[Measured], Section], measured: Measured, base: Measured, *, where: str
) -> Section:
    """Return what ``build`` makes of measurements.

    Parameters
    ----------
    build
        Makes a section of them.
    measured
        The measurements, a dataclass.
    base
        Measurements that make a section.
    where
        Name of their table.

    Raises
    ------
    SettingError
        If they make no section. It names the key that is to blame, its value, and the value
        nearest to it that makes one.
    """
    kind: Any = type(measured)

    def works(values: Values) -> bool:
        try:
            build(kind(**values))
        except DrinksimError:
            return False
        return True

    try:
        return build(measured)
    except DrinksimError as error:
        given, usual = _values(measured), _values(base)
        if given == usual:
            raise
        raise SettingError(_blame(works, given, usual, kind, where)) from error


def _blame(
    works: Callable[[Values], bool], given: Values, usual: Values, kind: Any, where: str
) -> str:
    changed = [name for name in given if given[name] != usual[name]]
    name = next((name for name in changed if works({**given, name: usual[name]})), None)
    if name is None:
        given, name = _first_to_break(works, given, usual, changed)
    bad = given[name]
    good = _nearest_good(lambda value: works({**given, name: value}), bad, usual[name])
    metadata = next(each.metadata for each in dataclasses.fields(kind) if each.name == name)
    text = f"{where}.{name} = {in_unit(bad, metadata)} makes no {DESCRIBED[where]}"
    others = " with the other measurements as they are" if len(changed) > 1 else ""
    if good is None:
        return f"{text}{others}: leave it out"
    direction = "at most" if good < bad else "at least"
    return f"{text}{others}: use {direction} {in_unit(good, metadata)}"


def _first_to_break(
    works: Callable[[Values], bool], given: Values, usual: Values, changed: list[str]
) -> tuple[Values, str]:
    """Return values that break with the last key laid over the usual ones, and that key."""
    reached = dict(usual)
    for name in changed[:-1]:
        trial = {**reached, name: given[name]}
        if not works(trial):
            return trial, name
        reached = trial
    return given, changed[-1]


def _nearest_good(works: Callable[[Any], bool], bad: Any, good: Any) -> float | None:
    """Return the value nearest to a bad one that works, on the way to a good one.

    Where there is no good one, smaller ones than the bad one are looked at; None if none works.
    """
    if good is None:
        good = next((bad * 2.0**-k for k in range(1, HALVINGS) if works(bad * 2.0**-k)), None)
        if good is None:
            return None
    whole = isinstance(bad, int)
    for _ in range(HALVINGS):
        middle = 0.5 * (bad + good)
        middle = round(middle) if whole else middle
        if middle in (bad, good):
            break
        bad, good = (bad, middle) if works(middle) else (middle, good)
    return float(good) if whole else _short(works, good, away_from=bad)


def _short(works: Callable[[Any], bool], good: float, *, away_from: float) -> float:
    """Return a number of few digits near ``good`` that works."""
    for digits in range(2, 6):
        step = 10.0**-digits * max(abs(good), 1e-3)
        short = float(f"{good + (step if good > away_from else -step):.{digits}g}")
        if works(short):
            return short
    return good


def _values(measured: object) -> dict[str, Any]:
    names = [field.name for field in dataclasses.fields(measured)]  # type: ignore[arg-type]
    return {name: getattr(measured, name) for name in names}
