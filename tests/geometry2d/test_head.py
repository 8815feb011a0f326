import dataclasses
from functools import cache

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry2d.curves import left_normals
from geometry2d.head import HeadError, HeadMeasurements, head_section

STANDARD_DEVIATION = {
    "nose_projection_mm": 1.7,
    "nasolabial_angle_deg": 9.5,
    "upper_lip_length_mm": 2.5,
    "upper_lip_projection_mm": 1.7,
    "upper_lip_thickness_mm": 1.4,
    "interlabial_gap_mm": 1.1,
    "lower_lip_length_mm": 2.4,
    "lower_lip_projection_mm": 2.2,
    "lower_lip_thickness_mm": 1.2,
    "sulcus_projection_mm": 1.6,
    "mentolabial_angle_deg": 10.0,
    "pogonion_projection_mm": 1.8,
    "pogonion_thickness_mm": 2.3,
    "menton_thickness_mm": 1.3,
    "dermis_thickness_mm": 0.25,
    "vermilion_thickness_mm": 0.25,
    "incisor_exposure_mm": 1.2,
    "overbite_mm": 0.7,
    "jaw_opening_deg": 3.0,
}

MEAN = HeadMeasurements()
heads = st.builds(
    lambda **by: dataclasses.replace(
        MEAN, **{n: getattr(MEAN, n) + STANDARD_DEVIATION[n] * k for n, k in by.items()}
    ),
    **{name: st.floats(-1.3, 1.3) for name in STANDARD_DEVIATION},
)

mean_head = cache(head_section)


def closed(measurements):
    return head_section(dataclasses.replace(measurements, jaw_opening_deg=0.0))


@given(heads)
@settings(max_examples=40, deadline=None)
def test_every_ordinary_person_gives_two_separate_sound_bodies(measurements):
    head = head_section(measurements)

    bodies = []
    for lip in (head.upper, head.lower):
        regions = {name: shapely.Polygon(p) for name, p in lip.regions.items()}
        for polygon in regions.values():
            assert polygon.is_valid
            assert polygon.exterior.is_ccw
        assert regions["dermis"].intersection(regions["bulk"]).area < 1e-6
        body = shapely.union(regions["dermis"], regions["bulk"])
        assert body.area == pytest.approx(sum(r.area for r in regions.values()), rel=1e-9)
        bodies.append(body)
    assert not bodies[0].intersects(bodies[1])
    for body, tooth in zip(bodies, (head.upper_tooth, head.lower_tooth), strict=True):
        rigid = shapely.Polygon(tooth.sampled(0.1))
        bone = shapely.LineString(
            (head.upper if body is bodies[0] else head.lower).curves["bone"]
        ).buffer(1.0)
        assert body.intersection(rigid).difference(bone).area < 1e-6


@given(heads)
@settings(max_examples=40, deadline=None)
def test_measuring_the_head_gives_the_measurements(measurements):
    m = measurements
    head = closed(m)
    at = head.landmarks
    subnasale = at["subnasale"]

    def ahead(name):
        return at[name][0] - subnasale[0]

    def below(name, other):
        return at[other][1] - at[name][1]

    # Smoothing moves rounded places by up to width²/2r, 0.1 mm at a radius of 2 mm.
    near = {"abs": 0.15}
    assert ahead("pronasale") == pytest.approx(m.nose_projection_mm, **near)
    assert ahead("upper_lip") == pytest.approx(m.upper_lip_projection_mm, **near)
    assert ahead("lower_lip") == pytest.approx(m.lower_lip_projection_mm, **near)
    assert ahead("sulcus") == pytest.approx(m.sulcus_projection_mm, **near)
    assert ahead("pogonion") == pytest.approx(m.pogonion_projection_mm, **near)
    assert below("stomion_upper", "subnasale") == pytest.approx(m.upper_lip_length_mm, **near)
    assert below("menton", "stomion_lower") == pytest.approx(m.lower_lip_length_mm, **near)
    assert below("stomion_lower", "stomion_upper") == pytest.approx(m.interlabial_gap_mm, **near)
    assert below("upper_incisor", "stomion_upper") == pytest.approx(m.incisor_exposure_mm, **near)
    assert below("upper_incisor", "lower_incisor") == pytest.approx(m.overbite_mm, abs=1e-9)
    assert np.hypot(*at["nose"]) == pytest.approx(m.ear_nose_mm)
    assert np.hypot(*(at["lower_incisor"] - at["hinge"])) == pytest.approx(m.hinge_incisor_mm)


@given(heads)
@settings(max_examples=20, deadline=None)
def test_lips_are_as_thick_as_measured(measurements):
    head = closed(measurements)
    for lip, name, thickness in (
        (head.upper, "upper_lip", measurements.upper_lip_thickness_mm),
        (head.lower, "lower_lip", measurements.lower_lip_thickness_mm),
    ):
        body = shapely.union_all([shapely.Polygon(p) for p in lip.regions.values()])
        x, y = head.landmarks[name]
        chord = body.intersection(shapely.LineString([(x + 5, y), (x - 25, y)]))
        assert chord.length == pytest.approx(thickness, abs=0.3)


@given(heads)
@settings(max_examples=20, deadline=None)
def test_dermis_is_as_thick_as_asked(measurements):
    head = head_section(measurements)
    for lip, border in ((head.upper, "labrale_superius"), (head.lower, "labrale_inferius")):
        skin = lip.curves["skin"]
        interface = shapely.LineString(lip.curves["interface"])
        thickness = shapely.distance(shapely.points(skin[5:-5]), interface)
        from_border = np.hypot(*(skin[5:-5] - head.landmarks[border]).T)
        margin = head.landmarks["stomion_upper" if lip is head.upper else "stomion_lower"]
        red = np.hypot(*(skin[5:-5] - margin).T) < 4.0
        outside = (from_border > 3.0) & (
            skin[5:-5, 1] > head.landmarks[border][1]
            if lip is head.upper
            else skin[5:-5, 1] < head.landmarks[border][1]
        )
        np.testing.assert_allclose(thickness[outside], measurements.dermis_thickness_mm, rtol=0.02)
        np.testing.assert_allclose(thickness[red], measurements.vermilion_thickness_mm, rtol=0.02)


def test_skin_has_no_kink():
    head = mean_head()
    for lip in (head.upper, head.lower):
        for name, sharpest in (("skin", 2.0), ("inner", 2.0), ("bone", 1.5)):
            normal = left_normals(lip.curves[name])
            turn = np.arccos(np.clip(np.sum(normal[1:] * normal[:-1], axis=1), -1, 1))
            step = np.hypot(*np.diff(lip.curves[name], axis=0).T)
            assert (turn / step).max() < 1 / sharpest, name


def test_lip_margins_are_round():
    head = mean_head()
    for lip, margin in ((head.upper, "stomion_upper"), (head.lower, "stomion_lower")):
        skin = lip.curves["skin"]
        near = np.hypot(*(skin - head.landmarks[margin]).T) < 7.0
        normal = left_normals(skin)[near]
        turn = np.arccos(np.clip(np.sum(normal[1:] * normal[:-1], axis=1), -1, 1))
        assert (turn / 0.1).max() < 1 / 2.5


def test_boundary_runs_on_without_a_corner_where_the_tie_ends():
    head = mean_head()
    for before, after in (
        (head.upper.curves["bone"], head.upper.curves["inner"]),
        (head.lower.curves["inner"], head.lower.curves["bone"]),
    ):
        assert np.array_equal(before[-1], after[0])
        first, second = before[-1] - before[-2], after[1] - after[0]
        turn = np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second)
        assert abs(np.rad2deg(turn)) < 2.0


def test_free_inner_side_clears_the_teeth_and_the_bone_does_not_reach_into_the_mouth():
    head = mean_head()
    for lip, tooth in ((head.upper, head.upper_tooth), (head.lower, head.lower_tooth)):
        clearance = tooth.project(lip.curves["inner"]).distance
        assert clearance.min() > 0.15
        assert clearance.min() == pytest.approx(MEAN.tooth_clearance_mm, abs=0.12)


def test_package_sees_open_lips():
    gap = mean_head().landmarks["stomion_upper"] - mean_head().landmarks["stomion_lower"]
    assert 10.0 <= gap[1] <= 14.0


def test_jaw_turns_about_the_hinge_and_leaves_the_upper_face_alone():
    shut, wide = closed(MEAN), head_section(dataclasses.replace(MEAN, jaw_opening_deg=12.0))
    assert np.array_equal(shut.upper.curves["skin"], wide.upper.curves["skin"])
    hinge = shut.landmarks["hinge"]
    before = shut.lower.curves["skin"] - hinge
    after = wide.lower.curves["skin"] - hinge
    np.testing.assert_allclose(np.hypot(*before.T), np.hypot(*after.T), rtol=1e-12)
    turned = np.arctan2(after[:, 1], after[:, 0]) - np.arctan2(before[:, 1], before[:, 0])
    np.testing.assert_allclose(np.rad2deg(turned), -12.0)


def test_incisors_derived_from_lips_lie_where_cephalometry_expects_them():
    at = closed(MEAN).landmarks
    assert (at["upper_incisor"] - at["subnasale"])[0] == pytest.approx(-12.1, abs=1.8)
    assert (at["lower_incisor"] - at["subnasale"])[0] == pytest.approx(-15.4, abs=1.9)


def test_every_measurement_has_unit_source_and_description():
    for entry in dataclasses.fields(HeadMeasurements):
        assert entry.metadata["unit"] in ("mm", "deg")
        assert entry.name.endswith("_" + entry.metadata["unit"])
        assert len(entry.metadata["source"]) > 3
        assert len(entry.metadata["description"]) > 5


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"dermis_thickness_mm": 0.0}, "dermis_thickness_mm"),
        ({"jaw_opening_deg": 40.0}, "jaw_opening_deg"),
        ({"upper_lip_length_mm": float("nan")}, "upper_lip_length_mm"),
        ({"ear_nose_mm": 200.0}, "ear_nose_mm"),
        ({"dermis_wrap_mm": 30.0}, "dermis_wrap_mm"),
        ({"jaw_opening_deg": 0.0, "interlabial_gap_mm": -3.0}, "interlabial_gap_mm"),
    ],
)
def test_impossible_heads_are_refused_by_name(wrong, named):
    with pytest.raises(HeadError, match=named):
        head_section(dataclasses.replace(MEAN, **wrong))
