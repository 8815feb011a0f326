"""Committed increments, and their reports while the next step is being solved."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem2d.contact.contact import ContactResponse
from fem2d.solvers.model import Energies, ModelBalance
from fem2d.solvers.newton import NewtonResult
from fem2d.solvers.stability import Instability, instability_of
from fem2d.solvers.state import State
from fem2d.solvers.step_control import StepSettings
from fem2d.threads import Threads

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Commit:
    """One committed increment.

    Attributes
    ----------
    state
        The new committed state.
    contacts
        Response of each contact in it.
    reaction
        (2n,) forces of the supports on the held unknowns, N; elsewhere the unbalanced forces.
    newton
        Result of Newton's method.
    cutbacks
        Trials rejected since the last commit.
    duration_s
        Length of the step, s.
    energies
        Energies at its end.
    instability
        Static instability of the state; None if it is stable, or not tested.
    """

    state: State
    contacts: tuple[ContactResponse, ...]
    reaction: Array
    newton: NewtonResult
    cutbacks: int
    duration_s: float
    energies: Energies
    instability: Instability | None = None


class Reports:
    """Tests and reports committed increments in the background.

    One at a time and in order: an increment is added when the one before it has been reported.
    """

    def __init__(
        self, steps: StepSettings, threads: Threads, on_commit: Callable[[Commit], None]
    ) -> None:
        self._steps, self._on_commit = steps, on_commit
        self._aside = threads.aside()
        self._last: Future[None] | None = None
        self._stopped = False

    def __enter__(self) -> Reports:
        return self

    def __exit__(self, *_: object) -> None:
        self._aside.shutdown()

    def add(self, commit: Commit, balance: ModelBalance) -> None:
        """Report an increment."""
        self._last = self._aside.submit(self._report, commit, balance)

    def stopped(self) -> bool:
        """Wait for the last report and return whether it raised ``KeyboardInterrupt``.

        Any other error of a report is raised here.
        """
        if self._last is not None:
            last, self._last = self._last, None
            try:
                last.result()
            except KeyboardInterrupt:
                self._stopped = True
        return self._stopped

    def _report(self, commit: Commit, balance: ModelBalance) -> None:
        model, state = balance.model, commit.state
        if self._steps.tests_stability(balance.before.time_s, state.time_s):
            tangent = model.static_tangent(state, balance.contacts, balance.body)
            positions = model.body.nodes + state.displacement
            commit = replace(commit, instability=instability_of(tangent, positions))
        self._on_commit(commit)
