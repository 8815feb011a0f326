"""A viscous step: derivatives, its stand-in, and the stresses that its forces come from."""

from __future__ import annotations

import numpy as np
import pytest

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.body.overstress import Overstress, ViscousStep, second_piola, viscous_step
from fem2d.materials.prony import PronySeries
from tests.support.section_bodies import FIBROUS, STIFF, body, displacement

SERIES = PronySeries((0.8, 0.3), (0.2, 2.0))
STEP_S = 0.1
CASES = [
    (Plane.STRESS, "T6"),
    (Plane.STRAIN, "T6"),
    (Plane.STRAIN, "T6M"),
    (Plane.AXISYMMETRIC, "Q8M"),
    (Plane.AXISYMMETRIC, "T6"),
]
LABELS = [f"{plane.name.lower()}-{element}" for plane, element in CASES]


def remembered(it: Body) -> Overstress:
    """What a body remembers that was deformed quickly, twice."""
    history = Overstress.relaxed(it, SERIES, np.zeros_like(it.nodes))
    for seed, duration in ((3, 0.05), (4, 0.3)):
        history = history.after(it, SERIES, displacement(it, seed=seed), duration)
    return history


def step(it: Body) -> ViscousStep:
    return viscous_step(it, SERIES, remembered(it), STEP_S)


@pytest.mark.parametrize(("plane", "element"), CASES, ids=LABELS)
def test_force_and_stiffness_are_derivatives_of_the_energy(plane, element):
    it = body(plane, element, left=FIBROUS, right=STIFF, cells=1)
    viscous, u = step(it), displacement(it)

    def total(at):
        return viscous.response(it.response(at), at)

    response, h = total(u), 1e-6
    stiffness = it.pattern.matrix(response.stiffness).toarray()
    size = np.linalg.norm(response.force)
    held = np.abs(response.force - viscous.scale * it.response(u).force).max()
    assert held > 0.05 * np.abs(response.force).max()
    for direction in np.random.default_rng(5).standard_normal((4, *u.shape)):
        plus, minus = total(u + h * direction), total(u - h * direction)
        d = direction.ravel()
        slope = (plus.energy - minus.energy) / (2 * h)
        assert slope == pytest.approx(response.force @ d, rel=1e-6, abs=1e-8 * size)
        bend = (plus.force - minus.force) / (2 * h)
        np.testing.assert_allclose(stiffness @ d, bend, atol=1e-6 * np.abs(bend).max())
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-13 * np.abs(stiffness).max())


@pytest.mark.parametrize(("plane", "element"), CASES, ids=LABELS)
def test_forces_are_those_of_the_stresses_at_the_end_of_the_step(plane, element):
    it = body(plane, element, left=FIBROUS, right=STIFF, cells=1)
    u, history = displacement(it), remembered(it)
    force = step(it).response(it.response(u), u).force
    after = history.after(it, SERIES, u, STEP_S)
    fields = after.added_to(it.fields(u))
    F = fields.deformation_gradient
    volume = it.weights * np.linalg.det(F)
    moved = np.linalg.inv(F)[..., :2, :2]
    gradients = np.einsum("eqaj,eqji->eqai", it.tables.gradients, moved)
    expected = np.zeros_like(it.nodes)
    pull = np.einsum("eq,eqaj,eqij->eai", volume, gradients, fields.cauchy[..., :2, :2])
    if plane is Plane.AXISYMMETRIC:
        radius = it.tables.points[..., 0] * F[..., 2, 2]
        hoop = volume * fields.cauchy[..., 2, 2] / radius
        pull[..., 0] += np.einsum("eq,qa->ea", hoop, it.tables.values)
    np.add.at(expected, it.tables.connectivity, pull)
    np.testing.assert_allclose(force, expected.ravel(), atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(("plane", "element"), CASES, ids=LABELS)
def test_the_stand_in_is_positive_semi_definite(plane, element):
    it = body(plane, element, left=FIBROUS, right=STIFF, cells=1)
    viscous, u = step(it), displacement(it)
    pressed = ViscousStep(it, viscous.scale, viscous.held - [0.3, 0.1, 0.2, 0.3])
    largest = np.abs(it.response(u).stiffness).max()

    def lowest(data):
        return np.linalg.eigvalsh(it.pattern.matrix(data).toarray())[0]

    assert lowest(pressed.response(it.response(u), u).stiffness) < -1e-6 * largest
    stand_in = pressed.stand_in(it.response(u, psd=True).stiffness)
    assert lowest(stand_in) > -1e-12 * largest


def test_a_wild_trial_between_leaves_no_trace():
    it = body(Plane.STRESS, "T6")
    history, u = remembered(it), displacement(it)
    once = history.after(it, SERIES, u, STEP_S)
    history.after(it, SERIES, 2 * u, 3.0)
    again = history.after(it, SERIES, u, STEP_S)
    np.testing.assert_array_equal(once.branches, again.branches)
    np.testing.assert_array_equal(once.elastic, second_piola(it.fields(u)))


@pytest.mark.parametrize("plane", [Plane.STRESS, Plane.STRAIN])
def test_what_turns_with_the_tissue_stays_in_it(plane):
    it = body(plane, "T6")
    u = displacement(it)
    c, s = np.cos(0.9), np.sin(0.9)
    turn = np.array([[c, -s], [s, c]])
    turned = (it.nodes + u) @ turn.T - it.nodes
    viscous, history = step(it), remembered(it)
    force = viscous.response(it.response(u), u).force.reshape(-1, 2)
    of_turned = viscous.response(it.response(turned), turned).force.reshape(-1, 2)
    np.testing.assert_allclose(of_turned, force @ turn.T, atol=1e-12 * np.abs(force).max())
    after, of_turned = (history.after(it, SERIES, at, STEP_S) for at in (u, turned))
    np.testing.assert_allclose(of_turned.branches, after.branches, atol=1e-13)
    assert np.abs(after.branches).max() > 1e-3
