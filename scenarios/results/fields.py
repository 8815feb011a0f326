"""Displacements and element fields of a solution, wherever they are kept."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from scenarios.results.quantities import ELEMENT_FIELDS, LATER_FIELDS

Array = NDArray[np.float64]


class FieldStore(Protocol):
    """Where displacements and element fields of a solution's increments are kept."""

    def displacement(self, index: int) -> Array:
        """Return the displacement (n, 2), mm, of an increment."""
        ...

    def element(self, index: int) -> Mapping[str, Array]:
        """Return the element fields (e,) of an increment, by name of ELEMENT_FIELDS."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """The element fields that are kept, in the order of ELEMENT_FIELDS."""
        ...

    def along(self, name: str) -> Array:
        """Return an element field in every increment, (k, e)."""
        ...


@dataclass(frozen=True, eq=False)
class FieldsInMemory:
    """The fields of a solution that has not been written."""

    displacements: Sequence[Array]
    elements: Sequence[Mapping[str, NDArray[np.float32]]]

    def displacement(self, index: int) -> Array:
        """Return the displacement (n, 2), mm, of an increment."""
        return self.displacements[index]

    def element(self, index: int) -> Mapping[str, Array]:
        """Return the element fields (e,) of an increment, by name of ELEMENT_FIELDS."""
        return {name: values.astype(float) for name, values in self.elements[index].items()}

    @property
    def names(self) -> tuple[str, ...]:
        """The element fields that are kept, in the order of ELEMENT_FIELDS."""
        return held_fields(self.elements[0])

    def along(self, name: str) -> Array:
        """Return an element field in every increment, (k, e)."""
        return np.array([element[name] for element in self.elements], float)


def held_fields(names: Container[str]) -> tuple[str, ...]:
    """Return ELEMENT_FIELDS without those later ones that are not among some names."""
    every = (quantity.name for quantity in ELEMENT_FIELDS)
    return tuple(name for name in every if name not in LATER_FIELDS or name in names)
