"""The table of the muscles of the lips: how active each is, against time."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from fem2d.loads.amplitude import Amplitude
from fem2d.loads.muscle_law import MuscleFibre
from geometry2d.anatomy.muscle_measurements import MuscleMeasurements
from geometry2d.foundation.settings import setting
from scenarios.settings.tables import SettingError

Activation = float | tuple[float, ...]

NAMES = ("upper_orbicularis", "lower_orbicularis", "mentalis", "levator", "depressor")


@dataclass(frozen=True)
class Muscles:
    """Activations of the lips' muscles, from 0 (at rest) to 1 (all they can).

    Between two instants an activation changes smoothly; before the first it rises from nothing.
    """

    time_s: tuple[float, ...] = setting(
        default=(),
        unit="s",
        minimum=0.0,
        description="instants of the activations, in the recording; without any, muscles are as "
        "active as they are when the neck comes near",
    )
    upper_orbicularis: Activation = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="activation of the upper orbicularis, which closes",
    )
    lower_orbicularis: Activation = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="activation of the lower orbicularis, which closes",
    )
    mentalis: Activation = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="activation of mentalis, which lifts chin and lower lip",
    )
    levator: Activation = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="activation of the levator of the upper lip",
    )
    depressor: Activation = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="activation of the depressor of the lower lip",
    )
    rise_s: float = setting(
        default=0.3,
        unit="s",
        above=0.0,
        maximum=10.0,
        description="time in which a muscle rises from nothing before the first instant",
        source="estimate: lips are closed and opened two or three times a second",
    )
    corner_stretch: float = setting(
        default=1.0,
        minimum=0.5,
        maximum=1.5,
        description="stretch of orbicularis' fibres by the corners of the mouth",
        source="1: the corners stay where they are",
    )
    fibre: MuscleFibre = setting(
        default=MuscleFibre(), description="tension of the fibres at a stretch"
    )
    places: MuscleMeasurements = setting(
        default=MuscleMeasurements(), description="where the muscles lie and how they are curved"
    )

    def __post_init__(self) -> None:
        if any(b <= a for a, b in itertools.pairwise(self.time_s)):
            raise SettingError(
                f"muscles.time_s = {list(self.time_s)} s: each instant must be later than the one "
                "before"
            )
        for name in NAMES:
            value = getattr(self, name)
            if isinstance(value, tuple) and len(value) != len(self.time_s):
                raise SettingError(
                    f"muscles.{name} holds {len(value)} activations and muscles.time_s "
                    f"{len(self.time_s)} instants: give one for each, or one number"
                )

    def activations(self, near_s: float) -> dict[str, Amplitude]:
        """Return the activation of every muscle that acts, against time.

        Parameters
        ----------
        near_s
            When the neck comes near: the instant that is meant where none is given.
        """
        instants = self.time_s or (near_s,)
        return {
            name: self._risen(instants, value)
            for name in NAMES
            if any(value := _as_tuple(getattr(self, name), len(instants)))
        }

    def _risen(self, instants: tuple[float, ...], values: tuple[float, ...]) -> Amplitude:
        if values[0] > 0:
            return Amplitude((instants[0] - self.rise_s, *instants), (0.0, *values))
        return Amplitude(instants, values)


def _as_tuple(value: Activation, count: int) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,) * count
