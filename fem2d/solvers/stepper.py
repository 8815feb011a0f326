"""Steps of a march, component by component while components do not touch one another."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Response
from fem2d.loads.load import Load
from fem2d.solvers.components import Component, component_of_node, components_of, gather
from fem2d.solvers.linear import DirectSolver
from fem2d.solvers.model import FurtherUnknowns, Model
from fem2d.solvers.newton import NewtonResult
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.state import State
from fem2d.solvers.step import (
    Trial,
    balanced,
    from_prediction,
    predicted,
    with_supports_moved,
)
from fem2d.threads import ONE_THREAD, Threads

Array = NDArray[np.float64]


class Stepper:
    """Tries steps of a model.

    Each component is balanced alone, in as many iterations as it needs, in parallel. The whole
    model starts from the results and is in balance at once unless components have met.

    Parameters
    ----------
    model
        The model.
    solver
        For the linear systems of the whole model; each component gets another one of its kind.
    newton
        Settings of Newton's method.
    threads
        Threads that share the work.
    """

    def __init__(
        self, model: Model, solver: DirectSolver, newton: NewtonSettings, threads: Threads
    ) -> None:
        self._model, self._solver, self._newton, self._threads = model, solver, newton, threads
        self._component = component_of_node(model)
        self._components = [(part, solver.another()) for part in components_of(model)]

    def attempt(
        self,
        state: State,
        load: Load,
        duration_s: float,
        body: Response,
        further: FurtherUnknowns | None = None,
    ) -> Trial:
        """Try to balance the forces ``duration_s`` after ``state``; nothing is committed.

        ``body`` is the body's response in ``state``. If a component fails, that is what is
        returned. With ``further`` unknowns, which join them, components are not tried alone.
        """
        model, newton = self._model, self._newton
        if not self._components or further is not None or self._touch(state):
            return attempt(
                model, state, load, duration_s, self._solver, newton, body, further=further,
                threads=self._threads,
            )  # fmt: skip

        def alone(component: Component, solver: DirectSolver) -> Trial:
            return attempt(
                component.model,
                component.state(state),
                component.load(load),
                duration_s,
                solver,
                newton,
                component.response(body),
            )

        trials = self._threads.run([partial(alone, *each) for each in self._components])
        for trial, balance in trials:
            if not trial.converged:
                return trial, balance
        return self._whole(state, load, duration_s, [trial for trial, _ in trials])

    def _touch(self, state: State) -> bool:
        """Whether components touch one another."""
        return any(
            contact.evaluate(state.displacement, state.placement, before).joins(self._component)
            for contact, before in zip(self._model.contacts, state.contacts, strict=True)
            if not contact.within_elements
        )

    def _whole(
        self, state: State, load: Load, duration_s: float, trials: list[NewtonResult]
    ) -> Trial:
        """Balance the whole model from the results of its components."""
        model, components = self._model, [component for component, _ in self._components]
        count = len(model.body.nodes)
        start = gather(components, [trial.start for trial in trials], count)
        together = gather(components, [trial.displacement for trial in trials], count)
        before = model.with_first_contact(state, start, load.placement)
        whole, balance = balanced(
            model, load, before, duration_s, together, solver=self._solver, newton=self._newton,
            threads=self._threads,
        )  # fmt: skip
        slowest = max(trials, key=lambda trial: trial.iterations)
        norms = (*slowest.norms[:-1], *whole.norms)
        return replace(whole, start=start, norms=norms), balance


def attempt(
    model: Model,
    state: State,
    load: Load,
    duration_s: float,
    solver: DirectSolver,
    newton: NewtonSettings,
    body: Response | None = None,
    *,
    further: FurtherUnknowns | None = None,
    threads: Threads = ONE_THREAD,
) -> Trial:
    """Try to balance the forces under a load, ``duration_s`` after ``state``, as a whole.

    ``body`` is the body's response in ``state``, if it is known. For ``further`` unknowns the load
    is where the search for them starts; they are not predicted, for a body that is about to meet
    tissue to first order knows nothing of it.
    """
    here = state.displacement
    balance = model.balance(
        here, load, state, duration_s, bodies_still=True, body=body, threads=threads
    )
    prediction, _ = predicted(
        balance, balance.forces, load, solver=solver, residual=newton.predictor_residual
    )

    def solved(start: Array) -> Trial:
        before = model.with_first_contact(state, start, load.placement)
        return balanced(
            model, load, before, duration_s, start, solver=solver, newton=newton,
            further=further, threads=threads,
        )  # fmt: skip

    return from_prediction(solved, prediction, with_supports_moved(model, here, load))
