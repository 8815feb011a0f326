"""Scenes for the virtual camera: flat coloured bodies with markers that move in the world plane."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.rigid import RigidMotion
from mocap.stickers.codes import CELLS, MARGIN_CELLS, code_of
from mocap.synthetic.camera import Colour, SyntheticError, axis_angle_matrix

Array = NDArray[np.float64]

BLACK: Colour = (0.04, 0.04, 0.05)
WHITE: Colour = (0.93, 0.93, 0.91)


@dataclass(frozen=True, eq=False)
class ScenePolygon:
    """A flat coloured polygon of a body.

    Parameters
    ----------
    corners_mm
        (n, 2) corners in the body's own coordinates, mm; simple polygon, either orientation.
    colour
        Red, green, blue as displayed, 0...1.
    opacity
        1 covers everything behind it, 0 is invisible.
    softness_mm
        Standard deviation of the blur of the edge, mm; for shades, not for markers.
    depth_mm
        Height above the world plane, towards the camera, mm.
    name, inside
        Name of the shape, and name of an earlier shape of the body that confines it.
    """

    corners_mm: Array
    colour: Colour
    opacity: float = 1.0
    softness_mm: float = 0.0
    depth_mm: float = 0.0
    name: str = ""
    inside: str | None = None

    def __post_init__(self) -> None:
        corners = np.array(self.corners_mm, float)
        if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
            raise SyntheticError(
                f"shape {self.name!r} has corners of shape {corners.shape}: give at least three "
                "corners as (n, 2)"
            )
        if not np.isfinite(corners).all():
            raise SyntheticError(f"shape {self.name!r} has a corner that is not a finite number")
        corners.setflags(write=False)
        object.__setattr__(self, "corners_mm", corners)


@dataclass(frozen=True)
class Marker:
    """A named point of a body and the shapes that make it visible.

    The class methods make the usual kinds; ``at_mm`` is the point that a tracker has to find.
    """

    name: str
    at_mm: tuple[float, float]
    shapes: tuple[ScenePolygon, ...]
    depth_mm: float = 0.0

    @classmethod
    def dot(
        cls,
        name: str,
        at_mm: tuple[float, float],
        *,
        radius_mm: float,
        colour: Colour = BLACK,
        depth_mm: float = 0.0,
    ) -> Marker:
        """Return a disc."""
        return cls(name, at_mm, (disc(at_mm, radius_mm, colour, depth_mm),), depth_mm)

    @classmethod
    def ring(
        cls,
        name: str,
        at_mm: tuple[float, float],
        *,
        radii_mm: tuple[float, float],
        colours: tuple[Colour, Colour] = (BLACK, WHITE),
        depth_mm: float = 0.0,
    ) -> Marker:
        """Return a disc of the outer radius with a disc of the inner radius in the other colour."""
        outer = disc(at_mm, radii_mm[0], colours[0], depth_mm)
        inner = disc(at_mm, radii_mm[1], colours[1], depth_mm)
        return cls(name, at_mm, (outer, inner), depth_mm)

    @classmethod
    def patch(
        cls,
        name: str,
        at_mm: tuple[float, float],
        *,
        side_mm: float = 10.0,
        radius_mm: float = 2.5,
        turn_deg: float = 0.0,
        colours: tuple[Colour, Colour] = (WHITE, BLACK),
        depth_mm: float = 0.0,
    ) -> Marker:
        """Return a square sticker, turned by an angle, with a dot in its centre."""
        angle = np.radians(turn_deg + 45 + 90 * np.arange(4))
        square = np.column_stack([np.cos(angle), np.sin(angle)]) * side_mm / np.sqrt(2) + at_mm
        sticker = ScenePolygon(square, colours[0], depth_mm=depth_mm)
        return cls(name, at_mm, (sticker, disc(at_mm, radius_mm, colours[1], depth_mm)), depth_mm)

    @classmethod
    def coded(
        cls,
        name: str,
        at_mm: tuple[float, float],
        *,
        side_mm: float = 12.0,
        turn_deg: float = 0.0,
        colours: tuple[Colour, Colour] = (WHITE, BLACK),
        depth_mm: float = 0.0,
    ) -> Marker:
        """Return the coded sticker of a standard marker, turned counter-clockwise by an angle."""
        cell = side_mm / CELLS
        half = side_mm / 2
        angle = np.radians(turn_deg)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

        def rectangle(left: float, bottom: float, width: float, height: float) -> Array:
            corners = np.array([[0, 0], [width, 0], [width, height], [0, height]])
            return np.asarray((corners + np.array([left, bottom])) @ turn.T + at_mm)

        whole = half + MARGIN_CELLS * cell
        paper = ScenePolygon(
            rectangle(-whole, -whole, 2 * whole, 2 * whole), colours[0], depth_mm=depth_mm
        )
        square = ScenePolygon(
            rectangle(-half, -half, side_mm, side_mm), colours[1], depth_mm=depth_mm
        )
        light = [
            ScenePolygon(
                rectangle(
                    -half + first * cell, half - (row + 1) * cell, (last - first) * cell, cell
                ),
                colours[0],
                depth_mm=depth_mm,
            )
            for row, cells in enumerate(~code_of(name, side_mm).dark)
            for first, last in _runs(cells)
        ]
        return cls(name, at_mm, (paper, square, *light), depth_mm)


@dataclass(frozen=True, eq=False)
class OutOfPlane:
    """Turn of a body out of the world plane and its motion in depth, linear between instants.

    Parameters
    ----------
    time_s
        (n,) increasing times, s.
    turn_deg
        (n, 2) rotation about the world's x and y, an axis-angle vector, degrees. It follows the
        rotation in the plane and leaves the pivot in place.
    depth_mm
        (n,) displacement towards the camera, mm.
    pivot_mm
        (x, y) of the pivot in the body's own coordinates and its height above the plane, mm.
    """

    time_s: Array
    turn_deg: Array
    depth_mm: Array
    pivot_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def turn_at(self, time_s: float) -> Array:
        """Return the rotation (2,) at a time, degrees."""
        return np.array([np.interp(time_s, self.time_s, self.turn_deg[:, k]) for k in (0, 1)])

    def depth_at(self, time_s: float) -> float:
        """Return the displacement in depth at a time, mm."""
        return float(np.interp(time_s, self.time_s, self.depth_mm))


@dataclass(frozen=True)
class SceneBody:
    """Shapes and markers that move together; later ones cover earlier ones."""

    name: str
    motion: RigidMotion
    shapes: tuple[ScenePolygon, ...] = ()
    markers: tuple[Marker, ...] = ()
    out_of_plane: OutOfPlane | None = None

    def placed(
        self, points_mm: ArrayLike, depth_mm: ArrayLike, time_s: float
    ) -> tuple[Array, Array]:
        """Return where points of the body are at a time: (n, 2) in the plane and (n,) depth, mm."""
        placement = self.motion.at(time_s)
        plane = placement.apply(points_mm)
        depth = np.broadcast_to(np.asarray(depth_mm, float), plane.shape[:-1])
        if self.out_of_plane is None:
            return plane, depth
        x, y, height = self.out_of_plane.pivot_mm
        pivot = np.append(placement.apply((x, y)), height)
        turn = axis_angle_matrix(np.radians([*self.out_of_plane.turn_at(time_s), 0.0]))
        turned = (np.concatenate([plane, depth[..., None]], axis=-1) - pivot) @ turn.T + pivot
        return turned[..., :2], turned[..., 2] + self.out_of_plane.depth_at(time_s)

    def all_shapes(self) -> tuple[ScenePolygon, ...]:
        """Return all shapes in order; those of the markers are last."""
        return self.shapes + tuple(s for marker in self.markers for s in marker.shapes)


@dataclass(frozen=True)
class Light:
    """Uneven and flickering light.

    Parameters
    ----------
    slope
        Relative change of the light from one edge of the picture to the other (right, down).
    flicker, flicker_hz
        Relative amplitude and frequency of a sinusoidal flicker (mains light: 100 or 120 Hz).
    """

    slope: tuple[float, float] = (0.0, 0.0)
    flicker: float = 0.0
    flicker_hz: float = 100.0


@dataclass(frozen=True)
class Scene:
    """Bodies before a background; later bodies occlude earlier ones."""

    bodies: tuple[SceneBody, ...]
    background: Colour = (0.72, 0.75, 0.77)
    light: Light = field(default_factory=Light)

    def __post_init__(self) -> None:
        names = [marker.name for body in self.bodies for marker in body.markers]
        doubled = sorted({name for name in names if names.count(name) > 1})
        if doubled:
            raise SyntheticError(f"marker {doubled[0]!r} occurs twice: give every marker one name")


def disc(
    centre_mm: tuple[float, float], radius_mm: float, colour: Colour, depth_mm: float = 0.0
) -> ScenePolygon:
    """Return a disc as a polygon of 96 corners with the area of the circle."""
    angle = 2 * np.pi * np.arange(96) / 96
    radius = radius_mm * np.sqrt(2 * np.pi / (96 * np.sin(2 * np.pi / 96)))
    corners = np.column_stack([np.cos(angle), np.sin(angle)]) * radius + centre_mm
    return ScenePolygon(corners, colour, depth_mm=depth_mm)


def _runs(marked: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first index and end of each run of marked cells (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
