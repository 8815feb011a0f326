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
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import BodyComponent
from fem2d.body.surface import Surface
from fem2d.contact.contact import Contact, ContactOnComponent, ContactResponse
from fem2d.contact.gap import point_gap
from fem2d.contact.laws import (
    DEFAULT_FRICTION,
    DEFAULT_NORMAL,
    FrictionLaw,
    NormalLaw,
    pressure_of_gap,
    traction_of_slip,
)
from fem2d.contact.search import DEFAULT_SEARCH, SearchSettings
from geometry2d.compiled import compiled
from geometry2d.outline import Outline, project_point
from geometry2d.rigid import UNMOVED, RigidPlacement, rotated

Array = NDArray[np.float64]
Index = NDArray[np.intp]

REACH_MM = 1.0
"""Points farther than this from the outline's box are not projected: they cannot touch it."""

SURELY_OPEN_MM = 0.1
"""A point between nodes is not projected if the gap of a node proves it farther away than this."""

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


@dataclass(frozen=True)
class RigidContactPoints:
    """Values at the points of a contact, arrays (m, q) unless stated.

    Pressure and shear are per reference length here; divide by the surface stretch for true values.
    """

    gap: Array
    """Signed distance, mm; a lower bound of it farther than `REACH_MM` from the outline's box, and
    between nodes farther than `SURELY_OPEN_MM`."""
    normal: Array
    """(m, q, 2) outward normal of the rigid body, in the tissue's frame; zero out of reach."""
    pressure: Array
    shear: Array
    slipping: NDArray[np.bool_]
    outline_arc: Array
    traction: Array
    """(m, q, 2) traction on the tissue, MPa per reference length."""
    slope: Array
    """(m, q, 2, 2) derivative of the traction with respect to the position, MPa/mm."""
    psd_slope: Array
    """(m, q, 2, 2) symmetric, negative semi-definite stand-in for it: the penalty along the normal
    and the sticking resistance along the tangent, without the turning of the normal."""


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
        met = _where_met(
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
        raw = _evaluate(
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


@compiled
def _where_met(
    before: Array,
    after: Array,
    start: Array,
    curvature: Array,
    centre: Array,
    breaks: Array,
    box: Array,
    gap_offset: Array,
    entry_trials: int,
) -> Array:
    """Return where points (n, 2) that go straight from ``before`` to ``after`` enter the outline.

    All in the body's frame. Points that do not enter are returned as they were before.
    """
    met = before.copy()
    for i in range(before.shape[0]):
        x, y = before[i, 0], before[i, 1]
        end_x, end_y = after[i, 0], after[i, 1]
        if end_x < box[0] or end_x > box[2] or end_y < box[1] or end_y > box[3]:
            continue
        end = project_point(end_x, end_y, start, curvature, centre, breaks)[0] + gap_offset[i]
        if end >= 0.0:
            continue
        beginning = project_point(x, y, start, curvature, centre, breaks)[0] + gap_offset[i]
        if beginning <= 0.0:
            continue
        outside, gap_outside, inside, gap_inside = 0.0, beginning, 1.0, end
        for _ in range(entry_trials):
            share = outside + (inside - outside) * gap_outside / (gap_outside - gap_inside)
            met[i, 0], met[i, 1] = x + share * (end_x - x), y + share * (end_y - y)
            gap = project_point(met[i, 0], met[i, 1], start, curvature, centre, breaks)[0]
            gap += gap_offset[i]
            if gap > 0.0:
                outside, gap_outside = share, gap
            else:
                inside, gap_inside = share, gap
    return met


@compiled
def _evaluate(
    position: Array,
    body_before: Array,
    traction_before: Array,
    angle: float,
    shift_x: float,
    shift_y: float,
    start: Array,
    curvature: Array,
    centre: Array,
    breaks: Array,
    box: Array,
    normal_stiffness: float,
    ramp: float,
    is_between: NDArray[np.bool_],
    gap_offset: Array,
    coefficient: float,
    tangential_stiffness: float,
) -> tuple[NDArray[Any], ...]:
    """Evaluate all points; see `RigidContactPoints` for the meaning of what is returned."""
    count = position.shape[0]
    energy = np.zeros(count)
    gap = np.empty(count)
    normal = np.zeros((count, 2))
    pressure = np.zeros(count)
    shear = np.zeros(count)
    slipping = np.zeros(count, np.bool_)
    arc = np.zeros(count)
    body = np.empty((count, 2))
    traction = np.zeros((count, 2))
    slope = np.zeros((count, 2, 2))
    safe = np.zeros((count, 2, 2))
    cosine, sine = np.cos(angle), np.sin(angle)
    node = 0
    for i in range(count):
        dx, dy = position[i, 0] - shift_x, position[i, 1] - shift_y
        body[i, 0], body[i, 1] = cosine * dx + sine * dy, -sine * dx + cosine * dy
        if is_between[i]:
            # The gap changes by no more than the distance between the two points.
            away = np.hypot(position[i, 0] - position[node, 0], position[i, 1] - position[node, 1])
            gap[i] = gap[node] - away
            if gap[i] > SURELY_OPEN_MM:
                continue
        else:
            node = i
        beside = max(box[0] - body[i, 0], body[i, 0] - box[2], 0.0)
        above = max(box[1] - body[i, 1], body[i, 1] - box[3], 0.0)
        gap[i] = np.hypot(beside, above)
        if gap[i] > REACH_MM:
            continue
        g, nx, ny, h, arc[i], body[i, 0], body[i, 1], slip, travel = point_gap(
            position[i, 0],
            position[i, 1],
            cosine,
            sine,
            shift_x,
            shift_y,
            body_before[i, 0],
            body_before[i, 1],
            start,
            curvature,
            centre,
            breaks,
        )
        gap[i] = g
        normal[i, 0], normal[i, 1] = nx, ny
        psi, p, dp = pressure_of_gap(g + gap_offset[i], normal_stiffness, ramp)
        if p == 0.0:
            continue
        energy[i] = psi
        pressure[i] = p
        tau, by_slip, by_pressure, slipping[i] = traction_of_slip(
            traction_before[i], slip, p, coefficient, tangential_stiffness
        )
        shear[i] = tau
        tx, ty = -ny, nx
        traction[i, 0] = p * nx + tau * tx
        traction[i, 1] = p * ny + tau * ty
        # d(p n) = (p' n nᵀ + p h t tᵀ) dx
        # d(τ t) = (t (∂τ/∂s (1 − h n·Δy) tᵀ + ∂τ/∂p p' nᵀ) − τ h n tᵀ) dx
        along = by_slip * (1.0 - h * travel)
        across = by_pressure * dp
        slope[i, 0, 0] = (
            dp * nx * nx + (p * h + along) * tx * tx + tx * across * nx - tau * h * nx * tx
        )
        slope[i, 0, 1] = (
            dp * nx * ny + (p * h + along) * tx * ty + tx * across * ny - tau * h * nx * ty
        )
        slope[i, 1, 0] = (
            dp * ny * nx + (p * h + along) * ty * tx + ty * across * nx - tau * h * ny * tx
        )
        slope[i, 1, 1] = (
            dp * ny * ny + (p * h + along) * ty * ty + ty * across * ny - tau * h * ny * ty
        )
        safe[i, 0, 0] = dp * nx * nx + by_slip * tx * tx
        safe[i, 0, 1] = dp * nx * ny + by_slip * tx * ty
        safe[i, 1, 0] = safe[i, 0, 1]
        safe[i, 1, 1] = dp * ny * ny + by_slip * ty * ty
    return energy, gap, normal, pressure, shear, slipping, arc, body, traction, slope, safe
