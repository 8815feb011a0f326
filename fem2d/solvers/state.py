"""The state of a model at a committed instant: all that the next instant depends on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.body.overstress import Overstress
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
        State of each contact of the model.
    next_step_s
        Upper bound of the next step, s.
    overstress
        What a viscous body remembers; None for an elastic one.
    """

    load: Load
    displacement: Array
    velocity: Array
    acceleration: Array
    contacts: tuple[ContactState, ...]
    next_step_s: float = math.inf
    overstress: Overstress | None = None

    @property
    def time_s(self) -> float:
        """The instant, s."""
        return self.load.time_s

    @property
    def placement(self) -> RigidPlacement:
        """Placement of the moving rigid bodies."""
        return self.load.placement
