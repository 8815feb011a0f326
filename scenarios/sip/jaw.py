"""A jaw that turns while a sip is replayed: its course, and what goes with it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem2d.loads.amplitude import Amplitude
from geometry2d.rigid import RigidPlacement
from scenarios.settings.person import Jaw

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JawCourse:
    """Where the lower jaw is, from where it is when the section is built.

    Attributes
    ----------
    opening_deg
        Its opening against time: smooth between the instants of the table.
    built_deg
        Its opening in the section.
    hinge_mm
        (2,) the axis about which it turns, in the frame of the head section.
    """

    opening_deg: Amplitude
    built_deg: float
    hinge_mm: Array

    @classmethod
    def of(cls, jaw: Jaw, hinge_mm: Array) -> JawCourse | None:
        """Return the course of a jaw; None if it stays where it is."""
        if not jaw.turns:
            return None
        return cls(jaw.amplitude, jaw.opening_deg[0], hinge_mm)

    def resting(self, time_s: float) -> JawCourse:
        """Return the course of a jaw that stays where it is at a time, s."""
        return replace(self, opening_deg=Amplitude((0.0,), (self.opening_deg.at(time_s),)))

    def __call__(self, time_s: float) -> RigidPlacement:
        """Return the placement of what goes with the jaw at a time, s."""
        turn = -float(np.deg2rad(self.opening_deg.at(time_s) - self.built_deg))
        return RigidPlacement.turned_about(self.hinge_mm, turn)
