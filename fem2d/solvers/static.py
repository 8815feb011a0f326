"""Static equilibrium under loads and in contact, also beyond limit points.

A step prescribes the load, or the displacement of one unknown, and the pressure is then solved for
(`Steering`). The second passes the limit point of a pressure, where the first ends because no
equilibrium lies nearby. Held unknowns are eliminated: supports are rigid. Where they move, the
predictor moves the whole body with them; moving them alone would turn elements inside out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from fem2d.contact.contact import ContactResponse
from fem2d.loads.load import Load
from fem2d.loads.pressure import FollowerPressure
from fem2d.solvers.bordered import Border, BorderedSolver
from fem2d.solvers.linear import EXACT, DirectSolver, SingularMatrixError, fastest_solver
from fem2d.solvers.model import FurtherUnknowns, Model, ModelBalance
from fem2d.solvers.newton import NewtonResult, NewtonStatus
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.prediction import (
    Departure,
    predicted,
    predicted_together,
    with_supports_moved,
)
from fem2d.solvers.state import State
from fem2d.solvers.step import Trial, balanced, from_prediction
from fem2d.threads import ONE_THREAD, Threads
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting

Array = NDArray[np.float64]


STATIC_NEWTON = NewtonSettings(tolerance=1e-8, force_floor_n=1e-9)


class StaticsError(DrinksimError):
    """A static problem is described in a way that makes no sense."""


class StaticStatus(Enum):
    """How a search for equilibrium ended; the value is a message."""

    CONVERGED = "the forces balance under the load"
    STEP_FAILED = "the forces did not come into balance in the step"
    STEP_TOO_SMALL = "the load's step became too small without the forces coming into balance"


@dataclass(frozen=True)
class StaticSettings:
    """How equilibria are searched for.

    Parameters
    ----------
    newton
        Settings of Newton's method in a model with contact.
    free_iterations
        Iterations and patience of Newton's method in a model without contact. It has no memory of
        its path, so it may snap within one step, during which the forces grow.
    halvings
        Largest number of halvings of the step of a load.
    first_contact
        Whether a point that meets something within a step sticks from there on. Otherwise its slip
        counts from the start of the step.
    """

    newton: NewtonSettings = STATIC_NEWTON
    free_iterations: int = setting(
        default=40,
        minimum=1,
        maximum=1000,
        description="largest number of iterations in a step of a model without contact",
    )
    halvings: int = setting(
        default=9, minimum=0, maximum=50, description="largest number of halvings of a load's step"
    )
    first_contact: bool = setting(
        default=True,
        description="whether a point sticks from where it meets something within a step",
    )

    def newton_for(self, model: Model) -> NewtonSettings:
        """Return Newton's settings for a model."""
        if model.contacts:
            return self.newton
        count = self.free_iterations
        return replace(self.newton, iterations=count, patience=count)


@dataclass(frozen=True, eq=False)
class StaticResult:
    """Result of a search for equilibrium.

    Attributes
    ----------
    status
        How the search ended.
    state
        The equilibrium; if the search failed, the last one before.
    balance
        The balance there.
    newton
        Result of Newton's method in the last step that was tried.
    """

    status: StaticStatus
    state: State
    balance: ModelBalance
    newton: NewtonResult

    @property
    def converged(self) -> bool:
        """Whether the forces balance under the whole load."""
        return self.status is StaticStatus.CONVERGED

    @property
    def displacement(self) -> Array:
        """(n, 2), mm."""
        return self.state.displacement

    @property
    def load(self) -> Load:
        """The load; with the pressure found if a `Steering` was given."""
        return self.state.load

    @property
    def contacts(self) -> tuple[ContactResponse, ...]:
        """Response of each contact."""
        return self.balance.contacts

    @property
    def reaction(self) -> Array:
        """(2n,) forces of the supports on the held unknowns, N; elsewhere the unbalanced ones."""
        return self.balance.forces

    @property
    def iterations(self) -> int:
        """Iterations of Newton's method in the last step."""
        return self.newton.iterations

    def __repr__(self) -> str:
        largest = float(np.max(np.linalg.norm(self.displacement, axis=1)))
        return f"StaticResult({self.status.name}, largest displacement {largest:.4g} mm)"


@dataclass(frozen=True)
class Steering:
    """A displacement that one unknown reaches, for which the pressure is solved.

    Parameters
    ----------
    unknown
        ``2 * node + component``.
    value_mm
        Its displacement, mm.
    stiffness_n_per_mm
        Scale that makes a force of the missing displacement, N/mm.
    """

    unknown: int
    value_mm: float
    stiffness_n_per_mm: float = 1.0

    def values(self, load: Load) -> Array:
        """Return the pressure (1,), MPa."""
        return np.array([load.pressure_mpa])

    def applied(self, load: Load, values: Array) -> Load:
        """Return the load with a pressure (1,), MPa."""
        return replace(load, pressure_mpa=float(values[0]))

    def alone(self, load: Load) -> tuple[Array, Array]:
        """Return that the pressure by itself moves nothing."""
        return np.zeros(1), np.zeros((1, 1))

    def residual(self, trial: ModelBalance) -> Array:
        """Return the missing displacement (1,) as a force, N."""
        missing = trial.displacement.flat[self.unknown] - self.value_mm
        return np.array([self.stiffness_n_per_mm * missing])

    def border(self, trial: ModelBalance, *, psd: bool) -> Border:
        """Return the derivatives of the forces and of the missing displacement."""
        per_mpa = np.zeros(trial.displacement.size)
        for load in trial.model.loads:
            if isinstance(load, FollowerPressure):
                per_mpa += load.surface.scattered(load.unit_force(trial.displacement))
        row = np.zeros((1, per_mpa.size))
        row[0, self.unknown] = self.stiffness_n_per_mm
        return Border(-per_mpa[:, None], row, np.zeros((1, 1)))


def kept_at(model: Model, displacement: ArrayLike = 0.0, load: Load | None = None) -> StaticResult:
    """Return the model in equilibrium at a displacement (n, 2), mm, kept there by dead forces.

    Raises
    ------
    StaticsError
        If the displacement is inadmissible.
    """
    there = np.array(np.broadcast_to(np.asarray(displacement, float), model.body.nodes.shape))
    load = replace(load or Load(), held_mm=there.flat[model.held], dead_n=0.0)
    before = replace(
        model.at_rest(load), displacement=there,
        contacts=model.initial_contacts(there, load.placement),
    )  # fmt: skip
    unkept = model.balance(there, load, before)
    if not np.isfinite(unkept.body.energy):
        raise StaticsError("the displacement turns an element inside out: give an admissible one")
    load = replace(load, dead_n=np.where(model.free, unkept.forces, 0.0))
    balance = model.balance(there, load, before, body=unkept.body)
    nothing = NewtonResult(NewtonStatus.CONVERGED, there, there, np.empty(0), (0.0,), 0.0)
    return _committed(balance, nothing)


def solve_static(
    model: Model,
    load: Load,
    *,
    start: StaticResult | None = None,
    solver: DirectSolver | None = None,
    settings: StaticSettings | None = None,
    threads: Threads | None = None,
) -> StaticResult:
    """Return the equilibrium under a load.

    Parameters
    ----------
    model
        The model.
    load
        The load.
    start
        The equilibrium before, on which friction depends; the undeformed model by default.
    solver
        For the linear systems; by default the fastest that is installed.
    settings
        How equilibria are searched for.
    threads
        Threads that share the work.

    Examples
    --------
    >>> import skfem
    >>> from fem2d.body.body import Body
    >>> from fem2d.materials.neo_hookean import NeoHookean
    >>> square = skfem.MeshTri().with_boundaries({"low": lambda x: x[1] == 0})
    >>> body = Body(square, NeoHookean(0.005, poisson=0.49), plane="strain")
    >>> model = Model(body, held=body.dofs("low"))
    >>> solve_static(model, Load()).converged
    True
    """
    *_, last = static_path(
        model, load, start=start, solver=solver, settings=settings, threads=threads
    )
    return last


def static_path(
    model: Model,
    load: Load,
    *,
    start: StaticResult | None = None,
    solver: DirectSolver | None = None,
    settings: StaticSettings | None = None,
    threads: Threads | None = None,
) -> Iterator[StaticResult]:
    """Yield the equilibria on the way to a load, the last one under it.

    The whole load is tried in one step. A step that fails is halved; one that succeeds is followed
    by one twice as long. If the shortest step fails, the last result has the status
    ``STEP_TOO_SMALL`` and the state of the result before it. Parameters are those of
    `solve_static`.
    """
    settings, solver = settings or StaticSettings(), solver or fastest_solver()
    threads = threads or Threads()
    state = start or kept_at(model)
    begin, done, step = state.load, 0.0, 1.0
    while done < 1.0:
        goal = min(1.0, done + step)
        trial = static_step(
            model, state, begin.towards(load, goal), solver=solver, settings=settings,
            threads=threads,
        )  # fmt: skip
        if trial.converged:
            yield trial
            state, done, step = trial, goal, min(2 * step, 1.0)
        elif step > 2.0**-settings.halvings:
            step /= 2
        else:
            yield replace(trial, status=StaticStatus.STEP_TOO_SMALL)
            return


def static_step(
    model: Model,
    before: StaticResult,
    load: Load,
    *,
    solver: DirectSolver,
    settings: StaticSettings | None = None,
    further: FurtherUnknowns | None = None,
    guess: Array | None = None,
    threads: Threads = ONE_THREAD,
) -> StaticResult:
    """Return the equilibrium under a load, searched for in one step.

    Parameters
    ----------
    model
        The model.
    before
        The equilibrium before.
    load
        The load; with ``further`` unknowns, their values in it are where the search starts.
    solver
        For the linear systems.
    settings
        How equilibria are searched for.
    further
        Unknowns of the load and their equations, such as a `Steering`.
    guess
        (n, 2) first iterate, mm; that of the predictor by default.
    threads
        Threads that share the work.
    """
    settings = settings or StaticSettings()
    here = before.displacement
    start = guess
    if start is None:
        unbalanced = -model.change_of_load(before.balance, load)
        departure = Departure.of(before.balance, unbalanced, load)
        if further is None:
            start = predicted(departure, load, solver=solver, residual=EXACT)
        else:
            prediction = predicted_together(
                [departure], load, [load], further, solver=BorderedSolver(solver), residual=EXACT
            )
            (start,), load = prediction.displacements, prediction.load

    def solved(start: Array) -> Trial:
        state = before.state
        if settings.first_contact:
            state = model.with_first_contact(state, start, load.placement)
        return balanced(
            model, load, state, None, start, solver=solver, newton=settings.newton_for(model),
            further=further, threads=threads,
        )  # fmt: skip

    newton, balance = from_prediction(solved, start, with_supports_moved(model, here, load))
    if not newton.converged:
        return StaticResult(StaticStatus.STEP_FAILED, before.state, before.balance, newton)
    return _committed(balance, newton)


def _committed(balance: ModelBalance, newton: NewtonResult) -> StaticResult:
    """Return an equilibrium as a result."""
    still = np.zeros_like(balance.displacement)
    contacts = tuple(touch.state for touch in balance.contacts)
    relaxed = balance.model.relaxed(balance.displacement)
    state = State(balance.load, balance.displacement, still, still, contacts, overstress=relaxed)
    return StaticResult(StaticStatus.CONVERGED, state, balance, newton)


def eigenvalue_nearest_zero(result: StaticResult, *, solver: DirectSolver) -> float:
    """Return the eigenvalue of the tangent that is nearest to zero, N/mm; nan if none is found.

    It passes through zero at a limit point of the load and at a bifurcation. Held unknowns are left
    out.
    """
    free = result.balance.model.free
    try:
        solver.factorise(result.balance.tangent(False).matrix)
    except SingularMatrixError:
        return 0.0

    def inverse(vector: Array) -> Array:
        return solver.solve(np.where(free, vector.ravel(), 0.0))

    operator = LinearOperator((free.size, free.size), matvec=inverse, dtype=float)
    start = np.where(free, 1.0, 0.0)
    try:
        largest = eigs(operator, k=1, which="LM", v0=start, return_eigenvectors=False, tol=1e-6)
    except ArpackNoConvergence:
        return float("nan")
    return float((1.0 / largest[0]).real)
