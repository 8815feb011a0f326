"""The errors of everything that makes, reads or changes a motion."""

from geometry2d.foundation.errors import DrinksimError


class MotionError(DrinksimError):
    """Numbers, a file or tracks that give no motion."""


class ScaleError(DrinksimError):
    """Marks that give no scale."""
