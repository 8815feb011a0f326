"""Plots of runs: the five histories of a sip, and the imprint that it leaves on the neck."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, FigureBase
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from geometry2d.foundation.output import file_at_once
from geometry2d.neck import NeckSection
from geometry2d.outline import Outline
from scenarios.messages.verdict import FAILURE, PAIN
from scenarios.results.quantities import LIPS, Quantity
from scenarios.results.solution import Solution
from scenarios.settings.files import SCENARIO_FILE
from scenarios.settings.scenario import load_scenario
from scenarios.views.colours import PRESSURE_COLOURS
from scenarios.views.limits import upper_limit
from scenarios.views.strip import relative_axis
from scenarios.views.themes import INK, NECK, NECK_EDGE, PAPER, QUIET, RUN_COLOURS, WARNING

Array = NDArray[np.float64]

DPI = 110
FIVE_HISTORIES = (
    ("dermis_min_log_strain", "smallest log strain\nin the dermis"),
    ("dermis_max_log_strain", "largest log strain\nin the dermis"),
    ("dermis_max_mises_kpa", "largest von Mises\nin the dermis"),
    ("upper_lip_window_kpa", "pressure over 0.5 mm\nupper lip"),
    ("lower_lip_window_kpa", "pressure over 0.5 mm\nlower lip"),
)
"""The histories of the thesis' Figures 4.13 to 4.17, pressure over 0.5 mm of skin."""
THESIS_PRESSURES = {
    "upper_lip_window_kpa": "upper_lip_pressure_kpa",
    "lower_lip_window_kpa": "lower_lip_pressure_kpa",
}
"""The thesis' measure of a pressure, which is drawn beside it if there is one run."""
RELATIVE_AXIS_POINTS = 32.0
"""Room of an axis of relative time above another."""
IMPRINT_STEP_MM = 0.05
IMPRINT_REACH_MM = 0.8
IMPRINT_POINTS = 16
IMPRINT_MARGIN_MM = 1.0
CONTOUR_MM = 14.0
"""How much of a wall is drawn, from its opening."""


def plot_histories(runs: Sequence[Path], out: Path) -> None:
    """Draw the five histories of one or several runs, one below the other.

    One run is drawn against time in seconds of its film, several against seconds since each began;
    relative time is a second axis, one for each length of time. Thresholds of pain and tearing are
    drawn where they are.

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
    figure = histories_figure(solutions)
    with file_at_once(out) as partial:
        figure.savefig(partial, facecolor=PAPER)


def histories_figure(solutions: Sequence[Solution]) -> Figure:
    """Return the picture of :func:`plot_histories`."""
    starts = _starts(solutions)
    spans = _spans(solutions, starts)
    height = 11.0 + RELATIVE_AXIS_POINTS / 72 * (len(spans) - 1)
    figure = Figure(figsize=(9.0, height), dpi=DPI, facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(FIVE_HISTORIES), 1, sharex=True)
    for axes, (name, title) in zip(panels, FIVE_HISTORIES, strict=True):
        for solution, colour, start in zip(
            solutions, _colours(len(solutions)), starts, strict=True
        ):
            _history(axes, solution, name, colour, start, alone=len(solutions) == 1)
        _finish(axes, title, solutions[0][name].quantity)
        _threshold(axes, name)
    for text in panels[0].legend(loc="best", frameon=False, fontsize=10).get_texts():
        text.set_parse_math(False)  # a name may hold dollars
    what = "time since the start of each replay, s" if any(starts) else "time, s"
    panels[-1].set_xlabel(what, color=INK, size=11)
    _time_axes(panels, solutions, spans)
    return figure


def _time_axes(
    panels: Sequence[Axes],
    solutions: Sequence[Solution],
    spans: Mapping[tuple[float, float], Sequence[int]],
) -> None:
    """Fit the axis of time to histories, one below the other, and put shares of a run above."""
    begin, end = min(span[0] for span in spans), max(span[1] for span in spans)
    panels[-1].set_xlim(begin, end if end > begin else begin + 1.0)
    for row, ((first, last), runs) in enumerate(spans.items()):
        alone = len(spans) == 1
        relative_axis(
            panels[0],
            first,
            last,
            size=10,
            of="" if alone else ", ".join(solutions[run].name for run in runs),
            colour=None if alone else _colours(len(solutions))[runs[0]],
            away_points=row * RELATIVE_AXIS_POINTS,
        )


def _starts(solutions: Sequence[Solution]) -> list[float]:
    """Return the instant, s, from which the time of each run counts.

    Runs of one film share the film's time; those of several count from where each begins.
    """
    if all(solution.motion == solutions[0].motion for solution in solutions[1:]):
        return [0.0] * len(solutions)
    return [float(solution.time_s[0]) for solution in solutions]


def _spans(
    solutions: Sequence[Solution], starts_s: Sequence[float]
) -> dict[tuple[float, float], list[int]]:
    """Return when replays begin and end, s, and which they are of ``solutions``."""
    spans: dict[tuple[float, float], list[int]] = {}
    for number, (solution, start) in enumerate(zip(solutions, starts_s, strict=True)):
        first, last = (round(float(solution.time_s[k]) - start, 6) for k in (0, -1))
        spans.setdefault((first, last), []).append(number)
    return spans


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
    neck = load_scenario(str(run / SCENARIO_FILE)).package.section()
    figure = Figure(figsize=(9.0, 9.6), dpi=DPI, facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    # The annotation tells of one subfigure.
    maps, contour = cast(Any, figure.subfigures(2, 1, height_ratios=[7.0, 2.6]))
    figure.suptitle(
        f"{solution.name}: pressure along the neck's contour", color=INK, parse_math=False
    )
    imprints = imprint_maps(maps, solution, neck)
    highest = upper_limit(float(pressure.max()) for _, pressure in imprints.values())
    for axes, lip in zip(contour.subplots(1, 2), LIPS, strict=True):
        _draw_contour(axes, neck, lip, imprints[lip], highest)
    with file_at_once(out) as partial:
        figure.savefig(partial, facecolor=PAPER)


def _draw_contour(
    axes: Axes, neck: NeckSection, lip: str, imprinted: tuple[Array, Array], highest_kpa: float
) -> None:
    """Draw a wall near the opening, and on its contour the highest pressure at each place."""
    wall: Outline = getattr(neck, f"{lip}_wall")
    arc, pressure = imprinted
    line, most = wall.sampled(0.1), pressure.max(axis=0)
    axes.fill(*line.T, facecolor=NECK, edgecolor=NECK_EDGE, lw=0.8, alpha=0.4)
    x, y = wall.point_at(np.mod(arc[most > 0], wall.length))[0].T
    axes.scatter(
        x, y, s=30, c=most[most > 0], cmap=PRESSURE_COLOURS, vmin=0.0, vmax=highest_kpa, zorder=3
    )
    outside = 1 if lip == "upper" else -1
    left = float(line[:, 0].min())
    for name, (start, end) in getattr(neck, f"{lip}_stretches").items():
        middle = wall.point_at(np.array([np.mod((start + end) / 2, wall.length)]))[0][0]
        if middle[0] < left + CONTOUR_MM:
            axes.annotate(
                name.replace("_", " "), (middle[0], middle[1]), xytext=(0, 16 * outside), size=9,
                color=QUIET, textcoords="offset points", ha="center", va="center",
            )  # fmt: skip
    middle_y = float(line[:, 1].mean())
    axes.set(xlim=(left - 1.0, left + CONTOUR_MM), ylim=(middle_y - 4.0, middle_y + 4.0))
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(f"{lip} wall: highest pressure", size=11, color=INK, loc="left")


def imprint_maps(
    figure: FigureBase, solution: Solution, neck: NeckSection, *, highest_kpa: float | None = None
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
        axes.set_ylabel(f"{lip} lip: place on\nthe contour, mm", color=INK, size=11)
        _name_stretches(axes, getattr(neck, f"{lip}_stretches"))
        _quiet(axes)
    panels[-1].set_xlabel("time, s", color=INK, size=11)
    relative_axis(panels[0], *solution.time_s[[0, -1]].tolist(), size=10)
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


def _history(
    axes: Axes, solution: Solution, name: str, colour: str, start_s: float, *, alone: bool
) -> None:
    time = solution.time_s - start_s
    label = solution.name
    axes.plot(time, solution[name].values, color=colour, lw=1.8, label=label)
    thesis = THESIS_PRESSURES.get(name)
    if alone and thesis is not None:
        axes.plot(time, solution[thesis].values, color=colour, lw=1.2, ls=(0, (4, 2)))
        axes.plot([], [], color=colour, lw=1.8, label="mean over 0.5 mm")
        axes.plot([], [], color=colour, lw=1.2, ls=(0, (4, 2)), label="two highest elements")
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles[1:], labels[1:], loc="best", frameon=False, fontsize=10)


def _threshold(axes: Axes, name: str) -> None:
    """Draw the threshold of a history if it lies within the axis, and say where it is."""
    if name in THESIS_PRESSURES:
        low, words = PAIN.low, f"pain from {PAIN.low:.0f} kPa"
    elif name == "dermis_max_log_strain":
        low, words = FAILURE.low, f"skin tears at {FAILURE.low:.2f}"
    else:
        return
    top = axes.get_ylim()[1]
    if low < top:
        axes.axhline(low, color=WARNING, lw=1.2)
    said = words if low < top else f"{words}, above ↑"
    axes.set_title(said, color=WARNING, size=10, loc="right", pad=2)


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
