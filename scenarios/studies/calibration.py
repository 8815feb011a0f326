"""Calibration: which parameters make the suction test follow a measured curve.

Thesis section 3.1.2, there with Isight: bounded least squares on apex displacement against suction
with the limits of Table 3.3. Added here: exact gradients, which parameters ended on a limit, and
how well the curve constrains them at all.

Parameters are fitted by their logarithms, so that steps, limits and errors are relative. The
derivative of the apex displacement is that of the equilibrium, ``K ∂u/∂θ = −∂r/∂θ``, with the
tangent of the converged state and a central difference of the internal forces at fixed ``u``.
"""

from __future__ import annotations

import csv
import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares
from scipy.special import stdtrit

from fem2d.materials.library import MaterialCard, configuration_cards, material_from
from fem2d.materials.material import Material
from fem2d.solvers.static import StaticResult, static_step
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import (
    check_replaceable,
    claimed,
    empty_directory,
    put_in_place,
)
from geometry2d.foundation.progress import Progress
from geometry2d.foundation.settings import setting
from scenarios.studies.aspiration import write_summary, write_table
from scenarios.studies.suction import SuctionModel, SuctionOptions

Array = NDArray[np.float64]

DIFFERENCE = 1e-4
"""Relative change of a parameter in the central difference of the internal forces."""
AT_LIMIT = 0.01
"""A parameter is on a limit if it lies within this share of its (logarithmic) range of it."""
LOOSE = 0.5
"""A relative standard error beyond which a parameter counts as barely constrained."""
EVALUATIONS = "evaluations.jsonl"
REQUEST = "request.json"


class CalibrationError(DrinksimError):
    """A calibration was asked for that cannot be done."""


class CalibrationStopped(ArithmeticError):
    """The suction test could not be computed for some parameters on the way."""


@dataclass(frozen=True)
class CalibrationOptions(SuctionOptions):
    """The suction test that is fitted, and when to stop."""

    solves: int = setting(
        default=40, minimum=1, maximum=10_000, description="most suction tests to compute"
    )
    confidence: float = setting(
        default=0.95, minimum=0.5, maximum=0.9999, description="of the stated intervals"
    )


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


@dataclass(frozen=True)
class Target:
    """A measured curve: apex displacement (k,), mm, at increasing suctions (k,), kPa."""

    suction_kpa: Array
    apex_mm: Array

    def __post_init__(self) -> None:
        if len(self.suction_kpa) < 2:
            raise CalibrationError("the target has fewer than two points: a curve needs more")
        if not (np.all(np.isfinite(self.suction_kpa)) and np.all(np.isfinite(self.apex_mm))):
            raise CalibrationError("the target holds numbers that are not finite: remove them")
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

        A first row at rest (0, 0) is skipped.
        """
        if not path.is_file():
            raise CalibrationError(f"target {path} does not exist: give a CSV file")
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        names = ("pressure_kpa", "apex_mm")
        missing = [name for name in names if not rows or name not in rows[0]]
        if missing:
            raise CalibrationError(
                f"target {path} has no column {' and no column '.join(missing)}: name the columns "
                "pressure_kpa and apex_mm in the first line"
            )
        try:
            values = np.array([[float(row[name]) for name in names] for row in rows])
        except (TypeError, ValueError) as error:
            raise CalibrationError(f"target {path}: {error}: give numbers only") from None
        if values[0, 0] == 0:
            values = values[1:]
        return cls(values[:, 0], values[:, 1])


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
class Evaluation:
    """One computed suction test.

    Attributes
    ----------
    logarithms
        (p,) of the parameters.
    apex_mm
        (k,) at the target's suctions.
    gradient
        (k, p) its derivative by the logarithms, mm.
    """

    logarithms: Array
    apex_mm: Array
    gradient: Array


@dataclass
class SuctionCurve:
    """Apex displacement and its gradient as a function of the parameters.

    Each evaluation starts from the equilibria of the one before, moved along their derivatives,
    which is what makes it cheap; that memory is its only state.

    Parameters
    ----------
    model
        The suction test; its materials are replaced.
    materials
        Returns the materials by layer for parameters (p,).
    suction_kpa
        (k,) where the curve is wanted.
    """

    model: SuctionModel
    materials: Callable[[Array], Mapping[str, Material]]
    suction_kpa: Array
    computed: int = 0
    _before: tuple[Array, list[StaticResult], list[Array]] | None = field(default=None, repr=False)

    def at(self, logarithms: Array) -> Evaluation:
        """Return curve and gradient.

        Raises
        ------
        CalibrationStopped
            If no equilibrium is found at one of the suctions.
        """
        model = self.model.with_materials(self.materials(np.exp(logarithms)))
        states = self._equilibria(model, logarithms)
        varied = [self._varied(logarithms, p) for p in range(len(logarithms))]
        slopes = [self._slope(model, state, varied) for state in states]
        self._before = (logarithms.copy(), states, slopes)
        self.computed += 1
        unknown = 2 * model.apex + 1
        return Evaluation(
            logarithms.copy(),
            np.array([model.apex_mm(state) for state in states]),
            np.array([slope[unknown] for slope in slopes]),
        )

    def _varied(self, logarithms: Array, p: int) -> tuple[SuctionModel, SuctionModel]:
        step = np.zeros(len(logarithms))
        step[p] = DIFFERENCE
        more, less = (self.materials(np.exp(logarithms + s)) for s in (step, -step))
        return self.model.with_materials(more), self.model.with_materials(less)

    def _equilibria(self, model: SuctionModel, logarithms: Array) -> list[StaticResult]:
        if self._before is not None:
            before, states, slopes = self._before
            found = []
            for state, slope in zip(states, slopes, strict=True):
                move = (slope @ (logarithms - before)).reshape(-1, 2)
                guess = state.displacement + move
                found.append(
                    static_step(
                        model.system,
                        state,
                        state.load,
                        solver=self.model.solver,
                        guess=guess,
                        threads=self.model.threads,
                    )
                )
                if not found[-1].converged:
                    break
            else:
                return found
        states = list(model.solve_at_suctions(self.suction_kpa))
        if not states[-1].converged:
            raise CalibrationStopped(
                f"no equilibrium at {self.suction_kpa[len(states) - 1]:.2f} kPa with "
                f"parameters {np.exp(logarithms).round(6).tolist()}"
            )
        return states

    def _slope(
        self,
        model: SuctionModel,
        state: StaticResult,
        varied: Sequence[tuple[SuctionModel, SuctionModel]],
    ) -> Array:
        """Return ∂u/∂(log θ), (2n, p), mm."""
        solver = self.model.solver
        solver.factorise(state.balance.tangent(False).matrix)
        columns = []
        for more, less in varied:
            change = (
                more.system.body.energy_and_force(state.displacement).force
                - less.system.body.energy_and_force(state.displacement).force
            ) / (2 * DIFFERENCE)
            columns.append(-solver.solve(np.where(model.system.free, change, 0.0)))
        return np.column_stack(columns)


@dataclass(frozen=True)
class Identifiability:
    """How well a curve constrains parameters.

    Attributes
    ----------
    sensitivity_mm
        (p,) RMS change of the curve for a change of the parameter by one percent, mm.
    relative_error
        (p,) standard error of the logarithms: 0.1 is about 10 %.
    interval
        (p, 2) confidence interval of the parameters.
    correlation
        (p, p) of the estimates.
    softest_direction
        (p,) the combination of logarithms that the curve constrains least.
    condition
        Ratio of the largest to the smallest singular value of the Jacobian by logarithms.
    """

    sensitivity_mm: Array
    relative_error: Array
    interval: Array
    correlation: Array
    softest_direction: Array
    condition: float


def identifiability(evaluation: Evaluation, apex_mm: Array, confidence: float) -> Identifiability:
    """Return what the linearised fit says of its parameters (Seber and Wild 1989, section 2.1.2).

    Parameters
    ----------
    evaluation
        Curve and gradient at the optimum.
    apex_mm
        (k,) the target; the residuals estimate its error.
    confidence
        Of the intervals.
    """
    gradient = evaluation.gradient
    points, count = gradient.shape
    freedom = max(points - count, 1)
    variance = float(np.sum((evaluation.apex_mm - apex_mm) ** 2)) / freedom
    _, singular, directions = np.linalg.svd(gradient, full_matrices=False)
    singular = np.maximum(singular, np.finfo(float).eps * singular[0])
    shape = directions.T / singular**2 @ directions
    spread = np.sqrt(np.diag(shape))
    error = np.sqrt(variance) * spread
    half = float(stdtrit(freedom, 0.5 * (1 + confidence))) * error
    with np.errstate(over="ignore"):
        interval = np.exp(evaluation.logarithms[:, None] + half[:, None] * np.array([-1.0, 1.0]))
    return Identifiability(
        0.01 * np.sqrt(np.mean(gradient**2, axis=0)),
        error,
        interval,
        shape / np.outer(spread, spread),
        directions[-1],
        float(singular[0] / singular[-1]),
    )


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
    progress: Progress = lambda share, text: None,
) -> Fit:
    """Return the parameters at which ``curve`` comes nearest to ``apex_mm`` (k,), mm.

    Trust-region reflective least squares (Branch, Coleman and Li 1999, scipy's), from the first
    guesses, within the limits.
    """
    low, guess, high = np.log([[p.low, p.guess, p.high] for p in parameters]).T
    total = float(np.sum((apex_mm - apex_mm.mean()) ** 2))
    scale = float(np.ptp(apex_mm)) or 1.0
    seen: dict[bytes, Evaluation] = {}
    explained: list[float] = []

    def evaluated(x: Array) -> Evaluation:
        key = x.tobytes()
        if key not in seen:
            seen[key] = curve(x)
            explained.append(1 - float(np.sum((seen[key].apex_mm - apex_mm) ** 2)) / total)
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
        ftol=1e-4,
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
        1 - float(np.sum((best.apex_mm - apex_mm) ** 2)) / total,
        at_limit,
        best,
        identifiability(best, apex_mm, options.confidence),
        _error_off_limits(best, apex_mm, parameters, at_limit),
        len(seen),
        found.status > 0,
        np.array(explained),
    )


def _error_off_limits(
    best: Evaluation, apex_mm: Array, parameters: Sequence[Parameter], at_limit: Mapping[str, str]
) -> dict[str, float]:
    freed = [k for k, p in enumerate(parameters) if p.name not in at_limit]
    if not freed:
        return {}
    rest = Evaluation(best.logarithms[freed], best.apex_mm, best.gradient[:, freed])
    error = identifiability(rest, apex_mm, 0.95).relative_error
    return {parameters[k].name: float(e) for k, e in zip(freed, error, strict=True)}


@dataclass(frozen=True)
class CalibrationResult:
    """Where a calibration's files are, and what must be said about it."""

    folder: Path
    sentences: tuple[str, ...]
    converged: bool


def calibration_study(
    configuration: str,
    target_file: Path,
    out: Path,
    options: CalibrationOptions | None = None,
    *,
    progress: Progress = lambda share, text: None,
) -> CalibrationResult:
    """Fit a configuration to a measured curve; write ``calibration.json``, a CSV and a picture.

    A run that was stopped leaves its suction tests beside ``out``; the same call uses them again.

    Parameters
    ----------
    configuration
        A library name or a TOML file with one table a layer; what has a ``range`` is fitted.
    target_file
        CSV file with columns ``pressure_kpa`` (increasing) and ``apex_mm``.
    out
        Directory for the results, complete or absent.
    options
        Sizes of the test and when to stop; the defaults if absent.
    progress
        Told how far it is.

    Raises
    ------
    MaterialError, SuctionError, CalibrationError, OutputError
        If configuration, sizes, target or directory cannot be used.
    CalibrationStopped
        If the test cannot be computed on the way; what was computed is kept.
    """
    chosen = options or CalibrationOptions()
    cards = configuration_cards(configuration)
    parameters = parameters_of(cards)
    target = Target.read(target_file)
    check_replaceable(out)
    printed = {name: card.material for name, card in cards.items()}
    model = SuctionModel.of(printed, chosen)
    request = {
        "configuration": configuration,
        "layers": {name: dict(card.parameters) for name, card in cards.items()},
        "limits": {p.name: [p.low, p.guess, p.high] for p in parameters},
        "target": [target.suction_kpa.tolist(), target.apex_mm.tolist()],
        "options": dataclasses.asdict(chosen),
    }
    with claimed(out) as folder:
        kept = _kept_evaluations(folder, request)
        curve = SuctionCurve(
            model, lambda values: layers_with(cards, parameters, values), target.suction_kpa
        )

        def remembered(logarithms: Array) -> Evaluation:
            if logarithms.tobytes() in kept:
                return kept[logarithms.tobytes()]
            evaluation = curve.at(logarithms)
            with (folder / EVALUATIONS).open("a", encoding="utf-8") as file:
                row = {k: np.asarray(v).tolist() for k, v in vars(evaluation).items()}
                file.write(json.dumps(row) + "\n")
            return evaluation

        fit = fitted(remembered, parameters, target.apex_mm, chosen, progress=progress)
        written = np.array([_number(cards[p.layer].parameters[p.key]) for p in parameters])
        at_written = curve.at(np.log(written)).apex_mm
        range_mm = float(np.max(target.apex_mm))
        written_rms = float(np.sqrt(np.mean((at_written - target.apex_mm) ** 2))) / range_mm
        sentences = _said(fit, written_rms)
        (folder / "calibration.json").write_text(
            json.dumps(_table(fit, written, written_rms), indent=2, ensure_ascii=False) + "\n",
            encoding="utf-8",
        )
        columns = (target.suction_kpa, target.apex_mm, fit.evaluation.apex_mm)
        write_table(
            folder / "fit.csv",
            ("pressure_kpa", "target_mm", "fitted_mm"),
            list(zip(*columns, strict=True)),
        )
        _plot(folder / "calibration.png", configuration, target, fit, at_written)
        write_summary(folder, {**request, "remarks": sentences})
        (folder / EVALUATIONS).unlink(missing_ok=True)
        (folder / REQUEST).unlink()
        put_in_place(folder, out)
        return CalibrationResult(out, sentences, fit.converged)


def _kept_evaluations(folder: Path, request: Mapping[str, Any]) -> dict[bytes, Evaluation]:
    """Return what an interrupted run of the same request computed; else start an empty folder."""
    asked = json.dumps(request, indent=2, ensure_ascii=False)
    known = folder / REQUEST
    if not (known.is_file() and known.read_text(encoding="utf-8") == asked):
        empty_directory(folder)
        known.write_text(asked, encoding="utf-8")
    kept: dict[bytes, Evaluation] = {}
    file = folder / EVALUATIONS
    if not file.is_file():
        return kept
    whole = []
    for line in file.read_text(encoding="utf-8").splitlines():
        try:
            row = json.loads(line)
        except json.JSONDecodeError:
            break  # the run was killed while it wrote this line
        whole.append(line + "\n")
        evaluation = Evaluation(**{key: np.array(value) for key, value in row.items()})
        kept[evaluation.logarithms.tobytes()] = evaluation
    file.write_text("".join(whole), encoding="utf-8")
    return kept


def _number(written: Any) -> float:
    return float(written[0] if isinstance(written, list) else written)


def _finite(value: float) -> float | None:
    """Return a number that JSON can hold: an interval without end has none."""
    return value if math.isfinite(value) else None


def _table(fit: Fit, written: Array, written_rms: float) -> dict[str, Any]:
    """Return ``calibration.json``."""
    known = fit.identifiability
    names = [p.name for p in fit.parameters]
    return {
        "parameters": dict(zip(names, fit.values.tolist(), strict=True)),
        "r_squared": fit.r_squared,
        "at_limit": fit.at_limit,
        "converged": fit.converged,
        "solves": fit.solves,
        "r_squared_of_each_solve": fit.history.tolist(),
        "as_written_in_the_configuration": {
            "parameters": dict(zip(names, written.tolist(), strict=True)),
            "rms_difference_from_target_over_range": written_rms,
        },
        "identifiability": {
            "sensitivity_mm_per_percent": dict(
                zip(names, known.sensitivity_mm.tolist(), strict=True)
            ),
            "relative_standard_error": dict(zip(names, known.relative_error.tolist(), strict=True)),
            "relative_standard_error_with_limits_held": fit.error_off_limits,
            "confidence_interval": {
                name: [_finite(low), _finite(high)]
                for name, (low, high) in zip(names, known.interval.tolist(), strict=True)
            },
            "correlation": {
                name: dict(zip(names, row, strict=True))
                for name, row in zip(names, known.correlation.tolist(), strict=True)
            },
            "least_constrained_combination_of_logarithms": dict(
                zip(names, known.softest_direction.tolist(), strict=True)
            ),
            "condition": known.condition,
        },
    }


def _said(fit: Fit, written_rms: float) -> tuple[str, ...]:
    ends = [
        f"{name} ended on its {side} limit, {value:.6g}"
        for name, value in zip((p.name for p in fit.parameters), fit.values, strict=True)
        if (side := fit.at_limit.get(name)) is not None
    ]
    sensitivity = fit.identifiability.sensitivity_mm
    error = fit.identifiability.relative_error
    loose = [
        f"{p.name} is barely constrained: 1 % of it moves the curve by {1e3 * s:.3g} µm, its "
        f"standard error is {100 * e:.3g} %"
        for p, s, e in zip(fit.parameters, sensitivity, error, strict=True)
        if e > LOOSE
    ]
    return (
        f"R² {fit.r_squared:.6f} after {fit.solves} suction tests"
        + ("" if fit.converged else ", stopped before it converged: raise --solves"),
        *ends,
        *loose,
        "with the values written in the configuration the curve differs from the target by "
        f"{100 * written_rms:.2f} % RMS of its range",
    )


def _plot(path: Path, name: str, target: Target, fit: Fit, at_written: Array) -> None:
    from scenarios.studies.plots import COLOURS, blank_figure, finish, labelled

    figure = blank_figure(10.5, 4.2)
    left, right = figure.subplots(1, 2)
    left.plot(target.suction_kpa, target.apex_mm, "o", color="0.4", label="target")
    left.plot(target.suction_kpa, at_written, "--", color=COLOURS[2], label="as written")
    left.plot(
        target.suction_kpa, fit.evaluation.apex_mm, color=COLOURS[1],
        label=f"fitted, R² {fit.r_squared:.5f}",
    )  # fmt: skip
    labelled(left, "suction (kPa)", "apex displacement (mm)").legend(frameon=False)
    names = [p.name for p in fit.parameters]
    picture = right.imshow(fit.identifiability.correlation, cmap="RdBu_r", vmin=-1, vmax=1)
    right.set_xticks(range(len(names)), names, rotation=30, ha="right", fontsize=8)
    right.set_yticks(range(len(names)), names, fontsize=8)
    right.set_title("correlation of the estimates", fontsize=10)
    figure.colorbar(picture, ax=right, shrink=0.8)
    figure.suptitle(f"Calibration of {name}")
    finish(figure, path)
