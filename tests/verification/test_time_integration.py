"""Mass and viscosity against the exact solution of the linear system: order in the step's length.

A small clamped block under a load so small that it stays linear: ``M u″ + τ K₀ u′ + K u = f(t)``.
The load sets in smoothly, so that the body's start at rest is exact.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem2d.solvers.inertia import Inertia
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.march import MarchStatus, march
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.step_control import StepSettings
from tests.support.contact_models import (
    block,
    linear_elastic,
    loaded,
    side_pressure,
    still,
    unknowns,
)
from tests.support.marks import slow

END_S = 1.0
EXACTLY = NewtonSettings(tolerance=1e-8, force_floor_n=1e-6)


def clamped(inertia):
    """A block on its clamped bottom, drawn sideways at its top by a load that grows as t³."""
    body = block(np.linspace(0, 2, 4), np.linspace(0, 1, 3), linear_elastic(1.0, 0.3))
    held = np.concatenate([unknowns(body, "bottom", c) for c in (0, 1)])
    force = side_pressure(body, "top", (1e-5, 0.0))
    return loaded(body, inertia=inertia, held=held, load=lambda t: t**3 * force)


def matrices(model):
    """Mass, viscosity and stiffness of a model at rest, without its held unknowns."""
    still_there = np.zeros_like(model.body.nodes)
    stiffness = model.body.pattern.matrix(model.body.response(still_there).stiffness)
    free = np.ix_(model.free, model.free)
    return [matrix.toarray()[free] for matrix in (model.mass, model.viscosity, stiffness)]


def driven(slope, drive):
    """What ``y′ = slope y + t³ drive`` has made of nothing at the end, with tight tolerances."""
    return solve_ivp(
        lambda t, y: slope @ y + t**3 * drive, (0, END_S), np.zeros(len(drive)),
        method="Radau", jac=slope, rtol=1e-9, atol=1e-16,
    ).y[:, -1]  # fmt: skip


def exact(problem):
    """The displacement of the free unknowns at the end: the linear equations solved exactly."""
    mass, viscosity, stiffness = matrices(problem.model)
    force = problem.load(1.0)[problem.model.free]
    if not mass.any():
        slope = -np.linalg.solve(viscosity, stiffness)
        return driven(slope, np.linalg.solve(viscosity, force))
    inverse = np.linalg.inv(mass)
    slope = np.block(
        [[np.zeros_like(mass), np.eye(len(mass))], [-inverse @ stiffness, -inverse @ viscosity]]
    )
    drive = np.concatenate([np.zeros(len(mass)), inverse @ force])
    return driven(slope, drive)[: len(mass)]


def integrated(problem, step_s, uneven):
    """The displacement of the free unknowns; uneven steps are short and long by turns, 1 to 2."""
    model, loading, solver = problem.model, problem.loading(still(END_S)), fastest_solver()
    state = model.at_rest(loading(0.0), next_step_s=step_s)
    lengths = step_s * (np.array([2, 4]) / 3 if uneven else np.ones(2))
    ends = np.cumsum(np.tile(lengths, round(END_S / step_s) // 2))
    for end in ends:
        length = end - state.time_s
        result = march(
            model, loading, replace(state, next_step_s=length), solver=solver, end_s=end,
            newton=EXACTLY, steps=StepSettings(longest_s=length, accuracy_mm=np.inf),
        )  # fmt: skip
        assert result.status is MarchStatus.FINISHED and result.increments == 1
        state = result.state
    return state.displacement.ravel()[model.free]


@pytest.mark.parametrize(
    ("density", "relaxation", "uneven", "order"),
    [
        (0.0, 0.1, False, 2.0),
        slow(0.0, 0.1, True, 2.0),
        (0.1, 0.0, False, 2.0),
        slow(0.1, 0.05, False, 2.0),
        # Steps that change by a factor of two at every instant cost mass half an order.
        (0.1, 0.05, True, 1.5),
    ],
    ids=["viscosity", "viscosity, uneven", "mass", "both", "both, uneven"],
)
def test_errors_fall_with_the_square_of_the_step(density, relaxation, uneven, order):
    problem = clamped(Inertia(density, 0.0, relaxation))
    expected = exact(problem)
    force = problem.load(END_S)[problem.model.free]
    at_rest = np.linalg.solve(matrices(problem.model)[2], force)
    size = np.abs(expected).max()
    assert np.abs(expected - at_rest).max() > 0.05 * size  # what resists motion shows
    errors = np.array(
        [
            np.abs(integrated(problem, step, uneven) - expected).max() / size
            for step in (1 / 40, 1 / 80, 1 / 160)
        ]
    )
    assert errors[-1] < 3e-3
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), order, atol=0.2)
