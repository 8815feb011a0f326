"""Compiled least squares of a printed code under perspective, blur and a camera's response.

The sticker's own coordinates (u, v) count cells from its centre, u to its right, v down; the black
square spans [−3, 3]². A picture point (x, y), from the middle of the window, lies at

    u = (g₀x + g₁y + g₂)/(1 + g₆x + g₇y),   v = (g₃x + g₄y + g₅)/(1 + g₆x + g₇y).

Blur makes each edge a normal distribution: a column i of cells covers B_i(u) = Φ((u − i)/s_u) −
Φ((u − i − 1)/s_u), and likewise the rows. The white share of the light is

    P = 1 − Σ_black B_i(u) B_j(v),   Q = P + 4κ P(1 − P),

where κ stands for ink that spreads and for a tone curve that is not the assumed one: both move
every edge the same way. The grey level is 255 [(a + c Q)(1 + h_x x + h_y y)]^(1/2.2). The edges
between cells have both polarities, so that κ does not take the place of the size.

Least squares by Levenberg–Marquardt with the exact Jacobian (Marquardt 1963).
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.compiled import compiled

Array: TypeAlias = NDArray[np.float64]

# Indices in the vector of parameters: homography 0-7, then the following.
BLUR_U, BLUR_V, BLACK_LIGHT, CONTRAST_LIGHT, SPREAD, SLOPE_X, SLOPE_Y = 8, 9, 10, 11, 12, 13, 14
PARAMETERS = 15
GAMMA = 2.2
# Light below which the response is its tangent: the power law is infinitely steep at black.
TOE = 5e-4
HALF = 3
# Pixels are used up to this distance outside the black square, cells; the margin is one cell wide.
USED_MARGIN = 0.7
ITERATIONS = 30
# The iteration ends when the corners move less than this, px.
CORNER_TOLERANCE = 5e-3
# Distance in pixels over which the residual's correlation is counted.
LAGS = 2
# Blur, cells: sharper than any lens, and wider than any code can be read through.
BLUR_RANGE = (0.02, 1.6)
LARGEST_SPREAD = 0.6


@compiled
def grey_and_gradient(
    p: Array, dark: NDArray[np.bool_], x: float, y: float, g: Array, edges: Array
) -> float:
    """Return the grey level at (x, y) and write its derivatives (15,) to ``g``.

    ``edges`` (3, 2, 6) is working memory: share, slope and widening of each column and row.
    """
    below = 1.0 + p[6] * x + p[7] * y
    u = (p[0] * x + p[1] * y + p[2]) / below
    v = (p[3] * x + p[4] * y + p[5]) / below
    share, slope, widen = edges[0], edges[1], edges[2]
    for axis in range(2):
        at = u if axis == 0 else v
        s = p[8 + axis]
        step_before = 0.0
        density_before = 0.0
        t_before = 0.0
        for k in range(7):
            t = (at - (k - 3)) / s
            step = 1.0 if t > 0.0 else 0.0
            density = 0.0
            if -5.0 < t < 5.0:
                step = 0.5 * math.erfc(-t * 0.7071067811865476)
                density = 0.3989422804014327 * math.exp(-0.5 * t * t) / s
            if k > 0:
                share[axis, k - 1] = step_before - step
                slope[axis, k - 1] = density_before - density
                widen[axis, k - 1] = t * density - t_before * density_before
            step_before, density_before, t_before = step, density, t
    white = 1.0
    by_u = 0.0
    by_v = 0.0
    by_su = 0.0
    by_sv = 0.0
    for row in range(6):
        if share[1, row] == 0.0 and slope[1, row] == 0.0:
            continue
        for column in range(6):
            if dark[row, column] and (share[0, column] != 0.0 or slope[0, column] != 0.0):
                white -= share[0, column] * share[1, row]
                by_u -= slope[0, column] * share[1, row]
                by_v -= share[0, column] * slope[1, row]
                by_su -= widen[0, column] * share[1, row]
                by_sv -= share[0, column] * widen[1, row]
    response = white + 4.0 * p[12] * white * (1.0 - white)
    d_white = 1.0 + 4.0 * p[12] * (1.0 - 2.0 * white)
    lit = 1.0 + p[13] * x + p[14] * y
    light = (p[10] + p[11] * response) * lit
    bent = max(light, TOE)
    level: float = 255.0 * bent ** (1.0 / GAMMA)
    d_light = level / (GAMMA * bent)
    level += d_light * (light - bent)
    if light >= 1.0:
        level = 255.0
        d_light = 0.0
    per_white = d_light * lit * p[11] * d_white
    per_u = per_white * by_u / below
    per_v = per_white * by_v / below
    g[0], g[1], g[2] = per_u * x, per_u * y, per_u
    g[3], g[4], g[5] = per_v * x, per_v * y, per_v
    outward = per_u * u + per_v * v
    g[6], g[7] = -outward * x, -outward * y
    g[8], g[9] = per_white * by_su, per_white * by_sv
    g[10] = d_light * lit
    g[11] = d_light * lit * response
    g[12] = d_light * lit * p[11] * 4.0 * white * (1.0 - white)
    g[13] = d_light * (p[10] + p[11] * response) * x
    g[14] = d_light * (p[10] + p[11] * response) * y
    return level


@compiled
def _used(p: Array, rows: int, columns: int) -> NDArray[np.bool_]:
    """Return which pixels of a window lie on the sticker, by its starting place."""
    used = np.zeros((rows, columns), np.bool_)
    limit = HALF + USED_MARGIN
    for row in range(rows):
        for column in range(columns):
            x = column - 0.5 * (columns - 1)
            y = row - 0.5 * (rows - 1)
            below = 1.0 + p[6] * x + p[7] * y
            u = (p[0] * x + p[1] * y + p[2]) / below
            v = (p[3] * x + p[4] * y + p[5]) / below
            used[row, column] = abs(u) <= limit and abs(v) <= limit
    return used


@compiled
def _evaluated(
    pixels: NDArray[np.uint8],
    used: NDArray[np.bool_],
    dark: NDArray[np.bool_],
    p: Array,
    jacobian: Array,
    residual: Array,
) -> float:
    """Write the derivatives (k, 15) and residuals (k,) of the used pixels, return half Σ r²."""
    rows, columns = pixels.shape
    edges = np.zeros((3, 2, 6))
    total = 0.0
    k = 0
    for row in range(rows):
        for column in range(columns):
            if not used[row, column]:
                continue
            x = column - 0.5 * (columns - 1)
            y = row - 0.5 * (rows - 1)
            r = pixels[row, column] - grey_and_gradient(p, dark, x, y, jacobian[k], edges)
            residual[k] = r
            total += 0.5 * r * r
            k += 1
    return total


@compiled
def fit_code(
    pixels: NDArray[np.uint8], dark: NDArray[np.bool_], start: Array
) -> tuple[Array, Array, Array, bool]:
    """Fit the model to a window.

    Parameters
    ----------
    pixels
        (rows, columns) grey levels.
    dark
        (6, 6) which cells are black.
    start
        (15,) parameters, from the middle of the window.

    Returns
    -------
    tuple
        Parameters (15,), residual (rows, columns; nan where unused), JᵀJ (15, 15), and whether the
        iteration converged.
    """
    p = start.copy()
    rows, columns = pixels.shape
    used = _used(p, rows, columns)
    count = np.count_nonzero(used)
    jacobian, trial_jacobian = np.zeros((count, 15)), np.zeros((count, 15))
    residual, trial_residual = np.zeros(count), np.zeros(count)
    cost = _evaluated(pixels, used, dark, p, jacobian, residual)
    normal = jacobian.T @ jacobian
    right = jacobian.T @ residual
    converged = False
    damping = 1e-3
    size = 0.5 * max(rows, columns)
    for _ in range(ITERATIONS):
        matrix = normal.copy()
        for i in range(15):
            matrix[i, i] += damping * matrix[i, i] + 1e-9
        step = np.linalg.solve(matrix, right)
        trial = p + step
        admissible = (
            BLUR_RANGE[0] < trial[8] < BLUR_RANGE[1]
            and BLUR_RANGE[0] < trial[9] < BLUR_RANGE[1]
            and trial[11] > 0.0
            and abs(trial[12]) < LARGEST_SPREAD
            and trial[0] * trial[4] - trial[1] * trial[3] > 0.0
            and size * (abs(trial[6]) + abs(trial[7])) < 0.5
            and size * (abs(trial[13]) + abs(trial[14])) < 0.9
        )
        trial_cost = math.inf
        if admissible:
            trial_cost = _evaluated(pixels, used, dark, trial, trial_jacobian, trial_residual)
        if trial_cost <= cost:
            gain = cost - trial_cost
            scale = math.sqrt(p[0] * p[4] - p[1] * p[3])
            moved = abs(step[2]) + abs(step[5])
            moved += size * (abs(step[0]) + abs(step[1]) + abs(step[3]) + abs(step[4]))
            p, cost = trial, trial_cost
            jacobian, trial_jacobian = trial_jacobian, jacobian
            residual, trial_residual = trial_residual, residual
            normal = jacobian.T @ jacobian
            right = jacobian.T @ residual
            damping = max(damping * 0.1, 1e-9)
            if moved / scale < CORNER_TOLERANCE and gain <= 1e-2 * cost + 1e-9:
                converged = True
                break
        else:
            damping *= 8.0
            if damping > 1e7:
                converged = True
                break
    left = np.full((rows, columns), math.nan)
    k = 0
    for row in range(rows):
        for column in range(columns):
            if used[row, column]:
                left[row, column] = residual[k]
                k += 1
    return p, left, normal, converged


@compiled
def noise_variance(residual: Array, parameters: int) -> tuple[float, float]:
    """Return the variance of the residual and the factor by which its correlation widens errors.

    An estimate moves along an edge's normal by the mean of the noise over many pixels: neighbouring
    pixels whose noise is correlated count for less than as many independent ones.
    """
    rows, columns = residual.shape
    total = 0.0
    count = 0
    for row in range(rows):
        for column in range(columns):
            if not math.isnan(residual[row, column]):
                total += residual[row, column] ** 2
                count += 1
    if count <= parameters:
        return math.nan, 1.0
    mean_square = total / count
    factor = 1.0
    for lag_row in range(LAGS + 1):
        for lag_column in range(-LAGS, LAGS + 1):
            if lag_row == 0 and lag_column <= 0:
                continue
            product = 0.0
            for row in range(rows - lag_row):
                for column in range(max(0, -lag_column), min(columns, columns - lag_column)):
                    value = residual[row, column] * residual[row + lag_row, column + lag_column]
                    if not math.isnan(value):
                        product += value
            taper = (1 - lag_row / (LAGS + 1)) * (1 - abs(lag_column) / (LAGS + 1))
            factor += 2.0 * taper * product / (count * max(mean_square, 1e-12))
    return total / (count - parameters), min(max(factor, 1.0), 8.0)
