"""The compiled loops over a muscle's elements: energy, nodal forces and stiffness of its fibres.

Forces are the derivatives of the energy, as a body's are. With shape functions ``N_a``:

    across the section:  λ = λ_c (1 − k·u),   ∂λ/∂u_a = −λ_c N_a k
    in the section:      λ = |g|, g = F a,    ∂λ/∂u_a = (∇N_a·a) g/λ

and ``∂²W = ∫ φ [T₀′ ∂λ⊗∂λ + T₀ ∂²λ]``, where only fibres in the section turn: their ``∂²λ`` is
``(∇N_a·a)(∇N_b·a)(1 − g⊗g/λ²)/λ``. The positive semi-definite stand-in leaves out a negative T₀′.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fem2d.loads.muscle_law import fibre_response
from geometry2d.compiled import compiled

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Index32 = NDArray[np.int32]


@compiled
def add_element(
    nodes: Index,
    fe: Array,
    ke: Array,
    slots: Index32,
    row_length: Index,
    order: int,
    force: Array,
    data: Array,
) -> None:
    """Add an element's forces (2a,) and, at order 2, its stiffness (2a, 2a) where they belong."""
    for a in range(nodes.shape[0]):
        force[nodes[a], 0] += fe[2 * a]
        force[nodes[a], 1] += fe[2 * a + 1]
        if order < 2:
            continue
        length = row_length[nodes[a]]
        for b in range(nodes.shape[0]):
            for i in range(2):
                for k in range(2):
                    data[slots[a, b] + i * length + k] += ke[2 * a + i, 2 * b + k]


@compiled
def assemble_across(
    u: Array, connectivity: Index, values: Array, volumes: Array, curvature: Array,
    corner_stretch: float, law: Array, activation: float, order: int, psd: bool,
    slots: Index32, row_length: Index, force: Array, data: Array,
) -> float:  # fmt: skip
    """Add what fibres across the section do; return their energy, N mm.

    Parameters
    ----------
    u
        (n, 2) displacements, mm.
    connectivity, values
        (m, a) nodes of the muscle's elements, (q, a) shape functions.
    volumes
        (m, q) volume of fibres that each point stands for, mm³.
    curvature
        (m, q, 2) curvature of the fibres, towards its centre, 1/mm.
    corner_stretch
        Stretch of the mouth's corners, λ_c.
    law, activation
        Packed fibre and how much of it acts.
    order, psd
        1 forces, 2 also stiffness; whether a negative T₀′ is left out.
    slots, row_length
        (m, a, a) data position of each pair of nodes, (n,) entries in a row of a node.
    force, data
        (n, 2), N, and (nnz,), N/mm: where the sums go.
    """
    elements, count = connectivity.shape
    fe, ke = np.empty(2 * count), np.empty((2 * count, 2 * count))
    lever = np.empty(2 * count)
    energy = 0.0
    for e in range(elements):
        nodes = connectivity[e]
        fe[:] = 0.0
        ke[:, :] = 0.0
        for q in range(volumes.shape[1]):
            volume = volumes[e, q]
            if volume == 0.0:
                continue
            stretch = corner_stretch
            for a in range(count):
                for i in range(2):
                    lever[2 * a + i] = -corner_stretch * values[q, a] * curvature[e, q, i]
                    stretch += lever[2 * a + i] * u[nodes[a], i]
            density, tension, slope = fibre_response(law, activation, stretch)
            energy += volume * density
            if psd:
                slope = max(slope, 0.0)
            for i in range(2 * count):
                fe[i] += volume * tension * lever[i]
                for k in range(2 * count):
                    ke[i, k] += volume * slope * lever[i] * lever[k]
        add_element(nodes, fe, ke, slots[e], row_length, order, force, data)
    return energy


@compiled
def assemble_in_plane(
    u: Array, connectivity: Index, gradients: Array, volumes: Array, direction: Array,
    law: Array, activation: float, order: int, psd: bool,
    slots: Index32, row_length: Index, force: Array, data: Array,
) -> float:  # fmt: skip
    """Add what fibres in the section do; return their energy, N mm.

    ``gradients`` are (m, q, a, 2), 1/mm, ``direction`` (m, q, 2) unit vectors along the undeformed
    fibres; the rest as of :func:`assemble_across`. Fibres of no length pull nowhere.
    """
    elements, count = connectivity.shape
    fe, ke = np.empty(2 * count), np.empty((2 * count, 2 * count))
    along, g = np.empty(count), np.empty(2)
    energy = 0.0
    for e in range(elements):
        nodes = connectivity[e]
        fe[:] = 0.0
        ke[:, :] = 0.0
        for q in range(volumes.shape[1]):
            volume = volumes[e, q]
            if volume == 0.0:
                continue
            g[0], g[1] = direction[e, q, 0], direction[e, q, 1]
            for a in range(count):
                along[a] = (
                    gradients[e, q, a, 0] * direction[e, q, 0]
                    + gradients[e, q, a, 1] * direction[e, q, 1]
                )
                g[0] += u[nodes[a], 0] * along[a]
                g[1] += u[nodes[a], 1] * along[a]
            stretch = math.hypot(g[0], g[1])
            density, tension, slope = fibre_response(law, activation, stretch)
            energy += volume * density
            if stretch == 0.0:
                continue
            if psd:
                slope = max(slope, 0.0)
            turn = tension / stretch
            for a in range(count):
                for i in range(2):
                    fe[2 * a + i] += volume * turn * g[i] * along[a]
                for b in range(count):
                    pair = volume * along[a] * along[b]
                    for i in range(2):
                        for k in range(2):
                            aligned = g[i] * g[k] / (stretch * stretch)
                            straight = turn if i == k else 0.0
                            ke[2 * a + i, 2 * b + k] += pair * ((slope - turn) * aligned + straight)
        add_element(nodes, fe, ke, slots[e], row_length, order, force, data)
    return energy
