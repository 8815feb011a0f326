"""Smoothing splines whose cutoff frequency follows from the noise of the signal.

A signal y(t) with standard errors σ is replaced by the curve z that minimises

    Σ ((yᵢ − zᵢ)/σᵢ)² + λ ∫ (z‴)² dt.

For even sampling this is a filter without phase lag and with the amplitude 1/(1 + (f/f₀)⁶), like a
third-order Butterworth filter applied forwards and backwards. It also accepts uneven times and
unequal errors. It needs no padding at the ends, where it approaches the best parabola.

λ is chosen by maximum likelihood. The penalty states that z is white noise integrated three times.
The data have the noise variance s²/w. The λ and s of greatest likelihood (Wahba 1985, "generalized
maximum likelihood") minimise

    (m − 3) log Q + log det(W + λP) − (n − 3) log λ,   Q = Σ w y (y − z),

with m the number of samples of nonzero weight; if the noise is known, s is one and Q takes the
place of (m − 3) log Q. This choice leaves slightly more noise than one by
least estimated error (Mallows' Cp, cross-validation), and less bias at the ends. The bias at the
first frame enters all angles, which count from there. The band of the inverse is computed exactly
in O(n) (Hutchinson and de Hoog 1985). The standard errors of the curve are those of Wahba (1983),
which include the bias of smoothing on average.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cholesky_banded
from scipy.stats import f as f_distribution

from geometry2d.compiled import compiled
from geometry2d.foundation.errors import DrinksimError

Array: TypeAlias = NDArray[np.float64]

ORDER = 3
CUTOFFS_TRIED = 60
# A sample whose standard error exceeds the median one by this factor gets no weight.
WORSE = 4.0
# If the noise is known, a large error is one: only interpolated samples have one so much larger.
INTERPOLATED = 50.0
# Smoothing removes motion if what it removes exceeds the noise by this factor, and by what noise
# has by chance with this probability.
MORE_THAN_NOISE = 1.3
RARE = 1e-3
# Shorter signals are not smoothed: their noise cannot be estimated.
LEAST_SAMPLES = 8


class SmoothingError(DrinksimError):
    """A signal that cannot be smoothed."""


@dataclass(frozen=True)
class Smoothed:
    """A smoothed signal.

    Parameters
    ----------
    values, sigma
        (n,) smoothed signal and its standard error.
    sigma_since_first
        (n,) standard error of the change since the first sample; zero there.
    rate, rate_sigma
        (n,) its time derivative and the standard error of that, per s.
    cutoff_hz
        Frequency at which the amplitude falls to 1/√2; nan if nothing was smoothed.
    removed_rms
        RMS difference of signal and curve, in the signal's unit.
    noise_factor
        Estimated noise of the signal over its stated standard errors.
    freedom
        Number of independent residuals that tell it.
    """

    values: Array
    sigma: Array
    sigma_since_first: Array
    rate: Array
    rate_sigma: Array
    cutoff_hz: float
    removed_rms: float
    noise_factor: float
    freedom: float = 0.0


def smoothed(
    time_s: ArrayLike,
    values: ArrayLike,
    sigma: ArrayLike,
    *,
    repeats: ArrayLike = 1.0,
    cutoff_hz: float | None = None,
    noise_known: bool = False,
) -> Smoothed:
    """Return a signal smoothed with the cutoff of greatest likelihood.

    Parameters
    ----------
    time_s, values, sigma
        (n,) increasing times (s), the signal, and its standard errors (positive).
    repeats
        (n,) number of samples that share each sample's error; together they count as one.
    cutoff_hz
        Cutoff frequency, Hz; None: chosen from the signal.
    noise_known
        Whether the standard errors are those of the noise, so that all other variation is signal.
        Otherwise they only weigh the samples, and the noise is estimated with the cutoff.

    Raises
    ------
    SmoothingError
        If shapes differ, a value is not finite, or a standard error is not positive.
    """
    time, signal, error = (np.asarray(a, float) for a in (time_s, values, sigma))
    if not (time.shape == signal.shape == error.shape and time.ndim == 1):
        raise SmoothingError(
            f"times {time.shape}, values {signal.shape} and errors {error.shape} differ in shape"
        )
    if not (np.isfinite(signal).all() and np.isfinite(error).all() and np.all(error > 0)):
        raise SmoothingError(
            "the signal has values that are not finite or standard errors that are not positive"
        )
    if time.size < LEAST_SAMPLES:
        rate = np.gradient(signal, time) if time.size > 1 else np.zeros_like(signal)
        unknown = np.full_like(signal, np.nan)
        return Smoothed(
            signal, error, np.hypot(error, error[0]), rate, unknown, float("nan"), 0.0, 1.0
        )
    unit = float(np.median(np.diff(time)))
    penalty = _penalty_band(time / unit)
    usual = float(np.median(error))
    # Samples of much larger error are interpolated ones: the curve interpolates better itself.
    limit = INTERPOLATED if noise_known else WORSE
    weight = np.where(error > limit * usual, 0.0, 1 / error**2)
    weight = weight / np.asarray(repeats, float)
    mean_weight = 1 / usual**2
    cutoffs = [cutoff_hz] if cutoff_hz else _cutoffs(time, unit)
    trials = [
        (_score(signal, weight, penalty, _stiffness(f, unit, mean_weight), noise_known), f)
        for f in cutoffs
    ]
    _, best = min(trials)
    return _solution(time, signal, weight, penalty, best, _stiffness(best, unit, mean_weight))


def _cutoffs(time: Array, unit: float) -> list[float]:
    """Return the cutoffs to compare, from one cycle per clip to nearly no smoothing."""
    slowest = 1.0 / (time[-1] - time[0])
    return list(np.geomspace(slowest, 0.45 / unit, CUTOFFS_TRIED))


def _stiffness(cutoff_hz: float, unit: float, weight: float) -> float:
    """Return λ (times in ``unit``) whose filter has amplitude 1/√2 at the cutoff."""
    # Response of a finite difference to this frequency; 2πf far below the sampling rate.
    omega = 2 * np.sin(np.pi * cutoff_hz * unit)
    return float((np.sqrt(2.0) - 1.0) * weight / omega ** (2 * ORDER))


def _solution(
    time: Array, signal: Array, weight: Array, penalty: Array, cutoff: float, stiffness: float
) -> Smoothed:
    unit = float(np.median(np.diff(time)))
    curve, inverse, factor = _fit(signal, weight, penalty, stiffness)
    first = np.zeros_like(signal)
    first[0] = 1.0
    with_first = banded_solution(factor, first)
    since_first = np.maximum(inverse[0] + inverse[0][0] - 2 * with_first, 0.0)
    measured = weight > 0
    left = float(measured.sum() - np.sum(inverse[0] * weight))
    chi = float(np.sum(weight * (signal - curve) ** 2))
    # With few degrees of freedom left the residual does not test the stated errors.
    noise = np.sqrt(chi / left) if left > LEAST_SAMPLES else 1.0
    rate = np.gradient(curve, time, edge_order=2)
    # Central differences of z at samples two apart, from the band of its covariance.
    rate_variance = np.empty_like(curve)
    spread = inverse[0][2:] + inverse[0][:-2] - 2 * inverse[2][:-2]
    rate_variance[1:-1] = np.maximum(spread, 0) / (time[2:] - time[:-2]) ** 2
    rate_variance[0], rate_variance[-1] = 4 * rate_variance[1], 4 * rate_variance[-2]
    trusted = max(noise, 1.0)
    return Smoothed(
        values=curve,
        sigma=trusted * np.sqrt(inverse[0]),
        sigma_since_first=trusted * np.sqrt(since_first),
        rate=rate,
        rate_sigma=trusted * np.sqrt(rate_variance),
        cutoff_hz=float(cutoff) if left > 1e-3 else 0.5 / unit,
        removed_rms=float(np.sqrt(np.mean((signal - curve)[measured] ** 2))),
        noise_factor=float(noise),
        freedom=left,
    )


def removes_motion(smooth: Smoothed, noise: Smoothed) -> bool:
    """Whether smoothing removed clearly more of a signal than its noise.

    Parameters
    ----------
    smooth, noise
        The smoothed signal, and what has the signal's noise and no quick motion, smoothed with the
        same cutoff. Standard errors of both have to be right relative to each other.
    """
    if min(smooth.freedom, noise.freedom) <= LEAST_SAMPLES:
        return False
    by_chance = np.sqrt(f_distribution.isf(RARE, smooth.freedom, noise.freedom))
    return bool(smooth.noise_factor > MORE_THAN_NOISE * by_chance * noise.noise_factor)


def _score(
    signal: Array, weight: Array, penalty: Array, stiffness: float, noise_known: bool
) -> float:
    """Return −2 log likelihood of one λ, up to a constant."""
    curve, _, factor = _fit(signal, weight, penalty, stiffness)
    residual = max(float(np.sum(weight * signal * (signal - curve))), 1e-300)
    determinant = 2.0 * float(np.sum(np.log(factor[0])))
    freedom = int(np.count_nonzero(weight)) - ORDER
    misfit = residual if noise_known else freedom * np.log(residual)
    likelihood = misfit + determinant
    return float(likelihood - (signal.size - ORDER) * np.log(stiffness))


def _fit(
    signal: Array, weight: Array, penalty: Array, stiffness: float
) -> tuple[Array, Array, Array]:
    """Return the curve (n,), the band (4, n) of (W + λP)⁻¹, diagonal first, and the factor."""
    band = stiffness * penalty
    band[0] += weight
    factor = cholesky_banded(band, lower=True)
    return banded_solution(factor, weight * signal), inverse_band(factor), factor


def _penalty_band(time: Array) -> Array:
    """Return ∫ (z‴)² dt as a quadratic form in the samples: lower band (4, n), diagonal first."""
    band = np.zeros((ORDER + 1, time.size))
    for k in range(time.size - ORDER):
        nodes = time[k : k + ORDER + 1]
        differences = nodes[:, None] - nodes[None, :] + np.eye(ORDER + 1)
        third = 6.0 / differences.prod(axis=1)
        width = (nodes[-1] - nodes[0]) / ORDER
        for i in range(ORDER + 1):
            for j in range(i + 1):
                band[i - j, k + j] += width * third[i] * third[j]
    return band


@compiled
def banded_solution(factor: Array, right: Array) -> Array:
    """Return x with L Lᵀ x = right (n,) for a lower banded Cholesky factor (b + 1, n)."""
    n = right.size
    width = factor.shape[0] - 1
    x = right.copy()
    for i in range(n):
        for k in range(1, min(width, i) + 1):
            x[i] -= factor[k, i - k] * x[i - k]
        x[i] /= factor[0, i]
    for i in range(n - 1, -1, -1):
        for k in range(1, min(width, n - 1 - i) + 1):
            x[i] -= factor[k, i] * x[i + k]
        x[i] /= factor[0, i]
    return x


@compiled
def inverse_band(factor: Array) -> Array:
    """Return the band (b + 1, n) of (L Lᵀ)⁻¹ by Takahashi's recursion."""
    width = factor.shape[0] - 1
    n = factor.shape[1]
    inverse = np.zeros((width + 1, n))
    for i in range(n - 1, -1, -1):
        d = factor[0, i]
        reach = min(width, n - 1 - i)
        for j in range(reach, -1, -1):
            total = 1.0 / (d * d) if j == 0 else 0.0
            for k in range(1, reach + 1):
                low, high = (j, k) if j < k else (k, j)
                total -= factor[k, i] / d * inverse[high - low, i + low]
            inverse[j, i] = total
    return inverse
