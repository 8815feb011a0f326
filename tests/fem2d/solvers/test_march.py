"""Each way in which a march can end, and what it may be given."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from fem2d.loads.load import Load
from fem2d.solvers.inertia import Inertia
from fem2d.solvers.march import MarchError, MarchStatus, march
from fem2d.solvers.model import Model
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.step_control import StepSettings
from fem2d.threads import Threads
from tests.support.pulled_block import arch, clamped_block, on_top

STEPS = StepSettings(longest_s=0.25, shortest_s=1e-3, accuracy_mm=np.inf)


def pulled(model: Model, largest_mpa: float = 0.1):
    """What acts on the block while it is pulled up, growing with time."""
    force = on_top(model, (0.02, largest_mpa))
    return lambda time_s: Load(dead_n=time_s * force)


def test_finished():
    model = clamped_block()
    commits = []
    result = march(
        model, pulled(model), model.at_rest(), end_s=1.0, steps=STEPS, on_commit=commits.append
    )
    assert result.status is MarchStatus.FINISHED and result.converged
    assert result.state.time_s == pytest.approx(1.0) and result.increments == len(commits)
    assert result.state is commits[-1].state
    assert str(result).startswith("MarchResult(FINISHED, ")
    last = commits[-1]
    total = last.reaction[model.held].reshape(-1, 2).sum(axis=0)
    np.testing.assert_allclose(total, [-0.04, -0.2], rtol=1e-5)


def test_step_too_small():
    # Without inertia nothing carries the arch through its snap: no equilibrium lies nearby.
    model, down = arch()
    result = march(
        model, lambda time_s: Load(dead_n=0.01 * time_s * down), model.at_rest(), end_s=1.0,
        steps=replace(STEPS, longest_s=0.05), newton=NewtonSettings(patience=4),
    )  # fmt: skip
    assert result.status is MarchStatus.STEP_TOO_SMALL and not result.converged
    assert 0.3 < result.state.time_s < 0.6 and result.cutbacks > 3
    # With inertia it goes through.
    moving = replace(model, inertia=Inertia(1e-9, relaxation_s=0.02))
    through = march(
        moving, lambda time_s: Load(dead_n=0.01 * min(time_s, 1.0) * down), moving.at_rest(),
        end_s=3.0, steps=replace(STEPS, longest_s=0.05, shortest_s=1e-7),
    )  # fmt: skip
    assert through.converged
    assert through.state.displacement[:, 1].min() < -3.0


@pytest.mark.parametrize("count", [1, 2])
def test_interrupted(count):
    model = clamped_block()
    told = []

    def stop(commit):
        told.append(commit)
        if len(told) == 2:
            raise KeyboardInterrupt

    result = march(
        model, pulled(model), model.at_rest(), end_s=1.0, steps=STEPS, on_commit=stop,
        threads=Threads(count),
    )  # fmt: skip
    assert result.status is MarchStatus.INTERRUPTED and not result.converged
    assert result.increments == len(told) == 2
    assert result.state is told[-1].state


@pytest.mark.parametrize("count", [1, 2])
def test_an_error_of_whoever_is_told_reaches_the_caller(count):
    model = clamped_block()

    def fail(commit):
        raise OSError("no space left")

    with pytest.raises(OSError, match="no space left"):
        march(
            model, pulled(model), model.at_rest(), end_s=1.0, on_commit=fail,
            threads=Threads(count),
        )  # fmt: skip


def test_loads_without_an_end_are_refused():
    model = clamped_block()
    with pytest.raises(MarchError, match="give end_s"):
        march(model, pulled(model), model.at_rest())


def test_moved_supports_end_where_they_are_told():
    model = clamped_block()
    body = model.body
    held = np.concatenate([body.dofs("bottom"), body.dofs("top", along="y")])
    model = Model(body, held=held, inertia=Inertia(1e-9, relaxation_s=0.01))
    lifted = np.repeat([0.0, 0.5], [body.dofs("bottom").size, held.size - body.dofs("bottom").size])
    result = march(model, lambda time_s: Load(held_mm=time_s * lifted), model.at_rest(), end_s=1.0)
    assert result.converged
    np.testing.assert_allclose(result.state.displacement.flat[held], lifted, atol=1e-15)
    top = body.dofs("top", along="y")
    np.testing.assert_allclose(result.state.velocity.flat[top], 0.5, rtol=1e-6)


def test_a_march_hands_the_interpreter_on_quickly_and_puts_that_back():
    model, seen = clamped_block(), []
    before = sys.getswitchinterval()
    march(
        model, pulled(model), model.at_rest(), end_s=1.0, steps=STEPS,
        on_commit=lambda commit: seen.append(sys.getswitchinterval()),
    )  # fmt: skip
    assert max(seen) == pytest.approx(5e-4)
    assert sys.getswitchinterval() == before
