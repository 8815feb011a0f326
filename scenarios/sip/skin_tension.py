"""The tension of the skin: the lips are under stress in the shape in which they are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from fem2d.analyses.prestretch import stretches_under_tension
from fem2d.body.body import Body
from fem2d.loads.nodal import NodalForce
from fem2d.solvers.prestress import PrestressError, balanced_as_drawn
from geometry2d.anatomy.head import HeadSection
from geometry2d.curves import arc_lengths, at_arc_lengths

Array = NDArray[np.float64]

ACCURACY = 1e-3
"""Largest error of the mean tension, over it."""

MOST_STARTS = 12
"""Tensions with which the dermis may start."""

SECANT_MM = 0.2
"""Half of the length of skin between whose ends its direction is taken, mm."""


@dataclass(frozen=True, eq=False)
class TenseLips:
    """Lips whose skin is under tension as they are drawn.

    Attributes
    ----------
    body
        The lips, prestretched.
    anchors
        What bone and the cut ends of the section hold of the tension.
    mean_tension_mpa
        True stress along the skin, averaged over the dermis, MPa.
    start_tension_mpa
        The tension with which the dermis starts, before what lies below gives way, MPa.
    """

    body: Body
    anchors: NodalForce
    mean_tension_mpa: float
    start_tension_mpa: float

    def about(self) -> dict[str, float]:
        """Return the numbers for the summary."""
        return {
            "mean_tension_kpa": 1e3 * self.mean_tension_mpa,
            "start_tension_kpa": 1e3 * self.start_tension_mpa,
        }


def tense_lips(
    body: Body, head: HeadSection, lips: tuple[str, ...], tension_mpa: float
) -> TenseLips:
    """Return lips in balance as they are drawn, the dermis under a tension along the skin.

    Every point of the dermis starts with the stretch at which its material bears a tension. What
    lies below gives way until all is in balance: less is left where the skin is curved, and none at
    its free end. The start is raised until the mean over the dermis is as asked.

    Parameters
    ----------
    body, head, lips
        The lips, free of stress; the head that they are of; which of them there are.
    tension_mpa
        True stress along the skin, MPa.

    Raises
    ------
    DrinksimError
        If the dermis cannot bear the tension, or the lips find no balance under it.
    """
    along = {lip: _along_skin(body, head, lip) for lip in lips}
    held = body.dofs(*(f"{lip}_{part}" for lip in lips for part in ("bone", "cut")))
    start_mpa = tension_mpa
    for _ in range(MOST_STARTS):
        found = balanced_as_drawn(body, _start(body, along, start_mpa), held)
        mean_mpa = _mean_tension(found.body, along)
        if abs(mean_mpa / tension_mpa - 1) <= ACCURACY:
            anchors = NodalForce(found.support_n, "tension of the skin at bone and cut")
            return TenseLips(found.body, anchors, mean_mpa, start_mpa)
        start_mpa *= tension_mpa / mean_mpa
    raise PrestressError(
        f"the skin keeps {1e3 * mean_mpa:.3g} kPa of a tension of {1e3 * tension_mpa:g} kPa: give "
        "a smaller one"
    )


def _start(body: Body, along: Mapping[str, Array], tension_mpa: float) -> Array:
    """Return the prestretch (e, q, 5) whose dermis bears a tension, and nothing else any."""
    prestretch = np.zeros((*body.weights.shape, 5))
    prestretch[..., [0, 3, 4]] = 1.0
    for lip, directions in along.items():
        dermis = body.elements_of(f"{lip}_dermis")
        material = body.materials[int(body.material_of[dermis[0]])]
        stretches = stretches_under_tension(material, tension_mpa, body.plane)
        prestretch[dermis] = _stretched(directions[dermis], stretches)
    return prestretch


def _along_skin(body: Body, head: HeadSection, lip: str) -> Array:
    """Return unit vectors (e, q, 2) along the nearest skin of a lip."""
    skin = getattr(head, lip).curves["skin"]
    line = shapely.LineString(skin)
    places = shapely.line_locate_point(line, shapely.points(body.tables.points))
    last = arc_lengths(skin)[-1]
    ends = [
        at_arc_lengths(skin, np.clip(places + shift, 0.0, last).ravel())
        for shift in (-SECANT_MM, SECANT_MM)
    ]
    secant = (ends[1] - ends[0]).reshape(*places.shape, 2)
    along: Array = secant / np.linalg.norm(secant, axis=-1, keepdims=True)
    return along


def _stretched(along: Array, stretches: tuple[float, float, float]) -> Array:
    """Return G (..., 5) with a stretch along unit vectors (..., 2), one across, and G₃₃."""
    c, s = along[..., 0], along[..., 1]
    longer, across, third = stretches
    more = longer - across
    parts = (across + more * c * c, more * c * s, more * c * s, across + more * s * s)
    return np.stack([*parts, np.full_like(c, third)], axis=-1)


def _mean_tension(body: Body, along: Mapping[str, Array]) -> float:
    """Return the true stress along the skin in the undeformed body, averaged over the dermis."""
    fields = body.fields(np.zeros_like(body.nodes))
    total = volume = 0.0
    for lip, directions in along.items():
        dermis = body.elements_of(f"{lip}_dermis")
        t, weight = directions[dermis], fields.volume[dermis]
        stress = np.einsum("eqi,eqij,eqj->eq", t, fields.cauchy[dermis][..., :2, :2], t)
        total, volume = total + float(np.sum(weight * stress)), volume + float(weight.sum())
    return total / volume
