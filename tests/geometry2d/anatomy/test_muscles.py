"""Muscles of the lips: where they lie, how their fibres run, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely

from geometry2d.anatomy.head import HeadError, HeadMeasurements, head_section
from geometry2d.anatomy.muscle_measurements import MuscleMeasurements
from geometry2d.anatomy.muscles import (
    STRAIGHT,
    FibresAroundMouth,
    StraightFibres,
    muscle_regions,
)
from geometry2d.drawings.drawn_head import HeadDrawing

AROUND = ("upper_peripheral", "upper_marginal", "lower_peripheral", "lower_marginal")
ARTISYNTH_MM2 = dict(zip(AROUND, (80.0, 47.0, 130.0, 120.0), strict=True))
"""Areas of whole elements of ArtiSynth's face 3 mm off its midline: more than the muscle has."""
WOMAN = {
    "upper_lip_length_mm": 21.0,
    "upper_lip_thickness_mm": 12.6,
    "lower_lip_length_mm": 46.9,
    "lower_lip_thickness_mm": 13.6,
    "pogonion_thickness_mm": 11.8,
    "menton_thickness_mm": 7.4,
    "upper_lip_projection_mm": 3.7,
    "lower_lip_projection_mm": 1.9,
    "pogonion_projection_mm": -2.6,
    "sulcus_projection_mm": -5.3,
}
HEADS = {
    "a man": HeadMeasurements(),
    "a woman": HeadMeasurements(**WOMAN),
    "jaw closed": HeadMeasurements(jaw_opening_deg=0.0),
    "jaw wide open": HeadMeasurements(jaw_opening_deg=14.0),
    "thick lips": HeadMeasurements(upper_lip_thickness_mm=17.6, lower_lip_thickness_mm=17.5),
    "thin lips": HeadMeasurements(upper_lip_thickness_mm=12.0, lower_lip_thickness_mm=12.7),
}


@pytest.fixture(params=HEADS.values(), ids=HEADS.keys())
def head(request):
    return head_section(request.param)


def test_every_muscle_lies_in_the_deep_layer_of_its_lip(head):
    regions = muscle_regions(head)
    assert set(regions) == {*AROUND, *STRAIGHT}
    for name, region in regions.items():
        polygon = shapely.Polygon(region.polygon)
        deep = shapely.Polygon(getattr(head, region.lip).regions["bulk"])
        assert polygon.is_valid
        assert region.area_mm2 > 10.0
        assert polygon.difference(deep).area < 1e-6 * polygon.area, name


@pytest.mark.parametrize("name", AROUND)
def test_areas_stay_below_those_of_whole_elements_of_a_published_face(name):
    assert 0.15 * ARTISYNTH_MM2[name] < muscle_regions(head_section())[name].area_mm2
    assert muscle_regions(head_section())[name].area_mm2 < ARTISYNTH_MM2[name]


def test_orbicularis_follows_the_lips_when_they_move_and_grow(head):
    regions = muscle_regions(head)
    for lip in ("upper", "lower"):
        margin = head.landmarks[f"stomion_{lip}"]
        marginal, peripheral = (
            shapely.Polygon(regions[f"{lip}_{part}"].polygon) for part in ("marginal", "peripheral")
        )
        assert marginal.distance(shapely.Point(margin)) < 2.5
        skin = shapely.LineString(getattr(head, lip).curves["skin"])
        inner = shapely.LineString(getattr(head, lip).curves["inner"])
        assert marginal.distance(skin) < 2.0
        assert peripheral.distance(inner) < peripheral.distance(skin)


def test_straight_muscles_reach_from_skin_to_bone_along_their_fibres(head):
    for name, region in muscle_regions(head).items():
        if name not in STRAIGHT:
            continue
        polygon = shapely.Polygon(region.polygon)
        section = getattr(head, region.lip)
        for curve in ("interface", "bone"):
            assert polygon.distance(shapely.LineString(section.curves[curve])) < 1e-6
        along = np.array(region.fibres.towards_bone)
        x, y = region.polygon.T
        centred = region.polygon - [x.mean(), y.mean()]
        assert np.ptp(centred @ along) > 2.5 * np.ptp(centred @ [-along[1], along[0]])


def test_levator_lifts_and_depressor_and_mentalis_point_where_anatomy_says():
    towards = {
        name: region.fibres.towards_bone
        for name, region in muscle_regions(head_section()).items()
        if name in STRAIGHT
    }
    assert towards["levator"][1] > 0.8
    assert towards["depressor"][1] < -0.5
    assert towards["mentalis"][1] > 0.5  # from the skin of the chin up to the incisive fossa
    assert all(direction[0] < 0 for direction in towards.values())


def test_a_circle_through_the_corners_has_the_radius_of_the_arch():
    fibres = FibresAroundMouth(23.0, 51.0, -54.0)
    above, at, below = fibres.curvature([[90.0, -37.5], [90.0, -54.0], [90.0, -70.5]])
    assert above == pytest.approx([-1 / 23, -1 / 27.95], rel=1e-3)
    assert at == pytest.approx([-1 / 23, 0.0])
    assert below == pytest.approx([-1 / 23, 1 / 27.95], rel=1e-3)
    radius = 1 / above[1]
    assert radius == pytest.approx(-(0.25 * 51.0**2 + 16.5**2) / (2 * 16.5), rel=1e-12)


def test_fibres_of_both_lips_are_curved_towards_the_opening(head):
    for name, region in muscle_regions(head).items():
        if name in AROUND:
            curvature = region.fibres.curvature(region.polygon)
            assert np.all(curvature[:, 0] < 0)
            assert np.all(curvature[:, 1] * (-1 if region.lip == "upper" else 1) > 0)


def test_the_share_is_one_inside_none_outside_and_adds_up_to_the_area():
    region = muscle_regions(head_section())["mentalis"]
    low, high = region.polygon.min(axis=0) - 1, region.polygon.max(axis=0) + 1
    x, y = (np.arange(a, b, 0.1) for a, b in zip(low, high, strict=True))
    points = np.stack(np.meshgrid(x, y), axis=-1)
    share = region.share(points)
    assert share.shape == points.shape[:2]
    assert share.sum() * 0.1**2 == pytest.approx(region.area_mm2, rel=0.01)
    polygon = shapely.Polygon(region.polygon)
    spots = shapely.points(points)
    deep = shapely.contains(polygon.buffer(-region.edge_mm), spots)
    outside = ~shapely.intersects(polygon.buffer(1.01 * region.edge_mm), spots)
    assert deep.any()
    assert outside.any()
    assert share[deep] == pytest.approx(1.0)
    assert np.all(share[outside] == 0.0)


def test_the_share_changes_without_a_jump_of_its_slope_across_the_edge():
    region = muscle_regions(head_section())["levator"]
    along = np.array(region.fibres.towards_bone)
    across = np.array([-along[1], along[0]])
    # 6 mm on both sides of the middle, in steps of 0.01 mm.
    line = region.polygon.mean(axis=0) + np.linspace(-6, 6, 1201)[:, None] * across
    share = region.share(line)
    slope = np.diff(share) / 0.01
    assert share.max() == pytest.approx(1.0)
    assert np.abs(slope).max() == pytest.approx(1.5 / (2 * region.edge_mm), rel=0.05)
    assert np.abs(np.diff(slope)).max() < 0.1


def test_a_drawn_head_has_the_same_muscles_as_the_measured_one_it_was_drawn_from():
    measured = head_section()
    drawn = HeadDrawing.of(measured).head(dermis_mm=1.0, tie_fade_mm=4.0)
    ours, theirs = muscle_regions(measured), muscle_regions(drawn)
    for name, region in ours.items():
        a, b = shapely.Polygon(region.polygon), shapely.Polygon(theirs[name].polygon)
        assert a.symmetric_difference(b).area < 0.05 * a.area, name


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"upper_peripheral_thickness_mm": 12.0}, "upper_peripheral would reach beyond the upper"),
        ({"lower_marginal_depth_mm": 15.0}, "lower_marginal_depth_mm is 15"),
        ({"lower_peripheral_start_mm": 40.0}, "lower_peripheral_start_mm is 40"),
        ({"upper_peripheral_beyond_fold_mm": 90.0}, "upper_peripheral_beyond_fold_mm is"),
        ({"mentalis_skin_mm": 300.0}, "mentalis_skin_mm is 300"),
        ({"depressor_skin_mm": 1.0, "depressor_bone_mm": 45.0}, "depressor would leave the lower"),
        ({"levator_thickness_mm": -1.0}, "levator_thickness_mm = -1 mm is too small"),
        ({"mouth_width_mm": float("nan")}, "mouth_width_mm = nan mm is not"),
    ],
)
def test_a_muscle_outside_the_tissue_is_refused_with_the_key_named(changed, what):
    with pytest.raises(HeadError, match=what):
        muscle_regions(head_section(), MuscleMeasurements(**changed))


def test_every_measurement_says_its_unit_source_and_meaning():
    for entry in dataclasses.fields(MuscleMeasurements):
        assert entry.metadata["unit"] == "mm"
        assert entry.name.endswith("_mm")
        assert entry.metadata["source"]
        assert entry.metadata["description"]


def test_fibres_in_the_section_have_one_direction_everywhere():
    fibres = StraightFibres((0.6, -0.8))
    np.testing.assert_array_equal(
        fibres.direction(np.zeros((4, 3, 2))), np.broadcast_to([0.6, -0.8], (4, 3, 2))
    )
