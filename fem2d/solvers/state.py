"""What equilibrium at the next instant depends on, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.contact.rigid import ContactHistory
from fem2d.contact.self_contact import SelfContactHistory
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """A committed instant.

    Attributes
    ----------
    time_s
        When, s.
    placement
        Where the moving rigid body is.
    displacement, velocity, acceleration
        (n, 2) of the nodes, mm, mm/s, mm/s².
    histories
        What friction remembers, one per contact pair.
    next_step_s
        How long the next step is to be, s.
    fold_histories
        What friction remembers where the tissue touches itself, one per contact.
    """

    time_s: float
    placement: RigidPlacement
    displacement: Array
    velocity: Array
    acceleration: Array
    histories: tuple[ContactHistory, ...]
    next_step_s: float
    fold_histories: tuple[SelfContactHistory, ...] = ()
