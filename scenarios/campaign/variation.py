"""What a study varies: a setting with a list of values, a range, or a normal distribution."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.toml import shown
from scenarios.settings.names import nearest, nearest_key
from scenarios.settings.scenario import SHAPE
from scenarios.settings.tables import Value

Array = NDArray[np.float64]

HOW = 'a list, {from = 0.5, to = 1.0}, or {mean = 1.0, sd = 0.2, source = "..."}'

LEVELS_OF_A_RANGE = (0.0, 0.5, 1.0)
LEVELS_OF_A_NORMAL = (0.1, 0.5, 0.9)
"""Quantiles that a grid takes of what is given as a distribution."""


class StudyError(DrinksimError):
    """A study that contradicts itself or cannot be carried out."""


@dataclass(frozen=True)
class VariedSetting:
    """One varied setting.

    Attributes
    ----------
    path
        Of the setting, its tables joined by dots.
    levels
        The values of a list; empty if it is a distribution.
    low, high
        Bounds of a uniform distribution.
    mean, sd
        Of a normal distribution.
    source
        Where it comes from.
    """

    path: str
    levels: tuple[Value, ...] = ()
    low: float | None = None
    high: float | None = None
    mean: float | None = None
    sd: float | None = None
    source: str = ""

    @property
    def is_continuous(self) -> bool:
        """Whether it is a distribution of numbers."""
        return not self.levels

    @property
    def grid(self) -> tuple[Value, ...]:
        """The values that a grid takes."""
        if self.levels:
            return self.levels
        quantiles = LEVELS_OF_A_RANGE if self.sd is None else LEVELS_OF_A_NORMAL
        return tuple(self.at(quantile) for quantile in quantiles)

    def at(self, quantile: float) -> Value:
        """Return the value at a quantile, 0…1; of a list, the one that many of its values reach."""
        if self.levels:
            return self.levels[min(int(quantile * len(self.levels)), len(self.levels) - 1)]
        if self.low is not None and self.high is not None:
            return float(self.low + quantile * (self.high - self.low))
        assert self.mean is not None and self.sd is not None
        return float(norm.ppf(quantile, self.mean, self.sd))

    def about(self) -> str:
        """Return what is varied, in words.

        >>> VariedSetting("contact.friction", low=0.5, high=1.0).about()
        'contact.friction from 0.5 to 1'
        """
        if self.levels:
            what = f"{self.path}: {', '.join(str(level) for level in self.levels)}"
        elif self.low is not None:
            what = f"{self.path} from {self.low:g} to {self.high:g}"
        else:
            what = f"{self.path} {self.mean:g} ± {self.sd:g}"
        return f"{what} ({self.source})" if self.source else what


def variations(document: Mapping[str, Any], *, where: str = "vary") -> tuple[VariedSetting, ...]:
    """Return the varied settings of a table of a study.

    Parameters
    ----------
    document
        By setting; a path may be one quoted key or nested tables.
    where
        The table's name.

    Raises
    ------
    StudyError
        If a setting is not known, or its values cannot be used.
    """
    flat = _flat(document, "")
    return tuple(_variation(path, value, where) for path, value in flat.items())


def _flat(document: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in document.items():
        path = f"{prefix}{name}"
        if isinstance(value, Mapping) and path not in SHAPE.keys and _holds_tables(path):
            found |= _flat(value, f"{path}.")
        else:
            found[path] = value
    return found


def _holds_tables(path: str) -> bool:
    return any(key.startswith(f"{path}.") for key in SHAPE.keys)


def _variation(path: str, value: Any, where: str) -> VariedSetting:
    if path not in SHAPE.keys:
        remedy = nearest_key(path, list(SHAPE.keys))
        raise StudyError(f'{where}: unknown setting "{path}": {remedy}')
    key = SHAPE.keys[path]
    if isinstance(value, Mapping):
        return _distribution(path, value, where)
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        raise StudyError(f'{where}."{path}" = {shown(value)}: give {HOW}')
    checked = tuple(key.checked(each) for each in value)
    doubles = [each for each in checked if checked.count(each) > 1]
    if doubles:
        raise StudyError(f'{where}."{path}" holds {shown(doubles[0])} more than once: give it once')
    return VariedSetting(path, levels=checked)


def _distribution(path: str, value: Mapping[str, Any], where: str) -> VariedSetting:
    named = f'{where}."{path}"'
    known = ("from", "to", "mean", "sd", "source")
    for name in value:
        if name not in known:
            raise StudyError(f"{named} has an unknown key {name}: {nearest(name, known)}")
    numbers = {name: value[name] for name in known[:-1] if name in value}
    for name, number in numbers.items():
        wrong = isinstance(number, bool) or not isinstance(number, int | float)
        if wrong or not math.isfinite(number):
            raise StudyError(f"{named}.{name} = {shown(number)}: give a number")
    source = value.get("source", "")
    if not isinstance(source, str):
        raise StudyError(f"{named}.source = {shown(source)}: give a text in quotes")
    if numbers.keys() == {"from", "to"}:
        low, high = float(numbers["from"]), float(numbers["to"])
        if low >= high:
            raise StudyError(f"{named}: from = {low:g} is not less than to = {high:g}")
        made = VariedSetting(path, low=low, high=high, source=source)
    elif numbers.keys() == {"mean", "sd"}:
        if numbers["sd"] <= 0:
            raise StudyError(f"{named}.sd = {numbers['sd']:g}: give more than 0")
        made = VariedSetting(
            path, mean=float(numbers["mean"]), sd=float(numbers["sd"]), source=source
        )
    else:
        raise StudyError(f"{named} = {shown(dict(value))}: give {HOW}")
    for each in made.grid:
        SHAPE.keys[path].checked(each)
    return made
