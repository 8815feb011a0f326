"""Isotropic laws in three dimensions, from their response in principal logarithmic stretches.

With F = Σ λ_i n_i ⊗ N_i, e_i = ln λ_i, τ_i = ∂ψ/∂e_i, c_ij = ∂τ_i/∂e_j and
g_ij = (τ_i − τ_j)/(λ_i² − λ_j²), the stress is P = Σ (τ_i/λ_i) n_i ⊗ N_i and the tangent has in
the principal frames the entries

    A_iijj = (c_ij − δ_ij τ_i)/(λ_i λ_j),
    A_ijij = g_ij,    A_ijji = (g_ij (λ_i² + λ_j²) − (τ_i + τ_j)) / (2 λ_i λ_j)    (i ≠ j).

(Ogden, Non-linear Elastic Deformations, 1984, section 6.1.4.) Nothing is divided by λ_i − λ_j
except inside g, which the laws evaluate exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fem2d.materials.material import Array, checked_gradient
from fem2d.materials.principal_kernels import principal_points


def principal_response(packed: Array, logs: Array) -> tuple[Array, Array, Array, Array]:
    """Return ψ (...,), τ (..., 3), c (..., 3, 3), g (..., 3, 3) for log stretches (..., 3)."""
    flat = np.ascontiguousarray(logs.reshape(-1, 3))
    n = len(flat)
    energy, stress = np.empty(n), np.empty((n, 3))
    slope, gap = np.empty((n, 3, 3)), np.empty((n, 3, 3))
    principal_points(packed, flat, energy, stress, slope, gap)
    shape = logs.shape[:-1]
    return (
        energy.reshape(shape),
        stress.reshape(*shape, 3),
        slope.reshape(*shape, 3, 3),
        gap.reshape(*shape, 3, 3),
    )


class PrincipalLaw:
    """Energy, stress and tangent of a law whose packed parameters are those of a sum of powers."""

    def packed(self) -> Array:
        """Return the packed parameters ``[0, n, μ₁, α₁, 1/D₁, …]`` read by the kernels."""
        raise NotImplementedError

    def energy(self, F: ArrayLike) -> Array:
        """Return ψ (...,), MPa, for deformation gradients (..., 3, 3)."""
        stretches = np.linalg.svd(checked_gradient(F), compute_uv=False)
        return principal_response(self.packed(), np.log(stretches))[0]

    def first_piola_kirchhoff(self, F: ArrayLike) -> Array:
        """Return P = ∂ψ/∂F (..., 3, 3), MPa, for deformation gradients (..., 3, 3)."""
        n, stretches, N = np.linalg.svd(checked_gradient(F))
        stress = principal_response(self.packed(), np.log(stretches))[1]
        P: Array = (n * (stress / stretches)[..., None, :]) @ N
        return P

    def tangent(self, F: ArrayLike) -> Array:
        """Return ∂P/∂F (..., 3, 3, 3, 3), MPa, for deformation gradients (..., 3, 3)."""
        n, stretches, N = np.linalg.svd(checked_gradient(F))
        _, stress, slope, gap = principal_response(self.packed(), np.log(stretches))
        s_i, s_j = stretches[..., :, None], stretches[..., None, :]
        t_i, t_j = stress[..., :, None], stress[..., None, :]
        off = 1.0 - np.eye(3)
        stretching = (slope - np.eye(3) * t_i) / (s_i * s_j)
        turning = (gap * (s_i**2 + s_j**2) - (t_i + t_j)) / (2 * s_i * s_j) * off
        modes = np.zeros((*stretches.shape, 3, 3, 3))
        i = np.arange(3)
        modes[..., i[:, None], i[:, None], i[None], i[None]] = stretching
        modes[..., i[:, None], i[None], i[:, None], i[None]] += gap * off
        modes[..., i[:, None], i[None], i[None], i[:, None]] += turning
        A: Array = np.einsum(
            "...ijkl,...ai,...jb,...ck,...ld->...abcd", modes, n, N, n, N, optimize=True
        )
        return A

    def volumetric(self, J: ArrayLike) -> tuple[Array, Array]:
        """Return U and dU/dJ (...,), MPa, at volume ratios J (...,)."""
        packed, excess = self.packed(), np.asarray(J, float) - 1
        inverse = packed[4::3]
        orders = 2 * np.arange(1, len(inverse) + 1)
        energy = np.sum(inverse * excess[..., None] ** orders, axis=-1)
        slope = np.sum(inverse * orders * excess[..., None] ** (orders - 1), axis=-1)
        return energy, slope
