"""What is said about a run, from its numbers."""

from __future__ import annotations

from typing import Any

import pytest

from scenarios.messages.lines import (
    acting_message,
    caught_message,
    crushed_message,
    ending,
    felt_message,
    lips_message,
    mesh_message,
    muscle_message,
    muscles_message,
    placement_message,
    skin_message,
    unstable_message,
)

AT_HOME = {
    "shift_x_mm": 0.0,
    "shift_y_mm": 0.0,
    "turn_deg": 0.0,
    "lower_face_x_mm": 0.0,
    "lower_face_y_mm": 0.0,
    "found_with_sigma": {},
}


def passage(start_s: float, end_s: float, lip: str) -> dict[str, Any]:
    where = {"lip": lip, "arc_mm": 12.3, "x_mm": 1.0, "y_mm": -2.0}
    return {"from_s": start_s, "to_s": end_s, "modes": 1, **where}


def test_an_ending_says_where_it_was_resumed_and_where_it_stopped() -> None:
    whole = ending(
        "all followed",
        increments=5,
        iterations=20,
        cutbacks=1,
        resumed_at_s=None,
        stopped_at_s=None,
        end_s=3.0,
    )
    assert whole == "all followed in 5 increments (20 iterations, 1 cutbacks)"
    part = ending(
        "too small",
        increments=5,
        iterations=20,
        cutbacks=1,
        resumed_at_s=1.0,
        stopped_at_s=2.0,
        end_s=3.0,
    )
    assert part.endswith("since it was resumed at 1.000 s, stopped at 2.000 s of 3.000 s")


@pytest.mark.parametrize(
    ("moved", "message"),
    [
        ({}, None),
        ({"shift_x_mm": 1.0}, "moved, as the scenario says: the package by (+1.0, +0.0) mm"),
        (
            {"lower_face_y_mm": -2.0, "turn_deg": 3.0, "found_with_sigma": {"turn_deg": 1.0}},
            "moved, found from the first contacts: the lower face by (+0.0, -2.0) mm, "
            "the package turned by 3.0°",
        ),
    ],
)
def test_what_was_moved_is_said(moved: dict[str, Any], message: str | None) -> None:
    assert placement_message(AT_HOME | moved) == message


def test_a_pull_is_said_to_be_found_only_if_it_was() -> None:
    pull = {"lip": "upper", "traction_kpa": 2.0, "direction_deg": 80.0, "clearance_mm": 0.5}
    assert muscle_message(pull | {"found": True}).endswith("0.5 mm clear of the neck (found)")
    assert muscle_message(pull | {"found": False}).endswith("0.5 mm clear of the neck")


def test_the_longest_unstable_passage_is_said() -> None:
    assert unstable_message([]) is None
    once = unstable_message([passage(1.0, 1.2, "lower")])
    assert once is not None
    assert "unstable once from 1.000 to 1.200 s, most of all the lower lip 12.3 mm" in once
    twice = unstable_message([passage(1.0, 1.2, "lower"), passage(2.0, 2.5, "upper")])
    assert twice is not None
    assert "unstable 2 times, longest from 2.000 to 2.500 s, most of all the upper lip" in twice


def test_a_lip_caught_between_neck_and_teeth_is_said_and_contact_as_usual_is_not() -> None:
    assert crushed_message(0.0042) is None
    assert "0.63 mm into a lip" in str(crushed_message(0.634))


def test_a_lip_that_the_neck_takes_along_is_said() -> None:
    assert caught_message(()) is None
    assert "the upper lip still hung on the neck" in str(caught_message(("upper",)))
    assert "the upper and lower lip" in str(caught_message(("upper", "lower")))


def test_what_a_lip_feels_is_said_for_each_lip() -> None:
    summary = {
        "upper_lip_window_1_5mm_kpa": 61.6,
        "upper_lip_mean_kpa": 29.7,
        "upper_lip_crest_contrast": 0.453,
        "lower_lip_window_1_5mm_kpa": 18.0,
        "lower_lip_mean_kpa": 9.0,
        "lower_lip_crest_contrast": 0.03,
    }
    upper, lower = felt_message(summary).split(". ")
    assert upper == (
        "The upper lip feels up to 62 kPa over the 1.5 mm that it resolves, and 30 kPa on average "
        "where it is touched; crests stand out of it by up to 45 %, and are felt one by one"
    )
    assert "crests hardly stand out of it (3 % at most)." in lower
    nothing = felt_message(summary | {"lower_lip_window_1_5mm_kpa": 0.0})
    assert nothing.endswith("The lower lip feels nothing.")


def test_a_seal_is_said_where_liquid_was_at_the_rim() -> None:
    summary = {
        "upper_lip_window_1_5mm_kpa": 60.0,
        "upper_lip_mean_kpa": 30.0,
        "upper_lip_crest_contrast": 0.4,
        "upper_lip_seal_margin_kpa": 12.34,
        "lower_lip_window_1_5mm_kpa": 18.0,
        "lower_lip_mean_kpa": 9.0,
        "lower_lip_crest_contrast": 0.03,
        "lower_lip_seal_margin_kpa": -0.46,
    }
    felt = felt_message(summary)
    assert "It seals with at least 12.3 kPa to spare. The lower lip" in felt
    assert felt.endswith("It does not seal: the liquid presses 0.5 kPa more at some instant.")


def test_the_tension_of_the_skin_is_told():
    about = {"mean_tension_kpa": 6.999, "start_tension_kpa": 13.3}
    assert skin_message(about) == "the skin is under 7.0 kPa of tension as it is drawn"


def test_muscles_are_said_with_their_largest_activation() -> None:
    message = muscles_message({"upper_peripheral": {"activation": 0.2, "tension_n": 0.79}})
    assert message == "muscles at most as active as: upper peripheral 0.20 (0.8 N)"


def test_how_active_lips_are_is_said_of_all_runs_or_of_some() -> None:
    assert "passive: no muscle" in lips_message([False], [False])
    assert "stands for a muscle in some" in lips_message([True, False], [False, False])
    assert "Muscles of the lips act;" in lips_message([True], [True])
    assert "act in some of the runs" in lips_message([False, False], [True, False])


def test_who_carried_the_package_is_said_of_every_run() -> None:
    film = acting_message({})
    assert film == "The neck followed the film, whatever it took."
    same = {"mode": "same", "reference": "A38-F"}
    assert "hand of the reference run A38-F, which yields" in acting_message({"hand": same})
    force = {"mode": "force", "reference": "A38-F"}
    assert "bore what it bore in the reference run A38-F." in acting_message({"hand": force})
    stated = force | {"upper_n": 1.0, "lower_n": 2.0}
    assert "1.00 N the upper and 2.00 N the lower" in acting_message({"hand": stated})
    found = {"least": 0.02, "twice": 0.04, "fixed_by": "keeps it clear"}
    assert "Activations found: levator 0.020" in acting_message({"activations": {"levator": found}})


def test_a_mesh_that_leaves_a_pressure_open_is_named_with_shorter_edges():
    about = {
        "highest_window_upper_lip_kpa": 76.0,
        "highest_recovered_window_upper_lip_kpa": 55.5,
        "highest_window_lower_lip_kpa": 44.0,
        "highest_recovered_window_lower_lip_kpa": 42.0,
    }
    told = mesh_message("upper", about, contact_mm=0.4, layer_mm=1.1)
    assert told is not None
    assert "upper lip" in told
    assert "76 and 56 kPa" in told
    assert "numerics.mesh.layer_mm = 0.25 and contact_mm = 0.25 " in told
    assert mesh_message("lower", about, contact_mm=0.4, layer_mm=1.1) is None
    shorter = mesh_message("upper", about, contact_mm=0.08, layer_mm=0.2)
    assert shorter is not None
    assert "numerics.mesh.layer_mm = 0.1 before" in shorter
