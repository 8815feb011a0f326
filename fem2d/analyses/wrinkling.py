"""When a compressed, layered surface wrinkles: linear stability of a homogeneous state.

Layers with a common stretch λ along x and a free surface on top carry, on that state, the
incremental displacement u = (a(Y) sin kX, b(Y) cos kX). The state is stable as long as the second
variation of the energy, for every wave number k,

    ∫ [ A₁₁₁₁ k² a² + 2 A₁₁₂₂ k a b' + A₂₂₂₂ b'² + A₁₂₁₂ a'² − 2 A₁₂₂₁ k a' b + A₂₁₂₁ k² b² ] dY,

is positive (Biot, Mechanics of Incremental Deformations, 1965). A_iJkL = ∂P_iJ/∂F_kL of each layer
is that of the compiled kernel, plane stress or plane strain; the integral is discretised by
quadratic finite elements through the depth, integrated with two points so that they do not lock.
All lengths are undeformed ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, cholesky_banded
from scipy.optimize import brentq, minimize_scalar

from fem2d.body.assembly import section_response, work_space
from fem2d.body.kinematics import Plane
from fem2d.materials.material import Material
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting

Array = NDArray[np.float64]

BANDS = 6
"""Diagonals of the banded matrix of two unknowns a node and quadratic elements."""

SYMMETRY = 1e-9
"""Coupling of normal and shear strains, over the largest modulus, that counts as rounding."""


class StabilityError(DrinksimError):
    """The stability of a layered surface cannot be computed."""


@dataclass(frozen=True)
class WrinklingSettings:
    """Discretisation of the layers, and how the critical compression is searched for.

    Parameters
    ----------
    elements
        Quadratic elements through each layer.
    strain_step
        Step of the compression in the search for the first unstable one.
    largest_strain
        Compression at which the search ends.
    strain_tolerance
        Width of the interval in which the critical compression is known in the end.
    """

    elements: int = setting(
        default=48, minimum=1, maximum=10_000, description="quadratic elements through each layer"
    )
    strain_step: float = setting(
        default=0.01, above=0.0, maximum=0.5, description="step of the compression in the search"
    )
    largest_strain: float = setting(
        default=0.85, above=0.0, maximum=0.99, description="compression at which the search ends"
    )
    strain_tolerance: float = setting(
        default=1e-7, above=0.0, maximum=0.1, description="error of the critical compression"
    )


@dataclass(frozen=True)
class Layer:
    """A layer of a surface: its material and its undeformed thickness, mm."""

    material: Material
    thickness_mm: float


@dataclass(frozen=True)
class Wrinkling:
    """The first compression at which a surface stops being flat.

    Attributes
    ----------
    strain, log_strain
        Nominal compression 1 − λ, and −ln λ.
    wavelength_mm
        Undeformed wavelength of the mode.
    wavelengths_mm, strains
        (m,) the curve: compression at which each wavelength becomes unstable, nan where none does
        up to the largest compression that is searched.
    """

    strain: float
    log_strain: float
    wavelength_mm: float
    wavelengths_mm: Array
    strains: Array


def wrinkling(
    layers: Sequence[Layer],
    *,
    plane: Plane,
    wavelengths_mm: ArrayLike | None = None,
    settings: WrinklingSettings | None = None,
) -> Wrinkling:
    """Return at which compression, and how long, a layered surface wrinkles first.

    Parameters
    ----------
    layers
        From the free surface downwards; below the last is a frictionless rigid floor.
    plane
        Plane stress or plane strain.
    wavelengths_mm
        (m,) undeformed wavelengths to test; by default from half the thinnest layer to four times
        the whole depth.
    settings
        Discretisation and search.

    Raises
    ------
    StabilityError
        If there is no layer, a thickness is not positive, the plane assumption is axisymmetry, or
        no wavelength becomes unstable.
    """
    if plane is Plane.AXISYMMETRIC:
        raise StabilityError(
            "plane = AXISYMMETRIC has no sideways compression: use STRESS or STRAIN"
        )
    if not layers or min(layer.thickness_mm for layer in layers) <= 0:
        raise StabilityError("give at least one layer, each with a thickness_mm above 0")
    chosen = settings or WrinklingSettings()
    thicknesses = [layer.thickness_mm for layer in layers]
    if wavelengths_mm is None:
        wavelengths = np.geomspace(min(thicknesses) / 2, 4 * sum(thicknesses), 40)
    else:
        wavelengths = np.asarray(wavelengths_mm, float)
    strains = np.array([_first_unstable(layers, plane, length, chosen) for length in wavelengths])
    if np.all(np.isnan(strains)):
        raise StabilityError(
            f"the surface is stable up to a compression of {chosen.largest_strain:.0%} at all "
            f"wavelengths from {wavelengths.min():g} to {wavelengths.max():g} mm: try others"
        )
    best = int(np.nanargmin(strains))
    length, strain = float(wavelengths[best]), float(strains[best])
    if 0 < best < len(wavelengths) - 1 and not np.isnan(strains[best - 1 : best + 2]).any():
        refined = minimize_scalar(
            lambda log_length: _first_unstable(layers, plane, math.exp(log_length), chosen),
            bounds=(math.log(wavelengths[best - 1]), math.log(wavelengths[best + 1])),
            method="bounded",
            options={"xatol": 1e-3},
        )
        if refined.fun < strain:
            length, strain = math.exp(float(refined.x)), float(refined.fun)
    return Wrinkling(strain, -math.log1p(-strain), length, wavelengths, strains)


def _first_unstable(
    layers: Sequence[Layer], plane: Plane, wavelength: float, settings: WrinklingSettings
) -> float:
    """Return the smallest compression at which a wave of this length is unstable, or nan."""
    step = settings.strain_step
    k = 2 * math.pi / wavelength
    grids = [_levels(layer.thickness_mm, wavelength, settings.elements) for layer in layers]
    low = 0.0
    for high in np.arange(step, settings.largest_strain, step):
        if not _stable(layers, grids, plane, k, float(high)):
            break
        low = float(high)
    else:
        return math.nan
    high = low + step
    while high - low > settings.strain_tolerance:
        middle = 0.5 * (low + high)
        if _stable(layers, grids, plane, k, middle):
            low = middle
        else:
            high = middle
    return high


def _levels(thickness: float, wavelength: float, elements: int) -> Array:
    """Return the element boundaries of a layer, graded towards its upper side.

    A wave decays over its length, so elements deeper down may be larger.
    """
    reach = min(thickness, wavelength)
    ratio = thickness / reach
    s = np.linspace(0, 1, elements + 1)
    return thickness * (s if ratio <= 1 else np.expm1(s * math.log1p(4 * ratio)) / (4 * ratio))


def _stable(
    layers: Sequence[Layer], grids: Sequence[Array], plane: Plane, k: float, strain: float
) -> bool:
    """Whether the second variation is positive definite at a compression, for one wave number."""
    nodes = 2 * sum(len(grid) - 1 for grid in grids) + 1
    band = np.zeros((BANDS, 2 * nodes))
    first = 0
    for layer, grid in zip(layers, grids, strict=True):
        moduli = _moduli(layer.material, plane, 1 - strain)
        if moduli is None:
            return False
        matrices = _element_matrices(moduli, np.diff(grid), k)
        starts = 4 * np.arange(len(matrices)) + first
        first += 4 * len(matrices)
        for i in range(6):
            for j in range(i + 1):
                band[i - j, starts + j] += matrices[:, i, j]
    band[0, -1] += 1e6 * band[0].max()  # the floor: b = 0
    try:
        cholesky_banded(band, lower=True, check_finite=True)
    except (LinAlgError, ValueError):
        return False
    return True


def free_height(material: Material, plane: Plane, stretch: float) -> tuple[float, Array] | None:
    """Return how a piece stretched along a free surface grows upwards, and its tangent there.

    Parameters
    ----------
    material
        Of the piece.
    plane
        Plane stress or plane strain.
    stretch
        Along the surface.

    Returns
    -------
    tuple or None
        Stretch across the surface at which nothing acts on it, and ∂P/∂F (5, 5) of the section's
        components (F₁₁, F₁₂, F₂₁, F₂₂, F₃₃); None if there is no such stretch.
    """
    packed = material.packed()
    x = np.array([stretch, 0.0, 0.0, 1.0, 1.0])
    P, A = np.zeros(5), np.zeros((5, 5))
    block, scratch = work_space(len(packed))

    def traction(log_side: float) -> float:
        x[3] = math.exp(log_side)
        _, admissible = section_response(
            packed, plane.value, x, 0.0, False, 2, False, P, A, block, scratch, True
        )
        return float(P[3]) if admissible else math.copysign(math.inf, log_side)

    guess = -math.log(stretch) * (1.0 if plane is Plane.STRAIN else 0.5)
    width = 0.05
    while not traction(guess - width) < 0 < traction(guess + width):
        width *= 2
        if width > 1.0:
            return None
    traction(float(brentq(traction, guess - width, guess + width, xtol=1e-14)))
    return float(x[3]), A


def _moduli(material: Material, plane: Plane, stretch: float) -> Array | None:
    """Return A₁₁₁₁, A₁₁₂₂, A₂₂₂₂, A₁₂₁₂, A₁₂₂₁, A₂₁₂₁ of a layer free to grow upwards."""
    found = free_height(material, plane, stretch)
    if found is None:
        return None
    A = found[1]
    mixed = np.abs(A[np.ix_([0, 3], [1, 2])]).max()
    if mixed > SYMMETRY * np.abs(A[:4, :4]).max():
        raise StabilityError(
            "a layer's fibres are not symmetric about the surface: sideways compression shears it"
        )
    return np.array([A[0, 0], A[0, 3], A[3, 3], A[1, 1], A[1, 2], A[2, 2]])


# Quadratic shape functions and derivatives at two Gauss points of [0, 1]; nodes 0, 1/2, 1.
_S = np.array([0.5 - math.sqrt(1 / 12), 0.5 + math.sqrt(1 / 12)])
_N = np.stack([(1 - _S) * (1 - 2 * _S), 4 * _S * (1 - _S), _S * (2 * _S - 1)])
_D = np.stack([4 * _S - 3, 4 - 8 * _S, 4 * _S - 1])
_NN, _ND, _DD = _N @ _N.T / 2, _N @ _D.T / 2, _D @ _D.T / 2


def _element_matrices(moduli: Array, heights: Array, k: float) -> Array:
    """Return the matrices (e, 6, 6) of elements with unknowns a, b at three nodes.

    Depth is counted downwards, so derivatives by Y change their sign.
    """
    A1111, A1122, A2222, A1212, A1221, A2121 = moduli
    h = heights[:, None, None]
    matrices = np.empty((len(heights), 6, 6))
    matrices[:, 0::2, 0::2] = A1111 * k**2 * h * _NN + A1212 / h * _DD
    matrices[:, 1::2, 1::2] = A2121 * k**2 * h * _NN + A2222 / h * _DD
    coupling = -A1122 * k * _ND + A1221 * k * _ND.T
    matrices[:, 0::2, 1::2] = coupling
    matrices[:, 1::2, 0::2] = coupling.T
    return matrices
