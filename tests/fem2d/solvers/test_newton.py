"""Each way in which Newton's method can end, reached by a body under a load."""

from __future__ import annotations

import numpy as np
import pytest

from fem2d.loads.load import Load
from fem2d.loads.pressure import FollowerPressure
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.newton import NewtonResult, NewtonStatus
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.static import Steering
from fem2d.solvers.step import balanced
from tests.support.pulled_block import arch, clamped_block, on_top


def solved(model: Model, load: Load, newton: NewtonSettings, **options) -> NewtonResult:
    """Newton's method from rest, in one step and without a prediction."""
    state = model.at_rest()
    result, _ = balanced(
        model, load, state, None, state.displacement, solver=fastest_solver(), newton=newton,
        **options,
    )  # fmt: skip
    return result


def test_converged():
    model = clamped_block()
    result = solved(model, Load(dead_n=on_top(model, (0.02, 0.1))), NewtonSettings())
    assert result.status is NewtonStatus.CONVERGED and result.converged
    assert 2 <= result.iterations <= 5
    assert result.imbalance < 1e-6 and result.norms[0] > 1e-2
    # Quadratic: each ratio of forces is about the square of the one before.
    assert result.norms[3] / result.norms[2] < 5 * (result.norms[2] / result.norms[1]) ** 1.5


def test_too_many_iterations():
    model = clamped_block()
    load = Load(dead_n=on_top(model, (0.02, 0.1)))
    result = solved(model, load, NewtonSettings(iterations=1))
    assert result.status is NewtonStatus.TOO_MANY_ITERATIONS
    assert result.iterations == 1 and not result.converged


def test_stalled():
    # On its way through a snap the arch has to let the forces grow.
    model, down = arch()
    load = Load(dead_n=0.006 * down)
    impatient = solved(model, load, NewtonSettings(patience=3, iterations=60))
    assert impatient.status is NewtonStatus.STALLED
    patient = solved(model, load, NewtonSettings(patience=40, iterations=60))
    assert patient.converged
    assert max(patient.norms) > 3 * patient.norms[0]


def test_inadmissible_at_the_start():
    model = clamped_block()
    state = model.at_rest()
    inside_out = -1.5 * model.body.nodes * [0.0, 1.0]
    result, _ = balanced(
        model, Load(), state, None, inside_out, solver=fastest_solver(), newton=NewtonSettings()
    )
    assert result.status is NewtonStatus.INADMISSIBLE
    assert result.iterations == 0 and result.norms == (np.inf,)


def test_inadmissible_along_the_step():
    model = clamped_block()
    result = solved(model, Load(dead_n=on_top(model, (0.0, -1e4))), NewtonSettings())
    assert result.status is NewtonStatus.INADMISSIBLE
    assert np.isfinite(result.norms[-1])


def test_singular():
    # A displacement is to be steered by a pressure that presses on nothing.
    model = clamped_block()
    steering = Steering(2 * int(np.argmax(model.body.nodes[:, 1])) + 1, 0.1)
    result = solved(model, Load(), NewtonSettings(), further=steering)
    assert result.status is NewtonStatus.SINGULAR


def test_a_further_unknown_is_found_with_the_displacements():
    block = clamped_block()
    model = Model(block.body, held=block.held, loads=[FollowerPressure(block.body.surface("top"))])
    top = model.body.dofs("top", along="y")
    steering = Steering(int(top[0]), 0.05)
    result = solved(model, Load(), NewtonSettings(tolerance=1e-10), further=steering)
    assert result.converged
    assert result.displacement.flat[top[0]] == pytest.approx(0.05, abs=1e-12)
    pressure = float(result.further[0])
    assert pressure < 0  # suction lifts
    same = solved(model, Load(pressure_mpa=pressure), NewtonSettings(tolerance=1e-10))
    np.testing.assert_allclose(same.displacement, result.displacement, atol=1e-9)
