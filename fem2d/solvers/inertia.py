"""Implicit time integration with controlled numerical damping.

Equilibrium is written at the end of a step, ``M ((1 − α) a₁ + α a₀) + C v₁ + f(u₁) = 0`` (Wood,
Bossak and Zienkiewicz 1980), with Newmark's relations between displacement, velocity and
acceleration. One number steers the damping: the spectral radius ``ρ`` at infinite frequency, 1 for
none, 0 for the most; ``α = (ρ − 1)/(ρ + 1)``, ``γ = ½ − α``, ``β = (1 − α)²/4`` keep second-order
accuracy and unconditional stability; without mass and with ρ = 0 they are the two-step backward
differences of ``C v + f(u) = 0``. Contact forces are those at the end of the step, so that no force
acts across an open gap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.solvers.state import State
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting

Array = NDArray[np.float64]


class InertiaError(DrinksimError):
    """Parameters of the time integration make no sense."""


@dataclass(frozen=True)
class Inertia:
    """Density and damping of the implicit dynamics; zero density is quasi-statics.

    Parameters
    ----------
    density_tonne_per_mm3
        Density that resists acceleration. Water is 1e-9; a larger value regularises snap-back and
        is harmless as long as the kinetic energy, which every result reports, stays small.
    spectral_radius
        ρ in [0, 1].
    relaxation_s
        τ, s, of the force ``τ K₀ v`` with the stiffness ``K₀`` of the undeformed body (Rayleigh's
        stiffness-proportional damping). Inertia limits fast motions of large regions, damping those
        of small ones: a crease that closes or a point that starts to slip takes a time of order τ.
        Motions much slower than τ are not affected.
    """

    density_tonne_per_mm3: float = setting(
        default=1e-9, unit="t/mm³", minimum=0.0, description="density; water's is 1e-9"
    )
    spectral_radius: float = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="at infinite frequency: 0 for the most numerical damping, 1 for none",
    )
    relaxation_s: float = setting(
        default=0.0,
        unit="s",
        minimum=0.0,
        description="relaxation time of the stiffness-proportional damping",
    )

    def __post_init__(self) -> None:
        if self.density_tonne_per_mm3 < 0:
            raise InertiaError(f"density {self.density_tonne_per_mm3} t/mm³ must not be negative")
        if self.relaxation_s < 0:
            raise InertiaError(f"relaxation time {self.relaxation_s} s must not be negative")
        if not 0 <= self.spectral_radius <= 1:
            raise InertiaError(f"spectral radius {self.spectral_radius} is outside 0…1")

    @property
    def alpha(self) -> float:
        """Bossak's α, between −1 and 0."""
        return (self.spectral_radius - 1) / (self.spectral_radius + 1)

    @property
    def beta(self) -> float:
        """Newmark's β."""
        return 0.25 * (1 - self.alpha) ** 2

    @property
    def gamma(self) -> float:
        """Newmark's γ."""
        return 0.5 - self.alpha

    @property
    def is_dynamic(self) -> bool:
        """Whether there is mass or damping; without, every instant is in static equilibrium."""
        return self.density_tonne_per_mm3 > 0 or self.relaxation_s > 0

    def pull(self, state: State, duration_s: float) -> tuple[float, Array]:
        """Return ``(c, û)``: the inertial force at the end of the step is ``M c (u − û)``."""
        scale = self._by_acceleration(duration_s)
        return scale, self._coasted(state, duration_s) - self.alpha / scale * state.acceleration

    def resistance(self, mass: Array, viscosity: Array, duration_s: float) -> Array:
        """Return the derivative of inertial and viscous force by the displacement, N/mm.

        Entry by entry of the matrices ``mass``, tonnes, and ``viscosity``, N s/mm.
        """
        by_velocity = self.gamma / (self.beta * duration_s)
        resistance: Array = self._by_acceleration(duration_s) * mass + by_velocity * viscosity
        return resistance

    def rates(self, state: State, displacement: Array, duration_s: float) -> tuple[Array, Array]:
        """Return velocity and acceleration (n, 2) at the end of a step to ``displacement``."""
        coasted = self._coasted(state, duration_s)
        acceleration = (displacement - coasted) / (self.beta * duration_s**2)
        velocity = state.velocity + duration_s * (
            (1 - self.gamma) * state.acceleration + self.gamma * acceleration
        )
        return velocity, acceleration

    def _by_acceleration(self, duration_s: float) -> float:
        """Return the derivative of the inertial force by ``M`` times the displacement, 1/s²."""
        return (1 - self.alpha) / (self.beta * duration_s**2)

    def _coasted(self, state: State, duration_s: float) -> Array:
        """Return where Newmark's relation leads (n, 2) with no acceleration at the end, mm."""
        coasted: Array = (
            state.displacement
            + duration_s * state.velocity
            + duration_s**2 * (0.5 - self.beta) * state.acceleration
        )
        return coasted


QUASI_STATIC = Inertia(density_tonne_per_mm3=0.0, spectral_radius=0.0, relaxation_s=0.0)
"""No mass and no damping: every instant is in static equilibrium."""
