"""From the solver's commits to a run's increments, each with all that is needed to go on from it.

The solver works in the frame of the head section; increments are in the head frame of the
recording.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.loads.load import Load
from fem2d.solvers.commit import Commit
from fem2d.solvers.stability import Passage, passages_with
from fem2d.solvers.state import State
from geometry2d.rigid import RigidPlacement, rotated
from scenarios.results.increment import Increment, Measured, SolutionError
from scenarios.results.summary import Extremes, passages_as_array, passages_from_array

Arrays = dict[str, NDArray[Any]]


class Recorder:
    """Turns commits into increments and keeps the extremes and unstable passages of the run.

    Both are part of every increment's checkpoint, so that a resumed replay goes on with them.

    Parameters
    ----------
    measure
        What is measured on a commit.
    start_s, end_s
        The period that is replayed, s.
    head_angle_rad
        Turn of the head section's frame into the head frame.
    force_floor_n
        Nodal force below which nothing is considered to act, N, as in Newton's method.
    resume_from
        The last increment of an interrupted replay, with its checkpoint.
    """

    def __init__(
        self,
        measure: Callable[[Commit], Measured],
        *,
        start_s: float,
        end_s: float,
        head_angle_rad: float,
        force_floor_n: float,
        resume_from: Increment | None = None,
    ) -> None:
        self._measure = measure
        self._start_s, self._end_s = start_s, end_s
        self._head_angle_rad = head_angle_rad
        self._force_floor_n = force_floor_n
        self.extremes = Extremes()
        self.unstable: tuple[Passage, ...] = ()
        self._last_s = start_s
        if resume_from is not None:
            self.extremes = Extremes.from_array(resume_from.checkpoint["extremes"])
            self.unstable = passages_from_array(resume_from.checkpoint["unstable"])
            self._last_s = resume_from.time_s

    def increment(self, commit: Commit) -> Increment:
        """Return a committed increment in the head frame."""
        state = commit.state
        measured = self._measure(commit)
        self._remember(commit, measured)
        x, y = rotated(state.placement.shift_mm, self._head_angle_rad).tolist()
        return Increment(
            time_s=state.time_s,
            relative_time=(state.time_s - self._start_s) / (self._end_s - self._start_s),
            placement=RigidPlacement(state.placement.angle_rad + self._head_angle_rad, (x, y)),
            displacement=rotated(state.displacement, self._head_angle_rad),
            element=measured.element,
            contact=measured.contact,
            history=measured.history,
            newton_iterations=commit.newton.iterations,
            cutbacks=commit.cutbacks,
            checkpoint=checkpoint(state)
            | {
                "extremes": self.extremes.as_array(),
                "unstable": passages_as_array(self.unstable),
            },
        )

    def _remember(self, commit: Commit, measured: Measured) -> None:
        time_s = commit.state.time_s
        self.unstable = passages_with(self.unstable, self._last_s, time_s, commit.instability)
        now = Extremes.of(commit, force_floor_n=self._force_floor_n)
        self.extremes = self.extremes.widened(now).widened(Extremes.of_windows(measured))
        self._last_s = time_s


def checkpoint(state: State) -> Arrays:
    """Return a committed state as arrays by name; its time is the increment's."""
    arrays: Arrays = {
        "placement": np.array([state.placement.angle_rad, *state.placement.shift_mm]),
        "displacement": state.displacement,
        "velocity": state.velocity,
        "acceleration": state.acceleration,
        "next_step_s": np.array(state.next_step_s),
    }
    for number, contact in enumerate(state.contacts):
        arrays |= _named(f"contact_{number}_", contact)
    if state.overstress is not None:
        arrays |= _named("overstress_", state.overstress)
    return arrays


def _named(prefix: str, remembered: Any) -> Arrays:
    """Return the arrays of a dataclass by prefix and name."""
    return {f"{prefix}{f.name}": getattr(remembered, f.name) for f in fields(remembered)}


def _read(like: Any, prefix: str, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """Return a dataclass like another one with the arrays of a prefix."""
    return replace(like, **{f.name: arrays[f"{prefix}{f.name}"] for f in fields(like)})


def restored(arrays: Mapping[str, NDArray[Any]], time_s: float, like: State) -> State:
    """Return the state of a checkpoint.

    Parameters
    ----------
    arrays
        What :func:`checkpoint` gave.
    time_s
        When the state was committed, s.
    like
        Any state of the same model: it has how many contacts there are and what each remembers.

    Raises
    ------
    SolutionError
        If the checkpoint is not one of this model.
    """
    try:
        angle, x, y = arrays["placement"].tolist()
        return State(
            Load.at(RigidPlacement(angle, (x, y)), time_s),
            arrays["displacement"],
            arrays["velocity"],
            arrays["acceleration"],
            tuple(
                _read(contact, f"contact_{n}_", arrays) for n, contact in enumerate(like.contacts)
            ),
            float(arrays["next_step_s"]),
            like.overstress and _read(like.overstress, "overstress_", arrays),
        )
    except KeyError as error:
        raise SolutionError(
            f"the checkpoint lacks {error}: another version wrote it; run without --resume to "
            "start over"
        ) from error
