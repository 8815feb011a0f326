"""Contact with rigid outlines against closed forms (Johnson, *Contact Mechanics*, 1985).

Small strain is reached by small loads: neo-Hookean blocks of Young's modulus 1 MPa whose largest
strain is about half a percent.
"""

from dataclasses import replace

import numpy as np
import pytest

from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.solvers.inertia import Inertia
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
    plane_below,
    side_pressure,
    still,
    unknowns,
)
from tests.support.crest import (
    NO_FRICTION,
    length_under_crest,
    pressed_by_crest,
    pressure_under_crest,
    supported,
)
from tests.support.marks import slow

QUASI_STATIC = Inertia(0.0)
GAUSS_2, GAUSS_4, NODES = {"points_per_edge": 2}, {"points_per_edge": 4}, {"at_nodes": True}
"""Where the tissue touches: lips do at their nodes."""
STIFF = NormalLaw(stiffness_mpa_per_mm=1e3, ramp_mm=1e-9)
"""Penetrates 6e-6 mm at the pressures below; indentations are a thousand times as deep."""


@pytest.mark.parametrize(
    ("element", "finest", "sampled"),
    [
        slow("Q4", 0.04, GAUSS_2),
        slow("T6", 0.05, GAUSS_4),
        ("Q4", 0.04, NODES),
        slow("T6", 0.05, NODES),
    ],
)
def test_hertz_cylinder(element, finest, sampled):
    # b² = 4 F'R/(π E*), p0 = 2 F'/(π b), here with the force found, half of which acts on the half
    # modelled. The block is 37 b wide and deep: its size changes p0 by some (b/D)² = 0.1 %.
    young, poisson, radius = 1.0, 0.3, 100.0
    body = block(
        graded(40, finest, 1.4, 1.2),
        -graded(40, finest, 0.5, 1.2)[::-1],
        linear_elastic(young, poisson),
        element=element,
    )
    top = body.surface("top", **sampled)
    cylinder = Outline.circle([0, radius], radius)
    system = supported(
        body,
        [RigidContact(top, cylinder, normal=STIFF, friction=NO_FRICTION, name="cylinder")],
        symmetric=True,
    )
    last = followed(system, path([0, 1], [[0, 0], [0, -0.025]]), increments=3)[-1]
    force = -2 * force_on_tissue(last)[1]
    half_width = np.sqrt(4 * force * radius * (1 - poisson**2) / (np.pi * young))
    peak = 2 * force / (np.pi * half_width)
    pressure = last.contacts[0].points.pressure
    x = top.positions(last.state.displacement)[..., 0]
    touching = pressure > 0
    # The ellipse p² = p0² (1 − x²/b²) fitted to all points gives both numbers without picking any.
    slope, square = np.polyfit(x[touching] ** 2, pressure[touching] ** 2, 1)
    assert np.sqrt(square) == pytest.approx(peak, rel=0.005)
    assert np.sqrt(-square / slope) == pytest.approx(half_width, rel=0.005)
    assert pressure.max() == pytest.approx(peak, rel=0.005)
    assert x[touching].max() == pytest.approx(half_width, abs=finest)


@pytest.mark.slow
def test_pressure_at_nodes_does_not_alternate_under_a_crest():
    place, pressure = pressure_under_crest(0.15, at_nodes=True)
    fine_place, fine = pressure_under_crest(0.05, at_nodes=True)
    flat = place < 0.3
    between = np.interp(place[flat], fine_place, fine)
    np.testing.assert_allclose(pressure[flat], between, rtol=0.03)
    outwards = pressure[: np.argmax(pressure) + 1]
    assert np.all(np.diff(outwards) > -0.02 * pressure.max())
    # Four Gauss points constrain an edge more often than it has unknowns.
    _, alternating = pressure_under_crest(0.15, points_per_edge=4)
    assert np.abs(np.diff(alternating, 2)).sum() > 2 * np.abs(np.diff(pressure, 2)).sum()


@pytest.mark.slow
@pytest.mark.parametrize("edge", [0.2, 0.3, 0.4])
@pytest.mark.parametrize("shift", [0.0, 0.25, 0.4])
def test_an_edge_does_not_sink_over_a_corner(edge, shift):
    # Corners of 0.4 mm, met by edges up to as long, wherever the nodes lie.
    _, last = pressed_by_crest(edge, aside=shift * edge, at_nodes=True, between_nodes=2)
    assert last.contacts[0].contact.deepest(last.contacts[0]) < 0.005
    assert force_on_tissue(last)[1] == pytest.approx(-0.03597, rel=0.03)


def test_without_points_between_nodes_an_edge_sinks_over_a_corner():
    _, last = pressed_by_crest(0.4, aside=0.1, at_nodes=True)
    assert last.contacts[0].contact.deepest(last.contacts[0]) > 0.02


@pytest.mark.slow
def test_points_between_nodes_stay_out_of_it_where_nodes_carry_the_load():
    _, alone = pressure_under_crest(0.1, at_nodes=True)
    place, watched = pressure_under_crest(0.1, at_nodes=True, between_nodes=2)
    np.testing.assert_allclose(watched[place < 0.5], alone[place < 0.5], rtol=1e-3)


@pytest.mark.slow
def test_length_of_contact_under_a_crest_wherever_the_nodes_lie():
    exact = length_under_crest(0.05, 0.0)
    coarse = [length_under_crest(0.2, aside) for aside in (0.0, 0.02, 0.04, 0.06, 0.08)]
    np.testing.assert_allclose(coarse, exact, rtol=0.015)


@pytest.mark.parametrize(("sampled", "within"), [(GAUSS_2, 0.005), (NODES, 0.01)])
def test_flat_punch_away_from_its_corners(sampled, within):
    # p = F'/(π √(a² − x²))
    # The lines are finest at the corner, where the exact pressure is infinite.
    inside, outside = graded(1, 0.01, 0.1, 1.2), graded(39, 0.01, 0.1, 1.2)
    x = np.concatenate([1 - inside[:0:-1], 1 + outside])
    body = block(x, -graded(40, 0.01, 0.1, 1.2)[::-1], linear_elastic(1.0, 0.3))
    top = body.surface("top", **sampled)
    punch = Outline.from_corners([[-1, 0], [1, 0], [1, 2], [-1, 2]], 0)
    system = supported(
        body,
        [RigidContact(top, punch, normal=STIFF, friction=NO_FRICTION, name="punch")],
        symmetric=True,
    )
    last = followed(system, path([0, 1], [[0, 0], [0, -0.002]]), increments=2)[-1]
    force = -2 * force_on_tissue(last)[1]
    pressure = last.contacts[0].points.pressure
    x = top.positions(last.state.displacement)[..., 0]
    away = np.abs(x) < 0.8
    assert away.sum() > 15
    exact = force / (np.pi * np.sqrt(1 - x[away] ** 2))
    np.testing.assert_allclose(pressure[away], exact, rtol=within)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("finest", "sampled", "largest_within"), [(0.03, GAUSS_2, 0.01), (0.02, NODES, 0.03)]
)
def test_cattaneo_mindlin_partial_slip(finest, sampled, largest_within):
    # c/b = √(1 − Q/(μP)) and q = μ p0 (√(1 − x²/b²) − (c/b) √(1 − x²/c²)) inside c. The block is
    # nearly incompressible (Dundurs' β = 0.0002) and is pressed without friction, so that no shear
    # is there before the cylinder is dragged. The radius is read between two points, half a node's
    # distance fine; at nodes the shear's peak at c, a cusp, is blunted.
    friction, radius, poisson = 0.2, 100.0, 0.4998
    half = graded(60, finest, 1.4, 1.35)
    body = block(
        np.concatenate([-half[:0:-1], half]),
        -graded(60, finest, 0.5, 1.35)[::-1],
        linear_elastic(1.0, poisson),
        element="Q4M",
    )
    top = body.surface("top", **sampled)
    cylinder = Outline.circle([0, radius], radius)

    def with_friction(law):
        return supported(
            body, [RigidContact(top, cylinder, normal=STIFF, friction=law, name="cylinder")]
        )

    motion = path([0, 1, 2], [[0, 0], [0, -0.025], [0.0045, -0.025]])
    pressed = followed(with_friction(NO_FRICTION), motion, increments=2, end_s=1.0)[-1].state
    rough = with_friction(FrictionLaw(friction, stiffness_mpa_per_mm=1e3))
    last = followed(rough, motion, increments=4, start=pressed)[-1]
    drag, normal = np.abs(force_on_tissue(last))
    assert 0.4 < drag / (friction * normal) < 0.7
    half_width = np.sqrt(4 * normal * radius * (1 - poisson**2) / np.pi)
    peak = 2 * normal / (np.pi * half_width)
    stick = half_width * np.sqrt(1 - drag / (friction * normal))
    points = last.contacts[0].points
    x = top.positions(last.state.displacement)[..., 0] - last.state.placement.shift_mm[0]
    touching = points.pressure > 0
    sticks, slips = touching & ~points.slipping, touching & points.slipping
    for side in (-1, 1):
        between = 0.5 * (np.max(side * x[sticks]) + np.min(side * x[slips & (side * x > 0)]))
        assert between == pytest.approx(stick, rel=0.02)
    root = np.sqrt(np.maximum(0, 1 - (x / half_width) ** 2))
    inner = np.sqrt(np.maximum(0, 1 - (x / stick) ** 2))
    exact = friction * peak * (root - stick / half_width * inner)
    difference = (np.abs(points.shear) - exact)[np.abs(x) < half_width]
    assert np.sqrt(np.mean(difference**2)) < 0.03 * friction * peak
    assert np.abs(points.shear).max() == pytest.approx(exact.max(), rel=largest_within)


@pytest.mark.parametrize("sampled", [GAUSS_4, NODES])
@pytest.mark.parametrize("element", ["Q4", "T6", "Q8"])
def test_patch_pressed_on_a_rigid_plane(element, sampled):
    # A uniform dead pressure on top of a distorted mesh arrives unchanged at the plane.
    body = block(
        np.linspace(0, 1, 7), np.linspace(0, 0.5, 4), linear_elastic(1.0, 0.3),
        element=element, distortion=0.35,
    )  # fmt: skip
    bottom = body.surface("bottom", **sampled)
    # The plane starts a little inside the block, which would otherwise hang free at first.
    pair = RigidContact(
        bottom, plane_below(1e-3), normal=NormalLaw(100.0, 1e-4), friction=NO_FRICTION, name="plane"
    )
    force = side_pressure(body, "top", (0.0, -0.05))
    system = loaded(
        body, contacts=(pair,), load=lambda t: t * force, held=unknowns(body, "left", 0)
    )
    last = followed(
        system,
        still(),
        increments=4,
        newton=NewtonSettings(tolerance=1e-11, force_floor_n=1e-3, iterations=30),
    )[-1]
    pressure = last.contacts[0].points.pressure
    np.testing.assert_allclose(pressure, 0.05, rtol=1e-6)
    stress = body.fields(last.state.displacement).cauchy[..., 1, 1]
    np.testing.assert_allclose(stress, stress.mean(), rtol=1e-6)


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.99, 1.0, 1.5])
def test_block_pushed_up_an_incline(friction):
    # Slope 1:10, weight G, horizontal push F: F/G = (μ + 0.1)/(1 − 0.1 μ), that is 0.412371 at
    # μ = 0.3 and 1.2222 at μ = 1, whatever the block does inside.
    slope = np.arctan(0.1)
    body = block(np.linspace(0, 4, 9), np.linspace(0, 1, 3), linear_elastic(1.0, 0.3), angle=slope)
    bottom = body.surface("bottom")
    pair = RigidContact(
        bottom,
        plane_below().moved(slope, [0, 0]),
        normal=NormalLaw(10.0, 1e-4),
        friction=FrictionLaw(friction, 10.0),
        name="slope",
    )
    weight = np.zeros((len(body.nodes), 2))
    weight[:, 1] = -body.lumped_mass(1.0)[1::2] * 0.01
    pushed = unknowns(body, "left", 0)
    system = loaded(
        body,
        contacts=(pair,),
        load=lambda t: min(1.0, 5 * t) * weight.ravel(),
        held=pushed,
        path=lambda t: max(0.0, t - 0.2) * 0.5 * np.ones(len(pushed)),
    )
    last = followed(system, still(), increments=20)[-1]
    points = last.contacts[0].points
    assert friction == 0 or points.slipping[points.pressure > 0].all()
    push = last.reaction[pushed].sum()
    assert push / -weight.sum() == pytest.approx((friction + 0.1) / (1 - 0.1 * friction), rel=1e-8)


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.99, 1.0, 1.5])
def test_plane_dragged_under_a_block(friction):
    # Stick, then F/N = μ; after the reversal stick, and the same ratio the other way.
    body = block(np.linspace(0, 4, 33), np.linspace(0, 0.5, 5), linear_elastic(1.0, 0.3))
    bottom = body.surface("bottom")
    pair = RigidContact(
        bottom,
        plane_below(),
        normal=NormalLaw(50.0, 1e-5),
        friction=FrictionLaw(friction, 50.0),
        name="plane",
    )
    held = np.concatenate([unknowns(body, "top", 0), unknowns(body, "top", 1)])
    system = loaded(body, contacts=(pair,), held=held)
    motion = path([0, 1, 2, 3], [[0, 0], [0, 1e-3], [0.06, 1e-3], [0.0, 1e-3]])
    commits = followed(system, motion, increments=60)
    sticking = []
    for commit in commits:
        points = commit.contacts[0].points
        assert np.all(np.abs(points.shear) <= friction * points.pressure * (1 + 1e-9))
        touching = points.pressure > 0
        sticking.append(np.mean(~points.slipping[touching]))
    time = np.array([c.state.time_s for c in commits])
    forces = np.array([force_on_tissue(c) for c in commits])
    for end, sign in ((2.0, 1), (3.0, -1)):
        fx, fy = forces[np.argmin(np.abs(time - end))]
        assert sign * fx / fy == pytest.approx(friction, rel=5e-4, abs=1e-9)
    if friction > 0:
        assert sticking[-1] == 0
    if friction > 0.9:  # less sticks no longer than one increment
        assert sticking[np.argmax(time > 2 + 1e-9)] > 0.9


@pytest.mark.parametrize(("friction", "slides"), [(1.01, False), (0.99, True)])
def test_block_under_its_weight_on_a_slope_of_45_degrees(friction, slides):
    gravity, density = 9810.0, 1e-6
    body = block(
        np.linspace(0, 4, 9), np.linspace(0, 0.5, 2), linear_elastic(1.0, 0.3), angle=-np.pi / 4
    )
    bottom = body.surface("bottom")
    slope = plane_below().moved(-np.pi / 4, [0, 0])
    pair = RigidContact(
        bottom,
        slope,
        normal=NormalLaw(10.0, 1e-4),
        friction=FrictionLaw(friction, 10.0),
        name="slope",
    )
    weight = np.zeros((len(body.nodes), 2))
    weight[:, 1] = -body.lumped_mass(density)[1::2] * gravity
    # The weight grows within 0.1 s, slowly against the block's own vibrations.
    system = loaded(
        body,
        contacts=(pair,),
        inertia=Inertia(density),
        load=lambda t: min(1.0, 10 * t) * weight.ravel(),
    )
    commits = followed(system, still(0.4), increments=80)
    travel = np.array([c.state.displacement.mean(axis=0) @ [1, -1] / np.sqrt(2) for c in commits])
    time = np.array([c.state.time_s for c in commits])
    after = time > 0.15
    if slides:
        acceleration = 2 * np.polyfit(time[after], travel[after], 2)[0]
        assert acceleration == pytest.approx(gravity * (1 - friction) / np.sqrt(2), rel=1e-4)
    else:
        assert np.ptp(travel[after]) < 1e-4


@pytest.mark.parametrize("increments", [1, 2, 7, 40])
def test_a_layer_reached_obliquely_sticks_where_it_was_reached(increments):
    # The plane comes down and sideways by 0.02 mm and meets the layer half way: what it travels
    # through air is no slip, so the layer's middle follows it by 0.01 mm, in one step as in many.
    body = block(np.linspace(0, 20, 41), np.linspace(-1, 0, 3), linear_elastic(1.0, 0.3))
    top = body.surface("top", points_per_edge=2)
    ceiling = Outline.from_corners([[-50, 0.01], [70, 0.01], [70, 50], [-50, 50]], 0)
    pair = RigidContact(
        top, ceiling, normal=STIFF, friction=FrictionLaw(1.0, 200.0), name="ceiling"
    )
    system = supported(body, [pair])
    last = followed(system, path([0, 1], [[0, 0], [0.02, -0.02]]), increments=increments)[-1]
    points = last.contacts[0].points
    middle = np.abs(top.positions(np.zeros_like(body.nodes))[..., 0] - 10) < 5
    assert np.all(points.pressure[middle] > 0) and not np.any(points.slipping[middle])
    followed_by = last.state.displacement[body.boundary_nodes("top")]
    x = body.nodes[body.boundary_nodes("top"), 0]
    np.testing.assert_allclose(followed_by[np.abs(x - 10) < 5, 0], 0.01, rtol=5e-3)


def test_energy_lost_by_a_layer_that_sticks_and_slips():
    # A thin layer sheared over ±U by a plane that presses p: loss per cycle 4 μp (U − μph/G).
    height, length, shear, pressure, friction = 1.0, 60.0, 0.4, 0.02, 0.5
    material = linear_elastic(2 * shear * 1.3, 0.3)
    body = block(np.linspace(0, length, 61), np.linspace(-height, 0, 3), material)
    top = body.surface("top", points_per_edge=2)
    normal = NormalLaw(100.0, 1e-6)
    pair = RigidContact(
        top,
        Outline.from_corners([[-50, 0], [110, 0], [110, 50], [-50, 50]], 0),
        normal=normal,
        friction=FrictionLaw(friction, 1e3),
        name="plane",
    )
    # All vertical unknowns are held: simple shear, at the pressure of the plane's penetration.
    held = np.concatenate([unknowns(body, "bottom", 0), 2 * np.arange(len(body.nodes)) + 1])
    system = loaded(body, contacts=(pair,), held=np.unique(held))
    deep = -(pressure / 100.0 + 0.5e-6)
    slip_at = friction * pressure * height / shear
    reach = 4 * slip_at
    stops = [[0, deep], [reach, deep], [-reach, deep], [reach, deep]]
    motion = path([0, 1, 3, 5], stops)
    commits, state = [], None
    for end in (1.0, 3.0, 5.0):  # leg by leg, so that the reversals are among the instants
        commits += followed(system, motion, increments=200, step_s=0.025, start=state, end_s=end)
        state = replace(commits[-1].state, next_step_s=0.025)
    where = np.array([c.state.placement.shift_mm[0] for c in commits])
    force = np.array([-force_on_tissue(c)[0] for c in commits])
    time = np.array([c.state.time_s for c in commits])
    cycle = time > 1 - 1e-9
    loss = abs(np.trapezoid(force[cycle], where[cycle]))
    exact = 4 * friction * pressure * length * (reach - slip_at)
    assert loss == pytest.approx(exact, rel=0.005)
    assert np.abs(force).max() == pytest.approx(friction * pressure * length, rel=2e-5)
    # Reversal: it sticks for 2 μph/G, no more and no less. One increment is reach/40.
    back = (time > 1 + 1e-9) & (time < 3 - 1e-9)
    slipping = np.array([c.contacts[0].points.slipping.all() for c in commits])
    first = where[back][np.argmax(slipping[back])]
    assert reach - first == pytest.approx(2 * slip_at, abs=reach / 20)


@pytest.mark.parametrize(("below", "above"), [(0.3, 2.0), (2.0, 0.3)])
def test_each_pair_has_its_own_friction(below, above):
    # A block between two plates, the lower one dragged: it slides on the plate with less friction
    # and sticks to the other, though both press it with the same force.
    body = block(np.linspace(0, 4, 17), np.linspace(0, 0.5, 5), linear_elastic(1.0, 0.3))
    sides = {side: body.surface(side) for side in ("bottom", "top")}
    normal = NormalLaw(50.0, 1e-5)
    plates = (
        RigidContact(
            sides["bottom"],
            plane_below(),
            normal=normal,
            friction=FrictionLaw(below, 50.0),
            name="below",
        ),
        RigidContact(
            sides["top"],
            plane_below().moved(np.pi, [0, 0.5]),
            normal=normal,
            friction=FrictionLaw(above, 50.0),
            moving=False,
            name="above",
        ),
    )
    system = loaded(body, contacts=plates)
    motion = path([0, 1, 2], [[0, 0], [0, 2e-3], [0.3, 2e-3]])
    last = followed(system, motion, increments=80)[-1]
    forces = [touch.force.reshape(-1, 2).sum(axis=0) for touch in last.contacts]
    assert forces[0][1] == pytest.approx(-forces[1][1], rel=1e-6)
    assert forces[0][0] / forces[0][1] == pytest.approx(min(below, above), rel=5e-4)
    slipping = [
        np.mean(touch.points.slipping[touch.points.pressure > 0]) for touch in last.contacts
    ]
    slides, sticks = (0, 1) if below < above else (1, 0)
    assert slipping[slides] == 1.0
    assert slipping[sticks] < 0.9
