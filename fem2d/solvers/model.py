"""A body, what holds it and what it touches: unbalanced forces and their derivative."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem2d.body.body import Body, Response
from fem2d.contact.rigid import ContactResponse, RigidContact
from fem2d.contact.self_contact import SelfContact, SelfContactResponse
from fem2d.loads.dead import DeadLoad
from fem2d.loads.tie import ElasticTie
from fem2d.solvers.inertia import Inertia
from fem2d.solvers.newton import Balance, work_of
from fem2d.solvers.state import State
from geometry2d.rigid import UNMOVED, RigidPlacement

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class Energies:
    """Where the energy is at one instant, N mm."""

    strain: float
    tie: float
    penalty: float
    kinetic: float
    load: float


@dataclass(frozen=True)
class SystemBalance(Balance):
    """Unbalanced forces of a system, and what its parts do there.

    Attributes
    ----------
    of_body
        Energy, force and stiffness of the body.
    touching, folded
        What each contact pair, and each contact of the tissue with itself, does; empty where the
        deformation is inadmissible.
    """

    of_body: Response
    touching: tuple[ContactResponse, ...] = ()
    folded: tuple[SelfContactResponse, ...] = ()


@dataclass(frozen=True)
class System:
    """Everything whose forces balance.

    Parameters
    ----------
    body
        The tissue.
    contacts
        Contact pairs with rigid outlines.
    ties
        Elastic ties to bone, or to the moving body.
    inertia
        What resists acceleration.
    folds
        Contacts of the tissue with itself: lip on lip, creases, or an elastic neck meshed with it.
    loads
        Dead loads on the tissue.
    """

    body: Body
    contacts: tuple[RigidContact, ...]
    ties: tuple[ElasticTie, ...]
    inertia: Inertia
    folds: tuple[SelfContact, ...] = ()
    loads: tuple[DeadLoad, ...] = ()
    tie_stiffness: sp.csr_matrix = field(init=False, repr=False, compare=False)
    tie_only: sp.csr_matrix = field(init=False, repr=False, compare=False)
    """The same without the zeros of the body's pattern."""
    mass: sp.csr_matrix = field(init=False, repr=False, compare=False)
    viscosity: sp.csr_matrix = field(init=False, repr=False, compare=False)
    """τ K₀, N s/mm."""

    def __post_init__(self) -> None:
        pattern = self.body.pattern
        data = np.zeros(len(pattern.indices))
        for tie in self.ties:
            dofs, blocks = tie.blocks()
            np.add.at(data, pattern.slots(dofs), blocks)
        object.__setattr__(self, "tie_stiffness", pattern.matrix(data))
        tie_only = self.tie_stiffness.copy()
        tie_only.eliminate_zeros()
        object.__setattr__(self, "tie_only", tie_only)
        mass = self.body.mass(self.inertia.density_tonne_per_mm3)
        object.__setattr__(self, "mass", pattern.matrix(mass))
        undeformed = self.body.response(np.zeros_like(self.body.nodes)).stiffness
        viscosity = pattern.matrix(self.inertia.relaxation_s * undeformed)
        object.__setattr__(self, "viscosity", viscosity)

    def state_at_rest(
        self, time_s: float, placement: RigidPlacement, *, next_step_s: float
    ) -> State:
        """Return the undeformed state, the moving body at ``placement``."""
        zero = np.zeros_like(self.body.nodes)
        histories = tuple(
            c.initial_history(zero, placement if c.moving else UNMOVED) for c in self.contacts
        )
        folds = tuple(fold.initial_history(zero, UNMOVED) for fold in self.folds)
        return State(time_s, placement, zero, zero, zero, histories, next_step_s, folds)

    def with_first_contact(
        self, before: State, displacement: Array, placement: RigidPlacement
    ) -> State:
        """Return the state to start a step from that is expected to lead to ``displacement``.

        Its histories know where tissue that touches nothing yet meets what it touches on its way.
        """
        histories = tuple(
            pair.with_first_contact(history, displacement, placement if pair.moving else UNMOVED)
            for pair, history in zip(self.contacts, before.histories, strict=True)
        )
        folds = tuple(
            fold.with_first_contact(history, before.displacement, displacement)
            for fold, history in zip(self.folds, before.fold_histories, strict=True)
        )
        return replace(before, histories=histories, fold_histories=folds)

    def contact_responses(
        self, displacement: Array, placement: RigidPlacement, before: State
    ) -> tuple[ContactResponse, ...]:
        """Return what each contact pair does at a trial displacement (n, 2), mm."""
        return tuple(
            pair.response(displacement, placement if pair.moving else UNMOVED, history)
            for pair, history in zip(self.contacts, before.histories, strict=True)
        )

    def fold_responses(self, displacement: Array, before: State) -> tuple[SelfContactResponse, ...]:
        """Return what each contact of the tissue with itself does at a trial displacement."""
        return tuple(
            fold.response(displacement, UNMOVED, history)
            for fold, history in zip(self.folds, before.fold_histories, strict=True)
        )

    def balance(
        self,
        displacement: Array,
        placement: RigidPlacement,
        before: State,
        duration_s: float,
        *,
        body_moves_to: RigidPlacement | None = None,
        of_body: Response | None = None,
    ) -> SystemBalance:
        """Return the unbalanced forces at a displacement (n, 2), ``duration_s`` after ``before``.

        With ``body_moves_to`` the moving body is about to go from ``placement`` there, and the
        forces hold what that motion adds to first order. ``of_body`` is the body's response at this
        displacement, if it is known already.
        """
        # Force and tangent together cost little more than force alone; most trials are accepted.
        response = of_body or self.body.response(displacement)
        if not np.isfinite(response.energy):
            nothing = np.full(displacement.size, np.inf)
            return SystemBalance(nothing, 0.0, lambda psd: self.mass, response)
        touching = self.contact_responses(displacement, placement, before)
        contact_force = np.zeros(displacement.size)
        for pair, touch in zip(self.contacts, touching, strict=True):
            np.add.at(contact_force, touch.dofs, touch.force)
            if body_moves_to is not None and pair.moving:
                moved = pair.force_of_moving_body(displacement, placement, body_moves_to, touch)
                np.add.at(contact_force, touch.dofs, moved)
        folded = self.fold_responses(displacement, before)
        for fold in folded:
            np.add.at(contact_force, fold.dofs, fold.force)
        of_anchors, _ = self._pull_of_ties(body_moves_to or placement)
        tie_force = self.tie_only @ displacement.ravel() - of_anchors
        load_force = self.load_force(before.time_s + duration_s)
        residual = response.force + tie_force - contact_force - load_force
        scale = max(float(np.max(np.abs(f))) for f in (contact_force, tie_force, load_force))
        if self.inertia.is_dynamic:
            pull, free = self.inertia.pull(before, duration_s)
            inertial = pull * (self.mass @ (displacement - free).ravel())
            velocity, _ = self.inertia.rates(before, displacement, duration_s)
            residual += inertial + self.viscosity @ velocity.ravel()
            scale = max(scale, float(np.max(np.abs(inertial))))

        def tangent(psd: bool) -> sp.csr_matrix:
            of_body = self.body.response(displacement, psd=True) if psd else response
            stiffness = of_body.stiffness
            if self.inertia.is_dynamic:
                stiffness = stiffness + self.inertia.resistance(
                    self.mass.data, self.viscosity.data, duration_s
                )
            return self._tangent(stiffness, touching, folded, psd=psd)

        return SystemBalance(residual, scale, tangent, response, touching, folded)

    def load_force(self, time_s: float) -> Array:
        """Return the nodal forces (2n,) of the dead loads at a time, s, N."""
        force = np.zeros(2 * len(self.body.nodes))
        for load in self.loads:
            np.add.at(force, load.dofs, load.force(time_s))
        return force

    def static_tangent(
        self,
        of_body: Response,
        touching: tuple[ContactResponse, ...],
        folded: tuple[SelfContactResponse, ...],
    ) -> sp.csr_matrix:
        """Return the tangent (2n, 2n), N/mm, that decides on stability where the parts answered so.

        It leaves out inertia and viscosity, and holds friction that slips at its present value: the
        exact tangent of sliding friction is unsymmetric, and its symmetric part indefinite at
        every point that slides, however stable the tissue is.
        """
        return self._tangent(
            of_body.stiffness,
            tuple(p.held_friction(t) for p, t in zip(self.contacts, touching, strict=True)),
            tuple(f.held_friction(t) for f, t in zip(self.folds, folded, strict=True)),
        )

    def _pull_of_ties(self, placement: RigidPlacement) -> tuple[Array, float]:
        """Return forces (2n,), N, and energy, N mm, that ties to the moving body add."""
        force, energy = np.zeros(2 * len(self.body.nodes)), 0.0
        for tie in self.ties:
            if tie.attached_at is not None:
                dofs, nodal, stored = tie.pull(placement)
                np.add.at(force, dofs, nodal)
                energy += stored
        return force, energy

    def _tangent(
        self,
        of_body: Array,
        touching: tuple[ContactResponse, ...],
        folded: tuple[SelfContactResponse, ...],
        *,
        psd: bool = False,
    ) -> sp.csr_matrix:
        pattern = self.body.pattern
        data = of_body + self.tie_stiffness.data
        for pair, touch in zip(self.contacts, touching, strict=True):
            if touch.edges.size:
                blocks = pair.stiffness(touch, psd=psd)
                np.subtract.at(data, pattern.slots(touch.dofs), blocks)
        matrix = pattern.matrix(data)
        for fold, touch_of_fold in zip(self.folds, folded, strict=True):
            if touch_of_fold.force.size:
                blocks = fold.stiffness(touch_of_fold, psd=psd)
                matrix = _with_blocks(matrix, touch_of_fold.dofs, -blocks)
        return matrix

    def energies(self, state: State, balance: SystemBalance) -> Energies:
        """Return where the energy is in a committed state, whose forces ``balance`` holds."""
        u, v = state.displacement.ravel(), state.velocity.ravel()
        pull, of_anchors = self._pull_of_ties(state.placement)
        return Energies(
            strain=balance.of_body.energy,
            tie=work_of(0.5 * (self.tie_only @ u) - pull, u) + of_anchors,
            penalty=sum(t.energy for t in balance.touching) + sum(t.energy for t in balance.folded),
            kinetic=0.5 * work_of(self.mass @ v, v),
            load=sum(load.energy(state.displacement, state.time_s) for load in self.loads),
        )


def _with_blocks(matrix: sp.csr_matrix, dofs: Index, blocks: Array) -> sp.csr_matrix:
    """Return the matrix with blocks (j, k, k) added that couple unknowns (j, k) of any elements.

    Entries are never dropped, so that the pattern depends only on who touches whom.
    """
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    square = blocks.shape
    more_rows = np.broadcast_to(dofs[:, :, None], square).ravel()
    more_columns = np.broadcast_to(dofs[:, None, :], square).ravel()
    total = sp.coo_matrix(
        (
            np.concatenate([matrix.data, blocks.ravel()]),
            (
                np.concatenate([rows, more_rows]),
                np.concatenate([matrix.indices, more_columns]),
            ),
        ),
        shape=matrix.shape,
    ).tocsr()
    total.sort_indices()
    return total
