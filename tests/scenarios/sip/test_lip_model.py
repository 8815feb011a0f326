"""What of a lip may touch: skin and inner side as one line, for everything that it meets."""

import numpy as np
import pytest

from fem2d.contact.rigid import rigid_contacts
from fem2d.contact.self_contact import self_contacts
from fem2d.materials.prony import PronySeries
from scenarios.settings.scenario import load_scenario
from scenarios.settings.tables import SettingError
from scenarios.sip.lip_model import Lips


@pytest.fixture(scope="module")
def lips() -> Lips:
    scenario = load_scenario("DC-AE", ["numerics.resolution=coarse"])
    return Lips(scenario, scenario.head.section(), scenario.package.section())


@pytest.mark.parametrize("lip", ["upper", "lower"])
def test_the_free_surface_is_one_line_of_skin_and_inner_side(lips: Lips, lip: str):
    edges = lips.free_edges(lip)
    np.testing.assert_array_equal(edges[1:, 0], edges[:-1, 1])
    parts = [lips.body.edges(f"{lip}_{part}") for part in ("skin", "inner")]
    assert {tuple(e) for e in edges} == {tuple(e) for part in parts for e in part}
    bone = set(lips.body.edges(f"{lip}_bone").ravel())
    cut = set(lips.body.edges(f"{lip}_cut").ravel())
    ends = {int(edges[0, 0]), int(edges[-1, 1])}
    assert len(ends & bone) == len(ends & cut) == 1


def test_all_that_a_lip_touches_meets_the_same_surface(lips: Lips):
    for pair in rigid_contacts(lips.fem_model.contacts):
        lip = pair.name.split()[0]
        np.testing.assert_array_equal(pair.surface.edges, lips.free_edges(lip))
        assert pair.surface.at_nodes
    (lip_on_lip,) = self_contacts(lips.fem_model.contacts)
    assert [len(s.edges) for s in lip_on_lip.surfaces] == [
        len(lips.free_edges(lip)) for lip in lips.present
    ]


@pytest.mark.parametrize("lip", ["upper", "lower"])
def test_edges_that_may_touch_a_package_are_fine_on_both_sides_of_the_margin(lips: Lips, lip: str):
    nodes = lips.body.nodes
    for part in ("skin", "inner"):
        ends = nodes[lips.body.edges(f"{lip}_{part}")[:, :2]]
        middle = ends.mean(axis=1)
        near = np.linalg.norm(middle - lips.head.landmarks[f"stomion_{lip}"], axis=1) < 8
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        assert near.any()
        assert length[near].max() < 0.75


def test_viscous_skin_relaxes_in_the_model_and_at_rest_remembers_nothing():
    viscous = ["numerics.resolution=coarse", "skin.overstress=[0.5]", "skin.relaxation_s=[0.3]"]
    for settings in (viscous, viscous[:1]):
        scenario = load_scenario("A38-F", settings)
        model = Lips(scenario, scenario.head.section(), scenario.package.section()).fem_model
        remembered = model.at_rest().overstress
        if settings is viscous:
            assert model.prony == PronySeries((0.5,), (0.3,)) == scenario.skin.prony
            assert remembered is not None and not remembered.elastic.any()
        else:
            assert model.prony is remembered is scenario.skin.prony is None


def test_branches_of_viscosity_without_a_time_are_refused():
    with pytest.raises(SettingError, match=r"skin\.overstress.*2 branches.*skin.relaxation_s 1"):
        load_scenario("A38-F", ["skin.overstress=[0.5, 0.2]", "skin.relaxation_s=[0.3]"])
