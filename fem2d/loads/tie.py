"""Tissue held to bone by an elastic layer that fades out towards its ends.

A rigid tie that ends at a free surface is a singular point: under refinement the elements beside it
collapse. A thin elastic layer with stiffness per area ``k(s)``, which rises smoothly from zero over
a stated length, is closer to anatomy (periosteum is no weld) and has no such point: the traction
``−k (u − u_bone)`` stays bounded.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field

import numpy as np
from numpy.typing import NDArray

from fem2d.body.surface import Surface
from fem2d.loads.fading import faded_share
from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class TieError(DrinksimError):
    """A tie has parameters that make no sense."""


@dataclass(frozen=True)
class ElasticTie:
    """An elastic layer between one stretch of surface and rigid bone.

    Parameters
    ----------
    surface
        The tissue's side.
    stiffness_mpa_per_mm
        Stiffness per area away from the ends, MPa/mm.
    fade_mm
        Arc length over which it rises from zero at each end.
    attached_at
        None ties to bone, which stands still. A placement ties to the moving rigid body and is the
        one at which the tie is relaxed: an elastic neck is held by the package behind it.
    only_along
        Unit vector of the only direction that is held, as by a row of rollers; None holds both.
    name
        Name in reports.
    """

    surface: Surface
    stiffness_mpa_per_mm: float
    _: KW_ONLY
    fade_mm: float = 0.0
    attached_at: RigidPlacement | None = None
    only_along: tuple[float, float] | None = None
    name: str = "tie"
    layer: Array = field(init=False, repr=False, compare=False)
    """(m, q) stiffness per area at the Gauss points, MPa/mm."""

    def __post_init__(self) -> None:
        if not self.stiffness_mpa_per_mm > 0 or self.fade_mm < 0:
            raise TieError(
                f"tie {self.name!r}: stiffness {self.stiffness_mpa_per_mm} MPa/mm must be positive "
                f"and the fade length {self.fade_mm} mm not negative"
            )
        length = float(np.sum(self.surface.weight)) / self.surface.thickness_mm
        ramp = np.ones_like(self.surface.arc_length)
        if self.fade_mm > 0:
            ramp = faded_share(self.surface, 0.0, length, self.fade_mm)
        object.__setattr__(self, "layer", self.stiffness_mpa_per_mm * ramp)

    def blocks(self) -> tuple[Index, Array]:
        """Return degrees of freedom (m, 2k) and constant stiffness blocks (m, 2k, 2k), N/mm."""
        slope = self.layer[:, :, None, None] * self._held
        edges = np.arange(len(self.surface.edges))
        return self.surface.dofs, self.surface.assembled_stiffness(slope, edges)

    @property
    def _held(self) -> Array:
        """(2, 2) projection on the directions that are held."""
        along = self.only_along
        held: Array = np.eye(2) if along is None else np.outer(along, along)
        return held

    def pull(self, placement: RigidPlacement) -> tuple[Index, Array, float]:
        """Return dofs (m, 2k), forces on the tissue, N, and energy that a moving anchor adds.

        With the anchors displaced by ``a`` the layer stores ``½∫ k |u − a|² dS``, which is
        ``½ u·K u − u·f + e`` with the constant stiffness ``K`` of `blocks`; this returns ``f`` and
        ``e``, N mm, when the moving body is at ``placement``.
        """
        anchor = np.zeros((*self.layer.shape, 2))
        if self.attached_at is not None:
            here = self.surface.positions(np.zeros_like(self.surface.nodes))
            anchor = (placement.apply(self.attached_at.pull_back(here)) - here) @ self._held
        dofs, force = self.surface.assembled_force(self.layer[:, :, None] * anchor)
        squared = np.sum(anchor**2, axis=-1)
        return dofs, force, 0.5 * float(np.sum(self.surface.weight * self.layer * squared))
