"""Blocks of viscous tissue against closed forms: relaxation, creep, hysteresis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem2d.body.kinematics import Plane
from fem2d.loads.load import Load
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden
from fem2d.materials.prony import PronySeries
from fem2d.solvers.march import march
from fem2d.solvers.model import Model
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.static import solve_static
from fem2d.solvers.step_control import StepSettings
from tests.support.contact_models import block, unknowns

LAW = Ogden((0.05,), (10.789,), poisson=0.49)
SOFT = NeoHookean(0.0042, poisson=0.49)
SERIES = PronySeries((0.6, 0.25), (0.05, 1.5))
BRANCH = PronySeries((0.7,), (0.4,))
EXACTLY = NewtonSettings(tolerance=1e-10, force_floor_n=1e-6)
SIDE = 2.0
PLANES = [Plane.STRESS, Plane.STRAIN]


def bar(law, plane, series, *, pulled_by_force=False):
    """A block 2 × 1 mm between rollers; its right end is moved, unless a force pulls it."""
    body = block(np.linspace(0, SIDE, 3), np.linspace(0, 1, 2), law, plane=plane, element="T6")
    left, bottom = unknowns(body, "left", 0), unknowns(body, "bottom", 1)
    right = np.empty(0, int) if pulled_by_force else unknowns(body, "right", 0)
    return Model(body, held=np.concatenate([left, bottom, right]), prony=series), len(right)


def stretched(model, count, by_mm):
    """The load that moves the right end."""
    return Load(held_mm=np.concatenate([np.zeros(model.held.size - count), np.full(count, by_mm)]))


def followed(model, loading, start, ends):
    """Every commit of a march whose steps end at these instants."""
    commits, state = [], start
    steps = StepSettings(longest_s=1e9, shortest_s=1e-12, accuracy_mm=np.inf, watch_stability=False)
    for end in ends:
        result = march(
            model, loading, replace(state, next_step_s=end - state.time_s), end_s=end,
            steps=steps, newton=EXACTLY, on_commit=commits.append,
        )  # fmt: skip
        assert result.converged
        state = result.state
    return commits


def pull_n(commit):
    """The force that the left end bears, N."""
    model_held = commit.reaction.reshape(-1, 2)[:, 0]
    return -float(model_held[model_held < 0].sum())


@pytest.mark.parametrize("plane", PLANES)
def test_a_sudden_stretch_relaxes_as_the_series_says(plane):
    model, count = bar(LAW, plane, SERIES)
    lasting = solve_static(model, stretched(model, count, 0.4))
    assert lasting.converged
    bears = np.abs(lasting.balance.forces[unknowns(model.body, "left", 0)].sum())
    ends = [1e-7, 0.01, 0.05, 0.2, 1.0, 3.0, 10.0]
    commits = followed(
        model, lambda time_s: stretched(model, count, 0.4 * min(time_s / 1e-7, 1.0)),
        model.at_rest(), ends,
    )  # fmt: skip
    measured = [pull_n(commit) for commit in commits if commit.state.time_s in ends]
    np.testing.assert_allclose(np.array(measured) / bears, SERIES.relaxation(ends), rtol=1e-5)
    # The stresses that are reported relax alike.
    fields = [model.fields(commit.state) for commit in (commits[0], commits[-1])]
    ratio = fields[0].cauchy[..., 0, 0] / fields[1].cauchy[..., 0, 0]
    expected = SERIES.relaxation(0.0) / SERIES.relaxation(10.0)
    np.testing.assert_allclose(ratio, expected, rtol=1e-5)


@pytest.mark.parametrize("plane", PLANES)
def test_a_small_dead_force_creeps_to_its_lasting_stretch(plane):
    model, _ = bar(SOFT, plane, BRANCH, pulled_by_force=True)
    force = model.body.surface("right").uniform_force((1e-7, 0.0))
    lasting = solve_static(model, Load(dead_n=force))
    right = unknowns(model.body, "right", 0)[0]
    ends = np.concatenate([[1e-7], np.linspace(0.02, 2.4, 120)])
    commits = followed(
        model, lambda time_s: Load(dead_n=min(time_s / 1e-7, 1.0) * force), model.at_rest(), ends
    )
    moved = np.array([commit.state.displacement.ravel()[right] for commit in commits])
    share = moved / lasting.state.displacement.ravel()[right]
    (beta,), (tau,) = BRANCH.overstress, BRANCH.relaxation_s
    times = np.array([commit.state.time_s for commit in commits])
    expected = 1 - beta / (1 + beta) * np.exp(-times / (tau * (1 + beta)))
    assert share[0] == pytest.approx(1 / 1.7, rel=1e-4)
    np.testing.assert_allclose(share, expected, atol=2e-4)


def loop_area(plane, steps_a_cycle):
    """Work lost in the second of two cycles of a small sinusoidal stretch, over π E ε²."""
    model, count = bar(SOFT, plane, BRANCH)
    small, rate = 1e-4, 2 * np.pi / 1.5
    ends = np.linspace(0, 5 * 1.5, 5 * steps_a_cycle + 1)[1:]
    commits = followed(
        model, lambda time_s: stretched(model, count, small * np.sin(rate * time_s)),
        model.at_rest(), ends,
    )[-steps_a_cycle - 1 :]  # fmt: skip
    left = unknowns(model.body, "left", 0)
    force = -np.array([commit.reaction[left].sum() for commit in commits])
    moved = small * np.sin(rate * np.array([commit.state.time_s for commit in commits]))
    lost = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(moved)))
    elastic = solve_static(model, stretched(model, count, small))
    stiffness = abs(float(elastic.balance.forces[left].sum())) / small
    return lost / (np.pi * stiffness * small**2)


@pytest.mark.slow
@pytest.mark.parametrize("plane", PLANES)
def test_a_cycle_loses_the_work_of_the_loss_modulus(plane):
    (beta,), (tau,) = BRANCH.overstress, BRANCH.relaxation_s
    turned = 2 * np.pi / 1.5 * tau
    expected = beta * turned / (1 + turned**2)
    coarse, fine = (abs(loop_area(plane, steps) - expected) for steps in (24, 48))
    assert fine < 0.01 * expected
    assert coarse / fine == pytest.approx(4.0, rel=0.15)  # second order in the step


def test_without_a_series_nothing_is_remembered():
    model, count = bar(LAW, Plane.STRESS, None)
    commits = followed(
        model, lambda time_s: stretched(model, count, 0.1 * time_s), model.at_rest(), [0.5, 1.0]
    )
    assert all(commit.state.overstress is None for commit in commits)
