"""The table of the muscles of the lips: how active each is, against time."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from fem2d.loads.amplitude import Amplitude
from fem2d.loads.muscle_law import MuscleFibre
from geometry2d.anatomy.muscle_measurements import MuscleMeasurements
from geometry2d.foundation.settings import setting
from scenarios.settings.tables import SettingError

Auto = Literal["auto"]
Activation = float | Auto | tuple[float | Auto, ...]

NAMES = ("upper_orbicularis", "lower_orbicularis", "mentalis", "levator", "depressor")


@dataclass(frozen=True)
class Seen:
    """What was seen of the lips; activations that are "auto" are the least that explain it."""

    clearance_mm: float = setting(
        default=0.5,
        unit="mm",
        minimum=0.0,
        maximum=5.0,
        description="from the neck, kept by a lip while its levator or depressor holds",
    )
    lower_reach_mm: float | None = setting(
        default=None,
        unit="mm",
        above=0.0,
        maximum=60.0,
        description="how far from the rim, along the neck, the lower lip bears on it",
    )
    reach_time_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="when that was seen, in the recording"
    )
    seal_time_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="when the lips sealed, in the recording"
    )
    seal_kpa: float = setting(
        default=0.0,
        unit="kPa",
        minimum=0.0,
        maximum=30.0,
        description="by how much the tightest place of each lip then pressed more than the liquid",
    )

    def __post_init__(self) -> None:
        if (self.lower_reach_mm is None) != (self.reach_time_s is None):
            missing = "lower_reach_mm" if self.lower_reach_mm is None else "reach_time_s"
            raise SettingError(f"{missing} is missing: say how far the lip reached, and when")


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
        description="activation of the upper orbicularis, which closes; auto: the least that seals",
    )
    lower_orbicularis: Activation = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="activation of the lower orbicularis, which closes; auto: the least that seals",
    )
    mentalis: Activation = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="activation of mentalis, which lifts chin and lower lip; "
        "auto: the least with which the lower lip reaches as far as seen",
    )
    levator: Activation = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="activation of the levator of the upper lip; "
        "auto: the least that clears the neck",
    )
    depressor: Activation = setting(
        default=0.0,
        minimum=0.0,
        maximum=1.0,
        description="activation of the depressor of the lower lip; "
        "auto: the least that clears the neck, or with which the lower lip reaches as far as seen",
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
    seen: Seen = setting(
        default=Seen(), description='what was seen of the lips, which an "auto" explains'
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

        for name in self.automatic:
            self.observation(name)

    @property
    def automatic(self) -> tuple[str, ...]:
        """The muscles whose activation is to be found."""
        return tuple(name for name in NAMES if "auto" in _as_tuple(getattr(self, name), 1))

    @property
    def sealing(self) -> tuple[str, ...]:
        """The muscles whose activation is the least that seals."""
        return tuple(name for name in self.automatic if self.observation(name) == "seals")

    def observation(self, name: str) -> Literal["clears", "reaches", "seals"]:
        """Return what decides over the activation of a muscle that is "auto".

        Raises
        ------
        SettingError
            If nothing that was seen does.
        """
        where = f'muscles.{name} = "auto"'
        if name.endswith("orbicularis"):
            if self.seen.seal_time_s is None:
                raise SettingError(
                    f"{where} is the least that seals: give muscles.seen.seal_time_s"
                )
            return "seals"
        if name != "levator" and self.seen.lower_reach_mm is not None:
            return "reaches"
        if name == "mentalis":
            raise SettingError(
                f"{where} is the least with which the lower lip reaches so far down the neck: give "
                "muscles.seen.lower_reach_mm and reach_time_s"
            )
        if not self.held_s(name):
            raise SettingError(
                f"{where} is the least that keeps the lip clear of the neck while it holds: give "
                'muscles.time_s, and "auto" at two instants that follow one another'
            )
        return "clears"

    def held_s(self, name: str) -> tuple[tuple[float, float], ...]:
        """Return from when to when a muscle is as active as is to be found, s."""
        values = _as_tuple(getattr(self, name), len(self.time_s))
        pairs = zip(itertools.pairwise(self.time_s), itertools.pairwise(values), strict=True)
        return tuple(instants for instants, ends in pairs if ends == ("auto", "auto"))

    def activations(
        self, near_s: float, found: Mapping[str, float] | None = None
    ) -> dict[str, Amplitude]:
        """Return the activation of every muscle that acts, against time.

        Parameters
        ----------
        near_s
            When the neck comes near: the instant that is meant where none is given.
        found
            What "auto" stands for, by muscle; 0 for those that are absent.
        """
        instants = self.time_s or (near_s,)
        known = found or {}
        return {
            name: self._risen(instants, values)
            for name in NAMES
            if any(values := self._values(name, len(instants), known.get(name, 0.0)))
        }

    def _values(self, name: str, count: int, found: float) -> tuple[float, ...]:
        values = _as_tuple(getattr(self, name), count)
        return tuple(found if value == "auto" else float(value) for value in values)

    def _risen(self, instants: tuple[float, ...], values: tuple[float, ...]) -> Amplitude:
        if values[0] > 0:
            return Amplitude((instants[0] - self.rise_s, *instants), (0.0, *values))
        return Amplitude(instants, values)


def _as_tuple(value: Activation, count: int) -> tuple[float | Auto, ...]:
    return value if isinstance(value, tuple) else (value,) * count
