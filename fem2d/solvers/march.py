"""From the first to the last instant of a rigid motion, in steps that adapt.

Each step tries to bring the forces into balance with the rigid body where the motion puts it at the
end of the step (:mod:`fem2d.solvers.step`). A trial that fails, or ends inside a wall, leaves no
trace: the step is halved and tried again from the same committed state. A trial that succeeds is
committed and reported.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from fem2d.contact.contact import ContactResponse
from fem2d.contact.rigid import rigid_responses
from fem2d.loads.load import Load, Loading
from fem2d.solvers.hand import Hand
from fem2d.solvers.linear import DirectSolver, fastest_solver
from fem2d.solvers.model import Energies, Model, ModelBalance
from fem2d.solvers.newton import NewtonResult, NewtonSettings
from fem2d.solvers.stability import Instability, instability_of
from fem2d.solvers.state import State
from fem2d.solvers.stepper import Stepper
from fem2d.threads import Threads
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting
from geometry2d.rigid import RigidMotion, RigidPlacement

Array = NDArray[np.float64]

TINY_MM = 1e-12
"""A way or an error shorter than this limits no step."""

PREDICTOR_ERROR_LIMIT = 10.0
"""An error of the predictor of so many times what is aimed at is no mere bend in the path."""

LEAP_SHARE = 0.5
"""A body that a hand lets go at most so much farther than a step's travel: less than this share of
its way would have been allowed."""

SHRINKING = 0.6
"""A step whose forces balance is followed by one of at least this share of its length."""


class MarchError(DrinksimError):
    """A march was asked for that makes no sense."""


class MarchStatus(Enum):
    """How a march ended; the value says it in words."""

    FINISHED = "the whole motion was followed"
    STEP_TOO_SMALL = "the step became too small without the forces coming into balance"
    INTERRUPTED = "the run was interrupted"


@dataclass(frozen=True)
class StepSettings:
    """How long steps are.

    Parameters
    ----------
    longest_s, shortest_s
        Bounds of a step, s; below the shortest the march stops.
    travel_mm
        Most that the rigid body moves in one step past a point of the tissue that is near, mm;
        where the gap is wide, seven tenths of it.
    accuracy_mm
        Largest difference between where the tissue was predicted to go and where it goes that is
        aimed at, mm. Friction depends on the path, and this tells how bent it is.
    snap_s
        A longer step that errs by more than `PREDICTOR_ERROR_LIMIT` times that, as when a lip snaps
        off an edge, is rejected, so that what happens in the snap is seen.
    easy_iterations, hard_iterations
        A step that needs no more (less) iterations than this is followed by a longer (shorter) one.
    penetration_growth_mm
        A trial in which the deepest penetration of a rigid body grows by more than this is rejected
        although its forces balance, mm: a lip that snaps can straddle a thin wall, whose two sides
        then hold it there. Far more than pressure adds in one step.
    watch_stability
        Whether every committed state is tested for static stability.
    """

    longest_s: float = setting(default=0.08, unit="s", above=0.0, description="longest step")
    shortest_s: float = setting(
        default=1e-7,
        unit="s",
        above=0.0,
        description="shortest step; the run stops if a shorter one is needed",
    )
    travel_mm: float = setting(
        default=0.3,
        unit="mm",
        above=0.0,
        description="largest motion of the rigid body past nearby tissue in one step",
    )
    accuracy_mm: float = setting(
        default=0.008,
        unit="mm",
        above=0.0,
        description="error of the predictor that the length of steps aims at",
    )
    snap_s: float = setting(
        default=0.004,
        unit="s",
        above=0.0,
        description="a longer step with a predictor error of ten times accuracy_mm is rejected",
    )
    easy_iterations: int = setting(
        default=7, minimum=1, description="a step with at most so many is followed by a longer one"
    )
    hard_iterations: int = setting(
        default=14,
        minimum=1,
        description="a step with at least so many is followed by a shorter one",
    )
    penetration_growth_mm: float = setting(
        default=0.1,
        unit="mm",
        above=0.0,
        description="a step in which the deepest penetration grows by more is rejected",
    )
    watch_stability: bool = setting(
        default=False, description="whether the stability of every committed state is tested"
    )


@dataclass(frozen=True, eq=False)
class Commit:
    """One committed increment.

    Attributes
    ----------
    state
        The new committed state.
    contacts
        What each contact does in it.
    reaction
        (2n,) what holds the body at its held unknowns, N; zero elsewhere but for what is left.
    newton
        How the forces came into balance.
    cutbacks
        Trials rejected since the last commit.
    duration_s
        Length of the step, s.
    energies
        Where the energy is.
    instability
        How the equilibrium would be unstable without inertia; None if it is stable, or if nobody
        asked.
    """

    state: State
    contacts: tuple[ContactResponse, ...]
    reaction: Array
    newton: NewtonResult
    cutbacks: int
    duration_s: float
    energies: Energies
    instability: Instability | None = None


@dataclass(frozen=True)
class MarchResult:
    """How a march ended and where."""

    status: MarchStatus
    state: State
    increments: int
    iterations: int
    cutbacks: int

    @property
    def converged(self) -> bool:
        """Whether the whole motion was followed."""
        return self.status is MarchStatus.FINISHED

    def __repr__(self) -> str:
        return (
            f"MarchResult({self.status.name}, {self.increments} increments to "
            f"{self.state.time_s:g} s, {self.iterations} iterations, {self.cutbacks} cutbacks)"
        )


def march(
    model: Model,
    motion: RigidMotion | Loading,
    start: State,
    *,
    end_s: float | None = None,
    hand: Hand | None = None,
    solver: DirectSolver | None = None,
    steps: StepSettings | None = None,
    newton: NewtonSettings | None = None,
    threads: Threads | None = None,
    on_commit: Callable[[Commit], None] = lambda commit: None,
) -> MarchResult:
    """Follow a motion from the committed state ``start`` and return how it went.

    Parameters
    ----------
    model
        What is to be in balance.
    motion
        Of the moving rigid bodies, in the frame of the tissue; or all that acts at each instant.
    start
        Committed state to start from; resuming from any committed state gives the same bits.
    end_s
        Where to stop, s; the motion's last sample by default.
    hand
        Who carries the moving rigid bodies if they may leave the motion; nobody yields without.
    solver
        For the linear systems, the fastest there is by default; components that do not touch get
        others of its kind.
    steps, newton
        How long steps are, and when a balance is good enough.
    threads
        Share the work; two by default.
    on_commit
        Called with every committed increment, in order, while the next step is being solved;
        raising ``KeyboardInterrupt`` stops.

    Raises
    ------
    MarchError
        If all that acts is given without where to stop.
    """
    loading, last_s = _loading(motion, end_s)
    steps, threads = steps or StepSettings(), threads or Threads()
    stepper = Stepper(model, solver or fastest_solver(), newton or NewtonSettings(), threads)
    state = start
    body = model.body.response(start.displacement)
    contacts = model.contact_responses(state.displacement, state.placement, state)
    increments = iterations = cutbacks = 0

    def ended(status: MarchStatus) -> MarchResult:
        if reports.stopped():
            status = MarchStatus.INTERRUPTED
        return MarchResult(status, state, increments, iterations, cutbacks)

    with threads.tuned(), _Reports(steps.watch_stability, threads, on_commit) as reports:
        while state.time_s < last_s * (1 - 1e-12):
            carried = loading if hand is None else hand.carried(loading, state)
            rejected = 0
            proposed = min(state.next_step_s, steps.longest_s)
            while True:
                duration = min(
                    proposed,
                    last_s - state.time_s,
                    _travel_limit(carried, state, contacts, steps),
                )
                further = None if hand is None else hand.unknowns(loading, state, duration)
                trial, balance = stepper.attempt(
                    state, carried(state.time_s + duration), duration, body, further
                )
                iterations += trial.iterations
                sound = trial.converged and not _penetration_grew(contacts, balance, steps)
                if hand is not None:
                    sound = sound and not _leapt(contacts, state, balance, steps)
                if sound and not _predictor_failed(trial, duration, steps):
                    break
                rejected += 1
                proposed = 0.5 * duration
                if proposed < steps.shortest_s:
                    cutbacks += rejected
                    return ended(MarchStatus.STEP_TOO_SMALL)
            cutbacks += rejected
            next_step = duration * _growth(trial, rejected, steps)
            commit = _committed(trial, balance, rejected, next_step)
            if hand is not None:
                commit = _with_hand(commit, hand, loading)
            if reports.stopped():
                return ended(MarchStatus.INTERRUPTED)
            reports.add(commit, balance)
            state, body, contacts = commit.state, balance.body, balance.contacts
            increments += 1
        return ended(MarchStatus.FINISHED)


def _loading(motion: RigidMotion | Loading, end_s: float | None) -> tuple[Loading, float]:
    """Return what acts at each instant, and where to stop, s."""
    if isinstance(motion, RigidMotion):
        last_s = float(motion.time_s[-1]) if end_s is None else end_s
        return lambda time_s: Load.at(motion.at(time_s), time_s), last_s
    if end_s is None:
        raise MarchError("a march under given loads has no end of its own: give end_s")
    given = motion
    return lambda time_s: replace(given(time_s), time_s=time_s), end_s


class _Reports:
    """Looks at committed increments and hands them on while the next step is being solved.

    One at a time and in order: an increment is added when the one before it has been reported.
    """

    def __init__(
        self, watch_stability: bool, threads: Threads, on_commit: Callable[[Commit], None]
    ) -> None:
        self._watch, self._on_commit = watch_stability, on_commit
        self._aside = threads.aside()
        self._last: Future[None] | None = None
        self._stopped = False

    def __enter__(self) -> _Reports:
        return self

    def __exit__(self, *_: object) -> None:
        self._aside.shutdown()

    def add(self, commit: Commit, balance: ModelBalance) -> None:
        """Report an increment."""
        self._last = self._aside.submit(self._report, commit, balance)

    def stopped(self) -> bool:
        """Wait until all is reported and return whether a report asked to stop.

        Whatever else a report raised is raised here.
        """
        if self._last is not None:
            last, self._last = self._last, None
            try:
                last.result()
            except KeyboardInterrupt:
                self._stopped = True
        return self._stopped

    def _report(self, commit: Commit, balance: ModelBalance) -> None:
        if self._watch:
            model, state = balance.model, commit.state
            tangent = model.static_tangent(state, balance.contacts, balance.body)
            positions = model.body.nodes + state.displacement
            commit = replace(commit, instability=instability_of(tangent, positions))
        self._on_commit(commit)


def _committed(
    trial: NewtonResult, balance: ModelBalance, cutbacks: int, next_step_s: float
) -> Commit:
    """Make a converged trial the new committed state."""
    model, before, duration_s = balance.model, balance.before, balance.duration_s
    velocity, acceleration = np.zeros_like(before.velocity), before.acceleration
    if model.inertia.is_dynamic and duration_s is not None:
        velocity, acceleration = model.inertia.rates(before, trial.displacement, duration_s)
    state = State(
        balance.load,
        trial.displacement,
        velocity,
        acceleration,
        tuple(touch.state for touch in balance.contacts),
        next_step_s,
    )
    energies = model.energies(state, balance)
    return Commit(
        state, balance.contacts, balance.forces, trial, cutbacks, duration_s or 0.0, energies
    )


def _with_hand(commit: Commit, hand: Hand, loading: Loading) -> Commit:
    """Return a commit with what the hand's springs store."""
    offset = hand.offset(commit.state.load, loading(commit.state.time_s))
    return replace(commit, energies=replace(commit.energies, hand=hand.energy(offset)))


def _travel_limit(
    loading: Loading, state: State, contacts: tuple[ContactResponse, ...], steps: StepSettings
) -> float:
    """Return the duration in which moving bodies travel as far as a step allows."""
    ahead = loading(state.time_s + steps.longest_s).placement
    return steps.longest_s * _allowed_share(contacts, state.placement, ahead, steps)


def _allowed_share(
    contacts: tuple[ContactResponse, ...],
    here: RigidPlacement,
    there: RigidPlacement,
    steps: StepSettings,
) -> float:
    """Return what share of their way moving bodies may travel in one step past near tissue."""
    share = np.inf
    for touch in rigid_responses(contacts):
        if touch.contact.moving:
            nodal = touch.contact.surface.nodal
            point = nodal(touch.state.body_position)
            travel = np.linalg.norm(there.apply(point) - here.apply(point), axis=-1)
            allowed = np.maximum(steps.travel_mm, 0.7 * nodal(touch.points.gap))
            share = min(share, float(np.min(allowed / np.maximum(travel, TINY_MM))))
    return share


def _leapt(
    before: tuple[ContactResponse, ...], state: State, balance: ModelBalance, steps: StepSettings
) -> bool:
    """Whether a body that a hand carries has gone farther than a step allows."""
    return _allowed_share(before, state.placement, balance.load.placement, steps) < LEAP_SHARE


def _penetration_grew(
    before: tuple[ContactResponse, ...], balance: ModelBalance, steps: StepSettings
) -> bool:
    """Whether tissue has gone into a rigid body farther than pressure can push it in one step."""
    return _deepest(balance.contacts) - _deepest(before) > steps.penetration_growth_mm


def _predictor_failed(trial: NewtonResult, duration_s: float, steps: StepSettings) -> bool:
    """Whether tissue has gone elsewhere than was predicted, in a step too long to tell how."""
    return (
        duration_s > steps.snap_s
        and trial.predictor_error_mm > PREDICTOR_ERROR_LIMIT * steps.accuracy_mm
    )


def _deepest(contacts: tuple[ContactResponse, ...]) -> float:
    """Return the deepest penetration of a rigid body, mm; 0 if there is none."""
    return max([0.0, *(-float(np.min(t.points.gap)) for t in rigid_responses(contacts))])


def _growth(trial: NewtonResult, rejected: int, steps: StepSettings) -> float:
    """Return how much longer the next step is to be."""
    if rejected > 0 or trial.iterations >= steps.hard_iterations:
        usual = 0.8
    else:
        usual = 1.5 if trial.iterations <= steps.easy_iterations else 1.0
    accurate = math.sqrt(steps.accuracy_mm / max(trial.predictor_error_mm, TINY_MM))
    return max(SHRINKING, min(usual, accurate))
