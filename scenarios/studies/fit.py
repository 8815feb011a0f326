"""Bounded least squares on a suction curve: parameters, target, and where they meet."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from fem2d.materials.library import MaterialCard, material_from
from fem2d.materials.material import Material
from geometry2d.foundation.delimited import read_named_table
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.progress import Progress, no_progress
from geometry2d.foundation.settings import setting
from scenarios.studies.curve_gradient import Evaluation
from scenarios.studies.identifiability import Identifiability, identifiability
from scenarios.studies.suction import SuctionOptions

Array = NDArray[np.float64]

AT_LIMIT = 0.01
"""A parameter is on a limit if it lies within this share of its (logarithmic) range of it."""


class CalibrationError(DrinksimError):
    """A calibration was asked for that cannot be done."""


@dataclass(frozen=True)
class CalibrationOptions(SuctionOptions):
    """The suction test that is fitted, and when to stop."""

    solves: int = setting(
        default=40, minimum=1, maximum=10_000, description="most suction tests to compute"
    )
    confidence: float = setting(
        default=0.95, minimum=0.5, maximum=0.9999, description="of the stated intervals"
    )
    tolerance: float = setting(
        default=1e-4, above=0.0, maximum=0.1,
        description="relative change of the sum of squares at which the fit ends",
    )  # fmt: skip


@dataclass(frozen=True)
class Parameter:
    """A number of a layer's material that may vary, with its limits and first guess."""

    layer: str
    key: str
    low: float
    guess: float
    high: float

    def __post_init__(self) -> None:
        if not 0 < self.low < self.high:
            raise CalibrationError(
                f"limits of {self.name} are {self.low:g} and {self.high:g}: give two positive ones "
                "in ascending order"
            )
        if not self.low <= self.guess <= self.high:
            raise CalibrationError(
                f"first guess {self.guess:g} of {self.name} is outside its limits {self.low:g} and "
                f"{self.high:g}: move the guess or widen the limits"
            )

    @property
    def name(self) -> str:
        """``layer.key``."""
        return f"{self.layer}.{self.key}"


MOST_POINTS = 1000
"""Points of a target; each is an equilibrium to be solved for."""

LARGEST_KPA, LARGEST_MM = 1e3, 1e3
"""A suction is at most the air's pressure, and a displacement no longer than a person."""


@dataclass(frozen=True)
class Target:
    """A measured curve: apex displacement (k,), mm, at increasing suctions (k,), kPa."""

    suction_kpa: Array
    apex_mm: Array

    def __post_init__(self) -> None:
        if len(self.suction_kpa) < 2:
            raise CalibrationError("the target has fewer than two points: a curve needs more")
        if len(self.suction_kpa) > MOST_POINTS:
            raise CalibrationError(
                f"the target has {len(self.suction_kpa)} points, more than {MOST_POINTS}: thin it"
            )
        for name, values, largest in (
            ("pressure_kpa", self.suction_kpa, LARGEST_KPA),
            ("apex_mm", self.apex_mm, LARGEST_MM),
        ):
            beyond = ~(np.abs(values) <= largest)
            if beyond.any():
                worst = float(values[np.argmax(beyond)])
                raise CalibrationError(
                    f"the target has {name} = {worst:g}, beyond {largest:g}: check the unit"
                )
        if self.suction_kpa[0] <= 0:
            raise CalibrationError(
                f"the target starts at {self.suction_kpa[0]:g} kPa: give positive suctions"
            )
        steps = np.diff(self.suction_kpa)
        if np.any(steps <= 0):
            at = int(np.argmax(steps <= 0))
            raise CalibrationError(
                f"the target's pressure does not increase: {self.suction_kpa[at]:g} kPa is "
                f"followed by {self.suction_kpa[at + 1]:g} kPa; sort it and drop doubled points"
            )

    @classmethod
    def read(cls, path: Path) -> Target:
        """Return the curve of a CSV file with columns ``pressure_kpa`` and ``apex_mm``.

        A first row at rest (0, 0) is skipped. Cells may be separated as
        :mod:`geometry2d.foundation.delimited` says.

        Raises
        ------
        CalibrationError
            If the file cannot be read, or its numbers are no such curve.
        """
        names = ("pressure_kpa", "apex_mm")
        table = read_named_table(path, names, what="suction curve", error=CalibrationError)
        values = np.column_stack([table.numbers(name) for name in names])
        if values[0, 0] == 0:
            values = values[1:]
        try:
            return cls(values[:, 0], values[:, 1])
        except CalibrationError as error:
            raise CalibrationError(f"{path}: {error}") from None


def parameters_of(cards: Mapping[str, MaterialCard]) -> tuple[Parameter, ...]:
    """Return all parameters of a configuration that have limits.

    Raises
    ------
    CalibrationError
        If there is none, or limits exclude a first guess.
    """
    found = tuple(
        Parameter(layer, key, *card.ranges[key])
        for layer, card in cards.items()
        for key in card.ranges
    )
    if not found:
        raise CalibrationError(
            "no parameter has limits: add range.<parameter> = [lowest, guess, highest] to a layer"
        )
    return found


def number_of(written: Any) -> float:
    """Return the number of a parameter, which a configuration may write as a list of one."""
    return float(written[0] if isinstance(written, list) else written)


def layers_with(
    cards: Mapping[str, MaterialCard], parameters: Sequence[Parameter], values: ArrayLike
) -> dict[str, Material]:
    """Return the materials by layer with ``values`` (p,) for the parameters."""
    tables = {layer: dict(card.parameters) for layer, card in cards.items()}
    for parameter, value in zip(parameters, np.asarray(values, float), strict=True):
        written = tables[parameter.layer][parameter.key]
        tables[parameter.layer][parameter.key] = (
            [float(value)] if isinstance(written, list) else float(value)
        )
    return {layer: material_from(table, f"{layer}: ") for layer, table in tables.items()}


@dataclass(frozen=True)
class Fit:
    """A calibration as computed.

    Attributes
    ----------
    parameters, values
        What was varied and where it ended.
    r_squared
        Share of the target's variance that the curve explains.
    at_limit
        ``{parameter: "lower" or "upper"}`` of those that ended on a limit.
    evaluation
        Curve and gradient there.
    identifiability
        How well the target constrains them.
    error_off_limits
        Relative standard errors of the other parameters if those on limits are taken as known.
    solves
        Suction tests computed.
    converged
        Whether the optimum was reached within the allowed number of tests.
    history
        (solves,) R² of each test.
    """

    parameters: tuple[Parameter, ...]
    values: Array
    r_squared: float
    at_limit: dict[str, str]
    evaluation: Evaluation
    identifiability: Identifiability
    error_off_limits: dict[str, float]
    solves: int
    converged: bool
    history: Array


def fitted(
    curve: Callable[[Array], Evaluation],
    parameters: Sequence[Parameter],
    apex_mm: Array,
    options: CalibrationOptions,
    *,
    progress: Progress = no_progress,
) -> Fit:
    """Return the parameters at which ``curve`` comes nearest to ``apex_mm`` (k,), mm.

    Trust-region reflective least squares (Branch, Coleman and Li 1999, scipy's), from the first
    guesses, within the limits.
    """
    low, guess, high = np.log([[p.low, p.guess, p.high] for p in parameters]).T
    scale = float(np.ptp(apex_mm)) or 1.0
    seen: dict[bytes, Evaluation] = {}
    explained: list[float] = []

    def evaluated(x: Array) -> Evaluation:
        key = x.tobytes()
        if key not in seen:
            seen[key] = curve(x)
            explained.append(_explained(seen[key], apex_mm))
            progress(len(seen) / options.solves, f"{len(seen)} solves, R² {max(explained):.6f}")
        return seen[key]

    # A guess on a limit would leave the reflective method no room to start.
    inset = 1e-3 * (high - low)
    found = least_squares(
        lambda x: (evaluated(x).apex_mm - apex_mm) / scale,
        np.clip(guess, low + inset, high - inset),
        jac=lambda x: evaluated(x).gradient / scale,
        bounds=(low, high),
        x_scale=1.0,
        ftol=options.tolerance,
        xtol=1e-6,
        gtol=1e-10,
        max_nfev=options.solves,
    )
    best = evaluated(found.x)
    share = (found.x - low) / (high - low)
    at_limit = {
        p.name: "lower" if s < AT_LIMIT else "upper"
        for p, s in zip(parameters, share, strict=True)
        if s < AT_LIMIT or s > 1 - AT_LIMIT
    }
    return Fit(
        tuple(parameters),
        np.exp(found.x),
        _explained(best, apex_mm),
        at_limit,
        best,
        identifiability(best, apex_mm, options.confidence),
        _error_off_limits(best, apex_mm, parameters, at_limit),
        len(seen),
        found.status > 0,
        np.array(explained),
    )


def _explained(evaluation: Evaluation, apex_mm: Array) -> float:
    """Return R²: the share of the target's variance that a curve explains."""
    total = float(np.sum((apex_mm - apex_mm.mean()) ** 2))
    return 1 - float(np.sum((evaluation.apex_mm - apex_mm) ** 2)) / total


def _error_off_limits(
    best: Evaluation, apex_mm: Array, parameters: Sequence[Parameter], at_limit: Mapping[str, str]
) -> dict[str, float]:
    freed = [k for k, p in enumerate(parameters) if p.name not in at_limit]
    if not freed:
        return {}
    rest = Evaluation(best.logarithms[freed], best.apex_mm, best.gradient[:, freed])
    error = identifiability(rest, apex_mm, 0.95).relative_error
    return {parameters[k].name: float(e) for k, e in zip(freed, error, strict=True)}
