"""The table of a report: key numbers of every run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.results.quantities import LIPS
from scenarios.views.page.different_settings import different_settings
from scenarios.views.page.hypertext import Markup, folded, tag
from scenarios.views.page.reported import Reported
from scenarios.views.page.tables import ABSENT, plain_cells, scrolled

MINUS = "−"


KILO = 1000


@dataclass(frozen=True)
class Row:
    """A line of the table: what, its unit, and how a run's value is written."""

    title: str
    unit: str
    value: Callable[[Reported], str]


def _summary_value(
    key: str, pattern: str = "{:.0f}", factor: float = 1.0
) -> Callable[[Reported], str]:
    """Return how a number of summary.json is written, whatever is found there."""

    def written(run: Reported) -> str:
        found: Any = run.solution.summary.get(key)
        if isinstance(found, bool) or not isinstance(found, int | float):
            return ABSENT if found is None else str(found)
        return pattern.format(factor * found).replace("-", MINUS)

    return written


def _energy_share(run: Reported) -> str:
    summary = run.solution.summary
    try:
        kinetic, strain = (
            float(summary[f"largest_{kind}_energy_nmm"]) for kind in ("kinetic", "strain")
        )
        return f"{100 * kinetic / strain:.2g}"
    except (KeyError, TypeError, ValueError, ZeroDivisionError):
        return ABSENT


def _neck_name(run: Reported) -> str:
    package = run.scenario.package
    return package.neck if package.outline is None else Path(package.outline).name


def _skin_name(run: Reported) -> str:
    skin = run.scenario.skin
    return skin.configuration if skin.file is None else Path(skin.file).name


def _largest_force(run: Reported) -> str:
    return f"{1e3 * np.hypot(run.force('x'), run.force('y')).max():.1f}"


def _both_lips(title: str, unit: str, name: str, pattern: str) -> list[Row]:
    return [
        Row(f"{title}, {lip} lip", unit, _summary_value(name.format(lip=lip), pattern))
        for lip in LIPS
    ]


FELT_ROWS: tuple[tuple[str, Sequence[Row]], ...] = (
    (
        "Contact",
        [
            *_both_lips(
                "highest pressure over 0.5 mm of lip", "kPa", "{lip}_lip_window_kpa", "{:.1f}"
            ),
            *_both_lips(
                "highest mean of two surface elements", "kPa", "{lip}_lip_pressure_kpa", "{:.1f}"
            ),
            *_both_lips("longest contact", "mm", "{lip}_lip_contact_mm", "{:.2f}"),
            *_both_lips(
                "highest pressure over 1.5 mm of lip", "kPa", "{lip}_lip_window_1_5mm_kpa", "{:.1f}"
            ),
            *_both_lips(
                "highest mean pressure where touched", "kPa", "{lip}_lip_mean_kpa", "{:.1f}"
            ),
            *_both_lips(
                "how much crests stand out, 0 to 1", "", "{lip}_lip_crest_contrast", "{:.2f}"
            ),
            *_both_lips("impulse", "N s", "{lip}_lip_impulse_ns", "{:.3f}"),
            Row("most pressed, upper wall", "", lambda run: run.most_pressed("upper")),
            Row("most pressed, lower wall", "", lambda run: run.most_pressed("lower")),
            Row("contact lasts", "s", lambda run: f"{run.touched_s:.2f}"),
            Row("largest force on the hand, per mm of width", "mN/mm", _largest_force),
        ],
    ),
    (
        "Dermis",
        [
            Row("smallest log strain", "", _summary_value("dermis_min_log_strain", "{:.3f}")),
            Row("largest log strain", "", _summary_value("dermis_max_log_strain", "{:.3f}")),
            Row(
                "largest von Mises stress", "kPa", _summary_value("dermis_max_mises_kpa", "{:.1f}")
            ),
        ],
    ),
)
"""What decides, by group."""

COMPUTED_ROWS: tuple[tuple[str, Sequence[Row]], ...] = (
    (
        "Model",
        [
            Row("neck", "", _neck_name),
            Row("skin", "", _skin_name),
            Row("friction on the package", "", lambda run: f"{run.scenario.contact.friction:g}"),
            Row("plane", "", lambda run: run.scenario.numerics.plane),
            Row("resolution", "", lambda run: run.scenario.numerics.resolution),
            Row("thickness", "mm", lambda run: f"{run.scenario.numerics.thickness_mm:g}"),
            Row("elements", "", _summary_value("elements", "{:,.0f}")),
            Row("nodes", "", _summary_value("nodes", "{:,.0f}")),
        ],
    ),
    (
        "Solver",
        [
            Row("increments", "", _summary_value("increments")),
            Row("Newton iterations", "", _summary_value("newton_iterations")),
            Row("cutbacks", "", _summary_value("cutbacks")),
            Row(
                "deepest penetration, neck",
                "µm",
                _summary_value("largest_penetration_neck_mm", "{:.1f}", KILO),
            ),
            Row(
                "deepest penetration, teeth",
                "µm",
                _summary_value("largest_penetration_teeth_mm", "{:.1f}", KILO),
            ),
            Row(
                "deepest penetration between nodes",
                "µm",
                _summary_value("largest_penetration_between_nodes_mm", "{:.1f}", KILO),
            ),
            Row(
                "deepest penetration, lips into each other or themselves",
                "µm",
                _summary_value("largest_penetration_lips_mm", "{:.1f}", KILO),
            ),
            Row(
                "largest unbalanced force, share of all forces",
                "",
                _summary_value("largest_unbalanced_force_share", "{:.1e}"),
            ),
            Row("largest kinetic over largest strain energy", "%", _energy_share),
            Row("time it took", "s", _summary_value("wall_s")),
            Row("drinksim", "", _summary_value("version")),
        ],
    ),
)


def key_numbers(runs: Sequence[Reported]) -> Markup:
    """Return the table of key numbers, and that of settings that differ between the runs."""
    about = (
        "Extremes over the whole sip. The mean of two surface elements is the thesis' measure; it "
        "depends on their size, the mean over 0.5 mm is made not to."
    )
    if len(runs) > 1:
        about += f" In brackets: the difference from {runs[0].label}."
    computed = _table("Model and solver", COMPUTED_ROWS, runs, plain_cells)
    return tag(
        "section",
        tag("h2", "Key numbers", id="numbers"),
        tag("p", about, class_="quiet"),
        _table("Key numbers", FELT_ROWS, runs, _compared_cells),
        different_settings(runs) if len(runs) > 1 else Markup(),
        folded("Model and solver", computed),
        aria_labelledby="numbers",
    )


def _table(
    title: str,
    groups: Sequence[tuple[str, Sequence[Row]]],
    runs: Sequence[Reported],
    cells: Callable[[Sequence[str]], list[Markup]],
) -> Markup:
    """Return a table with a column for each run, which scrolls where it is too wide."""
    head = tag(
        "tr",
        tag("th", "quantity", scope="col"),
        tag("th", "unit", scope="col", class_="unit"),
        *(tag("th", run.label, scope="col") for run in runs),
    )
    bodies = []
    for name, rows in groups:
        lines = [tag("tr", tag("th", name, scope="rowgroup", colspan=str(2 + len(runs))))]
        lines += [
            tag(
                "tr",
                tag("th", row.title, scope="row"),
                tag("td", row.unit, class_="unit"),
                *cells([row.value(run) for run in runs]),
            )
            for row in rows
        ]
        bodies.append(tag("tbody", *lines))
    return scrolled(title, tag("table", tag("thead", head), *bodies))


def _compared_cells(values: Sequence[str]) -> list[Markup]:
    """Return the cells of a row: each value, and behind it how far it is from the first run's."""
    cells = [tag("td", values[0])]
    for value in values[1:]:
        apart = _difference(values[0], value)
        cells.append(tag("td", value, *([tag("small", f" ({apart})")] if apart else [])))
    return cells


def _difference(first: str, second: str) -> str:
    """Return the difference of two written numbers, to their digits; empty if one is none.

    >>> _difference("69.4", "57.9"), _difference("−0.44", "−0.33"), _difference("rim", "1")
    ('−11.5', '+0.11', '')
    """
    try:
        one, other = (float(text.replace(MINUS, "-")) for text in (first, second))
    except ValueError:
        return ""
    decimals = max(len(text.partition(".")[2]) for text in (first, second))
    return f"{other - one:+.{decimals}f}".replace("-", MINUS)
