"""The activation that is found explains what was seen, nothing smaller does, or why none does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fem2d.loads.amplitude import Amplitude
from fem2d.loads.load import Load
from fem2d.solvers.static import solve_static
from scenarios.messages.lines import activations_message
from scenarios.recordings.script import script_of
from scenarios.settings.muscles import Muscles, Seen
from scenarios.settings.scenario import ScenarioError, load_scenario
from scenarios.settings.searches import ActivationSearch
from scenarios.sip.activation import (
    ActivationTrial,
    FoundActivation,
    find_activations,
    read_activations,
    write_activations,
)
from scenarios.sip.clearance import MovingNeck, PathClearance
from scenarios.sip.lip_model import Lips, without_neck
from scenarios.sip.replay import prepared
from tests.support.approach import approach

HELD = ("muscle=false", "muscles.time_s=[0.3, 0.9, 2.7, 3.5]")
LEVATOR = (*HELD, 'muscles.levator=[0.0, "auto", "auto", 0.0]')


def trial(beyond, **search) -> ActivationTrial:
    seen = Seen(clearance_mm=0.5)
    return ActivationTrial("levator", "clears", seen, beyond, ActivationSearch(**search))


@pytest.mark.parametrize("root", [0.004, 0.2, 0.96])
def test_the_least_activation_is_found_to_the_tolerance(root):
    found = trial(lambda activation: 3.0 * (activation - root), tolerance=0.001).least()
    assert root <= found.activation <= root + 0.001
    assert found.beyond_at_rest == pytest.approx(-3.0 * root)
    assert found.band == (found.activation, pytest.approx(min(2 * found.activation, 1.0)))


def test_a_lip_that_touches_at_once_and_for_good_is_bisected_too():
    found = trial(lambda activation: 0.003 if activation >= 0.3 else -1.0, tolerance=0.001).least()
    assert 0.3 <= found.activation <= 0.301


def test_what_a_passive_lip_does_needs_no_muscle():
    calls = []
    found = trial(lambda activation: calls.append(activation) or 0.2).least()
    assert (found.activation, calls) == (0.0, [0.0])
    assert "none, as the passive lip does" in activations_message({"levator": found.about()})


def test_what_no_activation_explains_is_refused_with_numbers():
    with pytest.raises(ScenarioError) as refused:
        trial(lambda activation: -2.0 + activation * (1.0 - activation), most=0.81).least()
    text = str(refused.value)
    assert "no activation of levator up to 0.81 keeps the upper lip 0.5 mm clear" in text
    assert "with 0.52, it falls short by 1.75 mm (2.00 mm at rest)" in text


def test_where_no_equilibrium_is_found_others_still_count():
    def beyond(activation: float) -> float:
        return math.nan if 0.3 < activation < 0.5 else activation - 0.6

    assert trial(beyond).least().activation == pytest.approx(0.6, abs=0.003)


def lips_of(*settings: str) -> Lips:
    scenario = load_scenario("DC-AE", ["numerics.resolution=coarse", *settings])
    return Lips(scenario, script_of("DC-AE").face(), scenario.package.section())


def moved_down(mm: float):
    motion = script_of("DC-AE").neck_motion()
    return replace(motion, shift_mm=motion.shift_mm - [0.0, mm])


@pytest.mark.slow
def test_the_levator_that_is_found_clears_the_neck_and_less_does_not():
    lips, motion = lips_of(*LEVATOR), moved_down(4.0)
    (found,) = find_activations(lips, motion, 0.3)
    assert found.muscle == "levator"
    assert 0.05 < found.activation < 1.0
    assert 0.0 <= found.beyond < 0.1
    for share, clears in ((1.0, True), (0.9, False)):
        given = share * found.activation
        assert (clearance_of(lips, motion, given) >= 0.499) is clears


def clearance_of(lips: Lips, motion, activation: float) -> float:
    """Clearance of the upper lip, solved in one go with a levator of its own."""
    rising = {"levator": Amplitude((0.0, 1.0), (0.0, activation))}
    alone = replace(lips, present=("upper",), activations=rising)
    result = solve_static(without_neck(alone.quasi_static), Load(time_s=1.0))
    assert result.converged
    path = [motion.at(float(time)) for time in np.linspace(0.9, 2.7, 300)]
    skin = alone.free_surface("upper")
    return PathClearance.of(skin, MovingNeck.of(alone.neck, path), 10.0)(result.displacement)


@pytest.mark.slow
def test_a_levator_that_cannot_clear_the_neck_is_refused():
    """The neck of the recording is 4.9 mm too high for a lip that is only drawn to the orbit."""
    lips = lips_of(*LEVATOR)
    with pytest.raises(ScenarioError, match=r"no activation of levator up to 1\.00 keeps"):
        find_activations(lips, script_of("DC-AE").neck_motion(), 0.3)


@pytest.mark.slow
def test_a_levator_along_the_maxilla_lets_the_neck_of_the_recording_in():
    touching = ["numerics.resolution=coarse", "muscles.seen.clearance_mm=0.0"]
    scenario = load_scenario("DC-AE-acting", touching)
    lips = Lips(scenario, script_of("DC-AE").face(), scenario.package.section())
    (found,) = find_activations(lips, script_of("DC-AE").neck_motion(), 0.6)
    assert found.muscle == "levator"
    assert found.beyond_at_rest < -2.0
    assert 0.3 < found.activation < 1.0


@pytest.mark.slow
def test_the_depressor_that_is_found_lets_the_lip_reach_the_lowest_thread():
    scenario = load_scenario(
        "A38-F",
        [
            "numerics.resolution=coarse",
            "muscles.depressor=auto",
            "muscles.seen.lower_reach_mm=8.5",
            "muscles.seen.reach_time_s=1.5",
            "numerics.activation_search.tolerance=0.01",
        ],
    )
    lips = Lips(scenario, script_of("A38-F").face(), scenario.package.section())
    (found,) = find_activations(lips, script_of("A38-F").neck_motion(), 0.8)
    assert found.muscle == "depressor"
    assert found.beyond_at_rest < 0.0 <= found.beyond
    assert 0.0 < found.activation < 0.1
    assert "at 1.5 s" in found.fixed_by


def test_without_muscles_nothing_is_searched():
    assert find_activations(lips_of(), moved_down(0.0), 0.3) == ()


def test_the_message_says_what_was_found_and_by_what():
    found = FoundActivation("depressor", 0.03, "lets the lower lip bear", 0.001, -0.4, "mm")
    assert activations_message({"depressor": found.about()}) == (
        "activations found: depressor 0.030, the least that lets the lower lip bear (up to 0.060 "
        "would not contradict it)"
    )
    assert Muscles().automatic == ()


def test_what_was_found_is_read_back_bit_for_bit(tmp_path):
    found = (FoundActivation("depressor", 0.1 + 0.2, "lets it bear", 1e-17, -1 / 3, "mm"),)
    file = tmp_path / "activations.json"
    assert read_activations(file) is None
    write_activations(file, found)
    assert read_activations(file) == found


@pytest.mark.slow
def test_another_neck_does_not_change_what_was_seen_with_the_filmed_one():
    filmed = load_scenario("A38-F", ["numerics.resolution=coarse"]).with_(
        motion=approach(), muscles={"time_s": [0.8, 1.2], "depressor": ["auto", "auto"]}
    )
    ready = prepared(filmed)
    (found,) = ready.activations
    assert 0.0 < found.activation < 0.5
    other = prepared(filmed.with_(package={"thread_diameter_mm": 40.0, "root_diameter_mm": 36.0}))
    assert other.lips.neck.upper_wall.box != ready.lips.neck.upper_wall.box
    assert other.activations == ready.activations
    assert prepared(filmed, activations=ready.activations).activations == ready.activations
