"""Scripted paths: smooth, and where the steps add up to."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.recordings.choreography import ChoreographyError, PosePath, PoseStep, minimum_jerk


def test_minimum_jerk_starts_and_ends_at_rest_without_acceleration():
    time = np.linspace(-0.2, 1.2, 14001)
    way = minimum_jerk(time)
    speed = np.gradient(way, time)
    acceleration = np.gradient(speed, time)
    assert speed.max() == pytest.approx(1.875, abs=1e-4)
    assert np.abs(np.diff(acceleration)).max() < 0.01  # a jump would be of the order of 1
    assert np.abs(acceleration).max() == pytest.approx(10 / np.sqrt(3), abs=1e-2)


@given(st.lists(st.tuples(*[st.floats(-9, 9)] * 3, st.floats(0, 2)), max_size=4))
def test_a_path_ends_where_its_steps_add_up_to(parts):
    steps = tuple(PoseStep(begin, begin + 0.7, x, y, turn) for x, y, turn, begin in parts)
    path = PosePath((12.0, -5.0), (100.0, -40.0), -30.0, steps)
    motion = path.motion(np.linspace(0, 3, 31))
    totals = np.sum([p[:3] for p in parts], axis=0) if parts else np.zeros(3)
    led = motion.apply([path.point_mm])[:, 0]
    assert led[0] == pytest.approx([100.0, -40.0])
    assert led[-1] == pytest.approx([100.0 + totals[0], -40.0 + totals[1]])
    assert np.degrees(motion.angle_rad[-1]) == pytest.approx(-30.0 + totals[2])


def test_turning_leaves_the_led_point_where_it_is():
    path = PosePath((12.0, -5.0), (100.0, -40.0), -30.0, (PoseStep(0.0, 1.0, turn_deg=18.0),))
    led = path.motion(np.linspace(0, 1, 11)).apply([path.point_mm])[:, 0]
    assert led == pytest.approx(np.tile([100.0, -40.0], (11, 1)))


def test_a_step_that_ends_before_it_begins_is_refused():
    with pytest.raises(ChoreographyError, match=r"'tilt' lasts from 2.0 s to 1.0 s"):
        PoseStep(2.0, 1.0, turn_deg=5.0, why="tilt")
