"""Contact of deformable surfaces with one another and with themselves.

Every surface carries integration points that look along their own outward normal ``n`` for the
other surfaces' deformed edges. Where the ray from ``x_s`` meets an edge at ``x_m(ξ)``,

* the gap is ``g = (x_m − x_s)·n``, with ``(x_m − x_s)·t = 0`` for the point's own tangent ``t``;
* the slip since the last committed instant is ``s = t·(x_s − x_a)``, where ``x_a`` is the material
  point that the ray met then, carried along by the other surface.

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
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem2d.friction import FrictionLaw, NormalLaw, pressure_of_gap, traction_of_slip
from fem2d.surface import Surface, edge_shapes
from geometry2d.compiled import compiled
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]
Index = NDArray[np.intp]

FACING_COSINE = -0.25
"""Surfaces face each other if the cosine between their outward normals is below this."""

SHORTEST_SEGMENT = 1e-7
"""Segments shorter than this share of an edge get no points."""

NONE = -1
"""No edge is met."""


class TissueContactError(ValueError):
    """Deformable surfaces were put together in a way that makes no sense."""


@dataclass(frozen=True)
class TissueHistory:
    """Integration points chosen at a committed instant, and what friction remembers of them.

    Attributes
    ----------
    edge, local, weight
        (p,) edge that carries each point, local coordinate on it, reference area, mm², halved
        because the other side looks back.
    anchor, anchor_local
        (p,) edge that the point's ray met, −1 for none, and local coordinate there.
    traction
        (p,) tangential traction, MPa, positive along the carrying edge.
    """

    edge: Index
    local: Array
    weight: Array
    anchor: Index
    anchor_local: Array
    traction: Array


@dataclass(frozen=True)
class TissuePoints:
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
class TissueResponse:
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
    points: TissuePoints
    pair: TissueContact = field(repr=False)
    displacement: Array = field(repr=False)
    before: TissueHistory = field(repr=False)

    @cached_property
    def history(self) -> TissueHistory:
        """Trial history: commit it by handing it to the next increment."""
        return self.pair.next_history(self)


@dataclass(frozen=True)
class TissueContact:
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
        penetration, less than half of the thinnest part.
    itself
        Whether a surface may touch itself, as in a crease.
    neighbourhood_mm
        Parts of a surface nearer than this along it do not touch each other, mm.
    """

    name: str
    surfaces: tuple[Surface, ...]
    normal: NormalLaw
    friction: FrictionLaw
    reach_mm: float
    itself: bool = False
    neighbourhood_mm: float = 0.0
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
        if not self.reach_mm > 0 or self.neighbourhood_mm < 0:
            raise TissueContactError(
                f"contact {self.name!r}: reach {self.reach_mm} mm must be positive and "
                f"neighbourhood {self.neighbourhood_mm} mm not negative"
            )
        if len(self.surfaces) < 2 - self.itself:
            raise TissueContactError(
                f"contact {self.name!r} of one surface with nothing: give a second one, or set "
                "itself=True"
            )
        first = self.surfaces[0]
        for surface in self.surfaces:
            if surface.nodes is not first.nodes or surface.edges.shape[1] != first.edges.shape[1]:
                raise TissueContactError(
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

    def initial_history(self, displacement: Array, placement: RigidPlacement) -> TissueHistory:
        """Return the points chosen at ``displacement`` (n, 2), mm; no friction acts yet."""
        return self._chosen_points(displacement, None)

    def response(
        self, displacement: Array, placement: RigidPlacement, before: TissueHistory
    ) -> TissueResponse:
        """Return forces and trial history at ``displacement`` (n, 2), mm."""
        position, normal = self._carried(displacement, before.edge, before.local)
        met, met_local, gap = self._met(displacement, before, position, normal)
        if not np.any(gap < 0):
            return self._apart(displacement, before, gap, met, met_local, normal)
        deformed = (self.surfaces[0].nodes + displacement)[self.edges]
        anchor = np.where(before.anchor == NONE, met, before.anchor)
        shape, _ = edge_shapes(self.edges.shape[1], before.anchor_local)
        anchored = np.einsum("pk,pkc->pc", shape, deformed[anchor])
        tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        slip = np.sum(tangent * (position - anchored), axis=1)
        laws = _laws(
            gap,
            slip,
            before.traction,
            before.anchor != NONE,
            self.normal.stiffness_mpa_per_mm,
            self.normal.ramp_mm,
            self.friction.coefficient,
            self.friction.stiffness_mpa_per_mm,
        )
        energy, pressure, shear, slipping, pressure_slope, by_slip, by_pressure = laws
        points = TissuePoints(
            gap, met, met_local, normal, pressure, shear, slipping, pressure_slope, by_slip,
            by_pressure,
        )  # fmt: skip
        touching = np.flatnonzero(pressure > 0)
        carrying, meeting = self._shapes(points, before, touching)[:2]
        traction = shear[:, None] * tangent - pressure[:, None] * normal
        pushed = before.weight[touching, None] * traction[touching]
        force = np.einsum("jcq,jc->jq", carrying - meeting, pushed)
        three = np.stack([before.edge[touching], met[touching], anchor[touching]], axis=1)
        nodes = self.edges[three].reshape(len(touching), 3 * self.edges.shape[1])
        dofs = (2 * nodes[:, :, None] + np.arange(2)).reshape(force.shape)
        return TissueResponse(
            float(energy @ before.weight), touching, dofs, force, points, self, displacement, before
        )

    def _apart(
        self,
        displacement: Array,
        before: TissueHistory,
        gap: Array,
        met: Index,
        met_local: Array,
        normal: Array,
    ) -> TissueResponse:
        """Return the response of surfaces of which no point touches another, the usual case."""
        zero, never = np.zeros(len(gap)), np.zeros(len(gap), np.bool_)
        points = TissuePoints(gap, met, met_local, normal, zero, zero, never, zero, zero, zero)
        nobody, unknowns = np.zeros(0, np.intp), (0, 6 * self.edges.shape[1])
        dofs, force = np.zeros(unknowns, np.intp), np.zeros(unknowns)
        return TissueResponse(0.0, nobody, dofs, force, points, self, displacement, before)

    def held_friction(self, response: TissueResponse) -> TissueResponse:
        """Return the response with friction that slips held at its present value."""
        nothing = np.zeros_like(response.points.shear_by_pressure)
        return replace(response, points=replace(response.points, shear_by_pressure=nothing))

    def stiffness(self, response: TissueResponse, *, safe: bool = False) -> Array:
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
        if safe:
            stand_in: Array = np.einsum("j,jp,jq->jpq", weight * by_gap, across, across)
            stand_in += np.einsum("j,jp,jq->jpq", weight * by_slip, along, along)
            return stand_in
        deformed = (self.surfaces[0].nodes + response.displacement)[self.edges]
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
        response: TissueResponse,
    ) -> Array:
        """Return zeros (j, 6k): no side of this contact is carried by the rigid body."""
        return np.zeros_like(response.force)

    def next_history(self, response: TissueResponse) -> TissueHistory:
        """Return the points chosen at the response's displacement; they inherit the friction."""
        return self._chosen_points(response.displacement, response)

    def arc_length(self, edge: Index, local: Array) -> Array:
        """Return the reference arc length (p,), mm, of points along their surface."""
        place: Array = self.start[edge] + local * self.length[edge]
        return place

    def _carried(self, displacement: Array, edge: Index, local: Array) -> tuple[Array, Array]:
        """Return position (p, 2) and outward normal (p, 2) of points on edges."""
        deformed = (self.surfaces[0].nodes + displacement)[self.edges[edge]]
        shape, slope = edge_shapes(self.edges.shape[1], local)
        along = np.einsum("pk,pkc->pc", slope, deformed)
        speed = np.linalg.norm(along, axis=1)
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1) / speed[:, None]
        return np.einsum("pk,pkc->pc", shape, deformed), normal

    def _met(
        self, displacement: Array, points: TissueHistory, position: Array, normal: Array
    ) -> tuple[Index, Array, Array]:
        deformed = (self.surfaces[0].nodes + displacement)[self.edges]
        found: tuple[Index, Array, Array] = _meetings(
            position,
            normal,
            points.edge,
            self.arc_length(points.edge, points.local),
            deformed,
            self.edges,
            self.owner,
            self.start,
            self.length,
            self.reach_mm,
            self.itself,
            self.neighbourhood_mm,
        )
        return found

    def _shapes(
        self, points: TissuePoints, before: TissueHistory, touching: Index
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

    def _chosen_points(self, displacement: Array, response: TissueResponse | None) -> TissueHistory:
        edge, local, share = self._segmented(displacement)
        nodes = self.surfaces[0].nodes[self.edges[edge]]
        _, slope = edge_shapes(self.edges.shape[1], local)
        speed = np.linalg.norm(np.einsum("pk,pkc->pc", slope, nodes), axis=1)
        weight = 0.5 * share * speed * self.surfaces[0].thickness_mm
        empty = TissueHistory(
            edge, local, weight, np.full(len(edge), NONE), np.zeros(len(edge)), np.zeros(len(edge))
        )
        position, normal = self._carried(displacement, edge, local)
        met, met_local, gap = self._met(displacement, empty, position, normal)
        traction = empty.traction
        if response is not None:
            traction = self._inherited(response, edge, local, gap)
        return TissueHistory(edge, local, weight, met, met_local, traction)

    def _inherited(self, response: TissueResponse, edge: Index, local: Array, gap: Array) -> Array:
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

    def _segmented(self, displacement: Array) -> tuple[Index, Array, Array]:
        """Return edge, local coordinate and share of the edge of every integration point."""
        breaks = _breaks(
            (self.surfaces[0].nodes + displacement)[self.edges],
            self.edges,
            self.owner,
            self.reach_mm,
            self.itself,
        )
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
    slip: Array,
    before: Array,
    anchored: NDArray[np.bool_],
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
        energy[i], pressure[i], slope[i] = pressure_of_gap(gap[i], normal_stiffness, ramp)
        if pressure[i] > 0.0 and anchored[i]:
            shear[i], by_slip[i], by_pressure[i], slipping[i] = traction_of_slip(
                before[i], slip[i], pressure[i], coefficient, tangential_stiffness
            )
    return energy, pressure, shear, slipping, slope, by_slip, by_pressure


@compiled
def _pressures(gap: Array, stiffness: float, ramp: float) -> Array:
    result = np.empty(len(gap))
    for i in range(len(gap)):
        result[i] = pressure_of_gap(gap[i], stiffness, ramp)[1]
    return result


@compiled
def _meetings(
    position: Array,
    normal: Array,
    carrier: Index,
    arc: Array,
    edge_nodes: Array,
    edges: Index,
    owner: Index,
    start: Array,
    length: Array,
    reach: float,
    itself: bool,
    neighbourhood: float,
) -> tuple[Index, Array, Array]:
    """Return edge, local coordinate and gap of what each point's ray meets nearest to it."""
    count, edge_count, k = len(position), edge_nodes.shape[0], edge_nodes.shape[1]
    met = np.full(count, NONE)
    local = np.zeros(count)
    gap = np.full(count, np.inf)
    low, high = np.empty((edge_count, 2)), np.empty((edge_count, 2))
    for e in range(edge_count):
        for c in range(2):
            least, most = edge_nodes[e, 0, c], edge_nodes[e, 0, c]
            for a in range(1, k):
                least, most = min(least, edge_nodes[e, a, c]), max(most, edge_nodes[e, a, c])
            # A quadratic edge may leave the box of its nodes by an eighth of its size.
            spare = reach + 0.125 * (most - least)
            low[e, c], high[e, c] = least - spare, most + spare
    for i in range(count):
        x, y = position[i, 0], position[i, 1]
        nx, ny = normal[i, 0], normal[i, 1]
        tx, ty = -ny, nx
        home = carrier[i]
        for e in range(edge_count):
            if x < low[e, 0] or x > high[e, 0] or y < low[e, 1] or y > high[e, 1]:
                continue
            if owner[e] == owner[home]:
                if not itself or _share_node(edges, e, home):
                    continue
                apart = max(start[e] - arc[i], arc[i] - start[e] - length[e])
                if apart < neighbourhood:
                    continue
            x0, y0 = edge_nodes[e, 0, 0] - x, edge_nodes[e, 0, 1] - y
            x1, y1 = edge_nodes[e, 1, 0] - x, edge_nodes[e, 1, 1] - y
            c0, c1 = x0 * tx + y0 * ty, x1 * tx + y1 * ty
            if k == 3:
                xm, ym = edge_nodes[e, 2, 0] - x, edge_nodes[e, 2, 1] - y
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
                if abs(g) > reach or abs(g) >= abs(gap[i]):
                    continue
                ax, ay = d0 * x0 + d1 * x1 + dm * xm, d0 * y0 + d1 * y1 + dm * ym
                facing = (ay * nx - ax * ny) / np.hypot(ax, ay)
                if facing < FACING_COSINE:
                    met[i], local[i], gap[i] = e, xi, g
    return met, local, gap


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
def _share_node(edges: Index, first: int, second: int) -> bool:
    for a in range(2):
        for b in range(2):
            if edges[first, a] == edges[second, b]:
                return True
    return False


@compiled
def _breaks(edge_nodes: Array, edges: Index, owner: Index, reach: float, itself: bool) -> Array:
    """Return (b, 2): edge and local coordinate where its segments begin and end, unsorted.

    An edge is broken at the normal projections of the other edges' end nodes within reach.
    """
    found = []
    count, k = edge_nodes.shape[0], edge_nodes.shape[1]
    for e in range(count):
        found.append((float(e), 0.0))
        found.append((float(e), 1.0))
        x0, y0 = edge_nodes[e, 0, 0], edge_nodes[e, 0, 1]
        x1, y1 = edge_nodes[e, 1, 0], edge_nodes[e, 1, 1]
        if k == 3:
            xm, ym = edge_nodes[e, 2, 0], edge_nodes[e, 2, 1]
        else:
            xm, ym = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
        chord = (x1 - x0) ** 2 + (y1 - y0) ** 2
        for other in range(count):
            if other == e or (owner[other] == owner[e] and not itself):
                continue
            for end in range(2):
                px, py = edge_nodes[other, end, 0], edge_nodes[other, end, 1]
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
                    and rx * rx + ry * ry < reach * reach
                ):
                    found.append((float(e), s))
    result = np.empty((len(found), 2))
    for i in range(len(found)):
        result[i, 0], result[i, 1] = found[i]
    return result
