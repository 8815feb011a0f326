"""The liquid of a sip: its level in the tilted package, and its pressure in the head section."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.loads.amplitude import Amplitude
from fem2d.loads.liquid import LiquidPressure, weight_mpa_per_mm
from geometry2d.container import ContainerError, carton
from geometry2d.neck import NeckSection
from geometry2d.rigid import RigidMotion, rotated
from scenarios.settings.scenario import Scenario, ScenarioError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TiltedLiquid:
    """The pressure of the content at each instant, in the frame of the head section.

    Attributes
    ----------
    neck
        Motion of the neck in the head section.
    up_rad
        (n,) direction of up in the head section at the samples of the motion, counter-clockwise
        from its y, rad.
    level_mm
        (n,) level of the free surface above the neck's lower mark, mm.
    weight_mpa_per_mm
        Weight of the liquid, MPa/mm.
    suction_mpa, suction
        Suction in the mouth, MPa, and how much of it there is against time.
    rim
        (2,) lowest edge of the bore's mouth when the package is level, in the neck frame, mm.
    """

    neck: RigidMotion
    up_rad: Array
    level_mm: Array
    weight_mpa_per_mm: float
    suction_mpa: float
    suction: Amplitude
    rim: tuple[float, float]

    def __call__(self, time_s: float) -> LiquidPressure:
        """Return the pressure at an instant, s."""
        angle = float(np.interp(time_s, self.neck.time_s, self.up_rad))
        up = -float(np.sin(angle)), float(np.cos(angle))
        mark = np.asarray(self.neck.at(time_s).shift_mm)
        level = float(np.interp(time_s, self.neck.time_s, self.level_mm)) + float(mark @ up)
        suction = self.suction_mpa * self.suction.at(time_s)
        return LiquidPressure(level, up, self.weight_mpa_per_mm, suction)

    def at_rim_mpa(self, time_s: float) -> float:
        """Return the head of liquid at the lower edge of the rim, MPa; 0 if none reaches it."""
        pressure = self(time_s)
        edge = self.neck.at(time_s).apply(np.array([self.rim]))[0]
        depth = pressure.level_mm - float(edge @ np.asarray(pressure.up))
        return self.weight_mpa_per_mm * max(depth, 0.0)


def tilted_liquid(
    scenario: Scenario, neck: NeckSection, motion: RigidMotion, head_angle_rad: float
) -> TiltedLiquid | None:
    """Return the liquid of a scenario; None without one.

    Up is the picture's: the camera is taken to be level. Where the motion does not say how the head
    turned, it is taken to stay.

    Parameters
    ----------
    scenario
        Its motion is known.
    neck
        The neck that is drunk from.
    motion
        Of that neck in the frame of the head section.
    head_angle_rad
        Turn of that frame into the head frame of the recording.

    Raises
    ------
    ScenarioError
        If the package does not hold that much.
    """
    settings = scenario.liquid
    if settings is None:
        return None
    recorded = scenario.known_motion()
    head_rad = np.interp(motion.time_s, recorded.time_s, np.nan_to_num(recorded.head_rad))
    up_rad = -head_rad - head_angle_rad
    container = carton(scenario.package.measurements)
    try:
        levels = [
            container.level(1e3 * settings.volume_ml, rotated([0.0, 1.0], up - angle))
            for up, angle in zip(up_rad, motion.angle_rad, strict=True)
        ]
    except ContainerError as error:
        raise ScenarioError(f"liquid.volume_ml: {error}") from error
    left, _, _, top = neck.lower_wall.box
    return TiltedLiquid(
        motion,
        up_rad,
        np.array(levels),
        weight_mpa_per_mm(settings.density_kg_per_m3),
        1e-3 * settings.suction_kpa,
        settings.suction,
        (left, top),
    )
