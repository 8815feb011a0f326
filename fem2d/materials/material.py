"""What every material law offers, whatever its formula."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]


class MaterialError(DrinksimError):
    """A material was described that does not exist or cannot be computed with."""


@runtime_checkable
class Material(Protocol):
    """A hyperelastic law: energy, stress and tangent of the same deformation gradient."""

    def energy(self, F: ArrayLike) -> Array:
        """Return the energy density ψ (...,), MPa, for deformation gradients (..., 3, 3)."""
        ...

    def first_piola_kirchhoff(self, F: ArrayLike) -> Array:
        """Return P = ∂ψ/∂F (..., 3, 3), MPa."""
        ...

    def tangent(self, F: ArrayLike) -> Array:
        """Return ∂P/∂F (..., 3, 3, 3, 3), MPa, with index order P_iJ, F_kL."""
        ...

    def volumetric(self, J: ArrayLike) -> tuple[Array, Array]:
        """Return the volumetric energy and its derivative by J, MPa, at volume ratios (...,)."""
        ...

    @property
    def shear_modulus_mpa(self) -> float:
        """Shear modulus at zero strain, MPa."""
        ...

    @property
    def bulk_modulus_mpa(self) -> float:
        """Bulk modulus at zero strain, MPa."""
        ...

    def packed(self) -> Array:
        """Return the packed parameters that the assembly kernel reads."""
        ...


M = TypeVar("M", bound=Material)


def stiffened(material: M, factor: float) -> M:
    """Return the same law with every stress multiplied by ``factor``.

    The unit in a parameter's name says how it scales: MPa by the factor, 1/MPa by its inverse.

    Raises
    ------
    MaterialError
        If the factor is not positive.
    """
    if not (math.isfinite(factor) and factor > 0):
        raise MaterialError(f"stiffness factor {factor:g} must be positive, e.g. 0.5 or 2")
    scaled: dict[str, float | tuple[float, ...]] = {}
    for item in fields(material):  # type: ignore[arg-type]
        power = -1 if item.name.endswith("_per_mpa") else int(item.name.endswith("_mpa"))
        if power:
            value = getattr(material, item.name)
            scale = factor**power
            scaled[item.name] = (
                tuple(scale * v for v in value) if isinstance(value, tuple) else scale * value
            )
    return replace(material, **scaled)  # type: ignore[type-var]


def compressibility(shear_modulus_mpa: float, poisson: float) -> float:
    """Return D₁ = 2/K₀ in 1/MPa of a material with this initial shear modulus and Poisson's ratio.

    Thesis eq. 3.2: ``D₁ = 3 (1 − 2ν) / (μ₀ (1 + ν))``.

    Raises
    ------
    MaterialError
        If Poisson's ratio is not above −1 and below 0.5, or the shear modulus not positive.

    >>> round(compressibility(2 * 0.004292, 0.49), 6)
    4.691106
    """
    if not (math.isfinite(shear_modulus_mpa) and shear_modulus_mpa > 0):
        raise MaterialError(
            f"initial shear modulus {shear_modulus_mpa:g} MPa is not positive: a material needs "
            "Σ mu_mpa > 0 (or C10_mpa > 0) to be stable at zero strain"
        )
    if not -1 < poisson < 0.5:
        raise MaterialError(
            f"poisson = {poisson:g} is outside (-1, 0.5): give e.g. 0.49, or the compressibility "
            "D_per_mpa itself for a material still closer to incompressible"
        )
    return 3 * (1 - 2 * poisson) / (shear_modulus_mpa * (1 + poisson))


def given_compressibility(
    name: str, given: float | None, shear_modulus_mpa: float, poisson: float | None
) -> float:
    """Return D₁ in 1/MPa, which is given either itself, under a name, or by Poisson's ratio.

    Raises
    ------
    MaterialError
        If none or both are given, or Poisson's ratio is out of its range.
    """
    if given is not None and poisson is None:
        return float(given)
    if poisson is not None and given is None:
        return compressibility(shear_modulus_mpa, poisson)
    told = "both poisson and" if poisson is not None else "neither poisson nor"
    raise MaterialError(f"{told} {name} given: give one of the two, for instance poisson = 0.49")


def poisson_ratio(shear_modulus_mpa: float, bulk_modulus_mpa: float) -> float:
    """Return Poisson's ratio at zero strain from the two moduli, MPa (thesis eq. 3.1)."""
    ratio = bulk_modulus_mpa / shear_modulus_mpa
    return (3 * ratio - 2) / (6 * ratio + 2)


def checked_gradient(F: ArrayLike) -> Array:
    """Return ``F`` as an array (..., 3, 3), none of it turned inside out."""
    gradient = np.asarray(F, float)
    if gradient.shape[-2:] != (3, 3):
        raise MaterialError(
            f"deformation gradient of shape {gradient.shape}: the last two axes must be (3, 3)"
        )
    volume = np.linalg.det(gradient)
    if not np.all(volume > 0):
        raise MaterialError(
            f"deformation gradient with determinant {np.min(volume):g}: it must be positive, "
            "material cannot be turned inside out"
        )
    return gradient
