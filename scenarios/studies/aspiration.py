"""The aspiration study: how far a suction cup lifts layered tissue, and when it lets go.

Thesis section 3.1.2: the LASTIC test of Luboz et al. (2014) as a model. The result is the curve of
apex displacement against suction, the extreme strains of the dermis, and the suction at which
equilibrium is lost.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fem2d.materials.library import configuration_cards
from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress, no_progress
from scenarios.studies.aspiration_plots import plot_comparison, plot_curve, plot_field
from scenarios.studies.files import StudyResult, write_summary, write_table
from scenarios.studies.suction_curve import Aspiration, AspirationOptions, Loss, aspirated

COLUMNS = ("pressure_kpa", "apex_mm", "dermis_min_log_strain", "dermis_max_log_strain")

CONFIGURATIONS = ("L1", "L2-GOH", "L2-Ogden", "L3")

THESIS_HIGHEST_KPA: Mapping[str, float] = {
    "L1": 12.0, "L2-GOH": 21.9, "L2-Ogden": 17.5, "L3": 21.9,
}  # fmt: skip
"""Thesis section 3.1.2 and Figure 3.14."""


def aspiration_study(
    configuration: str,
    out: Path,
    options: AspirationOptions | None = None,
    *,
    progress: Progress = no_progress,
) -> StudyResult:
    """Suck at a configuration; write ``aspiration.csv``, pictures and ``summary.json``.

    Parameters
    ----------
    configuration
        A library name (``L1``, ``L2-GOH``, ``L2-Ogden``, ``L3``) or a TOML file with one table a
        layer, outermost first.
    out
        Directory for the results, written whole or not at all.
    options
        Sizes and suction; the defaults if absent.
    progress
        Told how far it is.

    Raises
    ------
    MaterialError, SuctionError, OutputError
        If the configuration, the sizes or the directory cannot be used.
    """
    chosen = options or AspirationOptions()
    cards = configuration_cards(configuration)
    chosen.refuse_ineffective(list(cards))
    with directory_at_once(out) as folder:
        result = aspirated(
            {k: c.material for k, c in cards.items()},
            chosen,
            search_kpa=chosen.search_kpa,
            progress=progress,
        )
        messages = curve_messages(configuration, result, chosen)
        write_curve(folder / "aspiration.csv", result)
        plot_curve(folder / "aspiration.png", configuration, result)
        plot_field(folder / "field.png", configuration, result, chosen)
        write_summary(
            folder,
            {
                "configuration": configuration,
                "layers": {k: dict(c.parameters) for k, c in cards.items()},
                "options": dataclasses.asdict(chosen),
                "elements": int(result.model.fem_model.body.mesh.t.shape[1]),
                "nonlinearity": result.nonlinearity,
                "tangent_eigenvalue_nearest_zero_n_per_mm": result.softest.tolist(),
                "loss": loss_table(result.loss),
                "remarks": messages,
            },
        )
    reached = bool(np.isclose(result.suction_kpa[-1], chosen.suction_kpa))
    return StudyResult(out, messages, reached)


def thesis_comparison(
    out: Path,
    options: AspirationOptions | None = None,
    *,
    progress: Progress = no_progress,
) -> StudyResult:
    """Redo Figures 3.11 to 3.14: the four printed optima, to 7.3 kPa and to the highest suctions.

    Writes ``aspiration-<configuration>.csv`` to 7.3 kPa, ``high-<configuration>.csv`` beyond,
    ``comparison.png`` and ``summary.json``.
    """
    chosen = options or AspirationOptions()
    curves: dict[str, Aspiration] = {}
    high: dict[str, Aspiration] = {}
    with directory_at_once(out) as folder:
        for number, name in enumerate(CONFIGURATIONS):
            layers = {k: c.material for k, c in configuration_cards(name).items()}
            progress(number / len(CONFIGURATIONS), name)
            curves[name] = aspirated(layers, chosen)
            far = dataclasses.replace(chosen, suction_kpa=THESIS_HIGHEST_KPA[name], points=20)
            high[name] = aspirated(layers, far, search_kpa=chosen.search_kpa)
            write_curve(folder / f"aspiration-{name}.csv", curves[name])
            write_curve(folder / f"high-{name}.csv", high[name])
        messages: list[str] = []
        for name in CONFIGURATIONS:
            messages += [f"{name}: {s}" for s in curve_messages(name, high[name], chosen)]
        differences = {n: curves["L1"].difference(c) for n, c in curves.items()}
        messages += [
            f"{n} differs from L1 by {100 * d:.2f} % RMS of L1's range up to 7.3 kPa"
            for n, d in differences.items()
            if n != "L1"
        ]
        plot_comparison(folder / "comparison.png", curves, high, THESIS_HIGHEST_KPA)
        write_summary(
            folder,
            {
                "options": dataclasses.asdict(chosen),
                "rms_difference_from_L1": differences,
                "nonlinearity": {n: c.nonlinearity for n, c in curves.items()},
                "loss": {n: loss_table(c.loss) for n, c in high.items()},
                "remarks": messages,
            },
        )
    return StudyResult(out, tuple(messages), all(c.loss is None for c in high.values()))


def curve_messages(name: str, result: Aspiration, options: AspirationOptions) -> tuple[str, ...]:
    """Return what a reader must know of a curve."""
    softest = result.softest
    messages = [
        f"apex {result.apex_mm[-1]:.3f} mm at {result.suction_kpa[-1]:.2f} kPa; the curve leaves "
        f"its chord by {100 * result.nonlinearity:.1f} % of its range"
    ]
    if result.loss is None:
        upto = max(options.search_kpa, float(result.suction_kpa[-1]))
        messages.append(
            f"equilibrium is not lost up to {upto:g} kPa; up to {result.suction_kpa[-1]:g} kPa the "
            "tangent's eigenvalue nearest to zero stays above "
            f"{softest.min() / softest[0]:.2f} of its value at rest"
        )
    else:
        messages.append(
            f"equilibrium is lost at {result.loss.suction_kpa:.2f} kPa, apex "
            f"{result.loss.apex_mm:.2f} mm: {result.loss.message}"
        )
    return tuple(messages)


def loss_table(loss: Loss | None) -> dict[str, Any] | None:
    """Return a loss as a table for JSON."""
    if loss is None:
        return None
    return {
        "suction_kpa": loss.suction_kpa,
        "apex_mm": loss.apex_mm,
        "physical": loss.physical,
        "sentence": loss.message,
        "path": {
            "apex_mm": loss.path[:, 0].tolist(),
            "suction_kpa": loss.path[:, 1].tolist(),
            "relative_eigenvalue": loss.path[:, 2].tolist(),
        },
    }


def write_curve(path: Path, result: Aspiration) -> None:
    """Write a curve as ``aspiration.csv``."""
    columns = (result.suction_kpa, result.apex_mm, result.min_log_strain, result.max_log_strain)
    write_table(path, COLUMNS, list(zip(*columns, strict=True)))
