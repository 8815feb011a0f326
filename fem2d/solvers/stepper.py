"""Steps of a march, component by component while components do not touch one another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Response
from fem2d.loads.load import Load
from fem2d.solvers.bordered import BorderedSolver
from fem2d.solvers.components import (
    Component,
    component_of_node,
    components_of,
    gather,
)
from fem2d.solvers.joined import joined_at
from fem2d.solvers.linear import DirectSolver
from fem2d.solvers.model import FurtherUnknowns, Model, ModelBalance
from fem2d.solvers.newton import solve
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.prediction import (
    Departure,
    Prediction,
    predicted,
    predicted_together,
    with_supports_moved,
)
from fem2d.solvers.state import State
from fem2d.solvers.step import Trial, balanced, from_prediction
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
        may_reach: Callable[[Load], bool] | None = None,
    ) -> Trial:
        """Try to balance the forces ``duration_s`` after ``state``; nothing is committed.

        ``body`` is the body's response in ``state``. If a component fails, that is what is
        returned. ``further`` unknowns are found with the displacements of all components together;
        for ``may_reach`` see `fem2d.solvers.prediction.predicted_together`.
        """
        if not self._components or self._touch(state):
            return attempt(
                self._model, state, load, duration_s, self._solver, self._newton, body,
                further=further, may_reach=may_reach, threads=self._threads,
            )  # fmt: skip
        if further is not None:
            return self._together(state, load, duration_s, body, further, may_reach)

        def alone(component: Component, solver: DirectSolver) -> Trial:
            return attempt(
                component.model,
                component.state(state),
                component.load(load),
                duration_s,
                solver,
                self._newton,
                component.response(body),
            )

        trials = self._threads.run([partial(alone, *each) for each in self._components])
        for trial, balance in trials:
            if not trial.converged:
                return trial, balance
        slowest = max((trial for trial, _ in trials), key=lambda trial: trial.iterations)
        starts = [trial.start for trial, _ in trials]
        return self._whole(
            state,
            load,
            duration_s,
            starts,
            [balance for _, balance in trials],
            slowest.norms,
            self._first_contact(state, starts, load),
        )

    def _together(
        self,
        state: State,
        load: Load,
        duration_s: float,
        body: Response,
        further: FurtherUnknowns,
        may_reach: Callable[[Load], bool] | None,
    ) -> Trial:
        """Balance components that share further unknowns, then the whole model from there."""
        components, newton = [each for each, _ in self._components], self._newton
        states = [component.state(state) for component in components]
        counts = [own.displacement.size for own in states]

        def departure(component: Component, own: State) -> Departure:
            still = component.model.balance(
                own.displacement, component.load(load), own, duration_s, bodies_still=True,
                body=component.response(body),
            )  # fmt: skip
            return Departure.of(still, still.forces, still.load)

        departures = self._threads.run(
            [partial(departure, *each) for each in zip(components, states, strict=True)]
        )
        prediction = predicted_together(
            departures, load, [each.balance.load for each in departures], further,
            solver=self._joined_solver(newton.predictor_residual),
            residual=newton.predictor_residual, may_reach=may_reach,
        )  # fmt: skip

        def solved(start: Prediction) -> Trial:
            displacements, there = start.displacements, start.load
            evaluations = [
                partial(_evaluated, component, _met(component, own, u, load), duration_s)
                for component, own, u in zip(components, states, start.kept, strict=True)
            ]
            trial, balance = solve(
                joined_at(evaluations, counts, there, further, newton.tolerance, self._threads),
                np.concatenate([*(u.ravel() for u in displacements), further.values(there)]),
                solver=self._joined_solver(newton.step_residual),
                settings=newton,
                further=further.values(there).size,
            )
            if not trial.converged:
                return trial, balance.components[0]
            return self._whole(
                state, balance.load, duration_s, displacements, balance.components, trial.norms,
                self._first_contact(state, start.kept, load), further,
            )  # fmt: skip

        return from_predictions(solved, prediction, load, [each.moved for each in departures])

    def _first_contact(self, state: State, predicted: Sequence[Array], load: Load) -> State:
        """Return the state with the first contacts of a step that components are predicted to."""
        components = [component for component, _ in self._components]
        there = gather(components, predicted, len(self._model.body.nodes))
        return self._model.with_first_contact(state, there, load.placement)

    def _joined_solver(self, residual: float) -> BorderedSolver:
        solvers = [solver for _, solver in self._components]
        return BorderedSolver(*solvers, residual=residual, threads=self._threads)

    def _touch(self, state: State) -> bool:
        """Whether components touch one another."""
        return any(
            contact.evaluate(state.displacement, state.placement, before).joins(self._component)
            for contact, before in zip(self._model.contacts, state.contacts, strict=True)
            if not contact.within_elements
        )

    def _whole(
        self,
        state: State,
        load: Load,
        duration_s: float,
        starts: Sequence[Array],
        balances: Sequence[ModelBalance],
        norms: tuple[float, ...],
        before: State,
        further: FurtherUnknowns | None = None,
    ) -> Trial:
        """Balance the whole model from the results of its components, found from ``starts``.

        ``before`` is the state with the first contacts of the step. Element sums of the components
        are not taken over: a march that goes on from a state has sums of the whole only, and is to
        go on bit for bit.
        """
        model, components = self._model, [component for component, _ in self._components]
        count = len(model.body.nodes)
        start = gather(components, starts, count)
        together = gather(components, [balance.displacement for balance in balances], count)
        whole, balance = balanced(
            model, load, before, duration_s, together, solver=self._solver, newton=self._newton,
            further=further, threads=self._threads,
        )  # fmt: skip
        return replace(whole, start=start, norms=(*norms[:-1], *whole.norms)), balance


def from_predictions(
    solved: Callable[[Prediction], Trial],
    prediction: Prediction,
    load: Load,
    unpredicted: list[Array],
) -> Trial:
    """Return the trial from a prediction; where it fails, from further unknowns where they were.

    A hand that follows a recorded motion, and stays where it was, so finds the recorded motion even
    through a snap that its predictor does not foresee.
    """
    trial, balance = from_prediction(solved, prediction, Prediction(load, unpredicted, unpredicted))
    if trial.converged or prediction.load is load:
        return trial, balance
    again, there = solved(Prediction(load, prediction.kept, prediction.kept))
    return replace(again, norms=(*trial.norms[:-1], *again.norms)), there


def _met(component: Component, state: State, predicted: Array, load: Load) -> State:
    """Return the state of a component with the places where its points meet something."""
    return component.model.with_first_contact(state, predicted, load.placement)


def _evaluated(
    component: Component,
    before: State,
    duration_s: float,
    displacement: Array,
    load: Load,
    body: Response | None,
) -> ModelBalance:
    """Return the balance of a component; see `fem2d.solvers.joined.Evaluation`."""
    return component.model.balance(
        displacement.reshape(-1, 2), component.load(load), before, duration_s, body=body
    )


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
    may_reach: Callable[[Load], bool] | None = None,
    threads: Threads = ONE_THREAD,
) -> Trial:
    """Try to balance the forces under a load, ``duration_s`` after ``state``, as a whole.

    ``body`` is the body's response in ``state``, if it is known. For ``further`` unknowns the load
    is where they were in ``state``; for ``may_reach`` see
    `fem2d.solvers.prediction.predicted_together`.
    """
    here, residual = state.displacement, newton.predictor_residual
    balance = model.balance(
        here, load, state, duration_s, bodies_still=True, body=body, threads=threads
    )
    departure = Departure.of(balance, balance.forces, load)
    if further is None:
        there = [predicted(departure, load, solver=solver, residual=residual)]
        prediction = Prediction(load, there, there)
    else:
        prediction = predicted_together(
            [departure], load, [load], further, residual=residual, may_reach=may_reach,
            solver=BorderedSolver(solver, residual=residual),
        )  # fmt: skip

    def solved(start: Prediction) -> Trial:
        before = model.with_first_contact(state, start.kept[0], load.placement)
        return balanced(
            model, start.load, before, duration_s, start.displacements[0], solver=solver,
            newton=newton, further=further, threads=threads,
        )  # fmt: skip

    return from_predictions(solved, prediction, load, [with_supports_moved(model, here, load)])
