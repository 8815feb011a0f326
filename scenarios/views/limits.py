"""How far colours and views reach: the largest values of a run, and where its lips ever touch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from scenarios.results.skin_line import SkinLine
from scenarios.results.solution import Solution
from scenarios.views.scene import Shown

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


def colour_limits(solution: Solution, shown: Shown, samples: int = 24) -> tuple[float, float]:
    """Return round upper limits of the dermis' colours (its unit) and of pressure (kPa).

    What is highest in a crease or at a corner would leave all else pale: the dermis' limit is
    exceeded by one element in fifty at the worst increment, the pressure's is the peak of the mean
    over the two most pressed elements: bands of pressure show what elements bear.
    """
    names = np.array(solution.model.region_names)[solution.model.region]
    dermis = np.char.endswith(names, "dermis")
    indices = np.unique(np.linspace(0, solution.time_s.size - 1, samples).round().astype(int))
    worst = [
        float(np.quantile(solution.snapshot(i).element[shown.field][dermis] * shown.factor, 0.98))
        for i in indices
    ]
    peaks = [float(solution[f"{lip}_lip_pressure_kpa"].values.max()) for lip in solution.contact]
    return upper_limit(worst), upper_limit(peaks)


def largest_values(solution: Solution, shown: Shown) -> tuple[float, float]:
    """Return the largest values of a run: of ``shown`` in the dermis, and of the pressure, kPa."""
    names = np.array(solution.model.region_names)[solution.model.region]
    dermis = np.char.endswith(names, "dermis")
    highest = max(
        float((solution.fields.element(index)[shown.field][dermis] * shown.factor).max())
        for index in range(solution.time_s.size)
    )
    pressures = (along.fields["pressure_mpa"] for along in solution.contact.values())
    return highest, max(1e3 * float(pressure.max()) for pressure in pressures)


def touched_points(solution: Solution) -> Mapping[str, Array]:
    """Return by lip the undeformed points (t, 2) of the skin that ever touch the neck."""
    found = {}
    for lip, contact in solution.contact.items():
        line = SkinLine(solution.model, solution.model.skin[lip], contact.arc_mm)
        ever = (contact.fields["pressure_mpa"] > 0).any(axis=0)
        points = line.points(solution.model.nodes)
        found[lip] = points[ever] if ever.any() else points
    return found
