"""What acts on a model at one instant: rigid bodies, pressure, supports, dead forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import BodyComponent
from fem2d.body.sparse import SparsePattern
from fem2d.body.surface import Surface
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Load:
    """What acts on a model at one instant.

    Parameters
    ----------
    move
        Shift of the moving rigid bodies, mm.
    turn_rad
        Angle by which they are turned about their origin, rad.
    pressure_mpa
        Pressure on the surfaces with a follower pressure, MPa; suction is negative.
    held_mm
        (h,) displacements of the held unknowns, or one for all of them, mm.
    dead_n
        (2n,) dead nodal forces, or 0, N.
    time_s
        The instant at which the amplitudes of dead loads are read, s.
    """

    move: tuple[float, float] = (0.0, 0.0)
    turn_rad: float = 0.0
    pressure_mpa: float = 0.0
    held_mm: Array | float = 0.0
    dead_n: Array | float = 0.0
    time_s: float = 0.0

    @classmethod
    def at(cls, placement: RigidPlacement, time_s: float = 0.0) -> Load:
        """Return the load that only moves the rigid bodies, to a placement at an instant, s."""
        return cls(placement.shift_mm, placement.angle_rad, time_s=time_s)

    @property
    def placement(self) -> RigidPlacement:
        """Placement of the moving rigid bodies."""
        return RigidPlacement(self.turn_rad, self.move)

    def towards(self, other: Load, share: float) -> Load:
        """Return the load a share (0…1) of the way to another one."""
        rest = 1 - share
        shift = rest * np.asarray(self.move) + share * np.asarray(other.move)
        return Load(
            (float(shift[0]), float(shift[1])),
            rest * self.turn_rad + share * other.turn_rad,
            rest * self.pressure_mpa + share * other.pressure_mpa,
            rest * self.held_mm + share * other.held_mm,
            rest * self.dead_n + share * other.dead_n,
            rest * self.time_s + share * other.time_s,
        )


Loading: TypeAlias = Callable[[float], Load]
"""What acts at each instant, s."""


class AppliedForce(Protocol):
    """A force on a body whose size a `Load` gives: a dead load, a pressure, a muscle."""

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surfaces it acts on, if it acts on any."""
        ...

    def on_component(self, component: BodyComponent) -> AppliedForce | None:
        """Return the part of the force that acts on a component; None if none does."""
        ...

    def force(self, displacement: Array, load: Load) -> Array:
        """Return the nodal forces (2n,), N, at a displacement (n, 2), mm."""
        ...

    def change(self, displacement: Array, before: Load, after: Load) -> Array:
        """Return the change of the forces (2n,), N, from one load to another."""
        ...

    def add_stiffness(
        self, data: Array, pattern: SparsePattern, displacement: Array, load: Load, *, psd: bool
    ) -> None:
        """Add minus the derivative of the forces, N/mm, to the data (nonzeros,) of a pattern.

        With ``psd`` at most a part of it that is positive semi-definite.
        """
        ...

    def energy(self, displacement: Array, load: Load) -> float:
        """Return the energy, N mm, of a force that has a potential; 0 for others."""
        ...
