"""Viscosity of a body: its overstress at every point, from one committed instant to the next.

Quasi-linear viscoelasticity (Fung 1993) with one reduced relaxation function for the whole tensor:
the second Piola–Kirchhoff stress S of the elastic law, which turns with the material, is what
relaxes (:mod:`fem2d.materials.prony`). Poisson's ratio is then the same at all times, and a free
face stays free, so that the thickness in plane stress is that of the elastic law. Over a step

    S + Σ Q = κ S + H,    κ = 1 + Σ β c,    H = Σ (e Q₀ − β c S₀),

where H is known from the instant before. Within the step the body is elastic, with the energy
``κ ψ + ½ H : (FᵀF − I)``: the second term is quadratic in the displacements, so it has a constant
stiffness, and the tangent is exact and symmetric. Components of H and S are (11, 12, 22, 33).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Body, Response
from fem2d.body.fields import Fields, von_mises
from fem2d.body.kinematics import Plane
from fem2d.materials.prony import PronySeries

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Overstress:
    """What a viscous body remembers of a committed instant.

    Attributes
    ----------
    elastic
        (e, q, 4) stress S of the elastic law, MPa.
    branches
        (N, e, q, 4) overstress Q of each branch, MPa.
    """

    elastic: Array
    branches: Array

    @classmethod
    def relaxed(cls, body: Body, series: PronySeries, displacement: Array) -> Overstress:
        """Return the memory of a body that has been at a displacement (n, 2), mm, for ever."""
        elastic = second_piola(body.fields(displacement))
        return cls(elastic, np.zeros((len(series.overstress), *elastic.shape)))

    def after(
        self, body: Body, series: PronySeries, displacement: Array, duration_s: float
    ) -> Overstress:
        """Return the memory at the end of a step to a displacement (n, 2), mm."""
        elastic = second_piola(body.fields(displacement))
        decay, gain = (each[:, None, None, None] for each in series.recurrence(duration_s))
        return Overstress(elastic, decay * self.branches + gain * (elastic - self.elastic))

    def of_elements(self, elements: Index) -> Overstress:
        """Return the memory of some elements (m,)."""
        return Overstress(self.elastic[elements], self.branches[:, elements])

    def added_to(self, fields: Fields) -> Fields:
        """Return the fields of the same instant with the overstress in their stresses."""
        F = fields.deformation_gradient
        Q = _tensor(self.branches.sum(axis=0))
        cauchy = fields.cauchy + F @ Q @ np.swapaxes(F, -1, -2) / _volume_ratio(F)
        return replace(fields, cauchy=cauchy, von_mises=von_mises(cauchy))


@dataclass(frozen=True, eq=False)
class ViscousStep:
    """A step of a viscous body, which is elastic within it.

    Attributes
    ----------
    body
        The body.
    scale
        κ, the factor on the elastic law's stress.
    held
        (e, q, 4) the stress H that the instant before has left, MPa.
    """

    body: Body
    scale: float
    held: Array

    def response(self, elastic: Response, displacement: Array) -> Response:
        """Return energy, force and stiffness, given those of the elastic law at (n, 2), mm."""
        u = displacement.ravel()
        undeformed, stiffness = self._quadratic
        by_stiffness = self.body.pattern.matrix(stiffness) @ u
        return Response(
            self.scale * elastic.energy + float((undeformed + 0.5 * by_stiffness) @ u),
            self.scale * elastic.force + undeformed + by_stiffness,
            self.scale * elastic.stiffness + stiffness,
        )

    def stand_in(self, elastic: Array) -> Array:
        """Return a positive semi-definite stiffness, given that of the elastic law (nnz,)."""
        data: Array = self.scale * elastic + self._safe_stiffness
        return data

    @cached_property
    def _quadratic(self) -> tuple[Array, Array]:
        """Force (2n,), N, in the undeformed body and stiffness (nnz,), N/mm, of H."""
        body, start = self.body, self.body.start
        pulled = start[..., :4].reshape(*start.shape[:2], 2, 2) @ _tensor(self.held)[..., :2, :2]
        pull = np.einsum(
            "eq,eqaj,eqij->eai", body.free_volumes, body.free_gradients, pulled, optimize=True
        )
        if body.plane is Plane.AXISYMMETRIC:
            ring = body.free_volumes * start[..., 4] * self.held[..., 3] / body.free_radius
            pull[..., 0] += np.einsum("eq,qa->ea", ring, body.tables.values)
        force = np.zeros_like(body.nodes)
        np.add.at(force, body.tables.connectivity, pull)
        return force.ravel(), self._stiffness(self.held)

    @cached_property
    def _safe_stiffness(self) -> Array:
        values, vectors = np.linalg.eigh(_tensor(self.held))
        clamped = np.maximum(values, 0.0)[..., None, :]
        return self._stiffness(_components(vectors * clamped @ np.swapaxes(vectors, -1, -2)))

    def _stiffness(self, stress: Array) -> Array:
        """Return the stiffness (nnz,) of a stress (e, q, 4) that turns with the material, N/mm."""
        body, values, pattern = self.body, self.body.tables.values, self.body.pattern
        in_plane = np.einsum(
            "eq,eqai,eqij,eqbj->eab",
            body.free_volumes, body.free_gradients, _tensor(stress)[..., :2, :2],
            body.free_gradients, optimize=True,
        )  # fmt: skip
        along_x = in_plane
        if body.plane is Plane.AXISYMMETRIC:
            ring = body.free_volumes * stress[..., 3] / body.free_radius**2
            along_x = in_plane + np.einsum("eq,qa,qb->eab", ring, values, values, optimize=True)
        con = body.tables.connectivity
        first = pattern.node_pairs(con[:, :, None], con[:, None, :])
        data = np.zeros(pattern.nonzeros)
        np.add.at(data, first, along_x)
        np.add.at(data, first + pattern.row_length[con][:, :, None] + 1, in_plane)
        return data


@lru_cache(maxsize=8)
def viscous_step(
    body: Body, series: PronySeries, before: Overstress, duration_s: float
) -> ViscousStep:
    """Return the step of a body from a committed instant, of this length, s.

    The last few are remembered: Newton's method asks for the same one in every iteration.
    """
    decay, gain = series.recurrence(duration_s)
    held = np.tensordot(decay, before.branches, axes=1) - gain.sum() * before.elastic
    return ViscousStep(body, 1.0 + float(gain.sum()), held)


def second_piola(fields: Fields) -> Array:
    """Return S = J F⁻¹ σ F⁻ᵀ (e, q, 4), MPa, of the points."""
    F = fields.deformation_gradient
    inverse = np.linalg.inv(F)
    return _components(_volume_ratio(F) * (inverse @ fields.cauchy @ np.swapaxes(inverse, -1, -2)))


def _volume_ratio(F: Array) -> Array:
    volume: Array = np.linalg.det(F)[..., None, None]
    return volume


def _components(tensor: Array) -> Array:
    """Return symmetric tensors (..., 3, 3) as components (..., 4)."""
    return np.stack([tensor[..., i, j] for i, j in ((0, 0), (0, 1), (1, 1), (2, 2))], axis=-1)


def _tensor(stress: Array) -> Array:
    """Return components (..., 4) as tensors (..., 3, 3)."""
    tensor = np.zeros((*stress.shape[:-1], 3, 3))
    tensor[..., 0, 0], tensor[..., 1, 1], tensor[..., 2, 2] = (stress[..., i] for i in (0, 2, 3))
    tensor[..., 0, 1] = tensor[..., 1, 0] = stress[..., 1]
    return tensor
