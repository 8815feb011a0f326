"""The content of a package that is carried to a mouth: level, head at the rim, wetted skin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fem2d.loads.liquid import weight_mpa_per_mm
from geometry2d.container import carton
from geometry2d.rigid import RigidMotion
from scenarios.placing.lip_skin import LipSkin
from scenarios.settings.scenario import LIBRARY, Scenario, ScenarioError, load_scenario
from scenarios.sip.lip_model import Lips
from scenarios.sip.tilted_liquid import TiltedLiquid, tilted_liquid

HEAD_ANGLE_RAD = 0.1
TILTS_DEG = (20.0, 60.0, 90.0, 110.0)


def scenario_with(volume_ml: float, **more: float) -> Scenario:
    truth = LIBRARY / "A38-F" / "truth_motion.csv"
    return load_scenario("A38-F").with_(motion=truth, liquid={"volume_ml": volume_ml} | more)


def tilting() -> RigidMotion:
    """A neck that tilts in the head section: upright its axis, into the package, points down.

    The head section is turned by `HEAD_ANGLE_RAD`, so up is elsewhere in it.
    """
    angle = np.deg2rad(TILTS_DEG) - 0.5 * np.pi - HEAD_ANGLE_RAD
    shift = np.array([[120.0, -60.0], [115.0, -58.0], [112.0, -55.0], [111.0, -54.0]])
    return RigidMotion(np.array([0.0, 1.0, 2.0, 3.0]), angle, shift)


def liquid(volume_ml: float, **more: float) -> TiltedLiquid:
    scenario = scenario_with(volume_ml, **more)
    found = tilted_liquid(scenario, scenario.package.section(), tilting(), HEAD_ANGLE_RAD)
    assert found is not None
    return found


def test_a_scenario_without_liquid_has_none():
    scenario = load_scenario("A38-F")
    assert tilted_liquid(scenario, scenario.package.section(), tilting(), 0.0) is None


@pytest.mark.parametrize("sample", range(4))
def test_below_the_level_lies_the_volume_wherever_the_package_is(sample):
    pressure = liquid(150.0)(float(sample))
    up = np.asarray(pressure.up)
    head = scenario_with(150.0).known_motion()
    turned_rad = HEAD_ANGLE_RAD + np.interp(sample, head.time_s, head.head_rad)
    assert np.arctan2(*up) == pytest.approx(turned_rad, abs=1e-9)
    place = tilting().at(float(sample))
    turned = np.array([[np.cos(place.angle_rad), -np.sin(place.angle_rad)],
                       [np.sin(place.angle_rad), np.cos(place.angle_rad)]])  # fmt: skip
    container = carton(scenario_with(150.0).package.measurements)
    level = pressure.level_mm - float(np.asarray(place.shift_mm) @ up)
    assert container.volume_below(level, turned.T @ up) == pytest.approx(150e3, rel=1e-9)


def test_liquid_reaches_the_rim_when_the_package_is_tilted_enough():
    heads = np.array([liquid(150.0).at_rim_mpa(float(time)) for time in range(4)])
    assert heads[0] == 0.0
    assert np.all(np.diff(heads[1:]) > 0)
    # A carton of 110 mm on its head presses with less than its height.
    assert 0 < heads[-1] < weight_mpa_per_mm(1000.0) * 150.0


def test_the_suction_is_part_of_the_pressure():
    sucked = liquid(150.0, suction_kpa=4.0, suck_from_s=1.5, suck_to_s=2.5)
    far_above = np.array([0.0, 500.0])
    assert sucked(2.0).at(far_above)[0] == pytest.approx(-4e-3)
    assert sucked(0.5).at(far_above)[0] == 0.0


def test_more_than_the_package_holds_is_refused():
    with pytest.raises(ScenarioError, match=r"liquid\.volume_ml: a volume of 900 ml does not fit"):
        liquid(900.0)


@pytest.mark.parametrize("lip", ["upper", "lower"])
def test_wet_are_the_inner_side_and_the_red_up_to_where_is_said(lip):
    scenario = scenario_with(150.0, wet_to_mm=3.0).with_(numerics={"resolution": "coarse"})
    lips = Lips(scenario, scenario.head.section(), scenario.package.section())
    lips = replace(lips, liquid=liquid(150.0))
    loads = {load.name: load for load in lips.liquid_loads}
    load = loads[f"liquid on the {lip} lip"]
    assert lips.loads == lips.liquid_loads
    place = load.surface.positions(np.zeros_like(lips.body.nodes)).reshape(-1, 2)
    share = load.share.ravel()
    inner = lips.body.surface(f"{lip}_inner")
    on_inner = inner.positions(np.zeros_like(lips.body.nodes)).reshape(-1, 2)
    nearest = np.min(np.hypot(*(place[:, None] - on_inner[None]).transpose(2, 0, 1)), axis=1)
    assert share[nearest < 1e-9] == pytest.approx(1.0)
    skin = LipSkin.of(lips.head, lip)
    arc, away = _nearest(skin.points, place)
    along = np.array([skin.place_mm(float(s)) for s in arc])
    beyond = (along > 3.0 + 0.3) & (away < 0.3)
    within = (np.abs(along) < 3.0 - scenario.liquid.wet_fade_mm - 0.3) & (away < 0.3)
    assert beyond.any()
    assert np.all(share[beyond] == 0.0)
    assert within.any()
    assert share[within] == pytest.approx(1.0)


def _nearest(line: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Arc length on a polyline of the vertex nearest to each point, and its distance."""
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    distance = np.hypot(*(points[:, None] - line[None]).transpose(2, 0, 1))
    nearest = np.argmin(distance, axis=1)
    return arc[nearest], distance.min(axis=1)
