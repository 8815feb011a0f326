"""Regions of a section, bounded by named curves that neighbouring regions share.

A section is a plane cut through soft tissue. Its curves are open polylines with common end points.
A region is a closed loop of curves; a boundary name stands for one or more curves. The meshes of
two regions match, because both contain the curve of their interface.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]

Loop = tuple[tuple[str, bool], ...]
"""Curve names in order, each with its direction: True for forwards."""


class RegionError(DrinksimError):
    """Curves that do not bound the regions of a section."""


@dataclass(frozen=True)
class Section:
    """A cut through a body: named curves, the regions they bound, and names for its boundary.

    Parameters
    ----------
    name
        Prefix of the section's names in a mesh, such as "upper".
    curves
        Open polylines (n, 2), mm, by name.
    loops
        For each region its closed, counter-clockwise loop of curves.
    boundary_curves
        Curves of each boundary name.
    focus
        (m, 2) points, mm, around which a mesh is finest; may be empty.
    layer_curves
        Curves along which a mesh resolves a thin layer, also far from the focus.

    Raises
    ------
    RegionError
        If a loop is not closed, not simple, or runs clockwise.
    """

    name: str
    curves: Mapping[str, Array]
    loops: Mapping[str, Loop]
    boundary_curves: Mapping[str, tuple[str, ...]]
    focus: Array = field(default_factory=lambda: np.empty((0, 2)))
    layer_curves: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for region, loop in self.loops.items():
            ends = [self._oriented(curve, forwards)[[0, -1]] for curve, forwards in loop]
            for k, (curve, _) in enumerate(loop):
                gap = float(np.max(np.abs(ends[k][0] - ends[k - 1][1])))
                if gap > 0:
                    raise RegionError(
                        f"{self.name}: curve {curve!r} of region {region!r} starts {gap:.3g} mm "
                        "from the end of the previous curve: let them share the point"
                    )
            polygon = shapely.Polygon(self.regions[region])
            if not polygon.is_valid:
                raise RegionError(
                    f"{self.name}: the boundary of region {region!r} crosses itself "
                    f"({shapely.is_valid_reason(polygon)}): change the measurement or drawing there"
                )
            if not polygon.exterior.is_ccw:
                raise RegionError(
                    f"{self.name}: region {region!r} runs clockwise: reverse its loop"
                )

    @property
    def regions(self) -> dict[str, Array]:
        """Polygon (n, 2), mm, of each region, counter-clockwise, without repeated first point."""
        return {
            region: np.concatenate([self._oriented(c, forwards)[:-1] for c, forwards in loop])
            for region, loop in self.loops.items()
        }

    @property
    def boundaries(self) -> dict[str, list[Array]]:
        """Polylines of each named boundary."""
        return {
            name: [self.curves[c] for c in curves] for name, curves in self.boundary_curves.items()
        }

    def _oriented(self, curve: str, forwards: bool) -> Array:
        if curve not in self.curves:
            raise RegionError(
                f"{self.name}: no curve {curve!r}; there are {', '.join(self.curves)}"
            )
        points = self.curves[curve]
        return points if forwards else points[::-1]
