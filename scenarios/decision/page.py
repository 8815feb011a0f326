"""study.html: one file, offline, with the answer on top and every number's origin below."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from geometry2d.anatomy.population import NORMS
from geometry2d.foundation.output import file_at_once
from scenarios.campaign.measures import HEADLINE
from scenarios.campaign.plan import Plan
from scenarios.campaign.sip import WHOLE
from scenarios.campaign.study import StudyOutcome
from scenarios.campaign.table import CSV_FILE, PARQUET_FILE, Row
from scenarios.decision.comparison import (
    ALIKE,
    CONFIDENCE,
    POWER,
    PairedDifference,
    factor_columns,
)
from scenarios.decision.figures import (
    differences_figure,
    effects_figure,
    indices_figure,
    people_figure,
)
from scenarios.decision.indices import effects, indices
from scenarios.decision.messages import (
    compared_necks,
    headline,
    is_lower_gentler,
    meaning,
    measure_sentence,
)
from scenarios.results.quantities import LIPS
from scenarios.views.page.embedded import Embedded, data_address, image
from scenarios.views.page.hypertext import Markup, joined, page, tag
from scenarios.views.page.style import STYLE

PAGE_FILE = "study.html"
ABSENT = "–"
WIDTH = "46rem"
"""Of figures, as of text."""

OF_BOTH_LIPS = {
    "window_kpa_peak": "highest pressure, {lip} lip, kPa",
    "window_1_5mm_kpa_peak": "the same over 1.5 mm, {lip} lip, kPa",
    "mean_kpa_mean": "mean pressure, {lip} lip, kPa",
    "contact_mm_mean": "touched length, {lip} lip, mm",
    "crest_contrast_mean": "contrast of crests, {lip} lip",
    "impulse_ns": "impulse, {lip} lip, N s",
    "seal_margin_kpa": "seal, {lip} lip, kPa",
    "force_n_peak": "largest force, {lip} lip, N",
}
LABELS = {
    HEADLINE: "highest pressure, either lip, kPa",
    **{
        f"{lip}_lip_{name}": label.format(lip=lip)
        for name, label in OF_BOTH_LIPS.items()
        for lip in LIPS
    },
    "dermis_max_log_strain_peak": "largest strain of the dermis",
    "dermis_max_mises_kpa_peak": "largest stress of the dermis, kPa",
    "neck_off_film_mm_peak": "neck away from the film, mm",
}
"""What the measures are called that the page compares; the table has all."""

SHOWN = tuple(LABELS)

MOST_PAIRS = 6
"""Pairs of necks that have a section of their own."""


def write_page(result: StudyOutcome, out: Path) -> Path:
    """Write the page of a study into a directory and return its path."""
    plan, rows = result.plan, result.rows
    sections = [
        _answer(result),
        *_pairs(result),
        *_sensitivity(rows),
        *_panel(result),
        _rule(result),
        _failures(result),
        _sips(rows),
        _trust(),
        _repeat(result),
    ]
    title = f"{plan.settings.name}: {', '.join(neck.name for neck in plan.necks)}"
    file = out / PAGE_FILE
    with file_at_once(file) as partial:
        text = page(title, STYLE, joined(_header(result), tag("main", *sections)))
        partial.write_text(text, encoding="utf-8")
    return file


def _header(result: StudyOutcome) -> Markup:
    plan = result.plan
    whole = len(result.rows) - len(result.failed)
    people = f"{len(plan.people)} people" if plan.people else "the filmed person"
    necks = "1 neck" if len(plan.necks) == 1 else f"{len(plan.necks)} necks"
    said = f"{necks}, {people}, {len(result.rows)} sips, {whole} of them replayed to the end"
    return tag(
        "header",
        tag("p", "drinksim study", class_="quiet"),
        tag("h1", plan.settings.name),
        tag("p", said, class_="lead"),
    )


def _section(anchor: str, title: str, *parts: str) -> Markup:
    return tag("section", tag("h2", title, id=anchor), *parts, aria_labelledby=anchor)


def _figure(picture: Embedded) -> Markup:
    return tag("figure", image(picture), style=f"max-width:{WIDTH}")


def _answer(result: StudyOutcome) -> Markup:
    said = headline(result.plan, result.rows)
    parts = [tag("p", tag("strong", said))]
    left = len(result.failed)
    if left:
        parts.append(
            tag(
                "p",
                f"{left} of {len(result.rows)} sips failed and are left out, with those they would "
                "be compared with.",
                class_="warning",
            )
        )
    parts.append(
        tag(
            "p",
            "The model is a plane section of passive lips: its pressures compare openings, "
            "they are not yet a person's.",
            class_="quiet",
        )
    )
    return _section("answer", "In a sentence", *parts)


def _pairs(result: StudyOutcome) -> list[Markup]:
    sections = []
    for number, pair in enumerate(compared_necks(result.plan, result.rows)[:MOST_PAIRS], 1):
        others = [
            other
            for measure in SHOWN
            for other in compared_necks(result.plan, result.rows, measure)
            if (other.first, other.second) == (pair.first, pair.second)
        ]
        parts = [
            _figure(differences_figure(pair, "highest pressure on the lips, kPa")),
            _about_pair(pair),
            _measures(others),
        ]
        title = f"{pair.first} and {pair.second}"
        sections.append(_section(f"pair-{number}", title, *parts))
    return sections


def _about_pair(pair: PairedDifference) -> Markup:
    texts = [
        f"Each point is one {pair.unit}, who meets both necks; the line is the mean, the band its "
        f"{100 * CONFIDENCE:.0f} % interval."
    ]
    if pair.exceptions and pair.is_settled:
        texts.append(f"It is the other way round for {', '.join(pair.exceptions)}.")
    if pair.left_out:
        texts.append(f"{pair.left_out} pairs of sips lack one that was replayed to its end.")
    return tag("p", " ".join(texts))


def _measures(pairs: Sequence[PairedDifference]) -> Markup:
    first, second = pairs[0].first, pairs[0].second
    names = (
        "measure",
        str(first),
        str(second),
        "first − second",
        f"{100 * CONFIDENCE:.0f} % interval",
        f"P({first} gentler)",
        "verdict",
    )
    head = tag("thead", tag("tr", *(tag("th", name, scope="col") for name in names)))
    body = tag("tbody", *(_measure_row(pair) for pair in pairs))
    note = (
        f"P is the chance that {first} is gentler for another {pairs[0].unit}. Settled: the "
        f"interval excludes 0. Alike: it lies within {100 * ALIKE:.0f} % of {second}'s mean. Open: "
        f"so many would settle the difference found, with a chance of {100 * POWER:.0f} %. Each "
        "row is tested alone: of 20 rows without a difference, two would be called settled."
    )
    return joined(
        tag("div", tag("table", head, body), class_="wide", tabindex="0"),
        tag("p", note, class_="quiet"),
    )


def _measure_row(pair: PairedDifference) -> Markup:
    low, high = pair.interval
    chance = pair.chance_lower[0]
    if not is_lower_gentler(pair.measure):
        chance = 1.0 - chance
    interval = f"{_number(low, pair)} to {_number(high, pair)}" if np.isfinite(low) else ABSENT
    cells = (
        _number(float(pair.first_values.mean()), pair),
        _number(float(pair.second_values.mean()), pair),
        _number(pair.mean, pair),
        interval,
        ABSENT if pair.count < 2 else f"{chance:.2f}",
        measure_sentence(pair),
    )
    return tag(
        "tr",
        tag("th", LABELS[pair.measure], scope="row", title=meaning(pair.measure)),
        *(tag("td", cell) for cell in cells),
    )


def _number(value: float, pair: PairedDifference) -> str:
    largest = max(abs(float(pair.first_values.mean())), abs(float(pair.second_values.mean())), 1e-9)
    digits = min(max(2 - int(np.floor(np.log10(largest))), 0), 6)
    return f"{value:.{digits}f}".replace("-", "−")


def _sensitivity(rows: Sequence[Row]) -> list[Markup]:
    label = "highest pressure, kPa"
    found, shares = effects(rows, HEADLINE), indices(rows, HEADLINE)
    parts: list[Markup] = []
    if shares is not None:
        parts += [
            _figure(indices_figure(shares, label)),
            tag(
                "p",
                "Upper points: the share that a setting causes alone; lower points: with all "
                f"others together. {shares.samples} samples, bootstrapped {100 * CONFIDENCE:.0f} % "
                "intervals.",
            ),
        ]
    if found:
        parts += [
            _figure(effects_figure(found, label)),
            tag("p", "What each setting changes, all else being the same, with its interval."),
        ]
    return [_section("sensitivity", "What matters", *parts)] if parts else []


def _panel(result: StudyOutcome) -> list[Markup]:
    people = result.plan.people
    if not people:
        return []
    rejected = [reason for person in people for reason in person.rejected]
    told = (
        f"{len(rejected)} of {len(people) + len(rejected)} draws made no head, and were sampled "
        "anew."
        if rejected
        else "Every draw made a head."
    )
    rows = []
    for name, norm in NORMS.items():
        cells = []
        for sex in ("female", "male"):
            values = [getattr(p.measurements, name) for p in people if p.sex == sex]
            mean, spread = norm.of("female" if sex == "female" else "male")
            sample = (
                f"{np.mean(values):.1f} ± {np.std(values, ddof=1):.1f}"
                if len(values) > 1
                else ABSENT
            )
            cells += [sample, f"{mean:.1f} ± {spread:.1f}"]
        cells.append(norm.source)
        rows.append(tag("tr", tag("th", name, scope="row"), *(tag("td", cell) for cell in cells)))
    names = ("measurement", "women here", "women", "men here", "men", "source")
    table = tag(
        "table",
        tag("thead", tag("tr", *(tag("th", name, scope="col") for name in names))),
        tag("tbody", *rows),
    )
    return [
        _section(
            "people",
            "Who drinks",
            tag("p", f"{told} Measurements of one face go together as in the how-to of studies."),
            _figure(people_figure(people)),
            tag(
                "details",
                tag("summary", "Their measurements beside the population's"),
                tag("div", table, class_="wide", tabindex="0"),
            ),
        )
    ]


def _rule(result: StudyOutcome) -> Markup:
    plan = result.plan
    texts = []
    for film in plan.films:
        meets = film.meeting
        where = (
            f"{film.name}: in the filmed sip the rim's lower edge reaches the lower lip "
            f"{meets.place_mm:.1f} mm from its margin, at {meets.time_s:.2f} s."
        )
        texts.append(where)
    if plan.people and plan.settings.meeting.at == "lower_lip":
        texts.append(
            "Each person meets the neck there on his or her own lower lip: the whole path of the "
            f"neck is shifted, its directions in the head stay. {_shifts(plan)}"
        )
    elif plan.people:
        texts.append("Each person meets the neck where the film has it in the head.")
    mode = plan.films[0].base.hand.mode
    texts.append(
        {
            "force": "From the first touch on, each lip bears the force that it bears in the "
            f"filmed sip{_held(result.rows)}.",
            "same": "The hand bears what it bears in the filmed sip, and yields to more.",
            "recorded": "The neck follows the film, whatever force that takes.",
        }[mode]
    )
    return _section("rule", "How they meet", *(tag("p", text) for text in texts))


def _shifts(plan: Plan) -> str:
    """Return how far the path of the neck is shifted for the people, in words."""
    meeting = plan.films[0].meeting
    placements = [meeting.met_by(person.measurements).placement for person in plan.people]
    filmed = meeting.scenario.placement
    spans = []
    for name, words in (("shift_x_mm", "forward"), ("shift_y_mm", "up")):
        away = [float(getattr(p, name)) - float(getattr(filmed, name)) for p in placements]
        spans.append(f"{min(away):+.1f} to {max(away):+.1f} mm {words}".replace("-", "−"))
    return (
        f"That moves it by {' and '.join(spans)}: so far from their lips' places the people would "
        "meet it where the film has it."
    )


def _held(rows: Sequence[Row]) -> str:
    """Return how well forces were held over the whole sips, in words."""
    parts = []
    for lip in LIPS:
        values = [row[f"{lip}_lip_force_n_peak"] for row in rows if row["status"] == WHOLE]
        if values:
            parts.append(f"{lip} {1e3 * min(values):.1f} to {1e3 * max(values):.1f} mN")
    return (
        f" (largest forces over all sips: {', '.join(parts)}, of a section 1 mm thick)"
        if parts
        else ""
    )


def _failures(result: StudyOutcome) -> Markup:
    if not result.failed:
        return _section("failures", "Failures", tag("p", "None."))
    factors = factor_columns(result.rows)
    entries = [
        tag(
            "li",
            f"{', '.join(str(row.get(name)) for name in factors)}: ",
            f"{row['status']}, {row['reason']} (",
            tag("a", "run", href=str(row["run"])),
            ")",
        )
        for row in result.failed
    ]
    return _section("failures", "Failures", tag("ul", *entries))


def _sips(rows: Sequence[Row]) -> Markup:
    names = [*factor_columns(rows), "status", "seconds", HEADLINE]
    lines = [
        tag(
            "tr",
            *(tag("td", _cell(row.get(name))) for name in names),
            tag("td", tag("a", "run", href=str(row["run"]))),
        )
        for row in rows
    ]
    head = tag("thead", tag("tr", *(tag("th", name, scope="col") for name in (*names, ""))))
    table = tag("div", tag("table", head, tag("tbody", *lines)), class_="wide", tabindex="0")
    return _section("sips", "Every sip", tag("details", tag("summary", "The table"), table))


def _cell(value: object) -> str:
    if value is None:
        return ABSENT
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _trust() -> Markup:
    limits = (
        "An interval holds what differs among people, motions and settings of the study. It does "
        "not hold what the model leaves out: the third dimension, lips that act, other films.",
        "People are sampled from norms of faces, with correlations of a morphable face; nobody was "
        "measured for this study.",
        "Pressure at a coarse mesh is rougher than the table's digits: rank with it, decide with a "
        "finer one.",
    )
    return _section(
        "trust", "How far to trust it", tag("ul", *(tag("li", text) for text in limits))
    )


def _repeat(result: StudyOutcome) -> Markup:
    table = (result.folder / CSV_FILE).read_bytes()
    return _section(
        "repeat",
        "How to repeat it",
        tag(
            "p",
            "All columns: ",
            tag("a", CSV_FILE, href=data_address(table, "text/csv"), download=CSV_FILE),
            f" (in this page), {PARQUET_FILE} beside it. Each sip's directory holds its scenario: ",
            tag("code", "drinksim replay runs/…/scenario.toml --out again"),
            " computes it anew, with all its fields.",
        ),
    )
