"""What a study says, in sentences that are true."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from geometry2d.foundation.text import counted
from scenarios.campaign.measures import HEADLINE, described
from scenarios.campaign.plan import Plan
from scenarios.campaign.table import Row
from scenarios.decision.comparison import CONFIDENCE, PairedDifference, paired

FEW_TO_SAY_SOMETHING = 3

MORE_IS_GENTLER = ("contact_mm_peak", "contact_mm_mean", "seal_margin_kpa")
"""How the names of measures end that are the better the higher they are."""

HANDS = {
    "force": "at equal force of each lip",
    "same": "in the same hand",
    "recorded": "where the film has it",
}


def is_lower_gentler(measure: str) -> bool:
    """Whether a lower value of a measure is gentler."""
    return not measure.endswith(MORE_IS_GENTLER)


def compared_necks(
    plan: Plan, rows: Sequence[Row], measure: str = HEADLINE
) -> list[PairedDifference]:
    """Return the differences between all pairs of necks that were computed with one another."""
    found = []
    for first, second in combinations([neck.name for neck in plan.necks], 2):
        try:
            found.append(paired(rows, "neck", first, second, measure))
        except ValueError:
            continue
    return found


def headline(plan: Plan, rows: Sequence[Row]) -> str:
    """Return what the study says about its necks, in a few sentences."""
    whole = [row for row in rows if row["status"] == "whole"]
    if not whole:
        return "No sip was replayed to its end: see the failures."
    hand = HANDS[plan.films[0].base.hand.mode]
    if len(plan.necks) == 1:
        return _of_one_neck(plan, whole, hand)
    pairs = compared_necks(plan, rows)
    if not pairs:
        return "No two necks were replayed to the end by the same person: see the failures."
    if len(plan.necks) == 2:
        return f"{hand[0].upper()}{hand[1:]}, {pair_sentence(pairs[0])}"
    return f"{hand[0].upper()}{hand[1:]}, {_ranking(plan, pairs)}"


def _of_one_neck(plan: Plan, whole: Sequence[Row], hand: str) -> str:
    values = np.array([row[HEADLINE] for row in whole], float)
    low, high = np.quantile(values, [0.05, 0.95])
    sips = counted(values.size, "sip", "sips")
    return (
        f"{hand[0].upper()}{hand[1:]}, {plan.necks[0].name} presses the lips with "
        f"{values.mean():.0f} kPa at most on average over {sips} (9 of 10: {low:.0f} to "
        f"{high:.0f} kPa)."
    )


def pair_sentence(pair: PairedDifference) -> str:
    """Return what a paired difference of the highest pressure says."""
    low, high = sorted(map(abs, pair.interval))
    unit, amount = _units(pair), abs(pair.mean)
    less, more = (pair.first, pair.second) if pair.mean < 0 else (pair.second, pair.first)
    if pair.count < FEW_TO_SAY_SOMETHING:
        return (
            f"{less} presses less than {more} for the {unit} compared, by {amount:.0f} kPa; "
            "that is too few to say it of others."
        )
    interval = f"{100 * CONFIDENCE:.0f} % interval"
    if pair.is_settled:
        usual = pair.second_values if less == pair.first else pair.first_values
        for_whom = pair.lower if pair.mean < 0 else int(np.sum(pair.differences > 0))
        return (
            f"{less} is gentler than {more}: the highest pressure on the lips is {amount:.0f} kPa "
            f"({100 * amount / float(usual.mean()):.0f} %) lower on average over {unit} "
            f"({interval} {low:.0f} to {high:.0f} kPa), and lower for "
            f"{for_whom} of the {pair.count}."
        )
    spoken = f"{pair.interval[0]:+.0f} to {pair.interval[1]:+.0f} kPa".replace("-", "−")
    if pair.is_alike:
        return (
            f"{pair.first} and {pair.second} press alike: over {unit} the mean difference lies "
            f"within 5 % ({interval} {spoken})."
        )
    wanted = pair.needed
    more_needed = (
        f"about {wanted} would, if the difference is as found"
        if wanted is not None
        else "no study of a sensible size would, if the difference is as found"
    )
    return (
        f"{unit} do not settle whether {pair.first} or {pair.second} presses less: the mean "
        f"difference is {amount:.0f} kPa in favour of {less} ({interval} {spoken}); {more_needed}."
    )


def _units(pair: PairedDifference) -> str:
    names = {"person": ("person", "people"), "draw": ("draw", "draws"), "sip": ("sip", "sips")}
    return counted(pair.count, *names[pair.unit])


def _ranking(plan: Plan, pairs: Sequence[PairedDifference]) -> str:
    """Return which of several necks is gentlest, and against which that is settled."""
    sums: dict[str, list[float]] = {neck.name: [] for neck in plan.necks}
    for pair in pairs:
        sums[pair.first].append(pair.mean)
        sums[pair.second].append(-pair.mean)
    order = sorted((n for n in sums if sums[n]), key=lambda name: float(np.mean(sums[name])))
    best = order[0]
    against = {
        (pair.second if pair.first == best else pair.first): pair
        for pair in pairs
        if best in (pair.first, pair.second)
    }
    settled = [name for name in order if name in against and against[name].is_settled]
    open_still = [name for name in order if name in against and not against[name].is_settled]
    text = f"{best} is the gentlest of {len(order)} necks by the highest pressure on the lips"
    if settled:
        bounds = ", ".join(f"{abs(against[name].mean):.0f} kPa below {name}" for name in settled)
        text += f": {bounds} on average over {_units(against[settled[0]])}"
    if open_still:
        text += f"; it is not settled against {', '.join(open_still)}"
    return f"{text}."


def measure_sentence(pair: PairedDifference) -> str:
    """Return whether a difference of any measure is settled, and how many units would settle it."""
    if pair.count < FEW_TO_SAY_SOMETHING:
        return f"only {_units(pair)}"
    if pair.is_settled:
        gentler = (pair.mean < 0) == is_lower_gentler(pair.measure)
        return f"settled: {pair.first if gentler else pair.second}"
    if pair.is_alike:
        return "alike to 5 %"
    return "open" if pair.needed is None else f"open: about {pair.needed} would settle it"


def meaning(measure: str) -> str:
    """Return what a measure is, with its unit."""
    quantity = described(measure)
    return f"{quantity.meaning}, {quantity.unit}" if quantity.unit else quantity.meaning
