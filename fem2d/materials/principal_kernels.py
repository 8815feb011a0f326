"""Scalar kernels of the laws that are sums of powers of the stretches (Ogden, neo-Hookean).

Such a law is packed into numbers: ``[0, n, μ₁, α₁, 1/D₁, μ₂, α₂, 1/D₂, …]``.
With deviatoric logarithmic stretches ``ê_i = ln λ̂_i`` and ``v = ln J``

    ψ̂ = Σ (2μ/α²) Σ_i (exp(α ê_i) − 1),   t_i = ∂ψ̂/∂ê_i = Σ (2μ/α) exp(α ê_i),
    h_i = ∂t_i/∂ê_i = Σ 2μ exp(α ê_i),     U = Σ (J − 1)^(2k) / D_k .

Energies are summed with ``expm1`` so that they keep their digits at small strain.
"""

from __future__ import annotations

import math

import numpy as np

from fem2d.materials.material import Array
from geometry2d.compiled import compiled

PRINCIPAL = 0.0


@compiled
def principal_in_plane(packed: Array, e1: float, e2: float, principal: Array) -> None:
    """Fill ``exp(α e) − 1`` of e₁, e₂ and e₁ − e₂ for each term into columns 0, 1, 3 (n, 5)."""
    for k in range(int(packed[1])):
        alpha = packed[3 + 3 * k]
        second, apart = math.expm1(alpha * e2), math.expm1(alpha * (e1 - e2))
        principal[k, 0] = second + apart + second * apart
        principal[k, 1] = second
        principal[k, 3] = apart


@compiled
def principal_isochoric(
    packed: Array, e3: float, v: float, principal: Array
) -> tuple[float, float, float, float, float, float, float]:
    """Return ψ̂, t₁, t₂, t₃, h₁, h₂, h₃; ``principal`` come from :func:`principal_in_plane`.

    Fills columns 2 and 4 of them, ``exp(α e) − 1`` of e₃ and −v/3. With x = exp(a) − 1 and
    z = exp(b) − 1 it is exp(a + b) − 1 = x + z + x z, so that small strains keep their digits.
    """
    energy = t1 = t2 = t3 = h1 = h2 = h3 = 0.0
    for k in range(int(packed[1])):
        mu = packed[2 + 3 * k]
        alpha = packed[3 + 3 * k]
        x1, x2 = principal[k, 0], principal[k, 1]
        x3 = principal[k, 2] = math.expm1(alpha * e3)
        z = principal[k, 4] = math.expm1(-alpha * v / 3.0)
        x1, x2, x3 = x1 + z + x1 * z, x2 + z + x2 * z, x3 + z + x3 * z
        energy += 2.0 * mu / (alpha * alpha) * (x1 + x2 + x3)
        h1 += 2.0 * mu * (1.0 + x1)
        h2 += 2.0 * mu * (1.0 + x2)
        h3 += 2.0 * mu * (1.0 + x3)
        t1 += 2.0 * mu / alpha * x1
        t2 += 2.0 * mu / alpha * x2
        t3 += 2.0 * mu / alpha * x3
    # t leaves out the constant Σ 2μ/α: only differences of t enter the stress.
    return energy, t1, t2, t3, h1, h2, h3


@compiled
def principal_volume(packed: Array, w: float) -> tuple[float, float, float]:
    """Return U, dU/dJ and d²U/dJ² at ``w = J − 1``."""
    energy = first = second = 0.0
    power = 1.0
    for k in range(int(packed[1])):
        order = 2.0 * (k + 1)
        inverse = packed[4 + 3 * k]
        energy += power * w * w * inverse
        first += order * power * w * inverse
        second += order * (order - 1.0) * power * inverse
        power *= w * w
    return energy, first, second


@compiled
def principal_difference(packed: Array, d: float, s2: float, principal: Array) -> float:
    """Return (τ₁ − τ₂)/(λ₁² − λ₂²), also for equal or nearly equal stretches.

    With d = e₁ − e₂ each term is ``(2μ/α) exp(α (e₂ − v/3)) (exp(α d) − 1)``, the divisor
    ``λ₂² (exp(2 d) − 1)``: both differences have full relative accuracy for every d ≠ 0, and their
    quotient the limit α/2 at d = 0: nothing is perturbed. ``principal`` are those that
    :func:`principal_isochoric` has completed.
    """
    total = 0.0
    for k in range(int(packed[1])):
        apart = 0.5 * packed[3 + 3 * k] if d == 0.0 else principal[k, 3]
        scale = 2.0 * packed[2 + 3 * k] / packed[3 + 3 * k]
        total += scale * (1.0 + principal[k, 1]) * (1.0 + principal[k, 4]) * apart
    return total / (s2 * s2 * (1.0 if d == 0.0 else math.expm1(2.0 * d)))


@compiled
def principal_points(
    packed: Array, logs: Array, energy: Array, stress: Array, slope: Array, gap: Array
) -> None:
    """Fill ψ (n,), τ (n, 3), ∂τ/∂e and gap quotients (n, 3, 3) for log stretches (n, 3)."""
    t = np.empty(3)
    h = np.empty(3)
    principal, of_pair = np.empty((int(packed[1]), 5)), np.empty((int(packed[1]), 5))
    for p in range(logs.shape[0]):
        v = logs[p, 0] + logs[p, 1] + logs[p, 2]
        principal_in_plane(packed, logs[p, 0], logs[p, 1], principal)
        isochoric, t[0], t[1], t[2], h[0], h[1], h[2] = principal_isochoric(
            packed, logs[p, 2], v, principal
        )
        of_pair[:, 4] = principal[:, 4]
        w = math.expm1(v)
        J = 1.0 + w
        volumetric, first, second = principal_volume(packed, w)
        energy[p] = isochoric + volumetric
        mean_t = (t[0] + t[1] + t[2]) / 3.0
        sum_h = h[0] + h[1] + h[2]
        for i in range(3):
            stress[p, i] = t[i] - mean_t + J * first
            for j in range(3):
                slope[p, i, j] = sum_h / 9.0 - (h[i] + h[j]) / 3.0 + J * first + J * J * second
                principal_in_plane(packed, logs[p, i], logs[p, j], of_pair)
                apart, stretch = logs[p, i] - logs[p, j], math.exp(logs[p, j])
                gap[p, i, j] = principal_difference(packed, apart, stretch, of_pair)
            slope[p, i, i] += h[i]
