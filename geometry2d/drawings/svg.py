"""Closed curves from SVG drawings, in mm and with y up.

Supported elements are paths, polygons, polylines, lines, circles, ellipses and rectangles without
rounded corners, with the transforms of their groups. Any other drawn element is an error.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from geometry2d.drawings.chains import SMALLEST, Chain, DrawingError, PieceCount
from geometry2d.drawings.svg_syntax import (
    after,
    applied,
    attribute_numbers,
    millimetres,
    path_steps,
    transform_map,
)
from geometry2d.foundation.text import bytes_of, quoted

Array = NDArray[np.float64]

CSS_PIXEL_MM = 25.4 / 96
"""User unit of a drawing with a physical size and no viewBox (SVG 2, section 8.2)."""

UNSEEN = frozenset(
    [
        *("defs", "clipPath", "mask", "marker", "symbol", "pattern", "filter"),
        *("linearGradient", "radialGradient", "style", "script", "sodipodi:namedview"),
        *("metadata", "title", "desc", "text", "image"),
    ]
)
"""Elements that draw no outline."""

REFUSED = frozenset(["use", "switch", "foreignObject"])
LARGEST_SCALE = 1e12
"""Largest size of a user unit under the transforms of a drawing, mm."""

MOST_ELEMENTS = 100_000
"""Largest number of elements of a drawing."""


def read_svg(
    file: Path, *, unit_mm: float | None = None, names: Container[str] | None = None
) -> list[Chain]:
    """Return the curves of an SVG file as chains, named by label or id, mm, y up.

    Parameters
    ----------
    file
        The drawing. Declarations of entities are errors; nothing is fetched.
    unit_mm
        User unit, mm, if the file states no physical width and height.
    names
        The curves wanted, in lower case; the others are not followed. All of them if None.

    Raises
    ------
    DrawingError
        If the file is not SVG, has no unit, or holds an element that cannot be converted.
    """
    content = bytes_of(file, what="drawing", error=DrawingError)
    reader = _SvgReader(file.name, unit_mm, names)
    parser = expat.ParserCreate()
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    parser.EntityDeclHandler = reader.refuse_entity
    try:
        parser.Parse(content, True)
    except DrawingError:
        raise
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise DrawingError(f"{file.name} is not valid XML: {error}") from error
    return reader.chains


class _SvgReader:
    """Parser of the elements of a file; it keeps the transform of the current group."""

    def __init__(self, file: str, unit_mm: float | None, names: Container[str] | None) -> None:
        self.chains: list[Chain] = []
        self._file, self._unit_mm, self._names = file, unit_mm, names
        self._pieces = PieceCount(file)
        self._maps: list[Array] = []
        self._hidden = 0
        self._elements = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        name = tag.removeprefix("svg:")
        self._elements += 1
        if self._elements > MOST_ELEMENTS:
            raise DrawingError(
                f"{self._file} has more than {MOST_ELEMENTS} elements: delete what is not needed"
            )
        if not self._maps:
            if name != "svg":
                raise DrawingError(f"{self._file} is no SVG drawing: it starts with {quoted(tag)}")
            self._maps.append(self._drawing_to_mm(attributes))
            return
        if self._hidden or name in UNSEEN or _invisible(attributes):
            self._hidden += 1
            return
        called = attributes.get("inkscape:label") or attributes.get("id") or name
        where = f"{self._file}: {quoted(called)}"
        if name in REFUSED or name == "svg":
            raise DrawingError(f"{where} is a <{name}>: replace it by plain paths")
        to_mm = self._maps[-1]
        if "transform" in attributes:
            to_mm = after(to_mm, transform_map(attributes["transform"], where))
            if not np.all(np.abs(to_mm) <= LARGEST_SCALE):
                raise DrawingError(f"{where} is scaled or moved out of all bounds: ungroup it")
        self._maps.append(to_mm)
        wanted = self._names is None or called.lower() in self._names
        if name in SHAPES and wanted:
            self.chains += SHAPES[name](_Shape(called, where, attributes, to_mm, self._pieces))

    def end(self, tag: str) -> None:
        if self._hidden:
            self._hidden -= 1
        else:
            self._maps.pop()

    def refuse_entity(self, name: str, *rest: object) -> None:
        raise DrawingError(
            f"{self._file} declares the entity {quoted(name)}: save it as plain SVG without "
            "entities"
        )

    def _drawing_to_mm(self, attributes: Mapping[str, str]) -> Array:
        """Return the map (2, 3) from user units with y down to mm with y up."""
        view = attribute_numbers(attributes.get("viewBox", ""), f"{self._file}: viewBox")
        if len(view) not in (0, 4) or (len(view) == 4 and min(view[2:]) <= 0):
            shown = quoted(attributes["viewBox"])
            raise DrawingError(
                f"{self._file}: viewBox {shown} is not x, y, width and height: give four numbers"
            )
        sizes = [
            millimetres(attributes.get(key, "auto"), f"{self._file}: {key}")
            for key in ("width", "height")
        ]
        stated = [size for size in sizes if size is not None]
        unit = self._unit_mm
        if stated and not view:
            unit = CSS_PIXEL_MM
        elif stated:
            units = [size / w for size, w in zip(sizes, view[2:], strict=True) if size is not None]
            unit = units[0]
            if not np.allclose(units, unit, rtol=1e-3):
                raise DrawingError(
                    f"{self._file}: width and height make a user unit {units[0]:.4g} mm wide and "
                    f"{units[1]:.4g} mm high: give the page the proportions of its viewBox"
                )
        if unit is None:
            width = quoted(attributes["width"]) if "width" in attributes else "not given"
            raise DrawingError(
                f"{self._file} has no physical size (width {width}): set the "
                'page\'s width and height in mm, as width="50mm", or give the user unit in mm'
            )
        if not 1e-6 < unit < 1e6:
            raise DrawingError(f"{self._file}: a user unit of {unit:.4g} mm is not for a drawing")
        if self._unit_mm is not None and not np.isclose(unit, self._unit_mm, rtol=1e-3):
            raise DrawingError(
                f"{self._file} says that a user unit is {unit:.4g} mm, not {self._unit_mm:g} mm"
            )
        x, y = view[:2] if view else (0.0, 0.0)
        return np.array([[unit, 0.0, -unit * x], [0.0, -unit, unit * y]])


@dataclass(frozen=True)
class _Shape:
    """An element that draws: its name, its description for messages, and its map to mm."""

    name: str
    where: str
    attributes: Mapping[str, str]
    to_mm: Array
    pieces: PieceCount

    def length(self, key: str) -> float:
        """Return an attribute in user units."""
        text = self.attributes.get(key, "0").strip()
        found = attribute_numbers(text.removesuffix("px"), f"{self.where}: {key}")
        if len(found) != 1:
            raise DrawingError(
                f"{self.where}: {key} = {quoted(text)} is not a number in user units"
            )
        return found[0]

    def points(self) -> Array:
        numbers = attribute_numbers(self.attributes.get("points", ""), f"{self.where}: points")
        if len(numbers) % 2:
            raise DrawingError(f"{self.where}: {len(numbers)} coordinates are not pairs")
        return np.reshape(numbers, (-1, 2))

    def polyline(self, points: Array) -> Chain:
        return self.pieces.counted(Chain.through(self.name, points).mapped(self.to_mm))

    def ellipse(
        self, centre: Array, radii: tuple[float, float], tilt: float = 0.0,
        first: float = 0.0, turn: float = 2 * np.pi,
    ) -> Chain:  # fmt: skip
        """Return the image of an arc of the unit circle, which starts at the angle ``first``."""
        c, s = np.cos(tilt), np.sin(tilt)
        own = np.array([[c * radii[0], -s * radii[1], centre[0]],
                        [s * radii[0], c * radii[1], centre[1]]])  # fmt: skip
        start = np.array([np.cos(first), np.sin(first)])
        chain = Chain.about(self.name, (0.0, 0.0), start, turn).mapped(after(self.to_mm, own))
        return self.pieces.counted(chain, fitted=len(chain.curvature) > 4)

    def bezier(self, control: Array) -> Chain:
        """Return arcs near the Bézier curve of control points (n, 2), in user units."""
        return self.pieces.counted(Chain.free(self.name, applied(self.to_mm, control)), fitted=True)


def _path(shape: _Shape) -> list[Chain]:
    commands = list(path_steps(shape.attributes.get("d", ""), shape.where))
    chains: list[Chain] = []
    parts: list[Chain] = []
    here = start = control = np.zeros(2)
    last = ""

    def finish() -> None:
        if parts:
            chains.append(Chain.of(shape.name, parts))
            parts.clear()

    for letter, relative, numbers in commands:
        origin = here if relative else np.zeros(2)
        end = origin + numbers[-2:] if len(numbers) > 1 else here
        if letter == "M":
            finish()
            start = end
        elif letter == "Z":
            if np.any(here != start):
                parts.append(shape.polyline(np.array([here, start])))
            finish()
            end = start
        elif letter in "LHV":
            if letter == "H":
                end = np.array([origin[0] + numbers[0], here[1]])
            elif letter == "V":
                end = np.array([here[0], origin[1] + numbers[0]])
            parts.append(shape.polyline(np.array([here, end])))
        elif letter == "A":
            parts.append(_arc(shape, here, numbers, end))
        else:
            given = [origin + numbers[k : k + 2] for k in range(0, len(numbers), 2)]
            if letter in "ST":
                smooth = last in ("CS" if letter == "S" else "QT") and last != ""
                given.insert(0, 2 * here - control if smooth else here)
            control = given[-2]
            parts.append(shape.bezier(np.array([here, *given])))
        here, last = end, letter
    finish()
    return chains


def _arc(shape: _Shape, start: Array, numbers: Array, end: Array) -> Chain:
    """Return an elliptical arc (SVG 2, appendix B.2.4); too small radii are an error."""
    radii, tilt = np.abs(numbers[:2]), np.radians(numbers[2])
    large, sweep = numbers[3:5]
    if not np.any(radii) or not np.any(end - start):
        return shape.polyline(np.array([start, end]))
    if np.min(radii) < SMALLEST:
        raise DrawingError(f"{shape.where} has an arc with radii {radii.tolist()}: enlarge them")
    c, s = np.cos(tilt), np.sin(tilt)
    half = np.array([[c, s], [-s, c]]) @ (0.5 * (start - end)) / radii
    size = float(half @ half)
    if size > 1 + 1e-3:
        raise DrawingError(
            f"{shape.where} has an arc of radii {radii.tolist()} that cannot reach from "
            f"{start.tolist()} to {end.tolist()} (user units): enlarge the radii"
        )
    # Rounded numbers may make a half circle slightly too small: the standard enlarges its radii.
    enlarged = max(1.0, float(np.sqrt(size)))
    half, radii = half / enlarged, radii * enlarged
    away = float(np.sqrt(max(0.0, 1 / float(half @ half) - 1))) * (1 if large == sweep else -1)
    middle = away * np.array([-half[1], half[0]])
    first = float(np.arctan2(*(half - middle)[::-1]))
    turn = float(np.arctan2(*(-half - middle)[::-1])) - first
    turn = turn % (2 * np.pi) if sweep else -((-turn) % (2 * np.pi))
    centre = 0.5 * (start + end) + np.array([[c, -s], [s, c]]) @ (radii * middle)
    return shape.ellipse(centre, (float(radii[0]), float(radii[1])), tilt, first, turn)


def _polygon(shape: _Shape) -> list[Chain]:
    points = shape.points()
    return [shape.polyline(np.concatenate([points, points[:1]]))]


def _polyline(shape: _Shape) -> list[Chain]:
    return [shape.polyline(shape.points())]


def _line(shape: _Shape) -> list[Chain]:
    x1, y1, x2, y2 = (shape.length(key) for key in ("x1", "y1", "x2", "y2"))
    return [shape.polyline(np.array([(x1, y1), (x2, y2)]))]


def _ellipse(shape: _Shape) -> list[Chain]:
    keys = ("r", "r") if "r" in shape.attributes else ("rx", "ry")
    rx, ry = (shape.length(key) for key in keys)
    if min(rx, ry) <= 0:
        raise DrawingError(f"{shape.where} has radius {min(rx, ry):g}: give it a size")
    return [shape.ellipse(np.array([shape.length("cx"), shape.length("cy")]), (rx, ry))]


def _rectangle(shape: _Shape) -> list[Chain]:
    if "rx" in shape.attributes or "ry" in shape.attributes:
        raise DrawingError(f"{shape.where} is a rounded rectangle: convert it to a path")
    x, y, width, height = (shape.length(key) for key in ("x", "y", "width", "height"))
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height), (0, 0)])
    return [shape.polyline(corners + np.array([x, y]))]


SHAPES: dict[str, Callable[[_Shape], list[Chain]]] = {
    "path": _path,
    "polygon": _polygon,
    "polyline": _polyline,
    "line": _line,
    "circle": _ellipse,
    "ellipse": _ellipse,
    "rect": _rectangle,
}


def _invisible(attributes: Mapping[str, str]) -> bool:
    style = attributes.get("style", "").replace(" ", "")
    return attributes.get("display") == "none" or "display:none" in style
