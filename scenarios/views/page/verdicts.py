"""The first section of a report: what was found about each run, in a sentence and on two gauges."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from scenarios.messages.lines import acting_message, felt_message, verdict_message
from scenarios.messages.verdict import FAILURE, PAIN, Threshold
from scenarios.views.page.hypertext import Markup, folded, tag
from scenarios.views.page.reported import Reported

SPELLED_OUT = 2
"""Of so many runs it is said at once what the gauges mean; of more it is folded."""


def verdicts(runs: Sequence[Reported]) -> Markup:
    """Return what was found about each run, in sentences and on gauges."""
    cards, many = [], len(runs) > SPELLED_OUT
    for run in runs:
        words = [
            tag("p", verdict_message(run.verdict)),
            tag("p", felt_message(run.solution.summary)),
            tag("p", acting_message(run.solution.summary), class_="quiet"),
        ]
        parts = [tag("h3", run.label), *([folded("In words", *words)] if many else words)]
        if not run.solution.summary["finished"]:
            how = f"The run is not complete: {run.solution.summary['sentence']}"
            until = (
                f"Numbers are those until {run.solution.time_s[-1]:.2f} s; what presses most may "
                "come later."
            )
            parts[1:1] = [tag("p", text, class_="warning") for text in (how, until)]
        parts += [
            _gauge("contact pressure", run.verdict.pressure_kpa, PAIN, 600.0, "pain begins"),
            _gauge("largest log strain", run.verdict.log_strain, FAILURE, 0.6, "skin tears"),
        ]
        cards.append(tag("article", *parts, class_="verdict"))
    limits = (
        "The model is a plane section of lips; its pressures compare openings, they are "
        f"not yet a person's. Pain: {PAIN.measured} ({PAIN.source}); lips may feel it "
        f"earlier. Tearing: {FAILURE.measured} "
        f"({FAILURE.source})."
    )
    return tag(
        "section",
        tag("h2", "In a sentence", id="sentence"),
        tag("div", *cards, class_="verdicts many" if many else "verdicts"),
        tag("p", limits, class_="quiet"),
        aria_labelledby="sentence",
    )


def _gauge(title: str, value: float, threshold: Threshold, end: float, meaning: str) -> Markup:
    """Return a bar from 0 to ``end`` with the value on it, and where the threshold begins."""

    def number(x: float) -> str:
        return f"{x:.0f} {threshold.unit}" if threshold.unit else f"{x:.2f}"

    low, high = 100 * threshold.low / end, 100 * threshold.high / end
    beyond = 100.0 if threshold.low == threshold.high else high
    label = f"{title} {number(value)}; {meaning} at {number(threshold.low)}"
    return tag(
        "div",
        tag(
            "div",
            tag("span", title, " ", tag("strong", number(value))),
            tag("span", f"{meaning}: {_range(threshold, number)}", class_="quiet"),
            class_="title",
        ),
        tag(
            "div",
            tag("span", class_="range", style=f"left:{low:.1f}%;width:{beyond - low:.1f}%"),
            tag("span", class_="value", style=f"width:{min(100 * value / end, 100.0):.1f}%"),
            class_="track",
            role="img",
            aria_label=label,
        ),
        class_="gauge",
    )


def _range(threshold: Threshold, number: Callable[[float], str]) -> str:
    if threshold.low == threshold.high:
        return number(threshold.low)
    return f"{threshold.low:.0f}–{number(threshold.high)}"
