"""Displacements and element fields of a solution, wherever they are kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class FieldStore(Protocol):
    """Where displacements and element fields of a solution's increments are kept."""

    def displacement(self, index: int) -> Array:
        """Return the displacement (n, 2), mm, of an increment."""
        ...

    def element(self, index: int) -> Mapping[str, Array]:
        """Return the element fields (e,) of an increment, by name of ELEMENT_FIELDS."""
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
