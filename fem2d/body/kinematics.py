"""Plane stress, plane strain and axisymmetry: what fills the third direction of a section.

A section's deformation gradient has five components, ``x = (F₁₁, F₁₂, F₂₁, F₂₂, F₃₃)``; the other
four are zero. F₃₃ is 1 in plane strain, r/R in axisymmetry, and in plane stress the root of P₃₃ =
0, which is then condensed out of the tangent. How the laws respond to them is in
:mod:`fem2d.body.section_principal` and :mod:`fem2d.body.section_fibres`; this module holds what
both need.
"""

from __future__ import annotations

import math
from enum import Enum

from fem2d.materials.material import Array
from geometry2d.compiled import compiled

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
def stretches_of(f11: float, f12: float, f21: float, f22: float) -> tuple[float, float, float]:
    """Return s₁ ≥ s₂ (s₂ from the determinant, without cancellation) and the determinant."""
    Q = 0.5 * math.sqrt((f11 + f22) ** 2 + (f21 - f12) ** 2)
    R = 0.5 * math.sqrt((f11 - f22) ** 2 + (f12 + f21) ** 2)
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
