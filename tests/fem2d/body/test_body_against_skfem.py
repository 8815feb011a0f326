"""The weak form as scikit-fem writes it, against which the compiled assembly is tested.

Plane sections:  ∫ P : ∇v t dA,  axisymmetric ones:  ∫ (P : ∇v + P₃₃ v_r/R) 2πR dA,
with P = ∂ψ/∂F of the three-dimensional law at F = I + ∇u, F₃₃ = 1, 1 + u_r/R, or where P₃₃ = 0.
"""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from scipy.optimize import brentq
from skfem.helpers import ddot, grad

from fem2d.body.body import Body
from fem2d.body.elements import element_named
from fem2d.body.kinematics import Plane
from fem2d.materials.material import Array, Material
from tests.support.section_bodies import FIBROUS, SOFT, STIFF, displacement, distorted


def full_gradient(law: Material, plane: Plane, u, r: Array) -> Array:
    """Return F (e, q, 3, 3) from scikit-fem's field u at distances r from the axis."""
    F = np.zeros((*r.shape, 3, 3))
    F[..., :2, :2] = np.moveaxis(grad(u), (0, 1), (-2, -1)) + np.eye(2)
    F[..., 2, 2] = 1.0
    if plane is Plane.AXISYMMETRIC:
        F[..., 2, 2] = 1 + np.asarray(u)[0] / r
    if plane is Plane.STRESS:
        for at in np.ndindex(r.shape):

            def traction(stretch: float, at: tuple[int, ...] = at) -> float:
                F[(*at, 2, 2)] = stretch
                return float(law.first_piola_kirchhoff(F[at])[2, 2])

            F[(*at, 2, 2)] = brentq(traction, 0.3, 3.0, xtol=1e-15, rtol=1e-15)
    return F


def weak_form(law: Material, plane: Plane, basis: skfem.CellBasis, u: Array) -> tuple[Array, Array]:
    """Return nodal forces and stiffness in scikit-fem's numbering."""
    field = basis.interpolate(u)
    r = basis.global_coordinates()[0]
    F = full_gradient(law, plane, field, r)
    P = np.moveaxis(law.first_piola_kirchhoff(F), (-2, -1), (0, 1))
    A = law.tangent(F)
    if plane is Plane.STRESS:
        A = (
            A
            - np.einsum("...ij,...kl->...ijkl", A[..., 2, 2], A[..., 2, 2, :, :])
            / (A[..., 2, 2, 2, 2][..., None, None, None, None])
        )
    A = np.moveaxis(A, (-4, -3, -2, -1), (0, 1, 2, 3))
    turn = 2 * np.pi * r if plane is Plane.AXISYMMETRIC else np.ones_like(r)
    ring = 1 / r if plane is Plane.AXISYMMETRIC else np.zeros_like(r)

    @skfem.LinearForm
    def force(v, w):
        return turn * (ddot(P[:2, :2], grad(v)) + P[2, 2] * v[0] * ring)

    @skfem.BilinearForm
    def stiffness(du, v, w):
        dF33, dv33 = du[0] * ring, v[0] * ring
        dP = np.einsum("ijkl...,kl...->ij...", A[:2, :2, :2, :2], grad(du)) + A[:2, :2, 2, 2] * dF33
        dP33 = np.einsum("kl...,kl...->...", A[2, 2, :2, :2], grad(du)) + A[2, 2, 2, 2] * dF33
        return turn * (ddot(dP, grad(v)) + dP33 * dv33)

    return force.assemble(basis), stiffness.assemble(basis).toarray()


@pytest.mark.parametrize("law", [SOFT, STIFF, FIBROUS], ids=["neo-hookean", "ogden", "hgo"])
@pytest.mark.parametrize("plane", list(Plane), ids=lambda plane: plane.name.lower())
@pytest.mark.parametrize("element", ["T6", "Q4", "Q8"])
def test_the_compiled_assembly_is_the_weak_form(element: str, plane: Plane, law: Material) -> None:
    mesh = distorted(element)
    body = Body(mesh, law, plane=plane, element=element)
    kind = element_named(element)
    basis = skfem.CellBasis(mesh, skfem.ElementVector(kind.shape), quadrature=kind.quadrature)
    # scikit-fem numbers the components of a node next to one another, but node by entity.
    order = np.empty(basis.N, int)
    for component in range(2):
        order[basis.element_dofs[component::2].T] = 2 * body.tables.connectivity + component
    u = displacement(body, size=0.01)
    force, stiffness = weak_form(law, plane, basis, u.ravel()[order])
    response = body.response(u)
    np.testing.assert_allclose(response.force[order], force, atol=1e-11 * np.abs(force).max())
    matrix = body.pattern.matrix(response.stiffness).toarray()[order][:, order]
    np.testing.assert_allclose(matrix, stiffness, atol=1e-11 * np.abs(stiffness).max())
