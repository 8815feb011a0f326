import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry2d.curves import (
    CurveError,
    arc_lengths,
    at_arc_lengths,
    graded,
    left_normals,
    nearest_arc_length,
    smoothed,
    stretch,
    through_landmarks,
)


@given(
    radius=st.floats(2.0, 50.0), start_deg=st.floats(0.0, 360.0), turn_deg=st.floats(10.0, 100.0)
)
def test_directions_that_allow_an_arc_give_that_arc(radius, start_deg, turn_deg):
    angle = np.deg2rad([start_deg, start_deg + turn_deg])
    ends = radius * np.column_stack([np.cos(angle), np.sin(angle)])

    curve = through_landmarks(ends, np.rad2deg(angle) + 90.0)

    # A single cubic for 100° of arc misses the circle by less than 0.3 % of its radius.
    assert np.abs(np.hypot(*curve.T) - radius).max() < 3e-3 * radius


def test_curve_passes_landmarks_in_the_given_directions():
    landmarks = np.array([[0.0, 0.0], [10.0, 4.0], [15.0, -2.0]])
    headings = [20.0, 0.0, -80.0]

    curve = through_landmarks(landmarks, headings, spacing_mm=0.01)

    for point, heading in zip(landmarks, headings, strict=True):
        at = nearest_arc_length(curve, point)
        before, after = at_arc_lengths(curve, [max(at - 0.02, 0.0), at + 0.02])
        assert np.hypot(*(at_arc_lengths(curve, at) - point)) < 2e-4
        step = after - before
        if np.hypot(*step) > 0:
            assert np.rad2deg(np.arctan2(step[1], step[0])) == pytest.approx(heading, abs=1.0)


def test_curve_that_would_turn_back_is_refused():
    with pytest.raises(CurveError, match="turn back on itself"):
        through_landmarks([[0, 0], [5, 0]], [180.0, 0.0])
    with pytest.raises(CurveError, match="coincide"):
        through_landmarks([[0, 0], [0, 0]], [0.0, 0.0])


def test_smoothing_keeps_ends_and_moves_an_arc_inwards_as_promised():
    angle = np.linspace(0.0, np.pi, 400)
    arc = 5.0 * np.column_stack([np.cos(angle), np.sin(angle)])

    smooth = smoothed(arc, 0.6)

    np.testing.assert_allclose(smooth[[0, -1]], arc[[0, -1]], atol=1e-12)
    inwards = 5.0 - np.hypot(*smooth[100:300].T)
    np.testing.assert_allclose(inwards, 0.6**2 / (2 * 5.0), rtol=0.03)


def test_smoothing_removes_a_jump_of_curvature():
    straight = np.column_stack([np.linspace(-10.0, 0.0, 201)[:-1], np.zeros(200)])
    angle = np.linspace(0.0, 1.5, 151)
    bent = 5.0 * np.column_stack([np.sin(angle), 1.0 - np.cos(angle)])

    def largest_curvature_step(points):
        direction = np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1]))
        return np.abs(np.diff(np.diff(direction) / 0.05)).max()

    kinked = np.concatenate([straight, bent])
    assert largest_curvature_step(smoothed(kinked, 0.6)) < 0.2 * largest_curvature_step(kinked)


@given(size=st.floats(0.3, 3.0))
def test_grading_follows_the_size_field(size):
    line = np.array([[0.0, 0.0], [30.0, 0.0]])

    points = graded(line, lambda p: size * (1.0 + 0.05 * p[:, 0]))

    assert points[0].tolist() == [0.0, 0.0]
    assert points[-1].tolist() == [30.0, 0.0]
    step = np.diff(points[:, 0])
    wished = size * (1.0 + 0.05 * 0.5 * (points[1:, 0] + points[:-1, 0]))
    rounding = 0.6 / len(step)
    np.testing.assert_allclose(step / wished, 1.0, atol=0.01 + rounding)


def test_normals_point_left_and_are_units():
    curve = stretch([[0.0, 0.0], [0.0, 10.0]], 2.0, 7.0)

    np.testing.assert_allclose(left_normals(curve), np.tile([-1.0, 0.0], (len(curve), 1)))
    assert arc_lengths(curve)[-1] == pytest.approx(5.0)
