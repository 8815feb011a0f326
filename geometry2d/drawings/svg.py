"""Closed curves from SVG drawings, in mm and with y up.

Read are paths, polygons, polylines, lines, circles, ellipses and plain rectangles, with the
transforms of their groups. What cannot be followed exactly is refused, not skipped over.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from geometry2d.drawings.chains import MOST_PIECES, SMALLEST, Chain, DrawingError, PieceCount
from geometry2d.foundation.text import NUMBER, bytes_of, number, quoted

Array = NDArray[np.float64]

MM_PER_UNIT = {"mm": 1.0, "cm": 10.0, "in": 25.4, "pt": 25.4 / 72, "pc": 25.4 / 6, "q": 0.25}
"""Physical lengths of SVG; px is not among them, for programs disagree on its size."""

NO_PHYSICAL_UNIT = frozenset(["", "px", "%", "em", "ex", "ch", "rem", "vw", "vh"])
"""Units of the screen, which leave the size of a drawing open."""

CSS_PIXEL_MM = 25.4 / 96
"""User unit of a drawing with a physical size and no viewBox (SVG 2, section 8.2)."""

UNSEEN = frozenset(
    [
        *("defs", "clipPath", "mask", "marker", "symbol", "pattern", "filter"),
        *("linearGradient", "radialGradient", "style", "script", "sodipodi:namedview"),
        *("metadata", "title", "desc", "text", "image"),
    ]
)
"""Elements that draw no outline by themselves."""

REFUSED = frozenset(["use", "switch", "foreignObject"])
FLAG = re.compile("[01]")
SEPARATOR = re.compile(r"[\s,]*+")
TRANSFORM = re.compile(r"[\s,]*+([A-Za-z]++)\s*+\(([^()]*+)\)")
ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}
LARGEST_NUMBER = 1e9
LARGEST_SCALE = 1e12
"""Bounds of a number in a drawing, and of what its transforms make of a user unit, mm."""

MOST_ELEMENTS = 100_000
MOST_TRANSFORMS = 100
"""Elements of a drawing, and transforms of one of them."""


def read_svg(
    file: Path, *, unit_mm: float | None = None, names: Container[str] | None = None
) -> list[Chain]:
    """Return the curves of an SVG file as chains, named by label or id, mm, y up.

    Parameters
    ----------
    file
        The drawing. Declarations of entities are refused, nothing is fetched.
    unit_mm
        What a user unit is, mm, if the file gives no physical width and height.
    names
        The curves wanted, in lower case; the others are not followed. All of them if None.

    Raises
    ------
    DrawingError
        If the file is not SVG, has no unit, or holds something that cannot be followed.
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
    """Follows the elements of the file and keeps the transform of the group it is in."""

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
            to_mm = _after(to_mm, _transform(attributes["transform"], where))
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
        view = _numbers(attributes.get("viewBox", ""), f"{self._file}: viewBox")
        if len(view) not in (0, 4) or (len(view) == 4 and min(view[2:]) <= 0):
            shown = quoted(attributes["viewBox"])
            raise DrawingError(
                f"{self._file}: viewBox {shown} is not x, y, width and height: give four numbers"
            )
        sizes = [
            _millimetres(attributes.get(key, "auto"), f"{self._file}: {key}")
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
                'page\'s width and height in mm, as width="50mm", or say what a user unit is'
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
    """An element that draws something: its name, its place in messages, and its map to mm."""

    name: str
    where: str
    attributes: Mapping[str, str]
    to_mm: Array
    pieces: PieceCount

    def length(self, key: str) -> float:
        """Return an attribute in user units."""
        text = self.attributes.get(key, "0").strip()
        found = _numbers(text.removesuffix("px"), f"{self.where}: {key}")
        if len(found) != 1:
            raise DrawingError(
                f"{self.where}: {key} = {quoted(text)} is not a number in user units"
            )
        return found[0]

    def points(self) -> Array:
        numbers = _numbers(self.attributes.get("points", ""), f"{self.where}: points")
        if len(numbers) % 2:
            raise DrawingError(f"{self.where}: {len(numbers)} coordinates are not pairs")
        return np.reshape(numbers, (-1, 2))

    def polyline(self, points: Array) -> Chain:
        return self.pieces.counted(Chain.through(self.name, points).mapped(self.to_mm))

    def ellipse(
        self, centre: Array, radii: tuple[float, float], tilt: float = 0.0,
        first: float = 0.0, turn: float = 2 * np.pi,
    ) -> Chain:  # fmt: skip
        """Return the part of an ellipse that a turn of the unit circle from ``first`` becomes."""
        c, s = np.cos(tilt), np.sin(tilt)
        own = np.array([[c * radii[0], -s * radii[1], centre[0]],
                        [s * radii[0], c * radii[1], centre[1]]])  # fmt: skip
        start = np.array([np.cos(first), np.sin(first)])
        chain = Chain.about(self.name, (0.0, 0.0), start, turn).mapped(_after(self.to_mm, own))
        return self.pieces.counted(chain, fitted=len(chain.curvature) > 4)

    def bezier(self, control: Array) -> Chain:
        """Return arcs near the Bézier curve of control points (n, 2), in user units."""
        return self.pieces.counted(
            Chain.free(self.name, _applied(self.to_mm, control)), fitted=True
        )


def _path(shape: _Shape) -> list[Chain]:
    commands = list(_commands(shape.attributes.get("d", ""), shape.where))
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
    """Return an elliptical arc (SVG 2, appendix B.2.4); radii too small are an error here."""
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
    # Rounded numbers make half circles a little too small: the standard enlarges their radii.
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


def _commands(text: str, where: str) -> list[tuple[str, bool, Array]]:
    """Return capital letter, whether relative, and numbers of each single step of path data."""
    steps: list[tuple[str, bool, Array]] = []
    runs = re.split(r"([A-DF-Za-df-z])", text)  # e and E belong to numbers
    if runs[0].strip():
        raise DrawingError(f"{where}: path data start with {quoted(runs[0].strip())}, not with M")
    for letter, arguments in zip(runs[1::2], runs[2::2], strict=True):
        command = letter.upper()
        if command not in ARGUMENTS or (not steps and command != "M"):
            raise DrawingError(f"{where}: path data have {letter!r} where a command should be")
        numbers = _numbers(arguments, where, arcs=command == "A")
        if len(steps) + len(numbers) // max(ARGUMENTS[command], 1) > MOST_PIECES:
            raise DrawingError(f"{where} has more than {MOST_PIECES} steps: simplify the path")
        each = ARGUMENTS[command]
        if each == 0 and not numbers:
            steps.append((command, False, np.zeros(0)))
        elif each and numbers and len(numbers) % each == 0:
            for k in range(0, len(numbers), each):
                # Further pairs after M are lines.
                step = "L" if command == "M" and k else command
                steps.append((step, letter.islower(), np.array(numbers[k : k + each])))
        else:
            raise DrawingError(f"{where}: {letter} has {len(numbers)} numbers, not {each} each")
    return steps


def _numbers(text: str, where: str, *, arcs: bool = False) -> list[float]:
    """Return the numbers of an attribute; in arcs the 4th and 5th of each seven are single digits.

    So "1 01-20" may be written for a flag 1, a flag 0, a flag 1 and -20 (SVG 2, section 9.3.9).
    """
    numbers: list[float] = []
    at = SEPARATOR.match(text).end()  # type: ignore[union-attr]  # matches nothing at least
    while at < len(text):
        found = (FLAG if arcs and len(numbers) % 7 in (3, 4) else NUMBER).match(text, at)
        value = number(found.group()) if found else None
        if found is None or value is None:
            raise DrawingError(
                f"{where}: {quoted(text[at:])} stands where a number should be: write one"
            )
        if abs(value) > LARGEST_NUMBER:
            raise DrawingError(
                f"{where}: {quoted(found.group())} is too large for a drawing: check the unit"
            )
        numbers.append(value)
        at = SEPARATOR.match(text, found.end()).end()  # type: ignore[union-attr]
    return numbers


def _millimetres(text: str, where: str) -> float | None:
    """Return a physical length, mm, or None if the text has no physical unit."""
    stripped = text.strip().lower()
    found = NUMBER.match(stripped)
    value = number(found.group()) if found else None
    unit = stripped[found.end() :].strip() if found else stripped
    if value is not None and unit in MM_PER_UNIT:
        return value * MM_PER_UNIT[unit]
    if stripped != "auto" and (value is None or unit not in NO_PHYSICAL_UNIT):
        raise DrawingError(f'{where} {quoted(text)} is no length: write one, such as "50mm"')
    return None


def _transform(text: str, where: str) -> Array:
    """Return the map (2, 3) of a transform attribute (CSS Transforms 1, section 8)."""
    result = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    at = count = 0
    while found := TRANSFORM.match(text, at):
        at, count = found.end(), count + 1
        if count > MOST_TRANSFORMS:
            raise DrawingError(f"{where} has more than {MOST_TRANSFORMS} transforms: ungroup it")
        result = _after(result, _one_transform(found[1], _numbers(found[2], where), where))
    if text[at:].strip(" ,\t\r\n"):
        raise DrawingError(
            f"{where}: transform {quoted(text[at:])} cannot be read: ungroup it, or convert it to "
            "a path"
        )
    return result


def _one_transform(kind: str, n: list[float], where: str) -> Array:
    if kind == "matrix" and len(n) == 6:
        return np.array([[n[0], n[2], n[4]], [n[1], n[3], n[5]]])
    if kind == "translate" and len(n) in (1, 2):
        return np.array([[1.0, 0.0, n[0]], [0.0, 1.0, n[1] if len(n) == 2 else 0.0]])
    if kind == "scale" and len(n) in (1, 2):
        return np.array([[n[0], 0.0, 0.0], [0.0, n[-1], 0.0]])
    if kind == "rotate" and len(n) in (1, 3):
        c, s = np.cos(np.radians(n[0])), np.sin(np.radians(n[0]))
        x, y = n[1:] if len(n) == 3 else (0.0, 0.0)
        return np.array([[c, -s, x - c * x + s * y], [s, c, y - s * x - c * y]])
    if kind in ("skewX", "skewY") and len(n) == 1:
        slope = float(np.tan(np.radians(n[0])))
        across, up = (slope, 0.0) if kind == "skewX" else (0.0, slope)
        return np.array([[1.0, across, 0.0], [up, 1.0, 0.0]])
    raise DrawingError(f"{where}: transform {quoted(kind)} with {len(n)} numbers is not known")


def _after(outer: Array, inner: Array) -> Array:
    """Return the map (2, 3) that applies ``inner`` first."""
    return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def _applied(to: Array, points: Array) -> Array:
    mapped: Array = points @ to[:, :2].T + to[:, 2]
    return mapped


def _invisible(attributes: Mapping[str, str]) -> bool:
    style = attributes.get("style", "").replace(" ", "")
    return attributes.get("display") == "none" or "display:none" in style
