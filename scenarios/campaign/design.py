"""Which values of the varied settings are combined: a grid, or samples that fill the ranges."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from scenarios.campaign.settings import DesignSettings
from scenarios.campaign.variation import VariedSetting
from scenarios.settings.tables import Value

Array = NDArray[np.float64]

INSIDE = 1e-9
"""How far quantiles stay from 0 and 1, where a normal distribution has no value."""


@dataclass(frozen=True)
class Point:
    """A combination of values.

    Attributes
    ----------
    values
        By setting.
    sample
        Number of the sample; None in a grid.
    matrix
        For indices of sensitivity: "A", "B", or the setting whose value in A is that of B.
    """

    values: Mapping[str, Value]
    sample: int | None = None
    matrix: str = ""


def design_points(settings: DesignSettings, vary: Sequence[VariedSetting]) -> tuple[Point, ...]:
    """Return the combinations of a design; a single one without values where nothing varies."""
    if not vary:
        return (Point({}),)
    if settings.kind == "grid":
        combinations = itertools.product(*(each.grid for each in vary))
        paths = [each.path for each in vary]
        return tuple(Point(dict(zip(paths, c, strict=True))) for c in combinations)
    if settings.kind == "latin_hypercube":
        cube = qmc.LatinHypercube(len(vary), rng=settings.seed).random(settings.samples)
        return tuple(_points(cube, vary))
    return tuple(_points_for_indices(settings, vary))


def quantiles_for_indices(samples: int, factors: int, seed: int) -> tuple[Array, Array]:
    """Return two independent samples (n, k) of quantiles, by one scrambled Sobol' sequence."""
    both = qmc.Sobol(2 * factors, rng=seed).random(samples)
    return both[:, :factors], both[:, factors:]


def _points_for_indices(settings: DesignSettings, vary: Sequence[VariedSetting]) -> list[Point]:
    """Return the points of Saltelli's design: A, B, and A with one column of B each."""
    a, b = quantiles_for_indices(settings.samples, len(vary), settings.seed)
    points = [*_points(a, vary, "A"), *_points(b, vary, "B")]
    for column, each in enumerate(vary):
        mixed = a.copy()
        mixed[:, column] = b[:, column]
        points += _points(mixed, vary, each.path)
    return points


def _points(quantiles: Array, vary: Sequence[VariedSetting], matrix: str = "") -> list[Point]:
    inside = np.clip(quantiles, INSIDE, 1.0 - INSIDE)
    return [
        Point(
            {each.path: each.at(float(q)) for each, q in zip(vary, row, strict=True)},
            sample=number,
            matrix=matrix,
        )
        for number, row in enumerate(inside)
    ]
