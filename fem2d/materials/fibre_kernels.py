"""Scalar kernels of the Holzapfel–Gasser–Ogden law.

Such a law is packed into numbers for a section:
``[1, N, C₁₀, 1/D, k₁, k₂, M₁₁, M₁₂, M₂₂, M₃₃, …]``, four numbers a family, where
``M = κ I + (1 − 3κ) A ⊗ A`` gathers dispersion and mean direction of a family, so that

    Ê = κ (Î₁ − 3) + (1 − 3κ) (Î₄ − 1) = J^(−2/3) tr(F M Fᵀ) − 1 .

Everything in the law is then a function of quadratic forms K = tr(F M Fᵀ), the matrix term among
them with M = I, and the isotropic case κ = 1/3 needs no code of its own.
"""

from __future__ import annotations

import math

from fem2d.materials.material import Array
from geometry2d.compiled import compiled

FIBRES = 1.0
FIRST_FAMILY = 6


@compiled
def fibre_energy(k1: float, k2: float, strain: float) -> tuple[float, float, float]:
    """Return W = k₁/(2k₂)(exp(k₂⟨Ê⟩²) − 1), dW/dÊ and d²W/dÊ²; ⟨Ê⟩ is Ê or, if negative, 0."""
    if strain <= 0.0:
        return 0.0, 0.0, 0.0
    square = strain * strain
    growth = math.exp(k2 * square)
    energy = 0.5 * k1 * (math.expm1(k2 * square) / k2 if k2 > 0.0 else square)
    return energy, k1 * strain * growth, k1 * (1.0 + 2.0 * k2 * square) * growth


@compiled
def fibres_volume(packed: Array, v: float) -> tuple[float, float, float]:
    """Return U = ((J² − 1)/2 − ln J)/D, dU/dJ and d²U/dJ² at ``v = ln J``."""
    inverse = packed[3]
    energy = (0.5 * math.expm1(2.0 * v) - v) * inverse
    return energy, 2.0 * math.sinh(v) * inverse, (1.0 + math.exp(-2.0 * v)) * inverse


@compiled
def quadratic_form(packed: Array, family: int, x: Array, f33: float) -> tuple[float, float]:
    """Return K = tr(F M Fᵀ) of a family and the share M₃₃ F₃₃² of the third direction in it."""
    at = FIRST_FAMILY + 4 * family
    m11, m12, m22 = packed[at], packed[at + 1], packed[at + 2]
    inside = (
        m11 * (x[0] * x[0] + x[2] * x[2])
        + 2.0 * m12 * (x[0] * x[1] + x[2] * x[3])
        + m22 * (x[1] * x[1] + x[3] * x[3])
    )
    across = packed[at + 3] * f33 * f33
    return inside + across, across


@compiled
def fibres_traction(packed: Array, x: Array, f33: float, v: float) -> tuple[float, float, float]:
    """Return τ₃, dτ₃/de₃ and a measure of size for both, at thickness stretch ``f33``."""
    shrink = math.exp(-2.0 * v / 3.0)
    plane = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]
    across = f33 * f33
    residual = packed[2] * shrink * (4.0 * across - 2.0 * plane) / 3.0
    slope = packed[2] * shrink * (16.0 * across + 4.0 * plane) / 9.0
    size = packed[2] * shrink * (plane + across)
    for family in range(int(packed[1])):
        K, share = quadratic_form(packed, family, x, f33)
        _, first, second = fibre_energy(packed[4], packed[5], shrink * K - 1.0)
        turn = shrink * (2.0 * share - 2.0 / 3.0 * K)
        residual += first * turn
        slope += second * turn * turn + first * shrink * (4.0 / 3.0 * share + 4.0 / 9.0 * K)
        size += first * shrink * K
    _, U1, U2 = fibres_volume(packed, v)
    J = math.exp(v)
    return residual + J * U1, slope + J * U1 + J * J * U2, size
