"""Tissue that touches tissue for the first time within a step sticks from where it touches.

One block falls onto another at a slant. Were slip counted from the start of the step, the way
through the air would count: a long step would begin contact at the limit of friction.
"""

from dataclasses import fields, replace

import numpy as np
import pytest

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.contact.laws import FrictionLaw, NormalLaw
from geometry2d.rigid import rotated
from tests.support.contact_models import (
    block,
    followed,
    linear_elastic,
    loaded,
    still,
    unknowns,
)
from tests.support.marks import slow
from tests.support.two_bodies import between, joined

GAP_MM, PRESSED_MM = 0.1, 0.02


def falling(across, *, bulge=0.0, lower_mpa=1.0, angle=0.0, reach=0.2):
    """A block of 1 MPa above another; its top is driven (across, −GAP_MM − PRESSED_MM) in 1 s.

    ``bulge`` is the curvature of the falling block's lower side, 1/mm; ``angle`` turns everything.
    """
    above, below = linear_elastic(1.0, 0.3), linear_elastic(lower_mpa, 0.45)
    lower = block(np.linspace(-2, 2, 25), np.linspace(-1, 0, 7), below, element="Q8")
    upper = block(np.linspace(-0.9, 1.1, 10), np.linspace(0, 0.8, 5), above, element="Q8")
    x, y = upper.mesh.p
    lifted = np.array([x, y + GAP_MM + (1 - y / 0.8) * bulge * x**2 / 2])
    upper = Body(replace(upper.mesh, doflocs=lifted), above, plane=Plane.STRAIN, element="Q8")
    materials = {"lower": below, "upper": above}
    mesh = joined(lower, upper, materials, "Q8").mesh
    mesh = replace(mesh, doflocs=rotated(mesh.p.T, angle).T)
    body = Body(mesh, materials, plane=Plane.STRAIN, element="Q8")
    pair = between(body, NormalLaw(50.0, 1e-4), FrictionLaw(1.0, 20.0), points=3, reach=reach)
    fixed = np.concatenate([unknowns(body, "lower_bottom", c) for c in (0, 1)])
    driven = [unknowns(body, "upper_top", c) for c in (0, 1)]
    end = rotated(np.array([across, -GAP_MM - PRESSED_MM]), angle)
    return loaded(
        body,
        contacts=(pair,),
        held=np.concatenate([fixed, *driven]),
        path=lambda t: t * np.repeat([0.0, *end], [len(fixed), len(driven[0]), len(driven[1])]),
    )


def touched(system, increments):
    """What the blocks do to each other in the end."""
    return followed(system, still(), increments=increments)[-1].contacts[0]


def drag_over_press(touch, angle=0.0):
    """Friction on the lower block over the force that presses it, positive to the right."""
    force = np.zeros_like(touch.displacement)
    np.add.at(force.reshape(-1), touch.dofs, touch.force)
    lower = touch.contact.surfaces[0]
    along, down = rotated(force[np.unique(lower.edges)].sum(axis=0), -angle)
    return along / -down


def shear_along_lower(touch):
    """Reference arc length (p,), mm, shear and pressure, MPa, of the lower block's points."""
    pair, points = touch.contact, touch.before
    chosen = (touch.points.pressure > 0) & (pair.owner[points.edge] == 0)
    arc = pair.arc_length(points.edge, points.local)[chosen]
    return arc, touch.points.shear[chosen], touch.points.pressure[chosen]


@pytest.mark.parametrize("increments", [1, 4])
@pytest.mark.parametrize(("across", "reach"), [(0.12, 0.2), slow(0.12, 0.05), slow(-0.3, 0.2)])
def test_a_slanted_fall_in_long_steps_ends_with_the_friction_of_short_ones(
    across, reach, increments
):
    # The gap is within reach at first, or out of it. Five sixths of the way are air; what is left
    # shears the blocks to 0.25 and 0.63 of the pressure.
    many = drag_over_press(touched(falling(across), 40))
    assert 0.2 < many * np.sign(across) < 0.7
    found = drag_over_press(touched(falling(across, reach=reach), increments))
    assert found == pytest.approx(many, rel=0.005)


@pytest.mark.slow
def test_shear_points_where_the_tissue_is_pushed_from_the_first_touch_on():
    # A bulging block spreads the soft one below it: shear to both sides, whatever the way through
    # air. It touches at many instants, of which one step foresees those without contact.
    model = {"across": 0.02, "bulge": 0.03, "lower_mpa": 0.2}
    arc, shear, pressure = shear_along_lower(touched(falling(**model), 80))
    once = shear_along_lower(touched(falling(**model), 1))
    found = np.interp(arc, once[0], once[1])
    large = np.abs(shear) > 0.05 * pressure.max()
    assert np.count_nonzero(shear[large] > 0) > 10
    assert np.count_nonzero(shear[large] < 0) > 10
    np.testing.assert_array_equal(np.sign(found[large]), np.sign(shear[large]))
    assert np.sqrt(np.mean((found - shear) ** 2)) < 0.1 * pressure.max()


@pytest.mark.parametrize("angle", [0.6, -2.1])
def test_turning_the_fall_turns_the_result(angle):
    plain = touched(falling(0.12, bulge=0.03), 2)
    turned = touched(falling(0.12, bulge=0.03, angle=angle), 2)
    assert drag_over_press(turned, angle) == pytest.approx(drag_over_press(plain), rel=1e-6)
    np.testing.assert_allclose(rotated(turned.displacement, -angle), plain.displacement, atol=1e-8)


def test_where_nothing_touches_anew_nothing_changes():
    system = falling(0.12)
    state = followed(system, still(), increments=40)[-1].state
    expected = state.contacts[0]
    reached = system.model.with_first_contact(state, state.displacement, state.placement)
    for item in fields(expected):
        found = getattr(reached.contacts[0], item.name)
        np.testing.assert_array_equal(found, getattr(expected, item.name))
