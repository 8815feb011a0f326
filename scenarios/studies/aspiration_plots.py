"""Pictures of suction tests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.studies.suction import SuctionOptions
from scenarios.studies.suction_curve import Aspiration


def plot_curve(path: Path, name: str, result: Aspiration) -> None:
    """Draw apex displacement and extreme strains against suction."""
    from scenarios.studies.plots import COLOURS, blank_figure, finish, labelled

    figure = blank_figure(9.5, 4.0)
    left, right = figure.subplots(1, 2)
    left.plot(result.suction_kpa, result.apex_mm, "o-", color=COLOURS[0], markersize=3)
    if result.loss is not None:
        left.plot([result.loss.suction_kpa], [result.loss.apex_mm], "x", color=COLOURS[1],
                  label="equilibrium lost")  # fmt: skip
        left.legend(frameon=False)
    labelled(left, "suction (kPa)", "apex displacement (mm)")
    right.plot(result.suction_kpa, result.max_log_strain, "+-", color=COLOURS[3], label="largest")
    right.plot(result.suction_kpa, result.min_log_strain, "x-", color=COLOURS[2], label="smallest")
    labelled(right, "suction (kPa)", "principal log strain in the dermis")
    right.legend(frameon=False)
    figure.suptitle(f"Aspiration of {name}")
    finish(figure, path)


def plot_field(path: Path, name: str, result: Aspiration, options: SuctionOptions) -> None:
    """Draw the last equilibrium under the cup, coloured by strain."""
    from scenarios.studies.plots import blank_figure, draw_field, finish, labelled

    body = result.model.fem_model.body
    fields = body.fields(result.last.displacement)
    strain = np.average(fields.log_strain[..., 2], axis=1, weights=fields.volume)
    figure = blank_figure(9.0, 4.6)
    axes = labelled(figure.subplots(), "distance from the axis (mm)", "height (mm)")
    colours = draw_field(axes, body, result.last.displacement, strain, mirrored=True)
    cup = options.cup.sampled(0.1)
    for side in (1.0, -1.0):
        axes.fill(side * cup[:, 0], cup[:, 1], facecolor="0.82", edgecolor="0.35", linewidth=0.8)
    reach = 1.9 * options.aperture_radius_mm
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-0.8 * reach, max(0.3 * reach, 1.3 * result.apex_mm[-1]))
    figure.colorbar(colours, ax=axes, label="largest principal log strain", shrink=0.8)
    axes.set_title(f"{name} at {result.suction_kpa[-1]:.2f} kPa, true scale")
    finish(figure, path)


def plot_comparison(
    path: Path,
    curves: Mapping[str, Aspiration],
    high: Mapping[str, Aspiration],
    highest_kpa: Mapping[str, float],
) -> None:
    """Draw curves of several configurations, and beside them those to the highest suctions."""
    from scenarios.studies.plots import COLOURS, blank_figure, finish, labelled

    figure = blank_figure(10.0, 4.2)
    left, right = figure.subplots(1, 2)
    shown: list[tuple[Any, Mapping[str, Aspiration], Callable[[str], str]]] = [
        (left, curves, lambda n: n),
        (right, high, lambda n: f"{n}, to {highest_kpa[n]:g} kPa"),
    ]
    for axes, results, label in shown:
        for colour, (name, result) in zip(COLOURS, results.items(), strict=False):
            axes.plot(result.suction_kpa, result.apex_mm, color=colour, label=label(name))
            if result.loss is not None:
                axes.plot([result.loss.suction_kpa], [result.loss.apex_mm], "x", color=colour)
        labelled(axes, "suction (kPa)", "apex displacement (mm)")
        axes.legend(frameon=False)
    left.set_title("up to 7.3 kPa (Figures 3.11 to 3.13)", fontsize=10)
    right.set_title("high suction (Figure 3.14)", fontsize=10)
    finish(figure, path)
