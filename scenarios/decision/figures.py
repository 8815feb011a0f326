"""The pictures of a study's page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geometry2d.anatomy.population import Person
from geometry2d.views.draw import draw_section
from scenarios.decision.indices import Effect, SobolIndices
from scenarios.views.page.embedded import Embedded
from scenarios.views.page.figures import TEXT, line_style, new_figure, quieten, svg
from scenarios.views.themes import INK, QUIET

COLUMNS = 6
"""Sections of people side by side."""

SECTION_INCHES = 1.35
SHOWN_MM = (-16.0, 26.0, -34.0, 34.0)
"""Left, right, bottom and top of what is shown of a head about its lips' margin, mm."""

ROW_INCHES = 0.27
BAND = "#d5dee4"


def effects_figure(effects: Sequence[Effect], label: str) -> Embedded:
    """Return a tornado: how much each setting changes a measure, the largest on top."""
    figure = new_figure((6.4, 0.9 + 0.42 * len(effects)))
    axes = figure.subplots()
    for row, effect in enumerate(reversed(effects)):
        axes.barh(row, effect.change, color=line_style(0)[0], height=0.55)
        low, high = effect.interval
        if np.isfinite(low) and np.isfinite(high):
            axes.plot([low, high], [row, row], color=INK, lw=1.6)
    axes.axvline(0.0, color=QUIET, lw=1.0)
    axes.set_yticks(
        range(len(effects)),
        [f"{e.setting}\n{_value(e.from_value)} → {_value(e.to_value)}" for e in reversed(effects)],
    )
    axes.set_xlabel(f"change of {label}", color=INK, size=TEXT)
    quieten(axes)
    said = "; ".join(f"{e.setting} {e.change:+.1f}" for e in effects)
    return svg(figure, f"Effects on {label}: {said}")


def indices_figure(found: SobolIndices, label: str) -> Embedded:
    """Return Sobol' indices with their intervals: alone, and with all others together."""
    figure = new_figure((6.4, 1.0 + 0.5 * len(found.settings)))
    axes = figure.subplots()
    shown = (
        (found.first, found.first_interval, -0.14, 0),
        (found.total, found.total_interval, 0.14, 1),
    )
    for value, interval, offset, colour in shown:
        rows = np.arange(len(found.settings)) + offset
        axes.hlines(rows, interval[:, 0], interval[:, 1], color=line_style(colour)[0], lw=1.6)
        axes.scatter(value, rows, s=34, color=line_style(colour)[0], zorder=3)
    axes.set_yticks(range(len(found.settings)), list(found.settings))
    axes.set_ylim(len(found.settings) - 0.5, -0.5)
    axes.set_xlim(-0.05, 1.1)
    axes.set_xlabel(f"share of the variance of {label}", color=INK, size=TEXT)
    quieten(axes)
    said = "; ".join(
        f"{name} {first:.2f} alone, {total:.2f} in total"
        for name, first, total in zip(found.settings, found.first, found.total, strict=True)
    )
    return svg(figure, f"Sobol' indices of {label}: {said}")


def people_figure(people: Sequence[Person]) -> Embedded:
    """Return the lips of every person of a panel, in small, at one scale."""
    rows = -(-len(people) // COLUMNS)
    left, right, bottom, top = SHOWN_MM
    height = SECTION_INCHES * (top - bottom) / (right - left) + 0.3
    figure = new_figure((COLUMNS * SECTION_INCHES, rows * height))
    panels = np.atleast_1d(figure.subplots(rows, COLUMNS, squeeze=False)).ravel()
    for axes in panels:
        axes.set_axis_off()
    for axes, person in zip(panels, people, strict=False):
        head = person.section()
        for lip in (head.upper, head.lower):
            draw_section(axes, lip)
        for tooth in (head.upper_tooth, head.lower_tooth):
            axes.fill(*tooth.sampled(0.3).T, facecolor="#fbfaf5", edgecolor="#9a958a", lw=0.5)
        middle = 0.5 * (head.landmarks["stomion_upper"] + head.landmarks["stomion_lower"])
        axes.set(
            xlim=(middle[0] + left, middle[0] + right),
            ylim=(middle[1] + bottom, middle[1] + top),
            aspect="equal",
        )
        axes.set_title(person.name, size=TEXT - 1.5, color=INK, pad=2)
    return svg(figure, f"The sections of {len(people)} people, at one scale")


def _value(value: float | str) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
