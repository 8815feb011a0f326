"""A sip at quick resolution feels like the same sip on the finest mesh."""

from __future__ import annotations

import pytest

from scenarios.results.increment import Increment
from scenarios.settings.scenario import load_scenario
from scenarios.sip.replay import replay
from scenarios.sip.run import with_known_motion

pytestmark = pytest.mark.slow

THESIS = {
    "upper_lip_window_kpa": 41.06,
    "lower_lip_window_kpa": 54.73,
    "upper_lip_window_1mm_kpa": 37.48,
    "lower_lip_window_1mm_kpa": 33.43,
    "upper_lip_window_1_5mm_kpa": 26.60,
    "lower_lip_window_1_5mm_kpa": 22.28,
    "upper_lip_force_n": 0.03762,
    "lower_lip_force_n": 0.03181,
}
"""Peaks of DC-F at `thesis` resolution."""


def test_felt_peaks_are_within_a_tenth_of_the_finest_mesh() -> None:
    scenario = load_scenario("DC-F", ["numerics.resolution=quick"])
    known = with_known_motion(scenario, lambda share, what: None)
    peaks = dict.fromkeys(THESIS, 0.0)

    def look(increment: Increment) -> None:
        for name in peaks:
            peaks[name] = max(peaks[name], float(increment.history[name]))

    outcome = replay(known, on_increment=look)
    assert outcome.finished
    assert outcome.about["elements"] < 1_000
    assert peaks == pytest.approx(THESIS, rel=0.1)
