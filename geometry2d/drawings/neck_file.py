"""A neck written as a drawing, SVG or DXF, that :mod:`geometry2d.drawings.drawn_neck` reads."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geometry2d.drawings.chains import DrawingError
from geometry2d.foundation.output import file_at_once
from geometry2d.neck import NeckSection
from geometry2d.outline import Outline

Array = NDArray[np.float64]

MARK_RADIUS_MM = 1.0
MARGIN_MM = 3.0
MILLIMETRES = 4
"""DXF's number for the unit."""


def write_neck(neck: NeckSection, file: Path) -> None:
    """Write walls and marks of a neck, in the neck frame; arcs stay arcs.

    Parameters
    ----------
    neck
        The neck.
    file
        Ending in ``.svg`` or ``.dxf``.

    Raises
    ------
    DrawingError
        If it has another ending, or what writes DXF is not installed.
    """
    kind = file.suffix.lower()
    if kind not in (".svg", ".dxf"):
        raise DrawingError(f"{file} must end in .svg or .dxf")
    with file_at_once(file) as partial:
        if kind == ".svg":
            partial.write_text(_svg(neck), encoding="utf-8")
        else:
            _dxf(neck).saveas(partial)


def _walls(neck: NeckSection) -> Iterator[tuple[str, Outline]]:
    yield "upper_wall", neck.upper_wall
    yield "lower_wall", neck.lower_wall


def _marks(neck: NeckSection) -> Iterator[tuple[str, Array]]:
    yield "upper_mark", neck.upper_mark
    yield "lower_mark", neck.lower_mark


def _svg(neck: NeckSection) -> str:
    points = np.vstack([wall.start for _, wall in _walls(neck)])
    low, high = points.min(axis=0) - MARGIN_MM, points.max(axis=0) + MARGIN_MM
    width, height = (float(side) for side in high - low)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width!r}mm" height="{height!r}mm" '
        f'viewBox="0 0 {width!r} {height!r}" fill="none" stroke="black" stroke-width="0.1">'
    ]
    for name, wall in _walls(neck):
        lines.append(f'  <path id="{name}" d="{_path(wall, low[0], high[1])}" />')
    for name, at in _marks(neck):
        x, y = float(at[0] - low[0]), float(high[1] - at[1])
        lines.append(f'  <circle id="{name}" cx="{x!r}" cy="{y!r}" r="{MARK_RADIUS_MM}" />')
    return "\n".join([*lines, "</svg>", ""])


def _path(wall: Outline, left: float, top: float) -> str:
    """Return the path of a wall on a sheet whose y runs downwards."""

    def at(point: Array) -> str:
        return f"{float(point[0] - left)!r} {float(top - point[1])!r}"

    words = [f"M {at(wall.start[0])}"]
    for end, curvature in zip(np.roll(wall.start, -1, axis=0), wall.curvature, strict=True):
        if curvature == 0:
            words.append(f"L {at(end)}")
        else:
            radius = 1.0 / abs(float(curvature))
            # An arc that bends to the left bends to the left on a mirrored sheet's back: sweep 0.
            words.append(f"A {radius!r} {radius!r} 0 0 {0 if curvature > 0 else 1} {at(end)}")
    return " ".join([*words, "Z"])


def _dxf(neck: NeckSection) -> Any:
    try:
        from ezdxf.filemanagement import new
    except ImportError:
        raise DrawingError("ezdxf is not installed: pip install 'drinksim[files]'") from None
    document = new("R2010")
    document.header["$INSUNITS"] = MILLIMETRES
    space = document.modelspace()
    for name, wall in _walls(neck):
        chord = np.roll(wall.start, -1, axis=0) - wall.start
        half_sine = 0.5 * np.hypot(*chord.T) * wall.curvature
        # The bulge of DXF is the tangent of a quarter of the arc's angle.
        bulges = [math.tan(0.5 * math.asin(max(-1.0, min(1.0, float(s))))) for s in half_sine]
        points = [
            (float(x), float(y), bulge) for (x, y), bulge in zip(wall.start, bulges, strict=True)
        ]
        space.add_lwpolyline(points, format="xyb", close=True, dxfattribs={"layer": name})
    for name, at in _marks(neck):
        space.add_circle((float(at[0]), float(at[1])), MARK_RADIUS_MM, dxfattribs={"layer": name})
    return document
