"""Compiled assembly against scikit-fem's own, side by side: force and stiffness of the same body.

    OMP_NUM_THREADS=1 python -m benchmarks.assembly

The body is the two-material block of 20,000 four-node elements. Both sides start from nodal
displacements and end with a force vector and a CSR matrix. scikit-fem's side interpolates the
displacement, evaluates the same two laws point by point with numpy (the best hand-written form
for neo-Hookean and Ogden in closed form, not the project's own three-dimensional code, which
would be slower) and assembles the two forms with its vectorised assembly. One thread each,
processor time, medians, rounds alternating so that other load falls on both.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from skfem.helpers import ddot, grad

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.body.sparse import SparsePattern
from fem2d.materials.library import material_named
from fem2d.materials.ogden import Ogden

Array = NDArray[np.float64]
ROUNDS = 9


def block() -> skfem.MeshQuad:
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 20, 201), np.linspace(0, 12, 101))
    return mesh.with_subdomains({"dermis": lambda x: x[1] > 10.8, "bulk": lambda x: x[1] < 10.8})


def displaced(nodes: Array) -> Array:
    x, y = nodes.T
    return np.stack([0.02 * y + 5e-4 * np.sin(3 * x) * y, -0.1 * y + 4e-3 * np.cos(2 * x)], axis=1)


class SkfemAssembly:
    """The weak form in scikit-fem, plane strain or plane stress, one Ogden term an element."""

    def __init__(self, mesh: skfem.MeshQuad, mu: Array, alpha: Array, D: Array, plane: Plane):
        self.basis = skfem.CellBasis(mesh, skfem.ElementVector(skfem.ElementQuad1()), intorder=3)
        self.mu, self.alpha, self.D = mu[:, None], alpha[:, None], D[:, None]
        self.plane = plane

    def __call__(self, u: Array) -> tuple[Array, csr_matrix]:
        """Return nodal forces and stiffness at displacements in scikit-fem's numbering."""
        P, A = self.law(np.asarray(grad(self.basis.interpolate(u))))

        @skfem.LinearForm
        def force(v, w):
            return ddot(P, grad(v))

        @skfem.BilinearForm
        def stiffness(du, v, w):
            return ddot(np.einsum("ijkl...,kl...->ij...", A, grad(du)), grad(v))

        return force.assemble(self.basis), stiffness.assemble(self.basis)

    def law(self, H: Array) -> tuple[Array, Array]:
        """P and dP/dF in the plane from principal stretches, vectorised over all points."""
        F = np.moveaxis(H, (0, 1), (-2, -1)) + np.eye(2)
        n, s, N = np.linalg.svd(F)
        e = np.log(s)
        v, tau, c = self._principal(e)
        e1, e2 = e[..., 0], e[..., 1]
        m, d = (e1 + e2) / 2, (e1 - e2) / 2
        safe = np.where(d == 0, 1.0, d)
        quotient = np.where(d == 0, self.alpha / 2, np.sinh(self.alpha * safe) / np.sinh(2 * safe))
        gap = 2 * self.mu / self.alpha * np.exp(self.alpha * (m - v / 3) - 2 * m) * quotient
        turning = (gap * (s**2).sum(-1) - tau.sum(-1)) / (2 * s[..., 0] * s[..., 1])
        modes = np.zeros((*e1.shape, 2, 2, 2, 2))
        for i in range(2):
            for j in range(2):
                modes[..., i, i, j, j] = (c[..., i, j] - (i == j) * tau[..., i]) / (
                    s[..., i] * s[..., j]
                )
                if i != j:
                    modes[..., i, j, i, j], modes[..., i, j, j, i] = gap, turning
        P = (n * (tau / s)[..., None, :]) @ N
        A = np.einsum("...ijkl,...ai,...jb->...abkl", modes, n, N)
        A = np.einsum("...abkl,...ck,...ld->...abcd", A, n, N)
        return np.moveaxis(P, (-2, -1), (0, 1)), np.moveaxis(A, (-4, -3, -2, -1), (0, 1, 2, 3))

    def _principal(self, e: Array) -> tuple[Array, Array, Array]:
        v = e.sum(-1) if self.plane is Plane.STRAIN else self._volume(e)
        t, h = self._terms(e, v)
        J = np.exp(v)
        pull = J * 2 * (J - 1) / self.D
        tau = t - t.mean(-1, keepdims=True) + pull[..., None]
        shared = h.sum(-1) / 9 + pull + J**2 * 2 / self.D
        c = (
            shared[..., None, None]
            - (h[..., :, None] + h[..., None, :]) / 3
            + (h[..., None] * np.eye(3))
        )
        if self.plane is Plane.STRESS:
            c = c - c[..., :, 2:] * c[..., 2:, :] / c[..., 2:, 2:]
        return v, tau[..., :2], c[..., :2, :2]

    def _terms(self, e: Array, v: Array) -> tuple[Array, Array]:
        third = v - e.sum(-1)
        powers = np.exp(
            self.alpha[..., None] * (np.concatenate([e, third[..., None]], -1) - v[..., None] / 3)
        )
        return (2 * self.mu / self.alpha)[..., None] * powers, 2 * self.mu[..., None] * powers

    def _volume(self, e: Array) -> Array:
        v = np.zeros(e.shape[:-1])
        for _ in range(30):
            t, h = self._terms(e, v)
            J = np.exp(v)
            pull = J * 2 * (J - 1) / self.D
            rest = t[..., 2] - t.mean(-1) + pull
            slope = (h.sum(-1) + 3 * h[..., 2]) / 9 + pull + J**2 * 2 / self.D
            v = v - rest / slope
            if np.abs(rest).max() < 1e-9 * h.max():
                return v
        raise ArithmeticError("the thickness was not found")


def milliseconds(call: Callable[[], object]) -> float:
    start = time.process_time()
    call()
    return 1e3 * (time.process_time() - start)


def compared(mesh: skfem.MeshQuad, plane: Plane) -> None:
    laws = {name: material_named(f"L2-Ogden/{name}") for name in ("dermis", "bulk")}
    body = Body(mesh, laws, plane=plane, element="Q4")
    mu, alpha, D = (np.empty(mesh.nelements) for _ in range(3))
    for name, law in laws.items():
        here = mesh.subdomains[name]
        mu[here] = law.shear_modulus_mpa
        alpha[here] = law.alpha[0] if isinstance(law, Ogden) else 2.0
        D[here] = 2 / law.bulk_modulus_mpa
    peer = SkfemAssembly(mesh, mu, alpha, D, plane)
    order = np.empty(peer.basis.N, int)
    for component in range(2):
        order[peer.basis.element_dofs[component::2].T] = 2 * body.tables.connectivity + component
    u = displaced(body.nodes)
    theirs_u = u.ravel()[order]
    ours, theirs = body.response(u), peer(theirs_u)
    apart = np.abs(ours.force[order] - theirs[0]).max() / np.abs(theirs[0]).max()
    rows = body.pattern.matrix(ours.stiffness)[order][:, order]
    apart = max(apart, abs(rows - theirs[1]).max() / abs(theirs[1]).max())
    P, A = peer.law(np.asarray(grad(peer.basis.interpolate(theirs_u))))

    def forms_alone() -> None:
        skfem.LinearForm(lambda v, w: ddot(P, grad(v))).assemble(peer.basis)
        skfem.BilinearForm(
            lambda du, v, w: ddot(np.einsum("ijkl...,kl...->ij...", A, grad(du)), grad(v))
        ).assemble(peer.basis)

    calls: dict[str, Callable[[], object]] = {
        "compiled, force and stiffness": lambda: body.pattern.matrix(body.response(u).stiffness),
        "compiled, projected": lambda: body.response(u, psd=True),
        "compiled, force only": lambda: body.energy_and_force(u),
        "scikit-fem, law and forms": lambda: peer(theirs_u),
        "scikit-fem, forms alone": forms_alone,
    }
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            times[name].append(milliseconds(call))
    medians = {name: statistics.median(rounds) for name, rounds in times.items()}
    print(f"\nplane {plane.name.lower()}: largest difference of the two {apart:.1e} (relative)")
    for name, median in medians.items():
        low, high = min(times[name]), max(times[name])
        print(f"  {name:<32}{median:9.1f} ms   ({low:.1f} to {high:.1f})")
    base = medians["compiled, force and stiffness"]
    print(f"  ratio, law and forms   {medians['scikit-fem, law and forms'] / base:5.1f}")
    print(f"  ratio, forms alone     {medians['scikit-fem, forms alone'] / base:5.1f}")


def main() -> None:
    mesh = block()
    print(f"{mesh.nelements} four-node elements, {2 * mesh.p.shape[1]} unknowns, {ROUNDS} rounds")
    for plane in (Plane.STRAIN, Plane.STRESS):
        compared(mesh, plane)
    tables = Body(mesh, material_named("L1"), plane=Plane.STRAIN, element="Q4").tables
    setup = milliseconds(lambda: SparsePattern.of(tables.connectivity, len(tables.nodes)))
    print(f"\nsparsity pattern, once a mesh: {setup:.0f} ms")


if __name__ == "__main__":
    main()
