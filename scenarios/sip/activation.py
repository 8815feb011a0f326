"""The least activation of a muscle that explains what was seen of a lip.

A film does not show activations. It shows what they did: a lip kept clear of the neck, the lower
lip reached so far down the neck, the lips sealed. Each of these is decided at known instants. The
smallest activation that explains it is searched on the coarse mesh with that lip alone: raised
until it is enough, then bisected. More would explain it too: the band that is reported ends at
twice the least.

A lip that keeps clear of the neck is in static equilibrium, without a neck. One that bears on it
remembers by friction how it was met, so it follows the film to the instant that decides.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq

from fem2d.contact.contact import ContactResponse
from fem2d.contact.rigid import rigid_responses
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.load import Load
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.march import MarchStatus, march
from fem2d.solvers.state import State
from fem2d.solvers.static import kept_at, static_path
from fem2d.threads import Threads
from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.progress import Progress, no_progress
from geometry2d.rigid import RigidMotion
from scenarios.settings.muscles import NAMES, Seen
from scenarios.settings.scenario import ScenarioError
from scenarios.settings.searches import ActivationSearch
from scenarios.sip.clearance import MovingNeck, PathClearance, held_times
from scenarios.sip.contact_line import TOUCHING_MM, line_on_neck
from scenarios.sip.felt import seal_margin_mpa
from scenarios.sip.lip_model import Lips, without_neck

Observation = Literal["clears", "reaches", "seals"]

LIP_OF: Mapping[str, str] = {
    name: "upper" if name in ("upper_orbicularis", "levator") else "lower" for name in NAMES
}


@dataclass(frozen=True)
class FoundActivation:
    """The least activation that explains what was seen.

    Attributes
    ----------
    muscle
        One of `scenarios.settings.muscles.NAMES`.
    activation
        The least one.
    fixed_by
        What was seen, to be read behind "the least that".
    beyond, beyond_at_rest
        By how much the lip does more than what was seen, with that activation and at rest, in the
        unit of what was seen; negative where it falls short.
    unit
        That unit.
    """

    muscle: str
    activation: float
    fixed_by: str
    beyond: float
    beyond_at_rest: float
    unit: str

    @property
    def band(self) -> tuple[float, float]:
        """From the least activation to twice that, or to all that a muscle can."""
        return self.activation, min(2.0 * self.activation, 1.0)

    def about(self) -> dict[str, Any]:
        """Return the numbers for the summary."""
        return {
            "least": self.band[0],
            "twice": self.band[1],
            "fixed_by": self.fixed_by,
            f"beyond_{self.unit}": self.beyond,
            f"beyond_at_rest_{self.unit}": self.beyond_at_rest,
        }


def write_activations(file: Path, found: Sequence[FoundActivation]) -> None:
    """Write what was found, so that a run that is resumed does not search again."""
    text = json.dumps([asdict(each) for each in found], indent=2)
    with file_at_once(file) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def read_activations(file: Path) -> tuple[FoundActivation, ...] | None:
    """Return what :func:`write_activations` wrote; None if there is no such file."""
    if not file.is_file():
        return None
    return tuple(FoundActivation(**each) for each in json.loads(file.read_text(encoding="utf-8")))


def find_activations(
    lips: Lips,
    motion: RigidMotion,
    start_s: float,
    *,
    threads: Threads | None = None,
    progress: Progress = no_progress,
) -> tuple[FoundActivation, ...]:
    """Return what every activation that is "auto" in a scenario stands for.

    Parameters
    ----------
    lips
        The model that they are for, with its liquid.
    motion
        Of the neck in the head section.
    start_s
        When the neck comes near, s.
    threads
        That share the work, two by default.
    progress
        Told which muscle is searched.

    Raises
    ------
    ScenarioError
        If no activation explains what was seen, or if statics cannot follow the neck.
    """
    muscles, share = lips.scenario.muscles, threads or Threads()
    found: dict[str, FoundActivation] = {}
    if muscles is None:
        return ()
    for observation in ("clears", "reaches", "seals"):
        names = [name for name in muscles.automatic if muscles.observation(name) == observation]
        tried: list[FoundActivation] = []
        failures: list[ScenarioError] = []
        for name in names:
            progress(0.0, f"searching the activation of {name.replace('_', ' ')}")
            known = {other: each.activation for other, each in found.items()}
            trial = _trial(lips, motion, name, observation, known, start_s, share)
            try:
                tried.append(trial.least())
            except ScenarioError as error:
                failures.append(error)
        # One observation of the lower lip is explained by one muscle: the one that needs least.
        one = observation == "reaches" and bool(tried)
        if failures and not one:
            raise failures[0]
        taken = [min(tried, key=lambda each: each.activation)] if one else tried
        found |= {each.muscle: each for each in taken}
    return tuple(found.values())


@dataclass(frozen=True)
class ActivationTrial:
    """A lip alone whose muscle is to explain one observation.

    Attributes
    ----------
    muscle, observation, seen
        What is sought, and what it is to explain.
    beyond
        By how much the lip does more than what was seen, with an activation; nan where no
        equilibrium was found.
    search
        How the least one is searched.
    """

    muscle: str
    observation: Observation
    seen: Seen
    beyond: Callable[[float], float]
    search: ActivationSearch

    @property
    def unit(self) -> str:
        """The unit of what was seen."""
        return "kpa" if self.observation == "seals" else "mm"

    @property
    def fixed_by(self) -> str:
        """What was seen, to be read behind "the least that"."""
        lip, seen = LIP_OF[self.muscle], self.seen
        return {
            "clears": f"keeps the {lip} lip {seen.clearance_mm:g} mm clear of the neck",
            "reaches": f"lets the lower lip bear on the neck {seen.lower_reach_mm or 0:g} mm from "
            f"its rim at {seen.reach_time_s or 0:g} s",
            "seals": f"presses the {lip} lip {seen.seal_kpa:g} kPa harder than the liquid at "
            f"{seen.seal_time_s or 0:g} s",
        }[self.observation]

    def least(self) -> FoundActivation:
        """Return the least activation that explains the observation.

        Raises
        ------
        ScenarioError
            If none does.
        """
        at_rest = self.beyond(0.0)
        low, enough, reached = 0.0, 0.0, at_rest
        tried = {0.0: at_rest}
        for share in np.linspace(0.0, 1.0, self.search.rising_steps + 1)[1:]:
            if reached >= 0:
                break
            low, enough = enough, self.search.most * float(share) ** 2
            tried[enough] = reached = self.beyond(enough)
        if not reached >= 0:
            raise ScenarioError(self._unexplained(tried))
        while enough - low > self.search.tolerance:
            middle = 0.5 * (low + enough)
            beyond = self.beyond(middle)
            if beyond >= 0:
                enough, reached = middle, beyond
            else:
                low = middle
        return FoundActivation(self.muscle, enough, self.fixed_by, reached, at_rest, self.unit)

    def _unexplained(self, tried: Mapping[float, float]) -> str:
        unit = "kPa" if self.unit == "kpa" else "mm"
        muscle = self.muscle.replace("_", " ")
        known = {activation: value for activation, value in tried.items() if np.isfinite(value)}
        if not known:
            return f"no activation of {muscle} could be tried: no equilibrium of the lip was found"
        best = max(known, key=lambda activation: known[activation])
        return (
            f"no activation of {muscle} up to {max(known):.2f} {self.fixed_by}: at best, with "
            f"{best:.2f}, it falls short by {-known[best]:.2f} {unit} "
            f"({-tried[0.0]:.2f} {unit} at rest): what was seen needs another motion, place or jaw "
            "opening, or state a number"
        )


def _trial(
    lips: Lips,
    motion: RigidMotion,
    muscle: str,
    observation: Observation,
    known: Mapping[str, float],
    start_s: float,
    threads: Threads,
) -> ActivationTrial:
    """Return the trial of a muscle beside others whose activation is known."""
    settings = lips.scenario.muscles
    assert settings is not None  # a muscle is sought
    search = lips.scenario.numerics.activation_search
    alone = replace(
        lips,
        scenario=lips.scenario.with_(numerics={"resolution": "coarse"}),
        present=(LIP_OF[muscle],),
        pull=None,
    )

    def active(activation: float) -> dict[str, Amplitude]:
        return settings.activations(start_s, {**known, muscle: activation})

    if observation == "clears":
        held = settings.held_s(muscle)
        beyond = _clears(alone, motion, muscle, active, held, threads)
    elif observation == "reaches":
        beyond = _reaches(alone, motion, active, start_s, threads)
    else:
        beyond = _seals(alone, motion, active, start_s, threads)
    return ActivationTrial(muscle, observation, settings.seen, beyond, search)


def _clears(
    alone: Lips,
    motion: RigidMotion,
    muscle: str,
    active: Callable[[float], dict[str, Amplitude]],
    held: tuple[tuple[float, float], ...],
    threads: Threads,
) -> Callable[[float], float]:
    """Return what tells by how much more than asked a lip is clear of the neck's path, mm."""
    settings = alone.scenario.muscles
    assert settings is not None
    search, seen = alone.scenario.numerics.activation_search, settings.seen
    path = [motion.at(float(time)) for time in held_times(held, search.instants)]
    clearance = PathClearance.of(
        alone.free_surface(alone.present[0]), MovingNeck.of(alone.neck, path), search.reach_mm
    )
    there = {name: each.at(held[0][0]) for name, each in active(0.0).items() if name != muscle}
    rising = {name: Amplitude(RISE.time_s, (0.0, value)) for name, value in there.items()}
    full = Amplitude(RISE.time_s, (0.0, search.most))
    held_alone = alone.with_jaw_at(held[0][0])
    acting = replace(held_alone, liquid=None, activations={**rising, muscle: full})
    model = without_neck(acting.quasi_static)
    solver = fastest_solver()
    equilibria = [kept_at(model)]

    def beyond(activation: float) -> float:
        load = Load(time_s=_rise_time(activation / search.most))
        below = [each for each in equilibria if each.load.time_s <= load.time_s]
        *_, last = static_path(model, load, start=below[-1], solver=solver, threads=threads)
        if not last.converged:
            return math.nan
        equilibria.append(last)
        equilibria.sort(key=lambda each: each.load.time_s)
        # A neck that never comes near is cleared by any distance; what is watched is so far away.
        return min(clearance(last.displacement), search.reach_mm) - seen.clearance_mm

    return beyond


RISE = Amplitude((0.0, 1.0), (0.0, 1.0))
"""How much of the largest activation acts in a search by statics, against its time."""


def _rise_time(share: float) -> float:
    """Return the time at which a share (0…1) of the largest activation acts."""
    return float(brentq(lambda time: RISE.at(time) - share, 0.0, 1.0, xtol=1e-12))


def _followed(
    alone: Lips,
    motion: RigidMotion,
    activations: Mapping[str, Amplitude],
    start_s: float,
    end_s: float,
    threads: Threads,
) -> tuple[State, tuple[ContactResponse, ...]] | None:
    """Return state and contacts of a lip that followed the film; None if it could not."""
    acting = replace(alone, activations=activations)
    model, numerics = acting.fem_model, alone.scenario.numerics
    begin_s = min([start_s, *(each.time_s[0] for each in activations.values())])
    rest = Load.at(motion.at(begin_s), begin_s)
    state = model.at_rest(rest, next_step_s=numerics.steps.longest_s)
    result = march(
        model, motion, state,
        solver=fastest_solver(), end_s=end_s, steps=numerics.steps, newton=numerics.newton,
        threads=threads,
    )  # fmt: skip
    if result.status is not MarchStatus.FINISHED:
        return None
    at = result.state
    return at, model.contact_responses(at.displacement, at.placement, at)


def _reaches(
    alone: Lips,
    motion: RigidMotion,
    active: Callable[[float], dict[str, Amplitude]],
    start_s: float,
    threads: Threads,
) -> Callable[[float], float]:
    """Return what tells how deep a lip lies in the neck at a depth from the rim or beyond, mm."""
    settings = alone.scenario.muscles
    assert settings is not None
    seen = settings.seen
    assert seen.reach_time_s is not None and seen.lower_reach_mm is not None
    instant, place = seen.reach_time_s, motion.at(seen.reach_time_s)
    from_mm = float(alone.neck.rim_edge("lower")[0]) + seen.lower_reach_mm
    skin = alone.free_surface(alone.present[0])

    def beyond(activation: float) -> float:
        followed = _followed(alone, motion, active(activation), start_s, instant, threads)
        if followed is None:
            return math.nan
        points = place.pull_back(skin.positions(followed[0].displacement).reshape(-1, 2))
        behind = points[points[:, 0] >= from_mm]
        gap = alone.neck.lower_wall.project(behind).distance
        return TOUCHING_MM - float(np.min(gap, initial=alone.neck.lower_wall.length))

    return beyond


def _seals(
    alone: Lips,
    motion: RigidMotion,
    active: Callable[[float], dict[str, Amplitude]],
    start_s: float,
    threads: Threads,
) -> Callable[[float], float]:
    """Return what tells by how much more than asked a lip presses beyond the liquid, kPa."""
    settings = alone.scenario.muscles
    assert settings is not None and settings.seen.seal_time_s is not None
    assert alone.liquid is not None  # the scenario says what is to be held back
    seen, instant = settings.seen, settings.seen.seal_time_s
    liquid, skin = alone.liquid(instant), alone.free_surface(alone.present[0])

    def beyond(activation: float) -> float:
        followed = _followed(alone, motion, active(activation), start_s, instant, threads)
        if followed is None:
            return math.nan
        state, contacts = followed
        on_neck = [each for each in rigid_responses(contacts) if each.contact.moving]
        line = line_on_neck(skin, on_neck, state.displacement)
        held_back = liquid.held_back_mpa(skin.positions(state.displacement))
        return 1e3 * seal_margin_mpa(line, held_back) - seen.seal_kpa

    return beyond
