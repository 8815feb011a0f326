"""Tissue under tension in its drawn shape: strips and a ring against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem2d.analyses.homogeneous import HomogeneousError, Mode, homogeneous_response
from fem2d.analyses.prestretch import stretches_under_tension
from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.body.overstress import Overstress, viscous_step
from fem2d.loads.load import Load
from fem2d.loads.nodal import NodalForce
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden
from fem2d.materials.prony import PronySeries
from fem2d.solvers.model import Model
from fem2d.solvers.prestress import EXACTLY, PrestressError, balanced_as_drawn
from fem2d.solvers.static import solve_static
from geometry2d.mesh import block_mesh
from tests.support.contact_models import block, unknowns

DERMIS = Ogden((0.05,), (10.789,), poisson=0.49)
BULK = NeoHookean(0.004292, poisson=0.49)
TENSION_MPA = 7e-3
PLANES = [Plane.STRESS, Plane.STRAIN]
LENGTH, HEIGHT = 4.0, 1.5


def strip(plane: Plane) -> Body:
    x, y = np.linspace(0, LENGTH, 5), np.linspace(0, HEIGHT, 3)
    return block(x, y, DERMIS, plane=plane, element="T6", distortion=0.2)


def along_x(body: Body, stretches: tuple[float, float, float]) -> np.ndarray:
    along, across, third = stretches
    return np.broadcast_to([along, 0.0, 0.0, across, third], (*body.weights.shape, 5))


def rollers(body: Body, *ends: str) -> np.ndarray:
    sides = [unknowns(body, end, 0) for end in ends]
    return np.concatenate([*sides, unknowns(body, "bottom", 1)])


@pytest.mark.parametrize("plane", PLANES)
def test_a_strip_under_tension_is_in_balance_as_it_is_drawn(plane):
    body = strip(plane)
    stretches = stretches_under_tension(DERMIS, TENSION_MPA, plane)
    assert stretches[0] > 1.01
    held = rollers(body, "left", "right")
    found = balanced_as_drawn(body, along_x(body, stretches), held)
    assert found.passes == 1
    stress = found.body.fields(np.zeros_like(body.nodes)).cauchy
    np.testing.assert_allclose(stress[..., 0, 0], TENSION_MPA, rtol=1e-9)
    assert np.abs(stress[..., 1, 1]).max() < 1e-9 * TENSION_MPA
    pull = found.support_n[unknowns(body, "right", 0)].sum()
    assert pull == pytest.approx(TENSION_MPA * HEIGHT, rel=1e-9)


@pytest.mark.parametrize("plane", PLANES)
def test_let_go_it_shrinks_to_its_free_shape_and_pulled_back_it_is_as_drawn(plane):
    body = strip(plane)
    along, across, third = stretches_under_tension(DERMIS, TENSION_MPA, plane)
    tense = balanced_as_drawn(body, along_x(body, (along, across, third)), rollers(body, "left"))
    assert tense.passes > 1  # nothing holds its end: in the drawn shape it is free of stress
    assert np.abs(tense.body.fields(np.zeros_like(body.nodes)).cauchy).max() < 1e-9
    held = balanced_as_drawn(
        body, along_x(body, (along, across, third)), rollers(body, "left", "right")
    ).body
    free = Model(held, held=rollers(held, "left"))
    shrunk = solve_static(free, Load(), settings=EXACTLY)
    assert shrunk.converged
    right, top = unknowns(body, "right", 0), unknowns(body, "top", 1)
    moved = shrunk.displacement.ravel()
    np.testing.assert_allclose(moved[right], LENGTH * (1 / along - 1), rtol=1e-8)
    np.testing.assert_allclose(moved[top], HEIGHT * (1 / across - 1), rtol=1e-8)
    # Forward: the same pull on the end of the free strip gives the drawn shape.
    end = np.zeros(moved.size)
    end[right] = balanced_as_drawn(
        body, along_x(body, (along, across, third)), rollers(body, "left", "right")
    ).support_n[right]
    pulled = solve_static(
        replace(free, loads=(NodalForce(end),)), Load(), start=shrunk, settings=EXACTLY
    )
    assert pulled.converged
    assert np.abs(pulled.displacement).max() < 1e-8


@pytest.mark.parametrize("plane", PLANES)
def test_stretched_further_it_answers_from_where_it_is_free(plane):
    body = strip(plane)
    stretches = stretches_under_tension(DERMIS, TENSION_MPA, plane)
    tense = body.with_prestretch(along_x(body, stretches))
    model = Model(tense, held=rollers(body, "left", "right"))
    count = len(unknowns(body, "right", 0))
    moved = np.zeros(model.held.size)
    moved[count : 2 * count] = 0.1 * LENGTH
    result = solve_static(model, Load(held_mm=moved))
    mode = Mode.UNIAXIAL if plane is Plane.STRESS else Mode.PLANAR
    curve = homogeneous_response(DERMIS, mode, [1.1 * stretches[0]])
    force = result.balance.forces[unknowns(body, "right", 0)].sum()
    # Nominal stress over the area that the strip has where it is free.
    area = HEIGHT / stretches[1] / (stretches[2] if plane is Plane.STRESS else 1.0)
    assert force == pytest.approx(float(curve.nominal_mpa[0]) * area, rel=1e-7)


def ring(plane: Plane) -> Body:
    """A quarter of a ring, 8 … 12 mm, whose outermost 0.4 mm are skin."""
    radii = np.concatenate([np.linspace(8, 11.6, 7), [11.8, 12.0]])
    mesh = block_mesh(1.0, 1.0, len(radii) - 1, 14).to_meshtri()
    s, t = mesh.p
    radius = np.interp(s, np.linspace(0, 1, len(radii)), radii)
    points = np.stack([radius * np.cos(np.pi / 2 * t), radius * np.sin(np.pi / 2 * t)])
    mesh = type(mesh)(points, mesh.t).with_boundaries(
        {"low": lambda x: x[1] < 1e-9, "high": lambda x: x[0] < 1e-9}
    )
    outer = np.hypot(*mesh.p[:, mesh.t].mean(axis=1)) > 11.6
    mesh = mesh.with_subdomains({"skin": np.flatnonzero(outer), "core": np.flatnonzero(~outer)})
    return Body(mesh, {"skin": DERMIS, "core": BULK}, plane=plane, element="T6")


def around(body: Body, tension_mpa: float) -> np.ndarray:
    """The prestretch of the ring's skin around the centre."""
    along, across, third = stretches_under_tension(DERMIS, tension_mpa, body.plane)
    x, y = np.moveaxis(body.tables.points, -1, 0)
    c, s = -y / np.hypot(x, y), x / np.hypot(x, y)
    difference = along - across
    prestretch = np.zeros((*body.weights.shape, 5))
    prestretch[..., [0, 3, 4]] = 1.0
    skin = body.elements_of("skin")
    tensed = np.stack(
        [across + difference * c * c, difference * c * s, difference * c * s,
         across + difference * s * s, np.full_like(c, third)], axis=-1,
    )  # fmt: skip
    prestretch[skin] = tensed[skin]
    return prestretch


@pytest.mark.parametrize("plane", PLANES)
def test_a_tense_skin_presses_on_a_ring_with_tension_over_radius(plane):
    body = ring(plane)
    held = np.concatenate([body.dofs("low", along="y"), body.dofs("high", along="x")])
    found = balanced_as_drawn(body, around(body, 2e-4), held)
    assert 1 < found.passes < 30
    # Inverse, then forward: what was found deforms into the drawn shape.
    forward = solve_static(Model(found.body, held=held), Load())
    assert forward.converged and np.abs(forward.displacement).max() < 1e-7
    # The cut bears nothing as a whole: what the skin pulls the core pushes.
    cut = found.support_n[body.dofs("low", along="y")].sum()
    stress = found.body.fields(np.zeros_like(body.nodes)).cauchy
    centre = body.tables.points.mean(axis=1)
    near = np.abs(np.arctan2(centre[:, 1], centre[:, 0]) - np.pi / 4) < 0.3
    x, y = np.moveaxis(body.tables.points, -1, 0)
    c, s = -y / np.hypot(x, y), x / np.hypot(x, y)
    hoop = stress[..., 0, 0] * c * c + 2 * stress[..., 0, 1] * c * s + stress[..., 1, 1] * s * s
    tension = hoop[np.intersect1d(body.elements_of("skin"), np.flatnonzero(near))].mean()
    assert tension > 1e-5
    assert abs(cut) < 1e-5 * tension * 0.4
    # Lamé: outer pressure p on a ring gives the hoop stress −p R²/(R² − r₀²) (1 + r₀²/r²).
    inner, outer = 8.0, 11.6
    core = np.intersect1d(body.elements_of("core"), np.flatnonzero(near))
    radius = np.hypot(x, y)[core].mean(axis=1)
    shape = outer**2 / (outer**2 - inner**2) * (1 + inner**2 / radius**2)
    pressure = tension * 0.4 / outer
    np.testing.assert_allclose(hoop[core].mean(axis=1), -pressure * shape, rtol=0.02)


def test_a_viscous_body_remembers_where_it_was_free():
    body = strip(Plane.STRESS)
    stretches = stretches_under_tension(DERMIS, TENSION_MPA, Plane.STRESS)
    tense = body.with_prestretch(along_x(body, stretches))
    series = PronySeries((0.5,), (0.3,))
    rest = np.zeros_like(body.nodes)
    history = Overstress.relaxed(tense, series, rest)
    step = viscous_step(tense, series, history, 0.1)
    still = step.response(tense.response(rest), rest)
    scale = np.abs(tense.response(rest).force).max()
    # At rest nothing changes: κ S + H = S.
    np.testing.assert_allclose(still.force, tense.response(rest).force, atol=1e-12 * scale)
    assert scale > 1e-4


def test_a_tension_that_a_material_never_bears_is_refused():
    with pytest.raises(HomogeneousError, match="less than 1e\\+06 kPa at a stretch of 3"):
        stretches_under_tension(BULK, 1e3, Plane.STRESS)


def test_a_shape_that_does_not_settle_is_refused():
    body = ring(Plane.STRESS)
    held = np.concatenate([body.dofs("low", along="y"), body.dofs("high", along="x")])
    with pytest.raises(PrestressError, match="after 2 equilibria the drawn shape is still"):
        balanced_as_drawn(body, around(body, 2e-4), held, most_passes=2)
