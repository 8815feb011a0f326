"""The pressure of liquid on the skin that it wets: hydrostatic, and what is sucked at it.

Below the free surface, at the level ``up·x = z``, the gauge pressure is ``ρ g (z − up·x) − s`` with
the suction ``s`` in the mouth; above it there is air, sucked at as well. It acts as a follower
pressure on a stretch of skin, fading towards the stretch's ends.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import BodyComponent
from fem2d.body.sparse import SparsePattern
from fem2d.body.surface import Surface
from fem2d.loads.amplitude import LoadError
from fem2d.loads.fading import stretch_share
from fem2d.loads.follower import PressureField, follower_force, follower_stiffness
from fem2d.loads.load import Load

Array = NDArray[np.float64]

GRAVITY_M_PER_S2 = 9.81


def weight_mpa_per_mm(density_kg_per_m3: float) -> float:
    """Return the weight of a liquid, ρ g, MPa/mm.

    >>> round(1e6 * weight_mpa_per_mm(1000.0), 3)
    9.81
    """
    return 1e-9 * density_kg_per_m3 * GRAVITY_M_PER_S2


@dataclass(frozen=True)
class LiquidPressure:
    """The pressure of liquid at rest, and of the air over it.

    Attributes
    ----------
    level_mm
        Level of the free surface, along ``up``, mm.
    up
        (2,) unit vector upwards.
    weight_mpa_per_mm
        Weight of the liquid, MPa/mm.
    suction_mpa
        By how much the pressure in the mouth is below that outside, MPa.
    """

    level_mm: float
    up: tuple[float, float]
    weight_mpa_per_mm: float
    suction_mpa: float = 0.0

    def __post_init__(self) -> None:
        if abs(np.hypot(*self.up) - 1.0) > 1e-9:
            raise LoadError(f"up = {self.up} is no unit vector: divide it by its length")
        if not self.weight_mpa_per_mm >= 0:
            raise LoadError(f"weight_mpa_per_mm = {self.weight_mpa_per_mm:g} must not be negative")

    def at(self, position: Array) -> tuple[Array, Array]:
        """Return the gauge pressure (...,), MPa, at positions (..., 2), and its gradient, MPa/mm.

        At the free surface the gradient jumps; the pressure does not.
        """
        upwards = np.asarray(self.up)
        depth = np.maximum(self.level_mm - position @ upwards, 0.0)
        slope = np.where(depth > 0, -self.weight_mpa_per_mm, 0.0)
        pressure: Array = self.weight_mpa_per_mm * depth - self.suction_mpa
        return pressure, slope[..., None] * upwards

    def held_back_mpa(self, position: Array) -> Array:
        """Return the pressure difference (...,), MPa, that a seal at positions (..., 2) holds.

        Liquid must not leave and air must not enter: the head and the suction count both.
        """
        depth = np.maximum(self.level_mm - position @ np.asarray(self.up), 0.0)
        held: Array = self.weight_mpa_per_mm * depth + self.suction_mpa
        return held


@dataclass(frozen=True)
class LiquidLoad:
    """A pressure that depends on place and time on a stretch of skin.

    Parameters
    ----------
    name
        Name in reports.
    surface
        The surface that carries the stretch, with Gauss points.
    from_mm, to_mm
        Arc length along the undeformed surface where the stretch begins and ends, mm.
    fade_mm
        Arc length inside the stretch over which the pressure rises from nothing at each end.
    field
        The pressure at each instant, s.
    """

    name: str
    surface: Surface
    from_mm: float
    to_mm: float
    fade_mm: float
    field: Callable[[float], PressureField]
    share: Array = dataclasses.field(init=False, repr=False, compare=False)
    """(m, q) how much of the pressure acts at the Gauss points."""

    def __post_init__(self) -> None:
        if self.surface.at_nodes:
            raise LoadError(f"{self.name}: give a surface with Gauss points, a pressure varies")
        share = stretch_share(self.name, self.surface, self.from_mm, self.to_mm, self.fade_mm)
        object.__setattr__(self, "share", share)

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surface it acts on."""
        return (self.surface,)

    def on_component(self, component: BodyComponent) -> LiquidLoad | None:
        """Return the same load on a component that has its surface; see `AppliedForce`."""
        if not component.has(self.surface):
            return None
        return replace(self, surface=component.surface(self.surface))

    def force(self, displacement: Array, load: Load) -> Array:
        """Return the nodal forces (2n,), N, at the instant of a load; see `AppliedForce`."""
        pressure, _ = self.field(load.time_s).at(self.surface.positions(displacement))
        nodal = follower_force(self.surface, displacement, self.share * pressure)
        return self.surface.scattered(nodal)

    def change(self, displacement: Array, before: Load, after: Load) -> Array:
        """Return the change of the forces (2n,), N, between the instants of two loads."""
        return self.force(displacement, after) - self.force(displacement, before)

    def add_stiffness(
        self, data: Array, pattern: SparsePattern, displacement: Array, load: Load, *, psd: bool
    ) -> None:
        """Add minus the derivative of the forces, N/mm; nothing with ``psd``."""
        if psd:
            return
        pressure, gradient = self.field(load.time_s).at(self.surface.positions(displacement))
        share = self.share
        blocks = follower_stiffness(
            self.surface, displacement, share * pressure, share[..., None] * gradient
        )
        np.subtract.at(data, pattern.slots(self.surface.dofs), blocks)

    def energy(self, displacement: Array, load: Load) -> float:
        """Return 0: a pressure on part of a surface has no potential."""
        return 0.0
