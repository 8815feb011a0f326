"""Outlines against shapely's polygons, finite differences and closed forms."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from geometry2d.outline import Outline, OutlineError

NOTCHED = Outline.from_corners(
    [[0, 0], [10, 0], [10, 6], [6, 6], [6, 3], [4, 3], [4, 6], [0, 6]],
    [1, 1, 1, 0.5, 0.7, 0.7, 0.5, 0],
)
ROUND = Outline.from_corners([[0, 0], [9, 0], [9, 5], [4, 7], [0, 5]], 0.8)


def random_points(count: int = 1500) -> np.ndarray:
    return np.random.default_rng(4).uniform(-3, 13, (count, 2))


def test_distance_and_sign_agree_with_a_fine_polygon():
    points = random_points()
    polygon = shapely.Polygon(NOTCHED.sampled(0.002))
    where = shapely.points(points)
    expected = shapely.distance(polygon.exterior, where) * np.where(polygon.contains(where), -1, 1)
    assert np.ptp(expected) > 5
    np.testing.assert_allclose(NOTCHED.project(points).distance, expected, atol=2e-6)


def test_area_and_length_agree_with_a_fine_polygon():
    polygon = shapely.Polygon(NOTCHED.sampled(0.002))
    assert NOTCHED.area == pytest.approx(polygon.area, rel=1e-6)
    assert NOTCHED.length == pytest.approx(polygon.length, rel=1e-6)


@pytest.mark.parametrize("outline", [NOTCHED, ROUND, Outline.circle([1, 2], 3)])
def test_foot_distance_and_normal_are_consistent(outline):
    points = random_points()
    projection = outline.project(points)
    foot, _ = outline.point_at(projection.arc_length)
    np.testing.assert_allclose(
        foot + projection.distance[:, None] * projection.normal, points, atol=1e-12
    )


@pytest.mark.parametrize("outline", [NOTCHED, ROUND, Outline.circle([1, 2], 3)])
def test_normal_and_curvature_are_the_derivatives_of_the_distance(outline):
    points = random_points()
    projection = outline.project(points)
    step = 1e-6
    shifts = step * np.eye(2)
    plus = [outline.project(points + s) for s in shifts]
    minus = [outline.project(points - s) for s in shifts]
    gradient = np.stack(
        [(a.distance - b.distance) / (2 * step) for a, b in zip(plus, minus, strict=True)], -1
    )
    hessian = np.stack(
        [(a.normal - b.normal) / (2 * step) for a, b in zip(plus, minus, strict=True)], -1
    )
    tangent = np.column_stack([-projection.normal[:, 1], projection.normal[:, 0]])
    expected = projection.level_curvature[:, None, None] * tangent[:, :, None] * tangent[:, None, :]
    # Points nearest to two places at once have no derivative; few random points come that close.
    smooth = np.abs(hessian).max(axis=(1, 2)) < 1e3
    assert smooth.mean() > 0.99
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(gradient[smooth], projection.normal[smooth], atol=1e-5)
    np.testing.assert_allclose(hessian[smooth], expected[smooth], atol=1e-3, rtol=1e-4)


def test_normals_do_not_jump_at_rounded_corners():
    s = np.linspace(0, ROUND.length, 20001)
    _, normal = ROUND.point_at(s)
    assert np.abs(np.diff(normal, axis=0)).max() < 2 * (s[1] - s[0]) / 0.8
    assert ROUND.smallest_radius == pytest.approx(0.8)
    assert NOTCHED.smallest_radius == 0.0


@given(
    angle=st.floats(-7, 7),
    x=st.floats(-50, 50),
    y=st.floats(-50, 50),
)
def test_distance_does_not_see_a_rigid_motion(angle, x, y):
    from geometry2d.rigid import RigidPlacement

    points = random_points(50)
    moved = NOTCHED.moved(angle, (x, y)).project(RigidPlacement(angle, (x, y)).apply(points))
    np.testing.assert_allclose(moved.distance, NOTCHED.project(points).distance, atol=1e-9)


@pytest.mark.parametrize(
    ("corners", "radii", "word"),
    [
        ([[0, 0], [0, 1], [1, 1], [1, 0]], 0.0, "clockwise"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], 0.0, "crosses"),
        ([[0, 0], [1, 0], [1, 1], [0, 1]], 0.7, "smaller radii"),
        ([[0, 0], [1, 0], [1, 0], [0, 1]], 0.0, "doubled"),
    ],
)
def test_what_bounds_no_solid_is_refused(corners, radii, word):
    with pytest.raises(OutlineError, match=word):
        Outline.from_corners(corners, radii)
