"""The compiled loop over elements: energy, nodal forces and stiffness of a body."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fem2d.body.kinematics import AXISYMMETRIC
from fem2d.body.section_fibres import fibres_section
from fem2d.body.section_principal import principal_section
from fem2d.materials.fibre_kernels import FIBRES, fibres_volume
from fem2d.materials.material import Array
from fem2d.materials.principal_kernels import principal_volume
from geometry2d.compiled import compiled

Index = NDArray[np.int64]
Index32 = NDArray[np.int32]


@compiled
def work_space(packed_length: int) -> tuple[Array, Array]:
    """Return the ``block`` and ``scratch`` of :func:`section_response` for laws of this length."""
    return np.empty((3, 3)), np.empty((max(6, packed_length), 6))


@compiled
def section_response(
    packed: Array,
    plane: int,
    x: Array,
    pressure: float,
    mixed: bool,
    order: int,
    psd: bool,
    P: Array,
    A: Array,
    block: Array,
    scratch: Array,
    fibres: bool | None,
) -> tuple[float, bool]:
    """Call the law that ``packed`` describes; arguments as of its function.

    ``fibres`` is None where no law has any. What None rules out is not compiled: laws with fibres
    take as long as all others.
    """
    if fibres is not None and packed[0] == FIBRES:
        return fibres_section(packed, plane, x, pressure, mixed, order, psd, P, A, scratch)
    return principal_section(packed, plane, x, pressure, mixed, order, psd, P, A, block, scratch)


@compiled
def volume_response(packed: Array, v: float) -> tuple[float, float, float]:
    """Return U, dU/dJ, d²U/dJ² of the law that ``packed`` describes at v = ln J."""
    if packed[0] == FIBRES:
        return fibres_volume(packed, v)
    return principal_volume(packed, math.expm1(v))


@compiled
def section_components(
    u: Array,
    connectivity: Index,
    gradients: Array,
    values: Array,
    radius: Array,
    start: Array,
    plane: int,
    components: Array,
) -> None:
    """Fill the components (e, q, 5) of F at every integration point.

    F₃₃ in plane stress is that of the start, as of :func:`assemble`.
    """
    elements, points = radius.shape
    for e in range(elements):
        for q in range(points):
            gradient_at(
                u,
                connectivity[e],
                gradients[e, q],
                values[q],
                radius[e, q],
                start_of(start, e, q),
                plane,
                components[e, q],
            )


@compiled
def section_stresses(
    components: Array,
    laws: Array,
    law_of: Index,
    plane: int,
    mixed: bool,
    order: int,
    psd: bool,
    fibres: bool | None,
    energy: Array,
    stress: Array,
) -> None:
    """Fill ψ (e, q) and the first Piola–Kirchhoff stress (e, q, 5) at components (e, q, 5) of F.

    In plane stress F₃₃ is filled in. A point that is not admissible gets an infinite energy.
    ``mixed``, ``order`` and ``psd`` are False, 1 and False: numba compiles the laws anew for
    constants, but shares them with `assemble` for arguments.
    """
    A = np.zeros((5, 5))
    block, scratch = work_space(laws.shape[1])
    elements, points = energy.shape
    for e in range(elements):
        for q in range(points):
            energy[e, q], _ = section_response(
                laws[law_of[e]], plane, components[e, q], 0.0, mixed, order, psd, stress[e, q], A,
                block, scratch, fibres,
            )  # fmt: skip


@compiled
def start_of(start: Array, e: int, q: int) -> Array:
    """Return the components (5,) of F at a point of the undeformed body."""
    there: Array = start[e, q] if start.shape[0] > 1 else start[0, 0]
    return there


@compiled
def gradient_at(
    u: Array,
    nodes: Index,
    gradients: Array,
    values: Array,
    radius: float,
    start: Array,
    plane: int,
    x: Array,
) -> None:
    """Fill the components ``x`` (5,) of F at one point: F = F₀ + Σ u_a ⊗ ∇N_a, likewise u_r/R."""
    for i in range(5):
        x[i] = start[i]
    for a in range(nodes.shape[0]):
        ux, uy = u[nodes[a], 0], u[nodes[a], 1]
        gx, gy = gradients[a, 0], gradients[a, 1]
        x[0] += ux * gx
        x[1] += ux * gy
        x[2] += uy * gx
        x[3] += uy * gy
        if plane == AXISYMMETRIC:
            x[4] += ux * values[a] / radius


@compiled
def mean_dilatation(
    u: Array,
    nodes: Index,
    gradients: Array,
    values: Array,
    weights: Array,
    radius: Array,
    start: Array,
    e: int,
    plane: int,
    x: Array,
) -> tuple[float, float]:
    """Return the volume of element ``e`` and ln of its mean volume ratio (nan if some J ≤ 0)."""
    volume = excess = 0.0
    for q in range(weights.shape[0]):
        gradient_at(u, nodes, gradients[q], values[q], radius[q], start_of(start, e, q), plane, x)
        J = (x[0] * x[3] - x[1] * x[2]) * x[4]
        if not (J > 0.0 and x[4] > 0.0):
            return volume, math.nan
        volume += weights[q]
        excess += weights[q] * (J - 1.0)
    return volume, math.log1p(excess / volume)


@compiled
def assemble(
    u: Array,
    connectivity: Index,
    gradients: Array,
    values: Array,
    weights: Array,
    radius: Array,
    start: Array,
    laws: Array,
    law_of: Index,
    plane: int,
    mixed: bool,
    order: int,
    psd: bool,
    fibres: bool | None,
    first_slot: Index32,
    packed_length: Index,
    first: int,
    last: int,
    force: Array,
    data: Array,
) -> float:
    """Add nodal forces (n, 2) and stiffness (nnz,) of some elements into arrays; return the energy.

    Elements are taken one after another in their order, so the sums always come out the same. An
    inadmissible point makes the energy infinite and contributes nothing.

    Parameters
    ----------
    u
        (n, 2) displacements, mm.
    connectivity, gradients, values, weights, radius
        (e, a) nodes, (e, q, a, 2) shape gradients, (q, a) shape functions, (e, q) volumes that
        the points stand for (mm³), (e, q) distances from the axis (mm; unused unless axisymmetric).
    start
        (e, q, 5) components of F in the undeformed body, or one for all points (1, 1, 5).
    laws, law_of
        (m, k) packed parameters of the laws and (e,) which one each element has.
    plane, mixed, order, psd, fibres
        The section assumption; whether volumetric energies are those of element means; 0 energy,
        1 also force, 2 also stiffness; whether point tangents are clamped; True if a law has
        fibres, else None.
    first_slot, packed_length
        (e, a, a) data position of each pair of nodes, (n,) length of the two rows of a node.
    first, last
        Elements first … last − 1 are summed.
    force, data
        Where the sums go.
    """
    count = connectivity.shape[1]
    points = weights.shape[1]
    x, P = np.empty(5), np.empty(5)
    A = np.zeros((5, 5))
    block, scratch = work_space(laws.shape[1])
    n = 2 * count
    fe, ke = np.empty(n), np.empty((n, n))
    dJ = np.empty(n)
    energy = 0.0
    for e in range(first, last):
        packed = laws[law_of[e]]
        nodes = connectivity[e]
        pressure = volume = second = 0.0
        if mixed:
            volume, v = mean_dilatation(
                u, nodes, gradients[e], values, weights[e], radius[e], start, e, plane, x
            )
            if not math.isfinite(v):
                energy = math.inf
                continue
            volumetric, pressure, second = volume_response(packed, v)
            energy += volume * volumetric
            dJ[:] = 0.0
        fe[:] = 0.0
        ke[:, :] = 0.0
        admissible = True
        for q in range(points):
            grads, shape = gradients[e, q], values[q]
            gradient_at(u, nodes, grads, shape, radius[e, q], start_of(start, e, q), plane, x)
            density, admissible = section_response(
                packed, plane, x, pressure, mixed, order, psd, P, A, block, scratch, fibres
            )
            if not admissible:
                break
            w = weights[e, q]
            energy += w * density
            if order == 0:
                continue
            hoop = 1.0 / radius[e, q] if plane == AXISYMMETRIC else 0.0
            for a in range(count):
                gx, gy = grads[a, 0], grads[a, 1]
                fe[2 * a] += w * (P[0] * gx + P[1] * gy + P[4] * shape[a] * hoop)
                fe[2 * a + 1] += w * (P[2] * gx + P[3] * gy)
                if mixed:
                    area = x[0] * x[3] - x[1] * x[2]
                    dJ[2 * a] += w * (x[4] * (x[3] * gx - x[2] * gy) + area * shape[a] * hoop)
                    dJ[2 * a + 1] += w * x[4] * (x[0] * gy - x[1] * gx)
            if order == 2:
                add_stiffness(w, A, grads, shape, hoop, plane == AXISYMMETRIC, ke)
        if not admissible:
            energy = math.inf
            continue
        if order == 0:
            continue
        for a in range(count):
            force[nodes[a], 0] += fe[2 * a]
            force[nodes[a], 1] += fe[2 * a + 1]
        if order == 1:
            continue
        if mixed and not (psd and second < 0.0):
            for i in range(n):
                scaled = second / volume * dJ[i]
                for j in range(i, n):
                    ke[i, j] += scaled * dJ[j]
        for a in range(count):
            length = packed_length[nodes[a]]
            for b in range(count):
                slot = first_slot[e, a, b]
                for i in range(2):
                    for k in range(2):
                        r, c = 2 * a + i, 2 * b + k
                        data[slot + i * length + k] += ke[r, c] if r <= c else ke[c, r]
    return energy


@compiled
def add_stiffness(
    w: float, A: Array, grads: Array, shape: Array, hoop: float, third: bool, ke: Array
) -> None:
    """Add ``w · Bᵀ A B`` of one point to the upper triangle of an element stiffness.

    Node b moving along x (y) changes entry m of P by x_m (y_m); ∇N_a takes that to forces.
    """
    for b in range(grads.shape[0]):
        gx, gy = w * grads[b, 0], w * grads[b, 1]
        x0, y0 = A[0, 0] * gx + A[0, 1] * gy, A[0, 2] * gx + A[0, 3] * gy
        x1, y1 = A[1, 0] * gx + A[1, 1] * gy, A[1, 2] * gx + A[1, 3] * gy
        x2, y2 = A[2, 0] * gx + A[2, 1] * gy, A[2, 2] * gx + A[2, 3] * gy
        x3, y3 = A[3, 0] * gx + A[3, 1] * gy, A[3, 2] * gx + A[3, 3] * gy
        if third:
            ring = w * hoop * shape[b]
            x0, x1 = x0 + A[0, 4] * ring, x1 + A[1, 4] * ring
            x2, x3 = x2 + A[2, 4] * ring, x3 + A[3, 4] * ring
            x4 = A[4, 0] * gx + A[4, 1] * gy + A[4, 4] * ring
            y4 = A[4, 2] * gx + A[4, 3] * gy
            for a in range(b + 1):
                ke[2 * a, 2 * b] += shape[a] * hoop * x4
                ke[2 * a, 2 * b + 1] += shape[a] * hoop * y4
        for a in range(b + 1):
            hx, hy = grads[a, 0], grads[a, 1]
            ke[2 * a, 2 * b] += hx * x0 + hy * x1
            ke[2 * a, 2 * b + 1] += hx * y0 + hy * y1
            ke[2 * a + 1, 2 * b] += hx * x2 + hy * x3
            ke[2 * a + 1, 2 * b + 1] += hx * y2 + hy * y3
