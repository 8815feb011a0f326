"""The scalar law of viscosity: how a stress relaxes, as a sum of exponentials.

A tissue that is stretched suddenly and held bears ``G(t) = 1 + Σ β_i exp(−t/τ_i)`` times the stress
that lasts. In each branch the overstress Q follows ``Q′ + Q/τ = β S′`` with the elastic stress S.
Where S grows evenly over a step of length Δ, that is exactly (Taylor, Pister and Goudreau 1970)

    Q₁ = e Q₀ + β c (S₁ − S₀),    e = exp(−Δ/τ),    c = (1 − e) τ/Δ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fem2d.materials.material import Array, MaterialError


@dataclass(frozen=True)
class PronySeries:
    """How the stress of a tissue relaxes to the one that lasts, which is that of its elastic law.

    Parameters
    ----------
    overstress
        β of each branch: the stress that it adds to a sudden stretch, over the one that lasts.
    relaxation_s
        τ of each branch, s.

    Raises
    ------
    MaterialError
        If there are not as many of the one as of the other, or one is not positive.

    Examples
    --------
    >>> PronySeries((0.5, 0.25), (0.1, 2.0)).relaxation([0.0, 1e9]).tolist()
    [1.75, 1.0]
    """

    overstress: tuple[float, ...]
    relaxation_s: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.overstress or len(self.overstress) != len(self.relaxation_s):
            raise MaterialError(
                f"overstress has {len(self.overstress)} terms and relaxation_s "
                f"{len(self.relaxation_s)}: give one time for each overstress, and at least one"
            )
        for name in ("overstress", "relaxation_s"):
            values = getattr(self, name)
            if not all(math.isfinite(value) and value > 0 for value in values):
                raise MaterialError(f"{name} = {list(values)}: every term must be positive")

    def relaxation(self, time_s: ArrayLike) -> Array:
        """Return G (...,) at times (...,) after a sudden stretch, s."""
        time = np.asarray(time_s, float)[..., None]
        branches = np.array(self.overstress) * np.exp(-time / np.array(self.relaxation_s))
        relaxed: Array = 1.0 + branches.sum(axis=-1)
        return relaxed

    def recurrence(self, duration_s: float) -> tuple[Array, Array]:
        """Return e and β c (N,) of each branch for a step of this length, s."""
        ratio = duration_s / np.array(self.relaxation_s)
        return np.exp(-ratio), np.array(self.overstress) * -np.expm1(-ratio) / ratio
