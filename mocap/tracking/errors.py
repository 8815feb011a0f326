"""The errors of markers that cannot be found or followed."""

from __future__ import annotations

from collections.abc import Sequence

from geometry2d.foundation.errors import DrinksimError


class TrackingError(DrinksimError):
    """Markers that cannot be found or followed."""


class UnnamedSpotsError(TrackingError):
    """Spots of which it is not sure which marker each is.

    Parameters
    ----------
    message
        The error in words.
    frame
        Number of the frame that shows the spots.
    places_px
        (n, 2) their centres, px; the first one is called 1.
    """

    def __init__(
        self, message: str, *, frame: int, places_px: Sequence[tuple[float, float]]
    ) -> None:
        super().__init__(message)
        self.frame = frame
        self.places_px = tuple(places_px)
