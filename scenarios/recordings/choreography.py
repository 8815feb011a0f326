"""Scripted drinking motions: how head and neck move in a rendered recording.

Reaching movements of people are well described by *minimum-jerk* steps (Flash & Hogan 1985), and
longer ones by steps that overlap in time. A `PosePath` is such a sum: a starting pose and steps,
each with its own beginning and end. A step begins and ends at rest with zero acceleration, so
every path is twice continuously differentiable, also where steps overlap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidMotion

Array = NDArray[np.float64]


class ChoreographyError(DrinksimError):
    """A scripted motion cannot be carried out."""


@dataclass(frozen=True)
class PoseStep:
    """One minimum-jerk movement: from when to when (s), by how much (mm, degrees)."""

    from_s: float
    to_s: float
    x_mm: float = 0.0
    y_mm: float = 0.0
    turn_deg: float = 0.0
    why: str = ""

    def __post_init__(self) -> None:
        if not self.to_s > self.from_s:
            raise ChoreographyError(
                f"step {self.why!r} lasts from {self.from_s} s to {self.to_s} s: let it end after "
                "it begins"
            )


@dataclass(frozen=True)
class PosePath:
    """Where a body point goes and how the body turns meanwhile.

    Parameters
    ----------
    point_mm
        The body point (x, y), in the body's coordinates, that the path leads and about which the
        body turns.
    start_mm, start_deg
        Where that point is and how the body is turned before the first step.
    steps
        Movements, each added to the others; they may overlap.
    """

    point_mm: tuple[float, float]
    start_mm: tuple[float, float]
    start_deg: float
    steps: tuple[PoseStep, ...] = ()

    def motion(self, time_s: ArrayLike) -> RigidMotion:
        """Return the motion sampled at times (n,), s."""
        time = np.asarray(time_s, float)
        position = np.tile(np.asarray(self.start_mm, float), (time.size, 1))
        turn = np.full(time.size, self.start_deg)
        for step in self.steps:
            share = minimum_jerk((time - step.from_s) / (step.to_s - step.from_s))
            position += share[:, None] * [step.x_mm, step.y_mm]
            turn += share * step.turn_deg
        return RigidMotion.of_reference_point(time, np.radians(turn), position, self.point_mm)


def minimum_jerk(share_of_time: ArrayLike) -> Array:
    """Return the share of the way covered, 0...1, at a share of the time, held outside 0...1.

    10 s³ - 15 s⁴ + 6 s⁵ (Flash & Hogan 1985, eq. 3): the smoothest way from rest to rest; its peak
    speed is 1.875 times the mean.

    >>> minimum_jerk([-1.0, 0.0, 0.5, 1.0, 2.0]).tolist()
    [0.0, 0.0, 0.5, 1.0, 1.0]
    """
    s = np.clip(np.asarray(share_of_time, float), 0, 1)
    return np.asarray(s**3 * (10 + s * (6 * s - 15)))
