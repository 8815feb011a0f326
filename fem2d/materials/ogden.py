"""Ogden's law with any number of terms, in Abaqus' convention."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem2d.materials.material import Array, MaterialError, given_compressibility
from fem2d.materials.principal import PrincipalLaw
from fem2d.materials.principal_kernels import PRINCIPAL


@dataclass(frozen=True, init=False)
class Ogden(PrincipalLaw):
    """ψ = Σ (2μ_i/α_i²)(λ̂₁^α_i + λ̂₂^α_i + λ̂₃^α_i − 3) + Σ (J − 1)^(2i)/D_i.

    The initial moduli are μ₀ = Σ μ_i and K₀ = 2/D₁. Ogden's own convention (1972) writes μ/α for
    2μ/α²: convert with :meth:`from_ogden_convention`.

    Parameters
    ----------
    mu_mpa
        μ_i, MPa; single ones may be negative as long as their sum is positive.
    alpha
        α_i, as many as μ_i, none zero.
    D_per_mpa
        D_i, 1/MPa; D₁ > 0. Missing ones and zeros leave their term out.
    poisson
        Poisson's ratio at zero strain, which gives D₁, instead of ``D_per_mpa``.

    Raises
    ------
    MaterialError
        If the numbers do not describe a material that is stable at zero strain.

    Examples
    --------
    >>> Ogden(mu_mpa=[0.05], alpha=[10.789], poisson=0.49).D_per_mpa[0].__round__(6)
    0.805369
    """

    mu_mpa: tuple[float, ...]
    alpha: tuple[float, ...]
    D_per_mpa: tuple[float, ...]

    def __init__(
        self,
        mu_mpa: Sequence[float],
        alpha: Sequence[float],
        D_per_mpa: Sequence[float] | None = None,
        *,
        poisson: float | None = None,
    ) -> None:
        given = {"mu_mpa": mu_mpa, "alpha": alpha}
        if D_per_mpa is not None:
            given["D_per_mpa"] = D_per_mpa
        for name, numbers in given.items():
            object.__setattr__(self, name, _numbers(name, numbers))
        self._check_terms()
        if D_per_mpa is None or poisson is not None:
            D1 = given_compressibility(
                "D_per_mpa", None if D_per_mpa is None else D_per_mpa[0], sum(self.mu_mpa), poisson
            )
            object.__setattr__(self, "D_per_mpa", (D1,))
        self._check_compressibility()

    def _check_terms(self) -> None:
        if len(self.mu_mpa) != len(self.alpha):
            raise MaterialError(
                f"mu_mpa has {len(self.mu_mpa)} terms and alpha {len(self.alpha)}: "
                "give one alpha for each mu"
            )
        if 0.0 in self.alpha:
            raise MaterialError(f"alpha = {list(self.alpha)} holds 0: leave that term out")
        if sum(self.mu_mpa) <= 0:
            raise MaterialError(
                f"mu_mpa = {list(self.mu_mpa)} sums to {sum(self.mu_mpa):g} MPa: the sum is the "
                "initial shear modulus and must be positive"
            )

    def _check_compressibility(self) -> None:
        if len(self.D_per_mpa) > len(self.mu_mpa):
            raise MaterialError(
                f"D_per_mpa has {len(self.D_per_mpa)} terms for {len(self.mu_mpa)} of mu_mpa: "
                "give at most one D for each mu"
            )
        if self.D_per_mpa[0] <= 0 or min(self.D_per_mpa) < 0:
            raise MaterialError(
                f"D_per_mpa = {list(self.D_per_mpa)}: the first must be positive and none negative "
                "(or give poisson, e.g. 0.49)"
            )

    @classmethod
    def from_ogden_convention(
        cls, mu_mpa: Sequence[float], alpha: Sequence[float], D_per_mpa: Sequence[float]
    ) -> Ogden:
        """Return the law for energies written Σ (μ/α)(…), as Ogden (1972) does: μ here is μα/2."""
        converted = tuple(0.5 * m * a for m, a in zip(mu_mpa, alpha, strict=True))
        return cls(converted, alpha, D_per_mpa)

    @property
    def shear_modulus_mpa(self) -> float:
        """Shear modulus at zero strain, MPa."""
        return sum(self.mu_mpa)

    @property
    def bulk_modulus_mpa(self) -> float:
        """Bulk modulus at zero strain, MPa."""
        return 2 / self.D_per_mpa[0]

    def packed(self) -> Array:
        """Return the packed parameters ``[0, n, μ₁, α₁, 1/D₁, …]`` read by the kernels."""
        inverse = [1 / d if d > 0 else 0.0 for d in self.D_per_mpa]
        inverse += [0.0] * (len(self.mu_mpa) - len(inverse))
        terms = np.column_stack([self.mu_mpa, self.alpha, inverse])
        return np.concatenate([[PRINCIPAL, len(self.mu_mpa)], terms.ravel()])


def _numbers(name: str, values: Sequence[float]) -> tuple[float, ...]:
    numbers = tuple(float(x) for x in values)
    if not numbers or not all(math.isfinite(x) for x in numbers):
        raise MaterialError(f"{name} = {list(numbers)}: give at least one finite number")
    return numbers
