"""Contact of deformable surfaces with one another and with themselves.

Every surface carries integration points. The ray from a point ``x_s`` along its own outward normal
``n`` is intersected with the deformed edges of the other surfaces. Where it meets an edge at
``x_m(ξ)``,

* the gap is ``g = (x_m − x_s)·n``, with ``(x_m − x_s)·t = 0`` for the point's own tangent ``t``;
* the slip since the last committed instant is ``s = t·(x_s − x_a)``, where ``x_a`` is the material
  point that the ray met then, carried along by the other surface; for a point that the other
  surface first reaches within the step, the material point that it meets when it does.

The force ``f = −p n + τ t`` acts on the point and ``−f`` on the place that it meets. As the two lie
on one normal, forces cancel, and moments too but for the couple ``τ g``, which vanishes with the
penetration. Rays go from both surfaces, and each counts half. The normal of the point, unlike that
of the edge it meets, is continuous where a point passes from edge to edge, and with it gap and
direction of the force on quadratic edges, so that contact does not chatter there (Puso and Laursen
2004 argue likewise for mortar methods).

Integration is by segments: the ends of the other surfaces' edges are projected onto each edge and
Gauss points are put between them, so that forces on both sides are integrated exactly where the
surfaces are flat, and non-matching meshes pass the patch test. Segments and points are chosen at
committed instants and are fixed during an increment; with their weights and tractions they are the
state.

A ray is also followed backwards, because a penetrating surface lies behind the point. So does the
other side of the same tissue, where it is thin. The committed instant distinguishes them: a surface
that penetrates now lay in front then.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import ABSENT, BodyComponent
from fem2d.body.surface import Surface, edge_shapes
from fem2d.contact.contact import Contact, ContactOnComponent, ContactResponse
from fem2d.contact.laws import (
    DEFAULT_FRICTION,
    DEFAULT_NORMAL,
    FrictionLaw,
    NormalLaw,
)
from fem2d.contact.search import (
    DEFAULT_SEARCH,
    NONE,
    SearchSettings,
    Sides,
    first_touches,
    meetings,
    segment_ends,
)
from fem2d.contact.self_contact_points import (
    SelfContactPoints,
    SelfContactState,
    laws_at_points,
    pressures_at_gaps,
    state_on_edges,
)
from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class SelfContactError(DrinksimError):
    """A self-contact is described in a way that makes no sense."""


@dataclass(frozen=True, eq=False)
class SelfContactResponse:
    """Contact forces of deformable surfaces at one trial displacement; see `ContactResponse`.

    Attributes
    ----------
    contact
        The contact.
    displacement, before
        Displacement (n, 2), mm, and committed state, at which it is evaluated.
    energy
        Energy stored in the normal penalty, N mm.
    touching
        (j,) points that touch; the arrays below belong to them.
    dofs, force
        (j, 6k) unknowns of the carrying, the met and the anchoring edge, and forces on them, N.
    points
        Values at all integration points.
    """

    contact: SelfContact = field(repr=False)
    displacement: Array = field(repr=False)
    before: SelfContactState = field(repr=False)
    energy: float
    touching: Index = field(repr=False)
    dofs: Index = field(repr=False)
    force: Array = field(repr=False)
    points: SelfContactPoints = field(repr=False)

    @cached_property
    def state(self) -> SelfContactState:
        """Trial state: points chosen at the displacement, which inherit the friction."""
        return self.contact.next_state(self)

    def joins(self, component: Index) -> bool:
        """Whether tissue of two components touches; (n,) component of each node."""
        edges, touching = self.contact.edges, self.touching
        here = component[edges[self.before.edge[touching], 0]]
        there = component[edges[self.points.met_edge[touching], 0]]
        return bool(np.any(here != there))


@dataclass(frozen=True, init=False, eq=False)
class SelfContact:
    """Deformable surfaces of one body that may touch one another.

    Parameters
    ----------
    surfaces
        Surfaces that may touch one another.
    friction
        The law of friction, or the coefficient of one.
    normal
        The law of the pressure.
    reach_mm
        Distance from a surface within which others are searched for, outside and inside, mm: more
        than any penetration.
    same_surface
        Whether each surface may also touch itself, as in a crease.
    search
        How surfaces are searched for.
    name
        Name in reports.

    Raises
    ------
    SelfContactError
        If there is nothing to touch, the surfaces belong to different bodies, or the reach is not
        positive.
    """

    surfaces: tuple[Surface, ...]
    friction: FrictionLaw
    normal: NormalLaw
    reach_mm: float
    same_surface: bool
    search: SearchSettings
    name: str
    edges: Index = field(init=False, repr=False)
    """(m, k) node indices of all surfaces' edges."""
    owner: Index = field(init=False, repr=False)
    """(m,) which surface each edge belongs to."""
    start: Array = field(init=False, repr=False)
    """(m,) reference arc length along its surface at which each edge starts, mm."""
    length: Array = field(init=False, repr=False)
    """(m,) reference length of each edge, mm."""
    within_elements: ClassVar[bool] = False

    def __init__(
        self,
        surfaces: Iterable[Surface],
        *,
        friction: FrictionLaw | float = DEFAULT_FRICTION,
        normal: NormalLaw = DEFAULT_NORMAL,
        reach_mm: float = 0.5,
        same_surface: bool = False,
        search: SearchSettings = DEFAULT_SEARCH,
        name: str = "self-contact",
    ) -> None:
        for key, value in (
            ("surfaces", tuple(surfaces)),
            ("friction", friction if isinstance(friction, FrictionLaw) else FrictionLaw(friction)),
            ("normal", normal),
            ("reach_mm", reach_mm),
            ("same_surface", same_surface),
            ("search", search),
            ("name", name),
        ):
            object.__setattr__(self, key, value)
        self._check()
        lengths = [s.weight.sum(axis=1) / s.thickness_mm for s in self.surfaces]
        for key, arrays in (
            ("edges", [s.edges for s in self.surfaces]),
            ("owner", [np.full(len(s.edges), i) for i, s in enumerate(self.surfaces)]),
            ("length", lengths),
            ("start", [np.concatenate([[0.0], np.cumsum(length)[:-1]]) for length in lengths]),
        ):
            object.__setattr__(self, key, np.concatenate(arrays))

    def __repr__(self) -> str:
        edges = " + ".join(str(len(s.edges)) for s in self.surfaces)
        return f"SelfContact({self.name!r}, {edges} edges, friction {self.friction.coefficient:g})"

    def _check(self) -> None:
        if not self.reach_mm > 0:
            raise SelfContactError(
                f"contact {self.name!r}: reach_mm = {self.reach_mm} must be positive"
            )
        if len(self.surfaces) < 2 - self.same_surface:
            raise SelfContactError(
                f"contact {self.name!r} of one surface with nothing: give a second one, or set "
                "same_surface=True"
            )
        first = self.surfaces[0]
        for surface in self.surfaces:
            if surface.nodes is not first.nodes or surface.edges.shape[1] != first.edges.shape[1]:
                raise SelfContactError(
                    f"contact {self.name!r}: its surfaces belong to different bodies; mesh them "
                    "as components of one body"
                )

    @cached_property
    def _sides(self) -> Sides:
        return Sides(
            self.edges, self.owner, self.reach_mm, self.same_surface, *astuple(self.search)
        )

    def initial_state(self, displacement: Array, placement: RigidPlacement) -> SelfContactState:
        """Return the points chosen at ``displacement`` (n, 2), mm; no friction acts yet."""
        return self._chosen_points(displacement, None)

    def with_first_contact(
        self,
        state: SelfContactState,
        displacement: Array,
        predicted: Array,
        placement: RigidPlacement,
    ) -> SelfContactState:
        """Return the state for a step from ``displacement`` to ``predicted``; see `Contact`.

        Nodes are assumed to move on straight lines at constant velocity.
        """
        after = self._deformed(predicted)
        before = self._deformed(displacement)
        _, met, met_local, gap = meetings(
            state.edge, state.local, after, before, state.depth, self._sides
        )
        if not np.any(gap < 0):
            return state
        anchor, anchor_local = first_touches(
            state.edge,
            state.local,
            state.anchor,
            state.anchor_local,
            met,
            met_local,
            gap,
            before,
            state.depth,
            after,
            self._sides,
        )
        return replace(state, anchor=anchor, anchor_local=anchor_local)

    def evaluate(
        self, displacement: Array, placement: RigidPlacement, before: SelfContactState
    ) -> SelfContactResponse:
        """Return forces and trial state at ``displacement`` (n, 2), mm; see `Contact`."""
        deformed = self._deformed(displacement)
        normal, met, met_local, gap = meetings(
            before.edge, before.local, deformed, before.places, before.depth, self._sides
        )
        laws = laws_at_points(
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
            self, displacement, before, energy, touching, dofs, force, points
        )

    def held_friction(self, response: SelfContactResponse) -> SelfContactResponse:
        """Return the response with friction that slips held at its present value; see `Contact`."""
        nothing = np.zeros_like(response.points.shear_by_pressure)
        return replace(response, points=replace(response.points, shear_by_pressure=nothing))

    def tangent(self, response: SelfContactResponse, *, psd: bool = False) -> Array:
        """Return the derivative (j, 6k, 6k) of the forces, N/mm, or a stand-in; see `Contact`."""
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

    def force_of_motion(self, response: SelfContactResponse, placement: RigidPlacement) -> Array:
        """Return zeros (j, 6k): no side of this contact is rigid."""
        return np.zeros_like(response.force)

    def on_component(self, component: BodyComponent) -> ContactOnComponent | None:
        """Return the contact between those surfaces that lie on a component; see `Contact`."""
        own = tuple(component.surface(s) for s in self.surfaces if component.has(s))
        if len(own) + self.same_surface < 2:
            return None
        on_it = component.number[self.edges[:, 0]] != ABSENT
        number = np.where(on_it, np.cumsum(on_it) - 1, NONE)
        return ContactOnComponent(
            replace(self, surfaces=own), lambda state: state_on_edges(state, number)
        )

    def next_state(self, response: SelfContactResponse) -> SelfContactState:
        """Return the points chosen at the displacement of a response, with inherited friction."""
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
        self, points: SelfContactPoints, before: SelfContactState, touching: Index
    ) -> tuple[Index, Array]:
        """Return unknowns and forces (j, 6k), N, of the points that touch."""
        count = self.edges.shape[1]
        if touching.size == 0:  # usual
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
        self, points: SelfContactPoints, before: SelfContactState, touching: Index
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
    ) -> SelfContactState:
        deformed = self._deformed(displacement)
        edge, local, share = self._segmented(deformed)
        nodes = self.surfaces[0].nodes[self.edges[edge]]
        _, slope = edge_shapes(self.edges.shape[1], local)
        speed = np.linalg.norm(np.einsum("pk,pkc->pc", slope, nodes), axis=1)
        weight = 0.5 * share * speed * self.surfaces[0].thickness_mm
        before, depth = deformed, np.zeros(len(deformed))
        if response is not None:
            before, depth = response.before.places, response.before.depth
        _, met, met_local, gap = meetings(edge, local, deformed, before, depth, self._sides)
        deepest = np.zeros(len(deformed))
        np.maximum.at(deepest, edge, -gap)
        traction = np.zeros(len(edge))
        if response is not None:
            traction = self._inherited(response, edge, local, gap)
        return SelfContactState(edge, local, weight, met, met_local, traction, deformed, deepest)

    def _inherited(
        self, response: SelfContactResponse, edge: Index, local: Array, gap: Array
    ) -> Array:
        """Return tractions (p,) at new points, which inherit the ratio of traction to pressure."""
        points, before = response.points, response.before
        touching = response.touching
        traction = np.zeros(len(edge))
        pressure = pressures_at_gaps(gap, self.normal.stiffness_mpa_per_mm, self.normal.ramp_mm)
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
        breaks = segment_ends(deformed, self._sides)
        gauss, gauss_weight = np.polynomial.legendre.leggauss(self.surfaces[0].points_per_edge)
        gauss, gauss_weight = 0.5 * (gauss + 1), 0.5 * gauss_weight
        at = np.argsort(breaks[:, 0] + breaks[:, 1] * 0.5, kind="stable")
        owner, place = breaks[at, 0].astype(np.intp), breaks[at, 1]
        same = owner[1:] == owner[:-1]
        width = np.diff(place)[same]
        begin, carrier = place[:-1][same], owner[:-1][same]
        kept = width > self.search.shortest_segment
        begin, width, carrier = begin[kept], width[kept], carrier[kept]
        local = begin[:, None] + width[:, None] * gauss
        share = width[:, None] * gauss_weight
        return np.repeat(carrier, len(gauss)), local.ravel(), share.ravel()


def self_contacts(contacts: Iterable[Contact]) -> tuple[SelfContact, ...]:
    """Return those of some contacts that are of deformable surfaces."""
    return tuple(c for c in contacts if isinstance(c, SelfContact))


def self_responses(responses: Iterable[ContactResponse]) -> tuple[SelfContactResponse, ...]:
    """Return those of some responses that are of deformable surfaces."""
    return tuple(r for r in responses if isinstance(r, SelfContactResponse))
