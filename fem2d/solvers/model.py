"""A model: body, contacts, ties, loads, supports, inertia. Unbalanced forces and tangent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem2d.body.body import Body, Response
from fem2d.body.fields import Fields
from fem2d.body.overstress import Overstress, viscous_step
from fem2d.contact.contact import Contact, ContactResponse
from fem2d.loads.load import AppliedForce, Load
from fem2d.loads.tie import ElasticTie
from fem2d.materials.prony import PronySeries
from fem2d.solvers.bordered import Border, Tangent
from fem2d.solvers.inertia import QUASI_STATIC, Inertia
from fem2d.solvers.newton import Balance, work_of
from fem2d.solvers.state import State
from fem2d.threads import ONE_THREAD, Threads
from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class Energies:
    """Energies at one instant, N mm."""

    strain: float
    tie: float
    penalty: float
    kinetic: float
    load: float
    hand: float = 0.0


@dataclass(frozen=True, eq=False)
class ModelBalance(Balance):
    """Unbalanced forces of a model at a trial, and the responses of its members.

    Attributes
    ----------
    model, displacement, load, before, duration_s
        The trial: the model, displacement (n, 2), mm, load, the committed state before it and the
        time since then, s (None in statics).
    forces
        (2n,) unbalanced forces without supports, N; in equilibrium, the reactions of the supports.
    body
        Energy, force and stiffness of the body.
    contacts
        Response of each contact; empty where the deformation is inadmissible.
    stiffness
        Builds the derivative (2n, 2n) of ``forces``, or its stand-in; see `Balance.tangent`.
    """

    model: Model
    displacement: Array
    load: Load
    before: State
    duration_s: float | None
    forces: Array
    tangent: Callable[[bool], Tangent]
    body: Response
    contacts: tuple[ContactResponse, ...]
    stiffness: Callable[[bool], sp.csr_matrix]


class FurtherUnknowns(Protocol):
    """Unknowns beside the displacements, each a value of the load, with one equation each.

    For instance a pressure for which a node reaches a position (`fem2d.solvers.static.Steering`).
    What is left of the equations, as forces, N, is a sum: of what the unknowns add by themselves
    and of what the tissue adds, component by component.
    """

    def values(self, load: Load) -> Array:
        """Return the values (m,) of the unknowns in a load."""
        ...

    def applied(self, load: Load, values: Array) -> Load:
        """Return the load with these values (m,) of the unknowns."""
        ...

    def alone(self, load: Load) -> tuple[Array, Array]:
        """Return what the unknowns add by themselves (m,), N, and its derivative by them (m, m)."""
        ...

    def residual(self, trial: ModelBalance) -> Array:
        """Return what the tissue adds (m,), N."""
        ...

    def border(self, trial: ModelBalance, *, psd: bool) -> Border:
        """Return the derivatives of the forces on the tissue and of what the tissue adds.

        With ``psd`` to go with the stand-in of the stiffness.
        """
        ...


@dataclass(frozen=True, eq=False)
class Model:
    """A body and everything that acts on it.

    Parameters
    ----------
    body
        The tissue.
    contacts
        With rigid outlines, and of deformable surfaces: lip on lip, creases, or an elastic neck
        that is a component of the body.
    ties
        Elastic ties to bone, or to the moving rigid bodies.
    loads
        Dead loads and follower pressures on surfaces, muscles.
    held
        (h,) unknowns ``2 * node + component`` whose displacement the load prescribes.
    inertia
        Density and damping; none by default.
    prony
        How the tissue's stress relaxes; an elastic tissue has none. In statics it has relaxed.
    """

    body: Body
    _: KW_ONLY
    contacts: Sequence[Contact] = ()
    ties: Sequence[ElasticTie] = ()
    loads: Sequence[AppliedForce] = ()
    held: Index = field(default_factory=lambda: np.empty(0, np.intp))
    inertia: Inertia = QUASI_STATIC
    prony: PronySeries | None = None

    def __post_init__(self) -> None:
        for name in ("contacts", "ties", "loads"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        object.__setattr__(self, "held", np.asarray(self.held, np.intp))

    def __repr__(self) -> str:
        counts = {"contacts": self.contacts, "ties": self.ties, "loads": self.loads}
        named = ", ".join(f"{len(what)} {name}" for name, what in counts.items() if len(what))
        return f"Model({self.body!r}{', ' if named else ''}{named}, {self.held.size} held unknowns)"

    @cached_property
    def free(self) -> NDArray[np.bool_]:
        """(2n,) which unknowns are not held."""
        free = np.ones(self.body.pattern.size, np.bool_)
        free[self.held] = False
        return free

    @cached_property
    def tie_stiffness(self) -> sp.csr_matrix:
        """(2n, 2n) stiffness of all ties in the body's pattern, N/mm."""
        pattern = self.body.pattern
        data = np.zeros(pattern.nonzeros)
        for tie in self.ties:
            dofs, blocks = tie.blocks()
            np.add.at(data, pattern.slots(dofs), blocks)
        return pattern.matrix(data)

    @cached_property
    def tie_only(self) -> sp.csr_matrix:
        """The same matrix without the zeros of the body's pattern."""
        tie_only = self.tie_stiffness.copy()
        tie_only.eliminate_zeros()
        return tie_only

    @cached_property
    def mass(self) -> sp.csr_matrix:
        """(2n, 2n) mass, tonne."""
        return self.body.pattern.matrix(self.body.mass(self.inertia.density_tonne_per_mm3))

    @cached_property
    def viscosity(self) -> sp.csr_matrix:
        """(2n, 2n) τ K₀, N s/mm."""
        undeformed = self.body.response(np.zeros_like(self.body.nodes)).stiffness
        return self.body.pattern.matrix(self.inertia.relaxation_s * undeformed)

    def at_rest(self, load: Load | None = None, *, next_step_s: float = np.inf) -> State:
        """Return the undeformed state under a load, without friction."""
        load, zero = load or Load(), np.zeros_like(self.body.nodes)
        contacts = self.initial_contacts(zero, load.placement)
        return State(load, zero, zero, zero, contacts, next_step_s, self.relaxed(zero))

    def relaxed(self, displacement: Array) -> Overstress | None:
        """Return what a tissue remembers that has rested at a displacement (n, 2), mm."""
        if self.prony is None:
            return None
        return Overstress.relaxed(self.body, self.prony, displacement)

    def overstress_after(
        self, before: State, displacement: Array, duration_s: float
    ) -> Overstress | None:
        """Return what the tissue remembers of a step, s, to a displacement (n, 2), mm."""
        if self.prony is None or before.overstress is None:
            return None
        return before.overstress.after(self.body, self.prony, displacement, duration_s)

    def fields(self, state: State) -> Fields:
        """Return strains and stresses, those of viscosity included, in a committed state."""
        fields = self.body.fields(state.displacement)
        return fields if state.overstress is None else state.overstress.added_to(fields)

    def initial_contacts(self, displacement: Array, placement: RigidPlacement) -> tuple[Any, ...]:
        """Return states of the contacts at a displacement (n, 2), mm, without friction."""
        return tuple(c.initial_state(displacement, placement) for c in self.contacts)

    def with_first_contact(
        self, before: State, predicted: Array, placement: RigidPlacement
    ) -> State:
        """Return the state from which a step to a predicted displacement (n, 2), mm, starts.

        Its contacts hold the places where points that are open yet meet something on their way.
        """
        contacts = tuple(
            contact.with_first_contact(state, before.displacement, predicted, placement)
            for contact, state in zip(self.contacts, before.contacts, strict=True)
        )
        return replace(before, contacts=contacts)

    def contact_responses(
        self, displacement: Array, placement: RigidPlacement, before: State
    ) -> tuple[ContactResponse, ...]:
        """Return the response of each contact at a trial displacement (n, 2), mm."""
        return tuple(
            contact.evaluate(displacement, placement, state)
            for contact, state in zip(self.contacts, before.contacts, strict=True)
        )

    def balance(
        self,
        displacement: Array,
        load: Load,
        before: State,
        duration_s: float | None = None,
        *,
        further: FurtherUnknowns | None = None,
        bodies_still: bool = False,
        body: Response | None = None,
        threads: Threads = ONE_THREAD,
    ) -> ModelBalance:
        """Return the unbalanced forces at a displacement (n, 2), mm.

        Parameters
        ----------
        displacement
            Trial displacement.
        load
            What acts.
        before
            The committed state before.
        duration_s
            Time since then, s; None in statics, without inertia.
        further
            Unknowns of the load and their equations.
        bodies_still
            Whether contact is evaluated with the moving rigid bodies at their placement before;
            their motion to that of the load then counts to first order.
        body
            The body's response at this displacement, if known.
        threads
            Threads that share the work.
        """
        # Force and tangent together cost little more than force alone; most trials are accepted.
        response = body or self.body.response(displacement, threads=threads)
        if not np.isfinite(response.energy):
            return self._inadmissible(displacement, load, before, duration_s, response, further)
        placement = before.placement if bodies_still else load.placement
        contacts = self.contact_responses(displacement, placement, before)
        tissue, viscous = response, None
        if self.prony is not None and before.overstress is not None and duration_s is not None:
            viscous = viscous_step(self.body, self.prony, before.overstress, duration_s)
            tissue = viscous.response(response, displacement)
        forces, scale = self._unbalanced(
            displacement, load, before, duration_s, tissue, contacts, bodies_still
        )

        def stiffness(psd: bool) -> sp.csr_matrix:
            data = tissue.stiffness
            if psd:
                data = self.body.response(displacement, psd=True, threads=threads).stiffness
                data = data if viscous is None else viscous.stand_in(data)
            if duration_s is not None and self.inertia.is_dynamic:
                data = data + self.inertia.resistance(
                    self.mass.data, self.viscosity.data, duration_s
                )
            return self._stiffness(data, contacts, displacement, load, psd=psd)

        plain = ModelBalance(
            np.where(self.free, forces, 0.0) if self.held.size else forces,
            scale,
            lambda psd: self.eliminated(Tangent(stiffness(psd))),
            self,
            displacement,
            load,
            before,
            duration_s,
            forces,
            response,
            contacts,
            stiffness,
        )
        return plain if further is None else self._bordered(plain, further)

    def _unbalanced(
        self,
        displacement: Array,
        load: Load,
        before: State,
        duration_s: float | None,
        response: Response,
        contacts: tuple[ContactResponse, ...],
        bodies_still: bool,
    ) -> tuple[Array, float]:
        """Return the unbalanced forces (2n,) without supports, and the largest that acts, N."""
        contact_force = np.zeros(displacement.size)
        for contact, touch in zip(self.contacts, contacts, strict=True):
            if not touch.force.size:
                continue
            np.add.at(contact_force, touch.dofs, touch.force)
            if bodies_still:
                moved = contact.force_of_motion(touch, load.placement)
                np.add.at(contact_force, touch.dofs, moved)
        of_anchors, _ = self._pull_of_ties(load.placement)
        tie_force = self.tie_only @ displacement.ravel() - of_anchors
        load_force = self.load_force(displacement, load)
        forces = response.force + tie_force - contact_force - load_force
        acting = [contact_force, tie_force, load_force]
        if duration_s is not None and self.inertia.is_dynamic:
            pull, free = self.inertia.pull(before, duration_s)
            inertial = pull * (self.mass @ (displacement - free).ravel())
            velocity, _ = self.inertia.rates(before, displacement, duration_s)
            forces += inertial + self.viscosity @ velocity.ravel()
            acting.append(inertial)
        acting.append(forces[self.held])
        return forces, max(float(np.max(np.abs(force), initial=0.0)) for force in acting)

    def _inadmissible(
        self,
        displacement: Array,
        load: Load,
        before: State,
        duration_s: float | None,
        response: Response,
        further: FurtherUnknowns | None,
    ) -> ModelBalance:
        """Return the balance of an inadmissible deformation: nothing is finite."""
        count = displacement.size + (0 if further is None else further.values(load).size)
        nothing = np.full(count, np.inf)

        def none(psd: bool) -> Any:
            raise DrinksimError("an inadmissible deformation has no tangent")

        return ModelBalance(
            nothing, 0.0, none, self, displacement, load, before, duration_s, nothing, response,
            (), none,
        )  # fmt: skip

    def _bordered(self, plain: ModelBalance, further: FurtherUnknowns) -> ModelBalance:
        """Return a balance with the equations of further unknowns."""
        alone, corner = further.alone(plain.load)

        def tangent(psd: bool) -> Tangent:
            border = further.border(plain, psd=psd)
            border = replace(border, corner=corner + border.corner)
            return self.eliminated(Tangent(plain.stiffness(psd), border))

        residual = np.concatenate([plain.residual, alone + further.residual(plain)])
        return replace(plain, residual=residual, tangent=tangent)

    def change_of_load(self, balance: ModelBalance, load: Load) -> Array:
        """Return the first-order change of the external forces (2n,), N, to a new load.

        At the displacement of a balance; moving rigid bodies go to the placement of the load.
        """
        here, before = balance.displacement, balance.load
        change = np.zeros(here.size)
        for acting in self.loads:
            change += acting.change(here, before, load)
        change += load.dead_n - before.dead_n
        for contact, touch in zip(self.contacts, balance.contacts, strict=True):
            np.add.at(change, touch.dofs, contact.force_of_motion(touch, load.placement))
        change += self._pull_of_ties(load.placement)[0] - self._pull_of_ties(before.placement)[0]
        return change

    def load_force(self, displacement: Array, load: Load) -> Array:
        """Return the nodal forces (2n,) of surface loads and dead nodal forces, N."""
        force = np.zeros(displacement.size)
        for acting in self.loads:
            force += acting.force(displacement, load)
        return force + load.dead_n

    def eliminated(self, tangent: Tangent) -> Tangent:
        """Return a tangent with 1 at held unknowns and nothing that couples them to others."""
        if not self.held.size:
            return tangent
        matrix, border = tangent.matrix, tangent.border
        row = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
        kept = self.free[row] & self.free[matrix.indices]
        data = np.where(kept, matrix.data, 0.0)
        data[(row == matrix.indices) & ~self.free[row]] = 1.0
        matrix = sp.csr_matrix((data, matrix.indices, matrix.indptr), shape=matrix.shape)
        if border is not None:
            free = self.free
            border = Border(border.columns * free[:, None], border.rows * free, border.corner)
        return Tangent(matrix, border)

    def static_tangent(
        self, state: State, contacts: Sequence[ContactResponse], body: Response | None = None
    ) -> sp.csr_matrix:
        """Return the tangent (2n, 2n), N/mm, that determines the stability of an equilibrium.

        It leaves out inertia and viscosity, and holds friction that slips at its present value: the
        exact tangent of sliding friction is unsymmetric, and its symmetric part indefinite at
        every point that slides, however stable the tissue is.

        Parameters
        ----------
        state
            The equilibrium.
        contacts
            Response of each contact in it.
        body
            The body's response there, if known.
        """
        here = state.displacement
        response = body or self.body.response(here)
        held = tuple(touch.contact.held_friction(touch) for touch in contacts)
        stiffness = self._stiffness(response.stiffness, held, here, state.load)
        return self.eliminated(Tangent(stiffness)).matrix

    def _pull_of_ties(self, placement: RigidPlacement) -> tuple[Array, float]:
        """Return forces (2n,), N, and energy, N mm, that ties to the moving bodies add."""
        force, energy = np.zeros(2 * len(self.body.nodes)), 0.0
        for tie in self.ties:
            if tie.attached_at is not None:
                dofs, nodal, stored = tie.pull(placement)
                np.add.at(force, dofs, nodal)
                energy += stored
        return force, energy

    def _stiffness(
        self,
        body: Array,
        contacts: tuple[ContactResponse, ...],
        displacement: Array,
        load: Load,
        *,
        psd: bool = False,
    ) -> sp.csr_matrix:
        """Return the stiffness of body (its data, inertia included), ties, contacts and loads."""
        pattern = self.body.pattern
        data = body + self.tie_stiffness.data
        touching = [
            pair for pair in zip(self.contacts, contacts, strict=True) if pair[1].force.size
        ]
        for contact, touch in touching:
            if contact.within_elements:
                blocks = contact.tangent(touch, psd=psd)
                np.subtract.at(data, pattern.slots(touch.dofs), blocks)
        for force in self.loads:
            force.add_stiffness(data, pattern, displacement, load, psd=psd)
        matrix = pattern.matrix(data)
        for contact, touch in touching:
            if not contact.within_elements:
                matrix = _with_blocks(matrix, touch.dofs, -contact.tangent(touch, psd=psd))
        return matrix

    def energies(self, state: State, balance: ModelBalance) -> Energies:
        """Return the energies of a committed state, given its balance."""
        u, v = state.displacement.ravel(), state.velocity.ravel()
        pull, of_anchors = self._pull_of_ties(state.placement)
        loads = sum(load.energy(state.displacement, state.load) for load in self.loads)
        return Energies(
            strain=balance.body.energy,
            tie=work_of(0.5 * (self.tie_only @ u) - pull, u) + of_anchors,
            penalty=sum(touch.energy for touch in balance.contacts),
            kinetic=0.5 * work_of(self.mass @ v, v),
            load=loads - float(np.sum(state.load.dead_n * u)),
        )


def _with_blocks(matrix: sp.csr_matrix, dofs: Index, blocks: Array) -> sp.csr_matrix:
    """Return the matrix with blocks (j, k, k) added that couple unknowns (j, k) of any elements.

    Zeros are kept, so that the pattern depends only on what touches what.
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
