"""One step: predict where the tissue goes when the rigid body moves on, then balance the forces."""

from __future__ import annotations

from concurrent.futures import wait
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Response
from fem2d.solvers.components import (
    Component,
    component_of_node,
    components_of,
    components_touch,
    gather,
)
from fem2d.solvers.linear import DirectSolver, SingularMatrixError
from fem2d.solvers.model import System, SystemBalance
from fem2d.solvers.newton import NewtonResult, NewtonSettings, NewtonStatus, solve
from fem2d.solvers.state import State
from fem2d.threads import second_thread
from geometry2d.rigid import RigidMotion, RigidPlacement

Array = NDArray[np.float64]

PREDICTOR_RESIDUAL = 1e-9
"""Smaller than Newton's steps may leave, because no later step corrects it: points that the
predictor brings to a rigid body start to stick where it says."""


class Stepper:
    """Tries steps of a system: in parts while these do not touch one another, else as a whole.

    Parts take as many iterations as each needs, side by side on two threads. Where they end is
    where the whole begins; unless they have met there, its forces balance at once.

    Parameters
    ----------
    system
        What is to be in balance.
    motion
        Of the moving rigid body.
    solver
        For the linear systems of the whole; each part gets another one of its kind, on one thread.
    newton
        When a balance is good enough.
    """

    def __init__(
        self, system: System, motion: RigidMotion, solver: DirectSolver, newton: NewtonSettings
    ) -> None:
        self._system, self._motion, self._solver, self._newton = system, motion, solver, newton
        self._piece = component_of_node(system)
        self._parts = [(part, solver.another()) for part in components_of(system)]

    def attempt(
        self, state: State, duration_s: float, of_body: Response
    ) -> tuple[NewtonResult, SystemBalance]:
        """Try to balance the forces ``duration_s`` after ``state``; nothing is committed.

        ``of_body`` is the body's response in ``state``. If a part fails, that is what is returned.
        """
        system, motion, newton = self._system, self._motion, self._newton
        if not self._parts or components_touch(
            self._piece, system.fold_responses(state.displacement, state)
        ):
            return attempt(system, motion, state, duration_s, self._solver, newton, of_body)

        def alone(part: Component, solver: DirectSolver) -> tuple[NewtonResult, SystemBalance]:
            of_part = part.response(of_body)
            return attempt(
                part.system, motion, part.state(state), duration_s, solver, newton, of_part
            )

        first, *others = self._parts
        waiting = [second_thread().submit(alone, *other) for other in others]
        try:
            trials = [alone(*first)]
        finally:
            wait(waiting)
        trials += [other.result() for other in waiting]
        for trial, balance in trials:
            if not trial.converged:
                return trial, balance
        return self._whole(state, duration_s, [trial for trial, _ in trials])

    def _whole(
        self, state: State, duration_s: float, trials: list[NewtonResult]
    ) -> tuple[NewtonResult, SystemBalance]:
        """Balance the forces of the whole from where its parts ended."""
        system, parts = self._system, [part for part, _ in self._parts]
        count = len(system.body.nodes)
        predicted = gather(parts, [trial.start for trial in trials], count)
        together = gather(parts, [trial.displacement for trial in trials], count)
        placement = self._motion.at(state.time_s + duration_s)
        before = system.with_first_contact(state, predicted, placement)
        whole, balance = solve(
            lambda u: system.balance(u, placement, before, duration_s),
            together,
            solver=self._solver,
            settings=self._newton,
        )
        slowest = max(trials, key=lambda trial: trial.iterations)
        norms = (*slowest.norms[:-1], *whole.norms)
        return replace(whole, start=predicted, norms=norms), balance


def attempt(
    system: System,
    motion: RigidMotion,
    state: State,
    duration_s: float,
    solver: DirectSolver,
    newton: NewtonSettings,
    of_body: Response | None = None,
) -> tuple[NewtonResult, SystemBalance]:
    """Try to balance the forces ``duration_s`` after ``state``; nothing is committed.

    ``of_body`` is the body's response in ``state``, if it is known.
    """
    placement = motion.at(state.time_s + duration_s)

    def solved(start: Array) -> tuple[NewtonResult, SystemBalance]:
        before = system.with_first_contact(state, start, placement)
        return solve(
            lambda u: system.balance(u, placement, before, duration_s),
            start,
            solver=solver,
            settings=newton,
        )

    trial, balance = solved(_predicted(system, state, placement, duration_s, solver, of_body))
    if trial.status is NewtonStatus.INADMISSIBLE and trial.iterations == 0:
        return solved(state.displacement)
    return trial, balance


def _predicted(
    system: System,
    state: State,
    placement: RigidPlacement,
    duration_s: float,
    solver: DirectSolver,
    of_body: Response | None,
) -> Array:
    """Return where the tissue goes to first order when the rigid body moves on."""
    balance = system.balance(
        state.displacement,
        state.placement,
        state,
        duration_s,
        body_moves_to=placement,
        of_body=of_body,
    )
    try:
        solver.factorise(balance.tangent(False))
        step = solver.solve(balance.residual, residual=PREDICTOR_RESIDUAL)
    except SingularMatrixError:
        return state.displacement
    return state.displacement - step.reshape(state.displacement.shape)
