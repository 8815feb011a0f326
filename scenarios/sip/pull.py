"""The pseudo-muscle that draws a lip out of the neck's way: how hard it pulls, and where to.

The thesis guessed size and direction of the force by trial and error. Here the same trial is made
in order: for a direction, the pull on the lip alone, with the neck away, is raised until the drawn
lip is clear of the neck wherever that is while the muscle holds; of all directions the one that
needs the smallest pull is taken. What relaxes afterwards lies down on the neck by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from fem2d.body.surface import Surface
from fem2d.contact.rigid import RigidContact
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.load import Load
from fem2d.solvers.inertia import QUASI_STATIC
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.static import StaticResult, kept_at, static_path
from fem2d.threads import Threads
from geometry2d.foundation.progress import Progress
from geometry2d.neck import NeckSection
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion, RigidPlacement
from scenarios.settings.scenario import Muscle, ScenarioError
from scenarios.settings.searches import PullSearch
from scenarios.sip.lip_model import Lips, Pull

Array = NDArray[np.float64]

RISE = Amplitude((0.0, 1.0), (0.0, 1.0))
"""How a trial pull rises. Its time only counts the way: the lip is at rest at every step."""


@dataclass(frozen=True)
class FoundPull:
    """A pull, and how it was found.

    Attributes
    ----------
    pull
        The pull.
    clearance_mm
        How near the held lip comes to the neck, the lip alone considered, mm.
    equilibria
        Equilibria of the lip that the search solved.
    """

    pull: Pull
    clearance_mm: float
    equilibria: int

    def about(self) -> dict[str, Any]:
        """Return the numbers for the summary."""
        return {
            "lip": self.pull.muscle.lip,
            "traction_kpa": self.pull.traction_kpa,
            "direction_deg": self.pull.direction_deg,
            "clearance_mm": self.clearance_mm,
            "equilibria_solved": self.equilibria,
            "found": "auto" in (self.pull.muscle.traction_kpa, self.pull.muscle.direction_deg),
        }


def found_pull(
    lips: Lips,
    motion: RigidMotion,
    *,
    progress: Progress = lambda share, what: None,
) -> FoundPull | None:
    """Return the pull of a scenario's muscle, found where it says "auto"; None without a muscle.

    Parameters
    ----------
    lips
        The model that the pull is for. Trials are made on the lip alone and on the coarse mesh, so
        that the pull does not depend on the resolution of the replay.
    motion
        Of the neck in the head frame.

    Raises
    ------
    ScenarioError
        If no pull that is tried keeps the lip clear of the neck.
    """
    muscle = lips.scenario.muscle
    if muscle is None:
        return None
    trial = _Trial.of(lips, muscle, motion)
    if muscle.direction_deg != "auto":
        return trial.enough(muscle, trial.pulled(muscle.direction_deg))
    search = lips.scenario.numerics.pull_search
    directions = search.directions_deg
    progress(0.0, f"pulling the {muscle.lip} lip in {len(directions)} directions")
    tried = []
    for first in range(0, len(directions), 2):
        two_at_once = directions[first : first + 2]
        tried += trial.threads.run([partial(trial.pulled, towards) for towards in two_at_once])

    def needed_kpa(direction_deg: float) -> float:
        progress(0.0, f"pulling the {muscle.lip} lip towards {direction_deg:.0f}°")
        tried.append(trial.pulled(float(direction_deg)))
        return trial.cost(tried[-1])

    best = int(np.argmin([trial.cost(pull) for pull in tried]))
    around = (max(best - 1, 0), min(best + 1, len(tried) - 1))
    minimize_scalar(
        needed_kpa,
        bounds=[directions[k] for k in around],
        method="bounded",
        options={"xatol": search.direction_tolerance_deg},
    )
    found = min(tried, key=trial.cost)
    return replace(trial.enough(muscle, found), equilibria=sum(t.equilibria for t in tried))


@dataclass(frozen=True)
class _Trial:
    """A lip alone, and where the neck is while the muscle holds the lip."""

    lips: Lips
    muscle: Muscle
    places: Sequence[RigidPlacement]
    obstacles: tuple[Outline, ...]
    system: Model
    skin: Surface
    reachable: NDArray[np.bool_]
    threads: Threads
    search: PullSearch

    @classmethod
    def of(cls, lips: Lips, muscle: Muscle, motion: RigidMotion) -> _Trial:
        scenario = lips.scenario
        coarse = scenario.with_(numerics={"resolution": "coarse"})
        alone = replace(lips, scenario=coarse, present=(muscle.lip,), pull=None)
        system, search = alone.system, scenario.numerics.pull_search
        times = np.concatenate(
            [
                np.linspace(held_from, held_to, search.instants)
                for held_from, held_to in zip(muscle.tense_to_s, muscle.relax_from_s, strict=True)
            ]
        )
        places = [motion.at(float(time)) for time in times]
        obstacles = (lips.neck.upper_wall, lips.neck.lower_wall, _bore(lips.neck))
        skin = alone.free_surface(muscle.lip)
        undrawn = skin.positions(np.zeros_like(skin.nodes)).reshape(-1, 2)
        near: NDArray[np.bool_] = (
            _at_least(_seen_from(undrawn, places), obstacles).min(axis=0) < search.reach_mm
        )
        near_places, near_points = np.flatnonzero(near.any(axis=1)), near.any(axis=0)
        return cls(
            lips=alone,
            muscle=muscle,
            places=[places[k] for k in near_places],
            obstacles=obstacles,
            system=replace(
                system,
                contacts=[
                    contact
                    for contact in system.contacts
                    if not (isinstance(contact, RigidContact) and contact.moving)
                ],
                inertia=QUASI_STATIC,
            ),
            skin=skin,
            reachable=np.asarray(near_points),
            threads=Threads(),
            search=search,
        )

    def pulled(self, direction_deg: float) -> FoundPull:
        """Return the smallest pull in a direction that is enough, or else the largest tried."""
        given = self.muscle.traction_kpa
        search = self.search
        most_kpa = search.most_kpa if given == "auto" else given
        enough_mm = self.muscle.clearance_mm if given == "auto" else np.inf
        pull = Pull(self.muscle, most_kpa, direction_deg)
        rising = replace(self.lips.load(pull), amplitude=RISE)
        system = replace(self.system, loads=(rising,))
        solver = fastest_solver()
        equilibria = 0

        def risen(start: StaticResult, time_s: float) -> tuple[StaticResult, float]:
            nonlocal equilibria
            load = Load(time_s=time_s)
            way = list(static_path(system, load, start=start, solver=solver, threads=self.threads))
            equilibria += sum(result.converged for result in way)
            return way[-1], self._clearance(way[-1].displacement)

        best = low = kept_at(system)
        best_mm = low_mm = self._clearance(low.displacement)
        while best_mm < enough_mm and best.load.time_s < 1.0:
            low, low_mm = best, best_mm
            best, best_mm = risen(low, min(1.0, low.load.time_s + search.rising_step))
            if best.load.time_s == low.load.time_s:
                break
        # Between the two by false position, aimed a little beyond what is enough.
        aim_mm = enough_mm + 0.5 * search.clearance_tolerance_mm
        for _ in range(search.refinements):
            if not low_mm < enough_mm <= best_mm - search.clearance_tolerance_mm:
                break
            into = (aim_mm - low_mm) / (best_mm - low_mm)
            aim = low.load.time_s + into * (best.load.time_s - low.load.time_s)
            middle, middle_mm = risen(low, aim)
            if middle_mm < enough_mm:
                low, low_mm = middle, middle_mm
            else:
                best, best_mm = middle, middle_mm
        time_s = best.load.time_s
        share = 1.0 if math.isclose(time_s, 1.0) else RISE.at(time_s)
        return FoundPull(replace(pull, traction_kpa=share * most_kpa), best_mm, equilibria)

    def cost(self, found: FoundPull) -> float:
        """Return the pull that is needed, kPa, larger than any where what was tried falls short."""
        short_mm = self.muscle.clearance_mm - found.clearance_mm
        return found.pull.traction_kpa if short_mm <= 0 else self.search.most_kpa + short_mm

    def enough(self, muscle: Muscle, found: FoundPull) -> FoundPull:
        """Return the pull if it keeps the lip clear, or if nothing else was asked for."""
        if muscle.traction_kpa == "auto" and found.clearance_mm < muscle.clearance_mm:
            raise ScenarioError(
                f"no pull on the {muscle.lip} lip up to {self.search.most_kpa:g} kPa keeps it "
                f"{muscle.clearance_mm:g} mm clear of the neck; the best, towards "
                f"{found.pull.direction_deg:.0f}°, reaches {found.clearance_mm:.1f} mm: open the "
                "jaw, shift the package, or tense the muscle before the neck is there"
            )
        return found

    def _clearance(self, displacement: Array) -> float:
        """Return how near the neck comes to the lip at a displacement, mm."""
        points = self.skin.positions(displacement).reshape(-1, 2)[self.reachable]
        return _distance(points, self.places, self.obstacles)


def _at_least(local: Array, obstacles: tuple[Outline, ...]) -> Array:
    """Return how far points (t, p, 2) are at least from outlines (o, t, p), mm.

    It is the distance from the outline's box, 0 inside it.
    """
    far = []
    for left, bottom, right, top in (outline.box for outline in obstacles):
        beside = np.maximum(np.maximum(left - local[..., 0], local[..., 0] - right), 0.0)
        above = np.maximum(np.maximum(bottom - local[..., 1], local[..., 1] - top), 0.0)
        far.append(np.hypot(beside, above))
    return np.array(far)


def _distance(
    points: Array, places: Sequence[RigidPlacement], obstacles: tuple[Outline, ...]
) -> float:
    """Return the smallest distance, mm, of points (p, 2) from outlines put at any of the places."""
    if not places or len(points) == 0:
        return np.inf
    local = _seen_from(points, places)
    nearest = np.inf
    for outline, far in zip(obstacles, _at_least(local, obstacles), strict=True):
        # No point farther from the box than the nearest one is from the outline can be nearer.
        first = np.unravel_index(np.argmin(far), far.shape)
        nearest = min(nearest, float(outline.project(local[first]).distance[0]))
        close = far <= max(nearest, 0.0)
        nearest = float(np.min(outline.project(local[close]).distance, initial=nearest))
    return nearest


def _seen_from(points: Array, places: Sequence[RigidPlacement]) -> Array:
    """Return points (p, 2) in the frames of bodies put at each place (t, p, 2)."""
    return np.array([place.pull_back(points) for place in places]).reshape(-1, len(points), 2)


def _bore(neck: NeckSection) -> Outline:
    """Return what lies between the walls: a lip that hangs into the opening is not clear of it."""
    left, low, right, lower_top = neck.lower_wall.box
    upper_bottom, high = neck.upper_wall.box[1], neck.upper_wall.box[3]
    bottom, top = 0.5 * (low + lower_top), 0.5 * (upper_bottom + high)
    return Outline.from_corners([(left, bottom), (right, bottom), (right, top), (left, top)], 0.1)
