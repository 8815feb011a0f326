"""How near a moving neck comes to points of a lip."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem2d.body.surface import Surface
from geometry2d.anatomy.head import HeadSection
from geometry2d.neck import NeckSection
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion, RigidPlacement
from scenarios.results.quantities import LIPS

Array = NDArray[np.float64]

BORE_RADIUS_MM = 0.1
"""Radius of the corners of the bore's outline."""

INSTANTS = 200
"""Of a motion, at which the distance of neck and lips is looked at."""

EVERY = 12
"""The distance of one point of the skin in so many bounds the distances of its neighbours."""


@dataclass(frozen=True)
class Approach:
    """How a neck comes near the lips at rest and leaves them; computed when it is asked for.

    Attributes
    ----------
    head, neck
        The sections, each in its own frame.
    motion
        Of the neck in the frame of the head section.
    """

    head: HeadSection
    neck: NeckSection
    motion: RigidMotion

    @cached_property
    def time_s(self) -> Array:
        """(n,) instants from the first sample of the motion to the last, s."""
        return np.linspace(self.motion.time_s[0], self.motion.time_s[-1], INSTANTS)

    @cached_property
    def placements(self) -> list[RigidPlacement]:
        """Where the neck is at each instant."""
        return [self.motion.at(float(time)) for time in self.time_s]

    @cached_property
    def gaps_mm(self) -> dict[str, Array]:
        """(n,) smallest distance of each lip's undeformed skin from the neck, mm, by lip."""
        return {lip: gaps_mm(self.head, self.neck, self.placements, lip) for lip in LIPS}


@dataclass(frozen=True)
class MovingNeck:
    """A neck at several placements.

    Attributes
    ----------
    outlines
        Its walls and the bore between them, in its own frame: a lip that hangs into the opening is
        not clear of it.
    placements
        In the head section.
    """

    outlines: tuple[Outline, ...]
    placements: Sequence[RigidPlacement]

    @classmethod
    def of(cls, neck: NeckSection, placements: Sequence[RigidPlacement]) -> MovingNeck:
        """Return a neck with its bore."""
        return cls((neck.upper_wall, neck.lower_wall, _bore(neck)), placements)

    def near(self, points: Array, reach_mm: float) -> NDArray[np.bool_]:
        """Return at which placements which points (t, p) can be nearer than a distance, mm."""
        bounds = _distance_from_boxes(self._in_neck_frame(points), self.outlines)
        near: NDArray[np.bool_] = bounds.min(axis=0) < reach_mm
        return near

    def only(self, placements: NDArray[np.intp]) -> MovingNeck:
        """Return the neck at some of its placements."""
        return replace(self, placements=[self.placements[k] for k in placements])

    def clearance(self, points: Array) -> float:
        """Return the smallest distance, mm, of points (p, 2) at any placement; inf without any."""
        if not self.placements or len(points) == 0:
            return np.inf
        local = self._in_neck_frame(points)
        nearest = np.inf
        bounds = _distance_from_boxes(local, self.outlines)
        for outline, bound in zip(self.outlines, bounds, strict=True):
            # The box is a lower bound: points farther from it than the nearest distance so far
            # cannot be nearer.
            first = np.unravel_index(np.argmin(bound), bound.shape)
            nearest = min(nearest, float(outline.project(local[first]).distance[0]))
            close = bound <= max(nearest, 0.0)
            nearest = float(np.min(outline.project(local[close]).distance, initial=nearest))
        return nearest

    def _in_neck_frame(self, points: Array) -> Array:
        """Return points (p, 2) in the neck's frame at each placement (t, p, 2)."""
        local = np.array([place.pull_back(points) for place in self.placements])
        return local.reshape(-1, len(points), 2)


@dataclass(frozen=True)
class PathClearance:
    """How near a neck comes to a lip on its path, at any displacement of the lip.

    Attributes
    ----------
    neck
        Where it can come near the undeformed lip.
    skin
        Free surface of the lip.
    reachable
        (p,) which points of the skin it can come near to.
    """

    neck: MovingNeck
    skin: Surface
    reachable: NDArray[np.bool_]

    @classmethod
    def of(cls, skin: Surface, neck: MovingNeck, reach_mm: float) -> PathClearance:
        """Return the clearance from a neck of the skin that it comes so near to at rest, mm."""
        undeformed = skin.positions(np.zeros_like(skin.nodes)).reshape(-1, 2)
        near = neck.near(undeformed, reach_mm)
        at = np.flatnonzero(near.any(axis=1))
        return cls(neck.only(at), skin, np.asarray(near.any(axis=0)))

    def __call__(self, displacement: Array) -> float:
        """Return the distance of the neck's path from the lip at a displacement (n, 2), mm."""
        points = self.skin.positions(displacement).reshape(-1, 2)[self.reachable]
        return self.neck.clearance(points)


def held_times(held_s: Iterable[tuple[float, float]], instants: int) -> Array:
    """Return instants of each interval in which a lip is held, s."""
    return np.concatenate([np.linspace(start, end, instants) for start, end in held_s])


def _distance_from_boxes(local: Array, outlines: tuple[Outline, ...]) -> Array:
    """Return the distance (o, t, p), mm, of points (t, p, 2) from the outlines' boxes, 0 inside."""
    distances = []
    for left, bottom, right, top in (outline.box for outline in outlines):
        beside = np.maximum(np.maximum(left - local[..., 0], local[..., 0] - right), 0.0)
        above = np.maximum(np.maximum(bottom - local[..., 1], local[..., 1] - top), 0.0)
        distances.append(np.hypot(beside, above))
    return np.array(distances)


def gaps_mm(
    head: HeadSection, neck: NeckSection, places: Sequence[RigidPlacement], lip: str
) -> Array:
    """Return the smallest distance (n,) of a lip's undeformed skin from the neck, mm.

    A distance changes by no more than the way between two points, so most points of the skin
    cannot be the nearest once the distance of a few is known.
    """
    skin = getattr(head, lip).curves["skin"]
    known = np.arange(0, len(skin), EVERY)
    nearest = np.minimum((np.arange(len(skin)) + EVERY // 2) // EVERY, len(known) - 1)
    away = np.hypot(*(skin - skin[known[nearest]]).T)
    local = np.stack([place.pull_back(skin) for place in places])
    gap = _gap(neck, local[:, known])
    smallest: Array = gap.min(axis=1)
    wanted = gap[:, nearest] - away < smallest[:, None]
    wanted[:, known] = False
    which, _ = np.nonzero(wanted)
    np.minimum.at(smallest, which, _gap(neck, local[wanted]))
    return smallest


def _gap(neck: NeckSection, points: Array) -> Array:
    """Return the distances (…) of points (…, 2) in the neck's frame from its walls, mm."""
    flat = points.reshape(-1, 2)
    walls = (neck.upper_wall, neck.lower_wall)
    distance: Array = np.min([wall.project(flat).distance for wall in walls], axis=0)
    return distance.reshape(points.shape[:-1])


def _bore(neck: NeckSection) -> Outline:
    """Return the outline of the opening between the walls."""
    left, low, right, lower_top = neck.lower_wall.box
    upper_bottom, high = neck.upper_wall.box[1], neck.upper_wall.box[3]
    bottom, top = 0.5 * (low + lower_top), 0.5 * (upper_bottom + high)
    corners = [(left, bottom), (right, bottom), (right, top), (left, top)]
    return Outline.from_corners(corners, BORE_RADIUS_MM)
