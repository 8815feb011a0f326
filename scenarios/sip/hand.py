"""The hand of a scenario: what it bears, from a reference run or as stated, and how it yields.

The section stands for a width of lip; a hand's stiffness, in newtons, is shared out over it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.solvers.hand import Borne, Hand
from geometry2d.rigid import rotated
from scenarios.results.quantities import LIPS, WALLS
from scenarios.results.solution import Solution
from scenarios.settings.hand import HandSettings
from scenarios.settings.scenario import Scenario, ScenarioError

Array = NDArray[np.float64]

N_PER_MM = 1e-3
"""N/mm in 1 N/m, and N s/mm in 1 N s/m."""

NMM_PER_NM = 1e3

LOOSE_N_PER_M = 0.5
"""Stiffness that keeps a package near the film while its lips' forces are held: 1 mm off the film
changes a force by half a millinewton."""

RAMP_S = 0.2
"""Time in which a lip takes over a stated force once it is touched."""


@dataclass(frozen=True)
class Reference:
    """What the lips of a reference run bore, in the frame of the head section.

    Attributes
    ----------
    time_s
        (k,) instants, s.
    force_n
        (k, 2) of each lip on the neck, by lip, N, of the section.
    moment_nmm
        (k,) about the neck's lower mark, N mm, of the section.
    thickness_mm
        Thickness of its section, mm.
    """

    time_s: Array
    force_n: Mapping[str, Array]
    moment_nmm: Array
    thickness_mm: float

    @classmethod
    def of(cls, solution: Solution, head_angle_rad: float) -> Reference:
        """Return what the lips of a run bore.

        Parameters
        ----------
        solution
            The run.
        head_angle_rad
            Turn of the head section into the head frame, in which a run's forces are kept.
        """
        history = solution.history
        return cls(
            solution.time_s,
            {
                lip: rotated(
                    np.column_stack([history[f"{lip}_lip_force_{axis}_n"] for axis in "xy"]),
                    -head_angle_rad,
                )
                for lip in LIPS
            },
            history["neck_moment_nmm"],
            solution.scenario.numerics.thickness_mm,
        )

    @property
    def total_n(self) -> Array:
        """(k, 2) force of both lips on the neck, N."""
        total: Array = np.sum([self.force_n[lip] for lip in LIPS], axis=0)
        return total

    def direction(self, lip: str) -> Array:
        """Return the unit vector (2,) of a lip's mean force on the neck.

        Raises
        ------
        ScenarioError
            If the lip bore nothing.
        """
        total = self.force_n[lip].sum(axis=0)
        size = float(np.hypot(*total))
        if size == 0.0:
            raise ScenarioError(
                f'hand.mode = "force": the {lip} lip bears nothing in the reference run; use "same"'
            )
        unit: Array = total / size
        return unit


def hand_of(
    settings: HandSettings,
    reference: Reference,
    thickness_mm: float,
    *,
    weight_n: float | None = None,
) -> Hand | None:
    """Return the hand of a scenario; None if it follows the film.

    Parameters
    ----------
    settings
        The table of the hand.
    reference
        What was borne in the run whose forces are followed.
    thickness_mm
        Thickness of the section that is to be solved, mm.
    weight_n
        Weight of package and content, N, of which a lip may bear a share.
    """
    if settings.mode == "recorded":
        return None
    share = thickness_mm / settings.width_mm
    scale = thickness_mm / reference.thickness_mm
    if settings.mode == "same":
        shift = settings.stiffness_n_per_m * N_PER_MM * share
        turn = settings.turning_stiffness_nm_per_rad * NMM_PER_NM * share
        damping = settings.damping_n_s_per_m * N_PER_MM * share
        borne = np.column_stack([reference.total_n, reference.moment_nmm]) * scale
        return Hand.yielding(
            (shift, shift, turn), Borne(reference.time_s, borne), damping=(damping, damping, 0.0)
        )
    directions = np.array([reference.direction(lip) for lip in LIPS])
    return Hand.of_forces(
        [[f"{lip} lip on {wall}" for wall in WALLS] for lip in LIPS],
        directions,
        Borne(
            reference.time_s,
            _wanted(settings.forces_n(weight_n), reference, directions, share, scale),
        ),
        stiffness=LOOSE_N_PER_M * N_PER_MM * share,
        damping=settings.damping_n_s_per_m * N_PER_MM * share,
    )


def _wanted(
    stated_n: tuple[float, float] | None,
    reference: Reference,
    directions: Array,
    share: float,
    scale: float,
) -> Array:
    """Return the forces (k, 2) that the lips are to bear along their directions, N."""
    bore = np.column_stack(
        [reference.force_n[lip] @ along for lip, along in zip(LIPS, directions, strict=True)]
    )
    if stated_n is None:
        return bore * scale
    acts = np.column_stack([_touched(reference.time_s, column) for column in bore.T])
    stated: Array = share * np.array(stated_n) * acts
    return stated


def _touched(time_s: Array, force: Array) -> Array:
    """Return (k,) how much of a stated force acts: from the first touch on to the last."""
    touching = time_s[force > 0]
    first, last = touching[0], touching[-1]
    rise = np.clip((time_s - first) / RAMP_S, 0.0, 1.0)
    fall = np.clip((last - time_s) / RAMP_S, 0.0, 1.0)
    share: Array = np.minimum(rise, fall)
    return share


def chosen_hand(
    scenario: Scenario, reference: Solution | None, head_angle_rad: float
) -> Hand | None:
    """Return the hand of a scenario; None if it follows the film.

    Parameters
    ----------
    scenario
        Its table of the hand is used.
    reference
        The run whose forces are followed.
    head_angle_rad
        Turn of the head section into the head frame.

    Raises
    ------
    ScenarioError
        If the hand needs a reference run and there is none.
    """
    if scenario.hand.mode == "recorded":
        return None
    if reference is None:
        raise ScenarioError(
            f'hand.mode = "{scenario.hand.mode}" needs a reference run: give hand.reference'
        )
    bore = Reference.of(reference, head_angle_rad)
    thickness = scenario.numerics.thickness_mm
    return hand_of(scenario.hand, bore, thickness, weight_n=scenario.weight_n)


def about_hand(scenario: Scenario, reference: Solution) -> dict[str, Any]:
    """Return the numbers for the summary."""
    settings = scenario.hand
    stated = settings.forces_n(scenario.weight_n)
    forces = {} if stated is None else dict(zip(("upper_n", "lower_n"), stated, strict=True))
    return {
        **forces,
        "mode": settings.mode,
        "width_mm": settings.width_mm,
        "reference": reference.name,
        "reference_upper_window_kpa": reference.summary["upper_lip_window_kpa"],
        "reference_lower_window_kpa": reference.summary["lower_lip_window_kpa"],
    }
