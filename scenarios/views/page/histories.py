"""The figures of a report that compare runs: outputs against relative time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenarios.results.doubt import SHARE
from scenarios.views.page.embedded import image
from scenarios.views.page.figures import RunCurve, curves, line_style
from scenarios.views.page.hypertext import Markup, folded, tag
from scenarios.views.page.reported import Reported

Array = NDArray[np.float64]

FIGURES = (
    ("dermis_min_log_strain", "Smallest principal log strain in the dermis", "log strain"),
    ("dermis_max_log_strain", "Largest principal log strain in the dermis", "log strain"),
    ("dermis_max_mises_kpa", "Largest von Mises stress in the dermis", "kPa"),
    ("upper_lip_pressure_kpa", "Contact pressure on the upper lip", "kPa"),
    ("lower_lip_pressure_kpa", "Contact pressure on the lower lip", "kPa"),
    ("upper_lip_contact_mm", "Length of contact, upper lip", "mm"),
    ("lower_lip_contact_mm", "Length of contact, lower lip", "mm"),
)
"""Output, title and unit; the first five are the thesis' Figures 4.13 to 4.17."""


FORCES = (("x", "Force on the hand, forward"), ("y", "Force on the hand, up"))


def histories(runs: Sequence[Reported]) -> Markup:
    """Return the outputs of all runs, a figure each."""
    pictures = [
        _history(
            runs,
            title,
            unit,
            [run.solution[name].values for run in runs],
            [run.band(name) for run in runs],
        )
        for name, title, unit in FIGURES
    ]
    pictures += [
        _history(
            runs,
            title,
            "mN per mm of width",
            [1e3 * run.force(axis) for run in runs],
            [run.band_of_force(axis, 1e3) for run in runs],
        )
        for axis, title in FORCES
    ]
    about = (
        "Relative time runs from 0 at the start of the replay to 1. Contact pressure is the "
        "mean over the two most pressed surface elements, as in the thesis. The force on the hand "
        "is what both lips do to the neck, in the directions of the head."
    )
    return tag(
        "section",
        tag("h2", "Histories", id="histories"),
        folded(
            "The histories as pictures",
            tag("p", about),
            *([tag("p", said)] if (said := doubt_in_words(runs)) else []),
            _key(runs) if len(runs) > 1 else Markup(),
            tag("div", *pictures, class_="curves"),
        ),
        aria_labelledby="histories",
    )


def doubt_in_words(runs: Sequence[Reported]) -> str:
    """Return what the bands of the figures are; empty if there are none."""
    known = [run for run in runs if run.doubt is not None]
    if not known:
        return ""
    counts = ", ".join(f"{run.doubt.count} for {run.label}" for run in known if run.doubt)
    return (
        f"Bands hold {100 * SHARE:.0f} % of what comes out of motions sampled from the recording's "
        f"standard errors: {counts}."
    )


def _history(
    runs: Sequence[Reported],
    title: str,
    unit: str,
    values: Sequence[Array],
    bands: Sequence[tuple[Array, Array] | None],
) -> Markup:
    peaks = [
        f"{run.label} {'peaks at' if line.any() else 'stays at'} {line[np.abs(line).argmax()]:.3g}"
        for run, line in zip(runs, values, strict=True)
    ]
    picture = curves(
        [
            RunCurve(run.relative_time, line, band)
            for run, line, band in zip(runs, values, bands, strict=True)
        ],
        label=unit,
        shows=f"{title}, {unit}, against relative time: {'; '.join(peaks)}.",
    )
    return tag("figure", tag("figcaption", title), image(picture))


def _key(runs: Sequence[Reported]) -> Markup:
    """Return which line is which run."""
    entries = []
    for index, run in enumerate(runs):
        colour, dashes = line_style(index)
        line = tag(
            "line",
            x1="1", y1="6", x2="43", y2="6", stroke=colour, stroke_width="2.6",
            stroke_dasharray=" ".join(f"{2.6 * length:g}" for length in dashes) or "none",
        )  # fmt: skip
        swatch = tag("svg", line, width="44", height="12", aria_hidden="true")
        entries.append(tag("li", swatch, run.label))
    return tag("ul", *entries, class_="key", aria_label="Lines of the figures")
