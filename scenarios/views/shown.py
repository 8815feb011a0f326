"""The fields that tissue is coloured by: how they are called, in which unit, in which colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.colors import Colormap, Normalize, PowerNorm
from numpy.typing import NDArray

from scenarios.results.increment import Integers, SectionModel
from scenarios.results.quantities import ELEMENT_FIELDS
from scenarios.views.colours import (
    AROUND_COLOURS,
    MUSCLE_COLOURS,
    STRAIN_COLOURS,
    STRESS_COLOURS,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shown:
    """What tissue is coloured by: a field, how it is called, and the unit it is shown in.

    Colours start at ``centre``; where that is not 0 they go as far below it as above. ``whole``
    colours all tissue, not the dermis alone.
    """

    field: str
    title: str
    unit: str
    factor: float
    colours: Colormap
    centre: float = 0.0
    whole: bool = False

    def values(self, element: Array) -> Array:
        """Return values of the field in the unit that is shown."""
        return element * self.factor

    def reach(self, values: Array) -> Array:
        """Return how far from the start of the colours values are."""
        return np.abs(values - self.centre) if self.centre else values

    def tissue(self, model: SectionModel) -> Integers:
        """Return the elements that are coloured."""
        names = np.array(model.region_names)[model.region]
        return np.flatnonzero(self.whole | np.char.endswith(names, "dermis"))

    def norm(self, limit: float) -> Normalize:
        """Return how colours go with values whose largest reach is ``limit``."""
        if self.centre:
            return Normalize(self.centre - limit, self.centre + limit)
        return PowerNorm(0.5, 0.0, limit)  # low values tell apart


SHOWN = {
    "von_mises_mpa": Shown("von_mises_mpa", "von Mises in dermis", "kPa", 1e3, STRESS_COLOURS),
    "log_strain_max": Shown("log_strain_max", "largest log strain", "", 1.0, STRAIN_COLOURS),
    "log_strain_min": Shown("log_strain_min", "compressive log strain", "", -1.0, STRAIN_COLOURS),
    "thickness_stretch": Shown(
        "thickness_stretch", "thickness stretch", "", 1.0, AROUND_COLOURS, centre=1.0, whole=True
    ),
    "activation": Shown("activation", "activation of muscles", "", 1.0, MUSCLE_COLOURS, whole=True),
}
assert SHOWN.keys() == {quantity.name for quantity in ELEMENT_FIELDS}
