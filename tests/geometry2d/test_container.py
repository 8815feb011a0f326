"""The level of liquid in a tilted container, against closed forms of boxes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry2d.container import Container, ContainerError, ContainerPart, carton
from geometry2d.neck import A38_NECK, DC_NECK

WIDE, TALL, DEEP = 40.0, 100.0, 30.0
BOX = Container((ContainerPart(np.array([[0, 0], [WIDE, 0], [WIDE, TALL], [0, TALL]]), DEEP),))


def up(tilt_deg: float) -> np.ndarray:
    """The upward direction seen from a box that is tilted from upright."""
    tilt = np.deg2rad(tilt_deg)
    return np.array([np.sin(tilt), np.cos(tilt)])


@pytest.mark.parametrize("filled_mm", [0.0, 12.5, 60.0, 100.0])
def test_an_upright_box_is_filled_to_its_volume_over_its_floor(filled_mm):
    assert BOX.level(filled_mm * WIDE * DEEP, up(0.0)) == pytest.approx(filled_mm, abs=1e-9)


@pytest.mark.parametrize("tilt_deg", [10.0, 30.0, 45.0])
def test_a_tilted_box_whose_floor_is_wet_has_the_level_of_its_middle(tilt_deg):
    """A plane through the middle of the floor's width cuts off what an untilted one does."""
    filled = 50.0
    expected = up(tilt_deg) @ [WIDE / 2, filled]
    assert BOX.level(filled * WIDE * DEEP, up(tilt_deg)) == pytest.approx(expected, rel=1e-12)


def test_a_strongly_tilted_box_holds_a_wedge():
    """Liquid in the corner: a right triangle with legs a and a/tan(tilt)."""
    tilt = np.deg2rad(70.0)
    leg = 10.0  # along the floor, from the lower corner
    volume = 0.5 * leg * leg / np.tan(np.pi / 2 - tilt) * DEEP
    # Upwards leans to +x, so the corner at the origin is the lowest.
    level = up(70.0) @ [leg, 0.0]
    assert leg / np.tan(np.pi / 2 - tilt) < TALL
    assert BOX.level(volume, up(70.0)) == pytest.approx(level, rel=1e-10)


@settings(max_examples=60, deadline=None)
@given(tilt=st.floats(0.0, 180.0), share=st.floats(0.001, 0.999))
def test_below_the_level_lies_the_volume_at_every_tilt(tilt, share):
    container = carton(A38_NECK)
    volume = share * container.capacity_mm3
    direction = up(tilt)
    level = container.level(volume, direction)
    assert container.volume_below(level, direction) == pytest.approx(volume, rel=1e-9)
    more = container.level(min(1.01 * volume, container.capacity_mm3), direction)
    assert more > level


@pytest.mark.parametrize("neck", [A38_NECK, DC_NECK])
def test_a_carton_holds_its_bore_shoulder_and_body(neck):
    bore = 0.5 * neck.root_diameter_mm - neck.wall_thickness_mm
    length = neck.mark_depth_mm + neck.carton_from_mm
    round_bore = np.pi * bore**2 * length
    square = neck.package_width_mm**2 * (neck.package_height_mm - neck.shoulder_mm)
    rest = carton(neck).capacity_mm3 - round_bore - square
    # The shoulder lies between a cylinder as wide as the bore and a box as wide as the carton.
    low = np.pi * bore**2 * neck.shoulder_mm
    assert low < rest < neck.package_width_mm**2 * neck.shoulder_mm
    assert 200e3 < carton(neck).capacity_mm3 < 320e3


def test_a_full_package_reaches_its_rim_when_it_is_tilted_and_an_almost_empty_one_much_later():
    """The neck frame's x points into the package: tilted by 90°, the axis lies level."""
    container = carton(A38_NECK)
    bore = 0.5 * A38_NECK.root_diameter_mm - A38_NECK.wall_thickness_mm
    lower_edge = np.array([-A38_NECK.mark_depth_mm, 0.5 * A38_NECK.mark_distance_mm - bore])

    def head_mm(volume_ml: float, tilt_deg: float) -> float:
        tilt = np.deg2rad(tilt_deg)
        upwards = np.array([-np.cos(tilt), np.sin(tilt)])  # upright: from the package to its rim
        return container.level(1e3 * volume_ml, upwards) - float(upwards @ lower_edge)

    assert head_mm(200.0, 30.0) < 0 < head_mm(200.0, 80.0)
    assert head_mm(20.0, 90.0) < 0 < head_mm(20.0, 120.0)


@pytest.mark.parametrize("volume_mm3", [-1.0, 120.1e3, float("nan")])
def test_a_volume_that_does_not_fit_is_refused(volume_mm3):
    with pytest.raises(ContainerError, match="does not fit into a container that holds 120 ml"):
        BOX.level(volume_mm3, up(0.0))


def test_no_direction_is_refused():
    with pytest.raises(ContainerError, match="is no direction"):
        BOX.level(1.0, (0.0, 0.0))
