"""Where a neck is touched by the lip that it is pressed into."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.contact.rigid import rigid_responses
from fem2d.solvers.static import StaticResult
from geometry2d.neck import NECKS
from scenarios.studies.press import Press

Array = NDArray[np.float64]

FLOOR = 0.1
"""The floor of a root: within this share of the thread's depth of the root's diameter."""


@dataclass(frozen=True)
class Imprint:
    """Where a neck is touched.

    Attributes
    ----------
    arc_mm
        (k,) arc lengths on the wall's outline that are touched, ascending.
    pressure_kpa
        (k,) true contact pressure there.
    contact_mm
        Length of deformed lip surface in contact.
    touched
        Names of the neck's stretches that are touched.
    crests, roots
        Which crests, and which floors of roots, are touched.
    depth_mm
        (2,) nearest and farthest touched point below the opening, along the axis.
    thread_end_mm
        Where the thread ends below the opening.
    """

    arc_mm: Array
    pressure_kpa: Array
    contact_mm: float
    touched: tuple[str, ...]
    crests: tuple[str, ...]
    roots: tuple[str, ...]
    depth_mm: tuple[float, float]
    thread_end_mm: float


def imprint_of(press: Press, result: StaticResult) -> Imprint:
    """Return where the neck is touched at an equilibrium."""
    (touch,) = rigid_responses(result.contacts)
    pair = touch.contact
    stretch = pair.surface.stretch(result.displacement)
    touching = touch.points.pressure > 0
    arc = touch.points.outline_arc[touching]
    order = np.argsort(arc)
    pressure = (touch.points.pressure / stretch)[touching][order] * 1e3
    arc = arc[order]
    wall, stretches = press.neck.lower_wall, press.neck.lower_stretches
    point = wall.point_at(arc)[0]
    measures = NECKS[press.options.neck]
    opening = wall.sampled(0.02)[:, 0].min()
    radius = 0.5 * measures.mark_distance_mm - point[:, 1]
    floor = radius < 0.5 * measures.root_diameter_mm + FLOOR * measures.thread_depth_mm

    def within(name: str) -> NDArray[np.bool_]:
        low, high = stretches[name]
        return (arc >= low) & (arc <= high)

    depth = point[:, 0] - opening
    return Imprint(
        arc,
        pressure,
        float(np.sum((pair.surface.weight * stretch)[touching])) / press.options.thickness_mm,
        tuple(name for name in stretches if np.any(within(name))),
        tuple(n for n in stretches if n.startswith("crest") and np.any(within(n))),
        tuple(n for n in stretches if n.startswith("root") and np.any(within(n) & floor)),
        (float(depth.min()), float(depth.max())),
        measures.mark_depth_mm - measures.mark_behind_thread_mm,
    )
