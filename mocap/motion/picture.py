"""Map from the world plane to the recording's picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

LEAST_SPREAD_MM = 1.0
"""Least standard deviation of positions from which a scale is fitted."""


@dataclass(frozen=True)
class PictureScale:
    """Map from world points to the picture: ``px = origin + px_per_mm · (x, −y)``.

    Attributes
    ----------
    origin_px
        The world's origin, px.
    px_per_mm
        The scale.
    mirrored
        Whether px count in the picture with left and right exchanged.
    """

    origin_px: tuple[float, float]
    px_per_mm: float
    mirrored: bool = False

    @classmethod
    def fitted(cls, pixels: Array, places_mm: Array) -> PictureScale | None:
        """Return the least-squares fit to positions in the world and in the picture.

        Parameters
        ----------
        pixels, places_mm
            (n, 2) px, y down, and mm, y up, of the same points. The result is None if their
            standard deviation is below ``LEAST_SPREAD_MM``.
        """
        if len(places_mm) < 2:
            return None
        places = places_mm * [1.0, -1.0]
        about = places - places.mean(axis=0)
        squared = float((about**2).sum())
        if squared < len(places) * LEAST_SPREAD_MM**2:
            return None
        scale = float((about * (pixels - pixels.mean(axis=0))).sum() / squared)
        origin = pixels.mean(axis=0) - scale * places.mean(axis=0)
        return cls((float(origin[0]), float(origin[1])), scale)

    def pixels(self, points_mm: Array) -> Array:
        """Return (n, 2) px, y down, of world points (n, 2), mm, y up."""
        return np.asarray(self.origin_px) + self.px_per_mm * points_mm * [1.0, -1.0]
