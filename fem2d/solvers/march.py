"""Implicit time marching through a motion, in steps of adaptive length.

Each step balances the forces at its end (:mod:`fem2d.solvers.stepper`). A trial that fails, or is
rejected (:mod:`fem2d.solvers.step_control`), leaves no trace: a shorter step starts from the same
committed state. A trial that is accepted is committed and reported (:mod:`fem2d.solvers.commit`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from typing import NamedTuple

import numpy as np

from fem2d.body.body import Response
from fem2d.contact.contact import ContactResponse
from fem2d.loads.load import Load, Loading
from fem2d.solvers.commit import Commit, Reports
from fem2d.solvers.hand import Hand
from fem2d.solvers.linear import DirectSolver, fastest_solver
from fem2d.solvers.model import Model, ModelBalance
from fem2d.solvers.newton import NewtonResult
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.state import State
from fem2d.solvers.step_control import StepSettings, growth, is_sound, may_travel, proposed_duration
from fem2d.solvers.stepper import Stepper
from fem2d.threads import Threads
from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidMotion


class MarchError(DrinksimError):
    """A march is described in a way that makes no sense."""


class MarchStatus(Enum):
    """How a march ended; the value is a message."""

    FINISHED = "the whole motion was followed"
    STEP_TOO_SMALL = "the step became too small without the forces coming into balance"
    INTERRUPTED = "the run was interrupted"


@dataclass(frozen=True)
class MarchResult:
    """Result of a march: its last committed state and what it took."""

    status: MarchStatus
    state: State
    increments: int
    iterations: int
    cutbacks: int

    @property
    def converged(self) -> bool:
        """Whether the march reached its end."""
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
    """Follow a motion, or a load against time, from a committed state.

    Parameters
    ----------
    model
        The model.
    motion
        Of the moving rigid bodies, in the frame of the tissue; or the load at each instant, s.
    start
        Committed state to start from; results do not change if a march is resumed from any state.
    end_s
        End of the march, s; the last sample of the motion by default.
    hand
        What carries the moving rigid bodies if they may deviate from the motion.
    solver
        For the linear systems; by default the fastest that is installed.
    steps, newton
        Settings of the steps and of Newton's method.
    threads
        Threads that share the work; two by default.
    on_commit
        Called with each committed increment, in order, while the next step is being solved;
        raising ``KeyboardInterrupt`` ends the march.

    Raises
    ------
    MarchError
        If a load against time is given without ``end_s``.
    """
    loading, last_s = _loading(motion, end_s)
    steps, threads = steps or StepSettings(), threads or Threads()
    stepper = Stepper(model, solver or fastest_solver(), newton or NewtonSettings(), threads)
    state, body = start, model.body.response(start.displacement, threads=threads)
    contacts = model.contact_responses(state.displacement, state.placement, state)
    increments = iterations = cutbacks = 0

    def ended(status: MarchStatus) -> MarchResult:
        if reports.stopped():
            status = MarchStatus.INTERRUPTED
        return MarchResult(status, state, increments, iterations, cutbacks)

    with threads.tuned(), Reports(steps, threads, on_commit) as reports:
        while state.time_s < last_s * (1 - 1e-12):
            step = _tried(stepper, steps, loading, hand, state, body, contacts, last_s)
            iterations, cutbacks = iterations + step.iterations, cutbacks + step.rejected
            if not step.sound:
                return ended(MarchStatus.STEP_TOO_SMALL)
            commit = _committed(step, hand, loading, steps)
            if reports.stopped():
                return ended(MarchStatus.INTERRUPTED)
            reports.add(commit, step.balance)
            state, body, contacts = commit.state, step.balance.body, step.balance.contacts
            increments += 1
        return ended(MarchStatus.FINISHED)


class _Step(NamedTuple):
    """Result of one step: the last trial, whether it is accepted, and what was tried before."""

    sound: bool
    trial: NewtonResult
    balance: ModelBalance
    duration_s: float
    rejected: int
    iterations: int


def _tried(
    stepper: Stepper,
    steps: StepSettings,
    loading: Loading,
    hand: Hand | None,
    state: State,
    body: Response,
    contacts: tuple[ContactResponse, ...],
    last_s: float,
) -> _Step:
    """Try a step, and shorter ones until one is accepted or would be too short."""
    carried = loading if hand is None else hand.carried(loading, state)
    at_most = min(state.next_step_s, steps.longest_s)
    rejected = iterations = 0
    while True:
        bound = min(at_most, last_s - state.time_s)
        duration = proposed_duration(steps, carried, state, contacts, bound)
        if hand is not None and rejected == 0:
            duration = hand.aligned(state.time_s, duration)
            if last_s - (state.time_s + duration) < steps.shortest_s:  # no step would fit there
                duration = last_s - state.time_s
        load = carried(state.time_s + duration)
        if hand is None:
            trial, balance = stepper.attempt(state, load, duration, body)
        else:
            trial, balance = stepper.attempt(
                state, load, duration, body, hand.unknowns(loading, state, duration),
                partial(_may_reach, steps, hand, state, contacts),
            )  # fmt: skip
        iterations += trial.iterations
        sound = is_sound(steps, trial, balance, contacts, carried=hand is not None)
        if sound:
            return _Step(True, trial, balance, duration, rejected, iterations)
        rejected += 1
        at_most = steps.cutback * duration
        if at_most < steps.shortest_s:
            return _Step(False, trial, balance, duration, rejected, iterations)


def _may_reach(
    steps: StepSettings,
    hand: Hand,
    state: State,
    contacts: tuple[ContactResponse, ...],
    load: Load,
) -> bool:
    """Whether a step is predicted to bring a body in a hand to where a load has it."""
    felt = hand.feels(contacts, load.time_s)
    return felt and may_travel(steps, contacts, state.placement, load.placement)


def _loading(motion: RigidMotion | Loading, end_s: float | None) -> tuple[Loading, float]:
    """Return the load against time, and the end of the march, s."""
    if isinstance(motion, RigidMotion):
        last_s = float(motion.time_s[-1]) if end_s is None else end_s
        return lambda time_s: Load.at(motion.at(time_s), time_s), last_s
    if end_s is None:
        raise MarchError("a load against time has no end of its own: give end_s")
    given = motion
    return lambda time_s: replace(given(time_s), time_s=time_s), end_s


def _committed(step: _Step, hand: Hand | None, loading: Loading, steps: StepSettings) -> Commit:
    """Return an accepted trial as the new committed state."""
    trial, balance, duration = step.trial, step.balance, step.duration_s
    model, before = balance.model, balance.before
    velocity, acceleration = np.zeros_like(before.velocity), before.acceleration
    if model.inertia.is_dynamic:
        velocity, acceleration = model.inertia.rates(before, trial.displacement, duration)
    state = State(
        balance.load,
        trial.displacement,
        velocity,
        acceleration,
        tuple(touch.state for touch in balance.contacts),
        duration * growth(steps, trial, step.rejected),
        model.overstress_after(before, trial.displacement, duration),
    )
    energies = model.energies(state, balance)
    if hand is not None:
        offset = hand.offset(state.load, loading(state.time_s))
        energies = replace(energies, hand=hand.energy(offset))
    return Commit(state, balance.contacts, balance.forces, trial, step.rejected, duration, energies)
