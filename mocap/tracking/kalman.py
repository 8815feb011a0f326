"""A Kalman filter for a point of constant velocity with random acceleration.

Source: Bar-Shalom, Li and Kirubarajan (2001), ch. 6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class KalmanState:
    """Expected position and velocity of a point (px, px/s) with covariance (4, 4)."""

    state: Array
    covariance: Array

    @classmethod
    def at_rest(cls, x: float, y: float, speed: float) -> KalmanState:
        """Return the state of a point measured once; ``speed``, px/s, is the velocity's σ."""
        return cls(np.array([x, y, 0.0, 0.0]), np.diag([1.0, 1.0, speed**2, speed**2]))

    def after(self, interval_s: float, acceleration: float) -> KalmanState:
        """Return the prediction after ``interval_s`` with random acceleration (px/s²)."""
        dt = interval_s
        step = np.eye(4)
        step[0, 2] = step[1, 3] = dt
        q = acceleration**2 * np.array([[dt**4 / 4, dt**3 / 2], [dt**3 / 2, dt**2]])
        noise = np.zeros((4, 4))
        noise[::2, ::2] = q
        noise[1::2, 1::2] = q
        return KalmanState(step @ self.state, step @ self.covariance @ step.T + noise)

    def corrected(self, x: float, y: float, covariance: Array) -> KalmanState:
        """Return the estimate after the point was measured at (x, y)."""
        total = self.covariance[:2, :2] + covariance
        gain = self.covariance[:, :2] @ np.linalg.inv(total)
        state = self.state + gain @ (np.array([x, y]) - self.state[:2])
        left = np.eye(4)
        left[:, :2] -= gain
        # Joseph's form keeps the covariance positive definite for any measurement error.
        return KalmanState(state, left @ self.covariance @ left.T + gain @ covariance @ gain.T)

    @property
    def spread_px(self) -> float:
        """Standard deviation of the position, px."""
        return math.sqrt(max(float(np.trace(self.covariance[:2, :2])) / 2, 0.0))
