"""Contact between deformable surfaces: derivative, balance, history, on curves and at corners."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem2d.body.surface import Surface
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.self_contact import NONE, SelfContact, SelfContactError
from geometry2d.rigid import RigidPlacement, rotated
from tests.support.differences import stiffness_and_differences
from tests.support.differences import total_force as force_at

NOWHERE = RigidPlacement(0.0, (0.0, 0.0))


def chain(points, nodes_per_edge, first):
    """Edges along a row of points that starts at node ``first``."""
    last = first + len(points) - 1
    if nodes_per_edge == 2:
        return np.column_stack([np.arange(first, last), np.arange(first + 1, last + 1)])
    return np.column_stack(
        [
            np.arange(first, last, 2),
            np.arange(first + 2, last + 1, 2),
            np.arange(first + 1, last, 2),
        ]
    )


def two_surfaces(coefficient, nodes_per_edge, corner=False):
    """A wavy surface below, run right to left, and one with other nodes above, left to right."""
    below_x = np.linspace(10, 0, 21)
    below = np.column_stack([below_x, 0.3 * np.sin(below_x)])
    above_x = np.linspace(0.4, 9.7, 27)
    above = np.column_stack([above_x, 0.3 * np.sin(above_x)])
    if corner:  # a roof that sinks into a flat surface with its ridge
        below[:, 1] = 0.0
        above[:, 1] = 0.35 * np.abs(above_x - above_x[13]) - 0.1
    nodes = np.concatenate([below, above])
    surfaces = (
        Surface(chain(below, nodes_per_edge, 0), nodes, 1.3, 3),
        Surface(chain(above, nodes_per_edge, len(below)), nodes, 1.3, 3),
    )
    return SelfContact(
        surfaces,
        normal=NormalLaw(20.0, 0.02),
        friction=FrictionLaw(coefficient, 3.0),
        reach_mm=0.6,
        name="two",
    )


def pressed(contact, seed, size=0.05):
    """A displacement that presses and slides, and a history that already holds tractions.

    The upper surface was 0.06 mm higher then: a ridge at rest lies 0.1 mm deep in what is below.
    """
    rng = np.random.default_rng(seed)
    nodes = contact.surfaces[0].nodes
    history = contact.initial_state(lifted(contact, (0.0, 0.06)), NOWHERE)
    history = replace(history, traction=rng.uniform(-0.2, 0.2, history.traction.shape))
    return rng.uniform(-size, size, nodes.shape), history


def total(contact, displacement, history):
    return force_at(contact, displacement, history, NOWHERE)


@pytest.mark.parametrize("corner", [False, True])
@pytest.mark.parametrize("nodes_per_edge", [2, 3])
@pytest.mark.parametrize(("coefficient", "state"), [(0.0, "none"), (0.2, "slip"), (10.0, "stick")])
def test_stiffness_is_the_derivative_of_the_force(coefficient, state, nodes_per_edge, corner):
    # At the corner the pressure is higher, and so is the bound.
    contact = two_surfaces(coefficient / (4 if corner else 1), nodes_per_edge, corner)
    displacement, history = pressed(contact, 3, 0.01 if corner else 0.05)
    _, response = total(contact, displacement, history)
    touching = response.touching
    assert len(touching) >= 4
    slipping = response.points.slipping[touching]
    if state == "slip":
        assert slipping.mean() > 0.4
    if state == "stick":
        assert (~slipping).mean() > 0.5
    assert_stiffness_is_derivative(contact, displacement, history)


def assert_stiffness_is_derivative(contact, displacement, history):
    stiffness, numeric = stiffness_and_differences(contact, displacement, history, NOWHERE)
    assert np.abs(stiffness).max() > 0.5
    np.testing.assert_allclose(stiffness, numeric, atol=3e-6 * np.abs(stiffness).max())


def lifted(contact, by):
    """A displacement that takes the upper surface away by ``by`` (2,), mm."""
    displacement = np.zeros_like(contact.surfaces[0].nodes)
    displacement[np.unique(contact.surfaces[1].edges)] = by
    return displacement


@pytest.mark.parametrize("nodes_per_edge", [2, 3])
@pytest.mark.parametrize("height", [0.4, 2.0])
def test_slip_is_counted_from_where_a_falling_point_touches(nodes_per_edge, height):
    # Both within reach (0.6 mm) at first and out of it. Where the gap vanishes on the way is found
    # anew here, by bisection of the whole surfaces' displacement.
    contact = two_surfaces(0.5, nodes_per_edge)
    start = lifted(contact, (-0.3, height))
    end = pressed(contact, 3)[0] + lifted(contact, (0.1, -0.02))
    history = contact.initial_state(start, NOWHERE)
    reached = contact.with_first_contact(history, start, end, NOWHERE)
    closed = contact.evaluate(end, NOWHERE, history).points.gap < 0
    assert 10 < closed.sum() < len(closed) - 10
    for name in ("anchor", "anchor_local"):
        kept = getattr(history, name)[~closed]
        np.testing.assert_array_equal(getattr(reached, name)[~closed], kept)
    way = np.linalg.norm(end - start, axis=1).max()
    errors = []
    for i in np.flatnonzero(closed)[::5]:
        outside, inside = 0.0, 1.0
        for _ in range(30):
            share = 0.5 * (outside + inside)
            there = contact.evaluate(start + share * (end - start), NOWHERE, history).points
            outside, inside = (share, inside) if there.gap[i] > 0 else (outside, share)
        touch = contact.arc_length(there.met_edge[[i]], there.met_local[[i]])
        found = contact.arc_length(reached.anchor[[i]], reached.anchor_local[[i]])
        errors.append(abs(float(found[0] - touch[0])))
    # Three trials of false position; the curved surfaces slide along each other as they close.
    assert np.median(errors) < 1e-6 * way
    assert np.max(errors) < 1e-3 * way
    assert_stiffness_is_derivative(contact, end, reached)


def test_what_touches_already_or_stays_apart_keeps_its_history():
    contact = two_surfaces(0.5, 3)
    far, near = lifted(contact, (0.0, 0.4)), lifted(contact, (0.2, 0.3))
    history = contact.initial_state(far, NOWHERE)
    assert contact.with_first_contact(history, far, near, NOWHERE) is history
    closed, _ = pressed(contact, 3, 0.0)
    history = contact.initial_state(closed, NOWHERE)
    touching = contact.evaluate(closed, NOWHERE, history).points.gap <= 0
    slid = closed + lifted(contact, (0.05, 0.0))
    reached = contact.with_first_contact(history, closed, slid, NOWHERE)
    assert touching.sum() > 10
    np.testing.assert_array_equal(reached.anchor[touching], history.anchor[touching])
    np.testing.assert_array_equal(reached.anchor_local[touching], history.anchor_local[touching])


@given(seed=st.integers(0, 10**6), coefficient=st.floats(0, 2))
@settings(max_examples=25, deadline=None)
def test_action_equals_reaction_and_friction_keeps_its_law(seed, coefficient):
    contact = two_surfaces(coefficient, 3)
    displacement, history = pressed(contact, seed)
    force, response = total(contact, displacement, history)
    size = np.abs(force).sum()
    assert size > 0
    force = force.reshape(-1, 2)
    place = contact.surfaces[0].nodes + displacement
    np.testing.assert_allclose(force.sum(axis=0), 0, atol=1e-13 * size)
    moment = np.sum(place[:, 0] * force[:, 1] - place[:, 1] * force[:, 0])
    points, touching = response.points, response.touching
    couple = points.gap[touching] * points.shear[touching] * history.weight[touching]
    assert moment == pytest.approx(-couple.sum(), abs=1e-11 * size)
    assert np.all(np.abs(points.shear) <= coefficient * points.pressure * (1 + 1e-12))


@given(angle=st.floats(-3, 3), x=st.floats(-20, 20), y=st.floats(-20, 20))
@settings(max_examples=20, deadline=None)
def test_turning_everything_turns_the_forces(angle, x, y):
    contact = two_surfaces(0.6, 3)
    displacement, history = pressed(contact, 2)
    force, _ = total(contact, displacement, history)
    world = RigidPlacement(angle, (x, y))
    nodes = world.apply(contact.surfaces[0].nodes)
    surfaces = tuple(Surface(s.edges, nodes, s.thickness_mm, 3) for s in contact.surfaces)
    turned = replace(contact, surfaces=surfaces)
    there, _ = total(turned, rotated(displacement, angle), history)
    np.testing.assert_allclose(
        there.reshape(-1, 2), rotated(force.reshape(-1, 2), angle), atol=1e-9
    )


def test_a_rigid_turn_after_sticking_brings_no_slip():
    contact = two_surfaces(1.0, 3)
    nodes = contact.surfaces[0].nodes
    displacement, history = pressed(contact, 7)
    _, response = total(contact, displacement, history)
    history = response.state
    turned = rotated(nodes + displacement, 0.7) - nodes
    here = contact.evaluate(displacement, NOWHERE, history).points
    there = contact.evaluate(turned, NOWHERE, history).points
    assert (here.pressure > 0).sum() > 5
    np.testing.assert_allclose(there.shear, here.shear, atol=1e-12)
    np.testing.assert_allclose(there.pressure, here.pressure, atol=1e-11)


def test_committing_keeps_what_friction_remembers():
    contact = two_surfaces(0.5, 3)
    displacement, history = pressed(contact, 9)
    _, response = total(contact, displacement, history)
    again = contact.evaluate(displacement, NOWHERE, response.state)
    once_more = contact.evaluate(displacement, NOWHERE, again.state)
    # The segments have settled at this displacement: from now on nothing changes any more.
    np.testing.assert_allclose(once_more.points.shear, again.points.shear, atol=1e-13)
    np.testing.assert_allclose(once_more.force.sum(axis=0), again.force.sum(axis=0), atol=1e-13)
    first = contact.evaluate(displacement, NOWHERE, history).points
    assert np.all(np.abs(again.points.shear).max() <= np.abs(first.shear).max() * 1.2)


def test_a_fold_meets_itself_but_not_its_neighbours():
    # A surface that runs down one bank of a groove and up the other.
    down = np.column_stack([np.full(11, -0.02), np.linspace(2, 0, 11)])
    up = np.column_stack([np.full(11, 0.02), np.linspace(0.0, 2, 11)])
    nodes = np.concatenate([down, [[0.0, -0.05]], up])[::-1].copy()
    edges = np.column_stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))])
    surface = Surface(edges, nodes, points_per_edge=2)
    fold = SelfContact(
        (surface,),
        normal=NormalLaw(10.0, 1e-3),
        friction=FrictionLaw(0.0),
        reach_mm=0.2,
        same_surface=True,
        name="fold",
    )
    narrowed = np.zeros_like(nodes)
    narrowed[:, 0] = -1.2 * nodes[:, 0]
    history = fold.initial_state(np.zeros_like(nodes), NOWHERE)
    apart = fold.evaluate(np.zeros_like(nodes), NOWHERE, history)
    assert apart.touching.size == 0
    assert np.count_nonzero(apart.points.met_edge != NONE) > 30
    assert np.median(apart.points.gap[apart.points.met_edge != NONE]) == pytest.approx(0.04)
    overlapping = fold.evaluate(narrowed, NOWHERE, history)
    assert overlapping.touching.size > 30
    pushed = np.zeros(nodes.size)
    np.add.at(pushed, overlapping.dofs, overlapping.force)
    # The bank that was on the right lies on the left now and is pushed back to the right.
    assert pushed.reshape(-1, 2)[nodes[:, 0] > 0.01, 0].sum() > 0.01
    assert pushed.reshape(-1, 2)[nodes[:, 0] < -0.01, 0].sum() < -0.01


def test_a_thin_tongue_does_not_touch_itself_through_its_own_tissue():
    # A surface that runs out along one side of a tongue of tissue, 0.3 mm thick, and back along the
    # other; it is bent, thinned to a half and thickened, and never gone through.
    out = np.column_stack([np.linspace(0, 2, 11), np.full(11, -0.15)])
    nodes = np.concatenate([out, [[2.1, 0.0]], out[::-1] * [1, -1]])
    edges = np.column_stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))])
    tongue = SelfContact(
        (Surface(edges, nodes),),
        normal=NormalLaw(),
        friction=FrictionLaw(0.3),
        reach_mm=0.5,
        same_surface=True,
        name="tongue",
    )
    x, y = nodes.T
    still = np.zeros_like(nodes)
    history = tongue.initial_state(still, NOWHERE)
    ways = (
        still,
        np.column_stack([0 * x, -0.5 * y]),
        np.column_stack([0 * x, 0.5 * y]),
        np.column_stack([-0.2 * x * y, 0.1 * x**2]),
    )
    for displacement in ways:
        response = tongue.evaluate(displacement, NOWHERE, history)
        assert np.all(response.points.gap > 0)
        assert response.touching.size == 0
        assert np.all(response.state.anchor == NONE)


def test_what_was_in_front_touches_however_near_it_lies_along_the_surface():
    # The banks of a groove as wide as one short edge close and cross.
    nodes = np.array([[1.0, -0.1], [0.0, -0.1], [0.0, 0.1], [1.0, 0.1]])
    groove = SelfContact(
        (Surface(np.array([[0, 1], [1, 2], [2, 3]]), nodes),),
        normal=NormalLaw(10.0, 1e-3),
        friction=FrictionLaw(0.0),
        reach_mm=0.5,
        same_surface=True,
        name="groove",
    )
    history = groove.initial_state(np.zeros_like(nodes), NOWHERE)
    narrowed, crossed = nodes * [0.0, -0.9], nodes * [0.0, -1.2]
    assert groove.evaluate(narrowed, NOWHERE, history).touching.size == 0
    force, response = total(groove, crossed, history)
    on_banks = history.edge != 1
    assert 0 < on_banks.sum() == response.touching.size
    np.testing.assert_allclose(response.points.gap[on_banks], -0.04)
    assert max(force[1], force[3]) < 0 < min(force[5], force[7])


def crease(shape):
    """Two edges (quadratic) that share a node at the origin, the second the mirror image of the
    first, whose nodes lie on (x, −shape(x)) for x = 1, 0.5 and 0: a valley if shape(x) > 0."""
    x = np.array([1.0, 0.5, 0.0, 0.5, 1.0])
    nodes = np.column_stack([x, shape(x) * [-1, -1, 0, 1, 1]])
    surface = Surface(np.array([[0, 2, 1], [2, 4, 3]]), nodes)
    return SelfContact(
        (surface,),
        normal=NormalLaw(10.0, 1e-3),
        friction=FrictionLaw(0.3),
        reach_mm=0.5,
        same_surface=True,
        name="crease",
    )


@pytest.mark.parametrize("shape", [lambda x: 0.2 * x, lambda x: 0.2 * x**2, lambda x: 0.3 * x**0.5])
def test_the_sides_of_a_crease_touch_up_to_the_node_they_share(shape):
    valley = crease(shape)
    nodes = valley.surfaces[0].nodes
    history = valley.initial_state(np.zeros_like(nodes), NOWHERE)
    nearly, crossed, farther = (nodes * [0.0, -share] for share in (0.95, 1.05, 1.1))
    assert valley.evaluate(nearly, NOWHERE, history).touching.size == 0
    for start in (history, valley.evaluate(crossed, NOWHERE, history).state):
        force, response = total(valley, farther, start)
        assert start.weight[response.touching].sum() > 0.9 * start.weight.sum()
        assert max(force[1], force[3]) < 0 < min(force[7], force[9])
        assert_stiffness_is_derivative(valley, farther, start)


def test_the_sides_of_a_tip_never_touch_each_other():
    tip = crease(lambda x: -0.2 * x)
    nodes = tip.surfaces[0].nodes
    history = tip.initial_state(np.zeros_like(nodes), NOWHERE)
    for share in (0.5, 0.0, -0.3, -0.6):
        response = tip.evaluate(nodes * [0.0, share], NOWHERE, history)
        assert response.touching.size == 0
        history = response.state


def test_an_edge_that_runs_back_touches_nothing_where_it_does():
    # Squeezed until its middle lies beyond the node it shares with the next edge: there its normal
    # points into the tissue, and the nearly straight line of both looks like a closed crease.
    undeformed = np.array([[-0.4, 0.0], [-0.2, 0.0], [0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    squeezed = np.array(
        [[-0.064, 0.073], [0.095, -0.028], [0.0, 0.0], [0.555, -0.311], [0.872, -0.617]]
    )
    wall = np.array([[-0.5, -0.2], [0.2, -0.15], [1.0, -0.1]])
    nodes = np.concatenate([undeformed, wall])
    line = Surface(np.array([[0, 2, 1], [2, 4, 3]]), nodes)
    contact = SelfContact(
        (line, Surface(np.array([[5, 7, 6]]), nodes)),
        normal=NormalLaw(),
        friction=FrictionLaw(0.3),
        reach_mm=0.5,
        same_surface=True,
        name="line",
    )
    displacement = np.concatenate([squeezed - undeformed, np.zeros_like(wall)])
    history = contact.initial_state(np.zeros_like(nodes), NOWHERE)
    for _ in range(2):
        points = contact.evaluate(displacement, NOWHERE, history).points
        local, first = history.local, history.edge == 0
        backwards = first & (local > 0.6)
        assert backwards.sum() > 0
        assert np.all(points.met_edge[backwards] == NONE)
        # Neither of the two sees the other, wherever they run.
        assert np.all(points.met_edge[first] != 1)
        assert np.all(points.met_edge[history.edge == 1] != 0)
        history = contact.evaluate(displacement, NOWHERE, history).state


def test_what_makes_no_sense_is_refused():
    contact = two_surfaces(0.5, 3)
    with pytest.raises(SelfContactError, match="one surface with nothing"):
        replace(contact, surfaces=contact.surfaces[:1])
    with pytest.raises(SelfContactError, match="must be positive"):
        replace(contact, reach_mm=0.0)
    other = Surface(contact.surfaces[1].edges, contact.surfaces[1].nodes.copy())
    with pytest.raises(SelfContactError, match="different bodies"):
        replace(contact, surfaces=(contact.surfaces[0], other))
