"""Calibration: which parameters make the suction test follow a measured curve.

Thesis section 3.1.2, there with Isight: bounded least squares on apex displacement against suction
with the limits of Table 3.3. Added here: exact gradients, which parameters ended on a limit, and
how well the curve constrains them at all.

Parameters are fitted by their logarithms, so that steps, limits and errors are relative. The
derivative of the apex displacement is that of the equilibrium, ``K ∂u/∂θ = −∂r/∂θ``, with the
tangent of the converged state and a central difference of the internal forces at fixed ``u``.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.materials.library import configuration_cards
from geometry2d.foundation.output import (
    check_replaceable,
    claimed,
    empty_directory,
    put_in_place,
)
from geometry2d.foundation.progress import Progress, no_progress
from scenarios.studies.curve_gradient import Evaluation, SuctionCurve
from scenarios.studies.files import StudyResult, write_summary, write_table
from scenarios.studies.fit import (
    CalibrationOptions,
    Fit,
    Target,
    fitted,
    layers_with,
    number_of,
    parameters_of,
)
from scenarios.studies.suction import SuctionModel

Array = NDArray[np.float64]


LOOSE = 0.5
"""A relative standard error beyond which a parameter counts as barely constrained."""

EVALUATIONS = "evaluations.jsonl"

REQUEST = "request.json"


def calibration_study(
    configuration: str,
    target_file: Path,
    out: Path,
    options: CalibrationOptions | None = None,
    *,
    progress: Progress = no_progress,
) -> StudyResult:
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
    chosen.refuse_ineffective(list(cards))
    parameters = parameters_of(cards)
    target = Target.read(target_file)
    check_replaceable(out)
    model = SuctionModel.of({name: card.material for name, card in cards.items()}, chosen)
    request = {
        "configuration": configuration,
        "layers": {name: dict(card.parameters) for name, card in cards.items()},
        "limits": {p.name: [p.low, p.guess, p.high] for p in parameters},
        "target": [target.suction_kpa.tolist(), target.apex_mm.tolist()],
        "options": dataclasses.asdict(chosen),
    }
    with claimed(out) as folder:
        curve = SuctionCurve(
            model, lambda values: layers_with(cards, parameters, values), target.suction_kpa
        )
        remembered = _remembering(curve.at, folder, _kept_evaluations(folder, request))
        fit = fitted(remembered, parameters, target.apex_mm, chosen, progress=progress)
        values = np.array([number_of(cards[p.layer].parameters[p.key]) for p in parameters])
        written = Written.of(values, curve.at(np.log(values)).apex_mm, target)
        messages = _messages(fit, written)
        _write(folder, configuration, target, fit, written)
        write_summary(folder, {**request, "remarks": messages})
        (folder / EVALUATIONS).unlink(missing_ok=True)
        (folder / REQUEST).unlink()
        put_in_place(folder, out)
        return StudyResult(out, messages, fit.converged)


@dataclass(frozen=True)
class Written:
    """What a configuration says before it is fitted.

    Attributes
    ----------
    values
        (p,) of the parameters.
    apex_mm
        (k,) the curve that they give.
    rms
        Its RMS difference from the target, over the target's range.
    """

    values: Array
    apex_mm: Array
    rms: float

    @classmethod
    def of(cls, values: Array, apex_mm: Array, target: Target) -> Written:
        """Return it beside a target."""
        range_mm = float(np.max(target.apex_mm))
        rms = float(np.sqrt(np.mean((apex_mm - target.apex_mm) ** 2))) / range_mm
        return cls(values, apex_mm, rms)


def _write(folder: Path, configuration: str, target: Target, fit: Fit, written: Written) -> None:
    """Write the table, the curves and the picture of a fit."""
    (folder / "calibration.json").write_text(
        json.dumps(_table(fit, written), indent=2, ensure_ascii=False) + "\n", encoding="utf-8"
    )
    columns = (target.suction_kpa, target.apex_mm, fit.evaluation.apex_mm)
    write_table(
        folder / "fit.csv",
        ("pressure_kpa", "target_mm", "fitted_mm"),
        list(zip(*columns, strict=True)),
    )
    _plot(folder / "calibration.png", configuration, target, fit, written.apex_mm)


def _remembering(
    curve: Callable[[Array], Evaluation], folder: Path, kept: Mapping[bytes, Evaluation]
) -> Callable[[Array], Evaluation]:
    """Return a curve that takes what is kept, and keeps what it computes, in a file."""

    def remembered(logarithms: Array) -> Evaluation:
        if logarithms.tobytes() in kept:
            return kept[logarithms.tobytes()]
        evaluation = curve(logarithms)
        with (folder / EVALUATIONS).open("a", encoding="utf-8") as file:
            row = {k: np.asarray(v).tolist() for k, v in vars(evaluation).items()}
            file.write(json.dumps(row) + "\n")
        return evaluation

    return remembered


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


def _finite(value: float) -> float | None:
    """Return a number that JSON can hold: an interval without end has none."""
    return value if math.isfinite(value) else None


def _table(fit: Fit, written: Written) -> dict[str, Any]:
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
            "parameters": dict(zip(names, written.values.tolist(), strict=True)),
            "rms_difference_from_target_over_range": written.rms,
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


def _messages(fit: Fit, written: Written) -> tuple[str, ...]:
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
        f"{100 * written.rms:.2f} % RMS of its range",
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
