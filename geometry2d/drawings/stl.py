"""Surfaces from STL files and their cuts with a plane.

The thesis draws its head on a cut through the STL surfaces of a head model (section 4.1.1). A cut
is defined only for a surface without holes: a surface that is not watertight is an error that names
the place. It is never closed silently.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from geometry2d.drawings.chains import LARGEST_MM, DrawingError
from geometry2d.drawings.joined import outline_through
from geometry2d.foundation.text import bytes_of, number, quoted
from geometry2d.outline import Outline

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

HEADER_BYTES = 84
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
SAME_MM = 1e-7
"""Points of a cut nearer than this are one, mm: the plane passes a corner of the surface."""


@dataclass(frozen=True)
class CutPlane:
    """A plane in space, with the axes of the cut.

    Parameters
    ----------
    point
        (3,) a point of the plane, mm: the origin of the cut.
    right, up
        (3,) directions in the plane that become x and y, at right angles. The normal, right × up,
        points to the viewer.
    """

    point: tuple[float, float, float]
    right: tuple[float, float, float]
    up: tuple[float, float, float]

    def __post_init__(self) -> None:
        sizes = [float(np.linalg.norm(v)) for v in (self.right, self.up)]
        if not np.all(np.isfinite([*self.point, *sizes])) or min(sizes) < 1e-12:
            raise DrawingError("a cut plane needs a finite point and two directions with a length")
        if abs(np.dot(self.right, self.up)) > 1e-6 * sizes[0] * sizes[1]:
            right, up = ([round(x, 6) for x in v] for v in (self.right, self.up))
            raise DrawingError(f"right {right} and up {up} are not at right angles: turn one")

    @property
    def axes(self) -> Array:
        """Unit vectors (3, 3) to the right, up and towards the viewer."""
        right, up = (np.asarray(v, float) / np.linalg.norm(v) for v in (self.right, self.up))
        return np.array([right, up, np.cross(right, up)])


@dataclass(frozen=True)
class Surface3D:
    """A watertight surface of triangles whose normals point outwards.

    Parameters
    ----------
    name
        Name, for messages.
    corners
        (n, 3) corners, mm.
    triangles
        (m, 3) indices of corners, counter-clockwise seen from outside.

    Raises
    ------
    DrawingError
        If an edge does not belong to two triangles in opposite directions, or normals point
        inwards.
    """

    name: str
    corners: Array
    triangles: Indices

    def __post_init__(self) -> None:
        if len(self.triangles) == 0:
            raise DrawingError(f"{self.name} has no triangles")
        first = self.triangles.ravel()
        last = np.roll(self.triangles, -1, axis=1).ravel()
        count = len(self.corners)
        there, back = np.sort(first * count + last), np.sort(last * count + first)
        doubled = there[:-1][there[1:] == there[:-1]]
        single = np.setdiff1d(there, back)
        if len(doubled) or len(single):
            key = int(single[0] if len(single) else doubled[0])
            place = 0.5 * (self.corners[key // count] + self.corners[key % count])
            raise DrawingError(
                f"{self.name} is not watertight: {len(single)} of its edges have no neighbour and "
                f"{len(doubled)} have too many, the first at {np.round(place, 4).tolist()} mm; "
                "export it as a closed solid, or repair it in the program it comes from"
            )
        if self.volume <= 0:
            raise DrawingError(f"{self.name} is inside out: flip its normals")

    @classmethod
    def of_triangles(cls, name: str, points: ArrayLike) -> Surface3D:
        """Return the surface of triangles (m, 3, 3), mm, that share exactly equal corners.

        Triangles with two equal corners are ignored.
        """
        p = np.asarray(points, float).reshape(-1, 3)
        corners, index = np.unique(p, axis=0, return_inverse=True)
        triangles = np.asarray(index, np.int64).reshape(-1, 3)
        flat = np.any(triangles == np.roll(triangles, -1, axis=1), axis=1)
        return cls(name, corners, triangles[~flat])

    @property
    def volume(self) -> float:
        """Enclosed volume, mm³."""
        a, b, c = (self.corners[self.triangles[:, k]] - self.corners[0] for k in range(3))
        return float(np.sum(a * np.cross(b, c)) / 6)


class CutLoop(NamedTuple):
    """A closed curve of a cut.

    Attributes
    ----------
    outline
        Counter-clockwise polygon in the coordinates of the plane, mm.
    hole
        Whether the solid is outside the curve.
    """

    outline: Outline
    hole: bool


def read_stl(file: Path, *, unit_mm: float | None) -> Surface3D:
    """Return the surface of an ASCII or binary STL file.

    Parameters
    ----------
    file
        The surface; STL has no unit.
    unit_mm
        Unit of the file, mm; it is required.

    Raises
    ------
    DrawingError
        If the file is neither kind of STL, or its surface is not closed.
    """
    if unit_mm is None or not 1e-6 < unit_mm < 1e6:
        given = "" if unit_mm is None else f", {unit_mm:g} is none"
        raise DrawingError(f"{file.name}: STL files have no unit; say what a unit is in mm{given}")
    content = bytes_of(file, what="surface", error=DrawingError)
    count = int.from_bytes(content[HEADER_BYTES - 4 : HEADER_BYTES], "little")
    expected = HEADER_BYTES + count * TRIANGLE.itemsize
    if len(content) >= HEADER_BYTES and len(content) == expected:
        with np.errstate(invalid="ignore"):  # values that are no numbers are an error below
            points = np.frombuffer(content, TRIANGLE, offset=HEADER_BYTES)["corners"].astype(float)
    elif content.lstrip()[:5].lower() == b"solid":
        points = _ascii_triangles(content, file.name)
    else:
        raise DrawingError(
            f"{file.name} is not STL: it has {len(content)} bytes, a binary file of its "
            f"{count} triangles would have {expected}"
        )
    if not np.all(np.abs(points) <= LARGEST_MM / unit_mm):
        raise DrawingError(
            f"{file.name} has coordinates beyond {LARGEST_MM:g} mm, or some that are not numbers: "
            "check the unit, or export the file again"
        )
    return Surface3D.of_triangles(file.name, points * unit_mm)


def cut(surface: Surface3D, plane: CutPlane) -> list[CutLoop]:
    """Return the closed curves of the cut of a surface with a plane, largest first.

    Corners on the plane count as on the viewer's side of it.

    Raises
    ------
    DrawingError
        If the plane misses the surface, or the curves touch or cross themselves or each other.
    """
    right_up_out = (surface.corners - np.asarray(plane.point)) @ plane.axes.T
    height = right_up_out[:, 2]
    above = height >= 0
    sides = above[surface.triangles]
    crossed = surface.triangles[sides.any(axis=1) & ~sides.all(axis=1)]
    if len(crossed) == 0:
        raise DrawingError(
            f"the plane misses {surface.name}: the surface lies {height.min():.4g} ... "
            f"{height.max():.4g} mm in front of it; move the plane into that range"
        )
    following = np.roll(crossed, -1, axis=1)
    downwards = above[crossed] & ~above[following]
    upwards = ~above[crossed] & above[following]
    # For the viewer, the solid is on the left of the segment from the edge that goes down to the
    # edge that goes up. The next segment is in the triangle where the latter edge goes down.
    entry = np.column_stack([crossed[downwards], following[downwards]])
    leave = np.column_stack([following[upwards], crossed[upwards]])
    number = {(int(a), int(b)): k for k, (a, b) in enumerate(entry)}
    after = [number[int(a), int(b)] for a, b in leave]
    upper, lower = height[entry[:, 0]], height[entry[:, 1]]
    share = (upper / (upper - lower))[:, None]
    points = ((1 - share) * right_up_out[entry[:, 0]] + share * right_up_out[entry[:, 1]])[:, :2]
    loops = [loop for ring in _cycles(after) if (loop := _loop(points[ring], surface.name))]
    if not loops:
        raise DrawingError(f"the plane only touches {surface.name}: move it a little")
    _refuse_crossing(loops, surface.name)
    return sorted(loops, key=lambda loop: -loop.outline.area)


def _cycles(after: list[int]) -> list[list[int]]:
    seen = [False] * len(after)
    rings = []
    for first in range(len(after)):
        ring = []
        at = first
        while not seen[at]:
            seen[at] = True
            ring.append(at)
            at = after[at]
        if ring:
            rings.append(ring)
    return rings


def _loop(points: Array, name: str) -> CutLoop | None:
    """Return a loop, or None if the plane only touches a corner or an edge."""
    step = np.roll(points, -1, axis=0) - points
    kept = points[np.hypot(step[:, 0], step[:, 1]) > SAME_MM]
    if len(kept) < 3:
        return None
    x, y = kept.T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    if abs(area) < SAME_MM:
        return None
    return CutLoop(outline_through(kept, f"the cut through {name}"), area < 0)


def _refuse_crossing(loops: list[CutLoop], name: str) -> None:
    rings = [shapely.LinearRing(loop.outline.start) for loop in loops]
    for i, j in zip(*shapely.STRtree(rings).query(rings, "intersects"), strict=True):
        if i < j:
            where = shapely.intersection(rings[i], rings[j]).representative_point()
            raise DrawingError(
                f"two of the {len(rings)} curves in the cut through {name} meet at "
                f"({where.x:.4g}, {where.y:.4g}) mm: the surface intersects itself, or the plane "
                "passes an edge; repair the surface or move the plane a little"
            )


def _ascii_triangles(content: bytes, name: str) -> Array:
    corners: list[list[float]] = []
    in_facet = 0
    for at, line in enumerate(content.decode("ascii", "replace").splitlines(), start=1):
        words = line.split()
        keyword = words[0].lower() if words else ""
        if keyword == "vertex":
            corner = [value for word in words[1:] if (value := number(word)) is not None]
            if len(corner) != 3 or len(words) != 4:
                raise DrawingError(
                    f"{name}, line {at}: {quoted(line.strip())} is no corner of three numbers: "
                    "export the file again"
                )
            corners.append(corner)
            in_facet += 1
        elif keyword == "endfacet":
            if in_facet != 3:
                raise DrawingError(
                    f"{name}, line {at}: a facet with {in_facet} corners: export the file again"
                )
            in_facet = 0
        elif keyword not in ("", "solid", "facet", "outer", "endloop", "endsolid"):
            raise DrawingError(
                f"{name}, line {at}: {quoted(keyword)} is not a word of STL: export the file again"
            )
    if in_facet:
        raise DrawingError(f"{name} ends within a facet: the file is cut short")
    return np.array(corners, float).reshape(-1, 3, 3)
