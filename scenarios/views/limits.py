"""How far colours and views reach: the largest values of a run, and where its lips ever touch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenarios.results.skin_line import SkinLine
from scenarios.results.solution import Solution
from scenarios.views.shown import Shown

Array = NDArray[np.float64]


def upper_limit(values: Iterable[float]) -> float:
    """Return the smallest round number (1, 1.5, 2, 3, 5, 8 × a power of ten) above all values.

    >>> upper_limit([3.0, 41.0]), upper_limit([0.0])
    (50.0, 1.0)
    """
    largest = max(values, default=0.0)
    if largest <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(largest))
    steps = np.array([1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 10.0]) * power
    return float(steps[steps >= largest * (1 - 1e-9)][0])


@dataclass(frozen=True)
class Reach:
    """How far a run goes from the start of its colours: a field in its unit, and pressure in kPa.

    ``limits`` are round numbers at which the colours end, ``largest`` the largest values.
    """

    limits: tuple[float, float]
    largest: tuple[float, float]


def colour_reach(solution: Solution, shown: Shown) -> Reach:
    """Return how far the colours of a run reach, and its largest values.

    What is highest in a crease or at a corner would leave all else pale: the field's limit is
    exceeded by one element in fifty at the worst increment, the pressure's is the peak of the mean
    over the two most pressed elements: bands of pressure show what elements bear.
    """
    values = shown.values(solution.fields.along(shown.field)[:, shown.tissue(solution.model)])
    away = shown.reach(values).round(9)  # an exact 1 of plane strain is none
    worst = np.quantile(away, 0.98, axis=1)
    peaks = [float(solution[f"{lip}_lip_pressure_kpa"].values.max()) for lip in solution.contact]
    pressures = (along.fields["pressure_mpa"] for along in solution.contact.values())
    highest = max(1e3 * float(pressure.max()) for pressure in pressures)
    return Reach(
        limits=(upper_limit(worst), upper_limit(peaks)), largest=(float(away.max()), highest)
    )


def touched_points(solution: Solution) -> Mapping[str, Array]:
    """Return by lip the undeformed points (t, 2) of the skin that ever touch the neck."""
    found = {}
    for lip, contact in solution.contact.items():
        line = SkinLine(solution.model, solution.model.skin[lip], contact.arc_mm)
        ever = (contact.fields["pressure_mpa"] > 0).any(axis=0)
        points = line.points(solution.model.nodes)
        found[lip] = points[ever] if ever.any() else points
    return found
