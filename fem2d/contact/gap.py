"""Kinematics of a material point near a rigid outline: gap, slip and their derivatives.

A rigid body is an `Outline` in its own frame and a `RigidPlacement`. A point ``x`` of the tissue is
pulled back into the body's frame, ``y = Rᵀ(x − c)``, where the outline stands still; there

* the gap is the signed distance ``g(y)``, with ``∂g/∂x = n`` and ``∂n/∂x = h t tᵀ``;
* the slip since the last committed instant is ``s = t·(y − y₀)``, with
  ``∂s/∂x = (1 − h n·(y − y₀)) t`` and ``∂t/∂x = −h n tᵀ``.

``t = (−n_y, n_x)`` is the tangent and ``h`` the curvature of the level set through the point. The
slip is measured with the unit tangent, not by arc length: the arc length of the foot point has a
gradient ``t/(1 + κ g)`` that jumps where a line meets an arc, the unit tangent's does not, so a
lip slides over such joints without noticing them (to first order both are the same).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from geometry2d.compiled import compiled
from geometry2d.outline import project_point

Array = NDArray[np.float64]


class PointGap(NamedTuple):
    """Gap kinematics of one point; vectors are in the frame of the tissue."""

    gap: float
    normal_x: float
    normal_y: float
    level_curvature: float
    arc_length: float
    body_x: float
    body_y: float
    slip: float
    normal_travel: float
    """n·(y − y₀), how far the point moved along the normal since the last committed instant, mm."""


@compiled
def point_gap(
    x: float,
    y: float,
    cosine: float,
    sine: float,
    shift_x: float,
    shift_y: float,
    before_x: float,
    before_y: float,
    start: Array,
    curvature: Array,
    centre: Array,
    breaks: Array,
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return the fields of `PointGap`; ``before`` is y₀, the arrays are those of `Outline`."""
    dx, dy = x - shift_x, y - shift_y
    body_x = cosine * dx + sine * dy
    body_y = -sine * dx + cosine * dy
    gap, nx, ny, level, arc = project_point(body_x, body_y, start, curvature, centre, breaks)
    travel_x, travel_y = body_x - before_x, body_y - before_y
    slip = -ny * travel_x + nx * travel_y
    normal_travel = nx * travel_x + ny * travel_y
    return (
        gap,
        cosine * nx - sine * ny,
        sine * nx + cosine * ny,
        level,
        arc,
        body_x,
        body_y,
        slip,
        normal_travel,
    )
