"""Dead loads: tractions that keep size and direction however the tissue under them moves.

A traction ``t`` per reference area does the virtual work ``∫ a(time) s(S) t·δu dS``, with a share
``s`` that fades towards the ends of the loaded stretch and an amplitude ``a`` against time. Its
forces do not depend on the displacement, so it has the energy ``−f·u`` and no stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fem2d.body.surface import Surface
from fem2d.loads.amplitude import Amplitude, LoadError

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class DeadLoad:
    """A dead load on a stretch of surface.

    Parameters
    ----------
    name
        What reports call it.
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
    """

    name: str
    surface: Surface
    from_mm: float
    to_mm: float
    fade_mm: float
    traction_mpa: tuple[float, float]
    amplitude: Amplitude
    share: Array = field(init=False, repr=False, compare=False)
    """(m, q) how much of the load acts at the Gauss points."""
    full_force: Array = field(init=False, repr=False, compare=False)
    """(m, 2k) nodal forces at an amplitude of 1, N."""

    def __post_init__(self) -> None:
        if not 0 < 2 * self.fade_mm <= self.to_mm - self.from_mm:
            raise LoadError(
                f"load {self.name!r}: a fade of {self.fade_mm:g} mm does not fit twice between "
                f"{self.from_mm:g} and {self.to_mm:g} mm: use a longer stretch or a shorter fade"
            )
        s = self.surface.arc_length
        nearest_end = np.minimum(s - self.from_mm, self.to_mm - s) / self.fade_mm
        ramp = np.clip(nearest_end, 0.0, 1.0)
        share = ramp**2 * (3 - 2 * ramp)
        if not share.any():
            raise LoadError(
                f"load {self.name!r}: no point of the surface lies between {self.from_mm:g} and "
                f"{self.to_mm:g} mm"
            )
        traction = share[..., None] * np.asarray(self.traction_mpa)
        object.__setattr__(self, "share", share)
        object.__setattr__(self, "full_force", self.surface.assembled_force(traction)[1])

    @property
    def dofs(self) -> Index:
        """(m, 2k) degrees of freedom that :meth:`force` belongs to."""
        return self.surface.dofs

    def force(self, time_s: float) -> Array:
        """Return the nodal forces (m, 2k), N, at a time, s."""
        return self.amplitude.at(time_s) * self.full_force

    def energy(self, displacement: Array, time_s: float) -> float:
        """Return the energy, N mm, of the load at a displacement (n, 2), mm: less its work."""
        return -float(np.sum(self.force(time_s) * displacement.ravel()[self.dofs]))
