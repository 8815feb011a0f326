"""The thesis' element study in three dimensions: one cube, linear and quadratic bricks.

scikit-fem's bricks with the three-dimensional laws answer a homogeneous pull with the stress that
the plane-stress kernel computes for a single point, whatever the element and its integration: the
thesis' "no difference regardless of element choice" (3.2.1), with numbers.
"""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from skfem.helpers import ddot, grad
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex

from fem2d.analyses.homogeneous import Mode, homogeneous_response
from fem2d.materials.library import material_named
from fem2d.materials.material import Array, Material


def brick_forces(
    law: Material, element: skfem.Element, order: int, stretches: Array
) -> tuple[Array, Array]:
    """Return nodal positions (n, 3) and internal forces (n, 3) of a stretched unit cube."""
    # scikit-fem's own rule of first order has eight points: one is meant.
    rule = (np.full((3, 1), 0.5), np.ones(1)) if order == 1 else get_quadrature(RefHex, order)
    basis = skfem.CellBasis(skfem.MeshHex(), skfem.ElementVector(element), quadrature=rule)
    positions = basis.doflocs.T
    u = np.empty(basis.N)
    for component in range(3):
        dofs = np.unique(basis.element_dofs[component::3])
        u[dofs] = positions[dofs, component] * (stretches[component] - 1)
    F = np.moveaxis(grad(basis.interpolate(u)), (0, 1), (-2, -1)) + np.eye(3)
    P = np.moveaxis(law.first_piola_kirchhoff(F), (-2, -1), (0, 1))

    @skfem.LinearForm
    def force(v, w):
        return ddot(P, grad(v))

    nodal = force.assemble(basis)
    nodes = basis.element_dofs[:, 0].reshape(-1, 3)
    return positions[nodes[:, 0]], nodal[nodes]


@pytest.mark.parametrize("name", ["luboz-2014/mean", "L2-Ogden/dermis", "ni-annaidh-2012/dermis"])
@pytest.mark.parametrize(
    ("element", "order"),
    [
        (skfem.ElementHex1(), 3),
        (skfem.ElementHex1(), 1),
        (skfem.ElementHexS2(), 5),
        (skfem.ElementHexS2(), 3),
    ],
    ids=["8 nodes full", "8 nodes reduced", "20 nodes full", "20 nodes reduced"],
)
def test_one_brick_answers_as_one_point(name: str, element: skfem.Element, order: int) -> None:
    law = material_named(name)
    curve = homogeneous_response(law, Mode.UNIAXIAL, [0.5, 0.8, 1.2, 2.0])
    for stretches, nominal in zip(curve.stretches, curve.nominal_mpa, strict=True):
        positions, forces = brick_forces(law, element, order, stretches)
        scale = np.abs(forces).max()
        pulled = positions[:, 0] > 1 - 1e-9
        assert forces[pulled, 0].sum() == pytest.approx(nominal, rel=1e-9)
        sides = np.abs(forces[:, 1:])
        assert sides.max() < 1e-9 * scale
