"""The muscles of the lips in a meshed section: from anatomy to fibres in elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Body
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.muscle import FibresAcross, FibresInPlane, MuscleLoad
from fem2d.loads.muscle_law import MuscleFibre
from geometry2d.anatomy.muscles import FibresAroundMouth, MuscleRegion

Array = NDArray[np.float64]

PARTS: Mapping[str, tuple[str, ...]] = {
    "upper_orbicularis": ("upper_peripheral", "upper_marginal"),
    "lower_orbicularis": ("lower_peripheral", "lower_marginal"),
    "mentalis": ("mentalis",),
    "levator": ("levator",),
    "depressor": ("depressor",),
}
"""The muscles that are activated, and the parts of each in the section."""


def lip_muscles(
    body: Body,
    regions: Mapping[str, MuscleRegion],
    activations: Mapping[str, Amplitude],
    *,
    fibre: MuscleFibre | None = None,
    corner_stretch: float = 1.0,
) -> tuple[MuscleLoad, ...]:
    """Return the muscles of those lips that a body has.

    Parameters
    ----------
    body
        The lips, with the subdomain "bulk" of each.
    regions
        Where the muscles lie, by name (:func:`geometry2d.anatomy.muscles.muscle_regions`).
    activations
        How active each of `PARTS` is against time; what is not named does nothing and is left out.
    fibre
        The force–length law of all fibres; the default one if absent.
    corner_stretch
        Stretch of the mouth's corners.

    Raises
    ------
    LoadError
        If an activation lies outside 0…1.
    """
    law = fibre or MuscleFibre()
    return tuple(
        _muscle(body, regions[part], law, activation, corner_stretch)
        for name, activation in activations.items()
        for part in PARTS[name]
        if f"{regions[part].lip}_bulk" in (body.mesh.subdomains or {})
    )


def _muscle(
    body: Body, region: MuscleRegion, law: MuscleFibre, activation: Amplitude, corner: float
) -> MuscleLoad:
    points = body.tables.points
    deep = np.zeros(len(body.tables.connectivity), np.bool_)
    deep[body.elements_of(f"{region.lip}_bulk")] = True
    share = np.where(deep[:, None], region.share(points), 0.0)
    fibres = (
        FibresAcross(region.fibres.curvature(points), corner)
        if isinstance(region.fibres, FibresAroundMouth)
        else FibresInPlane(region.fibres.direction(points))
    )
    return MuscleLoad(region.name, body, share, fibres, law, activation)


def fibre_activation(body: Body, muscles: Sequence[MuscleLoad], time_s: float) -> Array:
    """Return how active the fibres in each element of a body are at an instant, (e,) in 0…1.

    Where muscles share an element, each counts by its share of the volume; 0 where there are none.
    """
    fibres, active = np.zeros((2, len(body.weights)))
    for muscle in muscles:
        of_muscle = np.sum(body.weights * muscle.share, axis=1)
        fibres += of_muscle
        active += muscle.activation.at(time_s) * of_muscle
    return np.divide(active, fibres, out=np.zeros_like(active), where=fibres > 0)


def about_muscles(muscles: Sequence[MuscleLoad]) -> dict[str, dict[str, float]]:
    """Return the numbers for the summary, by part.

    The largest activation, the area of the fibres in the section and, at rest length, the tension
    of the whole muscle across the section, or for each mm of width of one that runs in it.
    """
    return {
        muscle.name: {
            "activation": (most := max(muscle.activation.factor)),
            "area_mm2": muscle.area_mm2,
            "tension_n": most * muscle.law.max_stress_mpa * muscle.area_mm2,
        }
        for muscle in muscles
    }
