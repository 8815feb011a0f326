import dataclasses
from functools import cache

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry2d.anatomy.head import HeadError, HeadMeasurements, head_section
from geometry2d.curves import left_normals

MEAN = HeadMeasurements()
# Where the literature names no standard deviation, a spread that people surely have.
SPREAD = {
    entry.name: entry.metadata["spread"]
    for entry in dataclasses.fields(HeadMeasurements)
    if entry.metadata["spread"] is not None and entry.default is not None
} | {
    "hinge_incisor_mm": 3.0,
    "nose_tip_height_mm": 1.5,
    "nasion_height_mm": 3.0,
    "upper_vermilion_mm": 0.7,
    "lower_vermilion_mm": 0.7,
    "mentolabial_angle_deg": 8.0,
    "dermis_thickness_mm": 0.25,
    "vermilion_thickness_mm": 0.25,
    "upper_crown_mm": 0.5,
    "lower_crown_mm": 0.5,
    "jaw_opening_deg": 3.0,
}
DERMIS_PLACES = {
    "nose_dermis_mm": ("upper", "pronasale"),
    "philtrum_dermis_mm": ("upper", "a_point"),
    "fold_dermis_mm": ("lower", "sulcus"),
    "chin_dermis_mm": ("lower", "pogonion"),
    "submental_dermis_mm": ("lower", "menton"),
}


def person(**by):
    return dataclasses.replace(
        MEAN, **{name: getattr(MEAN, name) + SPREAD[name] * k for name, k in by.items()}
    )


# Everything at once within 1.3 standard deviations, or any three measurements within two.
heads = st.one_of(
    st.builds(person, **{name: st.floats(-1.3, 1.3) for name in SPREAD}),
    st.dictionaries(st.sampled_from(sorted(SPREAD)), st.floats(-2.0, 2.0), max_size=3).map(
        lambda by: person(**by)
    ),
)

mean_head = cache(head_section)


def closed(measurements):
    return head_section(dataclasses.replace(measurements, jaw_opening_deg=0.0))


@given(heads)
@settings(max_examples=20, deadline=None)
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
@settings(max_examples=20, deadline=None)
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


def direction_deg(vector):
    return float(np.rad2deg(np.arctan2(vector[1], vector[0])))


def nearest_index(curve, point):
    return int(np.argmin(np.hypot(*(curve - point).T)))


@given(heads)
@settings(max_examples=20, deadline=None)
def test_nasolabial_angle_measured_on_the_skin(measurements):
    """Between the lip's foremost point, subnasale, and the middle of the columella."""
    head = closed(measurements)
    skin, subnasale = head.upper.curves["skin"], head.landmarks["subnasale"]
    nose = skin[nearest_index(skin, subnasale) :]
    reach = np.hypot(*(nose - subnasale).T)
    columella = nose[np.argmax(reach > 0.5 * measurements.nose_projection_mm)]
    lip = skin[: nearest_index(skin, subnasale)]
    lip = lip[lip[:, 1] < 0.5 * (subnasale[1] + head.landmarks["upper_lip"][1])]
    foremost = lip[np.argmax(lip[:, 0])]
    angle = direction_deg(columella - subnasale) - direction_deg(foremost - subnasale)
    assert angle == pytest.approx(measurements.nasolabial_angle_deg, abs=1.5)


@given(heads)
@settings(max_examples=20, deadline=None)
def test_mentolabial_angle_measured_on_the_skin(measurements):
    """Between the tangents of the lip, where its red part ends, and of the chin's steepest part."""
    head = closed(measurements)
    skin = head.lower.curves["skin"]
    border, fold, chin = (
        nearest_index(skin, head.landmarks[name])
        for name in ("labrale_inferius", "sulcus", "pogonion")
    )
    lip = direction_deg(skin[border + 5] - skin[border - 5])
    step = np.diff(skin[chin:fold], axis=0)
    angle = 180.0 - (np.rad2deg(np.arctan2(step[:, 1], step[:, 0])).max() - lip)
    assert angle == pytest.approx(measurements.mentolabial_angle_deg, abs=1.5)


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


def test_dermis_may_be_measured_in_five_places():
    thickness = dict(zip(DERMIS_PLACES, (1.25, 1.5, 1.3, 1.19, 1.02), strict=True))
    head = head_section(dataclasses.replace(MEAN, **thickness))
    for name, (lip, place) in DERMIS_PLACES.items():
        curves = getattr(head, lip).curves
        point = curves["skin"][nearest_index(curves["skin"], head.landmarks[place])]
        inside = shapely.LineString(curves["interface"])
        assert inside.distance(shapely.Point(point)) == pytest.approx(thickness[name], abs=0.01)
    for lip, margin in ((head.upper, "stomion_upper"), (head.lower, "stomion_lower")):
        inside = shapely.LineString(lip.curves["interface"])
        distance = inside.distance(shapely.Point(head.landmarks[margin]))
        assert distance == pytest.approx(MEAN.vermilion_thickness_mm, abs=0.02)


def test_dermis_between_two_places_lies_between_their_thicknesses():
    head = head_section(dataclasses.replace(MEAN, fold_dermis_mm=1.4, chin_dermis_mm=1.1))
    skin = head.lower.curves["skin"]
    chin, fold = (nearest_index(skin, head.landmarks[name]) for name in ("pogonion", "sulcus"))
    inside = shapely.LineString(head.lower.curves["interface"])
    thickness = shapely.distance(shapely.points(skin[chin:fold]), inside)
    assert np.all(np.diff(thickness) > -1e-3)
    assert thickness[0] == pytest.approx(1.1, abs=0.01)
    assert thickness[-1] == pytest.approx(1.4, abs=0.01)


def test_dermis_measured_nowhere_is_the_same_everywhere():
    places = dict.fromkeys(DERMIS_PLACES, MEAN.dermis_thickness_mm)
    named, plain = head_section(dataclasses.replace(MEAN, **places)), mean_head()
    for lip in ("upper", "lower"):
        for name, curve in getattr(plain, lip).curves.items():
            assert np.array_equal(curve, getattr(named, lip).curves[name])


def test_teeth_bite_without_touching():
    head = closed(MEAN)
    upper, lower = (
        shapely.Polygon(tooth.sampled(0.05)) for tooth in (head.upper_tooth, head.lower_tooth)
    )
    assert not upper.intersects(lower)


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
        ({"chin_dermis_mm": -1.0}, "chin_dermis_mm"),
        ({"nose_dermis_mm": float("inf")}, "nose_dermis_mm"),
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
