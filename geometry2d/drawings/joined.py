"""Chains of one name are joined at their ends to an outline, or to an open curve."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from geometry2d.drawings.chains import LARGEST_MM, Chain, DrawingError, spot
from geometry2d.foundation.text import quoted
from geometry2d.outline import Outline, OutlineError

Array = NDArray[np.float64]

JOIN_MM = 1e-3
"""Ends nearer than this are one point, mm: files hold rounded numbers."""

LONGEST_MM = 5e3
"""Largest length of a curve of a head or a neck, mm."""


class NamedOutline(NamedTuple):
    """A closed curve of a drawing, mm, counter-clockwise whatever its direction in the drawing."""

    name: str
    outline: Outline


def closed_outlines(chains: Iterable[Chain], *, join_mm: float = JOIN_MM) -> list[NamedOutline]:
    """Return the outlines that chains form; chains of one name are joined at their ends.

    Raises
    ------
    DrawingError
        If a curve is open, branches, crosses itself or is too large.
    """
    by_name: dict[str, list[Chain]] = {}
    for chain in chains:
        if len(chain.curvature):
            _refuse_size(chain)
            by_name.setdefault(chain.name, []).append(chain)
    return [
        NamedOutline(name, _outline(ring, join_mm))
        for name, parts in by_name.items()
        for ring in _rings(name, parts, join_mm)
    ]


def open_curve(name: str, parts: Sequence[Chain], *, join_mm: float = JOIN_MM) -> Chain:
    """Return the open curve that chains form, joined at their ends.

    Raises
    ------
    DrawingError
        If they form a closed curve, none, or several pieces, or branch.
    """
    parts = [part for part in parts if len(part.curvature)]
    for part in parts:
        _refuse_size(part)
    ends = np.array([p for part in parts for p in (part.points[0], part.points[-1])])
    partner = _meetings(name, ends, join_mm)
    loose = [i for i, other in enumerate(partner) if other is None]
    if len(loose) != 2:
        raise DrawingError(
            f"{quoted(name)} has {len(loose)} loose ends where one open curve has two: "
            "draw it as a single line that is not closed"
        )
    ordered: list[Chain] = []
    entry: int | None = loose[0]
    while entry is not None:
        part = parts[entry // 2]
        ordered.append(part if entry % 2 == 0 else part.backwards())
        entry = partner[entry ^ 1]
    if len(ordered) < len(parts):
        raise DrawingError(f"{quoted(name)} has a closed curve beside the open one: delete it")
    return Chain.of(name, ordered)


def outline_through(points: ArrayLike, name: str) -> Outline:
    """Return the counter-clockwise polygon through points (n, 2), mm; ``name`` is for messages."""
    p = np.asarray(points, float)
    return _outline(Chain.through(name, np.concatenate([p, p[:1]])), 0.0)


def centre_of(mark: Outline) -> Array:
    """Return the centroid (2,), mm, of a mark."""
    centre = shapely.Polygon(mark.sampled(mark.length / 360)).centroid
    return np.array([centre.x, centre.y])


def _rings(name: str, parts: list[Chain], join_mm: float) -> list[Chain]:
    """Return closed chains, each joined from chains whose ends meet."""
    rings = [part for part in parts if _closed(part, join_mm)]
    loose = [part for part in parts if not _closed(part, join_mm)]
    ends = np.array([p for part in loose for p in (part.points[0], part.points[-1])])
    partner = _partners(name, ends, join_mm)
    used = np.zeros(len(loose), bool)
    for first in range(len(loose)):
        if used[first]:
            continue
        ring: list[Chain] = []
        entry = 2 * first
        while not used[entry // 2]:
            used[entry // 2] = True
            part = loose[entry // 2]
            ring.append(part if entry % 2 == 0 else part.backwards())
            entry = partner[entry ^ 1]
        rings.append(Chain.of(name, ring))
    return rings


def _meetings(name: str, ends: Array, join_mm: float) -> list[int | None]:
    """Return for each of the ends (n, 2) the one that meets it, if any."""
    if len(ends) == 0:
        return []
    # A third end that is as near as the second, or nearer, makes a branch: no more are needed.
    near = cKDTree(ends).query(ends, k=range(1, 5), distance_upper_bound=2 * join_mm)[1]
    partner: list[int | None] = []
    for i, candidates in enumerate(near):
        others = candidates[(candidates != i) & (candidates < len(ends))]
        met = others[np.hypot(*(ends[others] - ends[i]).T) <= join_mm]
        if len(met) > 1:
            count = np.count_nonzero(np.hypot(*(ends - ends[i]).T) <= join_mm)
            raise DrawingError(
                f"{quoted(name)} branches at {spot(ends[i])}: {count} ends meet there; delete "
                "the pieces that do not belong to the outline, or put them on their own layer"
            )
        partner.append(int(met[0]) if len(met) else None)
    return partner


def _partners(name: str, ends: Array, join_mm: float) -> list[int]:
    """Return for each of the ends (n, 2) the one that meets it, or refuse an open curve."""
    partners: list[int] = []
    for i, met in enumerate(_meetings(name, ends, join_mm)):
        if met is None:
            distance = np.hypot(*(ends - ends[i]).T)
            distance[i] = np.inf
            nearest = int(np.argmin(distance))
            raise DrawingError(
                f"{quoted(name)} is open: its end at {spot(ends[i])} is "
                f"{distance[nearest]:.4g} mm from the next, at {spot(ends[nearest])}; close the "
                "curve in the drawing"
            )
        partners.append(met)
    return partners


def _closed(chain: Chain, join_mm: float) -> bool:
    return bool(np.hypot(*(chain.points[-1] - chain.points[0])) <= join_mm)


def _outline(ring: Chain, join_mm: float) -> Outline:
    start = ring.points[:-1]
    step = np.roll(start, -1, axis=0) - start
    kept = np.hypot(step[:, 0], step[:, 1]) > join_mm
    start, curvature = start[kept], ring.curvature[kept]
    if len(start) < 2 or (len(start) == 2 and not np.any(curvature)):
        raise DrawingError(
            f"{quoted(ring.name)} at {spot(ring.points[0])} encloses nothing: delete it, or draw "
            "it as a closed curve"
        )
    try:
        if _signed_area(start, curvature) < 0:
            start, curvature = np.roll(start[::-1], 1, axis=0), -curvature[::-1]
        return Outline(start, curvature)
    except OutlineError as error:
        where = shapely.is_valid_reason(shapely.Polygon(start)) if len(start) > 2 else ""
        raise DrawingError(f"{quoted(ring.name)}: {error} ({where})") from error


def _signed_area(start: Array, curvature: Array) -> float:
    x, y = start.T
    chord = np.hypot(*(np.roll(start, -1, axis=0) - start).T)
    half = np.arcsin(np.clip(0.5 * chord * curvature, -1, 1))
    bent = curvature != 0
    caps = (half[bent] - 0.5 * np.sin(2 * half[bent])) / curvature[bent] ** 2
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) + np.sum(caps))


def _refuse_size(chain: Chain) -> None:
    if not np.all(np.abs(chain.points) <= LARGEST_MM) or not np.all(np.isfinite(chain.curvature)):
        raise DrawingError(
            f"{quoted(chain.name)} reaches farther than {LARGEST_MM:g} mm from the origin: check "
            "the unit of the file and move the drawing to the origin"
        )
    chord = np.hypot(*np.diff(chain.points, axis=0).T)
    half = np.arcsin(np.clip(0.5 * chord * np.abs(chain.curvature), 0, 1))
    arc = np.divide(2 * half, np.abs(chain.curvature), out=chord, where=chain.curvature != 0)
    if float(np.sum(arc)) > LONGEST_MM:
        raise DrawingError(
            f"{quoted(chain.name)} is {1e-3 * np.sum(arc):.3g} m long: check the unit of the file, "
            "or simplify the curve"
        )
