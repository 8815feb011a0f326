"""What equilibrium at the next instant depends on, as frozen values."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.contact.contact import ContactState
from fem2d.loads.load import Load
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class State:
    """A committed instant.

    Attributes
    ----------
    load
        What acts.
    displacement, velocity, acceleration
        (n, 2) of the nodes, mm, mm/s, mm/s²; the last two are zero in statics.
    contacts
        What friction remembers, one state for each contact of the model.
    next_step_s
        How long the next step is to be at most, s.
    """

    load: Load
    displacement: Array
    velocity: Array
    acceleration: Array
    contacts: tuple[ContactState, ...]
    next_step_s: float = math.inf

    @property
    def time_s(self) -> float:
        """When, s."""
        return self.load.time_s

    @property
    def placement(self) -> RigidPlacement:
        """Where the moving rigid bodies are."""
        return self.load.placement
