"""Tissue in components: each balances as in the whole, and what they do to each other is seen."""

from dataclasses import fields, replace

import numpy as np
import pytest

import fem2d.solvers.step
import fem2d.solvers.stepper
from fem2d.body.definition import BodyError
from fem2d.body.surface import Surface
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.dead import DeadLoad
from fem2d.loads.load import Load
from fem2d.loads.tie import ElasticTie
from fem2d.materials.prony import PronySeries
from fem2d.solvers.components import component_of_node, components_of
from fem2d.solvers.inertia import Inertia
from fem2d.solvers.linear import SuperLu, fastest_solver
from fem2d.solvers.march import MarchStatus, march
from fem2d.solvers.model import Model
from fem2d.solvers.step_control import StepSettings
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion
from tests.support.contact_models import FINE, block, linear_elastic
from tests.support.marks import slow
from tests.support.two_bodies import between, joined

GAP_MM = 0.3
SERIES = PronySeries((0.5, 0.2), (0.1, 1.0))


def two_blocks(**members) -> Model:
    """A block on bone and, above it and apart from it, one on weak ties that a plate may push."""
    material = linear_elastic(1.0, 0.4)
    lower = block(np.linspace(-1.5, 1.5, 9), np.linspace(-1, 0, 4), material, element="T6")
    upper = block(
        np.linspace(-1, 1, 8), np.linspace(GAP_MM, GAP_MM + 0.8, 4), material, element="T6"
    )
    body = joined(lower, upper, {"lower": material, "upper": linear_elastic(0.5, 0.4)}, "T6")

    def surface(name: str) -> Surface:
        return body.surface(name)

    plate = Outline.from_corners([(-3, 0), (3, 0), (3, 1), (-3, 1)], 0.1)
    law = NormalLaw(50.0, 1e-3)
    contacts = tuple(
        RigidContact(surface(side), plate, normal=law, friction=FrictionLaw(0.6, 20.0), name=side)
        for side in ("upper_top", "lower_left")
    )
    pull = DeadLoad(
        surface("lower_right"),
        from_mm=0.1,
        to_mm=0.9,
        fade_mm=0.1,
        traction_mpa=(0.02, 0.0),
        amplitude=Amplitude((0.0, 1.0), (0.0, 1.0)),
    )
    return Model(
        body,
        contacts=(*contacts, between(body, law, FrictionLaw(0.3, 20.0), points=3)),
        ties=(
            ElasticTie(surface("lower_bottom"), 100.0, name="bone"),
            ElasticTie(surface("upper_left"), 0.3, fade_mm=0.2, name="left"),
            ElasticTie(surface("upper_right"), 0.3, fade_mm=0.2, name="right"),
        ),
        loads=(pull,),
        inertia=Inertia(1e-9, relaxation_s=0.01),
        **members,
    )


def pushed(down_mm: float) -> RigidMotion:
    """The plate comes down a second long, on a slant, and goes back up in the next."""
    times = np.array([0.0, 1.0, 2.0])
    top = GAP_MM + 0.8 + 0.02
    shift = [(0.0, top), (0.1, top - down_mm), (0.0, top + 0.1)]
    return RigidMotion(times, np.zeros(3), np.array(shift))


def at_rest(system: Model, motion: RigidMotion):
    return system.at_rest(Load.at(motion.at(0.0), 0.0), next_step_s=0.05)


def marched(system, motion, start=None, solver=None, **options):
    commits = []
    result = march(
        system,
        motion,
        start or at_rest(system, motion),
        solver=solver or fastest_solver(),
        steps=StepSettings(longest_s=0.05),
        newton=FINE,
        on_commit=commits.append,
        **options,
    )
    assert result.status is MarchStatus.FINISHED
    return commits


@pytest.mark.parametrize("prony", [None, SERIES], ids=["elastic", "viscous"])
def test_a_component_balances_as_it_does_in_the_whole(prony):
    system, motion = two_blocks(prony=prony), pushed(0.1)
    state = marched(system, motion, end_s=0.7)[-1].state
    assert state.contacts[0].traction.any()
    rng = np.random.default_rng(3)
    displacement = state.displacement + 1e-3 * rng.normal(size=state.displacement.shape)
    load = Load.at(motion.at(0.72), 0.72)
    whole = system.balance(displacement, load, state, 0.02)
    tangent = whole.tangent(False).matrix
    components = components_of(system)
    assert [len(component.place.nodes) for component in components] == [119, 105]
    nodes = np.concatenate([component.place.nodes for component in components])
    assert sorted(nodes) == list(range(224))
    for component in components:
        own, nodes, dofs = component.state(state), component.place.nodes, component.place.dofs
        alone = component.model.balance(displacement[nodes], component.load(load), own, 0.02)
        scale = np.abs(whole.residual).max()
        assert scale > 1e-3
        np.testing.assert_allclose(alone.residual, whole.residual[dofs], atol=1e-13 * scale)
        difference = alone.tangent(False).matrix - tangent[dofs][:, dofs]
        assert abs(difference).max() < 1e-13 * abs(tangent).max()
        share = component.response(system.body.response(displacement))
        expected = component.model.body.response(displacement[nodes])
        np.testing.assert_allclose(share.force, expected.force, atol=1e-15)
        np.testing.assert_allclose(share.stiffness, expected.stiffness, atol=1e-14)


def test_what_touches_nothing_of_the_other_takes_no_iterations_of_the_whole(monkeypatch):
    system, motion = two_blocks(), pushed(0.1)
    asked = []
    solved = fem2d.solvers.step.solve

    def watched(balance_at, start, **options):
        result, balance = solved(balance_at, start, **options)
        if len(start) == system.body.nodes.size:
            asked.append(result.iterations)
        return result, balance

    monkeypatch.setattr(fem2d.solvers.step, "solve", watched)
    commits = marched(system, motion)
    assert max(commit.contacts[0].energy for commit in commits) > 0
    assert len(asked) >= len(commits)
    assert set(asked) == {0}


@pytest.mark.parametrize("down_mm", [0.1, slow(0.6)])
def test_components_and_whole_go_the_same_way(monkeypatch, down_mm):
    """Apart all the time, or pressed on each other, which no component by itself knows of."""
    system, motion = two_blocks(), pushed(down_mm)
    commits = marched(system, motion)
    number = component_of_node(system)
    together = [any(touch.joins(number) for touch in commit.contacts) for commit in commits]
    assert any(together) == (down_mm > GAP_MM)
    assert not together[0]
    monkeypatch.setattr(fem2d.solvers.stepper, "components_of", lambda model: ())
    assert max(commit.newton.imbalance for commit in commits) <= FINE.tolerance
    whole = marched(system, motion)
    found, expected = commits[-1].state.displacement, whole[-1].state.displacement
    # Steps need not be the same, and what sticks and slips remembers them.
    np.testing.assert_allclose(found, expected, atol=1e-3)
    peaks = [
        max(float(np.max(commit.contacts[0].points.pressure)) for commit in run)
        for run in (commits, whole)
    ]
    assert peaks[0] == pytest.approx(peaks[1], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("prony", [None, SERIES], ids=["elastic", "viscous"])
def test_a_march_by_components_goes_on_bit_for_bit_from_any_state(prony):
    system, motion = two_blocks(prony=prony), pushed(0.6)
    commits = marched(system, motion)
    for at in (len(commits) // 4, len(commits) // 2, 3 * len(commits) // 4):
        again = marched(system, motion, start=commits[at].state)
        assert len(again) == len(commits) - at - 1
        found, expected = again[-1].state, commits[-1].state
        for name in ("displacement", "velocity", "acceleration"):
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
        for here, there in zip(found.contacts, expected.contacts, strict=True):
            for item in fields(here):
                np.testing.assert_array_equal(getattr(here, item.name), getattr(there, item.name))
        assert again[-1].state.time_s == commits[-1].state.time_s


def test_components_get_solvers_of_the_kind_that_was_given():
    system, motion = two_blocks(), pushed(0.1)
    found = marched(system, motion, solver=SuperLu(), end_s=0.5)[-1].state
    expected = marched(system, motion, end_s=0.5)[-1].state
    np.testing.assert_allclose(found.displacement, expected.displacement, atol=1e-7)


def test_a_surface_that_spans_two_components_keeps_them_together():
    system = two_blocks()
    edges = np.concatenate([system.body.edges(side) for side in ("upper_top", "lower_left")])
    spanning = replace(system.contacts[0], surface=Surface(edges, system.body.nodes))
    assert components_of(system)
    assert components_of(replace(system, contacts=(spanning,))) == ()


def test_nodes_that_are_no_component_are_refused():
    system = two_blocks()
    nodes = components_of(system)[0].place.nodes
    with pytest.raises(BodyError, match="no component"):
        system.body.component(nodes[:-1])
