"""Drawings that nobody can use are refused by name, soon and in little memory."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from pathlib import Path

import ezdxf
import numpy as np
import pytest

from geometry2d.drawings.chains import Chain, DrawingError
from geometry2d.drawings.drawing_file import drawn_outlines
from geometry2d.drawings.drawn_neck import drawn_neck
from geometry2d.drawings.joined import closed_outlines
from geometry2d.drawings.stl import read_stl
from tests.support.hostile_drawings import DXF, SHEET, SVG, dxf, svg
from tests.support.marks import slow


def cases(names: Iterable[str]) -> list[object]:
    """What is refused for its size takes long to be read."""
    return [slow(name) if name.startswith("many") else name for name in names]


@pytest.mark.parametrize("name", cases(SVG))
def test_a_hostile_svg_drawing_is_refused_by_what_is_wrong(tmp_path: Path, name: str):
    file = svg(name, tmp_path)
    with pytest.raises(DrawingError, match=rf"hostile\.svg.*{SVG[name][2]}") as caught:
        drawn_outlines(file)
    assert len(str(caught.value)) < 400 and str(caught.value).isprintable()
    with pytest.raises(DrawingError, match=r"hostile\.svg"):
        drawn_neck(file)


@pytest.mark.parametrize("name", cases(DXF))
def test_a_hostile_dxf_drawing_is_refused_by_what_is_wrong(tmp_path: Path, name: str):
    file = dxf(name, tmp_path)
    with pytest.raises(DrawingError, match=rf"hostile\.dxf.*{DXF[name][1]}"):
        drawn_outlines(file)
    with pytest.raises(DrawingError, match=r"hostile\.dxf"):
        drawn_neck(file)


def test_curves_that_are_not_wanted_cost_nothing(tmp_path: Path):
    file = tmp_path / "sheet.svg"
    decoration = '<path id="logo" d="M0 0' + "C9 9 -9 8 3 3 " * 20_000 + 'L oops"/>'
    far = '<path id="frame" d="M0 0C9e8 1 -9e8 7e8 3 3"/>'
    file.write_text(SHEET.format("100mm", f'{decoration}{far}<circle id="Wanted" r="3"/>'))
    ((name, outline),) = drawn_outlines(file, names=("wanted",))
    assert name == "Wanted" and outline.smallest_radius == pytest.approx(3)


@pytest.mark.parametrize("insunits", [1, 4, 6])
@pytest.mark.parametrize("kind", ["ellipse", "arcs", "mirrored", "spline"])
def test_free_curves_are_followed_in_mm_whatever_the_unit(tmp_path: Path, insunits: int, kind: str):
    mm = {1: 25.4, 4: 1.0, 6: 1000.0}[insunits]
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = insunits
    space, layer = document.modelspace(), {"layer": "oval"}
    angle = np.linspace(0, 2 * np.pi, 500)
    on_it = np.column_stack([40 * np.cos(angle), 20 * np.sin(angle)])
    if kind == "spline":
        spline = space.add_spline((on_it[:300:20] / mm).tolist(), dxfattribs=layer)
        points = [point.vec2 for point in spline.construction_tool().approximate(999)]
        space.add_line(points[0], points[-1], dxfattribs=layer)
        on_it = mm * np.array(points)
    elif kind == "mirrored":
        down = layer | {"extrusion": (0, 0, -1)}
        space.add_ellipse((0, 0), (40 / mm, 0), 0.5, 0.3, 2.0, dxfattribs=down)
        angle = -np.linspace(0.3, 2.0, 99)
        on_it = np.column_stack([40 * np.cos(angle), 20 * np.sin(angle)])
        space.add_line(*(on_it[[0, -1]] / mm), dxfattribs=layer)
    else:
        ends = [(0, 2 * np.pi)] if kind == "ellipse" else [(0.3, 2.0), (2.0, 0.3)]
        for low, high in ends:
            space.add_ellipse((0, 0), (40 / mm, 0), 0.5, low, high, dxfattribs=layer)
    document.saveas(tmp_path / "oval.dxf")
    ((_, outline),) = drawn_outlines(tmp_path / "oval.dxf")
    assert np.abs(outline.project(on_it).distance).max() < 3e-3


def test_ends_meet_in_any_order_and_number():
    rng = np.random.default_rng(0)
    corners = 50 * np.exp(2j * np.pi * np.arange(4000) / 4000)
    points = np.column_stack([corners.real, corners.imag])
    pieces = [
        Chain.through("ring", np.array([a, b])[:: rng.choice((1, -1))])
        for a, b in zip(points, np.roll(points, -1, axis=0), strict=True)
    ]
    ((_, outline),) = closed_outlines([pieces[k] for k in rng.permutation(len(pieces))])
    assert outline.area == pytest.approx(2500 * np.pi, rel=1e-5)
    with pytest.raises(DrawingError, match=r"'ring' branches at .*: 3 ends meet there"):
        closed_outlines([*pieces, Chain.through("ring", [points[7], (0, 0)])])
    with pytest.raises(DrawingError, match=r"'ring' is open: its end at .* is 0\.07854 mm from"):
        closed_outlines(pieces[1:])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"solid x\nfacet\nouter\nvertex 0 0 1_0\n", "line 4: 'vertex 0 0 1_0' is no corner of"),
        (b"solid x\nfacet\nouter\nvertex 0 0 0 0\n", "line 4: .* is no corner of three numbers"),
        (b"solid x\nvertex 0 0 " + b"9" * 90_000, "line 2: 'vertex 0 0 9.*…' is no corner"),
        (b"solid x\nvertex nan 0 0\n", "is no corner of three numbers"),
        (b"solid x\n" + b"\x1b[31m" * 99, r"line 2: '\\x1b\[31m.*…' is not a word of STL"),
        (b" " * 80 + struct.pack("<I", 2**32 - 1), "of its 4294967295 triangles would have"),
    ],
)
def test_hostile_surfaces_are_refused(tmp_path: Path, content: bytes, message: str):
    (tmp_path / "hostile.stl").write_bytes(content)
    with pytest.raises(DrawingError, match=rf"hostile\.stl.*{message}"):
        read_stl(tmp_path / "hostile.stl", unit_mm=1.0)
    with pytest.raises(DrawingError, match=r"say what a unit is in mm$"):
        read_stl(tmp_path / "hostile.stl", unit_mm=None)
