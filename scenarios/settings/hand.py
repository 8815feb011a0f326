"""The table of the hand: how the package is carried."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from geometry2d.foundation.settings import setting
from scenarios.settings.tables import SettingError

ARM = "arm's endpoint stiffness in posture, 100 to 500 N/m (Mussa-Ivaldi, Hogan and Bizzi 1985)"


@dataclass(frozen=True)
class HandSettings:
    """How the package is carried, and over which width of lip the section acts.

    ``recorded`` follows the film, whatever it takes. ``same`` yields about the film like the arm
    that held the filmed package: it bears what that bore, and gives way to more. ``force`` lets
    each lip bear what it bore in the reference run, or what is stated, from the first touch on.
    """

    mode: Literal["recorded", "same", "force"] = setting(
        default="recorded",
        description="recorded: as filmed; same: yields like the hand that was filmed; force: each "
        "lip bears what it bore, or what is stated",
    )
    reference: str | None = setting(
        default=None,
        file=True,
        example="runs/A38-F",
        description="run directory whose forces are followed; without it such a run is made first",
    )
    reference_scenario: str | None = setting(
        default=None,
        example="A38-F",
        description="scenario of the library whose run is made and followed, with this motion and "
        "numerics; without it, the filmed package as it was filmed",
    )
    width_mm: float = setting(
        default=25.0,
        unit="mm",
        minimum=5.0,
        maximum=100.0,
        description="width of lip that the section stands for",
        source="chord of a 38 mm opening that lips press, estimate",
    )
    stiffness_n_per_m: float = setting(
        default=300.0,
        unit="N/m",
        above=0.0,
        maximum=1e6,
        description="of the hand against a shift of the package",
        source=ARM,
    )
    turning_stiffness_nm_per_rad: float = setting(
        default=2.0,
        unit="N m/rad",
        above=0.0,
        maximum=1e4,
        description="of the hand against a turn of the package",
        source="a few N m/rad, estimate",
    )
    damping_n_s_per_m: float = setting(
        default=5.0,
        unit="N s/m",
        minimum=0.0,
        maximum=1e3,
        description="of the hand against a velocity that differs from the film's",
        source="arm's endpoint viscosity, some N s/m and more, estimate",
    )
    upper_force_n: float | None = setting(
        default=None,
        unit="N",
        minimum=0.0,
        maximum=100.0,
        description="force that the upper lip bears once touched, over the whole width",
    )
    lower_force_n: float | None = setting(
        default=None,
        unit="N",
        minimum=0.0,
        maximum=100.0,
        description="force that the lower lip bears once touched, over the whole width",
    )

    share_of_weight: float | tuple[float, float] | None = setting(
        default=None,
        minimum=0.0,
        maximum=1.0,
        description="share of the weight of package and content that each lip bears once touched, "
        "or of the upper and of the lower lip",
        source="thesis: a tenth; an estimate",
    )

    def __post_init__(self) -> None:
        stated = (self.upper_force_n, self.lower_force_n)
        if (stated[0] is None) != (stated[1] is None):
            missing = "upper" if stated[0] is None else "lower"
            raise SettingError(
                f"hand.{missing}_force_n is missing: state the force of both lips, or of neither"
            )
        sources = [name for name in ("upper_force_n", "share_of_weight", "reference")
                   if getattr(self, name) is not None]  # fmt: skip
        if self.mode != "force" and {"upper_force_n", "share_of_weight"} & set(sources):
            raise SettingError(
                f'hand.{sources[0]} has no effect while hand.mode = "{self.mode}": set mode = '
                '"force"'
            )
        if self.reference is not None and self.reference_scenario is not None:
            raise SettingError(
                "hand.reference and hand.reference_scenario contradict one another: give a run, or "
                "the scenario whose run is made"
            )
        if self.mode == "force" and len(sources) > 1:
            raise SettingError(
                f"hand.{sources[0]} and hand.{sources[1]} contradict one another: give stated "
                "newtons, shares of the weight, or a reference run"
            )

    @property
    def states_forces(self) -> bool:
        """Whether the forces are stated: then a reference run only tells directions and times."""
        return self.upper_force_n is not None or self.share_of_weight is not None

    def forces_n(self, weight_n: float | None) -> tuple[float, float] | None:
        """Return what the upper and the lower lip are to bear, N; None if a reference run tells.

        Parameters
        ----------
        weight_n
            Weight of package and content, N; needed for shares of it.
        """
        if self.upper_force_n is not None and self.lower_force_n is not None:
            return self.upper_force_n, self.lower_force_n
        if self.share_of_weight is None or weight_n is None:
            return None
        shares = self.share_of_weight
        upper, lower = shares if isinstance(shares, tuple) else (shares, shares)
        return upper * weight_n, lower * weight_n
