"""Plots of runs: the five histories of a sip, and the imprint that it leaves on the neck."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from geometry2d.foundation.output import file_at_once
from geometry2d.neck import NeckSection
from scenarios.results.quantities import LIPS, Quantity
from scenarios.results.solution import Solution
from scenarios.settings.scenario import load_scenario
from scenarios.views.scene import (
    INK,
    LOWER,
    PAPER,
    PRESSURE_COLOURS,
    QUIET,
    UPPER,
    upper_limit,
)

Array = NDArray[np.float64]

DPI = 110
FIVE_HISTORIES = (
    ("dermis_min_log_strain", "smallest log strain\nin the dermis"),
    ("dermis_max_log_strain", "largest log strain\nin the dermis"),
    ("dermis_max_mises_kpa", "largest von Mises\nin the dermis"),
    ("upper_lip_pressure_kpa", "contact pressure\nupper lip"),
    ("lower_lip_pressure_kpa", "contact pressure\nlower lip"),
)
"""The histories of the thesis' Figures 4.13 to 4.17."""
WINDOWS = {
    "upper_lip_pressure_kpa": "upper_lip_window_kpa",
    "lower_lip_pressure_kpa": "lower_lip_window_kpa",
}
RUN_COLOURS = (UPPER, LOWER, "#5b8c4a", "#8e4585", "#9a7d2e", "#555b66")
IMPRINT_STEP_MM = 0.05
IMPRINT_REACH_MM = 0.8
IMPRINT_POINTS = 16
IMPRINT_MARGIN_MM = 1.0


def plot_histories(runs: Sequence[Path], out: Path) -> None:
    """Draw the five histories of one or several runs against relative time, one below the other.

    Parameters
    ----------
    runs
        run directories; each is called by its scenario's name.
    out
        the picture to write, ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    SolutionError
        If one of ``runs`` is not a run directory.
    """
    solutions = [Solution.load(run) for run in runs]
    figure = Figure(figsize=(9.0, 11.0), dpi=DPI, facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(FIVE_HISTORIES), 1, sharex=True)
    for axes, (name, title) in zip(panels, FIVE_HISTORIES, strict=True):
        for solution, colour in zip(solutions, _colours(len(solutions)), strict=True):
            _history(axes, solution, name, colour, alone=len(solutions) == 1)
        _finish(axes, title, solutions[0][name].quantity)
    for text in panels[0].legend(loc="best", frameon=False, fontsize=10).get_texts():
        text.set_parse_math(False)  # a name may hold dollars
    panels[-1].set_xlabel("relative time", color=INK, size=11)
    panels[-1].set_xlim(0.0, 1.0)
    with file_at_once(out) as partial:
        figure.savefig(partial, facecolor=PAPER)


def plot_imprint(run: Path, out: Path) -> None:
    """Draw where along the neck's contour the lips press, against time.

    Parameters
    ----------
    run
        a run directory.
    out
        the picture to write, ``.png``, ``.svg`` or ``.pdf``.

    Raises
    ------
    SolutionError
        If ``run`` is not a run directory.
    """
    solution = Solution.load(run)
    neck = load_scenario(str(run / "scenario.toml")).package.section()
    figure = Figure(figsize=(9.0, 7.0), dpi=DPI, facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    imprint_maps(figure, solution, neck)
    with file_at_once(out) as partial:
        figure.savefig(partial, facecolor=PAPER)


def imprint_maps(
    figure: Figure, solution: Solution, neck: NeckSection, *, highest_kpa: float | None = None
) -> dict[str, tuple[Array, Array]]:
    """Draw on ``figure`` how each lip presses along the neck's contour, against time.

    ``highest_kpa`` ends the colours; by default a round number above all pressures of the run.
    Returns by lip what :func:`imprint` does.
    """
    panels = figure.subplots(len(LIPS), 1, sharex=True)
    imprints = {lip: imprint(solution, lip) for lip in LIPS}
    highest = highest_kpa or upper_limit(float(p.max()) for _, p in imprints.values())
    for axes, (lip, (arc, pressure)) in zip(panels, imprints.items(), strict=True):
        image = axes.pcolormesh(
            solution.time_s,
            arc,
            np.ma.masked_equal(pressure.T, 0.0),
            cmap=PRESSURE_COLOURS,
            vmin=0.0,
            vmax=highest,
            shading="nearest",
        )
        axes.set_ylim(arc[0] - IMPRINT_MARGIN_MM, arc[-1] + IMPRINT_MARGIN_MM)
        axes.set_ylabel(f"{lip} lip: place on the neck's\ncontour, mm", color=INK, size=11)
        _name_stretches(axes, getattr(neck, f"{lip}_stretches"))
        _quiet(axes)
    panels[-1].set_xlabel("time, s", color=INK, size=11)
    bar = figure.colorbar(image, ax=list(panels), pad=0.02, aspect=40)
    bar.set_label("contact pressure, kPa", color=INK, size=11)
    bar.ax.tick_params(labelsize=10, colors=INK, length=3)
    bar.outline.set_visible(False)
    return imprints


def imprint(solution: Solution, lip: str) -> tuple[Array, Array]:
    """Return the pressure of one lip along the contour of the neck.

    Between neighbouring points of the lip that both touch, place and pressure are linear.

    Returns
    -------
    arc_mm
        (a,) arc length along the wall's outline, mm, over the part that is ever touched.
    pressure_kpa
        (k, a) highest contact pressure at each increment, kPa; 0 where nothing touches.
    """
    contact = solution.contact[lip].fields
    pressure = 1e3 * contact["pressure_mpa"]
    where = np.where(pressure > 0, contact["neck_arc_mm"], np.nan)
    touching = np.isfinite(where)
    if not touching.any():
        return np.zeros(1), np.zeros((where.shape[0], 1))
    low, high = np.nanmin(where), np.nanmax(where)
    result = np.zeros((where.shape[0], int(np.ceil((high - low) / IMPRINT_STEP_MM)) + 1))
    # Points of different walls, or on both sides of a thread, have no contact between them.
    near = np.abs(np.diff(where, axis=1)) < IMPRINT_REACH_MM
    for weight in np.linspace(0.0, 1.0, IMPRINT_POINTS, endpoint=False):
        place, load = where[:, :-1], pressure[:, :-1]
        place = np.where(near, (1 - weight) * place + weight * where[:, 1:], place)
        load = np.where(near, (1 - weight) * load + weight * pressure[:, 1:], load)
        rows, columns = np.nonzero(np.isfinite(place))
        steps = ((place[rows, columns] - low) / IMPRINT_STEP_MM).round().astype(int)
        np.maximum.at(result, (rows, steps), load[rows, columns])
    return low + IMPRINT_STEP_MM * np.arange(result.shape[1]), result


def _name_stretches(axes: Axes, stretches: Mapping[str, tuple[float, float]]) -> None:
    """Shade the thread's crests and write every visible stretch's name at the right edge."""
    low, high = axes.get_ylim()
    for name, (start, end) in stretches.items():
        if name.startswith("crest"):
            axes.axhspan(start, end, color="#ece8e1", lw=0, zorder=0)
        bottom, top = max(start, low), min(end, high)
        if top - bottom > 0.04 * (high - low):
            axes.text(
                1.0,
                (bottom + top) / 2,
                f"{name.replace('_', ' ')} ",
                transform=axes.get_yaxis_transform(),
                size=10,
                color=QUIET,
                ha="right",
                va="center",
            )
    axes.set_ylim(low, high)


def _history(axes: Axes, solution: Solution, name: str, colour: str, *, alone: bool) -> None:
    time = solution["relative_time"].values
    label = solution.name
    axes.plot(time, solution[name].values, color=colour, lw=1.8, label=label)
    window = WINDOWS.get(name)
    if alone and window is not None:
        axes.plot(time, solution[window].values, color=colour, lw=1.2, ls=(0, (4, 2)))
        axes.plot([], [], color=colour, lw=1.2, ls=(0, (4, 2)), label="mean over 0.5 mm")
        axes.plot([], [], color=colour, lw=1.8, label="two highest elements")
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles[1:], labels[1:], loc="best", frameon=False, fontsize=10)


def _colours(count: int) -> list[str]:
    return [RUN_COLOURS[index % len(RUN_COLOURS)] for index in range(count)]


def _finish(axes: Axes, title: str, quantity: Quantity) -> None:
    unit = f", {quantity.unit}" if quantity.unit else ""
    axes.set_ylabel(title + unit, color=INK, size=11)
    axes.axhline(0.0, color=QUIET, lw=0.8, zorder=0)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.grid(axis="y", color="#e4e1db", lw=0.8)
    _quiet(axes)


def _quiet(axes: Axes) -> None:
    axes.set_facecolor("none")
    axes.tick_params(labelsize=10, colors=INK, length=3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(QUIET)
