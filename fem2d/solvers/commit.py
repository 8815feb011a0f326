"""Committed increments, and how they are handed on while the next step is being solved."""

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


class Reports:
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

    def __enter__(self) -> Reports:
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
