"""What a sip felt like in numbers: the columns of a study's table, from a history."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from scenarios.results.quantities import HISTORY, LIPS, Quantity
from scenarios.results.summary import seal_margins

Array = NDArray[np.float64]

OF_A_LIP = (
    "window_kpa",
    "window_1mm_kpa",
    "window_1_5mm_kpa",
    "mean_kpa",
    "force_n",
    "contact_mm",
    "crest_contrast",
)
"""Columns of a lip in a history that become a peak and a mean over the time it is touched."""

OF_THE_SKIN = ("dermis_max_log_strain", "dermis_max_mises_kpa")
OF_THE_HAND = ("neck_off_film_mm", "neck_off_film_deg")

HEADLINE = "lips_window_kpa_peak"
"""The highest mean pressure over 0.5 mm on either lip."""

MEANINGS = {quantity.name: quantity for quantity in HISTORY}


MEASURES = (
    HEADLINE,
    *(f"{lip}_lip_{name}_{how}" for lip in LIPS for name in OF_A_LIP for how in ("peak", "mean")),
    *(f"{lip}_lip_{name}" for lip in LIPS for name in ("impulse_ns", "seal_margin_kpa")),
    *(f"{name}_peak" for name in (*OF_THE_SKIN, *OF_THE_HAND)),
)
"""All measures of a sip; those of a seal only where liquid is at the rim."""


def felt_measures(history: Mapping[str, Array]) -> dict[str, float]:
    """Return the measures of a sip by name.

    Parameters
    ----------
    history
        Columns (k,) of a history.
    """
    found = {HEADLINE: max(float(history[f"{lip}_lip_window_kpa"].max()) for lip in LIPS)}
    for lip in LIPS:
        touched = history[f"{lip}_lip_contact_mm"] > 0
        for name in OF_A_LIP:
            column = history[f"{lip}_lip_{name}"]
            found[f"{lip}_lip_{name}_peak"] = float(column.max())
            found[f"{lip}_lip_{name}_mean"] = _mean(history["time_s"], column, touched)
        found[f"{lip}_lip_impulse_ns"] = float(
            np.trapezoid(history[f"{lip}_lip_force_n"], history["time_s"])
        )
    for name in (*OF_THE_SKIN, *OF_THE_HAND):
        found[f"{name}_peak"] = float(history[name].max())
    rows: Sequence[Mapping[str, float]] = [
        {name: float(history[name][k]) for name in _SEAL} for k in range(history["time_s"].size)
    ]
    return found | seal_margins(rows)


def described(measure: str) -> Quantity:
    """Return name, unit and meaning of a measure.

    >>> described("upper_lip_window_kpa_peak").meaning
    'highest mean pressure over 0.5 mm of deformed lip, upper lip: peak'
    """
    if measure == HEADLINE:
        return Quantity(measure, "kPa", "highest mean pressure over 0.5 mm on either lip: peak")
    for lip in LIPS:
        if measure == f"{lip}_lip_impulse_ns":
            return Quantity(measure, "N s", f"time integral of the force, {lip} lip")
        if measure == f"{lip}_lip_seal_margin_kpa":
            return Quantity(measure, "kPa", f"smallest seal while liquid is at the rim, {lip} lip")
    column, _, how = measure.rpartition("_")
    known = MEANINGS[column]
    place = next((f", {lip} lip" for lip in LIPS if column.startswith(lip)), "")
    return Quantity(measure, known.unit, f"{known.meaning}{place}: {how}")


_SEAL = ("liquid_kpa", *(f"{lip}_lip_seal_kpa" for lip in LIPS))


def _mean(time_s: Array, column: Array, touched: NDArray[np.bool_]) -> float:
    """Return the mean over the time that a lip is touched; 0 if it never is."""
    weight = np.zeros(time_s.size)
    step = np.diff(time_s)
    weight[:-1] += 0.5 * step
    weight[1:] += 0.5 * step
    weight = np.where(touched, weight, 0.0)
    total = float(weight.sum())
    return float(weight @ column) / total if total > 0 else 0.0
