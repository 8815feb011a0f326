"""Paired differences: what changes when one thing is another and all else stays.

Every neck meets the same people, hands, motions and settings. So a difference between two necks is
taken sip by sip and averaged for each person. The people are the sample: an interval says where the
mean over all such people lies. People are independent; sips of one person are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta, t

from scenarios.campaign.cases import FACTORS
from scenarios.campaign.sip import WHOLE
from scenarios.campaign.table import Row

Array = NDArray[np.float64]

CONFIDENCE = 0.9
"""Of all intervals."""

POWER = 0.8
"""Chance with which a study of the stated size settles a difference of the size found."""

ALIKE = 0.05
"""Share of the mean below which a difference counts as none."""

MOST_PEOPLE = 2000
"""More people than that are not proposed."""

NOT_COMPARED = ("status", "reason", "run", "seconds", "mesh_doubt", "notes")


@dataclass(frozen=True)
class PairedDifference:
    """Difference ``first`` − ``second`` of a measure, unit by unit.

    Attributes
    ----------
    measure
        Its name.
    first, second
        The two values of the factor.
    units
        Names of the units, such as people.
    first_values, second_values
        (n,) means of each unit.
    left_out
        Pairs of sips of which one was not replayed to its end.
    unit
        What a unit is: "person", "draw", or "sip".
    """

    measure: str
    first: Any
    second: Any
    units: tuple[str, ...]
    first_values: Array
    second_values: Array
    left_out: int = 0
    unit: str = "person"

    @property
    def count(self) -> int:
        """How many units there are."""
        return len(self.units)

    @property
    def differences(self) -> Array:
        """(n,) of the units."""
        return self.first_values - self.second_values

    @property
    def mean(self) -> float:
        """Mean of the differences."""
        return float(self.differences.mean())

    @property
    def spread(self) -> float:
        """Standard deviation of the differences among units; nan of a single one."""
        return float(self.differences.std(ddof=1)) if self.count > 1 else np.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Where the mean over all such units lies, with `CONFIDENCE`; infinite of a single one."""
        if self.count < 2:
            return -np.inf, np.inf
        half = self._quantile(0.5 * (1 + CONFIDENCE), self.count) * self.spread
        half /= np.sqrt(self.count)
        return self.mean - half, self.mean + half

    @property
    def share(self) -> float:
        """Mean difference as a share of the second one's mean; nan if that is 0."""
        usual = float(self.second_values.mean())
        return self.mean / usual if usual else np.nan

    @property
    def lower(self) -> int:
        """For how many units the first is lower."""
        return int(np.sum(self.differences < 0))

    @property
    def chance_lower(self) -> tuple[float, float, float]:
        """Chance that the first is lower for another unit: best estimate, and its interval.

        The posterior of a binomial share with Jeffreys' prior.
        """
        posterior = beta(self.lower + 0.5, self.count - self.lower + 0.5)
        low, high = posterior.interval(CONFIDENCE)
        return float(posterior.mean()), float(low), float(high)

    @property
    def is_settled(self) -> bool:
        """Whether the interval excludes 0."""
        low, high = self.interval
        return low > 0 or high < 0

    @property
    def is_alike(self) -> bool:
        """Whether the interval lies within `ALIKE` of the second one's mean about 0."""
        bound = ALIKE * abs(float(self.second_values.mean()))
        low, high = self.interval
        return -bound < low and high < bound

    @property
    def needed(self) -> int | None:
        """How many units settle a difference of this size with `POWER`; None if too many."""
        if self.count < 2 or self.mean == 0:
            return None
        for count in range(2, MOST_PEOPLE + 1):
            wanted = self._quantile(0.5 * (1 + CONFIDENCE), count) + self._quantile(POWER, count)
            if wanted * self.spread / np.sqrt(count) <= abs(self.mean):
                return count
        return None

    @property
    def exceptions(self) -> tuple[str, ...]:
        """The units whose difference has the other sign than the mean's."""
        against = np.sign(self.differences) == -np.sign(self.mean)
        return tuple(
            name for name, is_against in zip(self.units, against, strict=True) if is_against
        )

    @staticmethod
    def _quantile(probability: float, count: int) -> float:
        return float(t.ppf(probability, count - 1))


def paired(
    rows: Sequence[Row], factor: str, first: Any, second: Any, measure: str
) -> PairedDifference:
    """Return the paired difference of a measure between two values of a factor.

    Parameters
    ----------
    rows
        Of a study's table.
    factor
        The column whose value differs.
    first, second
        Its values.
    measure
        A column of numbers.

    Raises
    ------
    ValueError
        If no pair of whole sips is left.
    """
    settings = [name for name in factor_columns(rows) if name != factor]
    unit = unit_of(rows, factor)
    sides: list[dict[tuple[Any, ...], float]] = [{}, {}]
    everything: set[tuple[Any, ...]] = set()
    for row in rows:
        for side, value in zip(sides, (first, second), strict=True):
            if row.get(factor) == value:
                block = tuple(row.get(name) for name in settings)
                everything.add(block)
                if row["status"] == WHOLE and row.get(measure) is not None:
                    side[block] = float(row[measure])
    both = [block for block in sides[0] if block in sides[1]]
    if not both:
        raise ValueError(f"no sip was replayed to its end with both {first} and {second}")
    of_unit: dict[str, list[tuple[float, float]]] = {}
    for block in both:
        named = dict(zip(settings, block, strict=True))
        name = str(named[unit]) if unit in named else ", ".join(map(str, block))
        of_unit.setdefault(name, []).append((sides[0][block], sides[1][block]))
    means = np.array([np.mean(pairs, axis=0) for pairs in of_unit.values()])
    return PairedDifference(
        measure,
        first,
        second,
        tuple(of_unit),
        means[:, 0],
        means[:, 1],
        left_out=len(everything) - len(both),
        unit=unit,
    )


def factor_columns(rows: Sequence[Row]) -> list[str]:
    """Return the columns that say which sip a row is."""
    names: list[str] = []
    for name in dict.fromkeys(name for row in rows for name in row):
        if name == NOT_COMPARED[0]:
            break
        names.append(name)
    return names


def unit_of(rows: Sequence[Row], factor: str) -> str:
    """Return what is independent in a study: people, else draws of doubt, else single sips."""
    for name in ("person", "draw"):
        if name != factor and len({row.get(name) for row in rows}) > 1:
            return name
    return "sip"


def varied_columns(rows: Sequence[Row]) -> list[str]:
    """Return the columns of varied settings."""
    fixed = (*FACTORS, "sample", "matrix")
    return [name for name in factor_columns(rows) if name not in fixed]
