"""Lips whose skin is under tension: in balance as they are drawn, held by bone and cut ends."""

from __future__ import annotations

import numpy as np
import pytest

from fem2d.loads.load import Load
from fem2d.solvers.static import solve_static
from scenarios.settings.scenario import load_scenario
from scenarios.settings.tables import SettingError
from scenarios.sip.lip_model import Lips, without_neck


def lips(*settings: str, present: tuple[str, ...] = ("upper", "lower")) -> Lips:
    scenario = load_scenario("A38-F", ["numerics.resolution=coarse", *settings])
    section = scenario.head.section()
    return Lips(scenario, section, scenario.package.section(), present=present)


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_the_drawn_lips_are_in_balance_under_the_tension_that_is_asked(plane):
    tense = lips(f"numerics.plane={plane}", "skin.tension_kpa=7")
    assert tense.tense is not None
    assert tense.tense.mean_tension_mpa == pytest.approx(7e-3, rel=1e-3)
    model = without_neck(tense.quasi_static)
    rest = model.at_rest()
    unbalanced = model.balance(rest.displacement, Load(), rest).residual
    pulling = np.abs(tense.tense.anchors.nodal_n).max()
    assert pulling > 1e-4
    assert np.abs(unbalanced).max() < 1e-6 * pulling
    still = solve_static(model, Load())
    assert still.converged and np.abs(still.displacement).max() < 1e-6
    # What holds the skin are bone and cut ends, nothing on the free surface.
    pulled = np.flatnonzero(np.abs(tense.tense.anchors.nodal_n).reshape(-1, 2).max(axis=1))
    ends = [tense.body.boundary_nodes(f"{lip}_{p}") for lip in tense.present
            for p in ("bone", "cut")]  # fmt: skip
    assert set(pulled) <= set(np.concatenate(ends))


@pytest.mark.slow
def test_a_changed_model_keeps_its_mesh_and_its_tension():
    tense = lips("skin.tension_kpa=3", present=("lower",))
    body = tense.body
    assert tense.with_(activations={}).body is body
    assert tense.with_(present=("upper",)).body is not body
    rest = np.zeros_like(body.nodes)
    assert body.fields(rest).von_mises[body.elements_of("lower_dermis")].mean() > 1e-3


def test_without_tension_the_body_is_free_of_stress():
    free = lips()
    assert free.tense is None and free.body.prestretch is None
    assert not any(load.name.startswith("tension") for load in free.loads)


def test_a_tension_that_no_skin_has_is_refused():
    with pytest.raises(SettingError, match=r"skin\.tension_kpa = 200 kPa"):
        lips("skin.tension_kpa=200")
