"""Muscles in meshed lips: they lie where anatomy says, move the lips, and close them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem2d.contact.rigid import rigid_contacts
from fem2d.contact.self_contact import SelfContactResponse
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.load import Load
from fem2d.solvers.static import StaticResult, solve_static
from geometry2d.anatomy.muscles import muscle_regions
from scenarios.settings.scenario import load_scenario
from scenarios.sip.lip_model import Lips
from scenarios.sip.lip_muscles import PARTS, fibre_activation, lip_muscles
from tests.support.marks import slow

ORBICULARIS = ("upper_orbicularis", "lower_orbicularis")


def lips_of(*settings: str, resolution: str = "coarse") -> Lips:
    scenario = load_scenario("A38-F", [f"numerics.resolution={resolution}", *settings])
    return Lips(scenario, scenario.head.section(), scenario.package.section())


@pytest.fixture(scope="module")
def lips() -> Lips:
    return lips_of()


def tensed(lips: Lips, activations: Mapping[str, float]) -> StaticResult:
    """Return lips and teeth, without a neck, at rest with muscles active, raised in a second."""
    rising = {name: Amplitude((0.0, 1.0), (0.0, full)) for name, full in activations.items()}
    moving = [contact for contact in rigid_contacts(lips.fem_model.contacts) if contact.moving]
    model = replace(
        lips.fem_model,
        contacts=[contact for contact in lips.fem_model.contacts if contact not in moving],
        loads=lip_muscles(lips.body, muscle_regions(lips.head), rising),
    )
    result = solve_static(model, Load(time_s=1.0))
    assert result.converged
    return result


def moved(lips: Lips, result: StaticResult, landmark: str) -> np.ndarray:
    nearest = np.argmin(np.hypot(*(lips.body.nodes - lips.head.landmarks[landmark]).T))
    return result.displacement[nearest]


def test_the_activation_of_an_element_is_that_of_its_fibres(lips: Lips) -> None:
    regions = muscle_regions(lips.head)
    levels = {name: 0.1 * (number + 1) for number, name in enumerate(PARTS)}
    rising = {name: Amplitude((0.0, 1.0), (0.0, full)) for name, full in levels.items()}
    muscles = lip_muscles(lips.body, regions, rising)
    found = fibre_activation(lips.body, muscles, 1.0)
    of_element = np.array([muscle.share.any(axis=1) for muscle in muscles])
    full = np.array([levels[name] for name, parts in PARTS.items() for _ in parts])
    alone = of_element.sum(axis=0) == 1
    assert alone.sum() > 50
    np.testing.assert_allclose(found[alone], full[of_element.argmax(axis=0)][alone], rtol=1e-12)
    shared = of_element.sum(axis=0) > 1
    least = np.where(of_element, full[:, None], 2.0).min(axis=0)
    most = np.where(of_element, full[:, None], 0.0).max(axis=0)
    assert shared.sum() > 5
    assert np.all((least[shared] < found[shared] + 1e-12) & (found[shared] < most[shared] + 1e-12))
    np.testing.assert_array_equal(found[~of_element.any(axis=0)], 0.0)
    half = fibre_activation(lips.body, muscles, 0.5)
    assert 0.0 < half.max() < found.max()
    assert not fibre_activation(lips.body, (), 1.0).any()


@pytest.mark.parametrize("resolution", ["coarse", "standard"])
def test_fibres_fill_the_area_that_anatomy_gives_them(resolution):
    lips = lips_of(resolution=resolution)
    regions = muscle_regions(lips.head)
    always = {name: Amplitude((0.0,), (0.1,)) for name in PARTS}
    muscles = lip_muscles(lips.body, regions, always)
    assert [muscle.name for muscle in muscles] == [p for parts in PARTS.values() for p in parts]
    for muscle in muscles:
        assert muscle.area_mm2 == pytest.approx(regions[muscle.name].area_mm2, rel=0.05)
        deep = lips.body.elements_of(f"{regions[muscle.name].lip}_bulk")
        assert set(muscle.elements) <= set(deep)


def test_a_body_without_a_lip_has_none_of_its_muscles(lips):
    upper = replace(lips, present=("upper",))
    always = {name: Amplitude((0.0,), (0.1,)) for name in PARTS}
    muscles = lip_muscles(upper.body, muscle_regions(lips.head), always)
    assert [muscle.name for muscle in muscles] == ["upper_peripheral", "upper_marginal", "levator"]


@pytest.mark.parametrize(
    ("muscle", "landmark", "upwards"),
    [
        ("levator", "upper_lip", 1),
        ("depressor", "lower_lip", -1),
        ("mentalis", "stomion_lower", 1),
        slow("upper_orbicularis", "stomion_upper", -1),
        slow("lower_orbicularis", "stomion_lower", 1),
    ],
)
def test_each_muscle_moves_its_lip_the_way_it_is_named_for(lips, muscle, landmark, upwards):
    result = tensed(lips, {muscle: 0.1})
    assert 0.3 < upwards * moved(lips, result, landmark)[1] < 4.0
    other = "stomion_lower" if landmark in ("upper_lip", "stomion_upper") else "stomion_upper"
    assert np.abs(moved(lips, result, other)).max() < 1e-6


@pytest.mark.slow
def test_orbicularis_presses_the_lips_on_the_teeth(lips):
    result = tensed(lips, dict.fromkeys(ORBICULARIS, 0.1))
    for contact, touch in zip(result.balance.model.contacts, result.contacts, strict=True):
        if "tooth" in contact.name:
            forwards = touch.force.reshape(-1, 2).sum(axis=0)[0]
            assert forwards > 0.005


def on_teeth(result: StaticResult) -> np.ndarray:
    """Return the forces of the upper and the lower lip on their teeth, N for each mm of width."""
    forces = [
        np.hypot(*touch.force.reshape(-1, 2).sum(axis=0))
        for contact, touch in zip(result.balance.model.contacts, result.contacts, strict=True)
        if "tooth" in contact.name
    ]
    assert len(forces) == 2
    return np.array(forces)


@pytest.mark.slow
def test_a_tone_of_three_hundredths_presses_the_incisors_as_lips_at_rest_do():
    """Lips at rest press upper incisors with 0.4 and lower ones with 0.8 kPa.

    Crowns are some 10 and 9 mm high. No number of the model was fitted to that.
    """
    lips = lips_of("head.jaw_opening_deg=0.0")
    pressure_kpa = 1e3 * on_teeth(tensed(lips, dict.fromkeys(ORBICULARIS, 0.03))) / [10.0, 9.0]
    assert 0.2 < pressure_kpa[0] < 0.8
    assert 0.4 < pressure_kpa[1] < 1.6


@pytest.mark.slow
def test_the_lower_lip_presses_more_within_what_was_published():
    """At most three times as much (Barlow 1985); Jung 2010 finds the upper lip the stronger one."""
    lips = lips_of("head.jaw_opening_deg=0.0")
    upper, lower = on_teeth(tensed(lips, dict.fromkeys(ORBICULARIS, 0.1)))
    assert 1.0 < lower / upper < 3.0


def lip_on_lip(result: StaticResult) -> tuple[float, float]:
    """Return the load that lips press each other with, N/mm, and the length that touches, mm."""
    touch = next(t for t in result.contacts if isinstance(t, SelfContactResponse))
    weight = touch.before.weight[touch.touching]
    return float(np.sum(touch.points.pressure[touch.touching] * weight)), float(weight.sum())


@cache
def closed(plane: str, resolution: str) -> tuple[float, float]:
    """Return how lips press each other with the teeth closed and a fifth of the full activation."""
    lips = lips_of("head.jaw_opening_deg=0.0", f"numerics.plane={plane}", resolution=resolution)
    return lip_on_lip(tensed(lips, dict.fromkeys(ORBICULARIS, 0.2)))


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_closed_lips_press_each_other_as_lips_of_people_do(plane):
    """With the teeth closed, a fifth of the largest activation closes lips that were 2.4 mm apart.

    Men press with 5 to 7 kPa, women with 2 to 6 kPa when they close, blow or suck (J. Oral Rehabil.
    2019, PMID 31144727). No number of the model was fitted to that.
    """
    load, length = closed(plane, "coarse")
    assert length > 1.5
    assert 2.0 < 1e3 * load / length < 7.0


@pytest.mark.slow
def test_how_lips_close_hardly_depends_on_the_mesh():
    (coarse_load, coarse_length), (load, length) = (
        closed("stress", resolution) for resolution in ("coarse", "standard")
    )
    assert coarse_load == pytest.approx(load, rel=0.03)
    assert coarse_length == pytest.approx(length, rel=0.05)
