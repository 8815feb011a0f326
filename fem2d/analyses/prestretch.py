"""The stretch at which a material bears a given tension along one direction of a section."""

from __future__ import annotations

import math

from scipy.optimize import brentq

from fem2d.analyses.homogeneous import HomogeneousError, Mode, homogeneous_response
from fem2d.body.kinematics import Plane
from fem2d.materials.material import Material

MOST_STRETCH = 3.0
"""Stretch up to which the tension is looked for."""


def stretches_under_tension(
    material: Material, tension_mpa: float, plane: Plane
) -> tuple[float, float, float]:
    """Return the stretches along a tension, across it in the section, and of the thickness.

    Parameters
    ----------
    material
        An isotropic law.
    tension_mpa
        True stress along the tension, MPa; the other direction of the section is free.
    plane
        Whether the thickness is free (plane stress) or held.

    Raises
    ------
    HomogeneousError
        If the material does not bear that tension up to a stretch of 3.
    """
    mode = Mode.UNIAXIAL if plane is Plane.STRESS else Mode.PLANAR

    def missing(log_stretch: float) -> float:
        curve = homogeneous_response(material, mode, [math.exp(log_stretch)])
        return float(curve.cauchy_mpa[0]) - tension_mpa

    if missing(math.log(MOST_STRETCH)) < 0:
        raise HomogeneousError(
            f"the material bears less than {1e3 * tension_mpa:g} kPa at a stretch of "
            f"{MOST_STRETCH:g}: give a smaller tension"
        )
    found = math.exp(brentq(missing, 0.0, math.log(MOST_STRETCH), xtol=1e-14))
    along, second, third = homogeneous_response(material, mode, [found]).stretches[0].tolist()
    return (along, second, third) if plane is Plane.STRESS else (along, third, second)
