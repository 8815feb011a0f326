"""Compiled kernels of the marker fit: least squares of a blurred ellipse and its standard error.

A fit has free parameters, in order: the ten of a plain disc, then any of the others. Vectors and
matrices of the free ones count in that order.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.compiled import compiled
from mocap.tracking.spot import PARAMETERS, PLAIN, STREAK_X, disc_and_gradient, spot_and_gradient

Array: TypeAlias = NDArray[np.float64]

ITERATIONS = 40
# The iteration ends at a step of the centre below this, px; steps then shrink at least tenfold.
CENTRE_TOLERANCE = 1e-3
# Distance in pixels over which the noise of compression is correlated.
LAGS = 4
# A pivot that is a smaller share of the largest number of its column is rounding.
SINGULAR = 1e-14


@compiled
def _level(
    p: Array, x: float, y: float, ring: bool, free: NDArray[np.int_], gradient: Array
) -> float:
    """Return the model's grey level and write its derivatives by the free parameters."""
    if free[free.size - 1] < STREAK_X:
        plain: float = disc_and_gradient(p, x, y, ring, gradient)
        return plain
    level: float = spot_and_gradient(p, x, y, ring, gradient)
    for i in range(PLAIN, free.size):
        gradient[i] = gradient[free[i]]
    return level


@compiled
def _normal_equations(
    pixels: NDArray[np.uint8],
    p: Array,
    centre: Array,
    reach: float,
    ring: bool,
    free: NDArray[np.int_],
    normal: Array,
    right: Array,
    residual: Array,
) -> float:
    """Accumulate JᵀJ and Jᵀr over the window, return half the sum of squares."""
    count = free.size
    gradient = np.zeros(PARAMETERS)
    normal[:] = 0.0
    right[:] = 0.0
    total = 0.0
    for row in range(pixels.shape[0]):
        for column in range(pixels.shape[1]):
            if (column - centre[0]) ** 2 + (row - centre[1]) ** 2 > reach * reach:
                residual[row, column] = math.nan
                continue
            r = pixels[row, column] - _level(p, column, row, ring, free, gradient)
            residual[row, column] = r
            total += 0.5 * r * r
            for i in range(count):
                right[i] += gradient[i] * r
                for j in range(i + 1):
                    normal[i, j] += gradient[i] * gradient[j]
    for i in range(count):
        for j in range(i):
            normal[j, i] = normal[i, j]
    return total


@compiled
def eliminate(matrix: Array, right: Array) -> bool:
    """Put the solution (n, k) of ``matrix`` (n, n) times it in the place of ``right``.

    Gauss's elimination with the largest pivot of a column; ``matrix`` is used up. False if it is
    singular. Eleven unknowns need no library, whose solver takes as long to compile as all the rest
    of the fit.
    """
    n = matrix.shape[0]
    size = np.zeros(n)
    for i in range(n):
        for j in range(n):
            size[j] = max(size[j], abs(matrix[i, j]))
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if not abs(matrix[pivot, k]) > SINGULAR * size[k]:
            return False
        for j in range(n):
            matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        for j in range(right.shape[1]):
            right[k, j], right[pivot, j] = right[pivot, j], right[k, j]
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k, n):
                matrix[i, j] -= factor * matrix[k, j]
            for j in range(right.shape[1]):
                right[i, j] -= factor * right[k, j]
    for i in range(n - 1, -1, -1):
        for j in range(right.shape[1]):
            for m in range(i + 1, n):
                right[i, j] -= matrix[i, m] * right[m, j]
            right[i, j] /= matrix[i, i]
    return True


@compiled
def fit_disc(
    pixels: NDArray[np.uint8], start: Array, reach: float, ring: bool, free: NDArray[np.int_]
) -> tuple[Array, Array, Array, bool]:
    """Fit the model to the pixels within ``reach`` (px) of the starting centre.

    Parameters
    ----------
    pixels
        (rows, columns) grey levels of a window.
    start
        (15,) parameters in the window's coordinates.
    reach
        Radius (px) of the part of the window that is used.
    ring
        Whether the marker is a ring.
    free
        Increasing indices of the parameters that are fitted, the first ten among them.

    Returns
    -------
    tuple
        Parameters (15,), residual (rows, columns; nan outside), JᵀJ of the free parameters and
        whether the iteration converged.
    """
    count = free.size
    p = start.copy()
    centre = start[:2].copy()
    normal = np.zeros((count, count))
    right = np.zeros(count)
    residual = np.zeros(pixels.shape)
    trial_normal = np.zeros((count, count))
    trial_right = np.zeros(count)
    trial_residual = np.zeros(pixels.shape)
    cost = _normal_equations(pixels, p, centre, reach, ring, free, normal, right, residual)
    damping = 1e-4
    for _ in range(ITERATIONS):
        matrix = normal.copy()
        for i in range(count):
            matrix[i, i] += damping * matrix[i, i] + 1e-12
        step = right[:count].copy().reshape(count, 1)
        if not eliminate(matrix, step):
            return p, residual, normal, False
        trial = p.copy()
        for i in range(count):
            trial[free[i]] += step[i, 0]
        shrunk = trial[2] * trial[4] - trial[3] * trial[3]
        admissible = shrunk > 0.0 and trial[2] > 0.0 and 0.3 < trial[5] < 200.0
        if ring:
            admissible = admissible and 0.05 < trial[10] < 0.95
        if math.hypot(trial[0] - centre[0], trial[1] - centre[1]) > reach:
            admissible = False
        trial_cost = math.inf
        if admissible:
            trial_cost = _normal_equations(
                pixels, trial, centre, reach, ring, free, trial_normal, trial_right, trial_residual
            )
        if trial_cost <= cost:
            gain = cost - trial_cost
            moved = math.hypot(step[0, 0], step[1, 0])
            p, cost = trial, trial_cost
            normal, trial_normal = trial_normal, normal
            right, trial_right = trial_right, right
            residual, trial_residual = trial_residual, residual
            damping = max(damping * 0.1, 1e-9)
            if moved < CENTRE_TOLERANCE and gain <= 1e-2 * cost + 1e-9:
                return p, residual, normal, True
        else:
            damping *= 8.0
            if damping > 1e8:
                break
    small = math.sqrt(max(right[0] ** 2, right[1] ** 2)) <= 1e-2 * (
        CENTRE_TOLERANCE * max(normal[0, 0], normal[1, 1])
    )
    return p, residual, normal, small


@compiled
def centre_covariance(
    p: Array, residual: Array, normal: Array, ring: bool, free: NDArray[np.int_]
) -> Array:
    """Return the covariance (2, 2) px² of the fitted centre; nan if the pixels do not fix it.

    The centre's error is Σ h(x) e(x) with the influence h = (JᵀJ)⁻¹ J of each pixel. Its variance
    is Σ Σ h(x) h(x + l) C(l), where the noise's covariance C at lags l comes from the residual's
    antisymmetric part r(x) − r(2c − x).
    """
    count = free.size
    rows, columns = residual.shape
    gain = np.zeros((count, 2))
    gain[0, 0] = gain[1, 1] = 1.0
    matrix = normal.copy()
    for i in range(count):
        matrix[i, i] += 1e-12
    if not eliminate(matrix, gain):
        return np.full((2, 2), math.nan)
    influence = np.zeros((2, rows, columns))
    odd = np.zeros((rows, columns))
    valid = np.zeros((rows, columns))
    gradient = np.zeros(PARAMETERS)
    pixels = 0
    for row in range(rows):
        for column in range(columns):
            if math.isnan(residual[row, column]):
                continue
            _level(p, column, row, ring, free, gradient)
            for i in range(count):
                influence[0, row, column] += gain[i, 0] * gradient[i]
                influence[1, row, column] += gain[i, 1] * gradient[i]
            pixels += 1
            mirror_row = round(2 * p[1] - row)
            mirror_column = round(2 * p[0] - column)
            if not (0 <= mirror_row < rows and 0 <= mirror_column < columns):
                continue
            if math.isnan(residual[mirror_row, mirror_column]):
                continue
            odd[row, column] = (
                residual[row, column] - residual[mirror_row, mirror_column]
            ) * 0.7071067811865476
            valid[row, column] = 1.0
    inflation = pixels / max(pixels - count, 1)
    covariance = np.zeros((2, 2))
    white = np.zeros((2, 2))
    for lag_row in range(LAGS + 1):
        for lag_column in range(-LAGS, LAGS + 1):
            if lag_row == 0 and lag_column < 0:
                continue  # lags l and −l contribute the same
            both = 1.0 if lag_row == 0 and lag_column == 0 else 2.0
            product = 0.0
            weight = 0.0
            xx = 0.0
            xy = 0.0
            yy = 0.0
            for row in range(max(0, -lag_row), min(rows, rows - lag_row)):
                for column in range(max(0, -lag_column), min(columns, columns - lag_column)):
                    r2, c2 = row + lag_row, column + lag_column
                    product += odd[row, column] * odd[r2, c2]
                    weight += valid[row, column] * valid[r2, c2]
                    xx += influence[0, row, column] * influence[0, r2, c2]
                    xy += 0.5 * influence[0, row, column] * influence[1, r2, c2]
                    xy += 0.5 * influence[1, row, column] * influence[0, r2, c2]
                    yy += influence[1, row, column] * influence[1, r2, c2]
            if weight < 20:
                continue
            taper = both * (1 - abs(lag_row) / (LAGS + 1)) * (1 - abs(lag_column) / (LAGS + 1))
            noise = taper * inflation * product / weight
            covariance[0, 0] += noise * xx
            covariance[1, 1] += noise * yy
            covariance[0, 1] += noise * xy
            if lag_row == 0 and lag_column == 0:
                white[0, 0], white[0, 1], white[1, 1] = noise * xx, noise * xy, noise * yy
    # An estimate of the correlation may be negative by chance; half of white noise is the least.
    if covariance[0, 0] < 0.5 * white[0, 0] or covariance[1, 1] < 0.5 * white[1, 1]:
        for i in range(2):
            for j in range(2):
                covariance[i, j] = 0.5 * white[i, j]
    # Rounding to whole grey levels adds a variance of 1/12.
    for row in range(rows):
        for column in range(columns):
            covariance[0, 0] += influence[0, row, column] ** 2 / 12.0
            covariance[1, 1] += influence[1, row, column] ** 2 / 12.0
    covariance[1, 0] = covariance[0, 1]
    return covariance
