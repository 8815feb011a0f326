"""Tables of how a sip is prepared: what "auto" stands for is searched, and a period is chosen."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from geometry2d.foundation.settings import setting
from geometry2d.foundation.toml import shown
from scenarios.settings.tables import SettingError


@dataclass(frozen=True)
class Period:
    """Which part of a motion is replayed."""

    near_mm: float = setting(
        default=2.0,
        unit="mm",
        above=0.0,
        description="distance from a lip at which the neck's approach begins, and its way off ends",
    )
    after_release_s: float = setting(
        default=0.2,
        unit="s",
        minimum=0.0,
        description="time for which the lips are followed after the neck has gone",
    )


@dataclass(frozen=True)
class PullSearch:
    """How the traction and the direction of a pseudo-muscle are searched."""

    most_kpa: float = setting(
        default=6.0,
        unit="kPa",
        above=0.0,
        maximum=50.0,
        description="largest traction that is tried",
        source="three times what an ordinary sip needs",
    )
    directions_deg: tuple[float, ...] = setting(
        default=(0.0, 40.0, 80.0, 120.0),
        unit="deg",
        minimum=-180.0,
        maximum=180.0,
        description="directions tried first, ascending; then between the best one's neighbours",
    )
    direction_tolerance_deg: float = setting(
        default=4.0,
        unit="deg",
        above=0.0,
        description="at which the search for the direction ends",
        source="changes the needed traction by less than 1 %",
    )
    instants: int = setting(
        default=100,
        minimum=2,
        maximum=10_000,
        description="instants of each interval in which the lip is held, at which the clearance "
        "from the neck is measured",
    )
    reach_mm: float = setting(
        default=10.0,
        unit="mm",
        above=0.0,
        description="skin that stays farther from the neck while the lip is at rest is not watched",
    )
    rising_step: float = setting(
        default=0.1,
        above=0.0,
        maximum=1.0,
        description="step of the rising traction, over the largest one",
    )
    clearance_tolerance_mm: float = setting(
        default=0.005,
        unit="mm",
        above=0.0,
        description="excess of the clearance at which a traction counts as the smallest",
    )
    refinements: int = setting(
        default=12,
        minimum=1,
        maximum=100,
        description="most tractions tried between one that is not enough and one that is",
    )

    def __post_init__(self) -> None:
        directions = self.directions_deg
        if not directions or any(b <= a for a, b in itertools.pairwise(directions)):
            raise SettingError(
                f"numerics.pull_search.directions_deg = {shown(directions)}: give one direction or "
                "more, ascending"
            )


@dataclass(frozen=True)
class ActivationSearch:
    """How the least activation that explains what was seen of a lip is searched."""

    most: float = setting(
        default=1.0,
        above=0.0,
        maximum=1.0,
        description="largest activation that is tried",
        source="all that a muscle can",
    )
    rising_steps: int = setting(
        default=10,
        minimum=1,
        maximum=1000,
        description="steps of the rising activation, each longer than the one before",
    )
    tolerance: float = setting(
        default=0.002,
        above=0.0,
        maximum=0.1,
        description="between an activation that is not enough and the one that is taken",
    )
    instants: int = setting(
        default=100,
        minimum=2,
        maximum=10_000,
        description="instants of each interval in which a lip is held clear of the neck",
    )
    reach_mm: float = setting(
        default=10.0,
        unit="mm",
        above=0.0,
        description="skin that stays farther from the neck while the lip is at rest is not watched",
    )


@dataclass(frozen=True)
class ShiftSearch:
    """How the gap to the skin is measured at first contacts, and the smallest shift searched."""

    skin_spacing_mm: float = setting(
        default=0.4, unit="mm", above=0.0, description="spacing of the skin's points"
    )
    reach_mm: float = setting(
        default=24.0,
        unit="mm",
        above=0.0,
        description="largest distance of a first contact from the lip's margin, along the skin",
    )
    look_back_s: float = setting(
        default=1.0,
        unit="s",
        above=0.0,
        description="time before its first contact in which a lip must not touch",
    )
    instants: int = setting(
        default=8, minimum=1, maximum=1000, description="instants of that time that are looked at"
    )
    thinning: int = setting(
        default=3, minimum=1, maximum=100, description="of so many points of skin one is looked at"
    )
    difference: float = setting(
        default=1e-3,
        above=0.0,
        description="step of the differences that the fit follows, mm or degrees",
    )
    uncertainty_difference: float = setting(
        default=0.2,
        above=0.0,
        description="step of the differences that give standard deviations, mm or degrees",
    )
    weakest: float = setting(
        default=1e-2,
        above=0.0,
        description="smallest weight of the shift's own size, per mm or degree",
    )
    same: float = setting(
        default=0.1,
        above=0.0,
        description="fits from two starts that differ by less, mm or degrees, are one",
    )
    fineness: float = setting(
        default=0.05,
        above=0.0,
        description="relative width at which the search for the weight ends",
    )
