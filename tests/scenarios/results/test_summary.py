"""What is summed up of a history: impulses, and seals while liquid is at the rim."""

from __future__ import annotations

import pytest

from scenarios.results.summary import impulses, seal_margins


def row(time_s: float, liquid: float, upper: float, lower: float) -> dict[str, float]:
    return {
        "time_s": time_s,
        "liquid_kpa": liquid,
        "upper_lip_seal_kpa": upper,
        "lower_lip_seal_kpa": lower,
        "upper_lip_force_n": upper,
        "lower_lip_force_n": 2 * lower,
    }


ROWS = (row(0.0, 0.0, 0.0, 0.0), row(0.5, 0.2, 8.0, 5.0), row(1.5, 0.3, 6.0, -1.0))


def test_the_seal_counts_only_while_liquid_is_at_the_rim() -> None:
    assert seal_margins(ROWS) == {"upper_lip_seal_margin_kpa": 6.0, "lower_lip_seal_margin_kpa": -1}
    assert seal_margins(ROWS[:1]) == {}


def test_the_impulse_is_the_time_integral_of_the_force() -> None:
    assert impulses(ROWS) == pytest.approx(
        {"upper_lip_impulse_ns": 2.0 + 7.0, "lower_lip_impulse_ns": 2.5 + 4.0}
    )
