"""Plane stress, plane strain and axisymmetry: what fills the third direction of a section.

A section's deformation gradient has five entries, ``x = (F₁₁, F₁₂, F₂₁, F₂₂, F₃₃)``; the other
four are zero. F₃₃ is 1 in plane strain, r/R in axisymmetry, and in plane stress the root of
P₃₃ = 0, which is then condensed out of the tangent.

Isotropic laws are evaluated without rotations. Written with complex numbers, a 2×2 matrix is the
sum of a conformal part q = (F₁₁ + F₂₂, F₂₁ − F₁₂)/2 and an anti-conformal part
r = (F₁₁ − F₂₂, F₁₂ + F₂₁)/2, and its signed singular values are s₁ = Q + R and s₂ = Q − R with
Q = |q| and R = |r|. So ψ is a function of Q and R alone; its gradient is (ψ_Q q/Q, ψ_R r/R) and
its second derivative has the blocks

    ψ_QQ along q, ψ_Q/Q across q (the twist);  ψ_RR along r, ψ_R/R across r (the flip);
    ψ_QR between the directions of q and r.

With P_i = ∂ψ/∂s_i and g = (τ₁ − τ₂)/(s₁² − s₂²), which the law gives exactly for equal stretches,

    ψ_Q/(2Q) = (P₁ + P₂)/(s₁ + s₂) = (τ₁ + τ₂ − g (s₁ − s₂)²) / (2 s₁ s₂),
    ψ_R/(2R) = (P₁ − P₂)/(s₁ − s₂) = (g (s₁ + s₂)² − τ₁ − τ₂) / (2 s₁ s₂).

These are the twist and flip eigenvalues of Smith, De Goes and Kim, "Analytic Eigensystems for
Isotropic Distortion Energies" (2019); clamping them and the eigenvalues of the stretch block makes
the tangent positive semi-definite.
"""

from __future__ import annotations

import math
from enum import Enum

from fem2d.compiled import compiled
from fem2d.materials.fibres import (
    FIRST_FAMILY,
    fibre_energy,
    fibres_traction,
    fibres_volume,
    quadratic_form,
)
from fem2d.materials.material import Array
from fem2d.materials.powers import powers_gap, powers_isochoric, powers_volume

STRESS, STRAIN, AXISYMMETRIC = 0, 1, 2
NEWTON_LIMIT = 80


class Plane(Enum):
    """What a section assumes about the third direction."""

    STRESS = STRESS
    STRAIN = STRAIN
    AXISYMMETRIC = AXISYMMETRIC


@compiled
def next_guess(
    v: float, residual: float, slope: float, slow: bool, low: float, high: float
) -> float:
    """Return the next guess for ln J.

    A Newton step, at most 1 long; where it leaves the bracket, the slope has the wrong sign, or
    Newton is ``slow`` (exponentials far out shrink by a factor e a step only), half the bracket.
    """
    inside = math.isfinite(low + high)
    if slow or slope <= 0.0:
        return 0.5 * (low + high) if inside else v - math.copysign(0.5, residual)
    guess = v + min(1.0, max(-1.0, -residual / slope))
    if guess <= low or guess >= high:
        guess = 0.5 * (low + high) if inside else v - math.copysign(0.5, residual)
    return guess


@compiled
def powers_thickness(row: Array, e1: float, e2: float) -> tuple[float, bool]:
    """Return ln J for which τ₃ = 0 at in-plane log stretches e₁, e₂, and whether it was found.

    Newton's method from J = 1, so the result depends on e₁ and e₂ alone. The unknown is ln J and
    not ln λ₃, so the pressure keeps its digits however incompressible the material is.
    """
    v = 0.0
    low, high, previous = -math.inf, math.inf, math.inf
    for _ in range(NEWTON_LIMIT):
        _, t1, t2, t3, h1, h2, h3 = powers_isochoric(
            row, e1 - v / 3.0, e2 - v / 3.0, 2.0 * v / 3.0 - e1 - e2
        )
        _, first, second = powers_volume(row, v)
        J = math.exp(v)
        residual = (2.0 * t3 - t1 - t2) / 3.0 + J * first
        slope = (4.0 * h3 + h1 + h2) / 9.0 + J * first + J * J * second
        if math.isnan(residual):
            return v, False
        if residual > 0.0:
            high = min(high, v)
        else:
            low = max(low, v)
        finite = math.isfinite(slope)
        slow = not finite or abs(residual) > 0.25 * previous
        previous = abs(residual)
        # A Newton step this small leaves an error of its square: rounding.
        if finite and slope > 0.0 and abs(residual) <= 1e-9 * (h1 + h2 + h3):
            return v - residual / slope, True
        guess = next_guess(v, residual, slope, slow, low, high)
        if guess == v:
            return v, slope > 0.0
        v = guess
    return v, False


@compiled
def stretches_of(f11: float, f12: float, f21: float, f22: float) -> tuple[float, float, float]:
    """Return s₁ ≥ s₂ (s₂ from the determinant, without cancellation) and the determinant."""
    Q = 0.5 * math.hypot(f11 + f22, f21 - f12)
    R = 0.5 * math.hypot(f11 - f22, f12 + f21)
    determinant = f11 * f22 - f12 * f21
    s1 = Q + R
    return s1, determinant / s1 if s1 > 0.0 else 0.0, determinant


@compiled
def clamp(matrix: Array, size: int, vectors: Array) -> None:
    """Replace the leading ``size`` block of a symmetric matrix by its positive semi-definite part.

    Jacobi rotations: exact to rounding, and no library call inside the kernel. ``vectors`` is
    scratch of at least the same size.
    """
    for i in range(size):
        for j in range(size):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(12):
        off = 0.0
        diagonal = 0.0
        for i in range(size):
            diagonal += matrix[i, i] * matrix[i, i]
            for j in range(i + 1, size):
                off += matrix[i, j] * matrix[i, j]
        if off <= 1e-30 * diagonal:
            break
        for i in range(size - 1):
            for j in range(i + 1, size):
                entry = matrix[i, j]
                if entry == 0.0:
                    continue
                theta = 0.5 * (matrix[j, j] - matrix[i, i]) / entry
                t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                for k in range(size):
                    a, b = matrix[k, i], matrix[k, j]
                    matrix[k, i], matrix[k, j] = c * a - s * b, s * a + c * b
                for k in range(size):
                    a, b = matrix[i, k], matrix[j, k]
                    matrix[i, k], matrix[j, k] = c * a - s * b, s * a + c * b
                for k in range(size):
                    a, b = vectors[k, i], vectors[k, j]
                    vectors[k, i], vectors[k, j] = c * a - s * b, s * a + c * b
    for i in range(size):
        vectors[size, i] = max(matrix[i, i], 0.0)
    for i in range(size):
        for j in range(size):
            total = 0.0
            for k in range(size):
                total += vectors[i, k] * vectors[size, k] * vectors[j, k]
            matrix[i, j] = total


@compiled
def powers_section(
    row: Array,
    plane: int,
    x: Array,
    pressure: float,
    mixed: bool,
    order: int,
    projected: bool,
    P: Array,
    A: Array,
    block: Array,
    scratch: Array,
) -> tuple[float, bool]:
    """Return ψ of a sum of powers at section entries ``x`` (5,), and whether x is admissible.

    ``order`` 0 computes the energy only, 1 also the stress ``P`` (5,), 2 also the tangent ``A``
    (5, 5), clamped to positive semi-definite if ``projected``. In plane stress entry 5 is ignored
    and condensed out. If ``mixed``, the volumetric energy is left to the caller (it belongs to the
    element, not to the point) and ``pressure`` is its derivative with respect to J. ``block``
    (3, 3) and ``scratch`` (6, 6) are work space.
    """
    s1, s2, determinant = stretches_of(x[0], x[1], x[2], x[3])
    if not (determinant > 0.0 and s2 > 0.0):
        return math.inf, False
    e1, e2 = math.log(s1), math.log(s2)
    s3, e3 = 1.0, 0.0
    if plane == 0:
        v, found = powers_thickness(row, e1, e2)
        if not found:
            return math.inf, False
        e3 = v - e1 - e2
    else:
        s3 = x[4]
        if not s3 > 0.0:
            return math.inf, False
        e3 = math.log(s3)
        v = e1 + e2 + e3
    third = v / 3.0
    energy, t1, t2, t3, h1, h2, h3 = powers_isochoric(row, e1 - third, e2 - third, e3 - third)
    first, second = pressure, 0.0
    if not mixed:
        volumetric, first, second = powers_volume(row, v)
        energy += volumetric
    if not math.isfinite(energy):
        return math.inf, False
    if order == 0:
        return energy, True

    J = math.exp(v)
    mean = (t1 + t2 + t3) / 3.0 - J * first
    tau1, tau2, tau3 = t1 - mean, t2 - mean, t3 - mean
    if plane == 0:
        tau3 = 0.0
    gap = powers_gap(row, e1, e2, v)
    twist = 0.5 * (tau1 + tau2 - gap * (s1 - s2) ** 2) / (s1 * s2)
    flip = 0.5 * (gap * (s1 + s2) ** 2 - tau1 - tau2) / (s1 * s2)
    # ψ_Q q/Q = 2 twist q with q = half of the sums, likewise for r; back to the entries of F.
    qx, qy = twist * (x[0] + x[3]), twist * (x[2] - x[1])
    rx, ry = flip * (x[0] - x[3]), flip * (x[1] + x[2])
    P[0] = 0.5 * (qx + rx)
    P[1] = 0.5 * (ry - qy)
    P[2] = 0.5 * (ry + qy)
    P[3] = 0.5 * (qx - rx)
    P[4] = 0.0 if plane == 0 else tau3 / s3
    if order == 1:
        return energy, True

    shared = (h1 + h2 + h3) / 9.0 + J * first + J * J * second
    c11 = shared + h1 / 3.0
    c22 = shared + h2 / 3.0
    c33 = shared + h3 / 3.0
    c12 = shared - (h1 + h2) / 3.0
    c13 = shared - (h1 + h3) / 3.0
    c23 = shared - (h2 + h3) / 3.0
    size = 3 if plane == 2 else 2
    if plane == 0:
        c11 -= c13 * c13 / c33
        c22 -= c23 * c23 / c33
        c12 -= c13 * c23 / c33
    block[0, 0] = (c11 - tau1) / (s1 * s1)
    block[1, 1] = (c22 - tau2) / (s2 * s2)
    block[0, 1] = block[1, 0] = c12 / (s1 * s2)
    block[0, 2] = block[2, 0] = c13 / (s1 * s3)
    block[1, 2] = block[2, 1] = c23 / (s2 * s3)
    block[2, 2] = (c33 - tau3) / (s3 * s3)
    if projected:
        clamp(block, size, scratch)
        twist, flip = max(twist, 0.0), max(flip, 0.0)
    section_tangent(x, block, twist, flip, size == 3, A)
    return energy, True


@compiled
def section_tangent(
    x: Array, block: Array, twist: float, flip: float, third: bool, A: Array
) -> None:
    """Fill ``A`` (5, 5) from second derivatives with respect to the stretches, twist and flip."""
    qx, qy = 0.5 * (x[0] + x[3]), 0.5 * (x[2] - x[1])
    rx, ry = 0.5 * (x[0] - x[3]), 0.5 * (x[1] + x[2])
    Q, R = math.hypot(qx, qy), math.hypot(rx, ry)
    qx, qy = qx / Q, qy / Q
    if R > 0.0:
        rx, ry = rx / R, ry / R
    else:  # equal stretches: every direction of r is as good, ψ_RR = ψ_R/R and ψ_QR = 0
        rx, ry = 1.0, 0.0
    QQ = block[0, 0] + 2.0 * block[0, 1] + block[1, 1]
    RR = block[0, 0] - 2.0 * block[0, 1] + block[1, 1]
    QR = block[0, 0] - block[1, 1]
    across_q, across_r = 2.0 * twist, 2.0 * flip
    a11, a12, a22 = (
        QQ * qx * qx + across_q * qy * qy,
        (QQ - across_q) * qx * qy,
        QQ * qy * qy + across_q * qx * qx,
    )
    b11, b12, b22 = (
        RR * rx * rx + across_r * ry * ry,
        (RR - across_r) * rx * ry,
        RR * ry * ry + across_r * rx * rx,
    )
    c11, c12, c21, c22 = QR * qx * rx, QR * qx * ry, QR * qy * rx, QR * qy * ry
    A[0, 0] = 0.25 * (a11 + 2.0 * c11 + b11)
    A[3, 3] = 0.25 * (a11 - 2.0 * c11 + b11)
    A[0, 3] = A[3, 0] = 0.25 * (a11 - b11)
    A[2, 2] = 0.25 * (a22 + 2.0 * c22 + b22)
    A[1, 1] = 0.25 * (a22 - 2.0 * c22 + b22)
    A[1, 2] = A[2, 1] = 0.25 * (b22 - a22)
    A[0, 2] = A[2, 0] = 0.25 * (a12 + c12 + c21 + b12)
    A[0, 1] = A[1, 0] = 0.25 * (c12 - a12 - c21 + b12)
    A[3, 2] = A[2, 3] = 0.25 * (a12 + c12 - c21 - b12)
    A[3, 1] = A[1, 3] = 0.25 * (c12 - a12 + c21 - b12)
    if third:
        q3, r3 = block[0, 2] + block[1, 2], block[0, 2] - block[1, 2]
        A[0, 4] = A[4, 0] = 0.5 * (q3 * qx + r3 * rx)
        A[3, 4] = A[4, 3] = 0.5 * (q3 * qx - r3 * rx)
        A[2, 4] = A[4, 2] = 0.5 * (q3 * qy + r3 * ry)
        A[1, 4] = A[4, 1] = 0.5 * (r3 * ry - q3 * qy)
        A[4, 4] = block[2, 2]


@compiled
def fibres_thickness(row: Array, x: Array, determinant: float) -> tuple[float, bool]:
    """Return ln J for which P₃₃ = 0 at in-plane entries of ``x``, and whether it was found."""
    v = 0.0
    low, high, previous = -math.inf, math.inf, math.inf
    for _ in range(NEWTON_LIMIT):
        residual, slope, size = fibres_traction(row, x, math.exp(v) / determinant, v)
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
    row: Array,
    plane: int,
    x: Array,
    pressure: float,
    mixed: bool,
    order: int,
    projected: bool,
    P: Array,
    A: Array,
    scratch: Array,
) -> tuple[float, bool]:
    """Return ψ of a law with fibres; arguments as of :func:`powers_section`.

    With w the derivative of ψ by each form J^(−2/3) tr(F M Fᵀ), M_w = Σ w M, K_w = Σ w K,
    G = F^(−T) and c = J^(−2/3):  P = c (2 F M_w − ⅔ K_w G) + J U' G  and
    A = c (2 δ_ik M_w,JL − 4/3 (F M_w ⊗ G + G ⊗ F M_w) + 4/9 K_w G ⊗ G + ⅔ K_w G_iL G_kJ)
    + Σ W'' ∂Ê ⊗ ∂Ê + (J² U'' + J U') G ⊗ G − J U' G_iL G_kJ.
    """
    determinant = x[0] * x[3] - x[1] * x[2]
    if not determinant > 0.0:
        return math.inf, False
    f33 = x[4]
    if plane == 0:
        v, found = fibres_thickness(row, x, determinant)
        if not found:
            return math.inf, False
        f33 = math.exp(v) / determinant
    else:
        if not f33 > 0.0:
            return math.inf, False
        v = math.log(determinant * f33)
    families = int(row[1])
    C10, k1, k2 = row[2], row[4], row[5]
    shrink = math.exp(-2.0 * v / 3.0)
    squares = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3] + f33 * f33
    energy = C10 * (shrink * squares - 3.0)
    K, m11, m12, m22, m33 = C10 * squares, C10, 0.0, C10, C10
    for family in range(families):
        form, _ = quadratic_form(row, family, x, f33)
        stored, first, _ = fibre_energy(k1, k2, shrink * form - 1.0)
        at = FIRST_FAMILY + 4 * family
        energy += stored
        K += first * form
        m11 += first * row[at]
        m12 += first * row[at + 1]
        m22 += first * row[at + 2]
        m33 += first * row[at + 3]
    U1, U2 = pressure, 0.0
    if not mixed:
        volumetric, U1, U2 = fibres_volume(row, v)
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
    if plane == 0:
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
        form, _ = quadratic_form(row, family, x, f33)
        _, _, second = fibre_energy(k1, k2, shrink * form - 1.0)
        if second == 0.0:
            continue
        at = FIRST_FAMILY + 4 * family
        fibre_pull(x, f33, row[at], row[at + 1], row[at + 2], row[at + 3], dE)
        for i in range(5):
            dE[i] = shrink * (2.0 * dE[i] - 2.0 / 3.0 * form * G[i])
        for i in range(5):
            for j in range(5):
                A[i, j] += second * dE[i] * dE[j]
    size = 5 if plane == 2 else 4
    if plane == 0:
        for i in range(4):
            ratio = A[i, 4] / A[4, 4]
            for j in range(4):
                A[i, j] -= ratio * A[4, j]
    if projected:
        clamp(A, size, scratch)
    return energy, True


@compiled
def fibre_pull(
    x: Array, f33: float, m11: float, m12: float, m22: float, m33: float, H: Array
) -> None:
    """Fill ``H`` (5,) with the section entries of F M."""
    H[0] = x[0] * m11 + x[1] * m12
    H[1] = x[0] * m12 + x[1] * m22
    H[2] = x[2] * m11 + x[3] * m12
    H[3] = x[2] * m12 + x[3] * m22
    H[4] = f33 * m33
