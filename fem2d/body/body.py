"""A body: a mesh and its materials as one function of the nodal displacements.

The weak form is ∫ P(F) : ∇v dV = external work, with F = I + ∇u filled up by the plane assumption
(:mod:`fem2d.body.kinematics`). ``tests/fem2d/body/test_body_against_skfem.py`` states it with
scikit-fem's forms and compares.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property, partial

import numpy as np
import skfem
from numpy.typing import ArrayLike, NDArray

from fem2d.body.assembly import assemble, section_components, section_stresses
from fem2d.body.definition import (
    BodyError,
    materials_by_element,
    plane_named,
    section_depth,
    unknown_name,
)
from fem2d.body.elements import Element, Tables, element_named
from fem2d.body.fields import Fields, fields_from
from fem2d.body.kinematics import Plane
from fem2d.body.sparse import SparsePattern
from fem2d.body.surface import Surface
from fem2d.materials.fibre_kernels import FIBRES
from fem2d.materials.material import Material
from fem2d.threads import ONE_THREAD, Threads

Array = NDArray[np.float64]
Index = NDArray[np.int64]


SMALL_BODY = 500
"""Bodies of fewer elements are summed in one loop: a second thread costs more than it saves."""


UNSTRETCHED = np.array([[[1.0, 0.0, 0.0, 1.0, 1.0]]])
"""(1, 1, 5) components of F in a body that is free of stress."""


@dataclass(frozen=True, eq=False)
class Response:
    """Energy, force and stiffness of a body at a displacement.

    Attributes
    ----------
    energy
        Strain energy, N mm; infinite if the deformation is inadmissible: a volume ratio that is not
        positive, or no thickness that balances plane stress.
    force
        (2n,) derivative of the energy with respect to the displacements, N.
    stiffness
        (nnz,) derivative of the force, N/mm, as data of the body's sparsity pattern; empty if only
        the force was computed.
    """

    energy: float
    force: Array
    stiffness: Array


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Body:
    """A section of hyperelastic material, meshed.

    Displacements ``u`` are (n, 2) in mm (or anything that reshapes to it); unknown
    ``2 * node + component``.

    Parameters
    ----------
    mesh
        scikit-fem's triangles or quadrilaterals, mm, with named boundaries and subdomains. In
        axisymmetry x is the distance from the axis.
    materials
        One material for everything, or one for each named subdomain of the mesh.
    plane
        Assumption about the third direction: ``"stress"``, ``"strain"`` or ``"axisymmetric"``.
    element
        Name of an element type, see :mod:`fem2d.body.elements`.
    thickness_mm
        Thickness of the section, mm; unused in axisymmetry, where a full turn is integrated.

    Raises
    ------
    BodyError
        If subdomains and materials do not match, the plane is unknown, or the thickness is not
        positive.
    ElementError
        If the element does not exist or does not fit the mesh.

    Examples
    --------
    >>> from fem2d.materials.ogden import Ogden
    >>> skin = Ogden(mu_mpa=[0.05], alpha=[10.789], poisson=0.49)
    >>> Body(skfem.MeshTri().refined(2), skin, plane="stress")
    Body(32 T6, 81 nodes, plane stress)
    """

    mesh: skfem.Mesh
    element: Element
    plane: Plane
    thickness_mm: float
    materials: tuple[Material, ...]
    material_of: Index
    """(e,) which material each element has."""
    tables: Tables
    """Nodes, connectivity and shape functions."""
    weights: Array
    """(e, q) reference volume each integration point stands for, mm³."""
    pattern: SparsePattern
    """Sparsity pattern of the stiffness."""
    in_halves: bool
    """Whether a large body is summed in two halves, which two threads can share."""
    prestretch: Array | None
    """(e, q, 5) components of F of the undeformed body from where it is free of stress, or None."""

    def __init__(
        self,
        mesh: skfem.Mesh,
        materials: Material | Mapping[str, Material],
        *,
        plane: Plane | str,
        element: str = "T6",
        thickness_mm: float = 1.0,
    ) -> None:
        kind, assumed = element_named(element), plane_named(plane)
        if not (np.isfinite(thickness_mm) and thickness_mm > 0):
            raise BodyError(f"thickness_mm = {thickness_mm:g} is not positive: 1.0 is usual")
        if kind.mean_dilatation and assumed is Plane.STRESS:
            raise BodyError(
                f"element {element} averages volume changes, which plane stress leaves free: "
                f"use {element.rstrip('M')}"
            )
        tables = Tables.of(mesh, kind)
        laws, material_of = materials_by_element(mesh, materials)
        depth = section_depth(tables, assumed, thickness_mm)
        self._set(
            mesh=mesh,
            element=kind,
            plane=assumed,
            thickness_mm=float(thickness_mm),
            materials=laws,
            material_of=material_of,
            tables=tables,
            weights=np.ascontiguousarray(tables.areas * depth),
            pattern=SparsePattern.of(tables.connectivity, len(tables.nodes)),
            in_halves=True,
            prestretch=None,
        )

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _changed(self, **changes: object) -> Body:
        """Return the body with some of its attributes changed."""
        other = object.__new__(Body)
        other._set(**{f.name: getattr(self, f.name) for f in fields(self)} | changes)
        return other

    def __repr__(self) -> str:
        return (
            f"Body({len(self.tables.connectivity)} {self.element.name}, {len(self.nodes)} nodes, "
            f"plane {self.plane.name.lower()})"
        )

    @property
    def nodes(self) -> Array:
        """(n, 2) reference positions of all nodes, mm, mid-side nodes included."""
        return self.tables.nodes

    def with_materials(self, materials: tuple[Material, ...]) -> Body:
        """Return the body made of other materials, one for each of :attr:`materials`."""
        if len(materials) != len(self.materials):
            raise BodyError(
                f"{len(materials)} materials for a body of {len(self.materials)}: give as many"
            )
        return self._changed(materials=tuple(materials))

    def with_prestretch(self, prestretch: Array) -> Body:
        """Return the body under stress where it is: its points are stretched by G (e, q, 5).

        The law then sees ``F G`` in place of F, and strains are those from where the material is
        free of stress. G has the components of :mod:`fem2d.body.kinematics`; in plane stress its
        G₃₃ only tells how thick the material was.

        Raises
        ------
        BodyError
            If there is not one G for each point, or one turns the material inside out.
        """
        if prestretch.shape != (*self.weights.shape, 5):
            raise BodyError(
                f"prestretch of shape {prestretch.shape} for {self.weights.shape} integration "
                "points: give five components for each"
            )
        if not np.all(_determinant(prestretch) > 0):
            raise BodyError(
                f"a prestretch has the determinant {_determinant(prestretch).min():g}: it must be "
                "positive"
            )
        return self._changed(prestretch=np.ascontiguousarray(prestretch))

    def component(self, nodes: NDArray[np.integer]) -> Body:
        """Return the body made of the elements on some nodes (n,), ascending, and no others.

        Its nodes keep their order. It is summed in one loop: components share the threads.

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
        return self._changed(
            mesh=mesh,
            material_of=self.material_of[elements],
            tables=tables.renumbered(renumbered),
            weights=self.weights[elements],
            pattern=SparsePattern.of(connectivity, len(nodes)),
            in_halves=False,
            prestretch=None if self.prestretch is None else self.prestretch[elements],
        )

    def response(
        self, u: ArrayLike, *, psd: bool = False, threads: Threads = ONE_THREAD
    ) -> Response:
        """Return energy, force and stiffness at displacements ``u`` (n, 2), mm.

        A pure function. With ``psd`` the tangent of every integration point is clamped to
        positive semi-definite, which makes any step downhill; the force stays exact. An
        inadmissible ``u`` gives infinite energy and finite arrays. ``threads`` share the work; the
        result is the same to the last bit for one and for two.
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
            If a volume ratio is not positive: fields exist where the energy is finite.
        """
        components, piola, energy = self._point_responses(u)
        return fields_from(
            components, piola, energy, self.free_volumes, self.materials, self.material_of,
            mean_dilatation=self.element.mean_dilatation,
        )  # fmt: skip

    def _point_responses(self, u: ArrayLike) -> tuple[Array, Array, Array]:
        """Return F, P (e, q, 5), as in :mod:`fem2d.body.kinematics`, and ψ (e, q) of the points."""
        tables, plane = self.tables, self.plane.value
        components = np.empty((*self.weights.shape, 5))
        section_components(
            self._displacement(u), tables.connectivity, self.free_gradients, tables.values,
            self.free_radius, self.start, plane, components,
        )  # fmt: skip
        piola, energy = np.zeros_like(components), np.empty(self.weights.shape)
        section_stresses(
            components, self._laws, self.material_of, plane, False, 1, False, self._fibres, energy,
            piola,
        )  # fmt: skip
        return components, piola, energy

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
        of first → last. A boundary of several separate stretches gives them one after another, the
        one with the lowest-numbered first edge first.
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

    def surface(
        self,
        *boundaries: str,
        points_per_edge: int = 4,
        at_nodes: bool = False,
        between_nodes: int = 0,
    ) -> Surface:
        """Return one or several named boundaries as a surface that can be touched or loaded.

        Several ones must follow one another, the body on the left. For the points see `Surface`.
        """
        return Surface(
            np.concatenate([self.edges(boundary) for boundary in boundaries]),
            self.nodes,
            self.thickness_mm,
            points_per_edge,
            self.plane is Plane.AXISYMMETRIC,
            at_nodes,
            between_nodes,
        )

    def dofs(self, *boundaries: str, along: str = "xy") -> Index:
        """Return the unknowns (h,), ascending, on named boundaries, along x, y or both."""
        nodes = np.unique(np.concatenate([self.boundary_nodes(name) for name in boundaries]))
        components = np.array(["xy".index(axis) for axis in sorted(along)])
        unknowns: Index = (2 * nodes[:, None] + components).ravel()
        return unknowns

    def boundary_nodes(self, boundary: str) -> Index:
        """Return the nodes (m,) on a named boundary, ascending."""
        return np.unique(self.edges(boundary))

    def elements_of(self, subdomain: str) -> Index:
        """Return the elements (m,) of a named subdomain, ascending."""
        names = self.mesh.subdomains or {}
        if subdomain not in names:
            raise BodyError(unknown_name("mesh", "subdomain", subdomain, names))
        return np.unique(np.asarray(names[subdomain], np.int64))

    def _facets(self, boundary: str) -> Index:
        names = self.mesh.boundaries or {}
        if boundary not in names:
            raise BodyError(unknown_name("mesh", "boundary", boundary, names))
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
                self.free_gradients,
                self.tables.values,
                self.free_volumes,
                self.free_radius,
                self.start,
                self._laws,
                self.material_of,
                self.plane.value,
                self.element.mean_dilatation,
                order,
                psd,
                self._fibres,
                self._first_slot,
                self.pattern.row_length,
                first,
                last,
                force,
                data,
            )
            return Response(float(energy), force.ravel(), data)

        # Always the same two halves, so that bits do not depend on the number of threads.
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
        depth = section_depth(tables, self.plane, self.thickness_mm)
        return tables.points, tables.values, tables.areas * depth

    @cached_property
    def start(self) -> Array:
        """(e, q, 5) components of F in the undeformed body; (1, 1, 5) if it is free of stress."""
        return UNSTRETCHED if self.prestretch is None else self.prestretch

    @cached_property
    def free_gradients(self) -> Array:
        """(e, q, a, 2) shape gradients where the material is free of stress, Gᵀ ∇N, 1/mm."""
        if self.prestretch is None:
            return self.tables.gradients
        G = self.prestretch[..., :4].reshape(*self.weights.shape, 2, 2)
        return np.ascontiguousarray(self.tables.gradients @ G)

    @cached_property
    def free_volumes(self) -> Array:
        """(e, q) volume that each point stands for where the material is free of stress, mm³."""
        if self.prestretch is None:
            return self.weights
        return np.ascontiguousarray(self.weights / _determinant(self.prestretch))

    @cached_property
    def free_radius(self) -> Array:
        """(e, q) distance from the axis, over G₃₃, mm; unused unless axisymmetric."""
        radius = np.ascontiguousarray(self.tables.points[..., 0])
        return radius if self.prestretch is None else radius / self.prestretch[..., 4]

    @cached_property
    def _laws(self) -> Array:
        rows = [law.packed() for law in self.materials]
        table = np.zeros((len(rows), max(map(len, rows))))
        for target, row in zip(table, rows, strict=True):
            target[: len(row)] = row
        return table

    @cached_property
    def _fibres(self) -> bool | None:
        """True if a law has fibres, else None: see `fem2d.body.assembly.section_response`."""
        return True if np.any(self._laws[:, 0] == FIBRES) else None

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


def _determinant(components: Array) -> Array:
    """Return the determinants (...,) of components (..., 5)."""
    F11, F12, F21, F22, F33 = np.moveaxis(components, -1, 0)
    determinant: Array = (F11 * F22 - F12 * F21) * F33
    return determinant


def _chained(first: Index, last: Index) -> Index:
    """Return the order in which edges first → last follow one another, chain after chain."""
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
