"""Paired differences, their intervals and what they settle, against known truths."""

import numpy as np
import pytest
from scipy import stats

from scenarios.decision.comparison import CONFIDENCE, paired

MEASURE = "lips_window_kpa_peak"
TRUTH = -4.0


def rows_of(first, second, *, necks=("A", "B"), status="whole"):
    """Return the rows of two necks for as many people as there are values."""
    return [
        {"neck": neck, "person": f"P{k:02d}", "status": status, "reason": "", MEASURE: float(value)}
        for neck, values in zip(necks, (first, second), strict=True)
        for k, value in enumerate(values)
    ]


def test_a_difference_is_that_of_a_paired_t_test():
    random = np.random.default_rng(3)
    second = random.normal(60.0, 15.0, 12)
    first = second + random.normal(TRUTH, 5.0, 12)
    pair = paired(rows_of(first, second), "neck", "A", "B", MEASURE)
    known = stats.ttest_rel(first, second)
    interval = known.confidence_interval(CONFIDENCE)
    assert pair.interval == pytest.approx((interval.low, interval.high))
    assert pair.mean == pytest.approx(np.mean(first - second))
    assert pair.is_settled == (known.pvalue < 1 - CONFIDENCE)


@pytest.mark.parametrize("noise", ["normal", "skewed", "uniform"])
def test_the_interval_covers_the_truth_as_often_as_it_says(noise):
    """200 studies of 12 people whose differences are not all normal."""
    random = np.random.default_rng(11)
    draw = {
        "normal": lambda: random.normal(0.0, 6.0, 12),
        "skewed": lambda: 6.0 * (random.gamma(4.0, 0.5, 12) - 2.0),
        "uniform": lambda: random.uniform(-9.0, 9.0, 12),
    }[noise]
    covered = 0
    for _ in range(200):
        second = random.normal(60.0, 15.0, 12)
        pair = paired(rows_of(second + TRUTH + draw(), second), "neck", "A", "B", MEASURE)
        low, high = pair.interval
        covered += low <= TRUTH <= high
    assert 0.85 <= covered / 200 <= 0.95


@pytest.mark.slow
def test_a_difference_is_settled_as_often_as_the_size_of_the_study_promises():
    random = np.random.default_rng(5)
    spread, truth = 6.0, -4.0
    pilot = np.array([truth - spread, truth, truth + spread]) * 1.0
    pair = paired(rows_of(pilot, np.zeros(3)), "neck", "A", "B", MEASURE)
    assert pair.spread == pytest.approx(spread)
    settled = 0
    for _ in range(300):
        again = random.normal(truth, spread, pair.needed)
        settled += paired(
            rows_of(again, np.zeros(pair.needed)), "neck", "A", "B", MEASURE
        ).is_settled
    assert 0.72 <= settled / 300 <= 0.88


def test_people_are_the_sample_and_not_their_sips():
    """Four sips of each person that differ in a setting only do not make the interval narrower."""
    random = np.random.default_rng(1)
    own = random.normal(TRUTH, 6.0, 8)
    once = [
        {
            "neck": neck,
            "person": k,
            "status": "whole",
            MEASURE: 60.0 + (own[k] if neck == "A" else 0),
        }
        for neck in "AB"
        for k in range(8)
    ]
    often = [
        {"neck": r["neck"], "person": r["person"], "contact.friction": mu, "status": "whole",
         MEASURE: r[MEASURE] + 10 * mu}
        for r in once
        for mu in (0.25, 0.5, 0.75, 1.0)
    ]  # fmt: skip
    narrow, wide = (paired(rows, "neck", "A", "B", MEASURE) for rows in (often, once))
    assert narrow.count == wide.count == 8
    assert narrow.interval == pytest.approx(wide.interval)


def test_a_failed_sip_is_left_out_with_its_partner():
    rows = rows_of([50.0, 52.0, 54.0], [60.0, 60.0, 60.0])
    rows[0]["status"] = "stopped"
    pair = paired(rows, "neck", "A", "B", MEASURE)
    assert pair.units == ("P01", "P02")
    assert pair.left_out == 1
    assert pair.mean == pytest.approx(-7.0)


def test_without_a_pair_there_is_no_difference():
    with pytest.raises(ValueError, match="no sip was replayed"):
        paired(rows_of([1.0], [2.0], status="stopped"), "neck", "A", "B", MEASURE)


def test_the_chance_for_another_person_is_a_binomial_posterior():
    pair = paired(rows_of(range(10), [4.5] * 10), "neck", "A", "B", MEASURE)
    chance, low, high = pair.chance_lower
    assert pair.lower == 5
    assert chance == pytest.approx(0.5)
    assert low < 0.5 < high
    assert stats.beta.cdf(high, 5.5, 5.5) - stats.beta.cdf(low, 5.5, 5.5) == pytest.approx(0.9)


def test_exceptions_are_those_with_the_other_sign():
    pair = paired(rows_of([50.0, 51.0, 65.0], [60.0] * 3), "neck", "A", "B", MEASURE)
    assert pair.exceptions == ("P02",)


def test_alike_is_within_five_percent():
    random = np.random.default_rng(2)
    second = random.normal(60.0, 5.0, 24)
    pair = paired(rows_of(second + random.normal(0, 1, 24), second), "neck", "A", "B", MEASURE)
    assert pair.is_alike
    assert not paired(rows_of(second * 1.1, second), "neck", "A", "B", MEASURE).is_alike


def test_a_single_person_settles_nothing():
    pair = paired(rows_of([50.0], [60.0]), "neck", "A", "B", MEASURE)
    assert pair.interval == (-np.inf, np.inf)
    assert not pair.is_settled
    assert pair.needed is None
