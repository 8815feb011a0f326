"""Contact of deformable surfaces with one another and with themselves.

Every surface carries integration points that look along their own outward normal ``n`` for the
other surfaces' deformed edges. Where the ray from ``x_s`` meets an edge at ``x_m(ξ)``,

* the gap is ``g = (x_m − x_s)·n``, with ``(x_m − x_s)·t = 0`` for the point's own tangent ``t``;
* the slip since the last committed instant is ``s = t·(x_s − x_a)``, where ``x_a`` is the material
  point that the ray met then, carried along by the other surface; for a point that the other
  surface first reaches within the step, the material point that it meets when it does.

The point is pushed by ``f = −p n + τ t`` and the place it meets by ``−f``; as the two lie on one
normal, forces cancel, and moments too but for the couple ``τ g``, which vanishes with the
penetration. All surfaces look at each other, and each look counts half. The normal of the point
that looks, unlike the one of the edge it meets, never jumps: on quadratic edges both gap and
direction are continuous where a point passes from edge to edge, so nothing chatters there (Puso and
Laursen 2004 argue likewise for mortar methods).

Integration is by segments: the ends of the other surfaces' edges are projected onto each edge and
Gauss points are put between them, so that forces on both sides are integrated exactly where the
surfaces are flat, and non-matching meshes pass the patch test. Segments and points are chosen at
committed instants and stand still during an increment; with their weights and the tractions they
remember they are the history.

A ray is followed backwards too, for what has gone through the surface lies behind it. So does the
other side of the tissue itself, where a fold or a tongue of it is thin. What tells them apart is
where they were at the committed instant: what has come through lay in front then.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fem2d.body.surface import Surface, edge_shapes
from fem2d.contact.laws import FrictionLaw, NormalLaw, pressure_of_gap, traction_of_slip
from fem2d.contact.rigid import ENTRY_TRIALS
from geometry2d.compiled import compiled
from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]
Index = NDArray[np.intp]

FACING_COSINE = -0.25
"""Surfaces face each other if the cosine between their outward normals is below this."""

BEHIND_MM = 0.05
"""What lay farther than this behind a point at a committed instant, mm, and farther than anything
that had come through its edge, is the other side of its own tissue."""

SHARPEST_TIP_RAD = 0.25
"""Two edges that share a node and enclose so little tissue or less do not: they are the sides of a
crease whose bottom has closed a little too far."""

SHORTEST_SEGMENT = 1e-7
"""Segments shorter than this share of an edge get no points."""

NONE = -1
"""No edge is met."""

GROUP = 16
"""So many edges that follow one another have a common box, looked at before each one's own."""


class SelfContactError(DrinksimError):
    """Deformable surfaces were put together in a way that makes no sense."""


@dataclass(frozen=True)
class SelfContactHistory:
    """Integration points chosen at a committed instant, and what friction remembers of them.

    Attributes
    ----------
    edge, local, weight
        (p,) edge that carries each point, local coordinate on it, reference area, mm², halved
        because the other side looks back.
    anchor, anchor_local
        (p,) edge and local coordinate on it from which slip is counted: what the point's ray met at
        the committed instant, −1 for none; in a step in which the point first touches, what it
        meets then.
    traction
        (p,) tangential traction, MPa, positive along the carrying edge.
    places
        (m, k, 2) positions of the edges' nodes at the committed instant, mm.
    depth
        (m,) how far at most another surface had come through each edge then, mm.
    """

    edge: Index
    local: Array
    weight: Array
    anchor: Index
    anchor_local: Array
    traction: Array
    places: Array
    depth: Array


@dataclass(frozen=True)
class SelfContactPoints:
    """Everything known at the integration points, arrays (p,) unless stated.

    Pressure and shear are per reference length of the surface that carries the point.
    """

    gap: Array
    """mm; infinite where nothing is met within reach."""
    met_edge: Index
    met_local: Array
    normal: Array
    """(p, 2) outward normal of the carrying surface."""
    pressure: Array
    shear: Array
    slipping: NDArray[np.bool_]
    pressure_slope: Array
    """d pressure/d gap, MPa/mm."""
    shear_by_slip: Array
    shear_by_pressure: Array


@dataclass(frozen=True)
class SelfContactResponse:
    """Contact forces of deformable surfaces at one trial state.

    Attributes
    ----------
    energy
        Energy stored in the normal penalty, N mm.
    touching
        (j,) points that touch; the arrays below belong to them.
    dofs, force
        (j, 6k) unknowns of the carrying, the met and the anchoring edge, and forces on them, N.
    points
        Values at all integration points.
    """

    energy: float
    touching: Index
    dofs: Index
    force: Array
    points: SelfContactPoints
    pair: SelfContact = field(repr=False)
    displacement: Array = field(repr=False)
    before: SelfContactHistory = field(repr=False)

    @cached_property
    def history(self) -> SelfContactHistory:
        """Trial history: commit it by handing it to the next increment."""
        return self.pair.next_history(self)


class _Sides(NamedTuple):
    """What kernels know of a `SelfContact`, which has these under the same names."""

    edges: Index
    owner: Index
    reach_mm: float
    itself: bool


@dataclass(frozen=True)
class SelfContact:
    """Deformable surfaces of one body (in however many pieces) that may touch.

    Parameters
    ----------
    name
        What reports call this contact.
    surfaces
        Who may touch whom: each surface all the others, and itself if ``itself`` is set.
    normal, friction
        The laws.
    reach_mm
        How far from a surface others are looked for, outside and inside, mm: more than any
        penetration.
    itself
        Whether a surface may touch itself, as in a crease.
    """

    name: str
    surfaces: tuple[Surface, ...]
    normal: NormalLaw
    friction: FrictionLaw
    reach_mm: float
    itself: bool = False
    edges: Index = field(init=False, repr=False, compare=False)
    """(m, k) node indices of all surfaces' edges."""
    owner: Index = field(init=False, repr=False, compare=False)
    """(m,) which surface each edge belongs to."""
    start: Array = field(init=False, repr=False, compare=False)
    """(m,) reference arc length along its surface at which each edge starts, mm."""
    length: Array = field(init=False, repr=False, compare=False)
    """(m,) reference length of each edge, mm."""
    moving: bool = field(default=False, init=False)
    """Nothing here follows the prescribed motion by itself."""

    def __post_init__(self) -> None:
        if not self.reach_mm > 0:
            raise SelfContactError(
                f"contact {self.name!r}: reach_mm = {self.reach_mm} must be positive"
            )
        if len(self.surfaces) < 2 - self.itself:
            raise SelfContactError(
                f"contact {self.name!r} of one surface with nothing: give a second one, or set "
                "itself=True"
            )
        first = self.surfaces[0]
        for surface in self.surfaces:
            if surface.nodes is not first.nodes or surface.edges.shape[1] != first.edges.shape[1]:
                raise SelfContactError(
                    f"contact {self.name!r}: its surfaces belong to different bodies; mesh them "
                    "as pieces of one body"
                )
        lengths = [s.weight.sum(axis=1) / s.thickness_mm for s in self.surfaces]
        for name, parts in (
            ("edges", [s.edges for s in self.surfaces]),
            ("owner", [np.full(len(s.edges), i) for i, s in enumerate(self.surfaces)]),
            ("length", lengths),
            ("start", [np.concatenate([[0.0], np.cumsum(part)[:-1]]) for part in lengths]),
        ):
            object.__setattr__(self, name, np.concatenate(parts))

    @cached_property
    def _sides(self) -> _Sides:
        return _Sides(self.edges, self.owner, self.reach_mm, self.itself)

    def initial_history(self, displacement: Array, placement: RigidPlacement) -> SelfContactHistory:
        """Return the points chosen at ``displacement`` (n, 2), mm; no friction acts yet."""
        return self._chosen_points(displacement, None)

    def with_first_contact(
        self, history: SelfContactHistory, displacement: Array, predicted: Array
    ) -> SelfContactHistory:
        """Return the history for a step from ``displacement`` (n, 2), mm, towards ``predicted``.

        A point that meets another surface on its way starts to stick where it does, for the reasons
        told in `RigidContact.with_first_contact`. All nodes are taken to go straight and at one
        pace.
        """
        after = self._deformed(predicted)
        before = self._deformed(displacement)
        _, met, met_local, gap = _meetings(
            history.edge, history.local, after, before, history.depth, self._sides
        )
        if not np.any(gap < 0):
            return history
        anchor, anchor_local = _first_touches(
            history.edge,
            history.local,
            history.anchor,
            history.anchor_local,
            met,
            met_local,
            gap,
            before,
            history.depth,
            after,
            self._sides,
        )
        return replace(history, anchor=anchor, anchor_local=anchor_local)

    def response(
        self, displacement: Array, placement: RigidPlacement, before: SelfContactHistory
    ) -> SelfContactResponse:
        """Return forces and trial history at ``displacement`` (n, 2), mm."""
        deformed = self._deformed(displacement)
        normal, met, met_local, gap = _meetings(
            before.edge, before.local, deformed, before.places, before.depth, self._sides
        )
        laws = _laws(
            gap,
            normal,
            before.edge,
            before.local,
            before.anchor,
            before.anchor_local,
            before.traction,
            deformed,
            self.normal.stiffness_mpa_per_mm,
            self.normal.ramp_mm,
            self.friction.coefficient,
            self.friction.stiffness_mpa_per_mm,
        )
        points = SelfContactPoints(gap, met, met_local, normal, *laws[1:])
        energy = float(laws[0] @ before.weight)
        touching = np.flatnonzero(points.pressure > 0)
        dofs, force = self._forces(points, before, touching)
        return SelfContactResponse(
            energy, touching, dofs, force, points, self, displacement, before
        )

    def held_friction(self, response: SelfContactResponse) -> SelfContactResponse:
        """Return the response with friction that slips held at its present value."""
        nothing = np.zeros_like(response.points.shear_by_pressure)
        return replace(response, points=replace(response.points, shear_by_pressure=nothing))

    def stiffness(self, response: SelfContactResponse, *, psd: bool = False) -> Array:
        """Return the derivative (j, 6k, 6k) of ``response.force``, N/mm, or a safe stand-in.

        The safe one is symmetric and negative semi-definite: the penalty along the normal and the
        sticking resistance along the tangent, without the turning of the normal.
        """
        points, before, touching = response.points, response.before, response.touching
        carrying, meeting, anchored, turning, sliding = self._shapes(points, before, touching)
        n = points.normal[touching]
        t = np.stack([-n[:, 1], n[:, 0]], axis=1)
        weight = before.weight[touching]
        across = np.einsum("jc,jcq->jq", n, carrying - meeting)
        along = np.einsum("jc,jcq->jq", t, carrying - meeting)
        by_gap, by_slip = points.pressure_slope[touching], points.shear_by_slip[touching]
        if psd:
            stand_in: Array = np.einsum("j,jp,jq->jpq", weight * by_gap, across, across)
            stand_in += np.einsum("j,jp,jq->jpq", weight * by_slip, along, along)
            return stand_in
        deformed = self._deformed(response.displacement)
        anchor = np.where(before.anchor == NONE, points.met_edge, before.anchor)[touching]
        own, other = (
            deformed[e].reshape(len(touching), -1) for e in (before.edge[touching], anchor)
        )
        met = deformed[points.met_edge[touching]].reshape(len(touching), -1)
        q = np.concatenate([own, met, other], axis=1)
        speed = np.einsum("jc,jcq,jq->j", t, turning, q)
        met_tangent = np.einsum("jcq,jq->jc", sliding, q)
        offset = np.einsum("jc,jcq,jq->j", n, carrying - anchored, q)
        turn = np.einsum("jc,jcq->jq", n, turning) / speed[:, None]
        gap = points.gap[touching]
        # δξ from (x_m − x_s)·t = 0, then δg, δs and the laws.
        by_local = (along - gap[:, None] * turn) / np.sum(met_tangent * t, axis=1)[:, None]
        d_gap = np.sum(met_tangent * n, axis=1)[:, None] * by_local - across
        d_slip = np.einsum("jc,jcq->jq", t, carrying - anchored) + offset[:, None] * turn
        d_pressure = by_gap[:, None] * d_gap
        d_shear = by_slip[:, None] * d_slip
        d_shear += points.shear_by_pressure[touching, None] * d_pressure
        pressure, shear = points.pressure[touching], points.shear[touching]
        push = shear[:, None] * t - pressure[:, None] * n
        d_push = np.einsum("jc,jq->jcq", t, d_shear + pressure[:, None] * turn)
        d_push += np.einsum("jc,jq->jcq", n, shear[:, None] * turn - d_pressure)
        result: Array = np.einsum("j,jcp,jcq->jpq", weight, carrying - meeting, d_push)
        result -= np.einsum("j,jcp,jc,jq->jpq", weight, sliding, push, by_local)
        return result

    def force_of_moving_body(
        self,
        displacement: Array,
        before: RigidPlacement,
        after: RigidPlacement,
        response: SelfContactResponse,
    ) -> Array:
        """Return zeros (j, 6k): no side of this contact is carried by the rigid body."""
        return np.zeros_like(response.force)

    def next_history(self, response: SelfContactResponse) -> SelfContactHistory:
        """Return the points chosen at the response's displacement; they inherit the friction."""
        return self._chosen_points(response.displacement, response)

    def arc_length(self, edge: Index, local: Array) -> Array:
        """Return the reference arc length (p,), mm, of points along their surface."""
        place: Array = self.start[edge] + local * self.length[edge]
        return place

    def _deformed(self, displacement: Array) -> Array:
        """Return the positions (m, k, 2) of the edges' nodes, mm."""
        deformed: Array = (self.surfaces[0].nodes + displacement)[self.edges]
        return deformed

    def _forces(
        self, points: SelfContactPoints, before: SelfContactHistory, touching: Index
    ) -> tuple[Index, Array]:
        """Return unknowns and forces (j, 6k), N, of the points that touch."""
        count = self.edges.shape[1]
        if touching.size == 0:  # the usual case
            return np.zeros((0, 6 * count), np.intp), np.zeros((0, 6 * count))
        met = points.met_edge[touching]
        anchor = np.where(before.anchor == NONE, points.met_edge, before.anchor)[touching]
        carrying, meeting = self._shapes(points, before, touching)[:2]
        normal = points.normal[touching]
        tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        shear, pressure = points.shear[touching, None], points.pressure[touching, None]
        pushed = before.weight[touching, None] * (shear * tangent - pressure * normal)
        force = np.einsum("jcq,jc->jq", carrying - meeting, pushed)
        three = np.stack([before.edge[touching], met, anchor], axis=1)
        nodes = self.edges[three].reshape(len(touching), 3 * count)
        return (2 * nodes[:, :, None] + np.arange(2)).reshape(force.shape), force

    def _shapes(
        self, points: SelfContactPoints, before: SelfContactHistory, touching: Index
    ) -> tuple[Array, Array, Array, Array, Array]:
        """Return linear maps (j, 2, 6k) from the three edges' nodes to what moves.

        Position of the point, of what it meets, of its anchor; derivative of the first two with
        respect to their local coordinates.
        """
        count = self.edges.shape[1]
        anchor_local = np.where(before.anchor == NONE, points.met_local, before.anchor_local)
        own, own_slope = edge_shapes(count, before.local[touching])
        met, met_slope = edge_shapes(count, points.met_local[touching])
        anchor, _ = edge_shapes(count, anchor_local[touching])
        maps = []
        for block, shape in ((0, own), (1, met), (2, anchor), (0, own_slope), (1, met_slope)):
            full = np.zeros((len(touching), 2, 3, count, 2))
            full[:, 0, block, :, 0] = full[:, 1, block, :, 1] = shape
            maps.append(full.reshape(len(touching), 2, 6 * count))
        return maps[0], maps[1], maps[2], maps[3], maps[4]

    def _chosen_points(
        self, displacement: Array, response: SelfContactResponse | None
    ) -> SelfContactHistory:
        deformed = self._deformed(displacement)
        edge, local, share = self._segmented(deformed)
        nodes = self.surfaces[0].nodes[self.edges[edge]]
        _, slope = edge_shapes(self.edges.shape[1], local)
        speed = np.linalg.norm(np.einsum("pk,pkc->pc", slope, nodes), axis=1)
        weight = 0.5 * share * speed * self.surfaces[0].thickness_mm
        before, depth = deformed, np.zeros(len(deformed))
        if response is not None:
            before, depth = response.before.places, response.before.depth
        _, met, met_local, gap = _meetings(edge, local, deformed, before, depth, self._sides)
        deepest = np.zeros(len(deformed))
        np.maximum.at(deepest, edge, -gap)
        traction = np.zeros(len(edge))
        if response is not None:
            traction = self._inherited(response, edge, local, gap)
        return SelfContactHistory(edge, local, weight, met, met_local, traction, deformed, deepest)

    def _inherited(
        self, response: SelfContactResponse, edge: Index, local: Array, gap: Array
    ) -> Array:
        """Return tractions (p,) at new points: the share of the pressure is what is handed on."""
        points, before = response.points, response.before
        touching = response.touching
        traction = np.zeros(len(edge))
        pressure = _pressures(gap, self.normal.stiffness_mpa_per_mm, self.normal.ramp_mm)
        old_arc = self.arc_length(before.edge, before.local)[touching]
        old_owner = self.owner[before.edge[touching]]
        ratio = points.shear[touching] / points.pressure[touching]
        arc, owner = self.arc_length(edge, local), self.owner[edge]
        for surface in np.unique(old_owner):
            there, here = old_owner == surface, owner == surface
            traction[here] = np.interp(arc[here], old_arc[there], ratio[there]) * pressure[here]
        return traction

    def _segmented(self, deformed: Array) -> tuple[Index, Array, Array]:
        """Return edge, local coordinate and share of the edge of every integration point."""
        breaks = _breaks(deformed, self._sides)
        gauss, gauss_weight = np.polynomial.legendre.leggauss(self.surfaces[0].points_per_edge)
        gauss, gauss_weight = 0.5 * (gauss + 1), 0.5 * gauss_weight
        at = np.argsort(breaks[:, 0] + breaks[:, 1] * 0.5, kind="stable")
        owner, place = breaks[at, 0].astype(np.intp), breaks[at, 1]
        same = owner[1:] == owner[:-1]
        width = np.diff(place)[same]
        begin, carrier = place[:-1][same], owner[:-1][same]
        kept = width > SHORTEST_SEGMENT
        begin, width, carrier = begin[kept], width[kept], carrier[kept]
        local = begin[:, None] + width[:, None] * gauss
        share = width[:, None] * gauss_weight
        return np.repeat(carrier, len(gauss)), local.ravel(), share.ravel()


@compiled
def _laws(
    gap: Array,
    normal: Array,
    edge: Index,
    local: Array,
    anchor: Index,
    anchor_local: Array,
    before: Array,
    deformed: Array,
    normal_stiffness: float,
    ramp: float,
    coefficient: float,
    tangential_stiffness: float,
) -> tuple[Array, Array, Array, NDArray[np.bool_], Array, Array, Array]:
    """Apply the scalar laws to all points; a point that met nothing before has no friction yet."""
    count = len(gap)
    energy, pressure, shear = np.zeros(count), np.zeros(count), np.zeros(count)
    slope, by_slip, by_pressure = np.zeros(count), np.zeros(count), np.zeros(count)
    slipping = np.zeros(count, np.bool_)
    for i in range(count):
        if gap[i] >= 0.0:
            continue
        energy[i], pressure[i], slope[i] = pressure_of_gap(gap[i], normal_stiffness, ramp)
        if pressure[i] > 0.0 and anchor[i] != NONE:
            x, y = _place(deformed, edge[i], local[i])[:2]
            anchor_x, anchor_y = _place(deformed, anchor[i], anchor_local[i])[:2]
            slip = -normal[i, 1] * (x - anchor_x) + normal[i, 0] * (y - anchor_y)
            shear[i], by_slip[i], by_pressure[i], slipping[i] = traction_of_slip(
                before[i], slip, pressure[i], coefficient, tangential_stiffness
            )
    return energy, pressure, shear, slipping, slope, by_slip, by_pressure


@compiled
def _pressures(gap: Array, stiffness: float, ramp: float) -> Array:
    result = np.empty(len(gap))
    for i in range(len(gap)):
        result[i] = pressure_of_gap(gap[i], stiffness, ramp)[1]
    return result


@compiled
def _place(deformed: Array, e: int, local: float) -> tuple[float, float, float, float]:
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
def _within_reach(home: int, boxes: Array, groups: Array, sides: _Sides, found: Index) -> int:
    """Write the edges that the edge ``home`` may reach, ascending; return how many they are."""
    count = 0
    for group in range(len(groups)):
        if not _nearer(groups[group], boxes[home], sides.reach_mm):
            continue
        for e in range(group * GROUP, min((group + 1) * GROUP, len(boxes))):
            if e == home or (sides.owner[e] == sides.owner[home] and not sides.itself):
                continue
            if _nearer(boxes[e], boxes[home], sides.reach_mm):
                found[count] = e
                count += 1
    return count


@compiled
def _meetings(
    edge: Index, local: Array, deformed: Array, before: Array, depth: Array, sides: _Sides
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
        x, y, nx, ny = _place(deformed, home, local[i])
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
    sides: _Sides,
) -> tuple[int, float, float]:
    """Return edge, local coordinate and gap of what a ray meets nearest to its point, if any."""
    met, met_local, gap = NONE, 0.0, np.inf
    tx, ty = -ny, nx
    behind = BEHIND_MM + depth
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
            if facing >= FACING_COSINE or _form_tip(sides.edges, before, e, home):
                continue
            if g < -behind and _distance_before(before, home, local, e, xi) < -behind:
                continue
            met, met_local, gap = e, xi, g
    return met, met_local, gap


@compiled
def _distance_before(before: Array, home: int, local: float, met: int, met_local: float) -> float:
    """Return how far in front of a point of one edge a place on another was."""
    x, y, nx, ny = _place(before, home, local)
    met_x, met_y = _place(before, met, met_local)[:2]
    distance: float = (met_x - x) * nx + (met_y - y) * ny
    return distance


@compiled
def _first_touches(
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
    sides: _Sides,
) -> tuple[Index, Array]:
    """Return the anchors of points whose nodes (m, k, 2) go straight from ``before`` to ``after``.

    ``met`` and ``gap`` belong to the end. The anchor of a point that is open at first and closed at
    the end becomes what it meets where its gap vanishes; others keep theirs.
    """
    anchor, anchor_local = anchor.copy(), anchor_local.copy()
    near = np.empty(len(before), np.intp)
    _, _, _, beginning = _meetings(edge, local, before, before, depth, sides)
    for i in range(len(edge)):
        if gap[i] >= 0.0 or beginning[i] <= 0.0:
            continue
        home = edge[i]
        outside, gap_outside, inside, gap_inside = 0.0, beginning[i], 1.0, gap[i]
        if gap_outside == np.inf:
            # Out of reach: how far is it from what it meets in the end?
            x, y, nx, ny = _place(before, home, local[i])
            met_x, met_y = _place(before, met[i], met_local[i])[:2]
            gap_outside = (met_x - x) * nx + (met_y - y) * ny
            if gap_outside <= 0.0:
                continue
        for _ in range(ENTRY_TRIALS):
            share = outside + (inside - outside) * gap_outside / (gap_outside - gap_inside)
            now = before + share * (after - before)
            boxes, groups = _boxes(now)
            count = _within_reach(home, boxes, groups, sides, near)
            x, y, nx, ny = _place(now, home, local[i])
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
def _form_tip(edges: Index, before: Array, one: int, other: int) -> bool:
    """Whether two edges share a node and enclose tissue there, less than a half turn of it.

    If one of them runs back at that node, no angle can be told, and they count as if they did.
    """
    if edges[one, 1] == edges[other, 0]:
        first, second = one, other
    elif edges[other, 1] == edges[one, 0]:
        first, second = other, one
    else:
        return False
    _, _, nx, ny = _place(before, first, 1.0)
    _, _, mx, my = _place(before, second, 0.0)
    if _runs_back(before, first, nx, ny) or _runs_back(before, second, mx, my):
        return True
    turned = np.arctan2(nx * my - ny * mx, nx * mx + ny * my)
    tip: bool = 0.0 <= turned < np.pi - SHARPEST_TIP_RAD
    return tip


@compiled
def _breaks(deformed: Array, sides: _Sides) -> Array:
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
                    SHORTEST_SEGMENT < s < 1 - SHORTEST_SEGMENT
                    and rx * rx + ry * ry < sides.reach_mm * sides.reach_mm
                ):
                    found.append((float(e), s))
    result = np.empty((len(found), 2))
    for i in range(len(found)):
        result[i, 0], result[i, 1] = found[i]
    return result
