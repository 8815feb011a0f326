"""Pieces of tissue that touch one another only through a body in a yielding hand."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

import fem2d.body.body
import fem2d.solvers.stepper
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.loads.load import Load
from fem2d.solvers.bordered import BorderedSolver
from fem2d.solvers.commit import Commit
from fem2d.solvers.components import components_of
from fem2d.solvers.hand import Borne, Hand
from fem2d.solvers.joined import joined_at
from fem2d.solvers.linear import SuperLu
from fem2d.solvers.march import MarchStatus, march
from fem2d.solvers.model import Model
from fem2d.solvers.newton import NewtonResult, NewtonStatus
from fem2d.solvers.prediction import Prediction
from fem2d.solvers.state import State
from fem2d.solvers.step_control import StepSettings
from fem2d.solvers.stepper import from_predictions
from fem2d.threads import Threads
from geometry2d.outline import Outline
from tests.support.contact_models import FINE, block, linear_elastic, path, unknowns
from tests.support.two_bodies import joined

MOTION = path([0, 1, 2], [[0, 0.02], [0.05, -0.1], [0.25, -0.1]])
HAND = Hand.yielding(
    (0.05, 0.08, 0.6),
    Borne(np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0, 0], [0.01, 0.06, 0.05], [0.0, 0.05, 0.1]])),
    damping=(1e-3, 1e-3, 1e-2),
)


def two_blocks_under_a_plate() -> Model:
    """Two blocks side by side, the second one lower and softer, and a plate above both."""
    material = linear_elastic(1.0, 0.4)
    left = block(np.linspace(-3, -1, 9), np.linspace(-1, 0, 5), material)
    right = block(np.linspace(1, 3, 7), np.linspace(-1, -0.01, 5), material)
    body = joined(left, right, {"lower": material, "upper": linear_elastic(0.5, 0.4)}, "Q4")
    plate = Outline.from_corners([(-6, 0), (6, 0), (6, 2), (-6, 2)], 0.1)
    contacts = [
        RigidContact(
            body.surface(f"{side}_top", points_per_edge=2),
            plate,
            normal=NormalLaw(50.0, 1e-3),
            friction=FrictionLaw(0.6, 20.0),
            name=side,
        )
        for side in ("lower", "upper")
    ]
    held = np.concatenate(
        [unknowns(body, f"{side}_bottom", axis) for side in ("lower", "upper") for axis in (0, 1)]
    )
    return Model(body, contacts=contacts, held=np.sort(held))


def carried(model: Model, threads: Threads, start: State | None = None) -> list[Commit]:
    commits: list[Commit] = []
    result = march(
        model,
        MOTION,
        start or model.at_rest(Load.at(MOTION.at(0.0)), next_step_s=0.05),
        hand=HAND,
        solver=SuperLu(),
        steps=StepSettings(longest_s=0.05),
        newton=FINE,
        threads=threads,
        on_commit=commits.append,
    )
    assert result.status is MarchStatus.FINISHED
    return commits


@pytest.fixture(scope="module")
def marched() -> tuple[Model, list[Commit]]:
    model = two_blocks_under_a_plate()
    return model, carried(model, Threads(2))


def joint(model: Model, state: State, duration_s: float):
    """The joined balance against all unknowns, where each component's lie, and the hand."""
    components = components_of(model)
    assert len(components) == 2
    further = HAND.unknowns(lambda time_s: Load.at(MOTION.at(time_s), time_s), state, duration_s)
    load = Load.at(MOTION.at(state.time_s + duration_s), state.time_s + duration_s)

    def at(component, displacement, there, body):
        own = component.state(state)
        return component.model.balance(
            displacement.reshape(-1, 2), component.load(there), own, duration_s, body=body
        )

    dofs = [component.place.dofs for component in components]
    evaluations = [partial(at, component) for component in components]
    balance_at = joined_at(
        evaluations, [d.size for d in dofs], load, further, FINE.tolerance, Threads(2)
    )
    return balance_at, np.concatenate(dofs), further, load


def test_components_joined_by_a_hand_balance_and_step_as_the_whole(marched):
    model, commits = marched
    state = commits[len(commits) // 2].state
    assert all(contact.traction.any() for contact in state.contacts)
    balance_at, dofs, further, load = joint(model, state, 0.02)
    rng = np.random.default_rng(5)
    displacement = state.displacement.ravel() + 1e-4 * rng.normal(size=dofs.size) * model.free
    values = further.values(state.load) + 1e-3 * rng.normal(size=3)
    there = balance_at(np.concatenate([displacement[dofs], values]))
    whole = model.balance(
        displacement.reshape(-1, 2), further.applied(load, values), state, 0.02, further=further
    )
    order = np.concatenate([dofs, dofs.size + np.arange(3)])
    scale = np.abs(whole.residual).max()
    assert there.residual == pytest.approx(whole.residual[order], abs=1e-12 * scale)
    for psd in (False, True):
        apart, together = BorderedSolver(SuperLu(), SuperLu()), BorderedSolver(SuperLu())
        apart.factorise(there.tangent(psd))
        together.factorise(whole.tangent(psd))
        step = together.solve(whole.residual)
        assert np.abs(step[-3:]).min() > 1e-6
        found = apart.solve(there.residual)
        assert found == pytest.approx(step[order], abs=1e-9 * np.abs(step).max())


def test_the_tangent_of_joined_components_is_the_derivative(marched):
    """A step that the joined tangent maps to a change of the residual, as differences say."""
    model, commits = marched
    state = commits[len(commits) // 2].state
    balance_at, dofs, further, _ = joint(model, state, 0.02)
    rng = np.random.default_rng(6)
    moved = state.displacement.ravel() + 1e-4 * rng.normal(size=dofs.size) * model.free
    here = np.concatenate([moved[dofs], further.values(state.load)])
    solver = BorderedSolver(SuperLu(), SuperLu())
    solver.factorise(balance_at(here).tangent(False))
    free = np.concatenate([model.free[dofs], np.ones(3, bool)])
    for _ in range(4):
        way = 1e-7 * rng.normal(size=here.size) * free
        change = balance_at(here + way).residual - balance_at(here - way).residual
        assert np.abs(change[-3:]).min() > 1e-9
        assert 0.5 * solver.solve(change) == pytest.approx(way, abs=2e-4 * np.abs(way).max())


def test_components_and_whole_are_carried_the_same_way(marched, monkeypatch):
    """Same instants, same iterations, same places: joining changes how a step is solved."""
    _, commits = marched
    assert sum(c.contacts[0].energy > 0 < c.contacts[1].energy for c in commits) > 20
    monkeypatch.setattr(fem2d.solvers.stepper, "components_of", lambda model: ())
    whole = carried(two_blocks_under_a_plate(), Threads(1))
    assert len(whole) == len(commits)
    for one, other in zip(commits, whole, strict=True):
        assert one.state.time_s == pytest.approx(other.state.time_s, abs=1e-9)
        assert one.state.displacement == pytest.approx(other.state.displacement, abs=1e-8)
        assert one.newton.iterations <= other.newton.iterations + 1


def test_one_thread_and_two_carry_to_the_same_bits(marched):
    model, commits = marched
    for one, other in zip(carried(model, Threads(1)), commits, strict=True):
        assert np.array_equal(one.state.displacement, other.state.displacement)
        assert one.state.load.move == other.state.load.move


def test_the_hand_is_predicted_with_the_tissue(marched):
    """While both blocks are pressed the predictor's error is of second order in the step."""
    _, commits = marched
    sliding = [c for c in commits if c.state.time_s > 1.1]
    moved = [
        np.abs(b.state.displacement - a.state.displacement).max() for a, b in pairwise(sliding)
    ]
    errors = [c.newton.predictor_error_mm for c in sliding[1:]]
    assert np.median(errors) < 0.1 * np.median(moved)


def test_a_hand_feels_what_it_bears_only_where_something_touches(marched):
    model, commits = marched
    first, last = commits[0], commits[-1]
    away = model.contact_responses(
        np.zeros_like(model.body.nodes), MOTION.at(0.0), model.at_rest(Load.at(MOTION.at(0.0)))
    )
    assert HAND.feels(last.contacts, 1.5)
    assert not HAND.feels(away, 1.5)
    assert HAND.feels(away, 0.0), "nothing is borne yet"
    separate = replace(HAND, contacts=(("lower",), ("upper",), ("elsewhere",)))
    assert not separate.feels(last.contacts, 1.5)
    assert first.state.time_s < 1.0


def test_where_the_predicted_hand_leads_nowhere_it_is_tried_where_it_was():
    still, moved = Load(), Load(move=(0.1, 0.0))
    prediction = Prediction(moved, [np.ones((2, 2))], [np.zeros((2, 2))])
    tried: list[Prediction] = []

    def solved(start: Prediction):
        tried.append(start)
        status = NewtonStatus.CONVERGED if start.load is still else NewtonStatus.STALLED
        end = start.displacements[0]
        return NewtonResult(status, end, end, np.empty(0), (1.0, 0.5, 0.1), 1.0), None

    trial, _ = from_predictions(solved, prediction, still, [np.zeros((2, 2))])
    assert [start.load for start in tried] == [moved, still]
    assert np.array_equal(tried[1].displacements[0], prediction.kept[0])
    assert trial.converged
    assert trial.iterations == 4, "those of the trial that failed count"


def test_a_march_in_a_hand_goes_on_bit_for_bit_from_any_state(monkeypatch):
    monkeypatch.setattr(fem2d.body.body, "SMALL_BODY", 1)  # sums are grouped as in large bodies
    model = two_blocks_under_a_plate()
    commits = carried(model, Threads(1))
    for at in (len(commits) // 3, 2 * len(commits) // 3):
        again = carried(model, Threads(2), start=commits[at].state)
        assert len(again) == len(commits) - at - 1
        for one, other in zip(again, commits[at + 1 :], strict=True):
            assert np.array_equal(one.state.displacement, other.state.displacement)
            assert one.state.load.move == other.state.load.move
            assert one.state.time_s == other.state.time_s
