"""Heads from drawings and from cuts through surfaces: the measured head, drawn, comes back."""

import contextlib
import dataclasses
import struct
from functools import cache

import ezdxf
import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from geometry2d.anatomy.head import HeadMeasurements, head_section
from geometry2d.drawings.chains import Chain, DrawingError
from geometry2d.drawings.cut_lips import lip_curves
from geometry2d.drawings.drawn_head import OPEN, TEETH, HeadDrawing, drawn_head
from geometry2d.drawings.joined import open_curve, outline_through
from geometry2d.drawings.stl import CutPlane, cut, read_stl
from geometry2d.mesh import LEVELS, section_mesh
from geometry2d.mesh_quality import mesh_quality
from tests.support.marks import slow

LIPS = ("upper", "lower")
SAME_MM = 2e-3
SHEET = np.array([300.0, 40.0])
AWAY = np.array([7.0, -3.0])
measured = cache(head_section)


def distance(here, there):
    return shapely.hausdorff_distance(shapely.LineString(here), shapely.LineString(there))


def assert_same(head, other, *, within=SAME_MM, edges=SAME_MM, offset=SAME_MM):
    for lip in LIPS:
        one, two = getattr(head, lip), getattr(other, lip)
        assert one.loops == two.loops
        assert one.boundary_curves == two.boundary_curves
        for name, curve in one.curves.items():
            near = within if name in ("skin", "inner", "bone") else offset
            assert distance(curve, two.curves[name]) < near, name
            np.testing.assert_allclose(curve[[0, -1]], two.curves[name][[0, -1]], atol=near)
        for name, region in one.regions.items():
            around = shapely.Polygon(region).length
            areas = [shapely.Polygon(part.regions[name]).area for part in (one, two)]
            assert abs(areas[0] - areas[1]) < within * around
        tooth, drawn = (getattr(which, f"{lip}_tooth") for which in (head, other))
        assert np.abs(drawn.project(tooth.sampled(0.2)).distance).max() < within
        assert distance(one.focus, two.focus) < edges
    np.testing.assert_allclose(head.landmarks["nose"], other.landmarks["nose"], atol=within)
    for name in ("stomion_upper", "stomion_lower"):
        assert np.hypot(*(head.landmarks[name] - other.landmarks[name])) < edges


def without(drawing, *names):
    kept = {name: curve for name, curve in drawing.curves.items() if name not in names}
    return dataclasses.replace(drawing, curves=kept)


def svg_file(tmp_path, drawing):
    file = tmp_path / "head.svg"
    file.write_text(drawing.svg())
    return file


def dxf_file(tmp_path, drawing):
    document = ezdxf.new()
    document.header["$INSUNITS"] = 4
    space = document.modelspace()
    for name, curve in drawing.curves.items():
        space.add_lwpolyline(curve + SHEET, dxfattribs={"layer": name})
    for name, tooth in drawing.teeth.items():
        chord = np.roll(tooth.start, -1, axis=0) - tooth.start
        bulge = np.tan(0.5 * np.arcsin(0.5 * np.hypot(*chord.T) * tooth.curvature))
        points = np.column_stack([tooth.start + SHEET, bulge])
        space.add_lwpolyline(points, format="xyb", close=True, dxfattribs={"layer": name})
    for name, point in drawing.marks.items():
        space.add_circle(point + SHEET, 1.0, dxfattribs={"layer": name})
    document.saveas(tmp_path / "head.dxf")
    return tmp_path / "head.dxf"


@pytest.mark.parametrize("written", [svg_file, dxf_file])
@pytest.mark.parametrize("interface", [slow(True), False])
def test_the_measured_head_drawn_comes_back(tmp_path, written, interface):
    drawing = HeadDrawing.of(measured())
    if not interface:
        drawing = without(drawing, "upper_interface", "lower_interface")
    again = drawn_head(written(tmp_path, drawing), dermis_mm=1.0, tie_fade_mm=4.0)
    assert_same(measured(), again)
    assert distance(measured().profile, again.profile) < SAME_MM
    assert len(again.upper.focus) == len(measured().upper.focus)
    assert again.tie_fade_mm == 4.0


@pytest.mark.slow
def test_a_drawn_interface_lets_the_dermis_vary(tmp_path):
    head = head_section(HeadMeasurements(philtrum_dermis_mm=1.6, chin_dermis_mm=1.2))
    assert_same(
        head, drawn_head(svg_file(tmp_path, HeadDrawing.of(head)), dermis_mm=9.9, tie_fade_mm=4.0)
    )


def test_a_thicker_dermis_is_a_thicker_offset(tmp_path):
    drawing = without(HeadDrawing.of(measured()), "upper_interface", "lower_interface")
    head = drawn_head(svg_file(tmp_path, drawing), dermis_mm=1.5, tie_fade_mm=4.0)
    for lip in LIPS:
        curves = getattr(head, lip).curves
        away = shapely.distance(
            shapely.points(curves["skin"][5:-5]), shapely.LineString(curves["interface"])
        )
        np.testing.assert_allclose(away, 1.5, atol=0.01)


def test_what_is_drawn_has_neither_direction_nor_place():
    drawing = HeadDrawing.of(measured())
    moved = HeadDrawing(
        {name: curve[::-1] + AWAY for name, curve in drawing.curves.items()},
        {name: tooth.moved(0.0, AWAY) for name, tooth in drawing.teeth.items()},
        {name: mark + AWAY for name, mark in drawing.marks.items()},
    )
    assert_same(measured(), moved.head(dermis_mm=1.0, tie_fade_mm=4.0), within=1e-9, offset=1e-9)


BY_HAND = {
    "upper_skin": "M 90 47 C 92 50 96 50 98 49 C 103 48 104 42 102 36 C 100 28 106 24 112 18",
    "upper_inner": "M 88 37 C 88 41 88 44 90 47",
    "upper_bone": "M 100 14 C 92 20 88 28 88 37",
    "lower_skin": "M 86 62 C 88 58 98 58 98 64 C 98 69 93 73 91 78 C 89.4 82 93 90 92 98",
    "lower_inner": "M 83 72 C 83 68 84 65 86 62",
    "lower_bone": "M 83 72 L 80 98",
    "upper_tooth": "M 87 30 C 87.5 40 88 44 88 52 L 85 52 L 80 30 Z",
    "lower_tooth": "M 79 55 L 82 56 L 82.5 72 L 82 80 L 76 80 Z",
}
"""Two plain lips of lines and Bézier curves, as a drawing program writes them."""


def by_hand():
    content = "".join(f'<path id="{name}" d="{data}"/>' for name, data in BY_HAND.items())
    content += '<circle id="ear_mark" r="1"/><circle id="nose_mark" cx="104" cy="13" r="2"/>'
    return f'<svg width="120mm" height="120mm" viewBox="0 0 120 120">{content}</svg>'


def test_a_head_drawn_by_hand_can_be_meshed(tmp_path):
    file = tmp_path / "head.svg"
    file.write_text(by_hand())
    head = drawn_head(file, dermis_mm=1.0, tie_fade_mm=4.0)
    mesh = section_mesh([head.upper, head.lower], LEVELS["coarse"])
    assert mesh_quality(mesh).smallest_angle_deg > 15.0
    np.testing.assert_allclose(head.landmarks["nose"], [104, -13], atol=1e-9)
    assert head.landmarks["stomion_upper"][1] > head.landmarks["stomion_lower"][1]


@pytest.mark.slow
@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.integers(0, len(by_hand())), st.binary(max_size=4))
def test_any_damage_to_a_drawing_is_our_error(tmp_path, place, damage):
    content = by_hand().encode()
    file = tmp_path / "head.svg"
    file.write_bytes(content[:place] + damage + content[place + len(damage) :])
    with contextlib.suppress(DrawingError):
        drawn_head(file, dermis_mm=1.0, tie_fade_mm=4.0)


@pytest.mark.parametrize("name", [*OPEN, *TEETH, "ear_mark", "nose_mark"])
def test_what_is_missing_is_named(tmp_path, name):
    file = svg_file(tmp_path, HeadDrawing.of(measured()))
    file.write_text(file.read_text().replace(f'id="{name}"', 'id="other"'))
    with pytest.raises(DrawingError, match=rf"head.svg has nothing named {name} "):
        drawn_head(file, dermis_mm=1.0, tie_fade_mm=4.0)


def changed(**curves):
    drawing = HeadDrawing.of(measured())
    return dataclasses.replace(
        drawing,
        curves={
            name: curves[name](curve) if name in curves else curve
            for name, curve in drawing.curves.items()
        },
    )


def bulging(curve):
    """A curve whose middle reaches 25 mm forward, its ends kept."""
    bump = np.sin(np.linspace(0.0, np.pi, len(curve))) ** 2
    return curve + np.column_stack([25.0 * bump, 0.0 * bump])


@pytest.mark.parametrize(
    ("drawing", "message"),
    [
        (
            lambda: changed(upper_inner=lambda c: c + np.array([0.5, 0.0])),
            "upper_inner does not begin where upper_skin ends: 0.5 mm",
        ),
        (
            lambda: changed(lower_bone=lambda c: c - np.array([0.0, 0.2])),
            "lower_bone does not begin where lower_inner ends: 0.2 mm",
        ),
        (lambda: changed(upper_skin=lambda c: np.concatenate([c, c[:1]])), "loose ends"),
        (
            lambda: without(changed(), "upper_interface", "lower_interface"),
            "crosses itself.*4 mm thick: draw upper_skin rounder",
        ),
        (
            lambda: dataclasses.replace(
                changed(), marks={**changed().marks, "nose_mark": np.array([-90.0, 0.0])}
            ),
            "mirror the drawing",
        ),
        (
            lambda: changed(
                **{
                    f"lower_{c}": lambda p: p + np.array([0.0, 16.0])
                    for c in ("skin", "inner", "bone", "interface")
                }
            ),
            "lips overlap",
        ),
        (
            lambda: changed(upper_bone=bulging),
            "bulk.*stay behind the skin",
        ),
        (
            lambda: dataclasses.replace(
                changed(),
                teeth={
                    name: tooth.moved(0.0, [1.5, 0.0]) for name, tooth in changed().teeth.items()
                },
            ),
            r"upper_inner lies up to .* mm inside upper_tooth",
        ),
    ],
)
def test_what_is_wrong_with_a_drawn_head_is_said(tmp_path, drawing, message):
    with pytest.raises(DrawingError, match=message):
        drawn_head(svg_file(tmp_path, drawing()), dermis_mm=4.0, tie_fade_mm=4.0)


def test_a_head_that_looks_left_is_refused():
    drawing = HeadDrawing.of(measured())
    mirrored = dataclasses.replace(
        drawing, curves={name: curve * [-1.0, 1.0] for name, curve in drawing.curves.items()}
    )
    with pytest.raises(DrawingError, match="drawn inside out"):
        mirrored.head(dermis_mm=1.0, tie_fade_mm=4.0)


def test_open_curves_are_put_together_and_closed_ones_refused():
    arc = Chain.about("c", (0.0, 0.0), (1.0, 0.0), np.pi / 2)
    line = Chain.through("c", [[-2.0, 1.0], [0.0, 1.0]])
    points = open_curve("c", [line, arc]).sampled(0.01)
    ends = points[[0, -1]]
    assert sorted(map(tuple, np.round(ends, 9).tolist())) == [(-2.0, 1.0), (1.0, 0.0)]
    on_arc = points[points[:, 0] > 1e-9]
    np.testing.assert_allclose(np.hypot(*on_arc.T), 1.0, atol=1e-12)
    assert np.hypot(*np.diff(points, axis=0).T).max() < 0.0101
    for parts, message in (
        ([Chain.about("c", (0.0, 0.0), (1.0, 0.0), 2 * np.pi)], "0 loose ends"),
        ([line, line.mapped([[1, 0, 0], [0, 1, 5]])], "4 loose ends"),
        ([line, arc, Chain.through("c", [[0.0, 1.0], [0.0, 3.0]])], "branches"),
        ([line, Chain.about("c", (9.0, 0.0), (8.0, 0.0), 2 * np.pi)], "closed curve beside"),
    ):
        with pytest.raises(DrawingError, match=message):
            open_curve("c", parts)


# --- cuts through surfaces ---


def extruded(ring, half_width):
    """Triangles of a closed prism (m, 3, 3) over a counter-clockwise polygon (n, 2)."""
    caps = shapely.constrained_delaunay_triangles(shapely.Polygon(ring))
    flat = np.array([shapely.get_coordinates(t.exterior.normalize())[:3] for t in caps.geoms])
    u, v = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    turned = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] < 0
    flat[turned] = flat[turned][:, ::-1]
    level = np.full((*flat.shape[:2], 1), half_width)
    top = np.concatenate([flat, level], axis=2)
    bottom = np.concatenate([flat, -level], axis=2)[:, ::-1]
    nxt = np.roll(ring, -1, axis=0)
    a, b, c, d = (
        np.column_stack([points, np.full(len(ring), side * half_width)])
        for points, side in ((ring, -1), (nxt, -1), (nxt, 1), (ring, 1))
    )
    return np.concatenate([top, bottom, np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def stl_file(folder, name, triangles):
    record = np.zeros(len(triangles), [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    record["v"] = triangles
    (folder / name).write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + record.tobytes())
    return folder / name


@pytest.mark.slow
def test_a_head_is_cut_out_of_surfaces(tmp_path):
    """The head extruded to the left and right, its surfaces cut and the pieces named again."""
    head = measured()
    midsagittal = CutPlane(point=(0, 0, 0.3), right=(1, 0, 0), up=(0, 1, 0))
    curves, teeth = {}, {}
    for lip in LIPS:
        section, tooth = getattr(head, lip), getattr(head, f"{lip}_tooth")
        tissue = shapely.union_all(
            [shapely.Polygon(p) for p in section.regions.values()], grid_size=1e-7
        )
        ring = shapely.get_coordinates(shapely.orient_polygons(tissue))[:-1]
        solids = {"tissue": ring, "tooth": tooth.sampled(0.05)}
        loops = {}
        for name, solid in solids.items():
            file = stl_file(tmp_path, f"{lip}_{name}.stl", extruded(solid, 20.0))
            ((loops[name], hole),) = cut(read_stl(file, unit_mm=1.0), midsagittal)
            assert not hole
        skin, bone = section.curves["skin"], section.curves["bone"]
        upper = lip == "upper"
        curves |= lip_curves(
            lip,
            loops["tissue"],
            skin_end=skin[-1 if upper else 0],
            dermis_end=skin[0 if upper else -1],
            bone_start=bone[-1 if upper else 0],
            bone_end=bone[0 if upper else -1],
        )
        teeth[f"{lip}_tooth"] = loops["tooth"]
    marks = {f"{name}_mark": tuple(head.landmarks[name]) for name in ("ear", "nose")}
    drawing = HeadDrawing(curves, teeth, marks)
    # Without marks the edges of the lips are their lowest and highest points; the dermis ends at
    # right angles to a facet, not to a curve.
    loose = {"edges": 2.5, "offset": 0.01}
    assert_same(head, drawing.head(dermis_mm=1.0, tie_fade_mm=4.0), **loose)
    file = tmp_path / "head.svg"
    file.write_text(drawing.svg())
    assert_same(head, drawn_head(file, dermis_mm=1.0, tie_fade_mm=4.0), **loose)


def test_points_of_a_cut_must_follow_one_another():
    head = measured()
    ring = np.concatenate([head.upper.curves[name][:-1] for name in ("bone", "inner", "skin")])
    loop = outline_through(ring, "upper lip")
    with pytest.raises(DrawingError, match="give them in the order skin_end"):
        lip_curves(
            "upper",
            loop,
            skin_end=ring[-1],
            dermis_end=ring[3],
            bone_start=ring[500],
            bone_end=ring[200],
        )
