"""First contacts of a moved recording give back how it was moved; one that fits is not moved."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from geometry2d.anatomy.head import head_section
from geometry2d.rigid import rotated
from mocap.motion.motion import MarkedBody, Motion
from scenarios.messages.lines import placement_message
from scenarios.placing.placement import Placed, place
from scenarios.placing.recorded_motion import RecordedMotion, recorded_motion
from scenarios.placing.shift import UNKNOWNS, Shift, with_lower_face_moved
from scenarios.recordings.script import script_of
from scenarios.results.quantities import LIPS
from scenarios.settings.scenario import LIBRARY, FirstContact, ScenarioError, load_scenario
from scenarios.settings.tables import SettingError

NO_SHIFT = Shift()


@cache
def parts(name: str):
    """Scenario, neck, head and the true motion."""
    scenario, script = load_scenario(name), script_of(name)
    scenario = replace(scenario, placement=load_scenario("A38-F").placement)
    seen = RecordedMotion(script.neck_motion(), head_angle_rad=0.1)
    return scenario, scenario.package.section(), script.face(), seen


@cache
def seen_contact(name: str, shift: Shift = NO_SHIFT) -> FirstContact:
    """When and where the undeformed lips are touched first, looked up densely and independently."""
    _, neck, head, seen = parts(name)
    moved_head = with_lower_face_moved(head, shift.lower_face_mm)
    motion = shift.moved(seen.neck)
    values = {}
    for lip in LIPS:
        skin = getattr(moved_head, lip).curves["skin"]
        margin = moved_head.landmarks[f"stomion_{lip}"]
        k = int(np.argmin(np.hypot(*(skin - margin).T)))
        arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(skin, axis=0).T))])
        place = (arc - arc[k]) * (1 if lip == "upper" else -1)
        near = np.abs(place) < 24.0
        for time in np.arange(0.6, 3.0, 0.004):
            local = motion.at(float(time)).pull_back(skin[near])
            gap = np.min(
                [
                    getattr(neck, wall).project(local).distance
                    for wall in ("upper_wall", "lower_wall")
                ],
                axis=0,
            )
            if gap.min() <= 0:
                values[f"{lip}_time_s"] = float(time)
                values[f"{lip}_place_mm"] = float(place[near][np.argmin(gap)])
                break
    return FirstContact(**values)


def solved(name: str, contact: FirstContact, seen: RecordedMotion, **settings: object) -> Placed:
    scenario, neck, head, _ = parts(name)
    placement = replace(scenario.placement, **settings)
    return place(replace(scenario, placement=placement, first_contact=contact), neck, head, seen)


@pytest.mark.parametrize("name", ["A38-F", "A38-AE", "DC-F", "DC-AE"])
def test_a_recording_that_fits_is_not_moved(name):
    _, _, _, seen = parts(name)
    placed = solved(name, seen_contact(name), seen, **dict.fromkeys(UNKNOWNS, "auto"))
    assert placed.shift == Shift()
    assert max(abs(r) for r in placed.residuals.values()) < 0.3
    assert placed.motion.shift_mm == pytest.approx(seen.neck.shift_mm)
    assert placement_message(placed.about()) is None


@pytest.mark.parametrize(
    "wrong",
    [
        pytest.param(Shift(2.0, -3.0), marks=pytest.mark.slow),
        Shift(-1.5, 2.5),
        pytest.param(Shift(3.0, 1.0, turn_deg=4.0), marks=pytest.mark.slow),
        pytest.param(Shift(-2.0, 2.0, turn_deg=-3.0), marks=pytest.mark.slow),
    ],
    ids=["out and down", "in and up", "turned up", "turned down"],
)
def test_a_moved_recording_is_moved_back_within_what_was_observed(wrong):
    _, _, _, seen = parts("A38-F")
    misplaced = RecordedMotion(wrong.moved(seen.neck), seen.head_angle_rad)
    contact = replace(
        seen_contact("A38-F"), time_sigma_s=0.01, place_sigma_mm=0.3, skin_sigma_mm=0.05
    )
    names = [n for n in UNKNOWNS[:3] if n != "turn_deg" or wrong.turn_deg]
    placed = solved("A38-F", contact, misplaced, **dict.fromkeys(names, "auto"))
    for name in names:
        # The smallest shift stays short by √4 standard deviations, and what touches first jumps.
        off = getattr(placed.shift, name) + getattr(wrong, name)
        assert abs(off) < 4.0 * placed.found[name] < 2.5, name
    left, moved = (
        np.hypot(s.shift_x_mm, s.shift_y_mm)
        for s in (
            Shift(
                placed.shift.shift_x_mm + wrong.shift_x_mm,
                placed.shift.shift_y_mm + wrong.shift_y_mm,
            ),
            wrong,
        )
    )
    assert left < 0.3 * moved
    chi_squared = sum(r**2 for r in placed.residuals.values())
    assert 0.4 * 4 < chi_squared <= 4.0


@pytest.mark.slow
def test_the_lower_face_is_found_where_only_it_is_misplaced():
    _, _, _, seen = parts("A38-F")
    true = Shift(lower_face_x_mm=1.5, lower_face_y_mm=2.0)
    contact = replace(
        seen_contact("A38-F", true), time_sigma_s=0.01, place_sigma_mm=0.3, skin_sigma_mm=0.05
    )
    names = ("lower_face_x_mm", "lower_face_y_mm")
    placed = solved("A38-F", contact, seen, **dict.fromkeys(names, "auto"))
    for name in names:
        off = getattr(placed.shift, name) - getattr(true, name)
        assert abs(off) < 4.0 * placed.found[name] < 2.5
    low, moved = parts("A38-F")[2].lower.curves["skin"], placed.head.lower.curves["skin"]
    assert moved - low == pytest.approx(np.tile(placed.shift.lower_face_mm, (len(low), 1)))
    assert placed.head.upper is parts("A38-F")[2].upper


@pytest.mark.slow
def test_the_smallest_shift_is_taken_and_what_nothing_fixes_is_said():
    """One time fixes one combination of shifts: the answer lies along it, and is no longer."""
    _, _, _, seen = parts("A38-F")
    contact = seen_contact("A38-F")
    only = FirstContact(lower_time_s=contact.lower_time_s)
    wrong = Shift(shift_y_mm=3.0)
    misplaced = RecordedMotion(wrong.moved(seen.neck), seen.head_angle_rad)
    both = solved("A38-F", only, misplaced, shift_x_mm="auto", shift_y_mm="auto")
    alone = solved("A38-F", only, misplaced, shift_y_mm="auto")
    size = float(np.hypot(both.shift.shift_x_mm, both.shift.shift_y_mm))
    assert 0.5 < size < abs(alone.shift.shift_y_mm) <= 3.0
    assert np.isinf(both.found["shift_x_mm"])
    assert np.isfinite(alone.found["shift_y_mm"])


def recorded(folder: Path, turn_deg: float) -> RecordedMotion:
    """What is read of A38-F's true motion, had the camera been turned by ``-turn_deg``."""
    folder.mkdir()
    truth, by = Motion.read(LIBRARY / "A38-F" / "truth_motion.csv"), np.deg2rad(turn_deg)
    Motion.of(
        truth.time_s,
        rotated(truth.relative_mm, by),
        truth.relative_rad,
        head_body=MarkedBody("head", axis_rad=np.deg2rad(12.3) + by),
        package_body=MarkedBody("package", axis_rad=np.deg2rad(125.8) + by),
    ).write(folder / "motion.csv", decimals=15)
    scenario = load_scenario("A38-F").with_motion(folder / "motion.csv")
    return recorded_motion(scenario, scenario.package.section(), scenario.head.section())


@pytest.mark.parametrize("turn_deg", [34.0, -120.0, 180.0])
def test_how_the_camera_stood_does_not_matter_to_the_last_bit(turn_deg, tmp_path):
    straight = recorded(tmp_path / "straight", 0.0)
    turned = recorded(tmp_path / "turned", turn_deg)
    assert np.array_equal(straight.neck.angle_rad, turned.neck.angle_rad)
    assert np.array_equal(straight.neck.shift_mm, turned.neck.shift_mm)
    by = np.rad2deg(turned.head_angle_rad - straight.head_angle_rad)
    assert by == pytest.approx(turn_deg)


def test_a_motion_that_does_not_say_how_the_head_was_turned_is_refused(tmp_path):
    truth = LIBRARY / "A38-F" / "truth_motion.csv"
    scenario = load_scenario("A38-F").with_motion(truth)
    with pytest.raises(ScenarioError, match=r"how head was turned in the first frame.*two markers"):
        recorded_motion(scenario, scenario.package.section(), scenario.head.section())


def test_what_cannot_be_explained_within_the_bounds_is_said():
    _, _, _, seen = parts("A38-F")
    misplaced = RecordedMotion(Shift(shift_y_mm=8.0).moved(seen.neck), seen.head_angle_rad)
    with pytest.raises(ScenarioError, match=r"no shift within 3 mm.*shift_y_mm reached the bound"):
        solved("A38-F", seen_contact("A38-F"), misplaced, shift_y_mm="auto", at_most_mm=3.0)
    with pytest.raises(SettingError, match="needs something observed"):
        solved("A38-F", FirstContact(), seen, shift_y_mm="auto")


def test_the_library_scenario_that_states_its_first_contacts_needs_no_shift():
    scenario, neck, head, seen = parts("A38-AE")
    wanted = [name for name in UNKNOWNS if name != "turn_deg"]
    written = load_scenario("A38-AE", [f'placement.{name}="auto"' for name in wanted])
    scenario = replace(scenario, placement=written.placement, first_contact=written.first_contact)
    placed = place(scenario, neck, head, seen)
    assert set(placed.found) == set(UNKNOWNS) - {"turn_deg"}
    assert placed.shift == NO_SHIFT
    assert max(abs(r) for r in placed.residuals.values()) < 1.0


def test_a_lower_face_moved_into_the_upper_lip_is_refused():
    with pytest.raises(ScenarioError, match=r"\(0.0, 20.0\) mm overlaps the upper lip"):
        with_lower_face_moved(head_section(), (0.0, 20.0))
