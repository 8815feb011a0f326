"""Drawings that cost time or memory, or that numbers, names and nesting make absurd."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf

SHEET = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="{}" height="80mm" viewBox="-50 -40 100 80">'
    "{}</svg>"
)


def wall(data: str, more: str = "") -> str:
    """A path that is called like a wall of a neck."""
    return f'<path id="upper_wall" {more} d="{data}"/>'


def lines(count: int) -> str:
    return "M0 0" + "".join(f"L{k % 7} {k % 5}" for k in range(count))


SVG: dict[str, tuple[str, str, str]] = {
    "width of digits": ("7" * 4000 + "?", "", "width '7{40}…' is no length"),
    "width of spaces": (" " * 90_000 + "9", wall("M0 0L1 0"), "is open"),
    "height of digits": ("100mm", wall("M0 " + "1" * 90_000), "'1{40}…' stands where a number"),
    "transform of letters": (
        "100mm",
        wall("M0 0L1 0", f'transform="{"q" * 90_000}"'),
        "'upper_wall': transform 'q{40}…' cannot be read",
    ),
    "transform of blanks": ("100mm", wall("M0 0L1 0", f'transform="{" " * 90_000}("'), "cannot be"),
    "many transforms": (
        "100mm",
        wall("M0 0L1 0", f'transform="{"scale(1)" * 9000}"'),
        "'upper_wall' has more than 100 transforms",
    ),
    "far cubics": (
        "100mm",
        wall("M1 1" + "C8e8 3 -8e8 9e8 2 2 " * 40 + "Z"),
        "'upper_wall' reaches farther than 10000 mm",
    ),
    "far quadratics": ("100mm", wall("M1 1" + "Q8e8 9e8 2 2 " * 40 + "Z"), "reaches farther"),
    "far arcs": ("100mm", wall("M0 0A9e8 1e8 3 1 1 1 1Z"), "reaches farther"),
    "far ellipse": ("100mm", '<ellipse id="a" rx="9e8" ry="1"/>', "'a' reaches farther"),
    "flat ellipse of matrices": (
        "100mm",
        '<circle id="a" r="1" transform="matrix(1e-6 0 0 1e6 0 0)"/>',
        "'a' reaches farther",
    ),
    "many lines": ("100mm", wall(lines(200_000)), "'upper_wall' has more than 30000 steps"),
    "many closings": ("100mm", wall("M0 0" + "z" * 900_000), "more than 30000 steps"),
    "many cubics": (
        "100mm",
        wall("M0 0" + "".join(f"C{k % 37} 9 {k % 31} -9 {k % 29} 3 " for k in range(5000))),
        "'upper_wall' and what stands before it need more than 30000",
    ),
    "many circles": ("100mm", '<circle id="a" r="2"/>' * 9000, "need more than 30000"),
    "many elements": ("100mm", "<g/>" * 200_000, "more than 100000 elements"),
    "deep groups": ("100mm", "<g>" * 150_000, "more than 100000 elements"),
    "groups that scale": (
        "100mm",
        '<g transform="scale(9)">' * 900,
        "'g' is scaled or moved out of all bounds",
    ),
    "skew by a right angle": ("100mm", '<g transform="skewX(90)">', "out of all bounds"),
    "to and fro": (
        "100mm",
        wall("M0 0" + "".join(f"L{k * 1e-3:.3f} {40 * (k % 2)}" for k in range(9000))),
        "'upper_wall' is 360 m long",
    ),
    "name without end": ("100mm", f'<path id="{"n" * 90_000}" d="M0 0L1 0"/>', "'n{40}…' is open"),
    "name of control characters": ("100mm", '<path id="a&#9;b" d="M0 0L1 0"/>', r"'a\\tb' is open"),
    "digits of another alphabet": ("100mm", wall("M0 0L٣ ٤"), "'٣ ٤' stands where a number"),
    "radius of nothing": ("100mm", wall("M0 0A1e-300 1e-300 0 0 1 5 5"), "an arc with radii"),
}
"""Width of the sheet and what is on it, with what is said of it."""


def svg(name: str, folder: Path) -> Path:
    """Write one of `SVG`."""
    width, content, _ = SVG[name]
    file = folder / "hostile.svg"
    file.write_text(SHEET.format(width, content), encoding="utf-8")
    return file


def tower(document: Any, levels: int, wide: int, *, empty: bool = False) -> None:
    """Blocks of blocks, each so many times in the next."""
    for level in range(levels):
        block = document.blocks.new(f"L{level}")
        if level == 0 and not empty:
            block.add_line((0, 0), (2, 1), dxfattribs={"layer": "upper_wall"})
        for k in range(wide if level else 0):
            block.add_blockref(f"L{level - 1}", (k, 0))
    document.modelspace().add_blockref(f"L{levels - 1}", (0, 0), dxfattribs={"layer": "roof"})


def in_itself(document: Any) -> None:
    for one, other in (("A", "B"), ("B", "A")):
        block = document.blocks.new(one)
        block.add_line((0, 0), (1, 1))
        block.add_blockref(other, (1, 0))
    document.modelspace().add_blockref("A", (0, 0))


def grid(document: Any) -> None:
    document.blocks.new("dot").add_circle((0, 0), 1)
    many = {"row_count": 20_000, "column_count": 9_000, "row_spacing": 3, "column_spacing": 3}
    document.modelspace().add_blockref("dot", (0, 0), dxfattribs=many | {"layer": "dots"})


def spline(points: list[tuple[float, float]]) -> Callable[[Any], None]:
    def draw(document: Any) -> None:
        document.modelspace().add_spline(points, dxfattribs={"layer": "upper_wall"})

    return draw


def many_splines(document: Any) -> None:
    for k in range(9):
        spline([(9 * math.cos(k * j), 0.1 * j) for j in range(1500)])(document)


def polyline(*points: tuple[float, ...]) -> Callable[[Any], None]:
    def draw(document: Any) -> None:
        layer = {"layer": "upper_wall"}
        document.modelspace().add_lwpolyline(points, "xyb", close=True, dxfattribs=layer)

    return draw


def circle(document: Any) -> None:
    document.modelspace().add_circle((1e300, 0), 1e300, dxfattribs={"layer": "upper_wall"})


DXF: dict[str, tuple[Callable[[Any], None], str]] = {
    "blocks of blocks": (lambda d: tower(d, 9, 12), "block 'L[345]' on layer '0' becomes"),
    "empty blocks of blocks": (
        lambda d: tower(d, 9, 12, empty=True),
        "block 'L[345]' on layer '0'",
    ),
    "deep blocks": (lambda d: tower(d, 900, 1), "block 'L[0-9]+' lies more than 32 blocks deep"),
    "blocks in themselves": (in_itself, "block '[AB]' lies more than 32 blocks deep, or in itself"),
    "grid of blocks": (grid, "block 'dot' on layer 'dots' becomes 360000001 entities"),
    "far spline": (
        spline([(7e8 * (-1) ** k, k * 1e5) for k in range(150)]),
        "'upper_wall' reaches farther than 10000 mm",
    ),
    "long spline": (spline([(k % 9, k) for k in range(3000)]), "SPLINE on layer 'upper_wall' has"),
    "many splines": (many_splines, "'upper_wall' and what stands before it need more than 30000"),
    "huge bulges": (polyline((0, 0, 1e300), (1, 0, 0), (1, 1, 0)), "turns by a full circle"),
    "far circle": (circle, "'upper_wall' reaches farther"),
    "many corners": (
        polyline(*[(k % 9, k % 7, 0) for k in range(40_000)]),
        "more than 30000 lines",
    ),
}
"""What draws into a document, with what is said of it."""


def dxf(name: str, folder: Path) -> Path:
    """Write one of `DXF`."""
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 4
    DXF[name][0](document)
    file = folder / "hostile.dxf"
    document.saveas(file)
    return file
