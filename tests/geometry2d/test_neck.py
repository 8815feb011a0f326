import dataclasses
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from geometry2d.neck import A38_NECK, DC_NECK, NECKS, NeckError, NeckMeasurements, neck_section

necks = st.builds(
    lambda base, **factors: dataclasses.replace(
        base, **{name: getattr(base, name) * factor for name, factor in factors.items()}
    ),
    st.sampled_from([A38_NECK, DC_NECK]),
    pitch_mm=st.floats(1.0, 1.5),
    crest_width_mm=st.floats(1.0, 1.3),
    wall_thickness_mm=st.floats(0.95, 1.3),
    rim_radius_mm=st.floats(0.6, 0.9),
    crest_radius_mm=st.floats(0.6, 1.0),
    root_radius_mm=st.floats(0.6, 1.2),
)


@given(necks)
@settings(max_examples=40, deadline=None)
def test_walls_are_sound_and_rounded_everywhere(measurements):
    neck = neck_section(measurements)
    for wall in (neck.upper_wall, neck.lower_wall):
        assert wall.area > 0
        assert wall.smallest_radius == pytest.approx(
            min(
                measurements.root_radius_mm,
                measurements.crest_radius_mm,
                measurements.rim_radius_mm,
                0.3 * measurements.wall_thickness_mm,
            ),
            rel=1e-6,
        )
    upper, lower = (shapely.Polygon(w.sampled(0.1)) for w in (neck.upper_wall, neck.lower_wall))
    assert not upper.intersects(lower)


@given(necks)
@settings(max_examples=30, deadline=None)
def test_measuring_the_walls_gives_the_measurements(measurements):
    m = measurements
    neck = neck_section(m)
    axis = 0.5 * m.mark_distance_mm
    upper, lower = (w.sampled(0.01) for w in (neck.upper_wall, neck.lower_wall))
    rim = -m.mark_depth_mm
    assert 2 * (upper[:, 1].max() - axis) == pytest.approx(m.thread_diameter_mm)
    assert 2 * (axis - lower[:, 1].min()) == pytest.approx(m.thread_diameter_mm)
    for wall in (upper, lower):
        assert wall[:, 0].min() == pytest.approx(rim)
        assert np.ptp(wall[:, 0]) == pytest.approx(m.length_mm)
    plain = neck.upper_wall.point_at([sum(neck.upper_stretches["plain"]) / 2])[0][0]
    assert 2 * (plain[1] - axis) == pytest.approx(m.root_diameter_mm)
    bore = 0.5 * m.root_diameter_mm - m.wall_thickness_mm
    assert upper[:, 1].min() - axis == pytest.approx(bore)


@pytest.mark.parametrize("name", NECKS)
def test_stretches_cover_the_outside_once_and_mean_what_they_say(name):
    m = NECKS[name]
    neck = neck_section(m)
    axis = 0.5 * m.mark_distance_mm
    for wall, stretches in (
        (neck.upper_wall, neck.upper_stretches),
        (neck.lower_wall, neck.lower_stretches),
    ):
        intervals = sorted(stretches.values())
        assert all(a[1] == pytest.approx(b[0]) for a, b in pairwise(intervals))
        crests = [n for n in stretches if n.startswith("crest")]
        roots = [n for n in stretches if n.startswith("root")]
        assert (len(crests), len(roots)) == (m.crests, m.crests - 1)
        for stretch, (start, end) in stretches.items():
            points = wall.point_at(np.linspace(start, end, 101))[0]
            radius = np.abs(points[:, 1] - axis)
            middle = 0.25 * (m.root_diameter_mm + m.thread_diameter_mm)
            if stretch.startswith("crest"):
                assert radius.min() == pytest.approx(middle, abs=1e-6)
                assert radius.max() == pytest.approx(0.5 * m.thread_diameter_mm)
            elif stretch.startswith("root"):
                assert radius.max() == pytest.approx(middle, abs=1e-6)
            elif stretch == "rim":
                assert points[:, 0].min() == pytest.approx(-m.mark_depth_mm)


def test_thread_climbs_half_a_pitch_from_one_side_to_the_other():
    neck = neck_section(A38_NECK)

    def crest_depths(wall, stretches):
        return [
            wall.point_at([sum(stretches[f"crest_{k}"]) / 2])[0][0, 0] + A38_NECK.mark_depth_mm
            for k in (1, 2)
        ]

    upper = crest_depths(neck.upper_wall, neck.upper_stretches)
    lower = crest_depths(neck.lower_wall, neck.lower_stretches)
    assert np.subtract(lower, upper) == pytest.approx(0.5 * A38_NECK.pitch_mm)
    assert np.diff(upper)[0] == pytest.approx(A38_NECK.pitch_mm)


def test_marks_lie_behind_the_thread_on_the_diameter_lower_one_at_the_origin():
    for m in NECKS.values():
        neck = neck_section(m)
        assert neck.lower_mark.tolist() == [0.0, 0.0]
        assert neck.upper_mark.tolist() == [0.0, m.mark_distance_mm]
        for wall, stretches in (
            (neck.upper_wall, neck.upper_stretches),
            (neck.lower_wall, neck.lower_stretches),
        ):
            last = wall.point_at(np.linspace(*stretches[f"crest_{m.crests}"], 50))[0]
            assert last[:, 0].max() < 0.0
        silhouette = shapely.Polygon(neck.silhouette)
        assert silhouette.is_valid
        assert silhouette.exterior.is_ccw
        assert silhouette.contains(shapely.Point(neck.upper_mark))


def test_a38_is_larger_and_has_more_threads_than_dc():
    assert A38_NECK.thread_diameter_mm == pytest.approx(37.2)
    assert DC_NECK.thread_diameter_mm == pytest.approx(26.0)
    assert A38_NECK.crests > DC_NECK.crests


def test_every_measurement_has_a_source():
    for entry in dataclasses.fields(NeckMeasurements):
        assert {"unit", "source", "description"} <= set(entry.metadata)
        assert entry.metadata["source"]


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"pitch_mm": 2.0}, "pitch_mm"),
        ({"rim_radius_mm": 1.0}, "rim_radius_mm"),
        ({"root_diameter_mm": 40.0}, "thread_diameter_mm"),
        ({"wall_thickness_mm": -1.0}, "wall_thickness_mm"),
        ({"mark_distance_mm": 36.0}, "mark_distance_mm"),
        ({"length_mm": 5.0}, "length_mm"),
    ],
)
def test_impossible_necks_are_refused_by_name(wrong, named):
    with pytest.raises(NeckError, match=named):
        neck_section(dataclasses.replace(A38_NECK, **wrong))


@pytest.mark.parametrize("wall", ["upper", "lower"])
@given(necks)
@settings(max_examples=20, deadline=None)
def test_the_edge_of_the_rim_is_where_its_plane_meets_the_outside(wall, measurements):
    m = measurements
    edge = neck_section(m).rim_edge(wall)
    side = 1 if wall == "upper" else -1
    outside = 0.5 * m.mark_distance_mm + side * 0.5 * m.root_diameter_mm
    assert edge == pytest.approx([-m.mark_depth_mm, outside], abs=1e-3)


def test_a_neck_without_a_thread():
    m = dataclasses.replace(A38_NECK, crests=0)
    neck = neck_section(m)
    assert set(neck.lower_stretches) == {"rim", "plain"}
    axis = 0.5 * m.mark_distance_mm
    upper = neck.upper_wall.sampled(0.05)
    assert upper[:, 1].max() - axis == pytest.approx(0.5 * m.root_diameter_mm)
    assert upper[:, 0].min() == pytest.approx(-m.mark_depth_mm)
    low, high = neck.lower_stretches["plain"]
    assert high - low == pytest.approx(m.length_mm, rel=0.1)
