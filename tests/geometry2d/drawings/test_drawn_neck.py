"""Outlines from files: exact where the file is exact, and an error wherever something is wrong."""

import contextlib
import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from geometry2d.drawings.chains import DrawingError
from geometry2d.drawings.drawing_file import drawn_outlines
from geometry2d.drawings.drawn_neck import drawn_neck
from geometry2d.drawings.stl import CutPlane, Surface3D, cut, read_stl
from geometry2d.neck import A38_NECK, neck_section
from tests.support.optional import needed_module

FRONT = CutPlane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
TOP = CutPlane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
FUZZ = settings(max_examples=150, deadline=None,
                suppress_health_check=[HealthCheck.function_scoped_fixture])  # fmt: skip


def svg(tmp_path, content, attributes='width="100mm" height="50mm" viewBox="0 0 100 50"'):
    file = tmp_path / "drawing.svg"
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {attributes}>{content}</svg>')
    return file


def path(tmp_path, data, **keys):
    ((name, outline),) = drawn_outlines(svg(tmp_path, f'<path id="p" d="{data}"/>'), **keys)
    assert name == "p"
    return outline


# --- SVG ---


@pytest.mark.parametrize(
    "data",
    [
        "M 10 10 L 30 10 L 30 20 L 10 20 Z",
        "m10,10 20,0 0,10 -20,0 z",
        "M10 10H30V20H10V10",
        "m 10 10 h 20 v 10 h -20 z",
        "M1e1 1.e1 3e+1,10 30-.2E1 30 20 10 20 Z",  # a spike up and back would cross: see below
    ],
)
def test_a_rectangle_in_all_its_spellings(tmp_path, data):
    if "-.2" in data:
        with pytest.raises(DrawingError, match="crosses or touches"):
            path(tmp_path, data)
        return
    outline = path(tmp_path, data)
    assert outline.area == pytest.approx(200)
    assert outline.box == pytest.approx((10, -20, 30, -10))  # y up, whatever way it was drawn


@pytest.mark.parametrize("data", ["M 30 20 A 10 10 0 0 1 10 20 A 10 10 0 0 1 30 20 Z",
                                  "M30 20a10 10 0 01-20 0 10 10 0 1 120 0z",
                                  "M 30 20 A 10 10 77 1 0 20 30 A 10 10 0 0 0 30 20"])  # fmt: skip
def test_arcs_stay_arcs(tmp_path, data):
    outline = path(tmp_path, data)
    assert outline.smallest_radius == pytest.approx(10, rel=1e-12)
    assert outline.area == pytest.approx(100 * np.pi, rel=1e-9)
    assert outline.project([[20.0, -20.0]]).distance == pytest.approx([-10], abs=1e-9)


def test_bezier_curves_come_out_smooth_and_near(tmp_path):
    k = 20 * 4 / 3 * np.tan(np.pi / 8)
    control = np.array([(60, 25), (60, 25 + k), (40 + k, 45), (40, 45)]) - (40, 25)
    data = (
        f"M 60 25 C 60 {25 + k} {40 + k} 45 40 45 S 20 {25 + k} 20 25 "
        f"S {40 - k} 5 40 5 S 60 {25 - k} 60 25 Z"
    )
    outline = path(tmp_path, data)
    assert outline.smallest_radius > 19  # no corner anywhere
    t = np.linspace(0, 1, 200)[:, None]
    a, b, c, d = control
    curve = (1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t**2 * (1 - t) * c + t**3 * d
    assert np.abs(outline.project(curve * (1, -1) + (40, -25)).distance).max() < 3e-3


def test_quadratic_curves_and_their_reflections(tmp_path):
    outline = path(tmp_path, "M 10 20 Q 20 0 30 20 T 50 20 L 50 40 H 10 Z")
    # The first arch rises, the second sinks by as much: the areas cancel.
    assert outline.area == pytest.approx(40 * 20, abs=0.1)
    assert np.abs(outline.project([[20, -10], [40, -30]]).distance).max() < 3e-3


def test_ellipses_whether_drawn_or_made_by_a_transform(tmp_path):
    drawn = '<ellipse id="a" cx="40" cy="25" rx="20" ry="10"/>'
    made = '<g transform="translate(40 25)"><circle id="b" r="10" transform="scale(2,1)"/></g>'
    arcs = '<path id="c" d="M 20 25 A 20 10 0 0 1 60 25 A 20 10 0 0 1 20 25"/>'
    angle = np.linspace(0, 2 * np.pi, 100)
    true = np.column_stack([40 + 20 * np.cos(angle), -25 + 10 * np.sin(angle)])
    for _, outline in drawn_outlines(svg(tmp_path, drawn + made + arcs)):
        assert np.abs(outline.project(true).distance).max() < 3e-3
        assert outline.area == pytest.approx(200 * np.pi, rel=1e-4)
        assert outline.smallest_radius == pytest.approx(5, rel=0.02)


def test_transforms_and_view_boxes_give_millimetres(tmp_path):
    shape = '<g transform="rotate(90 10 10) matrix(1 0 0 1 0 0)"><rect x="10" y="10" width="4" ' \
            'height="2"/></g>'  # fmt: skip
    half = 'width="5cm" height="25mm" viewBox="0 0 100 50"'
    ((_, outline),) = drawn_outlines(svg(tmp_path, shape, half))
    assert outline.box == pytest.approx((4, -7, 5, -5))
    ((_, inch),) = drawn_outlines(svg(tmp_path, '<circle r="96"/>', 'width="2in" height="2in"'))
    assert inch.smallest_radius == pytest.approx(25.4)


@pytest.mark.parametrize(
    ("attributes", "unit_mm", "message"),
    [
        ('viewBox="0 0 10 10"', None, "no physical size"),
        ('width="100px" height="50px" viewBox="0 0 100 50"', None, "no physical size"),
        ('width="100mm" height="70mm" viewBox="0 0 100 50"', None, "proportions"),
        ('width="100mm" height="50mm" viewBox="0 0 100 50"', 2.0, "says that a user unit is 1"),
        ('width="100mm" viewBox="0 0 0 0"', None, "viewBox"),
    ],
)
def test_units_are_never_guessed(tmp_path, attributes, unit_mm, message):
    with pytest.raises(DrawingError, match=message):
        drawn_outlines(svg(tmp_path, '<circle r="3"/>', attributes), unit_mm=unit_mm)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('<path id="gap" d="M 0 0 H 20 V 10 H 0.5"/>', r"'gap' is open.*10\.01 mm"),
        ('<path id="eight" d="M 0 0 L 10 10 H 0 L 10 0 Z"/>', r"'eight'.*crosses.*\[5 -5\]"),
        ('<path id="p" d="M 0 0 H x 20 V 10 Z"/>', "H has 0 numbers"),
        ('<path id="p" d="M 0 0 L 20 Z"/>', "1 numbers, not 2"),
        ('<path id="p" d="L 20 3 Z"/>', "command should be"),
        ('<path id="p" d="M 0 0 A 1 1 0 0 1 20 0 Z"/>', "cannot reach"),
        ('<path id="p" d="M 0 0 H 20 Z"/>', "encloses nothing|crosses"),
        ('<rect id="r" width="5" height="5" rx="1"/>', "rounded rectangle"),
        ('<use href="#r"/>', "replace it by plain paths"),
        ('<circle id="c" r="3" transform="bend(3)"/>', "bend"),
        ('<circle id="c" r="3" transform="scale(0)"/>', "flattened"),
        ('<circle id="c" r="3e5"/>', "reaches farther"),
        ("<path", "not valid XML"),
    ],
)
def test_what_is_wrong_in_a_drawing_is_said(tmp_path, content, message):
    with pytest.raises(DrawingError, match=message):
        drawn_outlines(svg(tmp_path, content))


def test_xml_entities_are_refused(tmp_path):
    file = tmp_path / "bomb.svg"
    file.write_text(
        '<!DOCTYPE svg [<!ENTITY a SYSTEM "file:///etc/hostname">]>'
        '<svg width="1mm" height="1mm" viewBox="0 0 1 1"><text>&a;</text></svg>'
    )
    with pytest.raises(DrawingError, match="entity 'a'"):
        drawn_outlines(file)


def test_what_is_not_drawn_is_not_read(tmp_path):
    hidden = '<defs><path d="M 0 0 H 3"/></defs><g style="display: none"><path d="M 0 0 H 3"/></g>'
    assert len(drawn_outlines(svg(tmp_path, hidden + '<circle r="2"/>'))) == 1


@FUZZ
@given(st.text("MLHVCSQTAZmlhvcsqtaz0123456789.-+eE, ", max_size=60))
def test_any_path_data_give_outlines_or_our_error(tmp_path, data):
    with contextlib.suppress(DrawingError):
        drawn_outlines(svg(tmp_path, f'<path d="M 1 2 {data}"/>'))


@settings(FUZZ, max_examples=40)
@given(
    st.lists(
        st.tuples(
            st.sampled_from("LHVCSQTAlhvcsqta"),
            st.lists(st.floats(-50, 50, width=16), min_size=7, max_size=7),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_any_wellformed_path_gives_outlines_or_our_error(tmp_path, steps):
    each = {"L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7}
    data = "M 0 0"
    for letter, n in steps:
        values = [str(v) for v in n[: each[letter.upper()]]]
        if letter in "Aa":
            values[3:5] = [str(int(n[3] > 0)), str(int(n[4] > 0))]
        data += f" {letter} {' '.join(values)}"
    with contextlib.suppress(DrawingError):
        for _, outline in drawn_outlines(svg(tmp_path, f'<path d="{data} Z"/>')):
            assert outline.area > 0


@FUZZ
@given(st.integers(0, 400), st.binary(max_size=5))
def test_any_damage_to_an_svg_file_is_our_error(tmp_path, place, damage):
    file = svg(tmp_path, '<g transform="rotate(30)"><ellipse rx="3" ry="2"/></g>')
    content = file.read_bytes()
    file.write_bytes(content[:place] + damage + content[place + len(damage) :])
    with contextlib.suppress(DrawingError):
        drawn_outlines(file)


# --- DXF ---

needs_ezdxf = pytest.mark.usefixtures("ezdxf")


@pytest.fixture(scope="module")
def ezdxf():
    return needed_module("ezdxf")


def dxf(tmp_path, draw, units=4, version="R2010"):
    import ezdxf

    document = ezdxf.new(version)
    document.header["$INSUNITS"] = units
    draw(document.modelspace())
    file = tmp_path / "drawing.dxf"
    document.saveas(file)
    return file


def drop(space):
    """A half circle and two lines, drawn in pieces and in both directions."""
    space.add_arc((0, 0), 5, 0, 180, dxfattribs={"layer": "drop"})
    space.add_line((-5, 0), (0, -9), dxfattribs={"layer": "drop"})
    space.add_line((5, 0), (0.0002, -9.0003), dxfattribs={"layer": "drop"})


@needs_ezdxf
@pytest.mark.parametrize(("units", "mm"), [(4, 1.0), (5, 10.0), (1, 25.4)])
def test_pieces_of_a_layer_are_put_together(tmp_path, units, mm):
    def draw(space):
        drop(space)
        space.add_text("not an outline", dxfattribs={"layer": "drop"})

    if units != 4:  # what rounding may leave is a length in mm, whatever the unit of the drawing
        with pytest.raises(DrawingError, match="is open"):
            drawn_outlines(dxf(tmp_path, draw, units=units))
        return
    ((name, outline),) = drawn_outlines(dxf(tmp_path, draw, units=units))
    assert name == "drop"
    assert outline.area == pytest.approx((12.5 * np.pi + 45) * mm**2, rel=1e-4)


@needs_ezdxf
def test_polylines_with_bulges_circles_splines_and_mirrored_blocks(tmp_path):
    def draw(space):
        corners = [(0, 0, 0), (10, 0, 1), (10, 4, 0), (0, 4, 1)]  # a stadium
        space.add_lwpolyline(corners, "xyb", close=True, dxfattribs={"layer": "flat"})
        space.add_polyline2d(corners, "xyb", close=True, dxfattribs={"layer": "old"})
        space.add_circle((3, 3), 2, dxfattribs={"layer": "round"})
        space.add_ellipse((0, 0), (8, 0), 0.5, dxfattribs={"layer": "oval"})
        block = space.doc.blocks.new("part")
        block.add_lwpolyline(corners, "xyb", close=True, dxfattribs={"layer": "mirrored"})
        space.add_blockref("part", (0, 0), {"xscale": -1})

    found = dict(drawn_outlines(dxf(tmp_path, draw)))
    for name, side in (("flat", 1), ("old", 1), ("mirrored", -1)):
        assert found[name].area == pytest.approx(40 + 4 * np.pi, rel=1e-9)
        assert found[name].smallest_radius == pytest.approx(2)
        assert found[name].contains([[11.9 * side, 2], [-1.9 * side, 2]]).all()
    assert found["round"].project([[3, 3]]).distance == pytest.approx([-2])
    assert found["oval"].area == pytest.approx(32 * np.pi, rel=1e-3)
    assert found["oval"].smallest_radius > 1.9


@needs_ezdxf
def test_what_is_wrong_in_a_dxf_file_is_said(tmp_path):
    def branch(space):
        drop(space)
        space.add_line((5, 0), (9, 9), dxfattribs={"layer": "drop"})

    def gap(space):
        space.add_lwpolyline([(0, 0), (10, 0), (10, 5), (0.3, 0.4)])

    def high(space):
        space.add_line((0, 0, 1), (1, 0, 1))

    for draw, message in (
        (branch, r"branches at \(5, 0\)"),
        (gap, r"is open: its end at \(0, 0\) mm is 0\.5 mm from the next, at \(0\.3, 0\.4\)"),
        (high, "height 1"),
        (lambda space: space.add_3dface([(0, 0), (1, 0), (0, 1)]), "cannot be followed"),
    ):
        with pytest.raises(DrawingError, match=message):
            drawn_outlines(dxf(tmp_path, draw))
    with pytest.raises(DrawingError, match="no unit"):
        drawn_outlines(dxf(tmp_path, drop, units=0))
    assert len(drawn_outlines(dxf(tmp_path, drop, units=0), unit_mm=1.0)) == 1


@needs_ezdxf
@settings(FUZZ, max_examples=40)
@given(place=st.floats(0, 1), damage=st.binary(min_size=1, max_size=8))
def test_any_damage_to_a_dxf_file_is_our_error(tmp_path, place, damage):
    file = tmp_path / "damaged.dxf"
    whole = tmp_path / "drawing.dxf"
    if not whole.exists():
        dxf(tmp_path, drop, version="R12")
    content = whole.read_bytes()
    at = int(place * len(content))
    file.write_bytes(content[:at] + damage + content[at + len(damage) :])
    try:
        drawn_outlines(file)
    except DrawingError as error:
        assert str(error).encode("utf-8")


# --- STL ---


def grid_surface(points, wrap_rows):
    """Triangles of a closed grid (r, c, 3) of points whose columns, and rows if asked, wrap."""
    below = np.roll(points, -1, axis=0) if wrap_rows else points[1:]
    here = points if wrap_rows else points[:-1]
    a, b = here, np.roll(here, -1, axis=1)
    c, d = np.roll(below, -1, axis=1), below
    return np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(
        -1, 3, 3
    )


def torus(major=10.0, minor=3.0, around=96, across=48):
    u = 2 * np.pi * np.arange(around)[None, :] / around
    v = 2 * np.pi * np.arange(across)[:, None] / across
    r = major + minor * np.cos(v)
    points = np.stack([r * np.cos(u), r * np.sin(u), minor * np.sin(v) + 0 * u], axis=-1)
    return grid_surface(points, wrap_rows=True)


def ball(radius=8.0, around=96, rows=49):
    u = 2 * np.pi * np.arange(around)[None, :] / around
    v = np.linspace(-0.5 * np.pi, 0.5 * np.pi, rows)[:, None]
    points = radius * np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v) + 0 * u],
                               axis=-1)  # fmt: skip
    points[0], points[-1] = (0, 0, -radius), (0, 0, radius)
    return grid_surface(points, wrap_rows=False)


def box(low=(0, 0, 0), high=(4, 3, 2)):
    c = np.array([[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return np.concatenate([[c[[a, b, d]], c[[b, e, d]]] for a, b, e, d in quads])


def binary(triangles):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in triangles)
    return b"any words".ljust(80) + struct.pack("<I", len(triangles)) + body


def ascii_stl(triangles):
    lines = ["solid part"]
    for t in triangles.astype(np.float32):
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x!s} {y!s} {z!s}" for x, y, z in t]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid part"]).encode()


def test_a_torus_cut_both_ways():
    surface = Surface3D.of_triangles("torus", torus())
    flat = cut(surface, CutPlane((0, 0, 1.5), (1, 0, 0), (0, 1, 0)))
    half = np.sqrt(9 - 1.5**2)
    assert [loop.hole for loop in flat] == [False, True]
    for loop, radius in zip(flat, (10 + half, 10 - half), strict=True):
        assert loop.outline.area == pytest.approx(np.pi * radius**2, rel=5e-3)
    across = cut(surface, CutPlane((0, 0.01, 0), (1, 0, 0), (0, 0, 1)))
    assert [loop.hole for loop in across] == [False, False]
    for loop in across:
        assert loop.outline.area == pytest.approx(9 * np.pi, rel=5e-3)
    centres = sorted(np.mean(loop.outline.box[::2]) for loop in across)
    assert centres == pytest.approx([-10, 10], abs=0.01)


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.2])
def test_a_ball_is_cut_in_circles_of_the_right_size_wherever_it_is_cut(turn):
    surface = Surface3D.of_triangles("ball", ball())
    c, s = np.cos(turn), np.sin(turn)
    normal = np.cross((c, s, 0), (0, 0, 1))
    for depth in (-6.0, 0.0, 3.0):
        (loop,) = cut(surface, CutPlane(tuple(depth * normal), (c, s, 0), (0, 0, 1)))
        radius = np.sqrt(64 - depth**2)
        distance = np.hypot(*loop.outline.start.T)
        assert not loop.hole
        assert distance.max() <= radius + 1e-9
        assert distance.min() > radius - 0.05


def test_planes_through_corners_edges_and_faces():
    surface = Surface3D.of_triangles("box", box())
    diagonal = CutPlane((0, 0, 0), (4, 3, 0), (0, 0, 1))
    (loop,) = cut(surface, diagonal)
    assert loop.outline.box == pytest.approx((0, 0, 5, 2))
    assert loop.outline.area == pytest.approx(10)
    (face,) = cut(surface, CutPlane((0, 0, 2), (1, 0, 0), (0, 1, 0)))  # on the viewer's side
    assert face.outline.area == pytest.approx(12)
    for height in (0.0, 2.1):
        with pytest.raises(DrawingError, match="misses"):
            cut(surface, CutPlane((0, 0, height), (1, 0, 0), (0, 1, 0)))
    top = Surface3D.of_triangles("ball", ball())
    with pytest.raises(DrawingError, match="only touches"):
        cut(top, CutPlane((0, 0, 8), (1, 0, 0), (0, 1, 0)))


def test_a_hollow_body_has_a_hole_and_solids_that_meet_are_an_error():
    hollow = np.concatenate([ball(), ball(radius=5)[:, ::-1]])
    loops = cut(Surface3D.of_triangles("shell", hollow), FRONT)
    assert [loop.hole for loop in loops] == [False, True]
    crossing = np.concatenate([box(), box((2, 1, -1), (6, 7, 5))])
    with pytest.raises(DrawingError, match=r"two of the 2 curves.*meet"):
        cut(Surface3D.of_triangles("two", crossing), CutPlane((0, 0, 1), (1, 0, 0), (0, 1, 0)))


def test_both_kinds_of_file_give_the_same_surface_in_the_unit_that_is_said(tmp_path):
    surfaces = []
    for content in (binary(torus()), ascii_stl(torus())):
        file = tmp_path / "torus.stl"
        file.write_bytes(content)
        surfaces.append(read_stl(file, unit_mm=10.0))
    np.testing.assert_allclose(surfaces[0].corners, surfaces[1].corners, rtol=1e-6, atol=1e-12)
    assert surfaces[0].volume == pytest.approx(1e3 * 2 * np.pi**2 * 10 * 9, rel=6e-3)
    assert cut(surfaces[0], TOP)[0].outline.area == pytest.approx(100 * np.pi * 169, rel=2e-3)
    with pytest.raises(DrawingError, match="no unit"):
        read_stl(file, unit_mm=None)


def test_surfaces_with_defects_are_refused_with_the_place(tmp_path):
    file = tmp_path / "box.stl"
    for triangles, message in (
        (box()[1:], r"3 of its edges have no neighbour and 0 .* at \["),
        (np.concatenate([box(), box()[:1]]), "not watertight.*too many"),
        (box()[:, ::-1], "inside out"),
        (box() * 1e6, "beyond"),
        (np.zeros((0, 3, 3)), "no triangles"),
    ):
        file.write_bytes(binary(triangles))
        with pytest.raises(DrawingError, match=message):
            read_stl(file, unit_mm=1.0)
    for content, message in (
        (binary(box())[:-1], "would have"),
        (b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n", "line 4"),
        (b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "cut short"),
        (b"solid x\nnonsense", "'nonsense'"),
    ):
        file.write_bytes(content)
        with pytest.raises(DrawingError, match=message):
            read_stl(file, unit_mm=1.0)


@FUZZ
@given(st.booleans(), st.integers(0, 1200), st.binary(max_size=6))
def test_any_damage_to_an_stl_file_is_our_error(tmp_path, text, place, damage):
    content = (ascii_stl if text else binary)(box())
    file = tmp_path / "box.stl"
    file.write_bytes(content[:place] + damage + content[place + len(damage) :])
    with contextlib.suppress(DrawingError):
        cut(read_stl(file, unit_mm=2.0), CutPlane((0, 0, 1), (1, 0, 0), (0, 1, 0)))


# --- a drawn neck ---


def path_data(outline):
    """SVG path data of an outline of lines and arcs, y down."""
    start, bend = outline.start * (1, -1), outline.curvature
    data = f"M {start[0, 0]:.6f} {start[0, 1]:.6f}"
    for (x, y), k in zip(np.roll(start, -1, axis=0), bend, strict=True):
        radius = 0 if k == 0 else 1 / abs(k)
        data += (
            f" L {x:.6f} {y:.6f}"
            if k == 0
            else f" A {radius:.6f} {radius:.6f} 0 0 {int(k < 0)} {x:.6f} {y:.6f}"
        )
    return data + " Z"


def neck_svg(tmp_path, neck, **replaced):
    parts = {name: f'<path id="{name}" d="{path_data(getattr(neck, name))}"/>'
             for name in ("upper_wall", "lower_wall")}  # fmt: skip
    for name in ("upper_mark", "lower_mark"):
        x, y = getattr(neck, name)
        parts[name] = f'<circle id="{name}" cx="{x}" cy="{-y}" r="1"/>'
    inside = "".join((parts | replaced).values())
    return svg(
        tmp_path, f'<path d="M 0 0 H 9"/><g transform="translate(60 9) rotate(-35)">{inside}</g>'
    )


def test_a_neck_that_is_drawn_comes_back_the_same_from_anywhere_on_the_sheet(tmp_path):
    neck = neck_section(A38_NECK)
    drawn = drawn_neck(neck_svg(tmp_path, neck))
    np.testing.assert_allclose(drawn.upper_mark, neck.upper_mark, atol=1e-6)
    for wall in ("upper_wall", "lower_wall"):
        there, back = getattr(neck, wall), getattr(drawn, wall)
        assert np.abs(back.project(there.sampled(0.05)).distance).max() < 1e-5
        assert np.abs(back.curvature).max() == pytest.approx(1 / there.smallest_radius, rel=1e-9)
        assert len(back.start) < 2.2 * len(there.start)  # arcs stayed arcs
    low, high = drawn.silhouette.min(axis=0), drawn.silhouette.max(axis=0)
    assert low[0] == pytest.approx(-A38_NECK.mark_depth_mm, abs=0.2)
    assert high[1] - low[1] == pytest.approx(A38_NECK.package_width_mm)


@pytest.mark.parametrize(
    ("replaced", "message"),
    [
        ({"lower_wall": ""}, "0 closed curves named 'lower_wall'"),
        ({"more": '<circle id="Upper_Wall" r="2"/>'}, "2 closed curves named 'upper_wall'"),
        ({"upper_mark": '<circle id="upper_mark" r="2"/>'}, "too near"),
        ({"upper_mark": '<circle id="upper_mark" cy="20" r="1"/>'}, "exchange the names"),
    ],
)
def test_what_is_wrong_with_a_drawn_neck_is_said(tmp_path, replaced, message):
    with pytest.raises(DrawingError, match=message):
        drawn_neck(neck_svg(tmp_path, neck_section(A38_NECK), **replaced))


def test_other_files_are_refused(tmp_path):
    with pytest.raises(DrawingError, match=r"neither \.svg nor \.dxf"):
        drawn_outlines(tmp_path / "neck.pdf")
    for name in ("none.svg", "none.dxf"):
        with pytest.raises(DrawingError, match=r"no such drawing; check|needs ezdxf"):
            drawn_outlines(tmp_path / name)
