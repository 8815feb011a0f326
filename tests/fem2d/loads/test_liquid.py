"""The liquid's pressure: exact derivatives, Archimedes, walls, arcs, what seals hold back."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from hypothesis import given, settings
from hypothesis import strategies as st

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.loads.amplitude import LoadError
from fem2d.loads.liquid import LiquidLoad, LiquidPressure, weight_mpa_per_mm
from fem2d.loads.load import Load
from fem2d.solvers.model import Model
from fem2d.solvers.static import solve_static
from geometry2d.mesh import block_mesh
from tests.support.section_bodies import SOFT

WATER = weight_mpa_per_mm(1000.0)
THICKNESS_MM = 1.5
SIDES = ("left", "right", "bottom", "top")


def block(element: str = "Q8") -> Body:
    mesh = block_mesh(8.0, 4.0, 16, 8)
    return Body(mesh, SOFT, plane=Plane.STRESS, element=element, thickness_mm=THICKNESS_MM)


def wavy(body: Body, seed: int) -> np.ndarray:
    x, y = body.nodes.T
    smooth = np.stack([0.2 * np.sin(y), 0.3 * np.cos(x)], axis=1)
    return smooth + np.random.default_rng(seed).normal(0.0, 0.02, smooth.shape)


def load_on(body: Body, side: str, pressure: LiquidPressure, **changed: float) -> LiquidLoad:
    length = 8.0 if side in ("bottom", "top") else 4.0
    surface = body.surface(side)
    stretch = {"from_mm": -1.0, "to_mm": length + 1.0, "fade_mm": 1.0} | changed
    return LiquidLoad(f"liquid on the {side}", surface, field=lambda time_s: pressure, **stretch)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("element", ["Q4", "Q8"])
def test_stiffness_is_minus_the_derivative_of_the_force(element, side):
    body = block(element)
    pressure = LiquidPressure(2.6, (0.28, 0.96), 100 * WATER, 0.003)
    load = load_on(body, side, pressure, from_mm=0.3, to_mm=3.5, fade_mm=1.0)
    here, direction = wavy(body, 1), np.random.default_rng(2).normal(size=body.nodes.shape)
    step = 1e-6
    back, ahead = (load.force(here + s * step * direction, Load()) for s in (-1, 1))
    data = np.zeros(body.pattern.nonzeros)
    load.add_stiffness(data, body.pattern, here, Load(), psd=False)
    exact = -(body.pattern.matrix(data) @ direction.ravel())
    difference = (ahead - back) / (2 * step)
    assert np.abs(difference).max() > 1e-4
    np.testing.assert_allclose(exact, difference, atol=1e-7 * np.abs(difference).max())


def test_a_stand_in_has_nothing_of_a_load_without_potential():
    body = block()
    data = np.zeros(body.pattern.nonzeros)
    load = load_on(body, "top", LiquidPressure(9.0, (0.0, 1.0), WATER))
    load.add_stiffness(data, body.pattern, wavy(body, 3), Load(), psd=True)
    assert not data.any()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), tilt=st.floats(0.0, 6.3))
def test_a_body_under_water_is_lifted_by_the_weight_of_what_it_displaces(seed, tilt):
    body = block("Q4")
    displacement, up = wavy(body, seed), (float(np.sin(tilt)), float(np.cos(tilt)))
    pressure = LiquidPressure(60.0, up, WATER, suction_mpa=0.002)
    total = np.zeros(2)
    for side in SIDES:
        force = load_on(body, side, pressure).force(displacement, Load())
        total += force.reshape(-1, 2).sum(axis=0)
    x, y = (body.nodes + displacement)[body.tables.connectivity].transpose(2, 0, 1)
    area = 0.5 * abs(np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)))
    weight = WATER * THICKNESS_MM * area
    assert total == pytest.approx(weight * np.array(up), rel=1e-9, abs=1e-12 * weight)


def test_a_wall_bears_half_the_head_times_the_wetted_height_at_its_lower_third():
    body = block()
    level = 3.0  # where two elements meet, so that nothing is lost at the free surface
    load = load_on(body, "left", LiquidPressure(level, (0.0, 1.0), WATER))
    force = load.force(np.zeros_like(body.nodes), Load()).reshape(-1, 2)
    expected = 0.5 * WATER * level**2 * THICKNESS_MM
    assert force.sum(axis=0) == pytest.approx([expected, 0.0], rel=1e-12, abs=1e-18)
    moment = float(np.sum(body.nodes[:, 1] * force[:, 0]))
    assert moment / expected == pytest.approx(level / 3, rel=1e-12)


def test_a_wetted_arc_bears_the_integral_of_the_head_along_it():
    """A quarter of a disc: ρ g ∫ (z − y) n ds, from its lowest point to its side."""
    radius, level = 5.0, 4.0
    circle = skfem.MeshTri.init_circle(5, smoothed=True).scaled(radius)
    rim = circle.with_boundaries(
        {"wet": lambda x: (x[0] > 0) & (x[1] < 0) & (np.hypot(*x) > 0.95 * radius)}
    )
    body = Body(rim, SOFT, plane=Plane.STRESS, element="T3", thickness_mm=THICKNESS_MM)
    surface = body.surface("wet")
    pressure = LiquidPressure(level, (0.0, 1.0), WATER)
    load = LiquidLoad("arc", surface, -1.0, 9.0, 1.0, lambda time_s: pressure)
    total = load.force(np.zeros_like(body.nodes), Load()).reshape(-1, 2).sum(axis=0)
    # −∫ (z − r sin a)(cos a, sin a) r da from −90° to 0.
    across = -(level * radius + radius**2 / 2)
    up = level * radius + np.pi * radius**2 / 4
    assert total == pytest.approx(WATER * THICKNESS_MM * np.array([across, up]), rel=2e-3)


def test_suction_pulls_everywhere_and_head_only_below_the_level():
    pressure = LiquidPressure(3.0, (0.0, 1.0), WATER, suction_mpa=0.004)
    value, gradient = pressure.at(np.array([[0.0, 1.0], [0.0, 5.0]]))
    assert value == pytest.approx([2 * WATER - 0.004, -0.004])
    np.testing.assert_allclose(gradient, [[0.0, -WATER], [0.0, 0.0]])
    held = pressure.held_back_mpa(np.array([[0.0, 1.0], [0.0, 5.0]]))
    assert held == pytest.approx([2 * WATER + 0.004, 0.004])


def test_the_pressure_follows_time():
    body = block()
    rising = LiquidLoad(
        "rising",
        body.surface("left"),
        -1.0,
        5.0,
        1.0,
        lambda time_s: LiquidPressure(time_s, (0.0, 1.0), WATER),
    )
    nothing = np.zeros_like(body.nodes)
    early, late = Load(time_s=1.0), Load(time_s=3.0)
    push = [rising.force(nothing, load)[::2].sum() for load in (early, late)]
    assert push[1] == pytest.approx(9 * push[0], rel=1e-9)
    np.testing.assert_allclose(
        rising.change(nothing, early, late),
        rising.force(nothing, late) - rising.force(nothing, early),
    )


def test_a_held_block_bears_the_liquid_in_equilibrium():
    body = block()
    pressure = LiquidPressure(4.0, (0.0, 1.0), 50 * WATER)
    load = load_on(body, "left", pressure)
    held = np.concatenate(
        [2 * body.boundary_nodes("bottom"), 2 * body.boundary_nodes("bottom") + 1]
    )
    result = solve_static(Model(body, loads=[load], held=held), Load())
    assert result.converged
    assert result.iterations < 8
    assert np.abs(result.displacement).max() > 0.05
    applied = load.force(result.displacement, Load()).reshape(-1, 2).sum(axis=0)
    reaction = result.reaction.reshape(-1, 2).sum(axis=0)
    assert reaction == pytest.approx(-applied, rel=1e-5)


@pytest.mark.parametrize(
    ("changed", "what"),
    [({"fade_mm": 4.0}, "does not fit twice"), ({"from_mm": 20.0, "to_mm": 30.0}, "no point of")],
)
def test_a_stretch_that_makes_no_sense_is_refused(changed, what):
    with pytest.raises(LoadError, match=what):
        load_on(block(), "left", LiquidPressure(1.0, (0.0, 1.0), WATER), **changed)


def test_a_liquid_that_makes_no_sense_is_refused():
    with pytest.raises(LoadError, match="no unit vector"):
        LiquidPressure(1.0, (1.0, 1.0), WATER)
    with pytest.raises(LoadError, match="must not be negative"):
        LiquidPressure(1.0, (0.0, 1.0), -WATER)
