"""The points of a contact with a rigid outline: where they enter it, and what the laws give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.contact.gap import point_gap
from fem2d.contact.laws import pressure_of_gap, traction_of_slip
from geometry2d.compiled import compiled
from geometry2d.outline import project_point

Array = NDArray[np.float64]


REACH_MM = 1.0
"""Points farther than this from the outline's box are not projected: they cannot touch it."""


SURELY_OPEN_MM = 0.1
"""A point between nodes is not projected if the gap of a node proves it farther away than this."""


@dataclass(frozen=True)
class RigidContactPoints:
    """Values at the points of a contact, arrays (m, q) unless stated.

    Pressure and shear are per reference length here; divide by the surface stretch for true values.
    """

    gap: Array
    """Signed distance, mm; a lower bound of it farther than `REACH_MM` from the outline's box, and
    between nodes farther than `SURELY_OPEN_MM`."""
    normal: Array
    """(m, q, 2) outward normal of the rigid body, in the tissue's frame; zero out of reach."""
    pressure: Array
    shear: Array
    slipping: NDArray[np.bool_]
    outline_arc: Array
    traction: Array
    """(m, q, 2) traction on the tissue, MPa per reference length."""
    slope: Array
    """(m, q, 2, 2) derivative of the traction with respect to the position, MPa/mm."""
    psd_slope: Array
    """(m, q, 2, 2) symmetric, negative semi-definite stand-in for it: the penalty along the normal
    and the sticking resistance along the tangent, without the turning of the normal."""


@compiled
def entry_places(
    before: Array,
    after: Array,
    start: Array,
    curvature: Array,
    centre: Array,
    breaks: Array,
    box: Array,
    gap_offset: Array,
    entry_trials: int,
) -> Array:
    """Return where points (n, 2) that go straight from ``before`` to ``after`` enter the outline.

    All in the body's frame. Points that do not enter are returned as they were before.
    """
    met = before.copy()
    for i in range(before.shape[0]):
        x, y = before[i, 0], before[i, 1]
        end_x, end_y = after[i, 0], after[i, 1]
        if end_x < box[0] or end_x > box[2] or end_y < box[1] or end_y > box[3]:
            continue
        end = project_point(end_x, end_y, start, curvature, centre, breaks)[0] + gap_offset[i]
        if end >= 0.0:
            continue
        beginning = project_point(x, y, start, curvature, centre, breaks)[0] + gap_offset[i]
        if beginning <= 0.0:
            continue
        outside, gap_outside, inside, gap_inside = 0.0, beginning, 1.0, end
        for _ in range(entry_trials):
            share = outside + (inside - outside) * gap_outside / (gap_outside - gap_inside)
            met[i, 0], met[i, 1] = x + share * (end_x - x), y + share * (end_y - y)
            gap = project_point(met[i, 0], met[i, 1], start, curvature, centre, breaks)[0]
            gap += gap_offset[i]
            if gap > 0.0:
                outside, gap_outside = share, gap
            else:
                inside, gap_inside = share, gap
    return met


@compiled
def laws_at_points(
    position: Array,
    body_before: Array,
    traction_before: Array,
    angle: float,
    shift_x: float,
    shift_y: float,
    start: Array,
    curvature: Array,
    centre: Array,
    breaks: Array,
    box: Array,
    normal_stiffness: float,
    ramp: float,
    is_between: NDArray[np.bool_],
    gap_offset: Array,
    coefficient: float,
    tangential_stiffness: float,
) -> tuple[NDArray[Any], ...]:
    """Evaluate all points; see `RigidContactPoints` for the meaning of what is returned."""
    count = position.shape[0]
    energy = np.zeros(count)
    gap = np.empty(count)
    normal = np.zeros((count, 2))
    pressure = np.zeros(count)
    shear = np.zeros(count)
    slipping = np.zeros(count, np.bool_)
    arc = np.zeros(count)
    body = np.empty((count, 2))
    traction = np.zeros((count, 2))
    slope = np.zeros((count, 2, 2))
    safe = np.zeros((count, 2, 2))
    cosine, sine = np.cos(angle), np.sin(angle)
    node = 0
    for i in range(count):
        dx, dy = position[i, 0] - shift_x, position[i, 1] - shift_y
        body[i, 0], body[i, 1] = cosine * dx + sine * dy, -sine * dx + cosine * dy
        if is_between[i]:
            # The gap changes by no more than the distance between the two points.
            away = np.hypot(position[i, 0] - position[node, 0], position[i, 1] - position[node, 1])
            gap[i] = gap[node] - away
            if gap[i] > SURELY_OPEN_MM:
                continue
        else:
            node = i
        beside = max(box[0] - body[i, 0], body[i, 0] - box[2], 0.0)
        above = max(box[1] - body[i, 1], body[i, 1] - box[3], 0.0)
        gap[i] = np.hypot(beside, above)
        if gap[i] > REACH_MM:
            continue
        g, nx, ny, h, arc[i], body[i, 0], body[i, 1], slip, travel = point_gap(
            position[i, 0],
            position[i, 1],
            cosine,
            sine,
            shift_x,
            shift_y,
            body_before[i, 0],
            body_before[i, 1],
            start,
            curvature,
            centre,
            breaks,
        )
        gap[i] = g
        normal[i, 0], normal[i, 1] = nx, ny
        psi, p, dp = pressure_of_gap(g + gap_offset[i], normal_stiffness, ramp)
        if p == 0.0:
            continue
        energy[i] = psi
        pressure[i] = p
        tau, by_slip, by_pressure, slipping[i] = traction_of_slip(
            traction_before[i], slip, p, coefficient, tangential_stiffness
        )
        shear[i] = tau
        tx, ty = -ny, nx
        traction[i, 0] = p * nx + tau * tx
        traction[i, 1] = p * ny + tau * ty
        # d(p n) = (p' n nᵀ + p h t tᵀ) dx
        # d(τ t) = (t (∂τ/∂s (1 − h n·Δy) tᵀ + ∂τ/∂p p' nᵀ) − τ h n tᵀ) dx
        along = by_slip * (1.0 - h * travel)
        across = by_pressure * dp
        slope[i, 0, 0] = (
            dp * nx * nx + (p * h + along) * tx * tx + tx * across * nx - tau * h * nx * tx
        )
        slope[i, 0, 1] = (
            dp * nx * ny + (p * h + along) * tx * ty + tx * across * ny - tau * h * nx * ty
        )
        slope[i, 1, 0] = (
            dp * ny * nx + (p * h + along) * ty * tx + ty * across * nx - tau * h * ny * tx
        )
        slope[i, 1, 1] = (
            dp * ny * ny + (p * h + along) * ty * ty + ty * across * ny - tau * h * ny * ty
        )
        safe[i, 0, 0] = dp * nx * nx + by_slip * tx * tx
        safe[i, 0, 1] = dp * nx * ny + by_slip * tx * ty
        safe[i, 1, 0] = safe[i, 0, 1]
        safe[i, 1, 1] = dp * ny * ny + by_slip * ty * ty
    return energy, gap, normal, pressure, shear, slipping, arc, body, traction, slope, safe
