"""What must hold whatever the problem: history, reproducibility, invariance, the friction law."""

from dataclasses import replace

import numpy as np
import pytest

from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.loads.load import Load
from fem2d.solvers.linear import Pardiso, SuperLu, fastest_solver
from fem2d.solvers.march import MarchStatus, march
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.step_control import StepSettings
from fem2d.solvers.stepper import attempt
from geometry2d.rigid import RigidMotion, rotated
from tests.support.contact_models import FINE, LIP_PRESS, followed, force_on_tissue, lip_press, path
from tests.support.marks import slow
from tests.support.optional import needed_module

MODEL = {"columns": 50, "rows": 10, "points": 3, "friction": FrictionLaw(0.3, 10.0)}


def pressed_and_dragged():
    """A short run in which points stick, slip, close and open, with its system."""
    system = lip_press(**MODEL)
    return system, path([0, 1, 2], [[0, 0], [0, -1.5], [1.5, -1.5]])


def test_friction_keeps_the_coulomb_law_at_every_point_and_instant():
    system, motion = pressed_and_dragged()
    slipped = stuck = 0
    for commit in followed(system, motion, increments=20):
        points = commit.contacts[0].points
        bound = 0.3 * points.pressure
        assert np.all(np.abs(points.shear) <= bound * (1 + 1e-9))
        assert np.all(points.pressure >= 0)
        touching = points.pressure > 0
        np.testing.assert_allclose(
            np.abs(points.shear)[points.slipping], bound[points.slipping], rtol=1e-9
        )
        slipped += np.count_nonzero(points.slipping & touching)
        stuck += np.count_nonzero(~points.slipping & touching)
    assert slipped > 50
    assert stuck > 50


def test_action_equals_reaction():
    # The rigid body's force is minus the tissue's by construction; what must balance it is what
    # holds the tissue, force and moment.
    system, motion = pressed_and_dragged()
    last = followed(system, motion, increments=20)[-1]
    u, held = last.state.displacement, np.zeros(system.body.nodes.size)
    held[system.held] = last.reaction[system.held]
    contact = np.zeros(u.size)
    np.add.at(contact, last.contacts[0].dofs, last.contacts[0].force)
    total = (held + contact).reshape(-1, 2)
    size = np.abs(contact).sum()
    np.testing.assert_allclose(total.sum(axis=0), 0, atol=1e-8 * size)
    arm = system.body.nodes + u
    moment = np.sum(arm[:, 0] * total[:, 1] - arm[:, 1] * total[:, 0])
    assert abs(moment) < 1e-8 * size * 20


@pytest.mark.parametrize(("instant", "least", "most"), [slow(1.25, 0.1, 0.9), slow(2.0, 1.0, 1.0)])
def test_a_held_load_does_not_creep(instant, least, most):
    # Held for 200 increments where some points stick and others are at the bound, and where all
    # are at the bound.
    system, motion = pressed_and_dragged()
    state = followed(system, motion, increments=20, end_s=instant)[-1].state
    points = system.contact_responses(state.displacement, state.placement, state)[0].points
    assert least <= points.slipping[points.pressure > 0].mean() <= most
    hold = RigidMotion(
        instant + np.array([0.0, 2.0]), np.zeros(2), np.array([state.placement.shift_mm] * 2)
    )
    commits = followed(
        system, hold, increments=200, start=replace(state, next_step_s=0.01), step_s=0.01
    )
    assert len(commits) >= 200
    drift = commits[-1].state.displacement - state.displacement
    assert np.abs(drift).max() < 1e-9
    np.testing.assert_allclose(
        commits[-1].contacts[0].points.shear, points.shear, atol=1e-9 * points.pressure.max()
    )


@pytest.mark.parametrize("angle", [0.6, slow(-2.1)])
def test_turning_the_whole_problem_turns_the_result(angle):
    plain, motion = pressed_and_dragged()
    turned = lip_press(**MODEL, angle=angle)
    there = RigidMotion(motion.time_s, motion.angle_rad, rotated(motion.shift_mm, angle))
    reference = followed(plain, motion, increments=16)[-1]
    result = followed(turned, there, increments=16)[-1]
    np.testing.assert_allclose(
        rotated(result.state.displacement, -angle), reference.state.displacement, atol=1e-7
    )
    np.testing.assert_allclose(
        rotated(force_on_tissue(result), -angle), force_on_tissue(reference), rtol=1e-6
    )


@pytest.mark.parametrize("solver", [Pardiso, SuperLu])
def test_a_rejected_trial_leaves_no_trace(solver):
    if solver is Pardiso:
        needed_module("pypardiso")
    system, motion = pressed_and_dragged()
    used = solver()
    state = followed(system, motion, increments=20, end_s=1.25, solver=used)[-1].state

    def tried(motion, duration_s, solver, newton):
        end_s = state.time_s + duration_s
        load = Load.at(motion.at(end_s), end_s)
        return attempt(system, state, load, duration_s, solver, newton)

    first, _ = tried(motion, 0.05, used, FINE)
    far = replace(motion, shift_mm=motion.shift_mm * 6)
    wild, _ = tried(far, 0.5, used, NewtonSettings(iterations=4))
    assert not wild.converged
    again, _ = tried(motion, 0.05, used, FINE)
    assert first.converged
    assert first.iterations > 1
    assert np.array_equal(first.displacement, again.displacement)
    assert first.norms == again.norms
    fresh, _ = tried(motion, 0.05, solver(), FINE)
    assert np.array_equal(first.displacement, fresh.displacement)


def test_resuming_from_any_committed_state_gives_the_same_bits():
    system, motion = pressed_and_dragged()
    whole = followed(system, motion, increments=20)
    middle = whole[11].state
    kept = replace(
        middle,
        load=replace(middle.load),
        displacement=middle.displacement.copy(),
        contacts=tuple(
            replace(s, body_position=s.body_position.copy(), traction=s.traction.copy())
            for s in middle.contacts
        ),
    )
    other_system, _ = pressed_and_dragged()
    rest = followed(other_system, motion, increments=20, start=kept, solver=fastest_solver())
    assert len(rest) == len(whole) - 12
    for here, there in zip(rest, whole[12:], strict=True):
        assert here.state.time_s == there.state.time_s
        assert np.array_equal(here.state.displacement, there.state.displacement)
        assert np.array_equal(here.contacts[0].points.shear, there.contacts[0].points.shear)


@pytest.mark.slow
def test_halving_the_steps_changes_little():
    # Coulomb friction depends on the path: with half the steps the drag force of PEERS' lip press
    # and the normal force change by less than 0.01 %.
    forces = []
    for increments in (35, 70):
        last = followed(lip_press(), LIP_PRESS, increments=increments)[-1]
        forces.append(force_on_tissue(last))
    coarse, fine = np.abs(forces)
    np.testing.assert_allclose(coarse, fine, rtol=1e-4)


def test_fast_growth_of_penetration_is_rejected_but_slow_squeezing_is_not():
    # A penalty so soft that the circle sinks in by a tenth of a millimetre altogether.
    system = lip_press(20, 10, normal=NormalLaw(0.2, 1e-4), points=3)
    motion = path([0, 1], [[0, 0], [0, -2.0]])
    most = 0.01

    def deepest(penetration_growth_mm):
        commits = []
        result = march(
            system, motion, system.at_rest(Load.at(motion.at(0.0), 0.0), next_step_s=0.25),
            solver=fastest_solver(),
            steps=StepSettings(
                longest_s=0.25, travel_mm=np.inf, accuracy_mm=np.inf,
                penetration_growth_mm=penetration_growth_mm
            ),
            newton=FINE, on_commit=commits.append,
        )  # fmt: skip
        assert result.status is MarchStatus.FINISHED
        return result, np.array([-c.contacts[0].points.gap.min() for c in commits])

    free, sunk = deepest(1.0)
    assert free.increments == 4
    assert np.diff(sunk, prepend=0).max() > 2 * most
    held, slowly = deepest(most)
    assert held.cutbacks > 0
    assert np.diff(slowly, prepend=0).max() <= most
    assert slowly[-1] > 3 * most
    assert slowly[-1] == pytest.approx(sunk[-1], rel=0.02)


def test_a_step_whose_predictor_errs_is_taken_again_in_shorter_ones():
    system = lip_press(20, 10, friction=FrictionLaw(0.3, 10.0), points=3)
    motion = path([0, 1, 2], [[0, 0], [0, -1.5], [1.5, -1.5]])
    aim, snap = 2e-4, 0.01

    def predictor_errors(snap_s):
        commits = []
        result = march(
            system, motion, system.at_rest(Load.at(motion.at(0.0), 0.0), next_step_s=0.1),
            solver=fastest_solver(),
            steps=StepSettings(longest_s=0.1, travel_mm=np.inf, accuracy_mm=aim, snap_s=snap_s),
            newton=FINE, on_commit=commits.append,
        )  # fmt: skip
        assert result.status is MarchStatus.FINISHED
        wrong = [c.newton.predictor_error_mm > StepSettings().snap_errors * aim for c in commits]
        return result, [c for c, surprising in zip(commits, wrong, strict=True) if surprising]

    accepted, followed_anyhow = predictor_errors(np.inf)
    assert len(followed_anyhow) > 0
    seen, rest = predictor_errors(snap)
    assert seen.cutbacks > accepted.cutbacks
    assert all(c.duration_s <= snap for c in rest)


def test_whoever_is_told_of_an_increment_can_stop_the_march():
    system, told = lip_press(10, 8), []

    def stop(commit):
        told.append(commit)
        if len(told) == 3:
            raise KeyboardInterrupt

    result = march(
        system, LIP_PRESS, system.at_rest(Load.at(LIP_PRESS.at(0.0), 0.0), next_step_s=0.05),
        solver=fastest_solver(), newton=FINE, on_commit=stop,
    )  # fmt: skip
    assert result.status is MarchStatus.INTERRUPTED
    assert result.increments == len(told) == 3
    assert result.state is told[-1].state
