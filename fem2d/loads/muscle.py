"""Muscles: fibres beside the tissue that pull when they are active.

A muscle fills a share ``φ`` of the tissue's reference volume with fibres whose nominal tension
``T₀`` is a function of their stretch and of an activation against time
(:mod:`fem2d.loads.muscle_law`). Its energy is ``W = ∫ φ w(λ) dV`` with ``w′ = T₀``. Two kinds of
fibres differ in what stretches them.

*Across the section* (orbicularis oris). A tension along the third direction does nothing in plane
strain, and in plane stress there is no tissue behind the section that could hold it. What acts in
the plane is the fibres' curvature: with the curvature vector ``k``, 1/mm, that points to the centre
of curvature,

    λ = λ_c (1 − k·u),   force on the tissue for each volume: + φ T₀ λ_c k
    stiffness: φ T₀′ λ_c² k ⊗ k

``λ_c`` is the stretch of the mouth's corners, which the section does not know. With ``k = −e_r/R``
this is the hoop stretch 1 + u_r/R of axisymmetry.

*In the section* (mentalis, levator, depressor). With the undeformed direction ``a`` (a unit vector)
the stretch is ``|F a|`` and the nominal stress ``φ T₀ (F a) ⊗ a/|F a|``.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem2d.body.body import Body, Response
from fem2d.body.component import ABSENT, BodyComponent
from fem2d.body.sparse import SparsePattern
from fem2d.body.surface import Surface
from fem2d.loads.amplitude import Amplitude, LoadError
from fem2d.loads.load import Load
from fem2d.loads.muscle_kernels import assemble_across, assemble_in_plane
from fem2d.loads.muscle_law import MuscleFibre

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class FibresAcross:
    """Fibres that run across the section.

    Parameters
    ----------
    curvature_per_mm
        (e, q, 2) curvature vector at the body's integration points, towards the centre, 1/mm.
    corner_stretch
        Stretch λ_c of the mouth's corners.
    """

    curvature_per_mm: Array
    corner_stretch: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.corner_stretch) and self.corner_stretch > 0):
            raise LoadError(f"corner_stretch = {self.corner_stretch:g} must be positive: 1 is rest")

    @property
    def vectors(self) -> Array:
        """(e, q, 2) what describes them at each point."""
        return self.curvature_per_mm

    def stretch(self, body: Body, elements: Index, displacement: Array) -> Array:
        """Return the stretch (m, q) of the fibres in some elements (m,)."""
        moved = displacement[body.tables.connectivity[elements]]
        there = np.einsum("qa,mai->mqi", body.tables.values, moved)
        along = np.sum(self.curvature_per_mm[elements] * there, axis=-1)
        stretch: Array = self.corner_stretch * (1.0 - along)
        return stretch


@dataclass(frozen=True, eq=False)
class FibresInPlane:
    """Fibres that run in the section.

    Parameters
    ----------
    direction
        (e, q, 2) unit vectors along the undeformed fibres at the body's integration points.
    """

    direction: Array

    def __post_init__(self) -> None:
        if not np.allclose(np.linalg.norm(self.direction, axis=-1), 1.0, rtol=0.0, atol=1e-9):
            raise LoadError("directions of fibres must be unit vectors: divide by their length")

    @property
    def vectors(self) -> Array:
        """(e, q, 2) what describes them at each point."""
        return self.direction

    def stretch(self, body: Body, elements: Index, displacement: Array) -> Array:
        """Return the stretch (m, q) of the fibres in some elements (m,)."""
        moved = displacement[body.tables.connectivity[elements]]
        direction = self.direction[elements]
        along = np.einsum("mqai,mqi->mqa", body.tables.gradients[elements], direction)
        stretched = direction + np.einsum("mqa,mai->mqi", along, moved)
        stretch: Array = np.hypot(stretched[..., 0], stretched[..., 1])
        return stretch


@dataclass(frozen=True, eq=False)
class MuscleLoad:
    """A muscle in a body.

    Parameters
    ----------
    name
        Name in reports.
    body
        The tissue it lies in.
    share
        (e, q) share φ (0…1) of the volume at each integration point that is fibres; 0 elsewhere.
    fibres
        How they run.
    law
        Their tension at a stretch.
    activation
        How active they are (0…1) against time.

    Raises
    ------
    LoadError
        If a share or an activation lies outside 0…1, fields do not belong to the body's points, or
        the muscle lies nowhere in it.
    """

    name: str
    body: Body
    share: Array
    fibres: FibresAcross | FibresInPlane
    law: MuscleFibre
    activation: Amplitude
    elements: Index = field(init=False, repr=False)
    """(m,) elements in which there are fibres."""

    def __post_init__(self) -> None:
        points = self.body.weights.shape
        if self.share.shape != points or self.fibres.vectors.shape != (*points, 2):
            raise LoadError(
                f"muscle {self.name!r}: shares {self.share.shape} and fibres "
                f"{self.fibres.vectors.shape} for a body with {points} integration points: give "
                "one of each for every point"
            )
        if not (np.all(self.share >= 0) and np.all(self.share <= 1)):
            raise LoadError(f"muscle {self.name!r}: its share of the volume must lie in 0…1")
        if not all(0 <= factor <= 1 for factor in self.activation.factor):
            raise LoadError(
                f"muscle {self.name!r}: activation {self.activation.factor} must lie in 0…1: no "
                "muscle does more than all its fibres can"
            )
        elements = np.flatnonzero(self.share.any(axis=1))
        if elements.size == 0:
            raise LoadError(f"muscle {self.name!r} lies in no element of the body")
        object.__setattr__(self, "elements", elements)

    def response(
        self, u: ArrayLike, time_s: float, *, order: int = 2, psd: bool = False
    ) -> Response:
        """Return energy, force and stiffness of the fibres at displacements (n, 2), mm.

        A pure function, with the meaning and the sparsity pattern of :meth:`Body.response`.

        Parameters
        ----------
        u
            (n, 2) displacements, mm.
        time_s
            When; it sets the activation.
        order
            1 leaves out the stiffness.
        psd
            Whether the stiffness of fibres that weaken when stretched is left out, so that every
            step leads downhill; the force stays exact.
        """
        displacement = np.ascontiguousarray(np.asarray(u, float).reshape(self.body.nodes.shape))
        force = np.zeros(self.body.nodes.shape)
        data = np.zeros(self.body.pattern.nonzeros if order == 2 else 0)
        activation = self.activation.at(time_s)
        connectivity, shapes, slots = self._tables
        where = (slots, self.body.pattern.row_length, force, data)
        if isinstance(self.fibres, FibresAcross):
            energy = assemble_across(
                displacement, connectivity, shapes, self._volumes, self._vectors,
                self.fibres.corner_stretch, self._law, activation, order, psd, *where,
            )  # fmt: skip
        else:
            energy = assemble_in_plane(
                displacement, connectivity, shapes, self._volumes, self._vectors,
                self._law, activation, order, psd, *where,
            )  # fmt: skip
        return Response(float(energy), force.ravel(), data)

    def stretch(self, u: ArrayLike) -> Array:
        """Return the fibres' stretch (m, q) in :attr:`elements` at displacements (n, 2), mm."""
        displacement = np.asarray(u, float).reshape(self.body.nodes.shape)
        return self.fibres.stretch(self.body, self.elements, displacement)

    def mean_tension(self, u: ArrayLike, time_s: float) -> float:
        """Return the nominal tension averaged over the fibres, MPa, at displacements (n, 2), mm."""
        _, tension, _ = self.law.response(self.stretch(u), self.activation.at(time_s))
        return float(np.sum(self._volumes * tension) / np.sum(self._volumes))

    @property
    def area_mm2(self) -> float:
        """Reference area of its fibres in the section, ∫ φ dA, mm²; not of a body of revolution."""
        return float(np.sum(self._volumes)) / self.body.thickness_mm

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """None: a muscle acts inside the body."""
        return ()

    def on_component(self, component: BodyComponent) -> MuscleLoad | None:
        """Return the muscle as far as it lies on a component; see `AppliedForce`.

        The component's elements are the body's, in order, see :meth:`Body.component`.
        """
        here = component.number[self.body.tables.connectivity[:, 0]] != ABSENT
        if not self.share[here].any():
            return None
        fibres = self.fibres
        own = (
            replace(fibres, curvature_per_mm=fibres.curvature_per_mm[here])
            if isinstance(fibres, FibresAcross)
            else replace(fibres, direction=fibres.direction[here])
        )
        return replace(self, body=component.body, share=self.share[here], fibres=own)

    def force(self, displacement: Array, load: Load) -> Array:
        """Return the nodal forces (2n,), N, at the instant of a load; see `AppliedForce`."""
        return -self.response(displacement, load.time_s, order=1).force

    def change(self, displacement: Array, before: Load, after: Load) -> Array:
        """Return the change of the forces (2n,), N, between the instants of two loads."""
        return self.force(displacement, after) - self.force(displacement, before)

    def add_stiffness(
        self, data: Array, pattern: SparsePattern, displacement: Array, load: Load, *, psd: bool
    ) -> None:
        """Add the fibres' stiffness, N/mm; see `AppliedForce`."""
        data += self.response(displacement, load.time_s, psd=psd).stiffness

    def energy(self, displacement: Array, load: Load) -> float:
        """Return the energy of the fibres, N mm, at the instant of a load."""
        return self.response(displacement, load.time_s, order=1).energy

    @cached_property
    def _tables(self) -> tuple[NDArray[np.int64], Array, NDArray[np.int32]]:
        """Nodes (m, a), shape functions or their gradients, and data positions (m, a, a)."""
        tables = self.body.tables
        connectivity = np.ascontiguousarray(tables.connectivity[self.elements])
        shapes = (
            tables.values
            if isinstance(self.fibres, FibresAcross)
            else np.ascontiguousarray(tables.gradients[self.elements])
        )
        first = self.body.pattern.node_pairs(connectivity[:, :, None], connectivity[:, None, :])
        return connectivity, shapes, first.astype(np.int32)

    @cached_property
    def _volumes(self) -> Array:
        """(m, q) volume of fibres that each point stands for, mm³."""
        return np.ascontiguousarray((self.share * self.body.weights)[self.elements])

    @cached_property
    def _vectors(self) -> Array:
        return np.ascontiguousarray(self.fibres.vectors[self.elements])

    @cached_property
    def _law(self) -> Array:
        return self.law.packed()
