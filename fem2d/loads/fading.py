"""Loads and ties that rise smoothly from nothing towards the middle of a stretch of surface."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fem2d.body.surface import Surface
from fem2d.loads.amplitude import LoadError

Array = NDArray[np.float64]

Values = TypeVar("Values", float, Array)


def smooth_step(s: Values) -> Values:
    """Return 3 s² − 2 s³, which rises from 0 at s = 0 to 1 at s = 1 and is flat at both.

    >>> smooth_step(0.0), smooth_step(0.5), smooth_step(1.0)
    (0.0, 0.5, 1.0)
    """
    return s**2 * (3 - 2 * s)


def faded_share(surface: Surface, from_mm: float, to_mm: float, fade_mm: float) -> Array:
    """Return how much of something acts at the points (m, q) of a surface, 0…1.

    Parameters
    ----------
    surface
        The surface.
    from_mm, to_mm
        Arc length along the undeformed surface where the stretch begins and ends, mm.
    fade_mm
        Arc length inside the stretch over which the share rises from nothing at each end, mm.
    """
    s = surface.arc_length
    nearest_end = np.minimum(s - from_mm, to_mm - s) / fade_mm
    return smooth_step(np.clip(nearest_end, 0.0, 1.0))


def stretch_share(
    name: str, surface: Surface, from_mm: float, to_mm: float, fade_mm: float
) -> Array:
    """Return :func:`faded_share` of a named load on a stretch that makes sense.

    Raises
    ------
    LoadError
        If both fades do not fit on the stretch, or no point of the surface lies on it.
    """
    if not 0 < 2 * fade_mm <= to_mm - from_mm:
        raise LoadError(
            f"{name}: a fade of {fade_mm:g} mm does not fit twice between {from_mm:g} and "
            f"{to_mm:g} mm: use a longer stretch or a shorter fade"
        )
    share = faded_share(surface, from_mm, to_mm, fade_mm)
    if not share.any():
        raise LoadError(
            f"{name}: no point of the surface lies between {from_mm:g} and {to_mm:g} mm"
        )
    return share
