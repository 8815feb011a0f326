"""Surfaces with points at their nodes, and what is told of an edge between them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fem2d.body.surface import Surface, SurfaceError
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from geometry2d.outline import Outline
from geometry2d.rigid import RigidPlacement

STRAIGHT = np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [3.0, 0.0], [2.5, 0.0]])
TWO_QUADRATIC = np.array([[0, 1, 2], [1, 3, 4]])


@pytest.mark.parametrize(
    ("edges", "weights"),
    [
        (TWO_QUADRATIC, [[1 / 3, 4 / 3, 1 / 3], [1 / 6, 4 / 6, 1 / 6]]),
        (TWO_QUADRATIC[:, :2], [[1, 1], [0.5, 0.5]]),
    ],
)
def test_points_at_nodes_are_the_nodes_in_order_with_newton_cotes_weights(edges, weights):
    surface = Surface(edges, STRAIGHT, thickness_mm=3.0, at_nodes=True)
    along = surface.positions(np.zeros_like(STRAIGHT))[..., 0]
    assert np.all(np.diff(along, axis=1) > 0)
    np.testing.assert_allclose(along, surface.arc_length, atol=1e-14)
    assert surface.arc_length[0, -1] == surface.arc_length[1, 0]
    np.testing.assert_allclose(surface.weight, 3.0 * np.array(weights), rtol=1e-14)


def test_a_uniform_traction_at_nodes_gives_the_forces_that_gauss_points_give():
    rng = np.random.default_rng(1)
    nodes = STRAIGHT + 0.1 * rng.standard_normal(STRAIGHT.shape)
    nodes[[2, 4]] = 0.5 * (nodes[[0, 1]] + nodes[[1, 3]])
    forces = []
    for options in ({"at_nodes": True}, {"points_per_edge": 4}):
        surface = Surface(TWO_QUADRATIC, nodes, **options)
        uniform = np.broadcast_to([0.3, -0.7], (*surface.weight.shape, 2))
        dofs, nodal = surface.assembled_force(uniform)
        force = np.zeros(nodes.size)
        np.add.at(force, dofs, nodal)
        forces.append(force)
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-13)


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("edges", [TWO_QUADRATIC, TWO_QUADRATIC[:, :2]])
def test_points_between_nodes_leave_the_nodes_as_they_are(edges, count):
    nodal = Surface(edges, STRAIGHT, thickness_mm=3.0, at_nodes=True)
    surface = Surface(edges, STRAIGHT, thickness_mm=3.0, at_nodes=True, between_nodes=count)
    intervals = edges.shape[1] - 1
    assert surface.is_between.sum() == count * intervals
    assert np.all(np.diff(surface.arc_length[0]) == pytest.approx(2.0 / intervals / (count + 1)))
    for name in ("weight", "arc_length", "reference_speed"):
        np.testing.assert_array_equal(surface.nodal(getattr(surface, name)), getattr(nodal, name))


@given(
    between=st.integers(0, 3),
    density=arrays(float, (2, 7), elements=st.floats(-1, 1)),
)
def test_what_nodes_carry_are_the_nodal_forces_and_add_up_to_the_load(between, density):
    surface = Surface(
        TWO_QUADRATIC, STRAIGHT, thickness_mm=1.7, at_nodes=True, between_nodes=between
    )
    load = density[:, : surface.is_between.size]
    load = np.pad(load, [(0, 0), (0, surface.is_between.size - load.shape[1])])
    carried = surface.carried(load)
    upwards = np.stack([np.zeros_like(load), load], axis=-1)
    _, force = surface.assembled_force(upwards)
    first, last, middle = force.reshape(2, 3, 2)[..., 1].T
    np.testing.assert_allclose(carried, np.column_stack([first, middle, last]), atol=1e-14)
    assert carried.sum() == pytest.approx((surface.weight * load).sum(), abs=1e-13)


def test_points_between_nodes_need_points_at_nodes():
    with pytest.raises(SurfaceError, match="set at_nodes too"):
        Surface(TWO_QUADRATIC, STRAIGHT, between_nodes=2)


@pytest.mark.parametrize("away_mm", [0.0, 0.04, 0.3, 5.0])
def test_the_deepest_penetration_between_nodes_is_a_circles_sagitta(away_mm):
    radius = 1.3
    surface = Surface(TWO_QUADRATIC[:1], STRAIGHT, at_nodes=True)
    circle = Outline.circle([0.5, np.sqrt(radius**2 - 0.5**2) + away_mm], radius)
    pair = RigidContact(
        surface, circle, normal=NormalLaw(), friction=FrictionLaw(0.0), name="circle"
    )
    at_rest, still = RigidPlacement(0.0, (0.0, 0.0)), np.zeros_like(STRAIGHT)
    response = pair.evaluate(still, at_rest, pair.initial_state(still, at_rest))
    # The circle passes through the nodes at 0 and 1 mm and is deepest between them.
    sagitta = radius - np.sqrt(radius**2 - 0.5**2)
    wanted = max(0.0, sagitta - away_mm)
    assert response.points.gap.min() > -1e-12
    assert pair.deepest(response) == pytest.approx(wanted, abs=0.006)
