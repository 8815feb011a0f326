"""The error of markers that cannot be found or followed."""

from geometry2d.foundation.errors import DrinksimError


class TrackingError(DrinksimError):
    """Markers that cannot be found or followed."""
