"""Scalar laws of contact: pressure against gap, and Coulomb friction against slip.

Both are given with their derivatives and know nothing of meshes or outlines. Pressures and
tractions are in MPa per reference length of the surface, gaps and slips in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

from geometry2d.compiled import compiled
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting


class ContactLawError(DrinksimError):
    """A contact law was given a parameter that makes no sense."""


@dataclass(frozen=True)
class NormalLaw:
    """Penalty pressure that sets in smoothly.

    With the penetration ``π = −gap``: ``p = 0`` for ``π ≤ 0``, ``ε π²/(2δ)`` up to ``π = δ`` and
    ``ε (π − δ/2)`` beyond, so that pressure and its derivative are continuous. The penetration is
    the price: ``p/ε + δ/2``, which the solution reports.

    Parameters
    ----------
    stiffness_mpa_per_mm
        ε, MPa/mm.
    ramp_mm
        δ, mm: over this penetration the stiffness rises from nothing to ε.
    gap_offset_mm
        Penetration, mm, up to which a point between nodes bears nothing (`Surface.between_nodes`);
        from there on the law is the same.
    """

    stiffness_mpa_per_mm: float = setting(
        default=100.0,
        unit="MPa/mm",
        above=0.0,
        description="pressure per penetration beyond the ramp",
    )
    ramp_mm: float = setting(
        default=0.004,
        unit="mm",
        above=0.0,
        description="penetration over which the stiffness rises from zero",
    )
    gap_offset_mm: float = setting(
        default=0.0025,
        unit="mm",
        minimum=0.0,
        description="penetration up to which a point between nodes bears no pressure",
    )

    def __post_init__(self) -> None:
        if not self.stiffness_mpa_per_mm > 0 or not self.ramp_mm > 0:
            raise ContactLawError(
                f"normal contact needs a positive stiffness and ramp, not "
                f"{self.stiffness_mpa_per_mm} MPa/mm and {self.ramp_mm} mm"
            )
        if not self.gap_offset_mm >= 0:
            raise ContactLawError(
                f"normal contact allows {self.gap_offset_mm} mm between nodes: give 0 or more"
            )


@dataclass(frozen=True)
class FrictionLaw:
    """Coulomb friction, exact but for a small elastic slip while the surfaces stick.

    The tangential traction follows the slip with stiffness ``ε_t`` until it reaches ``μ p``; then
    it stays there (return mapping, Giannakopoulos 1989). The traction at the last committed
    instant is remembered, so a held load does not creep.

    Parameters
    ----------
    coefficient
        μ ≥ 0, the same for stick and slip.
    stiffness_mpa_per_mm
        ε_t, MPa/mm: the elastic slip is at most ``μ p/ε_t``.
    """

    coefficient: float = setting(
        default=1.0, minimum=0.0, maximum=10.0, description="friction coefficient"
    )
    stiffness_mpa_per_mm: float = setting(
        default=2.5,
        unit="MPa/mm",
        above=0.0,
        description="tangential traction per slip while a point sticks",
    )

    def __post_init__(self) -> None:
        if not 0 <= self.coefficient <= 10:
            raise ContactLawError(
                f"friction coefficient {self.coefficient} is outside 0…10: give the ratio of "
                "tangential to normal traction at slip"
            )
        if not self.stiffness_mpa_per_mm > 0:
            raise ContactLawError(
                f"tangential stiffness {self.stiffness_mpa_per_mm} MPa/mm must be positive"
            )


DEFAULT_NORMAL, DEFAULT_FRICTION = NormalLaw(), FrictionLaw()


@compiled
def pressure_of_gap(gap: float, stiffness: float, ramp: float) -> tuple[float, float, float]:
    """Return energy per length ψ(gap), pressure −ψ' and d pressure/d gap (see `NormalLaw`)."""
    penetration = -gap
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    if penetration < ramp:
        return (
            stiffness * penetration**3 / (6.0 * ramp),
            stiffness * penetration**2 / (2.0 * ramp),
            -stiffness * penetration / ramp,
        )
    beyond = penetration - 0.5 * ramp
    return (
        0.5 * stiffness * beyond * beyond + stiffness * ramp * ramp / 24.0,
        stiffness * beyond,
        -stiffness,
    )


@compiled
def traction_of_slip(
    before: float, slip: float, pressure: float, coefficient: float, stiffness: float
) -> tuple[float, float, float, bool]:
    """Return traction, d/d slip, d/d pressure and whether the point slips (see `FrictionLaw`).

    ``before`` is the traction at the last committed instant and ``slip`` the slip since then; the
    traction opposes the slip.
    """
    trial = before - stiffness * slip
    bound = coefficient * pressure
    if abs(trial) < bound:
        return trial, -stiffness, 0.0, False
    direction = 1.0 if trial > 0.0 else -1.0
    if trial == 0.0:
        direction = 0.0
    return direction * bound, 0.0, direction * coefficient, True
