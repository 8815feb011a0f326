"""The table of the liquid: how much there is, and how hard it is sucked at."""

from __future__ import annotations

from dataclasses import dataclass

from fem2d.loads.amplitude import Amplitude
from geometry2d.foundation.settings import setting
from scenarios.settings.tables import SettingError


@dataclass(frozen=True)
class Liquid:
    """The content of the package: its level follows the tilt, its pressure acts on wet skin."""

    volume_ml: float = setting(
        unit="ml",
        minimum=5.0,
        maximum=2000.0,
        description="content of the package while it is drunk from",
    )
    density_kg_per_m3: float = setting(
        default=1000.0,
        unit="kg/m³",
        minimum=500.0,
        maximum=3000.0,
        description="density of the content",
        source="water; milk has 1030",
    )
    suction_kpa: float = setting(
        default=0.0,
        unit="kPa",
        minimum=0.0,
        maximum=30.0,
        description="suction in the mouth while it is sucked",
        source="people suck with 4.4 ± 2.6 (women) and 5.6 ± 2.8 kPa (men)",
    )
    suck_from_s: float | None = setting(
        default=None,
        unit="s",
        minimum=0.0,
        description="when the suction is there, in the recording",
    )
    suck_to_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="when the suction ends"
    )
    rise_s: float = setting(
        default=0.2,
        unit="s",
        above=0.0,
        maximum=10.0,
        description="time in which the suction rises before, and falls after",
        source="estimate",
    )
    wet_to_mm: float = setting(
        default=2.0,
        unit="mm",
        minimum=-10.0,
        maximum=20.0,
        description="how far beyond its margin a lip is wet, along its skin",
        source="estimate: the red that is closed around a rim",
    )
    wet_fade_mm: float = setting(
        default=1.0,
        unit="mm",
        above=0.0,
        maximum=10.0,
        description="length over which the pressure fades where a lip gets dry",
        source="so that no element sees the liquid end",
    )

    def __post_init__(self) -> None:
        instants = (self.suck_from_s, self.suck_to_s)
        if self.suction_kpa == 0:
            return
        if None in instants:
            raise SettingError(
                f"liquid.suction_kpa = {self.suction_kpa:g} kPa needs liquid.suck_from_s and "
                "suck_to_s: say when the person sucks"
            )
        if not self.suck_from_s < self.suck_to_s:  # type: ignore[operator]
            raise SettingError(
                f"liquid.suck_from_s = {self.suck_from_s:g} s is not before suck_to_s = "
                f"{self.suck_to_s:g} s"
            )

    @property
    def suction(self) -> Amplitude:
        """How much of the suction there is, against time."""
        if self.suction_kpa == 0 or self.suck_from_s is None or self.suck_to_s is None:
            return Amplitude((0.0,), (0.0,))
        instants = (
            self.suck_from_s - self.rise_s,
            self.suck_from_s,
            self.suck_to_s,
            self.suck_to_s + self.rise_s,
        )
        return Amplitude(instants, (0.0, 1.0, 1.0, 0.0))
