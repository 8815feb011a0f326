"""Deformable bodies in contact, and a body in contact with itself, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.body.surface import Surface, edge_shapes
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.contact.self_contact import SelfContact
from fem2d.loads.tie import ElasticTie
from fem2d.solvers.model import Model
from fem2d.solvers.newton_settings import NewtonSettings
from geometry2d.outline import Outline
from tests.support.contact_models import (
    block,
    followed,
    force_on_tissue,
    graded,
    linear_elastic,
    loaded,
    path,
    side_pressure,
    still,
    unknowns,
)
from tests.support.two_bodies import between, joined


@pytest.mark.parametrize("element", ["Q4", "T6", "Q8"])
def test_patch_of_two_blocks_with_meshes_that_do_not_match(element):
    # Taylor and Papadopoulos 1991: a uniform pressure crosses the interface unchanged.
    material = linear_elastic(1000.0, 0.4)
    lower = block(
        np.linspace(0, 1, 6), np.linspace(0, 0.5, 4), material, distortion=0.3, element=element
    )
    upper = block(
        np.linspace(0, 1, 9), np.linspace(0.5, 1, 5), material, distortion=0.3, element=element
    )
    body = joined(lower, upper, {"lower": material, "upper": material}, element)
    pair = between(body, NormalLaw(1e4, 1e-7), FrictionLaw(0.0), points=3)
    force = side_pressure(body, "upper_top", (0.0, -10.0))
    held = [unknowns(body, "lower_bottom", 1)]
    held += [unknowns(body, f"{piece}_left", 0) for piece in ("lower", "upper")]
    system = loaded(
        body,
        contacts=(pair,),
        load=lambda t: min(1.0, t) * force,
        held=np.unique(np.concatenate(held)),
    )
    # The upper block would float until it touches: it starts 1e-4 mm inside the lower one.
    down = np.zeros_like(body.nodes)
    down[np.unique(body.tables.connectivity[body.elements_of("upper")]), 1] = -1e-4
    start = system.model.at_rest(next_step_s=0.5)
    start = replace(start, displacement=down, contacts=(pair.initial_state(down, start.placement),))
    newton = NewtonSettings(tolerance=1e-11, force_floor_n=1.0, iterations=40)
    last = followed(system, still(2.0), increments=4, newton=newton, start=start)[-1]
    touch = last.contacts[0]
    assert len(touch.touching) == len(touch.points.pressure)
    np.testing.assert_allclose(touch.points.pressure, 10.0, rtol=1e-6)
    stress = body.fields(last.state.displacement).cauchy[..., 1, 1]
    np.testing.assert_allclose(stress, stress.mean(), rtol=1e-6)


@pytest.mark.slow
def test_hertz_of_two_elastic_bodies():
    # A parabola of curvature 1/R on a plane, both elastic: 1/E* = 2 (1 − ν²)/E.
    young, poisson, radius = 1.0, 0.3, 100.0
    material = linear_elastic(young, poisson)
    lower = block(graded(60, 0.04, 1.3, 1.35), -graded(60, 0.04, 0.4, 1.35)[::-1], material)
    upper = block(graded(60, 0.05, 1.3, 1.35), graded(60, 0.05, 0.4, 1.35), material)
    curved = upper.mesh.p.copy()
    curved[1] += curved[0] ** 2 / (2 * radius)
    upper = Body(replace(upper.mesh, doflocs=curved), material, plane=Plane.STRAIN, element="Q4")
    body = joined(lower, upper, {"lower": material, "upper": material}, "Q4")
    # The parabola is a polygon whose sides sag by 3e-6 mm: a penetration smaller than that would
    # only show the corners.
    pair = between(body, NormalLaw(100.0, 1e-9), FrictionLaw(0.0))
    top = unknowns(body, "upper_top", 1)
    fixed = [unknowns(body, "lower_bottom", c) for c in (0, 1)]
    fixed += [unknowns(body, f"{piece}_left", 0) for piece in ("lower", "upper")]
    fixed = np.setdiff1d(np.unique(np.concatenate(fixed)), top)
    held = np.concatenate([fixed, top])
    system = loaded(
        body,
        contacts=(pair,),
        held=held,
        path=lambda t: np.concatenate([np.zeros(len(fixed)), np.full(len(top), -0.03 * t)]),
    )
    # The system starts with a gap in one point only: the first increment finds the contact.
    last = followed(system, still(), increments=3)[-1]
    force = -2 * np.sum(last.reaction[top])
    half_width = np.sqrt(4 * force * radius * 2 * (1 - poisson**2) / (np.pi * young))
    peak = 2 * force / (np.pi * half_width)
    touch = last.contacts[0]
    points = touch.points
    shape, _ = edge_shapes(2, touch.before.local)
    deformed = body.nodes + last.state.displacement
    x = np.sum(shape * deformed[pair.edges[touch.before.edge], 0], axis=1)
    touching = points.pressure > 0
    slope, square = np.polyfit(x[touching] ** 2, points.pressure[touching] ** 2, 1)
    assert np.sqrt(square) == pytest.approx(peak, rel=0.005)
    assert np.sqrt(-square / slope) == pytest.approx(half_width, rel=0.005)


@pytest.mark.parametrize("friction", [0.0, 0.3, 1.0])
def test_block_dragged_over_a_block(friction):
    material = linear_elastic(1.0, 0.3)
    lower = block(np.linspace(-3, 3, 25), np.linspace(-1, 0, 5), material)
    upper = block(np.linspace(-1, 1, 12), np.linspace(0, 0.4, 4), material)
    body = joined(lower, upper, {"lower": material, "upper": material}, "Q4")
    pair = between(body, NormalLaw(50.0, 1e-5), FrictionLaw(friction, 20.0))
    down, along = unknowns(body, "upper_top", 1), unknowns(body, "upper_top", 0)
    fixed = np.concatenate([unknowns(body, "lower_bottom", c) for c in (0, 1)])

    def driven(t):
        steps = -0.004 * min(t, 1.0), 0.08 * max(0.0, t - 1.0)
        return np.repeat([0.0, *steps], [len(fixed), len(down), len(along)])

    held = np.concatenate([fixed, down, along])
    system = loaded(body, contacts=(pair,), held=held, path=driven)
    commits = followed(system, still(3.0), increments=48)
    reaction = commits[-1].reaction
    normal, drag = -reaction[down].sum(), reaction[along].sum()
    assert normal > 0.005
    # Where the upper block's corners dig in the two surfaces are not parallel to the drag.
    assert drag / normal == pytest.approx(friction, abs=0.02)
    for commit in commits:
        points = commit.contacts[0].points
        assert np.all(np.abs(points.shear) <= friction * points.pressure * (1 + 1e-9))
        force = np.zeros(body.nodes.size)
        np.add.at(force, commit.contacts[0].dofs, commit.contacts[0].force)
        np.testing.assert_allclose(force.reshape(-1, 2).sum(axis=0), 0, atol=1e-15)


def grooved_block():
    """A block with a slot from above, 0.3 mm wide, and the surface that runs through it."""
    x = np.concatenate([np.linspace(0, 1.85, 11), np.linspace(2.15, 4, 11)])
    mesh = skfem.MeshQuad.init_tensor(x, np.linspace(0, 2, 13))
    middle = mesh.p[:, mesh.t].mean(axis=1)
    slot = np.flatnonzero((np.abs(middle[0] - 2) < 0.15) & (middle[1] > 0.7))
    mesh = mesh.remove_elements(slot)
    outside = {
        "left": lambda p: np.isclose(p[0], 0),
        "right": lambda p: np.isclose(p[0], 4),
        "bottom": lambda p: np.isclose(p[1], 0),
    }
    mesh = mesh.with_boundaries(outside)
    rest = np.setdiff1d(mesh.boundary_facets(), np.concatenate(list(mesh.boundaries.values())))
    mesh = mesh.with_boundaries({**mesh.boundaries, "surface": rest})
    return Body(mesh, linear_elastic(1.0, 0.3), plane=Plane.STRAIN, element="Q8")


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_groove_closes_and_does_not_pass_through_itself(friction):
    body = grooved_block()
    surface = body.surface("surface", points_per_edge=3)
    law = NormalLaw(50.0, 1e-4)
    fold = SelfContact(
        (surface,),
        normal=law,
        friction=FrictionLaw(friction, 5.0),
        reach_mm=0.25,
        same_surface=True,
        name="groove",
    )
    sides = [unknowns(body, "left", 0), unknowns(body, "right", 0)]
    rest = np.unique(np.concatenate([unknowns(body, s, 1) for s in ("left", "right", "bottom")]))
    reach = [np.full(len(sides[0]), 0.45), np.full(len(sides[1]), -0.45)]
    system = loaded(
        body,
        contacts=(fold,),
        held=np.concatenate([*sides, rest]),
        path=lambda t: t * np.concatenate([*reach, np.zeros(len(rest))]),
    )
    last = followed(system, still(), increments=20)[-1]
    points = last.contacts[0].points
    touching = points.pressure > 0
    assert touching.sum() > 20
    assert -points.gap.min() < 0.01
    assert -points.gap.min() == pytest.approx(points.pressure.max() / 50.0 + 5e-5, rel=1e-6)
    deformed = body.nodes + last.state.displacement
    # Without contact the banks would overlap by 0.4 mm; what overlaps is the penetration.
    bank = np.unique(body.edges("surface"))
    bank = bank[(np.abs(body.nodes[bank, 0] - 2) < 0.16) & (body.nodes[bank, 1] > 0.8)]
    left = body.nodes[bank, 0] < 2
    overlap = deformed[bank[left], 0].max() - deformed[bank[~left], 0].min()
    assert 0 < overlap < 0.01
    force = np.zeros(body.nodes.size)
    np.add.at(force, last.contacts[0].dofs, last.contacts[0].force)
    np.testing.assert_allclose(force.reshape(-1, 2).sum(axis=0), 0, atol=1e-14)


@pytest.mark.slow
def test_shallow_ironing_with_an_elastic_die():
    # The five codes' problem itself: slab E 689.6, die E 6896 MPa, ν 0.32, μ 0.3; forces in N at
    # the end of pressing and in the middle of dragging (see test_contact_published.py).
    slab_law, die_law = linear_elastic(689.6, 0.32), linear_elastic(6896.0, 0.32)
    slab = block(np.linspace(0, 12, 61), np.linspace(0, 4, 17), slab_law)
    die = block(np.linspace(0.2, 1.4, 13), np.linspace(0, 1.2, 7), die_law)
    shaped = die.mesh.p.copy()
    bottom = 0.75 - np.sqrt(0.75**2 - (shaped[0] - 0.8) ** 2)
    shaped[1] = 4.2 + bottom + shaped[1] / 1.2 * (1.2 - bottom)
    die = Body(replace(die.mesh, doflocs=shaped), die_law, plane=Plane.STRAIN, element="Q4")
    body = joined(slab, die, {"lower": slab_law, "upper": die_law}, "Q4")
    around = np.concatenate([body.edges(f"upper_{side}") for side in ("left", "bottom", "right")])
    sides = (
        body.surface("lower_top", points_per_edge=2),
        Surface(around, body.nodes, points_per_edge=2),
    )
    pair = SelfContact(
        sides, normal=NormalLaw(2e4, 1e-4), friction=FrictionLaw(0.3, 2e3), reach_mm=0.3, name="die"
    )
    fixed = np.concatenate([unknowns(body, "lower_bottom", c) for c in (0, 1)])
    along, down = unknowns(body, "upper_top", 0), unknowns(body, "upper_top", 1)

    def driven(t):
        steps = 10 * max(0.0, t - 1), -min(t, 1.0)
        return np.repeat([0.0, *steps], [len(fixed), len(along), len(down)])

    held = np.concatenate([fixed, along, down])
    system = loaded(body, contacts=(pair,), held=held, path=driven)
    newton = NewtonSettings(tolerance=1e-6, force_floor_n=1.0)
    commits = followed(system, still(2.0), increments=20, end_s=1.0, step_s=0.05, newton=newton)
    state = replace(commits[-1].state, next_step_s=0.0125)
    commits += followed(
        system, still(2.0), increments=40, end_s=1.5, step_s=0.0125, start=state, newton=newton
    )
    found = {}
    for time in (0.5, 1.0, 1.25, 1.5):
        commit = min(commits, key=lambda c: abs(c.state.time_s - time))
        found[time] = (-commit.reaction[down].sum(), commit.reaction[along].sum())
    for time, (low, high) in {
        0.5: (81, 96),
        1.0: (268, 332),
        1.25: (335, 420),
        1.5: (337, 421),
    }.items():
        assert low <= found[time][0] <= high
    assert 0.3 <= found[1.5][1] / found[1.5][0] <= 0.53


def test_an_elastic_neck_as_stiff_as_plastic_acts_like_a_rigid_one():
    # A neck's wall of 1000 MPa, tied to the moving package behind it, on skin of 0.15 MPa.
    radius, skin_law, neck_law = 4.0, linear_elastic(0.15, 0.45), linear_elastic(1000.0, 0.4)
    skin = block(np.linspace(-6, 6, 49), np.linspace(-4, 0, 9), skin_law)
    wall = block(np.linspace(-2.5, 2.5, 22), np.linspace(0, 1, 4), neck_law)
    shaped = wall.mesh.p.copy()
    shaped[1] += (1 - shaped[1]) * (radius - np.sqrt(radius**2 - shaped[0] ** 2)) + 0.01
    wall = Body(replace(wall.mesh, doflocs=shaped), neck_law, plane=Plane.STRAIN, element="Q4")
    motion = path([0, 1, 2], [[0, 0], [0, -0.5], [0.6, -0.5]])
    normal, friction = NormalLaw(20.0, 1e-4), FrictionLaw(1.0, 5.0)

    def held(body, side, placement=None):
        return ElasticTie(body.surface(side), 1e3, attached_at=placement, name=side)

    top = skin.surface("top", points_per_edge=3)
    circle = Outline.circle([0, radius + 0.01], radius)
    pair = RigidContact(top, circle, normal=normal, friction=friction, name="rigid")
    rigid = Model(skin, contacts=(pair,), ties=(held(skin, "bottom"),))
    expected = force_on_tissue(followed(rigid, motion, increments=20)[-1])

    body = joined(skin, wall, {"lower": skin_law, "upper": neck_law}, "Q4")
    ties = (held(body, "lower_bottom"), held(body, "upper_top", motion.at(0.0)))
    elastic = Model(
        body, contacts=(between(body, normal, friction, points=3, reach=0.3),), ties=ties
    )
    last = followed(elastic, motion, increments=20)[-1]
    touch = last.contacts[0]
    force = np.zeros(body.nodes.size)
    np.add.at(force, touch.dofs, touch.force)
    below = np.unique(body.tables.connectivity[body.elements_of("lower")])
    found = force.reshape(-1, 2)[below].sum(axis=0)
    np.testing.assert_allclose(found, expected, rtol=0.02)
    assert 0 < last.energies.tie < 0.01 * last.energies.strain
