"""A body that is stretched where it is drawn: derivatives, and the same body drawn free."""

from __future__ import annotations

import numpy as np
import pytest

from fem2d.body.body import Body
from fem2d.body.definition import BodyError
from fem2d.body.kinematics import Plane
from tests.support.section_bodies import CASES, SOFT, STIFF, body, displacement, distorted

LABELS = [f"{plane.name.lower()}-{element}" for plane, element in CASES]
SOME = [(p, e) for p, e in CASES if e in ("T6", "T6M", "Q8", "Q4M")]


def stretched(it: Body, size: float = 0.1) -> Body:
    """Return a body with another prestretch at every point."""
    noise = size * np.random.default_rng(7).standard_normal((*it.weights.shape, 5))
    noise[..., 4] *= it.plane is not Plane.STRAIN
    return it.with_prestretch(np.array([1.1, 0.05, -0.1, 0.95, 1.0]) + noise)


@pytest.mark.parametrize(("plane", "element"), CASES, ids=LABELS)
def test_force_and_stiffness_are_derivatives(plane: Plane, element: str) -> None:
    it = body(plane, element, left=SOFT, right=SOFT, cells=1)
    tense, u = stretched(it, 0.03), displacement(it, size=0.01)
    response, h = tense.response(u), 1e-6
    assert np.isfinite(response.energy)
    stiffness = tense.pattern.matrix(response.stiffness).toarray()
    size = np.linalg.norm(response.force)
    assert np.linalg.norm(it.response(u).force - response.force) > 0.1 * size
    for direction in np.random.default_rng(5).standard_normal((3, *u.shape)):
        plus, minus = tense.response(u + h * direction), tense.response(u - h * direction)
        d = direction.ravel()
        slope = (plus.energy - minus.energy) / (2 * h)
        assert slope == pytest.approx(response.force @ d, rel=1e-6, abs=1e-8 * size)
        bend = (plus.force - minus.force) / (2 * h)
        np.testing.assert_allclose(stiffness @ d, bend, atol=1e-6 * np.abs(bend).max())


@pytest.mark.parametrize(("plane", "element"), SOME)
def test_it_is_the_body_that_is_drawn_free_of_stress_and_stretched(plane, element):
    across = 1.15 if plane is Plane.AXISYMMETRIC else 1.15 * (plane is Plane.STRESS) or 1.0
    G = np.array([1.15, 0.0, 0.0, 0.9, across])
    if plane is not Plane.AXISYMMETRIC:
        G[1:3] = 0.1, -0.05
    free_mesh = distorted(element)
    stretch = G[:4].reshape(2, 2)
    drawn_mesh = type(free_mesh)(
        stretch @ free_mesh.p, free_mesh.t,
        _boundaries=free_mesh.boundaries, _subdomains=free_mesh.subdomains,
    )  # fmt: skip
    laws = {"left": SOFT, "right": STIFF}
    free = Body(free_mesh, laws, plane=plane, element=element, thickness_mm=1.0)
    thick = across if plane is Plane.STRESS else 1.0
    drawn = Body(drawn_mesh, laws, plane=plane, element=element, thickness_mm=thick)
    drawn = drawn.with_prestretch(np.broadcast_to(G, (*drawn.weights.shape, 5)))
    u = displacement(drawn, size=0.01)
    from_free = drawn.nodes + u - free.nodes
    found, expected = drawn.response(u), free.response(from_free)
    assert found.energy == pytest.approx(expected.energy, rel=1e-12)
    scale = np.abs(expected.force).max()
    np.testing.assert_allclose(found.force, expected.force, atol=1e-11 * scale)
    scale = np.abs(expected.stiffness).max()
    np.testing.assert_allclose(found.stiffness, expected.stiffness, atol=1e-11 * scale)
    found_fields, expected_fields = drawn.fields(u), free.fields(from_free)
    for name in ("cauchy", "log_strain", "volume", "thickness_stretch"):
        found_values, values = getattr(found_fields, name), getattr(expected_fields, name)
        np.testing.assert_allclose(found_values, values, atol=1e-11 * np.abs(values).max())


@pytest.mark.parametrize("plane", list(Plane))
def test_none_leaves_every_bit(plane: Plane) -> None:
    it = body(plane, "T6")
    none = it.with_prestretch(np.broadcast_to(it.start, (*it.weights.shape, 5)))
    u = displacement(it)
    found, expected = none.response(u), it.response(u)
    assert found.energy == expected.energy
    np.testing.assert_array_equal(found.force, expected.force)
    np.testing.assert_array_equal(found.stiffness, expected.stiffness)


def test_what_is_no_prestretch_is_refused() -> None:
    it = body(Plane.STRESS, "T6")
    with pytest.raises(BodyError, match="integration points: give five"):
        it.with_prestretch(np.ones((3, 5)))
    with pytest.raises(BodyError, match="determinant -1: it must be positive"):
        it.with_prestretch(np.broadcast_to([1.0, 0, 0, -1.0, 1.0], (*it.weights.shape, 5)))
