"""Contact of tissue with a rigid outline: forces, stiffness and trial history.

The virtual work of contact is ``∫ (p n + τ t)·δx dS`` over the reference surface, integrated at
points with a friction state of their own: the nodes, or Gauss points (`fem2d.body.surface`).
Pressure and friction come from `fem2d.contact.laws`, gap and slip from `fem2d.contact.gap`.
`fem2d.contact.contact` defines what every contact offers.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import BodyComponent
from fem2d.body.surface import Surface
from fem2d.contact.contact import Contact, ContactOnComponent, ContactResponse
from fem2d.contact.laws import (
    DEFAULT_FRICTION,
    DEFAULT_NORMAL,
    FrictionLaw,
    NormalLaw,
)
from fem2d.contact.rigid_points import RigidContactPoints, entry_places, laws_at_points
from fem2d.contact.search import DEFAULT_SEARCH, SearchSettings
from geometry2d.outline import Outline
from geometry2d.rigid import UNMOVED, RigidPlacement, rotated

Array = NDArray[np.float64]
Index = NDArray[np.intp]

POINTS_TO_LOOK_AT = 9
"""Gauss points of an edge at which its deepest penetration is measured."""


@dataclass(frozen=True)
class RigidContactState:
    """What friction remembers of each point of the surface at a committed instant.

    Attributes
    ----------
    body_position
        (m, q, 2) place in the rigid body's frame from which slip is counted, mm: the position of
        the point at the committed instant, or, in a step in which the body first touches the point,
        where it does.
    traction
        (m, q) tangential traction, MPa, positive along ``t = (−n_y, n_x)``.
    """

    body_position: Array
    traction: Array


@dataclass(frozen=True, eq=False)
class RigidContactResponse:
    """Contact forces at one trial displacement; see `ContactResponse`.

    Attributes
    ----------
    contact
        The contact.
    displacement, placement
        Of the tissue, (n, 2), mm, and of the moving rigid bodies, at which it is evaluated.
    energy
        Energy stored in the normal penalty, N mm.
    edges
        (j,) edges that touch; the arrays below belong to them.
    dofs, force
        (j, 2k) degrees of freedom and forces on the tissue, N.
    points
        Values at all points.
    state
        Trial state.
    """

    contact: RigidContact = field(repr=False)
    displacement: Array = field(repr=False)
    placement: RigidPlacement
    energy: float
    edges: Index = field(repr=False)
    dofs: Index = field(repr=False)
    force: Array = field(repr=False)
    points: RigidContactPoints = field(repr=False)
    state: RigidContactState = field(repr=False)

    def joins(self, component: Index) -> bool:
        """Return False: between components lies a rigid body."""
        return False


@dataclass(frozen=True, init=False, eq=False)
class RigidContact:
    """One stretch of tissue surface against one rigid outline.

    Parameters
    ----------
    surface
        The tissue's side.
    outline
        The rigid body's side, in the body's frame.
    friction
        The law of friction, or the coefficient of one.
    normal
        The law of the pressure.
    moving
        Whether the rigid body is moved by the load, or stands still.
    search
        How the place where a point enters the outline is found.
    name
        Name in reports.
    """

    surface: Surface
    outline: Outline
    friction: FrictionLaw
    normal: NormalLaw
    moving: bool
    search: SearchSettings
    name: str
    within_elements: ClassVar[bool] = True

    def __init__(
        self,
        surface: Surface,
        outline: Outline,
        *,
        friction: FrictionLaw | float = DEFAULT_FRICTION,
        normal: NormalLaw = DEFAULT_NORMAL,
        moving: bool = True,
        search: SearchSettings = DEFAULT_SEARCH,
        name: str = "rigid contact",
    ) -> None:
        law = friction if isinstance(friction, FrictionLaw) else FrictionLaw(friction)
        for key, value in (
            ("surface", surface),
            ("outline", outline),
            ("friction", law),
            ("normal", normal),
            ("moving", moving),
            ("search", search),
            ("name", name),
        ):
            object.__setattr__(self, key, value)

    def __repr__(self) -> str:
        kind = "moving" if self.moving else "fixed"
        return (
            f"RigidContact({self.name!r}, {len(self.surface.edges)} edges, {kind} outline, "
            f"friction {self.friction.coefficient:g})"
        )

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The tissue's side."""
        return (self.surface,)

    @cached_property
    def _box(self) -> Array:
        return np.array(self.outline.box)

    @cached_property
    def _is_between(self) -> NDArray[np.bool_]:
        """(m q,) which points lie between nodes."""
        return np.tile(self.surface.is_between, len(self.surface.edges))

    @cached_property
    def _gap_offset(self) -> Array:
        """(m q,) penetration up to which each point bears nothing, mm."""
        return np.where(self._is_between, self.normal.gap_offset_mm, 0.0)

    def initial_state(self, displacement: Array, placement: RigidPlacement) -> RigidContactState:
        """Return the state of a surface on which no friction acts yet; see `Contact`."""
        position = self._pulled_back(displacement, placement)
        return RigidContactState(position, np.zeros(position.shape[:2]))

    def with_first_contact(
        self,
        state: RigidContactState,
        displacement: Array,
        predicted: Array,
        placement: RigidPlacement,
    ) -> RigidContactState:
        """Return the state for a step that is expected to lead to ``predicted``; see `Contact`."""
        met = entry_places(
            state.body_position.reshape(-1, 2),
            self._pulled_back(predicted, placement).reshape(-1, 2),
            self.outline.start,
            self.outline.curvature,
            self.outline.centre,
            self.outline.breaks,
            self._box,
            self._gap_offset,
            self.search.entry_trials,
        )
        return replace(state, body_position=met.reshape(state.body_position.shape))

    def evaluate(
        self, displacement: Array, placement: RigidPlacement, before: RigidContactState
    ) -> RigidContactResponse:
        """Return forces and trial state at ``displacement`` (n, 2), mm; see `Contact`."""
        there = self._placed(placement)
        position = self.surface.positions(displacement)
        shape = position.shape[:2]
        raw = laws_at_points(
            position.reshape(-1, 2),
            before.body_position.reshape(-1, 2),
            before.traction.reshape(-1),
            there.angle_rad,
            there.shift_mm[0],
            there.shift_mm[1],
            self.outline.start,
            self.outline.curvature,
            self.outline.centre,
            self.outline.breaks,
            self._box,
            self.normal.stiffness_mpa_per_mm,
            self.normal.ramp_mm,
            self._is_between,
            self._gap_offset,
            self.friction.coefficient,
            self.friction.stiffness_mpa_per_mm,
        )
        energy, gap, normal, pressure, shear, slipping, arc, body, traction, slope, safe = raw
        edges = np.flatnonzero(np.any(pressure.reshape(shape) > 0, axis=1))
        points = RigidContactPoints(
            gap.reshape(shape),
            normal.reshape(*shape, 2),
            pressure.reshape(shape),
            shear.reshape(shape),
            slipping.reshape(shape),
            arc.reshape(shape),
            traction.reshape(*shape, 2),
            slope.reshape(*shape, 2, 2),
            safe.reshape(*shape, 2, 2),
        )
        dofs, force = self.surface.assembled_force(points.traction[edges], edges)
        return RigidContactResponse(
            contact=self,
            displacement=displacement,
            placement=placement,
            energy=float(np.sum(energy.reshape(shape) * self.surface.weight)),
            edges=edges,
            dofs=dofs,
            force=force,
            points=points,
            state=RigidContactState(body.reshape(*shape, 2), shear.reshape(shape)),
        )

    def tangent(self, response: RigidContactResponse, *, psd: bool = False) -> Array:
        """Return the derivative (j, 2k, 2k) of the forces, N/mm, or a stand-in; see `Contact`."""
        slope = response.points.psd_slope if psd else response.points.slope
        return self.surface.assembled_stiffness(slope[response.edges], response.edges)

    def deepest(self, response: RigidContactResponse) -> float:
        """Return the deepest penetration, mm, anywhere on the surface, between its points too.

        There an edge may sink over a corner of the outline: between points a distance s apart, over
        a corner of radius r, by about s²/(8r).
        """
        length = self.surface.reference_speed.max(axis=1)
        near = response.points.gap.min(axis=1) < 0.5 * length
        if not near.any():
            return 0.0
        edges = Surface(
            self.surface.edges[near], self.surface.nodes, points_per_edge=POINTS_TO_LOOK_AT
        )
        position = edges.positions(response.displacement).reshape(-1, 2)
        there = self._placed(response.placement)
        distance = self.outline.project(there.pull_back(position)).distance
        return max(0.0, -float(distance.min()), -float(response.points.gap.min()))

    def held_friction(self, response: RigidContactResponse) -> RigidContactResponse:
        """Return the response without the coupling ``t·(∂f/∂x)·n`` of friction that slips.

        See `Contact`.
        """
        points = response.points
        tangent = np.stack([-points.normal[..., 1], points.normal[..., 0]], axis=-1)
        coupling = np.einsum("mqc,mqcd,mqd->mq", tangent, points.slope, points.normal)
        follows = coupling[..., None, None] * tangent[..., :, None] * points.normal[..., None, :]
        return replace(response, points=replace(points, slope=points.slope - follows))

    def force_of_motion(self, response: RigidContactResponse, placement: RigidPlacement) -> Array:
        """Return the change (j, 2k) of the forces, N, when the body goes to ``placement``.

        To first order, moving the rigid body by ``d`` while the tissue stands still is moving the
        tissue by ``−d`` relative to it, and turning the traction with the body; a Newton step needs
        this to predict where a sticking surface goes.
        """
        if not self.moving:
            return np.zeros_like(response.force)
        edges, before = response.edges, response.placement
        position = self.surface.positions(response.displacement)[edges]
        carried = placement.apply(before.pull_back(position)) - position
        here = response.points.traction[edges]
        relative = here - np.einsum("mqcd,mqd->mqc", response.points.slope[edges], carried)
        change = rotated(relative, placement.angle_rad - before.angle_rad) - here
        return self.surface.assembled_force(change, edges)[1]

    def force_by_motion(self, response: RigidContactResponse, *, psd: bool = False) -> Array:
        """Return the derivative (3, j, 2k) of the forces by the body's placement.

        By its shift along x and y, N/mm, and by a turn about its origin, N/rad; with ``psd`` of the
        stand-in that `tangent` returns.
        """
        edges, points = response.edges, response.points
        slope = (points.psd_slope if psd else points.slope)[edges]
        traction = points.traction[edges]
        position = self.surface.positions(response.displacement)[edges]
        arm = position - response.placement.shift_mm
        turned = np.stack([-arm[..., 1], arm[..., 0]], axis=-1)
        follows = np.stack([-traction[..., 1], traction[..., 0]], axis=-1)
        changes = (
            -slope[..., 0],
            -slope[..., 1],
            follows - np.einsum("mqcd,mqd->mqc", slope, turned),
        )
        return np.stack([self.surface.assembled_force(change, edges)[1] for change in changes])

    def on_component(self, component: BodyComponent) -> ContactOnComponent | None:
        """Return the contact if its surface lies on a component; see `Contact`."""
        if not component.has(self.surface):
            return None
        contact = replace(self, surface=component.surface(self.surface))
        return ContactOnComponent(contact, lambda state: state)

    def _placed(self, placement: RigidPlacement) -> RigidPlacement:
        """Return the placement of this contact's body when the moving ones are at ``placement``."""
        return placement if self.moving else UNMOVED

    def _pulled_back(self, displacement: Array, placement: RigidPlacement) -> Array:
        """Return the points (m, q, 2) in the body's frame, mm."""
        return self._placed(placement).pull_back(self.surface.positions(displacement))


def rigid_contacts(contacts: Iterable[Contact]) -> tuple[RigidContact, ...]:
    """Return those of some contacts that are with rigid outlines."""
    return tuple(c for c in contacts if isinstance(c, RigidContact))


def rigid_responses(responses: Iterable[ContactResponse]) -> tuple[RigidContactResponse, ...]:
    """Return those of some responses that are of contacts with rigid outlines."""
    return tuple(r for r in responses if isinstance(r, RigidContactResponse))
