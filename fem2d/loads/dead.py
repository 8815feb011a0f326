"""Dead loads: tractions whose size and direction do not depend on the deformation.

A traction ``t`` per reference area does the virtual work ``∫ a(time) s(S) t·δu dS``, with a share
``s`` that fades towards the ends of the loaded stretch and an amplitude ``a`` against time. Its
forces do not depend on the displacement, so it has the energy ``−f·u`` and no stiffness.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import BodyComponent
from fem2d.body.sparse import SparsePattern
from fem2d.body.surface import Surface
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.fading import stretch_share
from fem2d.loads.load import Load

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DeadLoad:
    """A dead load on a stretch of surface.

    Parameters
    ----------
    surface
        The surface that carries the stretch.
    from_mm, to_mm
        Arc length along the surface where the stretch begins and ends, mm.
    fade_mm
        Arc length inside the stretch over which the load rises from nothing at each end.
    traction_mpa
        Force per reference area where it acts in full, MPa.
    amplitude
        Factor on it against time.
    name
        Name in reports.
    """

    surface: Surface
    _: KW_ONLY
    from_mm: float
    to_mm: float
    fade_mm: float
    traction_mpa: tuple[float, float]
    amplitude: Amplitude
    name: str = "dead load"
    share: Array = field(init=False, repr=False, compare=False)
    """(m, q) how much of the load acts at the Gauss points."""
    full_force: Array = field(init=False, repr=False, compare=False)
    """(m, 2k) nodal forces at an amplitude of 1, N."""

    def __post_init__(self) -> None:
        share = stretch_share(self.name, self.surface, self.from_mm, self.to_mm, self.fade_mm)
        traction = share[..., None] * np.asarray(self.traction_mpa)
        object.__setattr__(self, "share", share)
        object.__setattr__(self, "full_force", self.surface.assembled_force(traction)[1])

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surface it acts on."""
        return (self.surface,)

    def on_component(self, component: BodyComponent) -> DeadLoad | None:
        """Return the same load on a component that has its surface; see `AppliedForce`."""
        if not component.has(self.surface):
            return None
        return replace(self, surface=component.surface(self.surface))

    def force(self, displacement: Array, load: Load) -> Array:
        """Return the nodal forces (2n,), N, at the instant of a load; see `AppliedForce`."""
        return self.surface.scattered(self.amplitude.at(load.time_s) * self.full_force)

    def change(self, displacement: Array, before: Load, after: Load) -> Array:
        """Return the change of the forces (2n,), N, between the instants of two loads."""
        factor = self.amplitude.at(after.time_s) - self.amplitude.at(before.time_s)
        return self.surface.scattered(factor * self.full_force)

    def add_stiffness(
        self, data: Array, pattern: SparsePattern, displacement: Array, load: Load, *, psd: bool
    ) -> None:
        """Add nothing: a dead load does not depend on the displacement."""

    def energy(self, displacement: Array, load: Load) -> float:
        """Return the energy, N mm, at a displacement (n, 2), mm: minus the work of the forces."""
        nodal = self.amplitude.at(load.time_s) * self.full_force
        return -float(np.sum(nodal * displacement.ravel()[self.surface.dofs]))
