"""What a lip feels of a contact: pressures at the scale that lips resolve, crests, the seal.

All measures are pure functions of a :class:`~scenarios.sip.contact_line.ContactLine`, the pressure
along the deformed skin at one instant.

Lips tell apart gratings of 1.5 ± 0.9 mm (upper) and 1.0 ± 0.7 mm (lower; Todd 2012), so a peak over
half a millimetre is finer than what is felt, while thread crests, 2.7 to 4.2 mm apart, are felt one
by one. Mean pressure and total force go with comfort of things worn on skin.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import black_tophat

from scenarios.sip.contact_line import WINDOW_MM, ContactLine

Array = NDArray[np.float64]

RESOLVED_MM = 1.0
"""Length over which pressure is averaged before crests are looked for: what lips resolve."""

CREST_REACH_MM = 6.0
"""A valley up to this wide lies between two crests. Threads have pitches of 2.7 to 4.2 mm, and the
skin that dips between two crests is longer than the straight way. It is the same for all necks, so
that they can be compared."""

SAMPLE_MM = 0.005


@dataclass(frozen=True)
class Felt:
    """What one lip feels at one instant.

    Attributes
    ----------
    mean_mpa
        Mean pressure over the touched skin, MPa.
    peak_1mm_mpa, peak_1_5mm_mpa
        Highest mean pressure over 1.0 and 1.5 mm of deformed skin, MPa.
    crest_contrast
        0…1, see :func:`crest_contrast`.
    touched_mm
        Deformed length that is touched, mm.
    """

    mean_mpa: float
    peak_1mm_mpa: float
    peak_1_5mm_mpa: float
    crest_contrast: float
    touched_mm: float

    @classmethod
    def of(cls, line: ContactLine) -> Felt:
        """Return what is felt of a contact."""
        touched = line.contact_length()
        return cls(
            mean_mpa=float(line.load.sum()) / touched if touched > 0 else 0.0,
            peak_1mm_mpa=line.highest_window(1.0),
            peak_1_5mm_mpa=line.highest_window(1.5),
            crest_contrast=crest_contrast(line),
            touched_mm=touched,
        )


def smoothed_pressure(line: ContactLine, window_mm: float, place_mm: ArrayLike) -> Array:
    """Return the mean pressure (n,), MPa, over ``window_mm`` of deformed skin around places (n,).

    Places are deformed arc lengths from the first point of the line, mm; nothing presses beyond its
    ends.
    """
    ends = np.concatenate([[0.0], np.cumsum(line.length.ravel())])
    load = np.concatenate([[0.0], np.cumsum(line.load.ravel())])
    place = np.asarray(place_mm, float)
    within: Array = np.interp(place + 0.5 * window_mm, ends, load) - np.interp(
        place - 0.5 * window_mm, ends, load
    )
    return within / window_mm


def crest_contrast(
    line: ContactLine, *, window_mm: float = RESOLVED_MM, reach_mm: float = CREST_REACH_MM
) -> float:
    """Return how much crests stand out of the pressure along the skin, from 0 to 1.

    The pressure, averaged over ``window_mm``, is closed: every valley at most ``reach_mm`` wide is
    filled to the lower of its two sides. The contrast is the greatest depth filled over the
    greatest pressure (morphological *black top-hat*, Serra 1982). It is 0 where the pressure has
    one summit, however narrow; 1 for two equal crests with nothing between them; and for a second
    crest that bears a share of the first's pressure it is that share.
    """
    loaded = np.flatnonzero(line.load.ravel() > 0)
    if loaded.size == 0:
        return 0.0
    ends = np.concatenate([[0.0], np.cumsum(line.length.ravel())])
    low, high = ends[loaded[0]] - reach_mm, ends[loaded[-1] + 1] + reach_mm
    place = np.arange(low, high + SAMPLE_MM, SAMPLE_MM)
    pressure = smoothed_pressure(line, window_mm, place)
    size = int(np.rint(reach_mm / SAMPLE_MM)) + 1
    filled = black_tophat(pressure, size=size, mode="constant")
    return float(np.clip(np.max(filled) / np.max(pressure), 0.0, 1.0))


def seal_margin_mpa(
    line: ContactLine, liquid_mpa: ArrayLike, *, window_mm: float = WINDOW_MM
) -> float:
    """Return by how much the tightest place of a contact presses more than the liquid, MPa.

    What holds liquid back is one line across the whole width that is pressed harder than the liquid
    presses there, so the largest difference along the lip counts. Negative: it leaks.

    Parameters
    ----------
    line
        The contact.
    liquid_mpa
        Pressure that the contact has to hold back, MPa: one number, or (m, k) along the line.
    window_mm
        Length over which both are averaged.
    """
    held_back = np.broadcast_to(np.asarray(liquid_mpa, float), line.load.shape)
    left = replace(line, load=line.load - held_back * line.length)
    return left.highest_window(window_mm)
