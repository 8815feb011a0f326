"""Contact forces against finite differences: in gap, stick, slip, on lines, arcs and corners."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem2d.body.surface import Surface
from fem2d.contact.laws import FrictionLaw, NormalLaw, pressure_of_gap, traction_of_slip
from fem2d.contact.rigid import RigidContact, RigidContactState
from geometry2d.outline import Outline
from geometry2d.rigid import RigidPlacement
from tests.support.differences import central_differences, stiffness_and_differences
from tests.support.differences import total_force as force_at

THREADED = Outline.from_corners(
    [[0, 0], [12, 0], [12, 4], [9, 4], [8.2, 5], [7, 5], [6.2, 4], [4, 4], [3, 5], [2, 5],
     [1, 4], [0, 4]],
    [0, 0, 0.5, 0.3, 0.4, 0.4, 0.3, 0.3, 0.4, 0.4, 0, 0.5],
)  # fmt: skip
PLACEMENT = RigidPlacement(0.37, (1.5, -2.2))


GAUSS = {"points_per_edge": 4}
WATCHED = {"at_nodes": True, "between_nodes": 2}


def pair(coefficient: float, edge_nodes: int = 3, points: dict = GAUSS) -> RigidContact:
    """A surface that lies close along the threads, seen from above."""
    x = np.linspace(11.5, 0.5, 41)
    arc = THREADED.sampled(0.01)
    top = np.array([arc[np.abs(arc[:, 0] - v) < 0.02][:, 1].max() for v in x])
    nodes = PLACEMENT.apply(np.column_stack([x, top]))
    count = len(nodes)
    if edge_nodes == 3:
        edges = np.column_stack(
            [np.arange(0, count - 2, 2), np.arange(2, count, 2), np.arange(1, count - 1, 2)]
        )
    else:
        edges = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    return RigidContact(
        Surface(edges, nodes, thickness_mm=1.3, **points),
        THREADED,
        normal=NormalLaw(stiffness_mpa_per_mm=20.0, ramp_mm=0.05, gap_offset_mm=0.01),
        friction=FrictionLaw(coefficient=coefficient, stiffness_mpa_per_mm=3.0),
        name="tissue on threads",
    )


def pressed(contact: RigidContact, seed: int) -> tuple[np.ndarray, RigidContactState]:
    """A displacement that presses and slides, and a committed history that already sticks."""
    rng = np.random.default_rng(seed)
    nodes = contact.surface.nodes
    start = contact.initial_state(np.zeros_like(nodes), PLACEMENT)
    history = RigidContactState(start.body_position, rng.uniform(-0.3, 0.3, start.traction.shape))
    return rng.uniform(-0.08, 0.08, nodes.shape), history


def total_force(contact, displacement, history, placement=PLACEMENT):
    return force_at(contact, displacement, history, placement)


@pytest.mark.parametrize("points", [GAUSS, WATCHED])
@pytest.mark.parametrize("edge_nodes", [2, 3])
@pytest.mark.parametrize(("coefficient", "state"), [(0.0, "none"), (0.2, "slip"), (50.0, "stick")])
def test_stiffness_is_the_derivative_of_the_force(coefficient, state, edge_nodes, points):
    contact = pair(min(coefficient, 10.0), edge_nodes, points)
    displacement, history = pressed(contact, 3)
    _, response = total_force(contact, displacement, history)
    touching = response.points.pressure > 0
    assert touching.mean() > 0.2
    if state == "slip":
        assert response.points.slipping[touching].mean() > 0.5
    if state == "stick":
        assert (~response.points.slipping[touching]).mean() > 0.5
    stiffness, numeric = stiffness_and_differences(contact, displacement, history, PLACEMENT)
    assert np.abs(stiffness).max() > 1.0
    # A Gauss point that switches between stick and slip, or between line and arc, within the
    # difference step has no derivative; with these seeds none does.
    np.testing.assert_allclose(stiffness, numeric, atol=2e-6 * np.abs(stiffness).max())


@pytest.mark.parametrize("points", [GAUSS, WATCHED])
def test_force_is_minus_the_derivative_of_the_penalty_energy(points):
    contact = pair(0.0, points=points)
    displacement, history = pressed(contact, 5)
    force, _ = total_force(contact, displacement, history)
    assert np.abs(force).max() > 0.01
    numeric = -central_differences(
        lambda u: contact.evaluate(u, PLACEMENT, history).energy, displacement, 1e-6
    )
    np.testing.assert_allclose(force, numeric, atol=1e-7 * np.abs(force).max() + 1e-9)


def test_motion_of_the_rigid_body_is_predicted_to_first_order():
    contact = pair(10.0)
    displacement, history = pressed(contact, 8)
    _, response = total_force(contact, displacement, history)
    here = contact.evaluate(displacement, PLACEMENT, response.state)
    small = 1e-5
    moved = RigidPlacement(PLACEMENT.angle_rad + 0.3 * small, (1.5 + small, -2.2 - 2 * small))
    after = contact.evaluate(displacement, moved, response.state)
    # A point that slipped and is now dragged back sticks: that is no small change. Leave it out.
    same = np.isin(here.edges, np.flatnonzero(~np.any(here.points.slipping, axis=1)))
    assert same.sum() > 5
    predicted = contact.force_of_motion(here, moved)[same]
    change = after.force[np.isin(after.edges, here.edges[same])] - here.force[same]
    assert np.abs(predicted).max() > 1e-6
    np.testing.assert_allclose(change, predicted, atol=2e-3 * np.abs(predicted).max())


def test_evaluating_leaves_no_trace():
    contact = pair(0.7)
    displacement, history = pressed(contact, 11)
    first, _ = total_force(contact, displacement, history)
    total_force(contact, displacement + 5.0, history)
    again, _ = total_force(contact, displacement, history)
    assert np.array_equal(first, again)


@given(
    coefficient=st.floats(0, 2),
    seed=st.integers(0, 1000),
)
def test_friction_never_exceeds_the_coulomb_bound(coefficient, seed):
    contact = pair(coefficient)
    displacement, history = pressed(contact, seed)
    _, response = total_force(contact, displacement, history)
    points = response.points
    assert np.all(np.abs(points.shear) <= coefficient * points.pressure * (1 + 1e-12))
    assert np.all(points.pressure >= 0)


@given(angle=st.floats(-3, 3), x=st.floats(-20, 20), y=st.floats(-20, 20))
def test_rotating_everything_rotates_the_forces(angle, x, y):
    contact = pair(0.6)
    displacement, history = pressed(contact, 2)
    force, _ = total_force(contact, displacement, history)
    world = RigidPlacement(angle, (x, y))
    turned = RigidContact(
        Surface(contact.surface.edges, world.apply(contact.surface.nodes), thickness_mm=1.3),
        contact.outline,
        normal=contact.normal,
        friction=contact.friction,
        name=contact.name,
    )
    placement = RigidPlacement(PLACEMENT.angle_rad + angle, tuple(world.apply(PLACEMENT.shift_mm)))
    rotation = RigidPlacement(angle, (0.0, 0.0))
    there, _ = total_force(turned, rotation.apply(displacement), history, placement)
    np.testing.assert_allclose(
        there.reshape(-1, 2), rotation.apply(force.reshape(-1, 2)), atol=1e-9
    )


@given(gap=st.floats(-0.02, 0.01))
def test_pressure_is_the_derivative_of_its_energy(gap):
    step = 1e-7
    plus, minus = (pressure_of_gap(gap + s, 30.0, 0.004) for s in (step, -step))
    _, pressure, slope = pressure_of_gap(gap, 30.0, 0.004)
    assert pressure == pytest.approx(-(plus[0] - minus[0]) / (2 * step), abs=1e-7)
    assert slope == pytest.approx((plus[1] - minus[1]) / (2 * step), abs=1e-3 + 1e-6 * abs(slope))


@given(before=st.floats(-1, 1), slip=st.floats(-1, 1), pressure=st.floats(0, 1), mu=st.floats(0, 2))
def test_friction_follows_stiffness_until_the_bound(before, slip, pressure, mu):
    traction, by_slip, by_pressure, slipping = traction_of_slip(before, slip, pressure, mu, 2.0)
    trial = before - 2.0 * slip
    if slipping:
        assert abs(traction) == pytest.approx(mu * pressure if trial != 0 else 0.0)
        assert by_slip == 0.0
        assert by_pressure * pressure == pytest.approx(traction)
    else:
        assert traction == trial
        assert by_slip == -2.0


def test_a_point_between_nodes_bears_nothing_up_to_the_gap_offset_and_then_the_law():
    contact = pair(0.7, points=WATCHED)
    displacement, history = pressed(contact, 13)
    _, response = total_force(contact, displacement, history)
    between = contact.surface.is_between
    gap, pressure = response.points.gap[:, between], response.points.pressure[:, between]
    spared = (gap < 0) & (gap > -0.01)
    assert spared.sum() > 3 and (gap < -0.02).sum() > 3
    law = [pressure_of_gap(g + 0.01, 20.0, 0.05)[1] for g in gap.ravel()]
    np.testing.assert_allclose(pressure.ravel(), law, atol=1e-15)
    assert not pressure[spared].any()


def test_every_point_starts_to_stick_where_it_begins_to_bear():
    contact = pair(0.7, points=WATCHED)
    nodes = contact.surface.nodes
    above = np.zeros_like(nodes) + PLACEMENT.apply([[0, 0.03]]) - PLACEMENT.apply([[0, 0]])
    below = PLACEMENT.apply([[0.01, -0.05]]) - PLACEMENT.apply([[0, 0]]) + np.zeros_like(nodes)
    start = contact.initial_state(above, PLACEMENT)
    met = contact.with_first_contact(start, above, below, PLACEMENT)
    changed = np.any(met.body_position != start.body_position, axis=-1)
    assert changed[:, contact.surface.is_between].sum() > 20
    where = THREADED.project(met.body_position.reshape(-1, 2)).distance.reshape(changed.shape)
    begins = np.where(contact.surface.is_between, -0.01, 0.0) + np.zeros(changed.shape)
    np.testing.assert_allclose(where[changed], begins[changed], atol=1e-4)
