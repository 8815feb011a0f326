"""The law of Holzapfel, Gasser and Ogden for tissue with families of collagen fibres."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from fem2d.materials.fibre_kernels import FIBRES
from fem2d.materials.material import Array, MaterialError, checked_gradient, given_compressibility

ISOTROPIC = 1 / 3
TINIEST = math.ulp(0.0)
"""The smallest positive number."""

Direction: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, init=False)
class HolzapfelGasserOgden:
    """ψ = C₁₀(Î₁ − 3) + ((J² − 1)/2 − ln J)/D + k₁/(2k₂) Σ_a (exp(k₂⟨Ê_a⟩²) − 1).

    Ê_a = κ(Î₁ − 3) + (1 − 3κ)(Î₄ₐ − 1), Î₄ₐ = A_a · Ĉ A_a (Gasser, Ogden and Holzapfel 2006, in
    Abaqus' convention). The bracket ⟨Ê⟩ leaves out fibres that are shortened. The initial moduli of
    the matrix are μ₀ = 2 C₁₀ and K₀ = 2/D; the volumetric term is not that of the other laws.

    Parameters
    ----------
    C10_mpa
        Matrix, MPa; positive.
    k1_mpa
        Fibre stiffness, MPa; not negative.
    k2
        Fibre stiffening; not negative.
    kappa
        Dispersion, 0 (aligned) … 1/3 (isotropic).
    D_per_mpa
        Compressibility, 1/MPa; positive.
    fibres
        Mean direction of each family in the reference state; any length but zero. With
        κ = 1/3 the direction means nothing and one family stands for all fibres.
    poisson
        Poisson's ratio of the matrix at zero strain, instead of ``D_per_mpa``.

    Raises
    ------
    MaterialError
        If a parameter is out of its range, or κ = 1/3 comes with several families (each would count
        all fibres again).
    """

    C10_mpa: float
    k1_mpa: float
    k2: float
    kappa: float
    D_per_mpa: float
    fibres: tuple[Direction, ...]

    def __init__(
        self,
        C10_mpa: float,
        k1_mpa: float,
        k2: float,
        kappa: float,
        D_per_mpa: float | None = None,
        fibres: Sequence[Direction] = ((1.0, 0.0, 0.0),),
        *,
        poisson: float | None = None,
    ) -> None:
        self._set("C10_mpa", C10_mpa, TINIEST, "half the matrix' shear modulus, positive")
        self._set("k1_mpa", k1_mpa, 0.0, "0 for no fibres, about 24.5 for skin")
        self._set("k2", k2, 0.0, "0 for fibres that do not stiffen, about 0.13 for skin")
        self._set("kappa", kappa, 0.0, "0 for aligned fibres … 1/3 for isotropic ones")
        D = given_compressibility("D_per_mpa", D_per_mpa, 2 * self.C10_mpa, poisson)
        self._set("D_per_mpa", D, TINIEST, "2 over the bulk modulus, positive (or poisson = 0.49)")
        if self.kappa > ISOTROPIC + 1e-9:
            raise MaterialError(
                f"kappa = {self.kappa:g} is above 1/3: give 0 for aligned fibres … 1/3 for "
                "isotropic ones"
            )
        object.__setattr__(self, "fibres", self._checked(fibres))

    def _set(self, name: str, value: float, lowest: float, remedy: str) -> None:
        number = float(value)
        if not (math.isfinite(number) and number >= lowest):
            raise MaterialError(f"{name} = {number:g} is out of range: give {remedy}")
        object.__setattr__(self, name, number)

    def _checked(self, fibres: Sequence[Direction]) -> tuple[Direction, ...]:
        directions = np.asarray(fibres, float)
        if directions.ndim != 2 or directions.shape[1] != 3 or len(directions) == 0:
            raise MaterialError(f"fibres = {fibres}: give one direction [x, y, z] for each family")
        lengths = np.linalg.norm(directions, axis=1)
        if not np.all(np.isfinite(lengths) & (lengths > 0)):
            raise MaterialError(f"fibres = {fibres}: a direction has no length")
        if self.isotropic and len(directions) > 1:
            raise MaterialError(
                f"kappa = 1/3 with {len(directions)} families counts all fibres "
                f"{len(directions)} times: leave out fibres, or give one direction"
            )
        return tuple((x, y, z) for x, y, z in directions.tolist())

    @property
    def isotropic(self) -> bool:
        """Whether the fibres have no direction."""
        return abs(self.kappa - ISOTROPIC) < 1e-9

    @property
    def shear_modulus_mpa(self) -> float:
        """Shear modulus of the matrix at zero strain, MPa (fibres start without stiffness)."""
        return 2 * self.C10_mpa

    @property
    def bulk_modulus_mpa(self) -> float:
        """Bulk modulus at zero strain, MPa."""
        return 2 / self.D_per_mpa

    @property
    def structure(self) -> Array:
        """(N, 3, 3) M = κ I + (1 − 3κ) A ⊗ A of each family."""
        A = np.asarray(self.fibres)
        A = A / np.linalg.norm(A, axis=1, keepdims=True)
        spread: Array = self.kappa * np.eye(3) + (1 - 3 * self.kappa) * A[:, :, None] * A[:, None]
        return spread

    def energy(self, F: ArrayLike) -> Array:
        """Return ψ (...,), MPa, for deformation gradients (..., 3, 3)."""
        gradient = checked_gradient(F)
        J = np.linalg.det(gradient)
        shrink = J ** (-2 / 3)
        energy: Array = self.C10_mpa * (shrink * np.sum(gradient**2, axis=(-2, -1)) - 3)
        for M in self.structure:
            strain = shrink * np.einsum("...iJ,JK,...iK->...", gradient, M, gradient) - 1
            energy = energy + self._fibre(strain)[0]
        return energy + self.volumetric(J)[0]

    def first_piola_kirchhoff(self, F: ArrayLike) -> Array:
        """Return P = ∂ψ/∂F (..., 3, 3), MPa, for deformation gradients (..., 3, 3)."""
        gradient = checked_gradient(F)
        J = np.linalg.det(gradient)[..., None, None]
        inverse = np.swapaxes(np.linalg.inv(gradient), -1, -2)
        stress = J * self.volumetric(J)[1] * inverse
        stress = stress + self.C10_mpa * _slope(gradient, inverse, J, np.eye(3))
        for M in self.structure:
            pull = self._fibre(_strain(gradient, J[..., 0, 0], M))[1]
            stress = stress + pull[..., None, None] * _slope(gradient, inverse, J, M)
        P: Array = stress
        return P

    def tangent(self, F: ArrayLike) -> Array:
        """Return ∂P/∂F (..., 3, 3, 3, 3), MPa, for deformation gradients (..., 3, 3)."""
        gradient = checked_gradient(F)
        J = np.linalg.det(gradient)
        ratio = J[..., None, None]
        G = np.swapaxes(np.linalg.inv(gradient), -1, -2)
        crossed = np.einsum("...iL,...kJ->...iJkL", G, G)
        slope = J * self.volumetric(J)[1]
        curvature = J**2 * (1 + J**-2) / self.D_per_mpa
        A = (slope + curvature)[..., None, None, None, None] * _outer(G, G)
        A -= slope[..., None, None, None, None] * crossed
        A += self.C10_mpa * _curvature(gradient, G, crossed, ratio, np.eye(3))
        for M in self.structure:
            _, first, second = self._fibre(_strain(gradient, J, M))
            pull = _slope(gradient, G, ratio, M)
            A += second[..., None, None, None, None] * _outer(pull, pull)
            A += first[..., None, None, None, None] * _curvature(gradient, G, crossed, ratio, M)
        tangent: Array = A
        return tangent

    def volumetric(self, J: ArrayLike) -> tuple[Array, Array]:
        """Return U and dU/dJ (...,), MPa, at volume ratios J (...,)."""
        ratio = np.asarray(J, float)
        return (
            ((ratio**2 - 1) / 2 - np.log(ratio)) / self.D_per_mpa,
            (ratio - 1 / ratio) / self.D_per_mpa,
        )

    def packed(self) -> Array:
        """Return the packed parameters ``[1, N, C₁₀, 1/D, k₁, k₂, M₁₁, M₁₂, M₂₂, M₃₃, …]``.

        Raises
        ------
        MaterialError
            If the families are not symmetric about the section: it would shear out of its plane.
        """
        M = self.structure
        lean = M[:, :2, 2]
        for family in np.flatnonzero(np.abs(lean).max(axis=1) > 1e-12):
            mirrored = M[family] * np.array([[1, 1, -1], [1, 1, -1], [-1, -1, 1]])
            if not np.any(np.abs(M - mirrored).max(axis=(1, 2)) < 1e-12):
                raise MaterialError(
                    f"fibres direction {list(self.fibres[family])} leans out of the section alone: "
                    "add its mirror image (third component with the other sign)"
                )
        planar = np.stack([M[:, 0, 0], M[:, 0, 1], M[:, 1, 1], M[:, 2, 2]], axis=1)
        head = [FIBRES, len(M), self.C10_mpa, 1 / self.D_per_mpa, self.k1_mpa, self.k2]
        return np.concatenate([head, planar.ravel()])

    def _fibre(self, strain: Array) -> tuple[Array, Array, Array]:
        """Return W, dW/dÊ, d²W/dÊ² at fibre strains (...,)."""
        stretched = np.maximum(strain, 0.0)
        growth = np.exp(self.k2 * stretched**2)
        energy = np.expm1(self.k2 * stretched**2) / self.k2 if self.k2 > 0 else stretched**2
        curvature = self.k1_mpa * (1 + 2 * self.k2 * stretched**2) * growth * (strain > 0)
        return 0.5 * self.k1_mpa * energy, self.k1_mpa * stretched * growth, curvature


def _outer(a: Array, b: Array) -> Array:
    product: Array = np.einsum("...iJ,...kL->...iJkL", a, b)
    return product


def _strain(F: Array, J: Array, M: Array) -> Array:
    strain: Array = J ** (-2 / 3) * np.einsum("...iJ,JK,...iK->...", F, M, F) - 1
    return strain


def _slope(F: Array, G: Array, J: Array, M: Array) -> Array:
    """Return ∂(J^(−2/3) tr(F M Fᵀ))/∂F with G = F^(−T); J (..., 1, 1)."""
    K = np.einsum("...iJ,JK,...iK->...", F, M, F)[..., None, None]
    slope: Array = J ** (-2 / 3) * (2 * F @ M - 2 / 3 * K * G)
    return slope


def _curvature(F: Array, G: Array, crossed: Array, J: Array, M: Array) -> Array:
    """Return the second derivative of J^(−2/3) tr(F M Fᵀ), with crossed_iJkL = G_iL G_kJ."""
    K = np.einsum("...iJ,JK,...iK->...", F, M, F)[..., None, None, None, None]
    FM = F @ M
    curvature: Array = J[..., None, None] ** (-2 / 3) * (
        2 * np.einsum("ik,JL->iJkL", np.eye(3), M)
        - 4 / 3 * (_outer(FM, G) + _outer(G, FM))
        + 4 / 9 * K * _outer(G, G)
        + 2 / 3 * K * crossed
    )
    return curvature
