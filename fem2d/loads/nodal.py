"""Constant forces on the nodes of a body."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import BodyComponent
from fem2d.body.sparse import SparsePattern
from fem2d.body.surface import Surface
from fem2d.loads.load import Load

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NodalForce:
    """Forces on nodes whose size and direction never change.

    Parameters
    ----------
    nodal_n
        (2n,) the forces, N.
    name
        Name in reports.
    """

    nodal_n: Array
    name: str = "nodal forces"

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """None: it acts on nodes."""
        return ()

    def on_component(self, component: BodyComponent) -> NodalForce | None:
        """Return the forces on the nodes of a component; see `AppliedForce`."""
        own = self.nodal_n[component.dofs]
        return replace(self, nodal_n=own) if own.any() else None

    def force(self, displacement: Array, load: Load) -> Array:
        """Return the nodal forces (2n,), N; see `AppliedForce`."""
        return self.nodal_n

    def change(self, displacement: Array, before: Load, after: Load) -> Array:
        """Return no change (2n,)."""
        return np.zeros_like(self.nodal_n)

    def add_stiffness(
        self, data: Array, pattern: SparsePattern, displacement: Array, load: Load, *, psd: bool
    ) -> None:
        """Add nothing: the forces do not depend on the displacement."""

    def energy(self, displacement: Array, load: Load) -> float:
        """Return minus the work of the forces, N mm, at a displacement (n, 2), mm."""
        return -float(self.nodal_n @ displacement.ravel())
