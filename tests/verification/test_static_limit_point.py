"""A balloon: the closed form of an inflated sphere, before, at and beyond its limit point."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fem2d.body import Body
from fem2d.kinematics import Plane
from fem2d.linear import fastest_solver
from fem2d.materials.material import compressibility
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.pressure import FollowerPressure
from fem2d.statics import (
    Load,
    Reach,
    StaticSystem,
    advance,
    eigenvalue_nearest_zero,
    settle,
)
from fem2d.surface import Surface

INNER_MM, OUTER_MM = 1.0, 1.2
SHEAR_MPA = 1.0


def closed_form(inner_stretch: float) -> float:
    """Pressure, MPa, inside an incompressible neo-Hookean sphere (Green and Zerna 1968)."""
    grown = (inner_stretch**3 - 1) * INNER_MM**3
    outer = (1 + grown / OUTER_MM**3) ** (1 / 3)
    a, b = inner_stretch, outer
    return 0.5 * SHEAR_MPA * ((b**-4 + 4 / b) - (a**-4 + 4 / a))


@pytest.fixture(scope="module")
def balloon() -> tuple[StaticSystem, int]:
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
    body = Body.of(mesh, material, plane=Plane.AXISYMMETRIC, element="Q8M")
    held = np.concatenate([2 * body.boundary_nodes("axis"), 2 * body.boundary_nodes("equator") + 1])
    inside = Surface(body.edges("inside"), body.nodes, axisymmetric=True)
    system = StaticSystem(body, held, pressures=(FollowerPressure(inside),))
    nearest = np.argmin(np.linalg.norm(body.nodes - [INNER_MM, 0.0], axis=1))
    return system, 2 * int(nearest)


def test_the_suction_is_found_beyond_the_limit_point(balloon):
    system, unknown = balloon
    solver = fastest_solver()
    stretches = np.arange(1.05, 2.0, 0.05)
    state, found, softest = system.undeformed(), [], []
    for stretch in stretches:
        reach = Reach(unknown, (stretch - 1) * INNER_MM)
        state = settle(system, state, state.load, solver=solver, reach=reach)
        assert state.found
        found.append(state.load.pressure_mpa)
        softest.append(eigenvalue_nearest_zero(system, state, solver=solver))
    exact = np.array([closed_form(s) for s in stretches])
    np.testing.assert_allclose(found, exact, rtol=0.01)
    top = int(np.argmax(exact))
    assert 0 < top < len(exact) - 1
    assert np.argmax(found) == top
    # The tangent is singular at the limit point: its softest eigenvalue changes sign there.
    assert softest[top - 3] > 0 > softest[top + 3]


def test_a_load_beyond_the_limit_point_is_not_reached(balloon):
    system, _ = balloon
    stretches = np.arange(1.05, 2.0, 0.01)
    highest = max(closed_form(s) for s in stretches)
    reached = list(
        advance(system, system.undeformed(), Load(1.3 * highest), solver=fastest_solver())
    )
    assert not reached[-1].found
    assert reached[-2].load.pressure_mpa == pytest.approx(highest, rel=0.02)
