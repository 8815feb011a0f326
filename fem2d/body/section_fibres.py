"""How laws with fibres respond in a section, by direct tensor formulas."""

from __future__ import annotations

import math

from fem2d.body.kinematics import AXISYMMETRIC, NEWTON_LIMIT, STRESS, clamp, next_guess
from fem2d.materials.fibre_kernels import (
    FIRST_FAMILY,
    fibre_energy,
    fibres_traction,
    fibres_volume,
    quadratic_form,
)
from fem2d.materials.material import Array
from geometry2d.compiled import compiled


@compiled
def fibres_thickness(packed: Array, x: Array, determinant: float) -> tuple[float, bool]:
    """Return ln J for which P₃₃ = 0 at in-plane components of ``x``, and whether it was found."""
    v = 0.0
    low, high, previous = -math.inf, math.inf, math.inf
    for _ in range(NEWTON_LIMIT):
        residual, slope, size = fibres_traction(packed, x, math.exp(v) / determinant, v)
        if math.isnan(residual):
            return v, False
        if residual > 0.0:
            high = min(high, v)
        else:
            low = max(low, v)
        finite = math.isfinite(slope)
        slow = not finite or abs(residual) > 0.25 * previous
        previous = abs(residual)
        if finite and slope > 0.0 and abs(residual) <= 1e-9 * size:
            return v - residual / slope, True
        guess = next_guess(v, residual, slope, slow, low, high)
        if guess == v:
            return v, slope > 0.0
        v = guess
    return v, False


@compiled
def fibres_section(
    packed: Array,
    plane: int,
    x: Array,
    pressure: float,
    mixed: bool,
    order: int,
    psd: bool,
    P: Array,
    A: Array,
    scratch: Array,
) -> tuple[float, bool]:
    """Return ψ of a law with fibres; arguments as of ``principal_section``.

    With w the derivative of ψ by each form J^(−2/3) tr(F M Fᵀ), M_w = Σ w M, K_w = Σ w K,
    G = F^(−T) and c = J^(−2/3):  P = c (2 F M_w − ⅔ K_w G) + J U' G  and
    A = c (2 δ_ik M_w,JL − 4/3 (F M_w ⊗ G + G ⊗ F M_w) + 4/9 K_w G ⊗ G + ⅔ K_w G_iL G_kJ)
    + Σ W'' ∂Ê ⊗ ∂Ê + (J² U'' + J U') G ⊗ G − J U' G_iL G_kJ.
    """
    determinant = x[0] * x[3] - x[1] * x[2]
    if not determinant > 0.0:
        return math.inf, False
    f33 = x[4]
    if plane == STRESS:
        v, found = fibres_thickness(packed, x, determinant)
        if not found:
            return math.inf, False
        f33 = x[4] = math.exp(v) / determinant
    else:
        if not f33 > 0.0:
            return math.inf, False
        v = math.log(determinant * f33)
    families = int(packed[1])
    C10, k1, k2 = packed[2], packed[4], packed[5]
    shrink = math.exp(-2.0 * v / 3.0)
    squares = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3] + f33 * f33
    energy = C10 * (shrink * squares - 3.0)
    K, m11, m12, m22, m33 = C10 * squares, C10, 0.0, C10, C10
    for family in range(families):
        form, _ = quadratic_form(packed, family, x, f33)
        stored, first, _ = fibre_energy(k1, k2, shrink * form - 1.0)
        at = FIRST_FAMILY + 4 * family
        energy += stored
        K += first * form
        m11 += first * packed[at]
        m12 += first * packed[at + 1]
        m22 += first * packed[at + 2]
        m33 += first * packed[at + 3]
    U1, U2 = pressure, 0.0
    if not mixed:
        volumetric, U1, U2 = fibres_volume(packed, v)
        energy += volumetric
    if not math.isfinite(energy):
        return math.inf, False
    if order == 0:
        return energy, True

    J = math.exp(v)
    G, H, dE = scratch[0], scratch[1], scratch[2]
    G[0], G[1], G[2], G[3] = (
        x[3] / determinant,
        -x[2] / determinant,
        -x[1] / determinant,
        x[0] / determinant,
    )
    G[4] = 1.0 / f33
    fibre_pull(x, f33, m11, m12, m22, m33, H)
    for i in range(5):
        P[i] = shrink * (2.0 * H[i] - 2.0 / 3.0 * K * G[i]) + J * U1 * G[i]
    if plane == STRESS:
        P[4] = 0.0
    if order == 1:
        return energy, True

    both = 4.0 / 9.0 * shrink * K + J * U1 + J * J * U2
    crossed = 2.0 / 3.0 * shrink * K - J * U1
    for i in range(5):
        for j in range(5):
            A[i, j] = both * G[i] * G[j] - 4.0 / 3.0 * shrink * (H[i] * G[j] + G[i] * H[j])
    for i in range(2):  # entry (i, J) of F is number 2 i + J
        for a in range(2):
            for k in range(2):
                for b in range(2):
                    A[2 * i + a, 2 * k + b] += crossed * G[2 * i + b] * G[2 * k + a]
    A[4, 4] += crossed * G[4] * G[4] + 2.0 * shrink * m33
    for i in range(0, 4, 2):
        A[i, i] += 2.0 * shrink * m11
        A[i, i + 1] += 2.0 * shrink * m12
        A[i + 1, i] += 2.0 * shrink * m12
        A[i + 1, i + 1] += 2.0 * shrink * m22
    for family in range(families):
        form, _ = quadratic_form(packed, family, x, f33)
        _, _, second = fibre_energy(k1, k2, shrink * form - 1.0)
        if second == 0.0:
            continue
        at = FIRST_FAMILY + 4 * family
        fibre_pull(x, f33, packed[at], packed[at + 1], packed[at + 2], packed[at + 3], dE)
        for i in range(5):
            dE[i] = shrink * (2.0 * dE[i] - 2.0 / 3.0 * form * G[i])
        for i in range(5):
            for j in range(5):
                A[i, j] += second * dE[i] * dE[j]
    size = 5 if plane == AXISYMMETRIC else 4
    if plane == STRESS:
        for i in range(4):
            ratio = A[i, 4] / A[4, 4]
            for j in range(4):
                A[i, j] -= ratio * A[4, j]
    if psd:
        clamp(A, size, scratch)
    return energy, True


@compiled
def fibre_pull(
    x: Array, f33: float, m11: float, m12: float, m22: float, m33: float, H: Array
) -> None:
    """Fill ``H`` (5,) with the five components of F M."""
    H[0] = x[0] * m11 + x[1] * m12
    H[1] = x[0] * m12 + x[1] * m22
    H[2] = x[2] * m11 + x[3] * m12
    H[3] = x[2] * m12 + x[3] * m22
    H[4] = f33 * m33
