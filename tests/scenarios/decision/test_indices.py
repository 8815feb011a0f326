"""Sensitivities through the same engine as sips, against formulas."""

import numpy as np
import pytest
from scipy import stats

from scenarios.campaign.engine import InProcess
from scenarios.campaign.study import carried_out
from scenarios.decision.indices import effects, indices
from tests.support.made_up_study import ishigami, ishigami_indices, ishigami_plan

MEASURE = "lips_window_kpa_peak"


def quiet(share, text):
    pass


def studied(tmp_path, samples, seed):
    plan = ishigami_plan(samples, seed)
    result = carried_out(plan, tmp_path, InProcess(), solver=ishigami, progress=quiet)
    assert len(result.rows) == samples * 5
    return result.rows


def test_ishigami_s_indices_are_the_exact_ones(tmp_path):
    found = indices(studied(tmp_path, 1024, 1), MEASURE)
    first, total = ishigami_indices()
    assert found.settings == ("x1", "x2", "x3")
    assert found.first == pytest.approx(first, abs=0.03)
    assert found.total == pytest.approx(total, abs=0.03)


@pytest.mark.slow
def test_their_intervals_hold_the_exact_ones_about_as_often_as_they_say(tmp_path):
    exact = np.array(ishigami_indices())
    held = []
    for seed in range(12):
        found = indices(studied(tmp_path / str(seed), 128, seed), MEASURE, seed=seed)
        for value, interval in zip(
            exact, (found.first_interval, found.total_interval), strict=True
        ):
            held += list((interval[:, 0] <= value) & (value <= interval[:, 1]))
    assert 0.8 <= np.mean(held) <= 1.0


def test_estimates_are_those_of_scipy(tmp_path):
    rows = studied(tmp_path, 64, 1)
    values = np.array([row[MEASURE] for row in rows]).reshape(5, 64)
    known = stats.sobol_indices(
        func={"f_A": values[:1], "f_B": values[1:2], "f_AB": values[2:, None]}, n=64
    )
    found = indices(rows, MEASURE)
    assert found.first == pytest.approx(known.first_order)
    assert found.total == pytest.approx(known.total_order)


def test_samples_that_failed_are_left_out(tmp_path):
    rows = [dict(row) for row in studied(tmp_path, 64, 1)]
    rows[3]["status"] = "stopped"
    assert indices(rows, MEASURE).samples == 63


def test_a_study_without_such_samples_has_no_indices():
    assert indices([{"neck": "A", "status": "whole", MEASURE: 1.0}], MEASURE) is None


def grid(slopes):
    rows = []
    for neck in "AB":
        for person in range(6):
            for a in (0.0, 1.0, 2.0):
                for b in (10.0, 20.0):
                    value = 60 + person + slopes[0] * a + slopes[1] * b
                    rows.append({"neck": neck, "person": f"P{person}", "s.a": a, "s.b": b,
                                 "status": "whole", "reason": "", MEASURE: value})  # fmt: skip
    return rows


def test_effects_in_a_grid_are_exact_and_ranked():
    found = effects(grid((3.0, -1.0)), MEASURE)
    assert [effect.setting for effect in found] == ["s.b", "s.a"]
    assert found[0].change == pytest.approx(-10.0)
    assert (found[1].from_value, found[1].to_value) == (0.0, 2.0)
    assert found[1].change == pytest.approx(6.0)
    assert found[1].interval == pytest.approx((6.0, 6.0))


def test_effects_among_samples_are_those_of_a_linear_truth_within_their_intervals():
    random = np.random.default_rng(4)
    held = 0
    for _ in range(60):
        x = random.uniform(0.0, 1.0, (40, 2))
        noise = random.normal(0.0, 2.0, 40)
        rows = [
            {"neck": "A", "person": "filmed", "sample": k, "s.a": a, "s.b": b, "status": "whole",
             "reason": "", MEASURE: 60 + 8 * a - 3 * b + noise[k]}
            for k, (a, b) in enumerate(x.tolist())
        ]  # fmt: skip
        for effect in effects(rows, MEASURE):
            slope = 8.0 if effect.setting == "s.a" else -3.0
            truth = slope * (effect.to_value - effect.from_value)
            held += effect.interval[0] <= truth <= effect.interval[1]
    assert 0.82 <= held / 120 <= 0.97
