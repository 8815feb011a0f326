"""Constant forces on nodes: their energy, and what of them acts on a component."""

from __future__ import annotations

import numpy as np

from fem2d.body.component import BodyComponent
from fem2d.body.kinematics import Plane
from fem2d.loads.load import Load
from fem2d.loads.nodal import NodalForce
from tests.support.section_bodies import body


def test_forces_are_minus_the_derivative_of_the_energy_and_never_change():
    rng = np.random.default_rng(3)
    it = body(Plane.STRESS, "T6")
    pulling = NodalForce(rng.normal(size=it.nodes.size))
    u, direction = rng.normal(size=(2, *it.nodes.shape))
    slope = pulling.energy(u + direction, Load()) - pulling.energy(u, Load())
    assert slope != 0.0
    np.testing.assert_allclose(-slope, pulling.force(u, Load()) @ direction.ravel(), rtol=1e-12)
    later = Load(move=(1.0, 0.0), time_s=3.0)
    np.testing.assert_array_equal(pulling.force(u, later), pulling.nodal_n)
    assert not pulling.change(u, Load(), later).any()


def test_a_component_has_the_forces_on_its_nodes():
    it = body(Plane.STRESS, "T6")
    whole = BodyComponent(it, np.arange(len(it.nodes)))
    force = np.zeros(it.nodes.size)
    assert NodalForce(force).on_component(whole) is None
    force[7] = 2.0
    part = NodalForce(force).on_component(whole)
    assert part is not None and part.nodal_n[7] == 2.0
