"""The peaks of a run that decide, and measured thresholds of pain and of tearing beside them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scenarios.results.increment import SolutionError
from scenarios.results.quantities import LIPS


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
