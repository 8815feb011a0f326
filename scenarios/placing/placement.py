"""Placing neck and lower face in the head section: as given, or as first contacts show."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.head import HeadSection
from geometry2d.neck import NeckSection
from geometry2d.rigid import RigidMotion
from scenarios.placing.placement_fit import PlacementFit, smallest_shift
from scenarios.placing.recorded_motion import RecordedMotion
from scenarios.placing.shift import UNKNOWNS, Shift, with_lower_face_moved
from scenarios.settings.scenario import Scenario

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Placed:
    """Head section and motion of the neck after placement, and what was moved.

    Attributes
    ----------
    head
        The head section with its lower face shifted.
    motion
        Of the neck in the head section's own frame.
    head_angle_rad
        Turn of the head section's frame into the head frame, rad.
    shift
        The movement, found or given.
    found
        Standard deviations of what was found, by name, mm or degrees.
    residuals
        Remaining differences from the observations, in standard deviations, by name.
    """

    head: HeadSection
    motion: RigidMotion
    head_angle_rad: float
    shift: Shift
    found: Mapping[str, float]
    residuals: Mapping[str, float]

    def about(self) -> dict[str, Any]:
        """Return the numbers for the summary; a sigma without a bound is None."""
        return {
            **{name: getattr(self.shift, name) for name in UNKNOWNS},
            "found_with_sigma": {
                name: sigma if np.isfinite(sigma) else None for name, sigma in self.found.items()
            },
            "residuals_sigma": dict(self.residuals),
        }


def place(
    scenario: Scenario, neck: NeckSection, head: HeadSection, recorded: RecordedMotion
) -> Placed:
    """Return head section and neck where the scenario's placement puts them.

    Parameters
    ----------
    scenario
        Its ``placement`` gives shifts or asks for them, its ``first_contact`` holds observations.
    neck, head
        The sections, each in its own frame.
    recorded
        The recorded motion.

    Raises
    ------
    ScenarioError
        If no shift within the bounds explains the observations, or if the shifted lower lip
        overlaps the upper one.
    """
    settings = scenario.placement
    given = {name: getattr(settings, name) for name in UNKNOWNS}
    wanted = tuple(name for name, value in given.items() if value == "auto")
    start = Shift(**{name: 0.0 if name in wanted else value for name, value in given.items()})
    search = scenario.numerics.shift_search
    problem = PlacementFit(head, neck, recorded, scenario.first_contact, start, wanted, search)
    if not wanted:
        return _placed(problem, np.zeros(0))
    return _placed(problem, smallest_shift(problem, settings))


def _placed(problem: PlacementFit, q: Array) -> Placed:
    """Return head section and neck moved by values of the unknowns."""
    shift = problem.shift(q)
    found = dict(zip(problem.wanted, problem.sigmas(q), strict=True)) if problem.wanted else {}
    residuals = map(float, problem.residuals(q))
    return Placed(
        with_lower_face_moved(problem.head, shift.lower_face_mm),
        shift.moved(problem.recorded.neck),
        problem.recorded.head_angle_rad,
        shift,
        found,
        dict(zip(problem.observations, residuals, strict=True)),
    )
