"""Element types by name: shape functions and quadrature, both scikit-fem's.

====== ==================== =================== ==============================================
name   shape functions      integration points  use
====== ==================== =================== ==============================================
T3     linear triangle      1                   comparison only: locks
T6     quadratic triangle   6                   the default of every model
T6R    quadratic triangle   3                   comparison: collapses under strong compression
T6M    quadratic triangle   6, mean dilatation  comparison: too soft in bending
Q4     bilinear square      2 × 2               comparison with other programs; locks
Q4R    bilinear square      1                   comparison only: hourglasses
Q4M    bilinear square      2 × 2, mean dil.    structured meshes, several cells thick
Q4RM   bilinear square      1, mean dil.        the same as Q4R: comparison only
Q8     serendipity square   3 × 3               structured meshes, bending
Q8R    serendipity square   2 × 2               the thesis' CAX8R
Q8M    serendipity square   3 × 3, mean dil.    comparison: too soft in bending
Q8RM   serendipity square   2 × 2, mean dil.    comparison (the thesis' CAX8RH)
====== ==================== =================== ==============================================

Mean dilatation: the volumetric energy of an element is that of its mean volume ratio
(Nagtegaal, Parks and Rice 1974; in energy form Simo, Taylor and Pister 1985), so force and tangent
are still derivatives of one energy.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature

from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class ElementError(DrinksimError):
    """An element type does not exist or does not fit the mesh."""


@dataclass(frozen=True)
class Element:
    """An element type: scikit-fem's shape functions, quadrature, volumetric treatment.

    Attributes
    ----------
    name
        As in the table above.
    shape
        scikit-fem's scalar element.
    order
        Polynomial order that the quadrature integrates.
    mean_dilatation
        Whether the volumetric energy is that of the element's mean volume ratio.
    """

    name: str
    shape: skfem.Element
    order: int
    mean_dilatation: bool = False

    @property
    def quadrature(self) -> tuple[Array, Array]:
        """Points (2, q) and weights (q,) on the reference element."""
        if self.order == 1:  # scikit-fem's smallest rules have more than the one point needed
            middle = 1 / 3 if self.shape.refdom is skfem.refdom.RefTri else 1 / 2
            return np.full((2, 1), middle), np.array([0.5 if middle < 0.5 else 1.0])
        points, weights = get_quadrature(self.shape.refdom, self.order)
        return points, weights

    @property
    def quadratic(self) -> bool:
        """Whether edges have a middle node."""
        return bool(self.shape.facet_dofs)


ELEMENTS: dict[str, Element] = {
    e.name: e
    for e in (
        Element("T3", skfem.ElementTriP1(), 1),
        Element("T6", skfem.ElementTriP2(), 4),
        Element("T6R", skfem.ElementTriP2(), 2),
        Element("T6M", skfem.ElementTriP2(), 4, mean_dilatation=True),
        Element("Q4", skfem.ElementQuad1(), 3),
        Element("Q4R", skfem.ElementQuad1(), 1),
        Element("Q4M", skfem.ElementQuad1(), 3, mean_dilatation=True),
        Element("Q4RM", skfem.ElementQuad1(), 1, mean_dilatation=True),
        Element("Q8", skfem.ElementQuadS2(), 5),
        Element("Q8R", skfem.ElementQuadS2(), 3),
        Element("Q8M", skfem.ElementQuadS2(), 5, mean_dilatation=True),
        Element("Q8RM", skfem.ElementQuadS2(), 3, mean_dilatation=True),
    )
}


def element_named(name: str) -> Element:
    """Return the element type called ``name``.

    Raises
    ------
    ElementError
        If there is none, with the nearest name.
    """
    if name not in ELEMENTS:
        near = difflib.get_close_matches(name, ELEMENTS, n=1, cutoff=0.0)
        raise ElementError(
            f"no element is called {name!r}: choose one of {', '.join(ELEMENTS)}"
            + (f" (did you mean {near[0]}?)" if near else "")
        )
    return ELEMENTS[name]


@dataclass(frozen=True)
class Tables:
    """Nodes, connectivity and shape functions of a mesh, as assembly needs them.

    Attributes
    ----------
    nodes
        (n, 2) reference positions, mm, scikit-fem's numbering.
    connectivity
        (e, a) node numbers.
    facet_nodes
        (f,) the middle node of each facet of the mesh, or (0,) for linear elements.
    values, gradients
        (q, a) shape functions and (e, q, a, 2) their gradients, 1/mm.
    points
        (e, q, 2) positions of the integration points, mm.
    areas
        (e, q) area that each point stands for, mm².
    """

    nodes: Array
    connectivity: Index
    facet_nodes: Index
    values: Array
    gradients: Array
    points: Array
    areas: Array

    def renumbered(self, number: Index) -> Tables:
        """Return the tables with node ``i`` called ``number[i]``."""
        nodes = np.empty_like(self.nodes)
        nodes[number] = self.nodes
        return replace(
            self,
            nodes=nodes,
            connectivity=number[self.connectivity],
            facet_nodes=number[self.facet_nodes],
        )

    @classmethod
    def of(cls, mesh: skfem.Mesh, element: Element) -> Tables:
        """Return the tables of ``element`` on ``mesh``.

        Raises
        ------
        ElementError
            If the mesh has other cells than the element, or a cell of no or negative area.
        """
        if mesh.refdom is not element.shape.refdom:
            raise ElementError(
                f"element {element.name} does not fit a {type(mesh).__name__}: "
                "T-elements need triangles, Q-elements quadrilaterals"
            )
        basis: Any = skfem.CellBasis(mesh, element.shape, quadrature=element.quadrature)
        shapes = [field[0] for field in basis.basis]
        areas = np.ascontiguousarray(basis.dx)
        if not np.all(areas > 0):
            bad = int(np.argmin(areas.min(axis=1)))
            middle = mesh.p[:, mesh.t[:, bad]].mean(axis=1).round(4).tolist()
            raise ElementError(f"cell {bad} around {middle} mm has no area: repair the mesh")
        facets = (
            basis.facet_dofs[0].astype(np.int64) if element.quadratic else np.empty(0, np.int64)
        )
        values = np.stack(
            [np.broadcast_to(np.asarray(shape), areas.shape)[0] for shape in shapes], axis=1
        )
        return cls(
            np.ascontiguousarray(basis.doflocs.T),
            np.ascontiguousarray(basis.element_dofs.T.astype(np.int64)),
            facets,
            np.ascontiguousarray(values),
            np.ascontiguousarray(np.stack([s.grad for s in shapes]).transpose(2, 3, 0, 1)),
            np.ascontiguousarray(np.asarray(basis.global_coordinates()).transpose(1, 2, 0)),
            areas,
        )
