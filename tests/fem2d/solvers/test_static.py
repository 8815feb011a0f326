"""Static equilibria: what a researcher writes, each way in which a search ends, derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import skfem

from fem2d.body.body import Body
from fem2d.contact.rigid import RigidContact
from fem2d.loads.load import Load
from fem2d.loads.pressure import FollowerPressure
from fem2d.materials.ogden import Ogden
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.newton import NewtonStatus
from fem2d.solvers.static import (
    StaticSettings,
    StaticStatus,
    Steering,
    kept_at,
    solve_static,
    static_path,
    static_step,
)
from fem2d.threads import Threads
from geometry2d.outline import Outline
from tests.support.pulled_block import arch, clamped_block, on_top


def pressed(plane: str = "stress", **options) -> Model:
    """A strip of skin under a circle that just touches it."""
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 8, 17), np.linspace(0, 3, 7)).with_boundaries(
        {"bottom": lambda x: np.isclose(x[1], 0), "top": lambda x: np.isclose(x[1], 3)}
    )
    body = Body(mesh, Ogden(mu_mpa=[0.05], alpha=[10.789], poisson=0.49), plane=plane)
    outline = Outline.circle([4.0, 5.0], 2.0)
    contact = RigidContact(body.surface("top"), outline, **({"friction": 1.0} | options))
    return Model(body, contacts=[contact], held=body.dofs("bottom"))


def force_on(model: Model, result) -> np.ndarray:
    """What the rigid body does to the tissue (2,), N."""
    (touch,) = result.contacts
    return touch.force.reshape(-1, 2).sum(axis=0)


def test_a_body_a_contact_and_a_load_are_a_model_to_solve():
    model = pressed()
    result = solve_static(model, Load(move=(0.0, -0.5)))
    assert result.status is StaticStatus.CONVERGED and result.converged
    down = force_on(model, result)
    assert down[1] < -1e-3 and abs(down[0]) < 0.01 * abs(down[1])
    held = result.reaction[model.held].reshape(-1, 2).sum(axis=0)
    np.testing.assert_allclose(held, -down, atol=1e-6 * abs(down[1]))
    np.testing.assert_allclose(result.reaction[model.free], 0.0, atol=1e-6 * abs(down[1]))
    assert result.state.placement.shift_mm == (0.0, -0.5)


def test_what_is_public_says_in_a_line_what_it_is():
    model = pressed()
    result = solve_static(model, Load(move=(0.0, -0.2)))
    shown = {
        repr(model.body): "Body(192 T6, 429 nodes, plane stress)",
        repr(model.contacts[0]): "RigidContact('rigid contact', 16 edges, moving outline, fric",
        repr(model): "Model(Body(192 T6, 429 nodes, plane stress), 1 contacts, 66 held unknowns",
        repr(result): "StaticResult(CONVERGED, largest displacement 0.1",
    }
    for text, start in shown.items():
        assert text.startswith(start)
        assert "\n" not in text and len(text) < 160


def test_friction_remembers_the_equilibrium_before():
    model = pressed(friction=0.3)
    down = solve_static(model, Load(move=(0.0, -0.4)))
    right = solve_static(model, Load(move=(0.5, -0.4)), start=down)
    back = solve_static(model, Load(move=(0.35, -0.4)), start=right)
    pushed, pulled = force_on(model, right), force_on(model, back)
    assert pushed[0] / -pushed[1] == pytest.approx(0.3, rel=0.1)
    assert pulled[0] < pushed[0] - 0.1 * abs(pushed[1])


def test_first_contact_within_a_step_is_where_slip_is_counted_from():
    # The circle comes down at a slant from 0.2 mm above: what it travels through air is no slip.
    apart, pressed_in = Load(move=(0.0, 0.2)), Load(move=(0.3, -0.2))
    drags = {}
    for first_contact, steps in ((True, 1), (True, 24), (False, 1)):
        model, settings = pressed(friction=0.5), StaticSettings(first_contact=first_contact)
        state = kept_at(model, load=apart)
        for step in range(1, steps + 1):
            load = apart.towards(pressed_in, step / steps)
            state = solve_static(model, load, start=state, settings=settings)
        x, y = force_on(model, state)
        drags[first_contact, steps] = x / -y
    assert drags[True, 1] == pytest.approx(drags[True, 24], rel=0.1)
    assert drags[False, 1] == pytest.approx(0.5, rel=0.02)
    assert drags[True, 24] < 0.45


def test_a_step_that_fails_leaves_the_equilibrium_before():
    model, down = arch()
    start = solve_static(model, Load(dead_n=0.004 * down))
    impatient = StaticSettings(free_iterations=2)
    failed = static_step(
        model, start, Load(dead_n=0.05 * down), solver=fastest_solver(), settings=impatient
    )
    assert failed.status is StaticStatus.STEP_FAILED and not failed.converged
    assert failed.newton.status in {NewtonStatus.TOO_MANY_ITERATIONS, NewtonStatus.STALLED}
    assert failed.state is start.state


def test_a_load_that_nothing_bears_is_approached_as_near_as_can_be():
    # Dead compression beyond what any admissible deformation carries.
    model = clamped_block()
    load = Load(dead_n=on_top(model, (0.0, -1e5)))
    settings = StaticSettings(halvings=4)
    *found, last = static_path(model, load, settings=settings)
    assert last.status is StaticStatus.STEP_TOO_SMALL
    assert last.newton.status is not NewtonStatus.CONVERGED
    assert not found or last.state is found[-1].state


def test_supports_are_moved_with_all_the_body():
    model = clamped_block()
    body = model.body
    held = np.concatenate([body.dofs("bottom"), body.dofs("top")])
    lifted = np.repeat([0.0, 1.0], [body.dofs("bottom").size, body.dofs("top").size])
    lifted[held % 2 == 0] = 0.0
    result = solve_static(Model(body, held=held), Load(held_mm=1.5 * lifted))
    assert result.converged
    np.testing.assert_array_equal(result.displacement.flat[held], 1.5 * lifted)
    assert result.reaction[body.dofs("top", along="y")].sum() > 1.0


def test_one_thread_and_two_give_the_same_bits():
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 8, 33), np.linspace(0, 3, 13))
    mesh = mesh.with_boundaries({"low": lambda x: x[1] == 0, "top": lambda x: x[1] == 3})
    body = Body(mesh, Ogden([0.05], [10.789], poisson=0.49), plane="stress")
    model = Model(body, held=body.dofs("low"), loads=[FollowerPressure(body.surface("top"))])
    one, two = (
        solve_static(model, Load(pressure_mpa=0.02), threads=Threads(count)) for count in (1, 2)
    )
    assert one.converged and np.abs(one.displacement).max() > 0.1
    assert np.array_equal(one.displacement, two.displacement)


def steered() -> tuple[Model, Steering]:
    block = clamped_block()
    model = Model(block.body, held=block.held, loads=[FollowerPressure(block.body.surface("top"))])
    return model, Steering(int(model.body.dofs("top", along="y")[0]), 0.3)


def test_the_border_of_a_steering_is_the_derivative_of_its_balance():
    model, steering = steered()
    rng = np.random.default_rng(4)
    here = rng.normal(0, 0.02, model.body.nodes.shape)
    here.flat[model.held] = 0.0
    load, before = Load(pressure_mpa=0.2), model.at_rest()

    def residual(displacement, pressure):
        there = replace(load, pressure_mpa=pressure)
        return model.balance(displacement, there, before, further=steering).residual

    tangent = model.balance(here, load, before, further=steering).tangent(False)
    step = 1e-6
    by_pressure = (residual(here, 0.2 + step) - residual(here, 0.2 - step)) / (2 * step)
    assert np.abs(tangent.border.columns).max() > 1e-2
    np.testing.assert_allclose(tangent.border.columns[:, 0], by_pressure[:-1], atol=1e-8)
    np.testing.assert_allclose(tangent.border.corner[0], by_pressure[-1:], atol=1e-8)
    move = rng.normal(size=here.shape)
    move.flat[model.held] = 0.0
    along = (residual(here + step * move, 0.2) - residual(here - step * move, 0.2)) / (2 * step)
    exact = np.append(tangent.matrix @ move.ravel(), tangent.border.rows @ move.ravel())
    assert np.abs(along).max() > 0.1
    np.testing.assert_allclose(exact, along, atol=1e-6 * np.abs(along).max())


def test_a_steered_step_ends_where_the_pressure_alone_would():
    model, steering = steered()
    result = static_step(model, kept_at(model), Load(), solver=fastest_solver(), further=steering)
    assert result.converged
    assert result.displacement.flat[steering.unknown] == pytest.approx(0.3, abs=1e-10)
    alone = solve_static(model, Load(pressure_mpa=result.load.pressure_mpa))
    np.testing.assert_allclose(alone.displacement, result.displacement, atol=1e-6)
