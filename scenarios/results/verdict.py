"""What a run's peaks mean beside what skin bears and what hurts, in one sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scenarios.results.solution import LIPS, SolutionError


@dataclass(frozen=True)
class Threshold:
    """A range that was measured on people, and who measured what.

    ``low`` and ``high`` are the smallest and the largest mean over the conditions; ``unit`` is
    empty for strain.
    """

    low: float
    high: float
    unit: str
    source: str
    measured: str


PAIN = Threshold(
    low=272.0,
    high=508.0,
    unit="kPa",
    source="Finocchietti 2011",
    measured=(
        "pressure at which eight volunteers began to feel pain when probes of 5 to 15 mm were "
        "pressed on the shin's muscle"
    ),
)
"""Finocchietti et al., European Journal of Pain 15 (2011): round probe 15 mm to flat probe 5 mm."""

FAILURE = Threshold(
    low=math.log(1.54),
    high=math.log(1.54),
    unit="",
    source="Ní Annaidh 2012",
    measured="strain at which strips of skin from the back tore, 54 ± 17 % on average",
)
"""Ní Annaidh et al., J. Mech. Behav. Biomed. Mater. 5 (2012): 56 samples, 54 % as log strain."""


@dataclass(frozen=True)
class Verdict:
    """The peaks that decide: pressure (kPa) on ``lip``, and stretch as logarithmic strain.

    The pressure is the highest mean over 0.5 mm of deformed lip, which converges with the mesh.
    """

    lip: str
    pressure_kpa: float
    log_strain: float

    @classmethod
    def of(cls, summary: Mapping[str, Any]) -> Verdict:
        """Return the verdict on a run's summary; :class:`SolutionError` if a peak is missing."""
        try:
            pressures = {lip: float(summary[f"{lip}_lip_window_kpa"]) for lip in LIPS}
            strain = float(summary["dermis_max_log_strain"])
        except (KeyError, TypeError, ValueError) as error:
            raise SolutionError(f"summary.json lacks a peak or it is no number: {error}") from error
        lip = max(pressures, key=lambda name: pressures[name])
        return cls(lip, pressures[lip], strain)

    @property
    def sentence(self) -> str:
        """The verdict, said plainly."""
        return f"{self._pressure_in_words()}; {self._strain_in_words()}."

    def _pressure_in_words(self) -> str:
        if self.pressure_kpa <= 0.0:
            return "The neck never presses a lip"
        said = (
            f"The {self.lip} lip is pressed most, with {self.pressure_kpa:.0f} kPa over half a "
            "millimetre, "
        )
        range_ = f"{PAIN.low:.0f} to {PAIN.high:.0f} kPa"
        if self.pressure_kpa < PAIN.low:
            share = 100 * self.pressure_kpa / PAIN.low
            return said + f"{share:.0f} % of the lowest pressure that hurt volunteers ({range_})"
        if self.pressure_kpa < PAIN.high:
            return said + f"which is within the range that hurt volunteers ({range_})"
        return said + f"which is above the whole range that hurt volunteers ({range_})"

    def _strain_in_words(self) -> str:
        percent = 100 * math.expm1(self.log_strain)
        beyond = "below" if self.log_strain < FAILURE.low else "beyond"
        return (
            f"the dermis is stretched by up to {percent:.0f} % (log strain "
            f"{self.log_strain:.2f}), {beyond} the 54 % ({FAILURE.low:.2f}) at which skin tore"
        )
