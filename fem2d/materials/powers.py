"""Scalar kernels of the laws that are sums of powers of the stretches (Ogden, neo-Hookean).

A row of numbers describes such a law: ``[0, n, μ₁, α₁, 1/D₁, μ₂, α₂, 1/D₂, …]``.
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

POWERS = 0.0


@compiled
def powers_isochoric(
    row: Array, a1: float, a2: float, a3: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return ψ̂, t₁, t₂, t₃, h₁, h₂, h₃ for deviatoric logarithmic stretches a₁, a₂, a₃."""
    energy = t1 = t2 = t3 = h1 = h2 = h3 = 0.0
    for k in range(int(row[1])):
        mu = row[2 + 3 * k]
        alpha = row[3 + 3 * k]
        x1 = math.expm1(alpha * a1)
        x2 = math.expm1(alpha * a2)
        x3 = math.expm1(alpha * a3)
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
def powers_volume(row: Array, w: float) -> tuple[float, float, float]:
    """Return U, dU/dJ and d²U/dJ² at ``w = J − 1``."""
    energy = first = second = 0.0
    power = 1.0
    for k in range(int(row[1])):
        order = 2.0 * (k + 1)
        inverse = row[4 + 3 * k]
        energy += power * w * w * inverse
        first += order * power * w * inverse
        second += order * (order - 1.0) * power * inverse
        power *= w * w
    return energy, first, second


@compiled
def powers_gap(row: Array, e1: float, e2: float, v: float) -> float:
    """Return (τ₁ − τ₂)/(λ₁² − λ₂²), also for equal or nearly equal stretches.

    With m = (e₁ + e₂)/2 and d = (e₁ − e₂)/2 each term is
    ``(2μ/α) exp(α (m − v/3) − 2m) sinh(α d)/sinh(2 d)``; the quotient of the sines has full
    relative accuracy for every d ≠ 0 and the limit α/2 at d = 0: nothing is perturbed.
    """
    m = 0.5 * (e1 + e2)
    d = 0.5 * (e1 - e2)
    total = 0.0
    for k in range(int(row[1])):
        mu = row[2 + 3 * k]
        alpha = row[3 + 3 * k]
        quotient = 0.5 * alpha if d == 0.0 else math.sinh(alpha * d) / math.sinh(2.0 * d)
        total += 2.0 * mu / alpha * math.exp(alpha * (m - v / 3.0) - 2.0 * m) * quotient
    return total


@compiled
def powers_points(
    row: Array, logs: Array, energy: Array, stress: Array, slope: Array, gap: Array
) -> None:
    """Fill ψ (n,), τ (n, 3), ∂τ/∂e and gap quotients (n, 3, 3) for log stretches (n, 3)."""
    t = np.empty(3)
    h = np.empty(3)
    for p in range(logs.shape[0]):
        v = logs[p, 0] + logs[p, 1] + logs[p, 2]
        isochoric, t[0], t[1], t[2], h[0], h[1], h[2] = powers_isochoric(
            row, logs[p, 0] - v / 3.0, logs[p, 1] - v / 3.0, logs[p, 2] - v / 3.0
        )
        w = math.expm1(v)
        J = 1.0 + w
        volumetric, first, second = powers_volume(row, w)
        energy[p] = isochoric + volumetric
        mean_t = (t[0] + t[1] + t[2]) / 3.0
        sum_h = h[0] + h[1] + h[2]
        for i in range(3):
            stress[p, i] = t[i] - mean_t + J * first
            for j in range(3):
                slope[p, i, j] = sum_h / 9.0 - (h[i] + h[j]) / 3.0 + J * first + J * J * second
                gap[p, i, j] = powers_gap(row, logs[p, i], logs[p, j], v)
            slope[p, i, i] += h[i]
