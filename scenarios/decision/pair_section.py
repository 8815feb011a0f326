"""What a study's page shows of two necks: differences person by person, and every measure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from geometry2d.anatomy.population import Person
from scenarios.campaign.measures import HEADLINE
from scenarios.campaign.study import StudyOutcome
from scenarios.campaign.table import Row
from scenarios.decision.comparison import ALIKE, CONFIDENCE, POWER, PairedDifference
from scenarios.decision.difference_table import difference_table, number_of, runs_of_units
from scenarios.decision.messages import (
    compared_necks,
    is_lower_gentler,
    meaning,
    measure_sentence,
)
from scenarios.decision.parts import Part
from scenarios.results.quantities import LIPS
from scenarios.views.page.hypertext import Markup, joined, tag
from scenarios.views.page.tables import ABSENT, scrolled

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

NAMED_DEVIATIONS = 2
"""Measurements that are told of a person who is an exception."""


def pair_sections(result: StudyOutcome) -> list[Part]:
    """Return a section for each pair of necks: who feels which difference, and every measure."""
    compared = {measure: compared_necks(result.plan, result.rows, measure) for measure in SHOWN}
    sections = []
    for number, pair in enumerate(compared[HEADLINE][:MOST_PAIRS], 1):
        others = [
            other
            for of_measure in compared.values()
            for other in of_measure
            if (other.first, other.second) == (pair.first, pair.second)
        ]
        parts = [
            difference_table(pair, LABELS[HEADLINE], runs_of_units(result.rows, pair)),
            _about_pair(pair, result.plan.people),
            _measures(others),
            _unit_by_unit(others, result.rows),
        ]
        sections.append(Part.of(f"pair-{number}", f"{pair.first} and {pair.second}", *parts))
    return sections


def _unit_by_unit(pairs: Sequence[PairedDifference], rows: Sequence[Row]) -> Markup:
    """Return the same table of every other measure, folded."""
    tables = [
        tag(
            "details",
            tag("summary", LABELS[pair.measure]),
            difference_table(pair, LABELS[pair.measure], runs_of_units(rows, pair)),
        )
        for pair in pairs
        if pair.measure != HEADLINE
    ]
    return tag("details", tag("summary", f"Every {pairs[0].unit}, measure by measure"), *tables)


def _about_pair(pair: PairedDifference, people: Sequence[Person]) -> Markup:
    texts = [
        f"Each row is one {pair.unit}, who meets both necks; the line is the mean, the band its "
        f"{100 * CONFIDENCE:.0f} % interval."
    ]
    if pair.left_out:
        lack = "1 pair of sips lacks" if pair.left_out == 1 else f"{pair.left_out} pairs lack"
        texts.append(f"{lack} one that was replayed to its end.")
    parts = [tag("p", " ".join(texts))]
    if pair.exceptions and pair.is_settled:
        who = {person.name: person for person in people}
        entries = [
            tag("li", f"{name}{f': {unusual(who[name])}' if name in who else ''}")
            for name in pair.exceptions
        ]
        parts += [tag("p", "It is the other way round for"), tag("ul", *entries)]
    return joined(*parts)


def unusual(person: Person) -> str:
    """Return in which measurements a person is farthest from the mean of the same sex."""
    order = sorted(person.deviations, key=lambda name: -abs(person.deviations[name]))
    said = [
        f"{name.removesuffix('_mm').replace('_', ' ')} {person.deviations[name]:+.1f} standard "
        "deviations"
        for name in order[:NAMED_DEVIATIONS]
    ]
    return ", ".join(said).replace("-", "−")


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
        scrolled(f"{first} and {second}, every measure", tag("table", head, body)),
        tag("p", note, class_="quiet"),
    )


def _measure_row(pair: PairedDifference) -> Markup:
    low, high = pair.interval
    chance = pair.chance_lower[0]
    if not is_lower_gentler(pair.measure):
        chance = 1.0 - chance
    interval = f"{number_of(low, pair)} to {number_of(high, pair)}" if np.isfinite(low) else ABSENT
    cells = (
        number_of(float(pair.first_values.mean()), pair),
        number_of(float(pair.second_values.mean()), pair),
        number_of(pair.mean, pair),
        interval,
        ABSENT if pair.count < 2 else f"{chance:.2f}",
        measure_sentence(pair),
    )
    return tag(
        "tr",
        tag("th", LABELS[pair.measure], scope="row", title=meaning(pair.measure)),
        *(tag("td", cell) for cell in cells),
    )
