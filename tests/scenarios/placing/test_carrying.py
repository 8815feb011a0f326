"""A neck that was not filmed has its rim where the filmed one's was, whatever else it is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry2d.neck import A38_NECK, DC_NECK, neck_section
from geometry2d.rigid import RigidMotion
from scenarios.placing.carrying import anchor_point, carried

TIMES = np.linspace(0.0, 2.0, 41)
MOTION = RigidMotion(
    TIMES,
    -0.4 - 0.3 * np.sin(TIMES),
    np.column_stack([100 + 50 * np.cos(TIMES), -60 - 40 * np.cos(TIMES)]),
)


@pytest.mark.slow
@given(
    crests=st.integers(0, 3),
    land=st.floats(1.0, 3.0),
    pitch=st.floats(1.0, 1.3),
    diameter=st.floats(0.9, 1.1),
    behind=st.floats(0.5, 2.0),
    anchor=st.sampled_from(["lower_rim", "rim_centre", "marks"]),
)
@settings(max_examples=40, deadline=None)
def test_the_anchor_is_where_it_was(crests, land, pitch, diameter, behind, anchor):
    filmed = neck_section(A38_NECK)
    other = neck_section(
        replace(
            A38_NECK,
            crests=crests,
            land_mm=land,
            pitch_mm=pitch * A38_NECK.pitch_mm,
            thread_diameter_mm=diameter * A38_NECK.thread_diameter_mm,
            root_diameter_mm=diameter * A38_NECK.root_diameter_mm,
            mark_behind_thread_mm=behind * A38_NECK.mark_behind_thread_mm,
            length_mm=40.0,
        )
    )
    moved = carried(MOTION, filmed, other, anchor)
    for time in (0.0, 0.7, 2.0):
        was = MOTION.at(time).apply(anchor_point(filmed, anchor)[None])
        now = moved.motion.at(time).apply(anchor_point(other, anchor)[None])
        assert now == pytest.approx(was, abs=1e-3)
        assert moved.motion.at(time).angle_rad == pytest.approx(MOTION.at(time).angle_rad)


def test_the_filmed_neck_is_not_moved():
    neck = neck_section(DC_NECK)
    moved = carried(MOTION, neck, neck_section(DC_NECK), "lower_rim")
    assert moved.motion is MOTION
    assert moved.shift_mm == (0.0, 0.0)


def test_a_thread_less_moves_the_marks_and_not_the_rim():
    filmed, other = neck_section(A38_NECK), neck_section(replace(A38_NECK, crests=1))
    moved = carried(MOTION, filmed, other, "lower_rim")
    assert moved.shift_mm == pytest.approx((-A38_NECK.pitch_mm, 0.0))
