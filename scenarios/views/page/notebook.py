"""Solutions as a notebook shows them: a small table beside a picture, or the page that moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution
from scenarios.views.on_axes import plot_snapshot
from scenarios.views.page.embedded import data_address
from scenarios.views.page.explore import explorer
from scenarios.views.page.hypertext import Markup, joined, tag
from scenarios.views.page.report import document
from scenarios.views.page.reported import reported_runs

SHOWN_IN_TABLE = (
    ("upper_lip_window_kpa", "upper lip, pressure over 0.5 mm", "{:.0f} kPa"),
    ("lower_lip_window_kpa", "lower lip, pressure over 0.5 mm", "{:.0f} kPa"),
    ("dermis_max_log_strain", "dermis, largest log strain", "{:.2f}"),
    ("dermis_min_log_strain", "dermis, smallest log strain", "{:.2f}"),
    ("dermis_max_mises_kpa", "dermis, von Mises stress", "{:.0f} kPa"),
)
DPI = 90
FRAME_PX = 900


@dataclass(frozen=True)
class Explorer:
    """Runs that a slider moves, in a frame of a notebook; scripts can reach nothing outside it.

    Attributes
    ----------
    labels
        What the runs are called.
    page
        The whole document in the frame.
    height_px
        Of the frame.
    """

    labels: tuple[str, ...]
    page: str
    height_px: int

    def __repr__(self) -> str:
        return f"<Explorer of {', '.join(self.labels)}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        return tag(
            "iframe",
            srcdoc=self.page,
            sandbox="allow-scripts",
            title=f"Move through {', '.join(self.labels)}",
            style=f"width:100%;height:{self.height_px}px;border:0",
        )


def explored(solutions: Sequence[Solution | Path], height_px: int = FRAME_PX) -> Explorer:
    """Return solutions or run directories to move through in a notebook; two lie side by side.

    Raises
    ------
    DrinksimError
        If a run lacks what is to be shown, or if one is given twice.
    """
    runs = reported_runs(solutions)
    labels = tuple(run.label for run in runs)
    return Explorer(
        labels, document(" · ".join(labels), runs, tag("main", explorer(runs))), height_px
    )


def solution_markup(solution: Solution) -> Markup:
    """Return the peaks of a solution, and the section when a lip is pressed most."""
    rows = [
        tag("tr", tag("td", title), tag("td", pattern.format(solution.summary[name])))
        for name, title, pattern in SHOWN_IN_TABLE
    ]
    start, end = solution.time_s[[0, -1]]
    span = f"{solution.time_s.size} increments, {start:.2f} to {end:.2f} s"
    table = tag("table", tag("caption", tag("strong", solution.name), f": {span}"), *rows)
    picture = tag("img", src=_picture(solution), alt="the section when a lip is pressed most")
    ended = [] if solution.finished else [tag("p", f"unfinished: {solution.message}")]
    beside = tag("div", table, picture, style="display:flex;gap:1.5em;align-items:center")
    return joined(beside, *ended)


def _picture(solution: Solution) -> str:
    """Return a picture as the address of an image."""
    pressure = np.max([solution[f"{lip}_lip_window_kpa"].values for lip in LIPS], axis=0)
    figure = Figure(figsize=(6.2, 3.8), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    plot_snapshot(solution.snapshot(int(np.argmax(pressure))), "von_mises", figure.add_subplot())
    picture = BytesIO()
    figure.savefig(picture, format="png")
    return data_address(picture.getvalue(), "image/png")
