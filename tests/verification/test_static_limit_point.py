"""Limit points: a balloon's closed form before, at and beyond its own, and an arch that snaps."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.loads.load import Load
from fem2d.loads.pressure import FollowerPressure
from fem2d.materials.material import compressibility
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.static import (
    StaticsError,
    StaticStatus,
    Steering,
    eigenvalue_nearest_zero,
    kept_at,
    solve_static,
    static_step,
)

INNER_MM, OUTER_MM = 1.0, 1.2
SHEAR_MPA = 1.0


def closed_form(inner_stretch: float) -> float:
    """Pressure, MPa, inside an incompressible neo-Hookean sphere (Green and Zerna 1968)."""
    grown = (inner_stretch**3 - 1) * INNER_MM**3
    outer = (1 + grown / OUTER_MM**3) ** (1 / 3)
    a, b = inner_stretch, outer
    return 0.5 * SHEAR_MPA * ((b**-4 + 4 / b) - (a**-4 + 4 / a))


@pytest.fixture(scope="module")
def balloon() -> tuple[Model, int]:
    radii, angles = np.linspace(INNER_MM, OUTER_MM, 4), np.linspace(0.0, np.pi / 2, 9)
    flat = skfem.MeshQuad.init_tensor(radii, angles).with_boundaries(
        {
            "inside": lambda x: x[0] < INNER_MM + 1e-9,
            "equator": lambda x: x[1] < 1e-9,
            "axis": lambda x: x[1] > np.pi / 2 - 1e-9,
        }
    )
    radius, angle = flat.p
    mesh = skfem.MeshQuad(
        np.ascontiguousarray([radius * np.cos(angle), radius * np.sin(angle)]),
        flat.t,
        _boundaries=flat.boundaries,
    )
    material = NeoHookean(0.5 * SHEAR_MPA, compressibility(SHEAR_MPA, 0.4999))
    body = Body(mesh, material, plane=Plane.AXISYMMETRIC, element="Q8M")
    held = np.concatenate([2 * body.boundary_nodes("axis"), 2 * body.boundary_nodes("equator") + 1])
    inside = body.surface("inside")
    model = Model(body, held=held, loads=[FollowerPressure(inside)])
    nearest = np.argmin(np.linalg.norm(body.nodes - [INNER_MM, 0.0], axis=1))
    return model, 2 * int(nearest)


def test_the_suction_is_found_beyond_the_limit_point(balloon):
    model, unknown = balloon
    solver = fastest_solver()
    stretches = np.arange(1.05, 2.0, 0.05)
    state, found, softest = kept_at(model), [], []
    for stretch in stretches:
        steering = Steering(unknown, (stretch - 1) * INNER_MM)
        state = static_step(model, state, state.load, solver=solver, further=steering)
        assert state.converged
        assert state.displacement.flat[unknown] == pytest.approx(steering.value_mm, abs=1e-10)
        found.append(state.load.pressure_mpa)
        softest.append(eigenvalue_nearest_zero(state, solver=solver))
    exact = np.array([closed_form(s) for s in stretches])
    np.testing.assert_allclose(found, exact, rtol=0.01)
    top = int(np.argmax(exact))
    assert 0 < top < len(exact) - 1
    assert np.argmax(found) == top
    # The tangent is singular at the limit point: its softest eigenvalue changes sign there.
    assert softest[top - 3] > 0 > softest[top + 3]


@pytest.mark.slow
def test_a_load_beyond_the_limit_point_is_not_reached(balloon):
    model, _ = balloon
    stretches = np.arange(1.05, 2.0, 0.01)
    highest = max(closed_form(s) for s in stretches)
    reached = solve_static(model, Load(pressure_mpa=1.3 * highest))
    assert reached.status is StaticStatus.STEP_TOO_SMALL
    assert reached.load.pressure_mpa == pytest.approx(highest, rel=0.02)


@pytest.fixture(scope="module")
def arch() -> Body:
    """A clamped arch, 20 mm wide, 2 mm high, 0.6 mm thick."""
    flat = skfem.MeshTri.init_tensor(np.linspace(-10, 10, 17), np.linspace(-0.3, 0.3, 2))
    x, y = flat.p
    mesh = skfem.MeshTri(np.stack([x, y + 2.0 * (1 - (x / 10) ** 2)]), flat.t)
    mesh = mesh.with_boundaries({"ends": lambda at: abs(at[0]) > 10 - 1e-9})
    return Body(mesh, NeoHookean(1.0, poisson=0.3), plane=Plane.STRAIN)


def test_a_body_alone_snaps_and_rests_where_it_also_comes_to_from_the_other_side(arch):
    ends, crown = arch.boundary_nodes("ends"), int(np.argmax(arch.nodes[:, 1]))
    model = Model(arch, held=np.concatenate([2 * ends, 2 * ends + 1]))

    def pushed(force_n, start=0.0):
        load = np.zeros_like(arch.nodes)
        load[crown, 1] = -force_n
        rest = solve_static(model, Load(dead_n=load.ravel()), start=kept_at(model, start))
        assert rest.converged
        return rest.displacement

    upright, snapped = pushed(0.004), pushed(0.006)
    assert upright[crown, 1] > -0.5 and snapped[crown, 1] < -3.0
    hanging = pushed(0.05)
    assert hanging[crown, 1] < snapped[crown, 1]
    np.testing.assert_allclose(pushed(0.006, hanging), snapped, atol=1e-6)
    assert pushed(0.004, hanging)[crown, 1] < -3.0  # two equilibria: the start decides


def test_a_start_that_is_turned_inside_out_is_refused(arch):
    with pytest.raises(StaticsError, match="inside out"):
        kept_at(Model(arch, held=np.array([0, 1])), -2.0 * arch.nodes * [1.0, 0.0])
