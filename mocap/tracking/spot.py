"""The grey level of a marker with its derivatives: a blurred ellipse, its streak and its tint.

A marker that moves during the exposure is smeared along its path: the picture is the mean of discs
at c + t s, −1 ≤ t ≤ 1, with the half streak s. A highlight or a shadow that passes over a marker
changes its contrast from one side to the other: A becomes A + a·(x − c), with the tint a.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.compiled import compiled

Array: TypeAlias = NDArray[np.float64]

# Indices in the vector of parameters: centre 0-1, G 2-4, then the following.
SHARPNESS, CONTRAST, LEVEL, SLOPE_X, SLOPE_Y, INNER = 5, 6, 7, 8, 9, 10
STREAK_X, STREAK_Y, TINT_X, TINT_Y = 11, 12, 13, 14
PARAMETERS = 15
# Parameters of a disc at rest in even light; a ring has its inner radius too.
PLAIN = 10
# Discs that make up a streak.
INSTANTS = 7


@compiled
def disc_and_gradient(p: Array, x: float, y: float, ring: bool, gradient: Array) -> float:
    """Return the model's grey level at (x, y) and write its derivatives (11,) to ``gradient``."""
    u = x - p[0]
    v = y - p[1]
    ux = p[2] * u + p[3] * v
    uy = p[3] * u + p[4] * v
    rho = math.sqrt(ux * ux + uy * uy) + 1e-9
    w = p[5]
    t = w * (1.0 - rho)
    edge = 0.5 * math.erfc(-t * 0.7071067811865476)
    density = 0.3989422804014327 * math.exp(-0.5 * t * t)
    d_rho = -w * density
    d_w = (1.0 - rho) * density
    d_q = 0.0
    if ring:
        s = w * (p[10] - rho)
        inner = 0.3989422804014327 * math.exp(-0.5 * s * s)
        edge -= 0.5 * math.erfc(-s * 0.7071067811865476)
        d_rho += w * inner
        d_w -= (p[10] - rho) * inner
        d_q = -w * inner
    slope = p[6] * d_rho / rho
    gradient[0] = -slope * (p[2] * ux + p[3] * uy) - p[8]
    gradient[1] = -slope * (p[3] * ux + p[4] * uy) - p[9]
    gradient[2] = slope * ux * u
    gradient[3] = slope * (ux * v + uy * u)
    gradient[4] = slope * uy * v
    gradient[5] = p[6] * d_w
    gradient[6] = edge
    gradient[7] = 1.0
    gradient[8] = u
    gradient[9] = v
    gradient[10] = p[6] * d_q
    level: float = p[7] + p[8] * u + p[9] * v + p[6] * edge
    return level


@compiled
def spot_and_gradient(p: Array, x: float, y: float, ring: bool, gradient: Array) -> float:
    """Return the grey level of a streaked and tinted marker at (x, y).

    Its derivatives (15,) are written to ``gradient``.
    """
    disc = p[:11].copy()
    disc[6], disc[7], disc[8], disc[9] = 1.0, 0.0, 0.0, 0.0
    of_disc = np.zeros(11)
    gradient[:] = 0.0
    u, v = x - p[0], y - p[1]
    contrast = p[6] + p[13] * u + p[14] * v
    covered = 0.0
    instants = INSTANTS if p[11] != 0.0 or p[12] != 0.0 else 1
    share = contrast / instants
    for k in range(instants):
        t = (2.0 * k + 1.0) / instants - 1.0
        disc[0], disc[1] = p[0] + t * p[11], p[1] + t * p[12]
        covered += disc_and_gradient(disc, x, y, ring, of_disc) / instants
        for i in range(6):
            gradient[i] += share * of_disc[i]
        gradient[10] += share * of_disc[10]
        gradient[11] += share * t * of_disc[0]
        gradient[12] += share * t * of_disc[1]
    gradient[0] -= p[8] + p[13] * covered
    gradient[1] -= p[9] + p[14] * covered
    gradient[6] = covered
    gradient[7] = 1.0
    gradient[8] = u
    gradient[9] = v
    gradient[13] = u * covered
    gradient[14] = v * covered
    level: float = p[7] + p[8] * u + p[9] * v + contrast * covered
    return level
