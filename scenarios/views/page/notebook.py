"""A solution as a notebook shows it: a small table beside a picture."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution
from scenarios.views.on_axes import plot_snapshot
from scenarios.views.page.embedded import data_address
from scenarios.views.page.hypertext import Markup, joined, tag

SHOWN_IN_TABLE = (
    ("upper_lip_window_kpa", "upper lip, pressure over 0.5 mm", "{:.0f} kPa"),
    ("lower_lip_window_kpa", "lower lip, pressure over 0.5 mm", "{:.0f} kPa"),
    ("dermis_max_log_strain", "dermis, largest log strain", "{:.2f}"),
    ("dermis_min_log_strain", "dermis, smallest log strain", "{:.2f}"),
    ("dermis_max_mises_kpa", "dermis, von Mises stress", "{:.0f} kPa"),
)
DPI = 90


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
