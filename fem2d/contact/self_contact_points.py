"""The integration points of a self-contact: what they remember, and what the laws give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.contact.laws import pressure_of_gap, traction_of_slip
from fem2d.contact.search import NONE, edge_point
from geometry2d.compiled import compiled

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class SelfContactState:
    """Integration points chosen at a committed instant, and their friction.

    Attributes
    ----------
    edge, local, weight
        (p,) edge that carries each point, local coordinate on it, and reference area, mm², halved
        because rays go from both sides.
    anchor, anchor_local
        (p,) edge and local coordinate on it from which slip is counted: what the ray met at the
        committed instant, −1 for nothing; in a step in which the point first touches, what it
        touches first.
    traction
        (p,) tangential traction, MPa, positive along the carrying edge.
    places
        (m, k, 2) positions of the edges' nodes at the committed instant, mm.
    depth
        (m,) deepest penetration of another surface through each edge at that instant, mm.
    """

    edge: Index
    local: Array
    weight: Array
    anchor: Index
    anchor_local: Array
    traction: Array
    places: Array
    depth: Array


@dataclass(frozen=True)
class SelfContactPoints:
    """Values at the integration points, arrays (p,) unless stated.

    Pressure and shear are per reference length of the surface that carries the point.
    """

    gap: Array
    """mm; infinite where nothing is met within reach."""
    met_edge: Index
    met_local: Array
    normal: Array
    """(p, 2) outward normal of the carrying surface."""
    pressure: Array
    shear: Array
    slipping: NDArray[np.bool_]
    pressure_slope: Array
    """d pressure/d gap, MPa/mm."""
    shear_by_slip: Array
    shear_by_pressure: Array


def state_on_edges(state: SelfContactState, number: Index) -> SelfContactState:
    """Return what of a state belongs to some edges; anchors on others are dropped.

    ``number`` (m,) is the new number of each edge, `NONE` for edges that are left out.
    """
    kept = number != NONE
    here = kept[state.edge]
    anchor = state.anchor[here]
    return SelfContactState(
        number[state.edge[here]],
        state.local[here],
        state.weight[here],
        np.where(anchor == NONE, NONE, number[anchor]),
        state.anchor_local[here],
        state.traction[here],
        state.places[kept],
        state.depth[kept],
    )


@compiled
def laws_at_points(
    gap: Array,
    normal: Array,
    edge: Index,
    local: Array,
    anchor: Index,
    anchor_local: Array,
    before: Array,
    deformed: Array,
    normal_stiffness: float,
    ramp: float,
    coefficient: float,
    tangential_stiffness: float,
) -> tuple[Array, Array, Array, NDArray[np.bool_], Array, Array, Array]:
    """Apply the scalar laws to all points; a point without an anchor has no friction."""
    count = len(gap)
    energy, pressure, shear = np.zeros(count), np.zeros(count), np.zeros(count)
    slope, by_slip, by_pressure = np.zeros(count), np.zeros(count), np.zeros(count)
    slipping = np.zeros(count, np.bool_)
    for i in range(count):
        if gap[i] >= 0.0:
            continue
        energy[i], pressure[i], slope[i] = pressure_of_gap(gap[i], normal_stiffness, ramp)
        if pressure[i] > 0.0 and anchor[i] != NONE:
            x, y = edge_point(deformed, edge[i], local[i])[:2]
            anchor_x, anchor_y = edge_point(deformed, anchor[i], anchor_local[i])[:2]
            slip = -normal[i, 1] * (x - anchor_x) + normal[i, 0] * (y - anchor_y)
            shear[i], by_slip[i], by_pressure[i], slipping[i] = traction_of_slip(
                before[i], slip, pressure[i], coefficient, tangential_stiffness
            )
    return energy, pressure, shear, slipping, slope, by_slip, by_pressure


@compiled
def pressures_at_gaps(gap: Array, stiffness: float, ramp: float) -> Array:
    """Return the contact pressures (p,), MPa, at gaps (p,), mm."""
    result = np.empty(len(gap))
    for i in range(len(gap)):
        result[i] = pressure_of_gap(gap[i], stiffness, ramp)[1]
    return result
