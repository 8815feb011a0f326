"""How much of a load acts, against time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry2d.foundation.errors import DrinksimError


class LoadError(DrinksimError):
    """A load was described in a way that makes no sense."""


@dataclass(frozen=True)
class Amplitude:
    """A factor against time: smooth steps between instants, constant before and after them.

    Between two instants it follows ``s³ (10 − 15 s + 6 s²)``, whose first and second derivative
    vanish at both ends (Abaqus' *smooth step*).

    Parameters
    ----------
    time_s
        (n,) increasing instants, s.
    factor
        (n,) the factor at each of them.
    """

    time_s: tuple[float, ...]
    factor: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.time_s) != len(self.factor) or not self.time_s:
            raise LoadError(
                f"an amplitude of {len(self.time_s)} instants and {len(self.factor)} factors: give "
                "one factor for each instant"
            )
        if any(b <= a for a, b in zip(self.time_s, self.time_s[1:], strict=False)):
            raise LoadError(f"the instants {self.time_s} s of an amplitude must increase")

    def at(self, time_s: float) -> float:
        """Return the factor at a time, s.

        >>> Amplitude((1.0, 2.0), (0.0, 1.0)).at(1.5), Amplitude((1.0, 2.0), (0.0, 1.0)).at(9.0)
        (0.5, 1.0)
        """
        after = int(np.searchsorted(self.time_s, time_s))
        if after == 0 or after == len(self.time_s):
            return self.factor[min(after, len(self.factor) - 1)]
        start, end = self.time_s[after - 1], self.time_s[after]
        s = (time_s - start) / (end - start)
        step = s**3 * (10 - 15 * s + 6 * s**2)
        return self.factor[after - 1] + step * (self.factor[after] - self.factor[after - 1])
