"""A body: a mesh and its materials as one function of the nodal displacements.

The weak form is ∫ P(F) : ∇v dV = external work, with F = I + ∇u filled up by the plane assumption
(:mod:`fem2d.body.kinematics`). ``tests/fem2d/body/test_body_against_skfem.py`` states it with
scikit-fem's forms and compares.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import skfem
from numpy.typing import ArrayLike, NDArray

from fem2d.body.assembly import assemble, section_components, section_stresses
from fem2d.body.elements import Element, Tables, element_named
from fem2d.body.kinematics import Plane
from fem2d.body.sparse import SparsePattern
from fem2d.materials.material import Material, MaterialError
from fem2d.threads import ONE_THREAD, Threads
from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


SMALL_BODY = 500
"""Bodies of fewer elements are summed in one go: handing half to a second thread costs more."""


class BodyError(DrinksimError):
    """A body was described or questioned in a way that makes no sense."""


@dataclass(frozen=True, eq=False)
class Response:
    """What a body answers to a displacement.

    Attributes
    ----------
    energy
        Strain energy, N mm; infinite if a point is turned inside out or otherwise inadmissible.
    force
        (2n,) derivative of the energy with respect to the displacements, N.
    stiffness
        (nnz,) derivative of the force, N/mm, data of the body's sparsity pattern; empty if it was
        not asked for.
    """

    energy: float
    force: Array
    stiffness: Array


@dataclass(frozen=True, eq=False)
class Fields:
    """What a deformed body looks like at its integration points.

    Attributes
    ----------
    deformation_gradient
        (e, q, 3, 3).
    log_strain
        (e, q, 3) principal logarithmic strains, ascending; the third direction is one of them.
    cauchy
        (e, q, 3, 3) true stress, MPa.
    von_mises
        (e, q) von Mises stress, MPa.
    thickness_stretch
        (e, q) F₃₃: thickness over thickness, or r/R in axisymmetry.
    energy_density
        (e, q) strain energy, MPa (of the point; mean-dilatation elements share their volumetric
        energy, which is counted here with the element's mean volume ratio).
    volume
        (e, q) reference volume the point stands for, mm³.
    """

    deformation_gradient: Array
    log_strain: Array
    cauchy: Array
    von_mises: Array
    thickness_stretch: Array
    energy_density: Array
    volume: Array


@dataclass(frozen=True, eq=False)
class Body:
    """A section of hyperelastic material, meshed.

    Build one with :meth:`of`. Displacements ``u`` are (n, 2) in mm (or anything that reshapes to
    it); unknown ``2 * node + component``.

    Attributes
    ----------
    mesh
        scikit-fem's mesh with its named boundaries and subdomains.
    element
        Element type.
    plane
        Assumption about the third direction.
    thickness_mm
        Thickness of the section (unused in axisymmetry, where a full turn is integrated).
    materials
        The materials, and ``material_of`` (e,) which one each element has.
    tables
        Nodes, connectivity and shape functions.
    weights
        (e, q) reference volume each integration point stands for, mm³.
    pattern
        Sparsity pattern of the stiffness.
    in_halves
        Whether a large body is summed in two halves, which two threads can share.
    """

    mesh: skfem.Mesh
    element: Element
    plane: Plane
    thickness_mm: float
    materials: tuple[Material, ...]
    material_of: Index
    tables: Tables
    weights: Array
    pattern: SparsePattern
    in_halves: bool = True

    @classmethod
    def of(
        cls,
        mesh: skfem.Mesh,
        materials: Material | Mapping[str, Material],
        *,
        plane: Plane,
        element: str = "T6",
        thickness_mm: float = 1.0,
    ) -> Body:
        """Return the body made of ``mesh``.

        Parameters
        ----------
        mesh
            Triangles or quadrilaterals, mm. In axisymmetry x is the distance from the axis.
        materials
            One material for everything, or one for each named subdomain of the mesh.
        plane
            Plane stress, plane strain or axisymmetry.
        element
            Name of an element type, see :mod:`fem2d.body.elements`.
        thickness_mm
            Thickness of the section, mm.

        Raises
        ------
        BodyError
            If subdomains and materials do not match, or the thickness is not positive.
        ElementError
            If the element does not exist or does not fit the mesh.
        """
        kind = element_named(element)
        if not (np.isfinite(thickness_mm) and thickness_mm > 0):
            raise BodyError(f"thickness_mm = {thickness_mm:g} is not positive: 1.0 is usual")
        if kind.mean_dilatation and plane is Plane.STRESS:
            raise BodyError(
                f"element {element} averages volume changes, which plane stress leaves free: "
                f"use {element.rstrip('M')}"
            )
        tables = Tables.of(mesh, kind)
        radius = tables.points[..., 0]
        if plane is Plane.AXISYMMETRIC and not np.all(radius > 0):
            raise BodyError(
                f"an axisymmetric mesh reaches x = {radius.min():g} mm: x is the distance from the "
                "axis and cannot be negative"
            )
        weights = tables.areas * (
            2 * np.pi * radius if plane is Plane.AXISYMMETRIC else thickness_mm
        )
        laws, material_of = _assigned(mesh, materials)
        return cls(
            mesh,
            kind,
            plane,
            float(thickness_mm),
            laws,
            material_of,
            tables,
            np.ascontiguousarray(weights),
            SparsePattern.of(tables.connectivity, len(tables.nodes)),
        )

    @property
    def nodes(self) -> Array:
        """(n, 2) reference positions of all nodes, mm, mid-side nodes included."""
        return self.tables.nodes

    def component(self, nodes: NDArray[np.integer]) -> Body:
        """Return the body made of the elements on some nodes (n,), ascending, and no others.

        Its nodes have the same order. It is summed in one go, because components share the threads.

        Raises
        ------
        BodyError
            If the elements have other nodes too, or not all of these.
        """
        number = np.full(len(self.nodes), -1)
        number[nodes] = np.arange(len(nodes))
        connectivity = number[self.tables.connectivity]
        elements = np.flatnonzero(connectivity[:, 0] >= 0)
        connectivity = connectivity[elements]
        if not np.array_equal(np.unique(connectivity), np.arange(len(nodes))):
            raise BodyError(
                f"{len(nodes)} nodes are no component: their elements have other nodes too"
            )
        mesh = self.mesh.restrict(elements)
        tables = Tables.of(mesh, self.element)
        renumbered = np.empty(len(nodes), np.int64)
        renumbered[tables.connectivity] = connectivity
        return replace(
            self,
            mesh=mesh,
            material_of=self.material_of[elements],
            tables=tables.renumbered(renumbered),
            weights=self.weights[elements],
            pattern=SparsePattern.of(connectivity, len(nodes)),
            in_halves=False,
        )

    def response(
        self, u: ArrayLike, *, psd: bool = False, threads: Threads = ONE_THREAD
    ) -> Response:
        """Return energy, force and stiffness at displacements ``u`` (n, 2), mm.

        A pure function. With ``psd`` the tangent of every integration point is clamped to
        positive semi-definite, which makes any step downhill; the force stays exact. An
        inadmissible ``u`` gives infinite energy and finite arrays. ``threads`` share the work and
        change no bit.
        """
        return self._assembled(u, 2, psd, threads)

    def energy_and_force(self, u: ArrayLike) -> Response:
        """Return energy and force at displacements ``u`` (n, 2), mm, without the stiffness."""
        return self._assembled(u, 1, False, ONE_THREAD)

    def fields(self, u: ArrayLike) -> Fields:
        """Return strains and stresses at displacements ``u`` (n, 2), mm.

        Raises
        ------
        MaterialError
            If a point is turned inside out: ask only for displacements of finite energy.
        """
        displacement = self._displacement(u)
        entries = np.empty((*self.weights.shape, 5))
        section_components(
            displacement,
            self.tables.connectivity,
            self.tables.gradients,
            self.tables.values,
            self._radius,
            self.plane.value,
            entries,
        )
        piola, energy = np.zeros_like(entries), np.empty(self.weights.shape)
        section_stresses(entries, self._rows, self.material_of, self.plane.value, energy, piola)
        F = np.zeros((*self.weights.shape, 3, 3))
        F[..., :2, :2] = entries[..., :4].reshape(*self.weights.shape, 2, 2)
        F[..., 2, 2] = entries[..., 4]
        F11, F12, F21, F22, F33 = np.moveaxis(entries, -1, 0)
        J = (F11 * F22 - F12 * F21) * F33
        mean_J = np.sum(self.weights * J, axis=1) / np.sum(self.weights, axis=1)
        if not np.all(np.isfinite(energy)):
            at = np.unravel_index(np.argmax(~np.isfinite(energy)), energy.shape)
            raise MaterialError(
                f"J = {J[at]:.4g} at a point of element {at[0]}: ask only for displacements of "
                "finite energy"
            )
        cauchy = np.zeros_like(F)
        section = piola[..., :4].reshape(*J.shape, 2, 2)
        cauchy[..., :2, :2] = section @ np.swapaxes(F[..., :2, :2], -1, -2) / J[..., None, None]
        cauchy[..., 2, 2] = piola[..., 4] * F[..., 2, 2] / J
        if self.element.mean_dilatation:
            for number, law in enumerate(self.materials):
                here = self.material_of == number
                mean = np.broadcast_to(mean_J[here][:, None], J[here].shape)
                at_mean, at_point = law.volumetric(mean), law.volumetric(J[here])
                cauchy[here] += (at_mean[1] - at_point[1])[..., None, None] * np.eye(3)
                energy[here] += at_mean[0] - at_point[0]
        deviator = cauchy - np.trace(cauchy, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
        return Fields(
            F,
            _log_stretches(F),
            cauchy,
            np.sqrt(1.5 * np.sum(deviator**2, axis=(-2, -1))),
            entries[..., 4],
            energy,
            self.weights,
        )

    def mass(self, density_tonne_per_mm3: float) -> Array:
        """Return the consistent mass matrix, tonne, as data (nonzeros,) of the body's pattern."""
        _, values, weights = self._mass_quadrature
        block = density_tonne_per_mm3 * np.einsum("eq,qa,qb->eab", weights, values, values)
        con = self.tables.connectivity
        data = np.zeros(self.pattern.nonzeros)
        first = self.pattern.node_pairs(con[:, :, None], con[:, None, :])
        np.add.at(data, first, block)
        np.add.at(data, first + self.pattern.row_length[con][:, :, None] + 1, block)
        return data

    def lumped_mass(self, density_tonne_per_mm3: float) -> Array:
        """Return a diagonal mass matrix (2n,), tonne, positive everywhere.

        The diagonal of each element's consistent mass, scaled to the element's mass (Hinton, Rock
        and Zienkiewicz 1976): row sums would leave the corners of quadratic elements without mass.
        """
        _, values, weights = self._mass_quadrature
        diagonal = np.einsum("eq,qa->ea", weights, values**2)
        diagonal *= (weights.sum(axis=1) / diagonal.sum(axis=1))[:, None]
        nodal = np.bincount(
            self.tables.connectivity.ravel(), diagonal.ravel(), minlength=len(self.nodes)
        )
        return np.repeat(density_tonne_per_mm3 * nodal, 2)

    def edges(self, boundary: str) -> Index:
        """Return the edges of a named boundary in the order in which they follow one another.

        (m, 3) nodes first, last, middle, or (m, 2) for linear elements; the body lies on the left
        of first → last. A boundary in several pieces gives them one after another, the piece with
        the lowest-numbered first edge first.
        """
        facets = self._facets(boundary)
        first, last = self.mesh.facets[:, facets]
        inside = self.mesh.p[:, self.mesh.t[:, self.mesh.f2t[0, facets]]].mean(axis=1)
        start, end = self.mesh.p[:, first], self.mesh.p[:, last]
        along, across = end - start, inside - start
        flip = along[0] * across[1] - along[1] * across[0] < 0
        first, last = np.where(flip, last, first), np.where(flip, first, last)
        columns = [self._node_of_vertex[first], self._node_of_vertex[last]]
        if self.element.quadratic:
            columns.append(self.tables.facet_nodes[facets])
        edges = np.stack(columns, axis=1).astype(np.int64)
        return edges[_chained(edges[:, 0], edges[:, 1])]

    def boundary_nodes(self, boundary: str) -> Index:
        """Return the nodes (m,) on a named boundary, ascending."""
        return np.unique(self.edges(boundary))

    def elements_of(self, subdomain: str) -> Index:
        """Return the elements (m,) of a named subdomain, ascending."""
        names = self.mesh.subdomains or {}
        if subdomain not in names:
            raise BodyError(_unknown("subdomain", subdomain, names))
        return np.unique(np.asarray(names[subdomain], np.int64))

    def _facets(self, boundary: str) -> Index:
        names = self.mesh.boundaries or {}
        if boundary not in names:
            raise BodyError(_unknown("boundary", boundary, names))
        return np.unique(np.asarray(names[boundary], np.int64))

    def _displacement(self, u: ArrayLike) -> Array:
        displacement = np.ascontiguousarray(np.asarray(u, float).reshape(-1, 2))
        if displacement.shape != self.nodes.shape:
            raise BodyError(
                f"displacements of {len(displacement)} nodes for a body of {len(self.nodes)}: "
                "give (n, 2) with mid-side nodes included"
            )
        return displacement

    def _assembled(self, u: ArrayLike, order: int, psd: bool, threads: Threads) -> Response:
        displacement = self._displacement(u)

        def summed(first: int, last: int) -> Response:
            force = np.zeros(self.nodes.shape)
            data = np.zeros(self.pattern.nonzeros if order == 2 else 0)
            energy = assemble(
                displacement,
                self.tables.connectivity,
                self.tables.gradients,
                self.tables.values,
                self.weights,
                self._radius,
                self._rows,
                self.material_of,
                self.plane.value,
                self.element.mean_dilatation,
                order,
                psd,
                self._first_slot,
                self.pattern.row_length,
                first,
                last,
                force,
                data,
            )
            return Response(float(energy), force.ravel(), data)

        # Always the same two halves, whatever runs them: the bits do not depend on the machine.
        elements = len(self.tables.connectivity)
        if elements < SMALL_BODY or not self.in_halves:
            return summed(0, elements)
        middle = elements // 2
        half, rest = threads.run([partial(summed, 0, middle), partial(summed, middle, elements)])
        half.force[:] += rest.force
        half.stiffness[:] += rest.stiffness
        return Response(half.energy + rest.energy, half.force, half.stiffness)

    @cached_property
    def _mass_quadrature(self) -> tuple[Array, Array, Array]:
        """Points, shape functions (q, a) and volumes (e, q) that integrate products of shapes."""
        tables = Tables.of(self.mesh, Element(self.element.name, self.element.shape, 5))
        depth = (
            2 * np.pi * tables.points[..., 0]
            if self.plane is Plane.AXISYMMETRIC
            else self.thickness_mm
        )
        return tables.points, tables.values, tables.areas * depth

    @cached_property
    def _radius(self) -> Array:
        return np.ascontiguousarray(self.tables.points[..., 0])

    @cached_property
    def _rows(self) -> Array:
        rows = [law.packed() for law in self.materials]
        table = np.zeros((len(rows), max(map(len, rows))))
        for target, row in zip(table, rows, strict=True):
            target[: len(row)] = row
        return table

    @cached_property
    def _first_slot(self) -> NDArray[np.int32]:
        con = self.tables.connectivity
        return self.pattern.node_pairs(con[:, :, None], con[:, None, :]).astype(np.int32)

    @cached_property
    def _node_of_vertex(self) -> Index:
        corners = self.mesh.t.shape[0]
        node = np.zeros(self.mesh.p.shape[1], np.int64)
        node[self.mesh.t.T] = self.tables.connectivity[:, :corners]
        return node


def _log_stretches(F: Array) -> Array:
    """Return the logarithms (..., 3), ascending, of the stretches of a section's F (..., 3, 3).

    In the plane, the sum and the difference of the two stretches are the lengths of the parts of F
    that commute and anticommute with a quarter turn.
    """
    a, b, c, d = F[..., 0, 0], F[..., 0, 1], F[..., 1, 0], F[..., 1, 1]
    total, apart = np.hypot(a + d, b - c), np.hypot(a - d, b + c)
    larger = 0.5 * (total + apart)
    smaller = np.abs(a * d - b * c) / larger
    return np.sort(np.log(np.stack([larger, smaller, F[..., 2, 2]], axis=-1)), axis=-1)


def _assigned(
    mesh: skfem.Mesh, materials: Material | Mapping[str, Material]
) -> tuple[tuple[Material, ...], Index]:
    """Return the materials and which one each element has."""
    elements = mesh.t.shape[1]
    if not isinstance(materials, Mapping):
        return (materials,), np.zeros(elements, np.int64)
    subdomains: Mapping[str, Any] = mesh.subdomains or {}
    which = np.full(elements, -1, np.int64)
    for number, name in enumerate(materials):
        if name not in subdomains:
            raise BodyError(_unknown("subdomain", name, subdomains))
        inside = np.asarray(subdomains[name], np.int64)
        if np.any(which[inside] >= 0):
            other = list(materials)[which[inside].max()]
            raise BodyError(
                f"subdomains {other!r} and {name!r} overlap: give each element one material"
            )
        which[inside] = number
    if np.any(which < 0):
        bare = [n for n in subdomains if n not in materials]
        raise BodyError(
            f"{np.count_nonzero(which < 0)} elements have no material: name one for "
            + (", ".join(bare) if bare else "every element, the mesh has cells in no subdomain")
        )
    return tuple(materials.values()), which


def _unknown(kind: str, name: str, known: Mapping[str, Any]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    listed = ", ".join(sorted(known)) if known else "none"
    return (
        f"the mesh has no {kind} called {name!r}"
        + (f": did you mean {near[0]!r}?" if near else "")
        + f" (it has {listed})"
    )


def _chained(first: Index, last: Index) -> Index:
    """Return the order in which edges first → last follow one another, piece after piece."""
    follower = {int(node): i for i, node in enumerate(first)}
    has_predecessor = set(map(int, last))
    starts = [i for i, node in enumerate(first) if int(node) not in has_predecessor]
    order: list[int] = []
    seen: set[int] = set()
    for start in [*starts, *range(len(first))]:
        at: int | None = start
        while at is not None and at not in seen:
            seen.add(at)
            order.append(at)
            at = follower.get(int(last[at]))
    return np.array(order, np.int64)
