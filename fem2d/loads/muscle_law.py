"""The force–length law of a muscle fibre: energy, tension and stiffness at one stretch.

With the activation ``α`` (0…1), the largest active stress ``σ₀`` and the fibre's stretch ``λ``, the
nominal tension (force per reference area of fibres) is

    T₀ = σ₀ [ α f(λ) + P₁ (exp(P₂ (λ − 1)) − 1) ]

    f = 1 − 4 (1 − λ)²             |λ − 1| ≤ 0.4
    f = (64/9) (0.625 − |λ − 1|)²  0.4 < |λ − 1| ≤ 0.625
    f = 0                          beyond

as Blemker, Pinsky and Delp (J. Biomech. 38, 2005) have it, with one change: their tails
``9 (0.6 − |λ − 1|)²`` meet the parabola in value but not in slope (3.6 against 3.2). The tails here
meet it in both, so that tension *and* stiffness are continuous for Newton's method, and end at
0.375 and 1.625 instead of 0.4 and 1.6. The passive term acts only in fibres longer than at rest and
goes on as a straight line beyond ``λ*``; at λ = 1 its stiffness jumps by σ₀ P₁ P₂, as theirs does.

λ is the whole stretch, not its deviatoric part: in a law that splits volume from shape, an active
term of the deviatoric stretch is not physical (Weickenmeier, Itskov, Mazza and Jabareen 2014,
10.1002/cnm.2618).
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem2d.loads.amplitude import LoadError
from geometry2d.compiled import compiled
from geometry2d.foundation.settings import check_ranges, setting

Array = NDArray[np.float64]

PARABOLA_TO = 0.4
TAIL_TO = 0.625
TAIL = 64.0 / 9.0
PARABOLA_AREA = PARABOLA_TO - 4.0 / 3.0 * PARABOLA_TO**3
"""∫ f over the half of the parabola."""


@compiled
def active_factor(stretch: float) -> tuple[float, float, float]:
    """Return ∫₁^λ f, f and df/dλ of the active force–length curve."""
    strain = stretch - 1.0
    size, sign = abs(strain), math.copysign(1.0, strain)
    if size <= PARABOLA_TO:
        return strain - 4.0 / 3.0 * strain**3, 1.0 - 4.0 * strain * strain, -8.0 * strain
    left = max(TAIL_TO - size, 0.0)
    area = PARABOLA_AREA + TAIL / 3.0 * ((TAIL_TO - PARABOLA_TO) ** 3 - left**3)
    return sign * area, TAIL * left * left, -2.0 * sign * TAIL * left


@compiled
def passive_factor(
    share: float, exponent: float, until: float, stretch: float
) -> tuple[float, float, float]:
    """Return ∫₁^λ g, g and dg/dλ of g = P₁ (exp(P₂ (λ − 1)) − 1), straight beyond ``until``."""
    strain = stretch - 1.0
    if strain <= 0.0 or share == 0.0:
        return 0.0, 0.0, 0.0
    inside = min(strain, until - 1.0)
    growth = share * math.expm1(exponent * inside)
    slope = exponent * (growth + share)
    beyond = strain - inside
    energy = growth / exponent - share * inside + growth * beyond + 0.5 * slope * beyond * beyond
    return energy, growth + slope * beyond, slope


@compiled
def fibre_response(packed: Array, activation: float, stretch: float) -> tuple[float, float, float]:
    """Return w, T₀ = w′ and T₀′, MPa, of the fibre that ``packed`` describes."""
    active = active_factor(stretch)
    passive = passive_factor(packed[1], packed[2], packed[3], stretch)
    size = packed[0]
    return (
        size * (activation * active[0] + passive[0]),
        size * (activation * active[1] + passive[1]),
        size * (activation * active[2] + passive[2]),
    )


@compiled
def _responses(packed: Array, activation: float, stretch: Array, out: Array) -> None:
    for i in range(stretch.size):
        out[0, i], out[1, i], out[2, i] = fibre_response(packed, activation, stretch[i])


@dataclass(frozen=True)
class MuscleFibre:
    """A muscle fibre; it acts beside the tissue around it, whose stiffness it does not replace.

    Parameters
    ----------
    max_stress_mpa
        Largest active stress σ₀ for each reference area of fibres, MPa.
    passive_share
        P₁; 0 leaves passive stiffness to the tissue, which was measured with its muscles in it.
    passive_exponent
        P₂.
    passive_until
        Stretch λ* beyond which the passive tension grows as a straight line.

    Raises
    ------
    LoadError
        If a value is not finite or out of its range.

    >>> energy, tension, stiffness = MuscleFibre(0.1).response([1.0, 0.8], 0.5)
    >>> (tension * 1e3).round(3).tolist()
    [50.0, 42.0]
    """

    max_stress_mpa: float = setting(
        default=0.1,
        unit="MPa",
        minimum=0.0,
        description="largest active stress of the fibres",
        source="Stavness 2013 (ArtiSynth's face); 0.1 to 0.3 in skeletal muscle",
    )
    passive_share: float = setting(
        default=0.0,
        minimum=0.0,
        description="passive tension, as a share of the largest active stress",
        source="0.05 in Blemker 2005; 0 where the tissue's stiffness contains it",
    )
    passive_exponent: float = setting(
        default=6.6,
        above=0.0,
        description="growth of the passive tension with the stretch",
        source="Blemker 2005",
    )
    passive_until: float = setting(
        default=1.4,
        minimum=1.0,
        description="stretch beyond which the passive tension is a straight line",
        source="Blemker 2005",
    )

    def __post_init__(self) -> None:
        check_ranges(self, LoadError)

    def packed(self) -> Array:
        """Return the law as the row of numbers that kernels read."""
        return np.array(dataclasses.astuple(self))

    def response(self, stretch: ArrayLike, activation: float) -> tuple[Array, Array, Array]:
        """Return energy density, nominal tension and its derivative, MPa, at stretches (...,).

        The energy is that of the tension at this activation, 0 at a stretch of 1. Activation is
        0…1; what it does is linear in it.
        """
        values = np.asarray(stretch, float)
        out = np.empty((3, values.size))
        _responses(self.packed(), float(activation), np.ascontiguousarray(values).ravel(), out)
        energy, tension, slope = out.reshape(3, *values.shape)
        return energy, tension, slope
