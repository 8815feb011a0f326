"""The hand of a scenario: what it bears, per width of lip, and what is refused."""

import numpy as np
import pytest

from scenarios.results.solution import Solution
from scenarios.settings.hand import HandSettings
from scenarios.settings.scenario import ScenarioError, load_scenario
from scenarios.settings.tables import SettingError
from scenarios.sip.hand import Reference, chosen_hand, hand_of

TIMES = np.linspace(0.0, 1.0, 11)


def reference(thickness_mm: float = 1.0) -> Reference:
    grows = np.sin(np.pi * TIMES)
    return Reference(
        TIMES,
        {
            "upper": np.outer(grows, [0.06, 0.02]) * thickness_mm,
            "lower": np.outer(grows, [0.01, 0.05]) * thickness_mm,
        },
        0.3 * grows * thickness_mm,
        thickness_mm,
    )


def test_a_hand_of_springs_is_shared_out_over_the_width():
    settings = HandSettings(mode="same", stiffness_n_per_m=500.0, width_mm=25.0)
    hand = hand_of(settings, reference(), 1.0)
    assert hand is not None
    assert hand.stiffness[0, 0] == pytest.approx(0.5 / 25.0)  # 0.5 N/mm over 25 mm
    assert hand.borne.at(0.5)[:2] == pytest.approx([0.07, 0.07])
    thick = hand_of(settings, reference(), 2.0)
    assert thick is not None
    assert thick.stiffness == pytest.approx(2.0 * hand.stiffness)
    assert thick.borne.at(0.5) == pytest.approx(2.0 * hand.borne.at(0.5))


def test_forces_are_held_along_what_each_lip_bore():
    hand = hand_of(HandSettings(mode="force"), reference(), 1.0)
    assert hand is not None
    assert hand.borne.at(0.5) == pytest.approx([np.hypot(0.06, 0.02), np.hypot(0.01, 0.05)])
    assert np.linalg.norm(hand.weights[:, :2], axis=1) == pytest.approx([1.0, 1.0])
    assert hand.contacts[0] == ("upper lip on upper_wall", "upper lip on lower_wall")


def test_stated_forces_act_from_the_first_touch_to_the_last():
    settings = HandSettings(mode="force", upper_force_n=1.0, lower_force_n=2.0, width_mm=20.0)
    hand = hand_of(settings, reference(), 1.0)
    assert hand is not None
    assert hand.borne.at(0.5) == pytest.approx([0.05, 0.1])
    assert hand.borne.at(0.0) == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize(("share", "upper", "lower"), [(0.1, 0.25, 0.25), ((0.2, 0.1), 0.5, 0.25)])
def test_each_lip_bears_its_share_of_package_and_content(share, upper, lower):
    """240 ml of water and 15 g of package weigh 255 g: 2.5007 N."""
    scenario = load_scenario("A38-F").with_(
        hand={"mode": "force", "share_of_weight": share, "width_mm": 20.0},
        liquid={"volume_ml": 240.0},
        package={"mass_g": 15.0},
    )
    assert scenario.weight_n == pytest.approx(0.255 * 9.80665)
    assert scenario.filmed is None  # the same neck, whatever it weighs
    hand = hand_of(scenario.hand, reference(), 1.0, weight_n=scenario.weight_n)
    assert hand is not None
    assert hand.borne.at(0.5) == pytest.approx([upper / 20, lower / 20], rel=2e-3)


@pytest.mark.parametrize(
    ("missing", "settings"),
    [("volume_ml", ["package.mass_g=15"]), ("package.mass_g", ["liquid.volume_ml=200"])],
)
def test_a_share_of_an_unknown_weight_is_refused(missing, settings):
    with pytest.raises(SettingError, match=rf"unknown weight: give .*{missing}"):
        load_scenario("A38-F", ["hand.mode=force", "hand.share_of_weight=0.1", *settings])


def test_a_reference_scenario_is_one_of_the_library():
    with pytest.raises(ScenarioError, match=r"reference_scenario = 'A38F': .*A38-F"):
        load_scenario("A38-AE", ["hand.mode=force", "hand.reference_scenario=A38F"])


def test_a_lip_that_bore_nothing_cannot_be_followed():
    nothing = reference()
    still = Reference(
        TIMES, {**nothing.force_n, "lower": np.zeros((11, 2))}, nothing.moment_nmm, 1.0
    )
    with pytest.raises(ScenarioError, match="the lower lip bears nothing"):
        hand_of(HandSettings(mode="force"), still, 1.0)


def test_the_film_needs_no_hand_and_others_need_a_run(run_directory):
    scenario = load_scenario("A38-F")
    assert chosen_hand(scenario, None, 0.0) is None
    same = scenario.with_(hand={"mode": "same"})
    with pytest.raises(ScenarioError, match=r"give hand\.reference"):
        chosen_hand(same, None, 0.0)
    assert chosen_hand(same, Solution.load(run_directory), 0.0) is not None


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        (["hand.stiffness_n_per_m=0"], "stiffness_n_per_m"),
        (["hand.mode=force", "hand.upper_force_n=1.0"], "lower_force_n"),
        (["hand.mode=same", "hand.upper_force_n=1", "hand.lower_force_n=1"], "no effect"),
        (["hand.mode=same", "hand.share_of_weight=0.1"], "share_of_weight has no effect"),
        (
            ["hand.mode=force", "hand.share_of_weight=0.1", "hand.reference=runs/A38-F"],
            "share_of_weight and hand.reference contradict",
        ),
        (
            ["hand.mode=force", "hand.share_of_weight=0.1"]
            + [f"hand.{lip}_force_n=1" for lip in ("upper", "lower")],
            "upper_force_n and hand.share_of_weight contradict",
        ),
        (["hand.mode=force", "hand.share_of_weight=1.5"], "share_of_weight"),
        (["hand.reference_scenario=A38-F"], "no effect"),
        (
            ["hand.mode=same", "hand.reference_scenario=A38-F", "hand.reference=runs/A38-F"],
            "reference and hand.reference_scenario contradict",
        ),
        (["hand.stiffness_n_per_m=200"], "no effect"),
        (["hand.mode=force", "hand.stiffness_n_per_m=200"], "no effect"),
        (["hand.mode=firm"], "recorded"),
    ],
)
def test_contradictions_are_refused(settings, word):
    with pytest.raises(SettingError, match=word):
        load_scenario("A38-F", settings)
