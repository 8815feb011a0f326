"""Distortion by a lens, in OpenCV's convention."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Distortion:
    """Brown's model in OpenCV's convention (calib3d, "Detailed description").

    Attributes
    ----------
    k1, k2, k3
        Radial coefficients.
    p1, p2
        Tangential coefficients.
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    @property
    def is_distorting(self) -> bool:
        """Whether straight lines appear curved."""
        return any((self.k1, self.k2, self.p1, self.p2, self.k3))

    def distorted(self, normalised: ArrayLike) -> Array:
        """Return where ideal normalised image points (..., 2) appear, also normalised."""
        point = np.asarray(normalised, float)
        x, y = point[..., 0], point[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return np.stack(
            [
                x * radial + 2 * self.p1 * x * y + self.p2 * (r2 + 2 * x * x),
                y * radial + self.p1 * (r2 + 2 * y * y) + 2 * self.p2 * x * y,
            ],
            axis=-1,
        )
