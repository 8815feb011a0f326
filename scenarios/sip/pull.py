"""The pseudo-muscle that pulls a lip out of the neck's way: search for traction and direction.

The thesis guessed size and direction of the force by trial and error. Here they are searched. For
a direction, the pull on the lip alone, without the neck, is raised until the lip keeps a clearance
from the neck's path while the muscle holds. Of all directions, the one with the smallest pull is
taken. When the muscle relaxes, the lip comes to rest on the neck.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from fem2d.loads.amplitude import Amplitude
from fem2d.loads.load import Load
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.static import StaticResult, kept_at, static_path
from fem2d.threads import Threads
from geometry2d.foundation.progress import Progress, no_progress
from geometry2d.rigid import RigidMotion
from scenarios.settings.scenario import Muscle, ScenarioError
from scenarios.settings.searches import PullSearch
from scenarios.sip.clearance import MovingNeck, PathClearance, held_times
from scenarios.sip.lip_model import Lips, Pull, without_neck

Array = NDArray[np.float64]

RISE = Amplitude((0.0, 1.0), (0.0, 1.0))
"""Amplitude of a trial pull. Its time is the share of the largest pull: statics has no other."""


@dataclass(frozen=True)
class PullResult:
    """A pull and its effect.

    Attributes
    ----------
    pull
        The pull.
    clearance_mm
        Smallest distance of the held lip from the neck's path, mm, without contact.
    equilibria
        Number of equilibria that the search solved.
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


def find_pull(
    lips: Lips,
    motion: RigidMotion,
    *,
    threads: Threads | None = None,
    progress: Progress = no_progress,
) -> PullResult | None:
    """Return the pull of a scenario's muscle, searched where it is "auto"; None without a muscle.

    Parameters
    ----------
    lips
        The model that the pull is for. Trials are made on the lip alone and on the coarse mesh, so
        that the pull does not depend on the resolution of the replay.
    motion
        Of the neck in the head section.
    threads
        That share the work; two by default.
    progress
        Told which direction is tried.

    Raises
    ------
    ScenarioError
        If no pull within the bounds of the search keeps the lip clear of the neck.
    """
    muscle = lips.scenario.muscle
    if muscle is None:
        return None
    trial = _Trial.of(lips, muscle, motion, threads or Threads())
    if muscle.direction_deg != "auto":
        return trial.checked(trial.solved(muscle.direction_deg))
    search = lips.scenario.numerics.pull_search
    directions = search.directions_deg
    progress(0.0, f"pulling the {muscle.lip} lip in {len(directions)} directions")
    tried = []
    for first in range(0, len(directions), 2):
        two_at_once = directions[first : first + 2]
        tried += trial.threads.run([partial(trial.solved, towards) for towards in two_at_once])

    def cost_kpa(direction_deg: float) -> float:
        progress(0.0, f"pulling the {muscle.lip} lip towards {direction_deg:.0f}°")
        tried.append(trial.solved(float(direction_deg)))
        return trial.cost(tried[-1])

    best = int(np.argmin([trial.cost(result) for result in tried]))
    around = (max(best - 1, 0), min(best + 1, len(tried) - 1))
    minimize_scalar(
        cost_kpa,
        bounds=[directions[k] for k in around],
        method="bounded",
        options={"xatol": search.direction_tolerance_deg},
    )
    result = trial.checked(min(tried, key=trial.cost))
    return replace(result, equilibria=sum(each.equilibria for each in tried))


@dataclass(frozen=True)
class _Trial:
    """A lip alone, and the neck's path while the muscle holds.

    Attributes
    ----------
    lips, model
        The lip, and its model without the neck and without inertia.
    muscle, search
        What is wanted, and how it is searched.
    clearance
        Of the lip from the neck's path.
    threads
        Share the work.
    """

    lips: Lips
    muscle: Muscle
    search: PullSearch
    model: Model
    clearance: PathClearance
    threads: Threads

    @classmethod
    def of(cls, lips: Lips, muscle: Muscle, motion: RigidMotion, threads: Threads) -> _Trial:
        scenario = lips.scenario
        coarse = scenario.with_(numerics={"resolution": "coarse"})
        alone = replace(lips, scenario=coarse, present=(muscle.lip,), pull=None).with_jaw_at(
            muscle.tense_to_s[0]
        )
        search = scenario.numerics.pull_search
        held = zip(muscle.tense_to_s, muscle.relax_from_s, strict=True)
        times = held_times(held, search.instants)
        neck = MovingNeck.of(lips.neck, [motion.at(float(time)) for time in times])
        return cls(
            lips=alone,
            muscle=muscle,
            search=search,
            model=without_neck(alone.quasi_static),
            clearance=PathClearance.of(alone.free_surface(muscle.lip), neck, search.reach_mm),
            threads=threads,
        )

    def solved(self, direction_deg: float) -> PullResult:
        """Return the smallest sufficient pull in a direction, or else the largest that is tried."""
        given = self.muscle.traction_kpa
        search = self.search
        most_kpa = search.most_kpa if given == "auto" else given
        wanted_mm = self.muscle.clearance_mm if given == "auto" else np.inf
        pull = Pull(self.muscle, most_kpa, direction_deg)
        pulling = replace(self.lips.load(pull), amplitude=RISE)
        model = replace(self.model, loads=(*self.model.loads, pulling))
        solver = fastest_solver()
        equilibria = 0

        def raised(start: StaticResult, share: float) -> tuple[StaticResult, float]:
            nonlocal equilibria
            load = Load(time_s=share)
            path = list(static_path(model, load, start=start, solver=solver, threads=self.threads))
            equilibria += sum(result.converged for result in path)
            return path[-1], self.clearance(path[-1].displacement)

        best = low = kept_at(model)
        best_mm = low_mm = self.clearance(low.displacement)
        while best_mm < wanted_mm and best.load.time_s < 1.0:
            low, low_mm = best, best_mm
            best, best_mm = raised(low, min(1.0, low.load.time_s + search.rising_step))
            if best.load.time_s == low.load.time_s:
                break
        # Between the two by false position, aimed a little beyond the wanted clearance.
        aim_mm = wanted_mm + 0.5 * search.clearance_tolerance_mm
        for _ in range(search.refinements):
            if not low_mm < wanted_mm <= best_mm - search.clearance_tolerance_mm:
                break
            into = (aim_mm - low_mm) / (best_mm - low_mm)
            middle_share = low.load.time_s + into * (best.load.time_s - low.load.time_s)
            middle, middle_mm = raised(low, middle_share)
            if middle_mm < wanted_mm:
                low, low_mm = middle, middle_mm
            else:
                best, best_mm = middle, middle_mm
        share = best.load.time_s
        share = 1.0 if math.isclose(share, 1.0) else RISE.at(share)
        return PullResult(replace(pull, traction_kpa=share * most_kpa), best_mm, equilibria)

    def cost(self, result: PullResult) -> float:
        """Return the pull, kPa; larger than any pull where the clearance falls short."""
        short_mm = self.muscle.clearance_mm - result.clearance_mm
        return result.pull.traction_kpa if short_mm <= 0 else self.search.most_kpa + short_mm

    def checked(self, result: PullResult) -> PullResult:
        """Return a pull whose size is given, or that keeps the lip clear.

        Raises
        ------
        ScenarioError
            If a searched pull does not.
        """
        muscle = self.muscle
        if muscle.traction_kpa == "auto" and result.clearance_mm < muscle.clearance_mm:
            raise ScenarioError(
                f"no pull on the {muscle.lip} lip up to {self.search.most_kpa:g} kPa keeps it "
                f"{muscle.clearance_mm:g} mm clear of the neck; the best, towards "
                f"{result.pull.direction_deg:.0f}°, reaches {result.clearance_mm:.1f} mm: open the "
                "jaw, shift the package, or tense the muscle before the neck is there"
            )
        return result
