"""People sampled at random are valid heads with the spreads and correlations that are stated."""

import numpy as np
import pytest

from geometry2d.anatomy.anthropometry import HeadError, HeadMeasurements
from geometry2d.anatomy.head import head_section
from geometry2d.anatomy.population import (
    ALONE,
    BELOW_THE_LIP,
    CORRELATION,
    FACE,
    FOLLOWS,
    NORMS,
    sampled_people,
)

SEXES = ("female", "male")


@pytest.fixture(scope="module")
def panel():
    return sampled_people(160, seed=7)


def deviations(panel, name):
    return np.array([person.deviations[name] for person in panel])


@pytest.mark.parametrize("sex", SEXES)
@pytest.mark.parametrize("name", NORMS)
def test_means_and_spreads_are_those_of_the_sources_within_sampling_error(panel, name, sex):
    mean, spread = NORMS[name].of(sex)
    values = np.array([getattr(p.measurements, name) for p in panel if p.sex == sex])
    assert abs(values.mean() - mean) < 3.5 * spread / np.sqrt(values.size)
    # The standard deviation of a sample's standard deviation is σ/√(2n).
    assert abs(values.std(ddof=1) - spread) < 3.5 * spread / np.sqrt(2 * values.size)


def test_correlations_are_those_of_the_source_within_sampling_error(panel):
    sample = np.corrcoef([deviations(panel, name) for name in FACE])
    error = (1 - CORRELATION**2) / np.sqrt(len(panel))
    off = ~np.eye(len(FACE), dtype=bool)
    assert np.all(np.abs(sample - CORRELATION)[off] < 3.5 * error[off])


def test_fold_and_chin_follow_the_lower_lip(panel):
    above = "lower_lip_projection_mm"
    for name in BELOW_THE_LIP:
        found = np.corrcoef(deviations(panel, above), deviations(panel, name))[0, 1]
        assert abs(found - FOLLOWS) < 3.5 * (1 - FOLLOWS**2) / np.sqrt(len(panel))
        above = name


def test_what_has_no_known_correlation_is_independent(panel):
    sample = np.corrcoef([deviations(panel, name) for name in ALONE])
    off = ~np.eye(len(ALONE), dtype=bool)
    assert np.all(np.abs(sample[off]) < 4.0 / np.sqrt(len(panel)))


def test_the_lower_third_of_the_face_is_that_of_the_norms(panel):
    thirds = {"female": (71.1, 3.5), "male": (81.1, 4.7)}
    for sex, (mean, spread) in thirds.items():
        parts = ("upper_lip_length_mm", "interlabial_gap_mm", "lower_lip_length_mm")
        values = np.array(
            [sum(getattr(p.measurements, n) for n in parts) for p in panel if p.sex == sex]
        )
        assert abs(values.mean() - mean) < 3.5 * spread / np.sqrt(values.size)
        assert values.std() == pytest.approx(spread, rel=0.35)


def test_nearly_every_draw_is_a_head_and_what_is_not_is_told(panel):
    rejected = [reason for person in panel for reason in person.rejected]
    assert 0 < len(rejected) < 0.05 * len(panel)
    assert all(len(reason.split()) > 3 for reason in rejected)
    assert all(person.section().upper.regions for person in panel[:4])


def test_a_larger_panel_begins_with_the_people_of_a_smaller_one(panel):
    assert sampled_people(5, seed=7) == panel[:5]
    assert sampled_people(5, seed=8)[0].measurements != panel[0].measurements


def test_both_takes_women_and_men_in_turn(panel):
    assert [person.name for person in panel[:3]] == ["P01-female", "P02-male", "P03-female"]
    assert {person.sex for person in sampled_people(3, sex="male")} == {"male"}


def test_without_spread_everybody_is_the_mean():
    (woman,) = sampled_people(1, spread=0.0)
    assert woman.measurements.upper_lip_length_mm == NORMS["upper_lip_length_mm"].female[0]
    assert not any(woman.deviations.values())


def test_what_is_not_sampled_is_the_base_head_s():
    base = HeadMeasurements(jaw_opening_deg=10.0, tooth_clearance_mm=0.4)
    (person,) = sampled_people(1, base=base)
    assert person.measurements.jaw_opening_deg == 10.0
    assert person.measurements.tooth_clearance_mm == 0.4


def test_the_nose_s_marker_keeps_its_share_of_the_way_to_the_tip(panel):
    for person in panel[:6]:
        at = head_section(person.measurements).landmarks["nose"]
        assert np.hypot(*at) == pytest.approx(person.measurements.ear_nose_mm)


def test_a_base_head_that_nobody_can_have_is_refused():
    with pytest.raises(HeadError, match=r"200 draws make no head.*base scenario"):
        sampled_people(1, base=HeadMeasurements(upper_crown_mm=2.0))
