"""The moving part of a page: controls, sections, imprints and curves that its scripts fill.

Without scripts it stays hidden, and the page is the printed one.
"""

from __future__ import annotations

from collections.abc import Sequence

from scenarios.results.quantities import HISTORY, LIPS
from scenarios.views.page.histories import doubt_in_words
from scenarios.views.page.hypertext import Markup, joined, tag
from scenarios.views.page.moving import shown_fields
from scenarios.views.page.reported import Reported
from scenarios.views.shown import SHOWN

CHARTS = (
    ("upper_lip_window_kpa", "Upper lip, pressure over 0.5 mm"),
    ("lower_lip_window_kpa", "Lower lip, pressure over 0.5 mm"),
    ("dermis_max_log_strain", "Dermis, largest log strain"),
    ("upper_lip_contact_mm", "Upper lip, touched length"),
    ("lower_lip_contact_mm", "Lower lip, touched length"),
    ("dermis_max_mises_kpa", "Dermis, largest von Mises stress"),
    ("upper_lip_force_n", "Upper lip, force on the neck"),
    ("lower_lip_force_n", "Lower lip, force on the neck"),
    ("neck_moment_nmm", "Moment of both lips on the neck"),
)
"""Histories with a curve of their own, and their titles."""

OPEN_CHARTS = 3
"""How many of them are seen before more are asked for."""

assert {name for name, _ in CHARTS} <= {quantity.name for quantity in HISTORY}

SPEEDS = (("1", "as filmed"), ("0.5", "half speed"), ("0.25", "quarter speed"), ("0.1", "a tenth"))
MOST_SIDE_BY_SIDE = 2
HELP = (
    "Click in a section, then drag to move it and turn the wheel to zoom; point for values. By "
    "keyboard: arrows move the cross, Shift and arrows move the view, + and − zoom, 0 shows all. "
    "The arrow at the neck is the force of both lips on the hand; bands beside the skin are "
    "contact pressure. Click a curve or an imprint to go to that instant."
)
DIFFERENCE = (
    "Red where the second run lies above the first, blue below it: between the curves, in the "
    "section and in the imprints, whose places are counted from the rim where necks differ."
)


def explorer(runs: Sequence[Reported], about: str = "") -> Markup:
    """Return the section in which a slider moves everything, hidden until the scripts run.

    ``about`` says which runs these are.
    """
    panes = [_pane(number) for number in range(min(len(runs), MOST_SIDE_BY_SIDE))]
    if len(runs) > 1:
        panes.append(_difference_pane())
    charts = [_chart(name, title) for name, title in CHARTS]
    return tag(
        "section",
        tag("h2", "Move through the sip", id="move"),
        *([tag("p", about)] if about else []),
        _bar(),
        _choices(runs),
        tag(
            "div",
            *(tag("div", class_=f"legend-{name}") for name in ("field", "pressure", "difference")),
            class_="bars",
        ),
        tag("div", *panes, class_="panes"),
        tag("p", HELP, class_="help", id="section-help"),
        tag(
            "div",
            tag("ul", class_="key lines-of-runs", aria_label="Lines of the curves"),
            tag("p", DIFFERENCE, class_="help difference-said"),
            *([tag("p", said, class_="help")] if (said := doubt_in_words(runs)) else []),
            class_="lines",
        ),
        tag("div", *charts[:OPEN_CHARTS], class_="charts"),
        tag(
            "details",
            tag("summary", "More curves"),
            tag("div", *charts[OPEN_CHARTS:], class_="charts"),
        ),
        id="explore",
        aria_labelledby="move",
        hidden="hidden",
    )


def _bar() -> Markup:
    speeds = (tag("option", text, value=value) for value, text in SPEEDS)
    return tag(
        "div",
        tag("button", "Play", class_="play", type="button"),
        tag("input", type="range", class_="time", min="0", value="0", step="1",
            aria_label="Instant of the sip"),
        tag("select", *speeds, class_="speed", aria_label="Speed of playing"),
        tag("p", class_="now", role="status"),
        class_="bar",
    )  # fmt: skip


def _choices(runs: Sequence[Reported]) -> Markup:
    fields = [tag("option", SHOWN[name].title, value=name) for name in shown_fields(runs)]
    fields.append(tag("option", "contact pressure alone", value="contact"))
    parts = [tag("label", "Tissue coloured by", tag("select", *fields, class_="field"))]
    if len(runs) > 1:
        labels = [tag("option", run.label, value=str(number)) for number, run in enumerate(runs)]
        none = tag("option", "none", value="-1")
        parts += [
            tag("label", "First run", tag("select", *labels, class_="chosen")),
            tag("label", "Second run", tag("select", *labels, none, class_="chosen")),
        ]
    zoom = (("zoom-in", "Zoom in"), ("zoom-out", "Zoom out"), ("zoom-all", "Show all"))
    buttons = (tag("button", text, type="button", class_=name) for name, text in zoom)
    return tag("div", *parts, tag("span", *buttons, class_="lines"), class_="choices")


def _canvas(number: str) -> Markup:
    return joined(
        tag("canvas", class_="section", tabindex="0", role="application",
            aria_label=f"Deformed section {number}", aria_describedby="section-help"),
        tag("p", "Point at the section for values.", class_="pointed", role="status"),
    )  # fmt: skip


def _maps(title: str) -> list[Markup]:
    return [
        tag(
            "figure",
            tag("figcaption", f"{title}, {lip} lip"),
            tag("canvas", role="img", aria_label=f"{title} of the {lip} lip"),
            tag("p", class_="values"),
            class_="imprint-map",
            data_lip=lip,
        )
        for lip in LIPS
    ]


def _pane(number: int) -> Markup:
    film = tag(
        "div",
        tag("img", class_="film", alt="The recording at this instant", src=EMPTY_PICTURE),
        tag("p", "the recording at this instant", class_="values"),
        class_="film-place",
    )
    return tag(
        "article",
        tag("h3", f"Run {number + 1}"),
        _canvas(str(number + 1)),
        tag("div", film, tag("div", *_maps("Imprint"), class_="maps"), class_="beside"),
        class_="pane",
    )


def _difference_pane() -> Markup:
    return tag(
        "article",
        tag("h3", "Difference"),
        _canvas("of differences"),
        tag("div", tag("div", *_maps("Difference of imprints"), class_="maps"), class_="beside"),
        class_="pane",
        data_kind="difference",
    )


def _chart(name: str, title: str) -> Markup:
    return tag(
        "figure",
        tag("figcaption", title, " ", tag("span", class_="limit")),
        tag("div", class_="curve", role="img", aria_label=f"{title} against time"),
        tag("p", class_="values"),
        class_="chart",
        data_name=name,
    )


EMPTY_PICTURE = "data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7"
"""One transparent point, until the scripts put the recording's picture in its place."""
