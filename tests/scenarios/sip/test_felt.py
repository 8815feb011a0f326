"""What a lip feels, against closed forms: Hertz, a flat punch, a comb of two Hertz contacts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from scenarios.sip.contact_line import ContactLine
from scenarios.sip.felt import (
    CREST_REACH_MM,
    Felt,
    crest_contrast,
    seal_margin_mpa,
    smoothed_pressure,
)

HALF_LENGTH_MM = 15.0
Profile = Callable[[np.ndarray], np.ndarray]
"""The load on the left of a place, N/mm, as a function of the place, mm."""


def line_of(load_left_of: Profile, cells: int = 6000, *, touched: Profile | None = None):
    """Return a line around the origin, its cells of unequal length, that bears a known load."""
    share = np.linspace(-1.0, 1.0, cells + 1)
    ends = HALF_LENGTH_MM * (share + 0.2 / np.pi * np.sin(np.pi * share))
    load = np.diff(load_left_of(ends))
    middle = 0.5 * (ends[1:] + ends[:-1])
    gap = np.where((load > 0) if touched is None else touched(middle), -1e-3, 1.0)
    return ContactLine(
        load[:, None], np.diff(ends)[:, None], middle[:, None] + HALF_LENGTH_MM, gap[:, None]
    )


def hertz(peak: float, half: float, centre: float = 0.0) -> Profile:
    """p = p₀ √(1 − x²/b²), integrated from the left."""

    def left_of(x: np.ndarray) -> np.ndarray:
        t = np.clip((x - centre) / half, -1.0, 1.0)
        return 0.5 * peak * half * (t * np.sqrt(1 - t**2) + np.arcsin(t) + 0.5 * np.pi)

    return left_of


def hertz_peak(peak: float, half: float, window: float) -> float:
    """Mean of the Hertz pressure over a window around its middle."""
    t = window / (2 * half)
    return peak * (np.sqrt(1 - t**2) + np.arcsin(t) / t) / 2


def punch(force: float, half: float) -> Profile:
    """p = F/(π √(a² − x²)), integrated from the left."""
    return lambda x: force / np.pi * (np.arcsin(np.clip(x / half, -1.0, 1.0)) + 0.5 * np.pi)


def both(*profiles: Profile) -> Profile:
    return lambda x: sum(profile(x) for profile in profiles)


def uniform(pressure: float, half: float) -> Profile:
    return lambda x: pressure * (np.clip(x, -half, half) + half)


def test_a_hertz_contact_has_one_summit_and_its_known_means():
    peak, half = 0.08, 1.4
    line = line_of(hertz(peak, half))
    felt = Felt.of(line)
    assert felt.touched_mm == pytest.approx(2 * half, abs=0.02)
    assert felt.mean_mpa == pytest.approx(np.pi / 4 * peak, rel=0.01)
    assert felt.peak_1mm_mpa == pytest.approx(hertz_peak(peak, half, 1.0), rel=1e-4)
    assert felt.peak_1_5mm_mpa == pytest.approx(hertz_peak(peak, half, 1.5), rel=1e-4)
    assert line.highest_window(0.5) == pytest.approx(hertz_peak(peak, half, 0.5), rel=1e-4)
    assert felt.crest_contrast < 1e-9


def test_the_smoothed_pressure_is_the_mean_around_a_place():
    line = line_of(uniform(0.05, 2.0))
    at = HALF_LENGTH_MM + np.array([0.0, 1.5, 2.0, 2.5, 4.0])
    expected = 0.05 * np.array([1.0, 1.0, 0.5, 0.0, 0.0])
    assert smoothed_pressure(line, 1.0, at) == pytest.approx(expected, abs=2e-4)


def test_a_flat_punch_is_felt_at_its_edges():
    force, half, window = 0.2, 1.6, 1.0
    line = line_of(punch(force, half))
    edge = force / np.pi * (np.pi / 2 - np.arcsin(1 - window / half)) / window
    middle = force / np.pi * 2 * np.arcsin(window / (2 * half)) / window
    felt = Felt.of(line)
    assert felt.mean_mpa == pytest.approx(force / (2 * half), rel=0.01)
    # One cell of 0.005 mm at the edge holds 4 % of the load within a millimetre of it.
    assert felt.peak_1mm_mpa == pytest.approx(edge, rel=5e-3)
    assert felt.crest_contrast == pytest.approx(1 - middle / edge, rel=0.01)


PITCH_MM = 4.233
HALF_MM = 0.9


def comb(first: float, second: float, distance: float = PITCH_MM) -> Profile:
    return both(hertz(first, HALF_MM, -distance / 2), hertz(second, HALF_MM, distance / 2))


def test_two_equal_crests_with_nothing_between_have_full_contrast():
    assert crest_contrast(line_of(comb(0.07, 0.07))) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("share", [0.8, 0.5, 0.1, 0.01])
def test_a_lower_crest_counts_by_its_share_of_the_pressure(share):
    contrast = crest_contrast(line_of(comb(0.07, share * 0.07)))
    assert contrast == pytest.approx(share, rel=2e-3)


@pytest.mark.parametrize("under", [0.02, 0.07, 0.2])
def test_pressure_between_the_crests_takes_contrast_away(under):
    line = line_of(both(comb(0.07, 0.07), uniform(under, 6.0)))
    crest = hertz_peak(0.07, HALF_MM, 1.0)
    assert crest_contrast(line) == pytest.approx(crest / (crest + under), rel=2e-3)


def test_crests_farther_apart_than_threads_are_two_contacts_and_not_a_pattern():
    narrow, wide = CREST_REACH_MM - 0.5, CREST_REACH_MM + 2 * HALF_MM + 1.5
    assert crest_contrast(line_of(comb(0.07, 0.07, narrow))) == pytest.approx(1.0, abs=1e-3)
    assert crest_contrast(line_of(comb(0.07, 0.07, wide))) < 1e-9


def test_contrast_depends_neither_on_the_size_of_the_pressure_nor_on_the_mesh():
    fine = crest_contrast(line_of(comb(0.07, 0.03)))
    assert crest_contrast(line_of(comb(0.7, 0.3))) == pytest.approx(fine, rel=1e-6)
    assert crest_contrast(line_of(comb(0.07, 0.03), cells=300)) == pytest.approx(fine, rel=0.02)


def test_nothing_is_felt_where_nothing_touches():
    felt = Felt.of(line_of(np.zeros_like))
    assert felt == Felt(0.0, 0.0, 0.0, 0.0, 0.0)


def test_the_seal_is_as_tight_as_its_tightest_place():
    peak, half = 0.03, 1.2
    line = line_of(hertz(peak, half))
    assert seal_margin_mpa(line, 0.004) == pytest.approx(
        hertz_peak(peak, half, 0.5) - 0.004, rel=1e-3
    )
    # A liquid that presses more to the right, by 10 kPa/mm, moves the tightest place to the left.
    place = np.cumsum(line.length.ravel()) - 0.5 * line.length.ravel() - HALF_LENGTH_MM
    liquid = 0.01 * place[:, None] + 0.004
    x = np.linspace(-half + 0.25, half - 0.25, 4001)
    left_of = hertz(peak, half)
    means = (left_of(x + 0.25) - left_of(x - 0.25)) / 0.5 - 0.01 * x - 0.004
    assert x[np.argmax(means)] < -0.2
    # Far to the left the straight line would fall below nothing: only the contact is looked at.
    near = np.maximum(liquid, 0.004 - 0.01 * half)
    assert seal_margin_mpa(line, near) == pytest.approx(means.max(), rel=1e-3)


def test_a_seal_without_contact_leaks_with_the_whole_pressure_of_the_liquid():
    nothing = line_of(np.zeros_like)
    assert seal_margin_mpa(nothing, 0.002) == pytest.approx(-0.002, rel=1e-12)
    assert seal_margin_mpa(nothing, 0.0) == 0.0
