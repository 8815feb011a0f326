"""The picture of a search: every neck that was tried, and the best ones."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.ticker import MaxNLocator

from geometry2d.neck import NeckSection
from scenarios.decision.messages import meaning
from scenarios.optimum.search import Trial
from scenarios.views.page.embedded import Embedded
from scenarios.views.page.figures import TEXT, line_style, new_figure, quieten, svg
from scenarios.views.themes import INK, NECK, NECK_EDGE, QUIET

LABEL_LETTERS = 42
"""In a line of an axis' label."""

SHOWN_MM, MARGIN_MM, SPACING_MM = 17.0, 0.8, 0.05
"""How much of a wall is shown from its opening, the room around it, and how finely it is drawn."""


def search_figure(
    trials: Sequence[Trial],
    best: Sequence[Trial],
    objectives: Sequence[str],
    signs: Sequence[float],
) -> Embedded:
    """Return two objectives against each other, or a single one against the number of the trial.

    Parameters
    ----------
    trials, best
        What was tried, and those that nothing feasible beats.
    objectives
        Names of the measures; the first two are shown.
    signs
        By which the objectives of trials are multiplied to be measures.
    """
    figure = new_figure((6.4, 4.4))
    axes = figure.subplots()

    def place(trial: Trial) -> tuple[float, float]:
        values = [v * s for v, s in zip(trial.evaluation.objectives, signs, strict=True)]
        return (values[0], values[1]) if len(values) > 1 else (float(trial.number), values[0])

    for feasible, colour, shown in ((False, QUIET, "breaks a constraint"), (True, INK, "tried")):
        points = np.array([place(t) for t in trials if t.evaluation.is_feasible == feasible])
        if points.size:
            axes.scatter(points[:, 0], points[:, 1], s=18, color=colour, alpha=0.5, label=shown)
    if best:
        points = np.array([place(trial) for trial in best])
        axes.scatter(points[:, 0], points[:, 1], s=46, color=line_style(0)[0], label="best")
        for trial in best:
            axes.annotate(str(trial.number), place(trial), size=TEXT - 1, xytext=(5, 4),
                          textcoords="offset points")  # fmt: skip
    names = [fill(meaning(name), LABEL_LETTERS) for name in objectives[:2]]
    x, y = names if len(names) > 1 else ("trial", names[0])
    if len(names) == 1:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel(x, color=INK, size=TEXT)
    axes.set_ylabel(y, color=INK, size=TEXT)
    axes.legend(frameon=False, fontsize=TEXT - 1)
    quieten(axes)
    return svg(figure, f"{len(trials)} necks that were tried, {len(best)} of them best")


def neck_figure(neck: NeckSection, base: NeckSection, shows: str) -> Embedded:
    """Return the lower wall of a neck near its opening, with the one it was made from, dashed."""
    figure = new_figure((3.6, 1.9))
    axes = figure.subplots()
    wall, usual = (each.lower_wall.sampled(SPACING_MM) for each in (neck, base))
    axes.fill(*wall.T, facecolor=NECK, edgecolor=NECK_EDGE, lw=1.0, alpha=0.6)
    axes.plot(*np.vstack([usual, usual[:1]]).T, color=INK, lw=1.0, ls=(0, (4, 3)))
    both = np.vstack([wall, usual])
    left, bottom = both.min(axis=0) - MARGIN_MM
    axes.set(xlim=(left, left + SHOWN_MM), ylim=(bottom, both[:, 1].max() + MARGIN_MM))
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.plot([left + SHOWN_MM - 5.5, left + SHOWN_MM - 0.5], [bottom + 0.4] * 2, color=INK, lw=2.0)
    axes.text(left + SHOWN_MM - 3.0, bottom + 0.6, "5 mm", size=TEXT - 1, color=INK, ha="center")
    return svg(figure, shows)
