"""Tables of muscles and liquid: what they mean against time, and what is refused."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from scenarios.settings.liquid import Liquid
from scenarios.settings.muscles import Muscles, Seen
from scenarios.settings.scenario import load_scenario, resolved_toml
from scenarios.settings.tables import SettingError


def test_without_the_tables_nothing_acts_and_nothing_is_written() -> None:
    scenario = load_scenario("A38-F")
    assert scenario.muscles is None
    assert scenario.liquid is None
    tables = tomllib.loads(resolved_toml(scenario))
    assert "muscles" not in tables
    assert "liquid" not in tables


def test_one_number_is_reached_when_the_neck_comes_near() -> None:
    activations = Muscles(levator=0.2, rise_s=0.4).activations(near_s=1.5)
    assert set(activations) == {"levator"}
    levator = activations["levator"]
    assert levator.at(1.1) == 0.0
    assert levator.at(1.3) == pytest.approx(0.1)
    assert levator.at(1.5) == levator.at(9.0) == 0.2


def test_muscles_that_rest_are_no_part_of_a_model() -> None:
    resting = Muscles(time_s=(1.0, 2.0), levator=(0.0, 0.0), depressor=0.0)
    assert resting.activations(near_s=1.5) == {}
    assert Muscles(levator="auto", time_s=(1.0, 2.0)).activations(1.5, {"levator": 0.0}) == {}


def test_activations_follow_their_instants() -> None:
    muscles = Muscles(
        time_s=(1.0, 2.0, 3.0), mentalis=(0.0, 0.4, 0.0), upper_orbicularis=(0.1, 0.1, 0.3)
    )
    activations = muscles.activations(near_s=7.0)
    assert activations["mentalis"].time_s == (1.0, 2.0, 3.0)
    assert activations["mentalis"].at(1.5) == pytest.approx(0.2)
    assert activations["upper_orbicularis"].time_s == (0.7, 1.0, 2.0, 3.0)
    assert activations["upper_orbicularis"].at(0.7) == 0.0


def test_a_scenario_file_says_how_the_lips_act(tmp_path: Path) -> None:
    file = tmp_path / "acting.toml"
    file.write_text(
        'base = "A38-F"\n[muscles]\ntime_s = [0.5, 1.0]\nlower_orbicularis = [0.0, 0.2]\n'
        "mentalis = 0.1\n[muscles.fibre]\nmax_stress_mpa = 0.2\n"
        "[muscles.places]\nmentalis_thickness_mm = 5.0\n"
        "[liquid]\nvolume_ml = 180.0\nsuction_kpa = 4.0\nsuck_from_s = 2.0\nsuck_to_s = 3.0\n"
    )
    scenario = load_scenario(file)
    assert scenario.muscles.lower_orbicularis == (0.0, 0.2)
    assert scenario.muscles.fibre.max_stress_mpa == 0.2
    assert scenario.muscles.places.mentalis_thickness_mm == 5.0
    assert scenario.liquid.volume_ml == 180.0
    again = tmp_path / "again.toml"
    again.write_text(resolved_toml(scenario))
    assert load_scenario(again) == scenario


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["muscles.levator=1.4"], r"muscles\.levator = 1.4 is too large: at most 1"),
        (["muscles.levator=[0.1, 0.2]"], "holds 2 activations and muscles.time_s 0 instants"),
        (["muscles.time_s=[2.0, 1.0]"], "each instant must be later"),
        (["muscles.levatr=0.1"], "did you mean"),
        (["muscles.levator=auto"], 'give muscles.time_s, and "auto" at two instants'),
        (
            ["muscles.time_s=[1.0, 2.0]", 'muscles.levator=["auto", 0.2]'],
            'give muscles.time_s, and "auto" at two instants',
        ),
        (["muscles.mentalis=auto"], r"give muscles\.seen\.lower_reach_mm"),
        (["muscles.seen.lower_reach_mm=8.0"], "reach_time_s is missing"),
        (["muscles.lower_orbicularis=auto"], r"give muscles\.seen\.seal_time_s"),
        (
            ["muscles.lower_orbicularis=auto", "muscles.seen.seal_time_s=3.0"],
            r"give \[liquid\] volume_ml too",
        ),
        (["muscles.levator=0.1", "muscles.seen.clearance_mm=1.0"], "has no effect"),
        (["numerics.activation_search.tolerance=0.01"], "has no effect"),
        (["liquid.density_kg_per_m3=1000.0"], r"liquid\.volume_ml is missing"),
        (["liquid.volume_ml=0.0"], r"liquid\.volume_ml = 0 ml is too small"),
        (["liquid.volume_ml=100.0", "liquid.suction_kpa=4.0"], "say when the person sucks"),
        (
            [
                "liquid.volume_ml=100.0",
                "liquid.suction_kpa=4.0",
                "liquid.suck_from_s=3.0",
                "liquid.suck_to_s=2.0",
            ],
            "is not before",
        ),
    ],
)
def test_what_no_lip_and_no_liquid_can_do_is_refused(settings: list[str], message: str) -> None:
    with pytest.raises(SettingError, match=message):
        load_scenario("A38-F", settings)


def test_auto_stands_for_what_was_found_wherever_it_is_written() -> None:
    muscles = Muscles(time_s=(1.0, 2.0, 3.0, 4.0), levator=("auto", "auto", 0.1, "auto"))
    assert muscles.automatic == ("levator",)
    assert muscles.held_s("levator") == ((1.0, 2.0),)
    levator = muscles.activations(0.0, {"levator": 0.3})["levator"]
    assert [levator.at(time) for time in (1.0, 1.5, 2.0, 3.0, 4.0)] == [0.3, 0.3, 0.3, 0.1, 0.3]


def test_one_muscle_is_decided_by_one_observation() -> None:
    seen = Seen(lower_reach_mm=8.0, reach_time_s=2.0, seal_time_s=2.0)
    muscles = Muscles(depressor="auto", mentalis="auto", lower_orbicularis="auto", seen=seen)
    decided = {name: muscles.observation(name) for name in muscles.automatic}
    assert decided == {
        "lower_orbicularis": "seals", "mentalis": "reaches", "depressor": "reaches"
    }  # fmt: skip


def test_suction_rises_holds_and_falls() -> None:
    suction = Liquid(100.0, suction_kpa=4.0, suck_from_s=2.0, suck_to_s=3.0, rise_s=0.2).suction
    assert suction.at(1.8) == suction.at(3.2) == 0.0
    assert suction.at(2.0) == suction.at(2.7) == 1.0
    assert suction.at(1.9) == pytest.approx(0.5)
    assert Liquid(100.0).suction.at(2.5) == 0.0
