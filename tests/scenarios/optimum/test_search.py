"""The search finds known optima, goes on after an interruption, and keeps to what is possible."""

import numpy as np
import pytest

from scenarios.optimum.search import (
    ImpossibleError,
    SearchSpace,
    StudyError,
    TrialResult,
    front,
    searched,
)

BRANIN = SearchSpace({"x": (-5.0, 10.0), "y": (0.0, 15.0)}, 1, seed=1)
BRANIN_LEAST = 0.397887


def branin(values):
    x, y = values["x"], values["y"]
    bowl = (y - 5.1 / (4 * np.pi**2) * x**2 + 5 / np.pi * x - 6) ** 2
    return TrialResult((float(bowl + 10 * (1 - 1 / (8 * np.pi)) * np.cos(x) + 10),), {})


@pytest.mark.slow
def test_branin_s_least_value_is_found(tmp_path):
    best = [
        min(
            trial.evaluation.objectives[0]
            for trial in searched(
                SearchSpace(BRANIN.bounds, 1, seed), branin, trials=80, journal=tmp_path / str(seed)
            )
        )
        for seed in (1, 2, 3)
    ]
    # Its values go from 0.4 to 308.
    assert np.median(best) - BRANIN_LEAST < 0.3


LOADS_N_PER_MM, SUM_MM = (1.0, 3.0), 8.0


def hertz(values):
    """Return the higher pressure of two cylinders, E* = 1 MPa, whose radii have a fixed sum."""
    radii = values["radius_mm"], SUM_MM - values["radius_mm"]
    pairs = zip(LOADS_N_PER_MM, radii, strict=True)
    return TrialResult((float(max(np.sqrt(f / (np.pi * r)) for f, r in pairs)),), {})


def test_the_radius_that_evens_out_two_hertz_contacts_is_found(tmp_path):
    space = SearchSpace({"radius_mm": (0.5, 7.5)}, 1, seed=2)
    trials = searched(space, hertz, trials=40, journal=tmp_path / "journal")
    best = min(trials, key=lambda trial: trial.evaluation.objectives)
    exact = SUM_MM * LOADS_N_PER_MM[0] / sum(LOADS_N_PER_MM)
    assert best.values["radius_mm"] == pytest.approx(exact, abs=0.15)
    assert best.evaluation.objectives[0] == pytest.approx(np.sqrt(1 / (np.pi * exact)), rel=0.02)


def test_an_interrupted_search_goes_on_as_if_it_had_not_been(tmp_path):
    whole = searched(BRANIN, branin, trials=16, journal=tmp_path / "whole")
    count = 0

    def interrupted(values):
        nonlocal count
        count += 1
        if count in (5, 12):
            raise KeyboardInterrupt
        return branin(values)

    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            searched(BRANIN, interrupted, trials=16, journal=tmp_path / "again")
    again = searched(BRANIN, interrupted, trials=16, journal=tmp_path / "again")
    assert again == whole
    assert count == 18


def test_more_trials_add_to_those_that_are_there(tmp_path):
    first = searched(BRANIN, branin, trials=6, journal=tmp_path / "journal")
    told = []
    more = searched(BRANIN, branin, trials=8, journal=tmp_path / "journal", after=told.append)
    assert more[:6] == first
    assert [trial.number for trial in told] == [7, 8]


def test_what_is_impossible_is_not_a_trial(tmp_path):
    def half(values):
        if values["x"] > 2.5:
            raise ImpossibleError("x is too large")
        return branin(values)

    trials = searched(BRANIN, half, trials=12, journal=tmp_path / "journal")
    assert len(trials) == 12
    assert all(trial.values["x"] <= 2.5 for trial in trials)


def test_a_search_of_which_nothing_is_possible_gives_up(tmp_path):
    def never(values):
        raise ImpossibleError("there is no such neck")

    with pytest.raises(StudyError, match=r"50 proposals in a row.*no such neck.*narrow"):
        searched(BRANIN, never, trials=2, journal=tmp_path / "journal")


def test_a_constraint_leads_the_search_to_where_it_holds(tmp_path):
    def bounded(values):
        return TrialResult((values["x"],), {"at least 3": 3.0 - values["x"]})

    trials = searched(BRANIN, bounded, trials=40, journal=tmp_path / "journal")
    (best,) = front(trials)
    assert 3.0 <= best.values["x"] < 3.6


@pytest.mark.slow
def test_the_front_holds_what_nothing_beats(tmp_path):
    def two(values):
        return TrialResult((values["x"] ** 2, (values["x"] - 2.0) ** 2), {})

    space = SearchSpace({"x": (-5.0, 10.0)}, 2, seed=1)
    trials = searched(space, two, trials=60, journal=tmp_path / "journal")
    best = front(trials)
    assert len(best) > 5
    assert all(-0.4 <= trial.values["x"] <= 2.4 for trial in best)
    for one in best:
        first, second = one.evaluation.objectives
        others = [trial.evaluation.objectives for trial in best]
        assert not any(a < first and b < second for a, b in others)
