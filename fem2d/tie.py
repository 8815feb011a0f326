"""Tissue held to bone by an elastic layer that fades out towards its ends.

A rigid tie that ends at a free surface is a singular point: under refinement the elements beside it
collapse, whatever the solver does. A thin elastic layer with stiffness per area ``k(s)``, rising
smoothly from zero over a stated length, is nearer to anatomy (periosteum is no weld) and has no
such point: the traction ``−k (u − u_bone)`` stays bounded.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fem2d.surface import Surface

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class TieError(ValueError):
    """A tie was given parameters that make no sense."""


@dataclass(frozen=True)
class ElasticTie:
    """An elastic layer between one stretch of surface and rigid bone.

    Parameters
    ----------
    name
        What reports call it.
    surface
        The tissue's side.
    stiffness_mpa_per_mm
        Stiffness per area away from the ends, MPa/mm.
    fade_mm
        Arc length over which it rises from zero at each end.
    """

    name: str
    surface: Surface
    stiffness_mpa_per_mm: float
    fade_mm: float
    layer: Array = field(init=False, repr=False, compare=False)
    """(m, q) stiffness per area at the Gauss points, MPa/mm."""

    def __post_init__(self) -> None:
        if not self.stiffness_mpa_per_mm > 0 or self.fade_mm < 0:
            raise TieError(
                f"tie {self.name!r}: stiffness {self.stiffness_mpa_per_mm} MPa/mm must be positive "
                f"and the fade length {self.fade_mm} mm not negative"
            )
        s = self.surface.arc_length
        whole = float(np.sum(self.surface.weight)) / self.surface.thickness_mm
        if self.fade_mm == 0:
            ramp = np.ones_like(s)
        else:
            nearest_end = np.clip(np.minimum(s, whole - s) / self.fade_mm, 0.0, 1.0)
            ramp = nearest_end**2 * (3 - 2 * nearest_end)
        object.__setattr__(self, "layer", self.stiffness_mpa_per_mm * ramp)

    def blocks(self) -> tuple[Index, Array]:
        """Return degrees of freedom (m, 2k) and constant stiffness blocks (m, 2k, 2k), N/mm."""
        slope = self.layer[:, :, None, None] * np.eye(2)
        edges = np.arange(len(self.surface.edges))
        return self.surface.dofs, self.surface.assembled_stiffness(slope, edges)
