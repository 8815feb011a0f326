"""How isotropic laws respond in a section: stress and tangent without rotations.

Written with complex numbers, a 2×2 matrix is the sum of a conformal part
q = (F₁₁ + F₂₂, F₂₁ − F₁₂)/2 and an anti-conformal part r = (F₁₁ − F₂₂, F₁₂ + F₂₁)/2, and its
signed singular values are s₁ = Q + R and s₂ = Q − R with Q = |q| and R = |r|. So ψ is a function of
Q and R alone; its gradient is (ψ_Q q/Q, ψ_R r/R) and its second derivative has the blocks

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

from fem2d.body.kinematics import (
    AXISYMMETRIC,
    NEWTON_LIMIT,
    STRESS,
    clamp,
    next_guess,
    stretches_of,
)
from fem2d.materials.material import Array
from fem2d.materials.principal_kernels import (
    principal_difference,
    principal_in_plane,
    principal_isochoric,
    principal_volume,
)
from geometry2d.compiled import compiled


@compiled
def principal_thickness(packed: Array, principal: Array) -> tuple[float, bool]:
    """Return ln J for which τ₃ = 0, and whether it was found; see ``principal_in_plane``.

    Halley's method from J = 1, so the result depends on e₁ and e₂ alone. The unknown is ln J and
    not ln λ₃, so the pressure keeps its digits however incompressible the material is. The third
    derivative of U is left out: one term of U has none.
    """
    terms = int(packed[1])
    v = 0.0
    low, high, previous = -math.inf, math.inf, math.inf
    for _ in range(NEWTON_LIMIT):
        residual = slope = curvature = size = 0.0
        for k in range(terms):
            alpha = packed[3 + 3 * k]
            scale = 2.0 * packed[2 + 3 * k] / alpha
            first, second = 1.0 + principal[k, 0], 1.0 + principal[k, 1]
            shrink = 1.0 if v == 0.0 else math.exp(-alpha * v / 3.0)
            across = scale / (first * second * shrink * shrink)
            inside = scale * (first + second) * shrink
            residual += (2.0 * across - inside) / 3.0
            slope += alpha * (4.0 * across + inside) / 9.0
            curvature += alpha * alpha * (8.0 * across - inside) / 27.0
            size += alpha * (across + inside)
        w = 0.0 if v == 0.0 else math.expm1(v)
        J = 1.0 + w
        _, first, second = principal_volume(packed, w)
        residual += J * first
        slope += J * first + J * J * second
        curvature += J * first + 3.0 * J * J * second
        if math.isnan(residual):
            return v, False
        if residual > 0.0:
            high = min(high, v)
        else:
            low = max(low, v)
        finite = math.isfinite(slope)
        slow = not finite or abs(residual) > 0.25 * previous
        previous = abs(residual)
        bent = slope - 0.5 * curvature * residual / slope
        # Halley's step from here leaves an error of its cube: rounding.
        if finite and slope > 0.0 and abs(residual) <= 1e-6 * size:
            return v - residual / bent, True
        guess = next_guess(v, residual, bent if bent > 0.5 * slope else slope, slow, low, high)
        if guess == v:
            return v, slope > 0.0
        v = guess
    return v, False


@compiled
def principal_section(
    packed: Array,
    plane: int,
    x: Array,
    pressure: float,
    mixed: bool,
    order: int,
    psd: bool,
    P: Array,
    A: Array,
    block: Array,
    scratch: Array,
) -> tuple[float, bool]:
    """Return ψ of a sum of powers at components ``x`` (5,), and whether x is admissible.

    ``order`` 0 computes the energy only, 1 also the stress ``P`` (5,), 2 also the tangent ``A``
    (5, 5), clamped to positive semi-definite if ``psd``. In plane stress component 5 of ``x`` is
    found and filled, and condensed out of ``A``. If ``mixed``, the volumetric energy is left to the
    caller (it belongs to the element, not to the point) and ``pressure`` is its derivative with
    respect to J. ``block`` (3, 3) and ``scratch`` (k, 6) are work space, with at least one line for
    each term and 6 in all.
    """
    s1, s2, determinant = stretches_of(x[0], x[1], x[2], x[3])
    if not (determinant > 0.0 and s2 > 0.0):
        return math.inf, False
    e1, e2 = math.log(s1), math.log(s2)
    s3, e3 = 1.0, 0.0
    principal_in_plane(packed, e1, e2, scratch)
    if plane == STRESS:
        v, found = principal_thickness(packed, scratch)
        if not found:
            return math.inf, False
        e3 = v - e1 - e2
        x[4] = math.exp(e3)
    else:
        s3 = x[4]
        if not s3 > 0.0:
            return math.inf, False
        e3 = math.log(s3)
        v = e1 + e2 + e3
    energy, t1, t2, t3, h1, h2, h3 = principal_isochoric(packed, e3, v, scratch)
    w = math.expm1(v)
    J = 1.0 + w
    first, second = pressure, 0.0
    if not mixed:
        volumetric, first, second = principal_volume(packed, w)
        energy += volumetric
    if not math.isfinite(energy):
        return math.inf, False
    if order == 0:
        return energy, True

    mean = (t1 + t2 + t3) / 3.0 - J * first
    tau1, tau2, tau3 = t1 - mean, t2 - mean, t3 - mean
    if plane == STRESS:
        tau3 = 0.0
    gap = principal_difference(packed, e1 - e2, s2, scratch)
    twist = 0.5 * (tau1 + tau2 - gap * (s1 - s2) ** 2) / (s1 * s2)
    flip = 0.5 * (gap * (s1 + s2) ** 2 - tau1 - tau2) / (s1 * s2)
    # ψ_Q q/Q = 2 twist q with q = half of the sums, likewise for r; back to the components of F.
    qx, qy = twist * (x[0] + x[3]), twist * (x[2] - x[1])
    rx, ry = flip * (x[0] - x[3]), flip * (x[1] + x[2])
    P[0] = 0.5 * (qx + rx)
    P[1] = 0.5 * (ry - qy)
    P[2] = 0.5 * (ry + qy)
    P[3] = 0.5 * (qx - rx)
    P[4] = 0.0 if plane == STRESS else tau3 / s3
    if order == 1:
        return energy, True

    shared = (h1 + h2 + h3) / 9.0 + J * first + J * J * second
    c11 = shared + h1 / 3.0
    c22 = shared + h2 / 3.0
    c33 = shared + h3 / 3.0
    c12 = shared - (h1 + h2) / 3.0
    c13 = shared - (h1 + h3) / 3.0
    c23 = shared - (h2 + h3) / 3.0
    size = 3 if plane == AXISYMMETRIC else 2
    if plane == STRESS:
        c11 -= c13 * c13 / c33
        c22 -= c23 * c23 / c33
        c12 -= c13 * c23 / c33
    block[0, 0] = (c11 - tau1) / (s1 * s1)
    block[1, 1] = (c22 - tau2) / (s2 * s2)
    block[0, 1] = block[1, 0] = c12 / (s1 * s2)
    block[0, 2] = block[2, 0] = c13 / (s1 * s3)
    block[1, 2] = block[2, 1] = c23 / (s2 * s3)
    block[2, 2] = (c33 - tau3) / (s3 * s3)
    if psd:
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
