"""Whole motions sampled from what a measurement leaves open.

The standard errors of a motion hold at each instant; its errors at neighbouring instants are nearly
the same. They have a part that does not change (scale, first frame, depth) and a part that follows
the smoothing spline, whose errors forget themselves within a time of about 1/(2π) of its cutoff
frequency. With z and u(t) of unit variance,

    e(t) = σ(t) (√c z + √(1 − c) u(t)),   cov(u(s), u(t)) = exp(−(s − t)²/(2τ²)),

so that a draw has the stated standard error at every instant and is as smooth as the motion.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mocap.motion.errors import MotionError
from mocap.motion.motion import Motion

Array = NDArray[np.float64]

CORRELATION_S = 0.1
"""τ: errors of a spline with a cutoff of some 1.6 Hz; those of a faster one forget sooner."""

CONSTANT_SHARE = 0.5
"""c: the share of the variance that does not change in time; an estimate."""


def sampled_motion(
    motion: Motion,
    random: np.random.Generator,
    *,
    correlation_s: float = CORRELATION_S,
    constant_share: float = CONSTANT_SHARE,
) -> Motion:
    """Return a motion that could be the true one, as far as the measurement says.

    Parameters
    ----------
    motion
        The measured motion, with its standard errors.
    random
        Gives the random numbers.
    correlation_s, constant_share
        τ and c of the errors.

    Raises
    ------
    MotionError
        If the motion has no standard errors.
    """
    if not np.isfinite(motion.sigma).all():
        raise MotionError(
            f"{motion!r} has no standard errors to draw from: convert a recording, or give the "
            "columns sigma_*"
        )
    error = motion.sigma * correlated_noise(
        motion.time_s, 3, random, correlation_s=correlation_s, constant_share=constant_share
    )
    return motion.with_(
        relative_mm=motion.relative_mm + error[:, :2],
        relative_rad=motion.relative_rad + error[:, 2],
    )


def correlated_noise(
    time_s: Array,
    columns: int,
    random: np.random.Generator,
    *,
    correlation_s: float,
    constant_share: float,
) -> Array:
    """Return independent columns (n, columns) of noise with unit variance, correlated in time."""
    values, vectors = np.linalg.eigh(
        noise_covariance(time_s, correlation_s=correlation_s, constant_share=constant_share)
    )
    root = vectors * np.sqrt(np.clip(values, 0.0, None))
    noise: Array = root @ random.standard_normal((time_s.size, columns))
    return noise


def noise_covariance(time_s: Array, *, correlation_s: float, constant_share: float) -> Array:
    """Return the covariance (n, n) of the noise at instants (n,)."""
    lag = (time_s[:, None] - time_s[None, :]) / correlation_s
    covariance: Array = constant_share + (1.0 - constant_share) * np.exp(-0.5 * lag**2)
    return covariance
