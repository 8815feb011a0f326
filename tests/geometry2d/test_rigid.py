"""Rigid motions form a group, carry reference points and refuse nonsense."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry2d.rigid import RigidMotion, RigidMotionError

TIMES = np.linspace(0, 2, 9)


def motion(seed: int) -> RigidMotion:
    rng = np.random.default_rng(seed)
    return RigidMotion(TIMES, rng.uniform(-2, 2, 9), rng.uniform(-30, 30, (9, 2)))


@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_composition_applies_one_after_the_other(a, b):
    points = np.array([[1.0, 2.0], [-3.0, 0.5]])
    first, second = motion(a), motion(b)
    composed = (second @ first).apply(points)
    one_by_one = np.array([second.at(t).apply(first.at(t).apply(points)) for t in TIMES])
    np.testing.assert_allclose(composed, one_by_one, atol=1e-10)


@given(st.integers(0, 10**6))
def test_inverse_undoes_and_pull_back_agrees(seed):
    points = np.array([[1.0, 2.0], [-3.0, 0.5]])
    some = motion(seed)
    np.testing.assert_allclose(
        (some.inverse() @ some).apply(points), np.broadcast_to(points, (9, 2, 2)), atol=1e-10
    )
    place = some.at(0.777)
    np.testing.assert_allclose(place.pull_back(place.apply(points)), points, atol=1e-12)


def test_reference_point_goes_where_it_was_seen():
    path = np.column_stack([TIMES, TIMES**2])
    some = RigidMotion.of_reference_point(TIMES, 0.3 * TIMES, path, (4.0, -1.0))
    np.testing.assert_allclose(some.apply([4.0, -1.0])[:, 0], path, atol=1e-12)


def test_seen_from_a_moving_body_a_body_at_rest_relative_to_it_stands_still():
    head = motion(3)
    offset = RigidMotion(TIMES, np.full(9, 0.4), np.tile([5.0, 6.0], (9, 1)))
    seen = (head @ offset).seen_from(head)
    np.testing.assert_allclose(seen.angle_rad, 0.4, atol=1e-12)
    np.testing.assert_allclose(seen.shift_mm, [[5.0, 6.0]] * 9, atol=1e-10)


@pytest.mark.parametrize(
    ("time", "angle", "shift", "word"),
    [
        ([0, 0], [0, 0], [[0, 0], [0, 0]], "do not increase"),
        ([0, 1], [0], [[0, 0], [0, 0]], "differ"),
        ([0, 1], [0, np.nan], [[0, 0], [0, 0]], "finite"),
    ],
)
def test_nonsense_is_refused(time, angle, shift, word):
    with pytest.raises(RigidMotionError, match=word):
        RigidMotion(np.array(time, float), np.array(angle, float), np.array(shift, float))
