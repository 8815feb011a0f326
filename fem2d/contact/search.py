"""Search for what the points of deformable surfaces meet along their normals.

A ray along the outward normal of each point is intersected with the other edges. Edges are arrays
(m, k, 2) of the deformed positions of their nodes: first, last and, on quadratic edges, middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from geometry2d.compiled import compiled
from geometry2d.foundation.settings import setting

Array = NDArray[np.float64]
Index = NDArray[np.intp]

NONE = -1
"""No edge is met."""

GROUP = 16
"""Number of consecutive edges in one bounding box, which is tested before the edges' own boxes."""


@dataclass(frozen=True)
class SearchSettings:
    """How surfaces are searched for, and how the place where contact begins is found.

    Parameters
    ----------
    entry_trials
        Trials of false position for the place where a point enters what it meets within a step; the
        first is exact if the gap changes linearly.
    facing_cosine
        Deformable surfaces face each other if the cosine between their outward normals is below.
    behind_mm
        An edge that lay farther than this behind a point at the committed instant, mm, and farther
        than the deepest penetration of the point's edge, is the other side of the same tissue.
    sharpest_tip_rad
        Two edges that share a node enclose tissue if its angle is larger, rad; otherwise they are
        the sides of a crease whose bottom has closed a little too far.
    shortest_segment
        Segments shorter than this share of an edge get no points.
    """

    entry_trials: int = setting(
        default=3,
        minimum=1,
        maximum=50,
        description="trials of false position for where a point enters what it meets in a step",
    )
    facing_cosine: float = setting(
        default=-0.25,
        minimum=-1.0,
        maximum=1.0,
        description="surfaces face each other if the cosine between their normals is below",
    )
    behind_mm: float = setting(
        default=0.05,
        unit="mm",
        above=0.0,
        description="an edge farther behind a point is the other side of its tissue",
    )
    sharpest_tip_rad: float = setting(
        default=0.25,
        unit="rad",
        minimum=0.0,
        maximum=3.0,
        description="adjacent edges enclose tissue if its angle is larger",
    )
    shortest_segment: float = setting(
        default=1e-7,
        above=0.0,
        maximum=0.1,
        description="shortest segment of an edge that is integrated, over the edge",
    )


DEFAULT_SEARCH = SearchSettings()


class Sides(NamedTuple):
    """The members of a `SelfContact` that the kernels need.

    Attributes
    ----------
    edges
        (m, k) node indices of all surfaces' edges.
    owner
        (m,) which surface each edge belongs to.
    reach_mm
        Distance from a surface within which others are searched for, mm.
    same_surface
        Whether a surface may touch itself.
    entry_trials, facing_cosine, behind_mm, sharpest_tip_rad, shortest_segment
        As of `SearchSettings`.
    """

    edges: Index
    owner: Index
    reach_mm: float
    same_surface: bool
    entry_trials: int
    facing_cosine: float
    behind_mm: float
    sharpest_tip_rad: float
    shortest_segment: float


@compiled
def edge_point(deformed: Array, e: int, local: float) -> tuple[float, float, float, float]:
    """Return position and outward normal of a point on one of the edges (m, k, 2)."""
    if deformed.shape[1] == 2:
        middle, n0, n1, nm = 0, 1.0 - local, local, 0.0
        d0, d1, dm = -1.0, 1.0, 0.0
    else:
        middle, n0, n1 = 2, (1.0 - local) * (1.0 - 2.0 * local), local * (2.0 * local - 1.0)
        nm = 4.0 * local * (1.0 - local)
        d0, d1, dm = 4.0 * local - 3.0, 4.0 * local - 1.0, 4.0 - 8.0 * local
    x = n0 * deformed[e, 0, 0] + n1 * deformed[e, 1, 0] + nm * deformed[e, middle, 0]
    y = n0 * deformed[e, 0, 1] + n1 * deformed[e, 1, 1] + nm * deformed[e, middle, 1]
    along_x = d0 * deformed[e, 0, 0] + d1 * deformed[e, 1, 0] + dm * deformed[e, middle, 0]
    along_y = d0 * deformed[e, 0, 1] + d1 * deformed[e, 1, 1] + dm * deformed[e, middle, 1]
    speed = np.sqrt(along_x * along_x + along_y * along_y)
    return x, y, along_y / speed, -along_x / speed


@compiled
def _runs_back(deformed: Array, e: int, nx: float, ny: float) -> bool:
    """Whether an edge runs from its last node towards its first one where its normal is this.

    A quadratic one does where it is squeezed so much that its middle lies beyond one of its ends.
    What seems to be its outward normal points into the tissue there, and the edge touches nothing.
    """
    along_x, along_y = deformed[e, 1, 0] - deformed[e, 0, 0], deformed[e, 1, 1] - deformed[e, 0, 1]
    back: bool = along_y * nx - along_x * ny <= 0.0
    return back


@compiled
def _boxes(deformed: Array) -> tuple[Array, Array]:
    """Return boxes (left, bottom, right, top) around edges (m, k, 2), and around groups of them."""
    count, k = deformed.shape[0], deformed.shape[1]
    boxes = np.empty((count, 4))
    groups = np.empty(((count + GROUP - 1) // GROUP, 4))
    groups[:, :2], groups[:, 2:] = np.inf, -np.inf
    for e in range(count):
        group = groups[e // GROUP]
        for c in range(2):
            least, most = deformed[e, 0, c], deformed[e, 0, c]
            for a in range(1, k):
                least, most = min(least, deformed[e, a, c]), max(most, deformed[e, a, c])
            # A quadratic edge may leave the box of its nodes by an eighth of its size.
            spare = 0.125 * (most - least)
            boxes[e, c], boxes[e, 2 + c] = least - spare, most + spare
            group[c] = min(group[c], boxes[e, c])
            group[2 + c] = max(group[2 + c], boxes[e, 2 + c])
    return boxes, groups


@compiled
def _nearer(one: Array, other: Array, reach: float) -> bool:
    """Whether two boxes are nearer to each other than ``reach`` in both directions."""
    near: bool = (
        one[0] - other[2] <= reach
        and other[0] - one[2] <= reach
        and one[1] - other[3] <= reach
        and other[1] - one[3] <= reach
    )
    return near


@compiled
def _within_reach(home: int, boxes: Array, groups: Array, sides: Sides, found: Index) -> int:
    """Write the edges that the edge ``home`` may reach, ascending; return how many they are."""
    count = 0
    for group in range(len(groups)):
        if not _nearer(groups[group], boxes[home], sides.reach_mm):
            continue
        for e in range(group * GROUP, min((group + 1) * GROUP, len(boxes))):
            if e == home or (sides.owner[e] == sides.owner[home] and not sides.same_surface):
                continue
            if _nearer(boxes[e], boxes[home], sides.reach_mm):
                found[count] = e
                count += 1
    return count


@compiled
def meetings(
    edge: Index, local: Array, deformed: Array, before: Array, depth: Array, sides: Sides
) -> tuple[Array, Index, Array, Array]:
    """Return each point's normal, and edge, local coordinate and gap of what its ray meets.

    The edges' nodes are at ``deformed`` (m, k, 2); ``before`` and ``depth`` are those of the
    history.
    """
    count = len(edge)
    normal = np.empty((count, 2))
    met, met_local, gap = np.full(count, NONE), np.zeros(count), np.full(count, np.inf)
    boxes, groups = _boxes(deformed)
    near, near_count, home = np.empty(len(deformed), np.intp), 0, NONE
    for i in range(count):
        # Points of one edge follow one another.
        if edge[i] != home:
            home = edge[i]
            near_count = _within_reach(home, boxes, groups, sides, near)
        x, y, nx, ny = edge_point(deformed, home, local[i])
        normal[i, 0], normal[i, 1] = nx, ny
        if _runs_back(deformed, home, nx, ny):
            continue
        met[i], met_local[i], gap[i] = _nearest(
            x, y, nx, ny, home, local[i], near, near_count, deformed, before, depth[home], sides
        )
    return normal, met, met_local, gap


@compiled
def _nearest(
    x: float,
    y: float,
    nx: float,
    ny: float,
    home: int,
    local: float,
    near: Index,
    near_count: int,
    deformed: Array,
    before: Array,
    depth: float,
    sides: Sides,
) -> tuple[int, float, float]:
    """Return edge, local coordinate and gap of what a ray meets nearest to its point, if any."""
    met, met_local, gap = NONE, 0.0, np.inf
    tx, ty = -ny, nx
    behind = sides.behind_mm + depth
    for at in range(near_count):
        e = near[at]
        x0, y0 = deformed[e, 0, 0] - x, deformed[e, 0, 1] - y
        x1, y1 = deformed[e, 1, 0] - x, deformed[e, 1, 1] - y
        c0, c1 = x0 * tx + y0 * ty, x1 * tx + y1 * ty
        if deformed.shape[1] == 3:
            xm, ym = deformed[e, 2, 0] - x, deformed[e, 2, 1] - y
            cm = xm * tx + ym * ty
        else:
            xm, ym, cm = 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (c0 + c1)
        square, linear = 2 * (c0 + c1 - 2 * cm), 4 * cm - 3 * c0 - c1
        for xi in _roots(square, linear, c0):
            if not -1e-10 <= xi <= 1 + 1e-10:
                continue
            n0, n1, nm = (1 - xi) * (1 - 2 * xi), xi * (2 * xi - 1), 4 * xi * (1 - xi)
            d0, d1, dm = 4 * xi - 3, 4 * xi - 1, 4 - 8 * xi
            g = (n0 * x0 + n1 * x1 + nm * xm) * nx + (n0 * y0 + n1 * y1 + nm * ym) * ny
            if abs(g) > sides.reach_mm or abs(g) >= abs(gap):
                continue
            ax, ay = d0 * x0 + d1 * x1 + dm * xm, d0 * y0 + d1 * y1 + dm * ym
            if ax * (x1 - x0) + ay * (y1 - y0) <= 0.0:
                continue  # it runs back there, as in `_runs_back`
            facing = (ay * nx - ax * ny) / np.hypot(ax, ay)
            if facing >= sides.facing_cosine or _form_tip(sides, before, e, home):
                continue
            if g < -behind and _distance_before(before, home, local, e, xi) < -behind:
                continue
            met, met_local, gap = e, xi, g
    return met, met_local, gap


@compiled
def _distance_before(before: Array, home: int, local: float, met: int, met_local: float) -> float:
    """Return how far in front of a point of one edge a place on another was."""
    x, y, nx, ny = edge_point(before, home, local)
    met_x, met_y = edge_point(before, met, met_local)[:2]
    distance: float = (met_x - x) * nx + (met_y - y) * ny
    return distance


@compiled
def first_touches(
    edge: Index,
    local: Array,
    anchor: Index,
    anchor_local: Array,
    met: Index,
    met_local: Array,
    gap: Array,
    before: Array,
    depth: Array,
    after: Array,
    sides: Sides,
) -> tuple[Index, Array]:
    """Return the anchors of points whose nodes (m, k, 2) go straight from ``before`` to ``after``.

    ``met`` and ``gap`` belong to the end. The anchor of a point that is open at first and closed at
    the end becomes what it meets where its gap vanishes; others keep theirs.
    """
    anchor, anchor_local = anchor.copy(), anchor_local.copy()
    near = np.empty(len(before), np.intp)
    _, _, _, beginning = meetings(edge, local, before, before, depth, sides)
    for i in range(len(edge)):
        if gap[i] >= 0.0 or beginning[i] <= 0.0:
            continue
        home = edge[i]
        outside, gap_outside, inside, gap_inside = 0.0, beginning[i], 1.0, gap[i]
        if gap_outside == np.inf:
            # Out of reach at first: use the distance from what it meets in the end.
            x, y, nx, ny = edge_point(before, home, local[i])
            met_x, met_y = edge_point(before, met[i], met_local[i])[:2]
            gap_outside = (met_x - x) * nx + (met_y - y) * ny
            if gap_outside <= 0.0:
                continue
        for _ in range(sides.entry_trials):
            share = outside + (inside - outside) * gap_outside / (gap_outside - gap_inside)
            now = before + share * (after - before)
            boxes, groups = _boxes(now)
            count = _within_reach(home, boxes, groups, sides, near)
            x, y, nx, ny = edge_point(now, home, local[i])
            found, found_local, found_gap = _nearest(
                x, y, nx, ny, home, local[i], near, count, now, before, depth[home], sides
            )
            if found == NONE:
                break
            anchor[i], anchor_local[i] = found, found_local
            if found_gap > 0.0:
                outside, gap_outside = share, found_gap
            else:
                inside, gap_inside = share, found_gap
    return anchor, anchor_local


@compiled
def _roots(square: float, linear: float, constant: float) -> tuple[float, float]:
    """Return the real roots of square ξ² + linear ξ + constant, without cancellation."""
    if abs(square) <= 1e-14 * abs(linear):
        if linear == 0.0:
            return np.inf, np.inf
        return -constant / linear, np.inf
    discriminant = linear * linear - 4 * square * constant
    if discriminant < 0.0:
        return np.inf, np.inf
    half = -0.5 * (linear + np.copysign(np.sqrt(discriminant), linear))
    if half == 0.0:
        return 0.0, np.inf
    return half / square, constant / half


@compiled
def _form_tip(sides: Sides, before: Array, one: int, other: int) -> bool:
    """Whether two edges share a node and enclose tissue there, less than a half turn of it.

    If one of them runs back at that node there is no angle, and they count as enclosing tissue.
    """
    edges = sides.edges
    if edges[one, 1] == edges[other, 0]:
        first, second = one, other
    elif edges[other, 1] == edges[one, 0]:
        first, second = other, one
    else:
        return False
    _, _, nx, ny = edge_point(before, first, 1.0)
    _, _, mx, my = edge_point(before, second, 0.0)
    if _runs_back(before, first, nx, ny) or _runs_back(before, second, mx, my):
        return True
    turned = np.arctan2(nx * my - ny * mx, nx * mx + ny * my)
    tip: bool = 0.0 <= turned < np.pi - sides.sharpest_tip_rad
    return tip


@compiled
def segment_ends(deformed: Array, sides: Sides) -> Array:
    """Return (b, 2): edge and local coordinate where its segments begin and end, unsorted.

    An edge is broken at the normal projections of the other edges' end nodes within reach.
    """
    found = []
    count, k = deformed.shape[0], deformed.shape[1]
    boxes, groups = _boxes(deformed)
    near = np.empty(count, np.intp)
    for e in range(count):
        found.append((float(e), 0.0))
        found.append((float(e), 1.0))
        x0, y0 = deformed[e, 0, 0], deformed[e, 0, 1]
        x1, y1 = deformed[e, 1, 0], deformed[e, 1, 1]
        if k == 3:
            xm, ym = deformed[e, 2, 0], deformed[e, 2, 1]
        else:
            xm, ym = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
        chord = (x1 - x0) ** 2 + (y1 - y0) ** 2
        for other in near[: _within_reach(e, boxes, groups, sides, near)]:
            for end in range(2):
                px, py = deformed[other, end, 0], deformed[other, end, 1]
                s = ((px - x0) * (x1 - x0) + (py - y0) * (y1 - y0)) / chord
                if not -0.5 < s < 1.5:
                    continue
                for _ in range(8):
                    n0, n1, nm = (1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)
                    d0, d1, dm = 4 * s - 3, 4 * s - 1, 4 - 8 * s
                    rx = px - (n0 * x0 + n1 * x1 + nm * xm)
                    ry = py - (n0 * y0 + n1 * y1 + nm * ym)
                    ax, ay = d0 * x0 + d1 * x1 + dm * xm, d0 * y0 + d1 * y1 + dm * ym
                    s += (rx * ax + ry * ay) / (ax * ax + ay * ay)
                if (
                    sides.shortest_segment < s < 1 - sides.shortest_segment
                    and rx * rx + ry * ry < sides.reach_mm * sides.reach_mm
                ):
                    found.append((float(e), s))
    result = np.empty((len(found), 2))
    for i in range(len(found)):
        result[i, 0], result[i, 1] = found[i]
    return result
