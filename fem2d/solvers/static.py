"""Static equilibrium of a held body under loads and in contact, also beyond limit points.

Two things can steer a step: the load, or the displacement of one unknown, for which the pressure
is then solved too (Batoz and Dhatt 1979: two right-hand sides and one factorisation). The second
goes round the limit point of a pressure, where the first ends because no equilibrium lies nearby.
Held unknowns are eliminated, so what holds the body is rigid. Where they are moved, the move enters
through a linear solve for the whole body: moving them alone would turn elements inside out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from fem2d.body.body import Body
from fem2d.contact.rigid import ContactHistory, ContactResponse, RigidContact
from fem2d.loads.pressure import FollowerPressure
from fem2d.solvers.linear import DirectSolver, SingularMatrixError, fastest_solver
from fem2d.solvers.newton import Balance, NewtonSettings, NewtonStatus, solve
from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import UNMOVED, RigidPlacement

Array = NDArray[np.float64]
Index = NDArray[np.intp]

HALVINGS = 9
"""A step that fails this many times when halved leads nowhere."""
ROUNDING_MM = 1e-12
NEWTON = NewtonSettings(tolerance=1e-8, force_floor_n=1e-9)
SNAPPING = replace(NEWTON, iterations=40, patience=40)
"""For what touches nothing: it remembers no path, so it may snap, forces growing, in one step."""


class StaticsError(DrinksimError):
    """A static problem was described in a way that makes no sense."""


class Load(NamedTuple):
    """What acts.

    A pressure (suction is negative), where the moving rigid body is, where the held unknowns are,
    (h,) or one for all, and dead nodal forces, (2n,) or 0.
    """

    pressure_mpa: float = 0.0
    placement: RigidPlacement = UNMOVED
    held_mm: Array | float = 0.0
    dead_n: Array | float = 0.0

    def towards(self, other: Load, share: float) -> Load:
        """Return the load a share (0…1) of the way to another one."""
        a, b = self.placement, other.placement
        shift = (1 - share) * np.asarray(a.shift_mm) + share * np.asarray(b.shift_mm)
        return Load(
            (1 - share) * self.pressure_mpa + share * other.pressure_mpa,
            RigidPlacement(
                (1 - share) * a.angle_rad + share * b.angle_rad, (float(shift[0]), float(shift[1]))
            ),
            (1 - share) * self.held_mm + share * other.held_mm,
            (1 - share) * self.dead_n + share * other.dead_n,
        )


@dataclass(frozen=True)
class Settled:
    """Where one search for equilibrium ended.

    Attributes
    ----------
    status
        Whether the forces balance.
    displacement
        (n, 2), mm.
    load
        The load at which it was searched; the pressure found where a displacement steered.
    contacts
        What each contact pair does there; their histories are those of the next step.
    reaction
        (2n,) internal less external forces, N: what holds the body at its held unknowns.
    iterations
        Linear systems solved.
    """

    status: NewtonStatus
    displacement: Array
    load: Load
    contacts: tuple[ContactResponse, ...]
    reaction: Array
    iterations: int

    @property
    def found(self) -> bool:
        """Whether the forces balance."""
        return self.status is NewtonStatus.CONVERGED

    @property
    def histories(self) -> tuple[ContactHistory, ...]:
        """What friction remembers."""
        return tuple(touch.history for touch in self.contacts)


class Reach(NamedTuple):
    """The displacement that one unknown is to reach, mm, by whatever pressure that takes."""

    unknown: int
    value_mm: float


@dataclass(frozen=True)
class StaticSystem:
    """A body, what holds it, what it touches and what presses on it.

    Parameters
    ----------
    body
        The tissue.
    held
        (h,) unknowns ``2 * node + component`` whose displacement the load prescribes.
    contacts
        Contact pairs with rigid outlines.
    pressures
        Surfaces on which the load's pressure acts.
    """

    body: Body
    held: Index
    contacts: tuple[RigidContact, ...] = ()
    pressures: tuple[FollowerPressure, ...] = ()
    free: NDArray[np.bool_] = field(init=False, repr=False, compare=False)
    """(2n,) which unknowns are not held."""
    _crossed_out: NDArray[np.bool_] = field(init=False, repr=False, compare=False)
    _held_diagonal: Index = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        pattern = self.body.pattern
        free = np.ones(pattern.size, bool)
        free[self.held] = False
        row = np.repeat(np.arange(pattern.size), np.diff(pattern.indptr))
        crossed = ~(free[row] & free[pattern.indices])
        diagonal = np.flatnonzero((row == pattern.indices) & ~free[row])
        for name, value in (
            ("free", free),
            ("_crossed_out", crossed),
            ("_held_diagonal", diagonal),
        ):
            object.__setattr__(self, name, value)

    def undeformed(self, load: Load | None = None) -> Settled:
        """Return the body at rest, before anything acts."""
        return self.kept_at(np.zeros_like(self.body.nodes), load or Load())

    def kept_at(self, displacement: Array, load: Load) -> Settled:
        """Return the body at a displacement (n, 2), mm, kept there by dead forces if need be.

        Raises
        ------
        StaticsError
            If an element is turned inside out there.
        """
        histories = tuple(c.initial_history(displacement, self._at(c, load)) for c in self.contacts)
        load = load._replace(held_mm=displacement.flat[self.held], dead_n=0.0)
        residual = self._residual(displacement, load, histories)
        if residual is None:
            raise StaticsError("nothing can be kept where an element is turned inside out")
        keeping = np.where(self.free, residual.forces, 0.0)
        return Settled(
            NewtonStatus.CONVERGED,
            displacement,
            load._replace(dead_n=keeping),
            residual.touching,
            residual.forces - keeping,
            0,
        )

    def tangent(self, settled: Settled) -> sp.csr_matrix:
        """Return the derivative (2n, 2n) of the unbalanced forces, N/mm, held unknowns as 1."""
        return self._eliminated(
            self._stiffness(settled.displacement, settled.load, settled.contacts)
        )

    def balance(
        self, displacement: Array, load: Load, before: tuple[ContactHistory, ...]
    ) -> Balance:
        """Return the unbalanced forces at a displacement (n, 2), mm; none at held unknowns."""
        residual = self._residual(displacement, load, before)
        if residual is None:
            nothing = np.full(displacement.size, np.inf)
            return Balance(nothing, 0.0, lambda psd: self.body.pattern.matrix(nothing))
        return Balance(
            np.where(self.free, residual.forces, 0.0),
            residual.scale,
            lambda psd: self._eliminated(
                self._stiffness(displacement, load, residual.touching, psd=psd)
            ),
        )

    def predicted(self, before: Settled, load: Load, *, solver: DirectSolver) -> Array:
        """Return where the body goes to first order when the load becomes ``load``, (n, 2), mm."""
        here = before.displacement
        move = np.zeros(here.size)
        move[self.held] = load.held_mm - here.flat[self.held]
        change = (load.pressure_mpa - before.load.pressure_mpa) * self.pressure_force(here)
        change += load.dead_n - before.load.dead_n
        for pair, touch in zip(self.contacts, before.contacts, strict=True):
            if pair.moving:
                moved = pair.force_of_moving_body(
                    here, before.load.placement, load.placement, touch
                )
                np.add.at(change, touch.dofs, moved)
        stiffness = self._stiffness(here, before.load, before.contacts)
        change -= stiffness @ move
        unpredicted: Array = here + move.reshape(-1, 2)
        try:
            solver.factorise(self._eliminated(stiffness))
            step = solver.solve(np.where(self.free, change, move))
        except SingularMatrixError:
            return unpredicted
        there: Array = here + step.reshape(-1, 2)
        return there if np.isfinite(self.body.energy_and_force(there).energy) else unpredicted

    def pressure_force(self, displacement: Array) -> Array:
        """Return the nodal forces (2n,) of a pressure of 1 MPa, N/MPa."""
        force = np.zeros(displacement.size)
        for pressure in self.pressures:
            np.add.at(force, pressure.dofs, pressure.unit_force(displacement))
        return force

    def _at(self, pair: RigidContact, load: Load) -> RigidPlacement:
        return load.placement if pair.moving else UNMOVED

    def _touching(
        self, displacement: Array, load: Load, before: tuple[ContactHistory, ...]
    ) -> tuple[ContactResponse, ...]:
        return tuple(
            pair.response(displacement, self._at(pair, load), history)
            for pair, history in zip(self.contacts, before, strict=True)
        )

    def _residual(
        self, displacement: Array, load: Load, before: tuple[ContactHistory, ...]
    ) -> _Residual | None:
        """Return the unbalanced forces, or None if the deformation is inadmissible."""
        response = self.body.energy_and_force(displacement)
        if not np.isfinite(response.energy):
            return None
        contact = np.zeros(displacement.size)
        touching = self._touching(displacement, load, before)
        for touch in touching:
            np.add.at(contact, touch.dofs, touch.force)
        per_mpa = self.pressure_force(displacement)
        pressing = load.pressure_mpa * per_mpa
        rest = response.force - contact - pressing - load.dead_n
        acting = (contact, pressing, load.dead_n, rest[self.held])
        scale = max(float(np.max(np.abs(force), initial=0.0)) for force in acting)
        return _Residual(rest, float(np.max(np.abs(rest[self.free]))), scale, per_mpa, touching)

    def _stiffness(
        self,
        displacement: Array,
        load: Load,
        touching: tuple[ContactResponse, ...],
        *,
        psd: bool = False,
    ) -> sp.csr_matrix:
        pattern = self.body.pattern
        data = self.body.response(displacement, psd=psd).stiffness
        for pair, touch in zip(self.contacts, touching, strict=True):
            if touch.edges.size:
                np.subtract.at(data, pattern.slots(touch.dofs), pair.stiffness(touch, psd=psd))
        if load.pressure_mpa != 0 and not psd:
            for pressure in self.pressures:
                blocks = load.pressure_mpa * pressure.unit_stiffness(displacement)
                np.subtract.at(data, pattern.slots(pressure.dofs), blocks)
        return pattern.matrix(data)

    def _eliminated(self, stiffness: sp.csr_matrix) -> sp.csr_matrix:
        """Return the stiffness with 1 at held unknowns and nothing that couples them to others."""
        data = stiffness.data.copy()
        data[self._crossed_out] = 0.0
        data[self._held_diagonal] = 1.0
        return self.body.pattern.matrix(data)


class _Residual(NamedTuple):
    """Unbalanced forces (2n,) and what they consist of.

    The largest of the free ones, the largest that acts, the forces of a unit pressure, and what
    the contacts do.
    """

    forces: Array
    largest: float
    scale: float
    per_mpa: Array
    touching: tuple[ContactResponse, ...]


def settle(
    system: StaticSystem,
    before: Settled,
    load: Load,
    *,
    solver: DirectSolver,
    reach: Reach | None = None,
    guess: Array | None = None,
) -> Settled:
    """Return the equilibrium at ``load`` that Newton's method finds from ``before``, in one step.

    Parameters
    ----------
    system
        What is to be in balance.
    before
        The equilibrium before; friction remembers it.
    load
        The load; with ``reach`` its pressure is only where the search for the pressure starts.
    solver
        For the linear systems.
    reach
        The displacement that steers instead of the pressure.
    guess
        (n, 2) where to start, mm; ``before`` if absent.
    """
    if reach is not None:
        return _reached(system, before, load, reach, solver)
    start = system.predicted(before, load, solver=solver) if guess is None else guess
    result, _ = solve(
        lambda u: system.balance(u, load, before.histories),
        start,
        solver=solver,
        settings=NEWTON if system.contacts else SNAPPING,
    )
    residual = system._residual(result.displacement, load, before.histories)
    touching, reaction = before.contacts, before.reaction
    if residual is not None:
        touching, reaction = residual.touching, residual.forces
    return Settled(result.status, result.displacement, load, touching, reaction, result.iterations)


def _reached(
    system: StaticSystem, before: Settled, load: Load, reach: Reach, solver: DirectSolver
) -> Settled:
    """Return the equilibrium at which an unknown has a given value, with the pressure it takes."""
    displacement, iterations = before.displacement, 0
    status = NewtonStatus.TOO_MANY_ITERATIONS
    residual = system._residual(displacement, load, before.histories)
    assert residual is not None  # an equilibrium is admissible
    while iterations < NEWTON.iterations:
        arrived = abs(displacement.flat[reach.unknown] - reach.value_mm) < ROUNDING_MM
        if arrived and residual.largest <= NEWTON.tolerance * residual.scale:
            status = NewtonStatus.CONVERGED
            break
        try:
            stiffness = system._stiffness(displacement, load, residual.touching)
            solver.factorise(system._eliminated(stiffness))
            step = -solver.solve(np.where(system.free, residual.forces, 0.0))
            by_pressure = solver.solve(np.where(system.free, residual.per_mpa, 0.0))
        except SingularMatrixError:
            status = NewtonStatus.SINGULAR
            break
        missing = reach.value_mm - displacement.flat[reach.unknown] - step[reach.unknown]
        pressure = missing / by_pressure[reach.unknown]
        step += pressure * by_pressure
        load = load._replace(pressure_mpa=load.pressure_mpa + pressure)
        iterations += 1
        trial = _admissible(system, displacement, step.reshape(-1, 2), load, before.histories)
        if trial is None:
            status = NewtonStatus.INADMISSIBLE
            break
        displacement, residual = trial
    return Settled(status, displacement, load, residual.touching, residual.forces, iterations)


def _admissible(
    system: StaticSystem,
    displacement: Array,
    step: Array,
    load: Load,
    before: tuple[ContactHistory, ...],
) -> tuple[Array, _Residual] | None:
    """Return where a step leads, shortened until nothing is turned inside out."""
    for share in (1.0, 0.5, 0.25, 0.125):
        trial = displacement + share * step
        residual = system._residual(trial, load, before)
        if residual is not None:
            return trial, residual
    return None


def advance(
    system: StaticSystem, before: Settled, load: Load, *, solver: DirectSolver
) -> Iterator[Settled]:
    """Yield the equilibria on the way from ``before`` to ``load``, the last one at ``load``.

    A step that fails is halved and tried again; if even the shortest fails, the last equilibrium
    yielded is short of ``load`` and the one after it, not found, says why.
    """
    done, step = 0.0, 1.0
    state, start = before, before.load
    while done < 1.0:
        goal = min(1.0, done + step)
        trial = settle(system, state, start.towards(load, goal), solver=solver)
        if trial.found:
            yield trial
            state, done, step = trial, goal, min(2 * step, 1.0)
        elif step > 2.0**-HALVINGS:
            step /= 2
        else:
            yield trial
            return


def equilibrium(
    body: Body,
    held: ArrayLike,
    held_mm: ArrayLike = 0.0,
    *,
    dead_n: ArrayLike = 0.0,
    start: ArrayLike = 0.0,
) -> Settled:
    """Return the equilibrium of a body that touches nothing, or how the search for it failed.

    Parameters
    ----------
    body
        The body.
    held
        (h,) unknowns ``2 * node + component`` that are held.
    held_mm
        (h,) or one displacement for all of them, mm.
    dead_n
        (2n,) dead nodal forces, N, or 0.
    start
        (n, 2) displacements to start from, mm, or 0; what keeps it there is taken away gradually.
    """
    system = StaticSystem(body, np.asarray(held, np.intp))
    state = system.kept_at(np.broadcast_to(np.asarray(start, float), body.nodes.shape), Load())
    load = Load(held_mm=np.asarray(held_mm, float), dead_n=np.asarray(dead_n, float))
    *_, last = advance(system, state, load, solver=fastest_solver())
    return last


def eigenvalue_nearest_zero(
    system: StaticSystem, settled: Settled, *, solver: DirectSolver
) -> float:
    """Return the eigenvalue of the tangent that is nearest to zero, N/mm; nan if none is found.

    It passes through zero where an equilibrium is lost: at a limit point of the load or at a
    bifurcation. Held unknowns are left out.
    """
    tangent = system.tangent(settled)
    try:
        solver.factorise(tangent)
    except SingularMatrixError:
        return 0.0
    size = len(system.free)

    def inverse(vector: Array) -> Array:
        return solver.solve(np.where(system.free, vector.ravel(), 0.0))

    operator = LinearOperator((size, size), matvec=inverse, dtype=float)
    start = np.where(system.free, 1.0, 0.0)
    try:
        largest = eigs(operator, k=1, which="LM", v0=start, return_eigenvectors=False, tol=1e-6)
    except ArpackNoConvergence:
        return float("nan")
    return float((1.0 / largest[0]).real)
