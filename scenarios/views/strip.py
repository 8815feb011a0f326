"""Pressure on both lips against time, under a film or a sheet: a cursor, or numbered instants."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike, NDArray

from scenarios.messages.verdict import PAIN
from scenarios.results.solution import Solution
from scenarios.views.labels import halo
from scenarios.views.panels import Place, axes_at
from scenarios.views.themes import LIGHT, Theme

Array = NDArray[np.float64]

LIP_PRESSURES = (
    ("upper_lip_window_kpa", "upper lip"),
    ("lower_lip_window_kpa", "lower lip"),
)
BELOW_WORDS = 0.8
"""Share of the strip's height that the cursor and marked instants take: words are above."""
VALUE_POINTS = 84.0
"""Room of a written pressure and its lip, points."""


def relative_axis(
    axes: Axes,
    start_s: float,
    end_s: float,
    *,
    size: float,
    theme: Theme = LIGHT,
    of: str = "",
    colour: str | None = None,
    away_points: float = 0.0,
) -> None:
    """Give axes whose x is time, s, a second axis above: 0 at the start of a replay, 1 at its end.

    An only instant has none. Where there are several such axes, ``of`` and ``colour`` tell whose it
    is, and ``away_points`` keeps it away from the one below.
    """
    if end_s <= start_s:
        return
    span = end_s - start_s

    def to_relative(time_s: ArrayLike) -> Array:
        return (np.asarray(time_s, float) - start_s) / span

    def to_seconds(share: ArrayLike) -> Array:
        return start_s + np.asarray(share, float) * span

    above = axes.secondary_xaxis("top", functions=(to_relative, to_seconds))
    above.set_ticks(np.linspace(0.0, 1.0, 6))
    colour = colour or theme.quiet
    above.tick_params(labelsize=size, colors=colour, length=3, pad=1)
    above.spines["top"].set(color=colour, position=("outward", away_points), bounds=(0.0, 1.0))
    words = f"relative time, {of}" if of else "relative time"
    above.set_xlabel(words, size=size, color=colour, labelpad=2, parse_math=False)


def _say_pain(axes: Axes, theme: Theme, *, size: float) -> None:
    """Say from which pressure on it hurts, above the curves, and draw it if the axis reaches it."""
    above = ", above ↑" if PAIN.low > axes.get_ylim()[1] else ""
    axes.text(
        0.5, 0.985, f"pain from {PAIN.low:.0f} kPa{above}", size=size, color=theme.warning,
        ha="center", va="top", transform=axes.transAxes,
    )  # fmt: skip
    if not above:
        axes.axhline(PAIN.low, color=theme.warning, lw=1.2)


class HistoryStrip:
    """Highest mean pressure over 0.5 mm of each lip against time, with a cursor."""

    def __init__(
        self,
        figure: Figure,
        place: Place,
        solution: Solution,
        *,
        size: float,
        theme: Theme = LIGHT,
    ) -> None:
        axes = axes_at(figure, place)
        self._theme = theme
        pressures = zip(LIP_PRESSURES, (theme.upper, theme.lower), strict=True)
        self._curves = [(solution[name], colour) for (name, _), colour in pressures]
        start, end = solution.time_s[[0, -1]]
        for (output, colour), (_, title) in zip(self._curves, LIP_PRESSURES, strict=True):
            axes.plot(output.time_s, output.values, color=colour, lw=1.8, label=title)
        highest = max(float(output.values.max()) for output, _ in self._curves)
        axes.set_ylim(0.0, 1.3 * highest or 1.0)  # room for the legend above the curves
        axes.set_xlim(start, end if end > start else start + 1.0)
        axes.set_xlabel("time, s", size=size, color=theme.ink, labelpad=2)
        relative_axis(axes, start, end, size=size - 2, theme=theme)
        axes.set_ylabel("pressure over\n0.5 mm, kPa", size=size, color=theme.ink)
        axes.yaxis.set_major_locator(MaxNLocator(4))
        axes.tick_params(labelsize=size, colors=theme.ink, length=3)
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines[["left", "bottom"]].set_color(theme.quiet)
        axes.set_facecolor("none")
        axes.legend(
            loc="upper left", fontsize=size, frameon=False, ncols=2, borderaxespad=0.1,
            labelcolor=theme.ink,
        )  # fmt: skip
        _say_pain(axes, theme, size=size - 1)
        self.axes = axes
        self._line = axes.axvline(start, ymax=BELOW_WORDS, color=theme.ink, lw=1.0, zorder=3)
        self._dots = [
            axes.plot(
                [start], [0.0], "o", ms=7, mfc=colour, mec=theme.halo, zorder=4, clip_on=False
            )[0]
            for _, colour in self._curves
        ]
        self._values = [
            axes.annotate(
                "",
                (1.0, 1.0),
                xycoords="axes fraction",
                xytext=(-VALUE_POINTS * (len(self._curves) - 1 - number), -2),
                textcoords="offset points",
                ha="right",
                va="top",
                size=size,
                weight="bold",
                color=colour,
            )
            for number, (_, colour) in enumerate(self._curves)
        ]
        self.artists: list[Artist] = [self._line, *self._dots, *self._values]

    def show(self, time_s: float) -> None:
        """Move the cursor to a time, s."""
        self._line.set_xdata([time_s, time_s])
        moving = zip(self._dots, self._values, self._curves, LIP_PRESSURES, strict=True)
        for dot, text, (output, _), (_, lip) in moving:
            value = output.at(time_s)
            dot.set_data([time_s], [value])
            text.set_text(f"{lip.removesuffix(' lip')} {value:.0f} kPa")

    def mark(self, times_s: Sequence[float], *, size: float) -> None:
        """Mark instants, s, by number, instead of the cursor."""
        for artist in self.artists:
            artist.set_visible(False)
        for number, time in enumerate(times_s, start=1):
            self.axes.axvline(
                time, ymax=BELOW_WORDS, color=self._theme.quiet, lw=1.0, ls=(0, (3, 3)), zorder=0
            )
            self.axes.annotate(
                f"{number}",
                (time, 0.0),
                xytext=(3, 3),
                textcoords="offset points",
                size=size,
                color=self._theme.ink,
                ha="left",
                va="bottom",
                path_effects=halo(self._theme),
            )
