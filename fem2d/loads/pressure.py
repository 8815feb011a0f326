"""A uniform pressure that stays normal to the surface it acts on, and follows where it goes.

Its forces are those of :mod:`fem2d.loads.follower` for each MPa of it. Inside a suction cup only
the free surface feels the suction: `Exposure` lets it fade where the tissue comes up to the rim,
smoothly, so that the derivative stays continuous.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import BodyComponent
from fem2d.body.sparse import SparsePattern
from fem2d.body.surface import Surface
from fem2d.loads.fading import smooth_step
from fem2d.loads.follower import follower_force, follower_stiffness
from fem2d.loads.load import Load
from geometry2d.foundation.errors import DrinksimError
from geometry2d.outline import Outline

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class PressureError(DrinksimError):
    """A pressure is described in a way that makes no sense."""


@dataclass(frozen=True)
class Exposure:
    """The points of a surface on which a pressure acts: on one side, and away from an outline.

    The share that acts is 0 at a gap of 0 and below, ``3 s² − 2 s³`` with ``s = gap/clearance``,
    and 1 from a gap of ``clearance`` on.

    Parameters
    ----------
    outline
        The rigid body that shields what it touches, mm.
    within_mm
        The pressure acts at points with x below this only, mm. It must lie where the outline is
        touched; otherwise the pressure would jump there.
    clearance_mm
        Gap beyond which the pressure acts in full, mm.
    """

    outline: Outline
    within_mm: float
    clearance_mm: float

    def __post_init__(self) -> None:
        if not self.clearance_mm > 0:
            raise PressureError(
                f"clearance_mm = {self.clearance_mm:g} must be positive: a pressure that jumps "
                "where contact begins has no derivative there"
            )

    def share(self, position: Array) -> tuple[Array, Array]:
        """Return the share (...,) that acts at positions (..., 2), mm, and its gradient, 1/mm."""
        projection = self.outline.project(position.reshape(-1, 2))
        near = np.clip(projection.distance / self.clearance_mm, 0.0, 1.0)
        inside = position.reshape(-1, 2)[:, 0] < self.within_mm
        share = np.where(inside, smooth_step(near), 0.0)
        slope = np.where(inside, 6 * near * (1 - near) / self.clearance_mm, 0.0)
        gradient = slope[:, None] * projection.normal
        return share.reshape(position.shape[:-1]), gradient.reshape(position.shape)


@dataclass(frozen=True)
class FollowerPressure:
    """A pressure on a surface; its size is that of the load.

    Parameters
    ----------
    surface
        Where it acts.
    exposure
        The points on which it acts; all of them if absent.
    """

    surface: Surface
    exposure: Exposure | None = None

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surface it acts on."""
        return (self.surface,)

    def on_component(self, component: BodyComponent) -> FollowerPressure | None:
        """Return the same load on a component that has its surface; see `AppliedForce`."""
        if not component.has(self.surface):
            return None
        return replace(self, surface=component.surface(self.surface))

    def force(self, displacement: Array, load: Load) -> Array:
        """Return the nodal forces (2n,), N, of the load's pressure; see `AppliedForce`."""
        return load.pressure_mpa * self.surface.scattered(self.unit_force(displacement))

    def change(self, displacement: Array, before: Load, after: Load) -> Array:
        """Return the change of the forces (2n,), N, between the pressures of two loads."""
        grown = after.pressure_mpa - before.pressure_mpa
        return grown * self.surface.scattered(self.unit_force(displacement))

    def add_stiffness(
        self, data: Array, pattern: SparsePattern, displacement: Array, load: Load, *, psd: bool
    ) -> None:
        """Add minus the derivative of the forces, N/mm; nothing with ``psd``."""
        if load.pressure_mpa != 0 and not psd:
            blocks = load.pressure_mpa * self.unit_stiffness(displacement)
            np.subtract.at(data, pattern.slots(self.surface.dofs), blocks)

    def energy(self, displacement: Array, load: Load) -> float:
        """Return 0: a pressure on part of a surface has no potential."""
        return 0.0

    def unit_force(self, displacement: Array) -> Array:
        """Return the nodal forces (m, 2k), N/MPa, of a pressure of 1 MPa at ``displacement``.

        A positive pressure pushes against the body; suction is a negative one.
        """
        return follower_force(self.surface, displacement, self._share(displacement)[0])

    def unit_stiffness(self, displacement: Array) -> Array:
        """Return the derivative (m, 2k, 2k), N/(mm MPa), of :meth:`unit_force`."""
        return follower_stiffness(self.surface, displacement, *self._share(displacement))

    def _share(self, displacement: Array) -> tuple[Array, Array]:
        """Return the share (m, q) of the pressure that acts, and its gradient (m, q, 2), 1/mm."""
        position = self.surface.positions(displacement)
        if self.exposure is None:
            return np.ones(position.shape[:2]), np.zeros_like(position)
        return self.exposure.share(position)
