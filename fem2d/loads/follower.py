"""Forces of a pressure that stays normal to the surface it acts on, and their exact derivative.

A pressure ``p(x)`` does the virtual work ``−∫ p n·δx da`` over the *deformed* surface. With the
edge ``x(ξ)`` and the body on the left of its direction, ``n ds = (y', −x') dξ``, so no
normalisation is needed: in a section of thickness ``h`` the nodal forces are
``−h ∫ N_k p (y', −x') dξ``, in axisymmetry ``−2π ∫ N_k p x (y', −x') dξ``. Their derivative has
three parts: the edge turns, the depth of a ring changes, and the pressure is another one where the
point goes. It is exact and not symmetric, because a pressure on part of a surface has no potential.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fem2d.body.surface import Surface

Array = NDArray[np.float64]


class PressureField(Protocol):
    """A pressure that depends on the place."""

    def at(self, position: Array) -> tuple[Array, Array]:
        """Return the pressure (...,), MPa, at positions (..., 2), mm, and its gradient, MPa/mm."""
        ...


def follower_force(surface: Surface, displacement: Array, pressure: Array) -> Array:
    """Return the nodal forces (m, 2k), N, of pressures (m, q), MPa, at the points of a surface.

    Parameters
    ----------
    surface
        With Gauss points.
    displacement
        (n, 2) of the body's nodes, mm.
    pressure
        (m, q) positive where it pushes against the body.
    """
    amount = _depth(surface, displacement)[0] * pressure
    density = amount[..., None] * _area_vector(surface, displacement)
    nodal = -np.einsum("q,qk,mqc->mkc", _gauss_weight(surface), surface.shape, density)
    force: Array = nodal.reshape(len(surface.edges), -1)
    return force


def follower_stiffness(
    surface: Surface, displacement: Array, pressure: Array, gradient: Array
) -> Array:
    """Return the derivative (m, 2k, 2k), N/mm, of :func:`follower_force` by the displacements.

    ``gradient`` (m, q, 2), MPa/mm, is that of the pressure (m, q) by the deformed position.
    """
    shape, slope = surface.shape, surface.slope
    depth, depth_slope = _depth(surface, displacement)
    amount = depth * pressure
    weighted = _gauss_weight(surface)[:, None] * shape
    # d(y', −x') turns the edge; d(depth) and d(pressure) change how much of it counts.
    turn = np.einsum("qa,mq,qb->mab", weighted, amount, slope)
    change = gradient * depth[..., None]
    change[..., 0] += pressure * depth_slope
    area_vector = _area_vector(surface, displacement)
    spread = np.einsum("qa,mqc,mqd,qb->macbd", weighted, area_vector, change, shape)
    spread[:, :, 0, :, 1] += turn
    spread[:, :, 1, :, 0] -= turn
    size = 2 * shape.shape[1]
    stiffness: Array = -spread.reshape(-1, size, size)
    return stiffness


def _gauss_weight(surface: Surface) -> Array:
    weight: Array = 0.5 * np.polynomial.legendre.leggauss(surface.points_per_edge)[1]
    return weight


def _area_vector(surface: Surface, displacement: Array) -> Array:
    """Return the outward normal times length per local coordinate (m, q, 2), mm."""
    deformed = (surface.nodes + displacement)[surface.edges]
    tangent = np.einsum("qk,mkc->mqc", surface.slope, deformed)
    return np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1)


def _depth(surface: Surface, displacement: Array) -> tuple[Array, float]:
    """Return the depth (m, q) of the section, mm, and its derivative by x."""
    points = (len(surface.edges), len(surface.shape))
    if surface.axisymmetric:
        return 2 * np.pi * surface.positions(displacement)[..., 0], 2 * np.pi
    return np.full(points, surface.thickness_mm), 0.0
