"""Muscles: derivatives, resultants, and what switches them off."""

from __future__ import annotations

import numpy as np
import pytest

from fem2d.body.body import Body
from fem2d.body.component import BodyComponent
from fem2d.body.kinematics import Plane
from fem2d.loads.amplitude import Amplitude, LoadError
from fem2d.loads.muscle import FibresAcross, FibresInPlane, MuscleLoad
from fem2d.loads.muscle_law import MuscleFibre
from geometry2d.mesh import block_mesh
from tests.support.section_bodies import SOFT

ON = Amplitude((1.0, 2.0), (0.0, 0.8))
LAW = MuscleFibre(0.1, passive_share=0.05)
FIBRES = ("across", "in the plane")
PLANES = (Plane.STRESS, Plane.STRAIN)


def block(plane: Plane, element: str = "T6") -> Body:
    mesh = block_mesh(6.0, 3.0, 6, 3)
    mesh = mesh.to_meshtri() if element[0] == "T" else mesh
    return Body(mesh, SOFT, plane=plane, element=element, thickness_mm=1.5)


def muscle(body: Body, fibres: str, **changed: object) -> MuscleLoad:
    """Return a muscle in the right part of a block, its fibres and its share changing over it."""
    x, y = np.moveaxis(body.tables.points, -1, 0)
    if fibres == "across":
        course = FibresAcross(np.stack([-1 / (18 + x), 1 / (30 + y)], axis=-1), 1.1)
    else:
        angle = 0.4 + 0.1 * x - 0.2 * y
        course = FibresInPlane(np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    share = np.clip((x - 2.0) / 3.0, 0.0, 1.0) * 0.9
    values = {"share": share, "fibres": course, "law": LAW, "activation": ON} | changed
    return MuscleLoad("test muscle", body, **values)


def wild(body: Body, size: float, seed: int) -> np.ndarray:
    """Return a displacement that stretches some fibres by tens of per cent and turns them."""
    x, y = body.nodes.T
    smooth = np.stack([0.12 * x + 0.2 * y, -0.15 * x + 0.1 * y], axis=1)
    return smooth * size + np.random.default_rng(seed).normal(0.0, 0.03, body.nodes.shape)


@pytest.mark.parametrize("size", [1.0, -1.0], ids=["stretched", "shortened"])
@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("element", ["T6", "Q8"])
@pytest.mark.parametrize("fibres", FIBRES)
def test_force_and_stiffness_are_derivatives_of_the_energy(fibres, element, plane, size):
    body = block(plane, element)
    pulling = muscle(body, fibres)
    here = wild(body, size, 3) * (8.0 if fibres == "across" else 1.0)
    direction = np.random.default_rng(4).normal(size=here.shape)
    h = 1e-6
    back, at, ahead = (pulling.response(here + s * h * direction, 1.6) for s in (-1, 0, 1))
    stretch = pulling.stretch(here)
    assert stretch.max() - stretch.min() > 0.05
    work = float(at.force @ direction.ravel())
    assert abs(work) > 1e-4
    assert (ahead.energy - back.energy) / (2 * h) == pytest.approx(work, rel=1e-6)
    difference = (ahead.force - back.force) / (2 * h)
    exact = body.pattern.matrix(at.stiffness) @ direction.ravel()
    assert np.abs(exact).max() > 1e-5
    np.testing.assert_allclose(exact, difference, atol=1e-6 * np.abs(difference).max())


@pytest.mark.parametrize("fibres", FIBRES)
def test_the_stand_in_is_positive_semi_definite_and_exact_where_fibres_stiffen(fibres):
    body = block(Plane.STRESS)
    pulling = muscle(body, fibres, law=MuscleFibre(0.1))
    away = 25.0 if fibres == "across" else 1.0

    def stiffness(size: float, psd: bool) -> np.ndarray:
        u = size * away * np.stack([body.nodes[:, 0] * 0.1, np.zeros(len(body.nodes))], axis=1)
        data = pulling.response(u, 2.0, psd=psd).stiffness
        return body.pattern.matrix(data).toarray()

    # Away from their centre, or pulled along, fibres lengthen and weaken; else they stiffen.
    longer, shorter = 1.0, -1.0
    assert np.linalg.eigvalsh(stiffness(longer, False)).min() < -5e-5
    assert np.linalg.eigvalsh(stiffness(longer, True)).min() > -1e-12
    assert np.abs(stiffness(shorter, True)).max() > 5e-5
    np.testing.assert_array_equal(stiffness(shorter, True), stiffness(shorter, False))


def test_undeformed_fibres_across_the_section_push_with_tension_over_radius():
    body = block(Plane.STRAIN)
    share = np.full(body.weights.shape, 0.6)
    curvature = np.broadcast_to([-1 / 20.0, 1 / 50.0], (*body.weights.shape, 2))
    ring = MuscleLoad("ring", body, share, FibresAcross(curvature), MuscleFibre(0.1), ON)
    on_tissue = -ring.response(np.zeros_like(body.nodes), 2.0).force.reshape(-1, 2).sum(axis=0)
    tension_n = 0.8 * 0.1 * 0.6 * 6.0 * 3.0
    assert ring.area_mm2 == pytest.approx(0.6 * 18.0, rel=1e-12)
    assert on_tissue == pytest.approx(1.5 * tension_n * np.array([-1 / 20, 1 / 50]), rel=1e-12)
    assert ring.mean_tension(np.zeros_like(body.nodes), 2.0) == pytest.approx(0.08, rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_fibres_in_the_plane_neither_push_nor_turn_the_body_as_a_whole(seed):
    body = block(Plane.STRESS)
    pulling = muscle(body, "in the plane")
    u = wild(body, 1.0, seed)
    force = pulling.response(u, 2.0).force.reshape(-1, 2)
    x, y = (body.nodes + u).T
    assert np.abs(force).max() > 1e-3
    assert np.abs(force.sum(axis=0)).max() < 1e-14
    assert abs(np.sum(x * force[:, 1] - y * force[:, 0])) < 1e-13


def test_turning_the_body_turns_the_forces_of_fibres_in_the_plane():
    body = block(Plane.STRESS)
    pulling = muscle(body, "in the plane")
    u = wild(body, 1.0, 5)
    c, s = np.cos(0.9), np.sin(0.9)
    turn = np.array([[c, -s], [s, c]])
    turned = (body.nodes + u) @ turn.T - body.nodes
    before, after = (pulling.response(v, 2.0) for v in (u, turned))
    assert after.energy == pytest.approx(before.energy, rel=1e-12)
    np.testing.assert_allclose(
        after.force.reshape(-1, 2), before.force.reshape(-1, 2) @ turn.T, atol=1e-15
    )


@pytest.mark.parametrize("fibres", FIBRES)
def test_what_is_not_active_changes_no_bit(fibres):
    body = block(Plane.STRESS)
    slack = muscle(body, fibres, law=MuscleFibre(0.1))
    u = wild(body, 1.0, 6)
    alone, beside = body.response(u), slack.response(u, 0.5)
    assert slack.response(u, 1.5).energy != 0.0
    assert alone.energy + beside.energy == alone.energy
    np.testing.assert_array_equal(alone.force + beside.force, alone.force)
    np.testing.assert_array_equal(alone.stiffness + beside.stiffness, alone.stiffness)


@pytest.mark.parametrize("fibres", FIBRES)
def test_a_response_does_not_depend_on_what_was_asked_before(fibres):
    body = block(Plane.STRESS)
    pulling = muscle(body, fibres)
    u = wild(body, 1.0, 7)
    first = pulling.response(u, 1.7)
    pulling.response(5.0 * u, 1.2, psd=True)
    again = pulling.response(u, 1.7)
    assert again.energy == first.energy
    np.testing.assert_array_equal(again.force, first.force)
    np.testing.assert_array_equal(again.stiffness, first.stiffness)


@pytest.mark.parametrize("fibres", FIBRES)
def test_components_of_a_body_do_together_what_the_whole_does(fibres):
    left, right = block_mesh(6.0, 3.0, 6, 3), block_mesh(6.0, 3.0, 6, 3).translated((10.0, 0.0))
    body = Body(left + right, SOFT, plane=Plane.STRESS, element="Q8")
    x = body.tables.points[..., 0]
    share = np.where((x > 3.0) & (x < 13.0), 0.5, 0.0)
    pulling = muscle(body, fibres, share=share)
    u = 0.3 * wild(body, 1.0, 8)
    whole, total = pulling.response(u, 2.0), np.zeros(body.nodes.size)
    energy = 0.0
    for side in (body.nodes[:, 0] < 8.0, body.nodes[:, 0] > 8.0):
        nodes = np.flatnonzero(side)
        own = pulling.on_component(BodyComponent(body, nodes))
        part = own.response(u[nodes], 2.0)
        total[(2 * nodes[:, None] + np.arange(2)).ravel()] += part.force
        energy += part.energy
    assert abs(whole.energy) > 1e-3
    assert energy == pytest.approx(whole.energy, rel=1e-12)
    np.testing.assert_allclose(total, whole.force, atol=1e-15)
    only_left = muscle(body, fibres, share=np.where(x < 5.0, 0.5, 0.0))
    nodes = np.flatnonzero(body.nodes[:, 0] > 8.0)
    assert only_left.on_component(BodyComponent(body, nodes)) is None


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"activation": Amplitude((0.0,), (1.2,))}, "must lie in 0…1: no"),
        ({"share": np.full((36, 6), 1.5)}, "its share of the volume"),
        ({"share": np.zeros((36, 6))}, "lies in no element"),
        ({"share": np.ones((2, 6))}, "one of each for every point"),
    ],
)
def test_a_muscle_that_cannot_be_is_refused(changed, what):
    with pytest.raises(LoadError, match=what):
        muscle(block(Plane.STRESS), "across", **changed)


def test_fibres_that_make_no_sense_are_refused():
    with pytest.raises(LoadError, match="unit vectors"):
        FibresInPlane(np.ones((3, 6, 2)))
    with pytest.raises(LoadError, match="corner_stretch = 0"):
        FibresAcross(np.ones((3, 6, 2)), 0.0)
