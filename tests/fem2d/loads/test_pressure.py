"""Follower pressure: exact derivatives, and the resultants that statics demands."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem2d.body.body import Body
from fem2d.loads.load import Load
from fem2d.loads.pressure import Exposure, FollowerPressure, PressureError
from fem2d.materials.neo_hookean import NeoHookean
from geometry2d.mesh import block_mesh
from geometry2d.outline import Outline

CUP = Outline.from_corners([[2.0, 2.0], [6.0, 2.0], [6.0, 5.0], [2.0, 5.0]], [0.5, 0.5, 0.0, 0.0])
EXPOSURES = (None, Exposure(CUP, within_mm=2.6, clearance_mm=0.2))


def block(element: str, plane: str = "axisymmetric", thickness_mm: float = 1.3) -> Body:
    mesh, material = block_mesh(4.0, 2.0, 8, 3), NeoHookean(0.005, 4.0)
    return Body(mesh, material, plane=plane, element=element, thickness_mm=thickness_mm)


def wavy(body: Body, seed: int) -> np.ndarray:
    displacement = np.random.default_rng(seed).normal(0.0, 0.05, body.nodes.shape)
    displacement[:, 1] += 0.1 * np.cos(body.nodes[:, 0])
    return displacement


def force(pressure: FollowerPressure, displacement: np.ndarray) -> np.ndarray:
    return pressure.force(displacement, Load(pressure_mpa=1.0))


@pytest.mark.parametrize("exposure", EXPOSURES, ids=["everywhere", "under a cup"])
@pytest.mark.parametrize("plane", ["stress", "axisymmetric"])
@pytest.mark.parametrize("element", ["Q4", "Q8R"])
def test_stiffness_is_the_derivative_of_the_force(element, plane, exposure):
    body = block(element, plane)
    pressure = FollowerPressure(body.surface("top"), exposure)
    displacement, direction = wavy(body, 0), np.random.default_rng(1).normal(size=body.nodes.shape)
    step = 1e-6
    difference = (
        force(pressure, displacement + step * direction)
        - force(pressure, displacement - step * direction)
    ) / (2 * step)
    data = np.zeros(body.pattern.nonzeros)
    load = Load(pressure_mpa=1.0)
    pressure.add_stiffness(data, body.pattern, displacement, load, psd=False)
    exact = -body.pattern.matrix(data) @ direction.ravel()
    assert np.abs(difference).max() > 1.0
    np.testing.assert_allclose(exact, difference, atol=1e-8 * np.abs(difference).max())


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_pressure_all_around_a_body_pushes_it_nowhere(seed):
    body = block("Q8R", "strain")
    displacement = wavy(body, seed)
    total = np.zeros(2)
    for side in ("left", "right", "bottom", "top"):
        pressure = FollowerPressure(body.surface(side))
        total += force(pressure, displacement).reshape(-1, 2).sum(axis=0)
    assert np.abs(total).max() < 1e-12


def test_lift_of_a_full_turn_is_the_pressure_on_the_projected_disc():
    body = block("Q8R")
    displacement = wavy(body, 3)
    displacement[:, 0] = 0.0
    pressure = FollowerPressure(body.surface("top"))
    lift = force(pressure, displacement)[1::2].sum()
    assert lift == pytest.approx(-np.pi * 4.0**2, rel=1e-12)


def test_pressure_ends_where_the_cup_touches():
    exposure = EXPOSURES[1]
    share, gradient = exposure.share(np.array([[1.0, 1.9], [2.55, 2.0], [2.5, 2.1], [3.0, 1.0]]))
    assert share[0] == 1.0 and share[1] == 0.0 and share[2] == 0.0 and share[3] == 0.0
    assert not gradient[0].any()


def test_a_clearance_of_nothing_is_refused():
    with pytest.raises(PressureError, match="clearance_mm = 0 must be positive"):
        Exposure(CUP, within_mm=2.6, clearance_mm=0.0)
