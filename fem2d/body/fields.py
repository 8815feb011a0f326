"""Strains and stresses of a deformed body at its integration points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.materials.material import Material, MaterialError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Fields:
    """Strains and stresses of a deformed body at its integration points.

    Strains are those from where the material is free of stress, see `Body.with_prestretch`.

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


def fields_from(
    components: Array,
    piola: Array,
    energy: Array,
    weights: Array,
    materials: tuple[Material, ...],
    material_of: Index,
    *,
    mean_dilatation: bool,
) -> Fields:
    """Return the fields from the stresses and energies that the laws give at the points.

    Parameters
    ----------
    components, piola
        (e, q, 5) components of F and of the first Piola–Kirchhoff stress, MPa, see
        :mod:`fem2d.body.kinematics`.
    energy
        (e, q) strain energy, MPa; not finite where the law is not defined.
    weights
        (e, q) reference volume of the points, mm³.
    materials, material_of
        The materials, and (e,) which one each element has.
    mean_dilatation
        Whether the volumetric energy is that of the element's mean volume ratio.

    Raises
    ------
    MaterialError
        If a volume ratio is not positive.
    """
    F = np.zeros((*weights.shape, 3, 3))
    F[..., :2, :2] = components[..., :4].reshape(*weights.shape, 2, 2)
    F[..., 2, 2] = components[..., 4]
    F11, F12, F21, F22, F33 = np.moveaxis(components, -1, 0)
    J = (F11 * F22 - F12 * F21) * F33
    mean_J = np.sum(weights * J, axis=1) / np.sum(weights, axis=1)
    if not np.all(np.isfinite(energy)):
        at = np.unravel_index(np.argmax(~np.isfinite(energy)), energy.shape)
        raise MaterialError(
            f"J = {J[at]:.4g} at a point of element {at[0]}: fields exist only where the energy is "
            "finite"
        )
    cauchy = np.zeros_like(F)
    section = piola[..., :4].reshape(*J.shape, 2, 2)
    cauchy[..., :2, :2] = section @ np.swapaxes(F[..., :2, :2], -1, -2) / J[..., None, None]
    cauchy[..., 2, 2] = piola[..., 4] * F[..., 2, 2] / J
    if mean_dilatation:
        for number, law in enumerate(materials):
            here = material_of == number
            mean = np.broadcast_to(mean_J[here][:, None], J[here].shape)
            at_mean, at_point = law.volumetric(mean), law.volumetric(J[here])
            cauchy[here] += (at_mean[1] - at_point[1])[..., None, None] * np.eye(3)
            energy[here] += at_mean[0] - at_point[0]
    return Fields(
        F,
        _log_stretches(F),
        cauchy,
        von_mises(cauchy),
        components[..., 4],
        energy,
        weights,
    )


def von_mises(cauchy: Array) -> Array:
    """Return the von Mises stress (...,), MPa, of true stresses (..., 3, 3)."""
    deviator = cauchy - np.trace(cauchy, axis1=-2, axis2=-1)[..., None, None] / 3 * np.eye(3)
    equivalent: Array = np.sqrt(1.5 * np.sum(deviator**2, axis=(-2, -1)))
    return equivalent


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
