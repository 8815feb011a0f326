"""A connected component of a body as a body with node numbers of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Body
from fem2d.body.surface import Surface

Index = NDArray[np.intp]

ABSENT = -1
"""Number of a node that a component does not have."""


@dataclass(frozen=True, eq=False)
class BodyComponent:
    """A connected component: elements that share no node with the rest of a body.

    Parameters
    ----------
    whole
        The body.
    nodes
        (n,) its nodes that belong to the component, ascending.
    """

    whole: Body
    nodes: Index

    @cached_property
    def body(self) -> Body:
        """The component alone."""
        return self.whole.component(self.nodes)

    @cached_property
    def number(self) -> Index:
        """Number on the component of each of the whole's nodes, `ABSENT` for others."""
        number = np.full(len(self.whole.nodes), ABSENT)
        number[self.nodes] = np.arange(len(self.nodes))
        return number

    @cached_property
    def elements(self) -> Index:
        """(e,) the whole body's elements that belong to the component, ascending."""
        return np.flatnonzero(self.number[self.whole.tables.connectivity[:, 0]] != ABSENT)

    @cached_property
    def dofs(self) -> Index:
        """(2n,) the whole body's unknowns that belong to the component."""
        dofs: Index = (2 * self.nodes[:, None] + np.arange(2)).ravel()
        return dofs

    @cached_property
    def entries(self) -> Index:
        """(nnz,) where the component's stiffness lies in the data of the whole body's."""
        start = self.whole.pattern.indptr
        return np.concatenate([np.arange(start[dof], start[dof + 1]) for dof in self.dofs])

    def has(self, surface: Surface) -> bool:
        """Whether a surface of the whole lies on the component."""
        return bool(self.number[surface.edges[0, 0]] != ABSENT)

    def surface(self, surface: Surface) -> Surface:
        """Return a surface of the whole that lies on the component as a surface of it."""
        return replace(surface, edges=self.number[surface.edges], nodes=self.body.nodes)
