"""The neo-Hookean law, in Abaqus' convention."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fem2d.materials.material import Array, MaterialError, given_compressibility
from fem2d.materials.principal import PrincipalLaw
from fem2d.materials.principal_kernels import PRINCIPAL


@dataclass(frozen=True, init=False)
class NeoHookean(PrincipalLaw):
    """ψ = C₁₀ (Î₁ − 3) + (J − 1)²/D₁ with μ₀ = 2 C₁₀ and K₀ = 2/D₁.

    It is Ogden's law with the one term μ = 2 C₁₀, α = 2, and the kernels treat it as such.

    Parameters
    ----------
    C10_mpa
        C₁₀ > 0, MPa.
    D1_per_mpa
        D₁ > 0, 1/MPa.
    poisson
        Poisson's ratio at zero strain, which gives D₁, instead of ``D1_per_mpa``.

    Raises
    ------
    MaterialError
        If a parameter is not positive.
    """

    C10_mpa: float
    D1_per_mpa: float

    def __init__(
        self, C10_mpa: float, D1_per_mpa: float | None = None, *, poisson: float | None = None
    ) -> None:
        self._set("C10_mpa", C10_mpa, "half the initial shear modulus, e.g. 0.005 for a lip")
        D1 = given_compressibility("D1_per_mpa", D1_per_mpa, 2 * self.C10_mpa, poisson)
        self._set("D1_per_mpa", D1, "2 over the bulk modulus; or give poisson, e.g. 0.49")

    def _set(self, name: str, value: float, remedy: str) -> None:
        number = float(value)
        if not (math.isfinite(number) and number > 0):
            raise MaterialError(f"{name} = {number:g} is not positive: give {remedy}")
        object.__setattr__(self, name, number)

    @property
    def shear_modulus_mpa(self) -> float:
        """Shear modulus at zero strain, MPa."""
        return 2 * self.C10_mpa

    @property
    def bulk_modulus_mpa(self) -> float:
        """Bulk modulus at zero strain, MPa."""
        return 2 / self.D1_per_mpa

    def packed(self) -> Array:
        """Return the packed parameters ``[0, 1, 2 C₁₀, 2, 1/D₁]`` read by the kernels."""
        return np.array([PRINCIPAL, 1.0, 2 * self.C10_mpa, 2.0, 1 / self.D1_per_mpa])
