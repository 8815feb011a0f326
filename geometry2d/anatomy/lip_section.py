"""A lip as a section: dermis and bulk between its curves, and where a mesh is finest."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from geometry2d.curves import arc_lengths, resampled
from geometry2d.regions import Loop, Section

Array = NDArray[np.float64]

OUTER_REACH_MM = {"upper": 24.0, "lower": 12.0}
INNER_REACH_MM = 14.0
"""Distance from the lip margin within which a package may touch, mm: along the skin (the rim of a
wide neck nearly reaches the nose) and along the inner side (of a lip around a neck)."""
FOCUS_SPACING_MM = 0.01
"""Spacing of the focus points, mm, much smaller than an edge of any mesh."""

UPPER_LOOPS: Mapping[str, Loop] = {
    "dermis": (
        ("skin", True),
        ("cut_dermis", True),
        ("interface", False),
        ("dermis_end", False),
    ),
    "bulk": (
        ("interface", True),
        ("cut_bulk", True),
        ("bone", True),
        ("inner", True),
        ("dermis_end", True),
    ),
}
"""Skin and interface run from the mouth up to the cut through the nose."""
LOWER_LOOPS: Mapping[str, Loop] = {
    "dermis": (
        ("skin", True),
        ("dermis_end", True),
        ("interface", False),
        ("cut_dermis", False),
    ),
    "bulk": (
        ("interface", True),
        ("dermis_end", False),
        ("inner", True),
        ("bone", True),
        ("cut_bulk", False),
    ),
}
"""Skin and interface run from the cut under the chin up into the mouth."""


def lip_section(
    name: str, *, skin: Array, interface: Array, inner: Array, bone: Array, margin: float
) -> Section:
    """Return a lip as regions "dermis" and "bulk" between curves with the tissue on their left.

    Parameters
    ----------
    name
        "upper", with the order bone, inner, skin of the curves; or "lower", with skin, inner, bone.
    skin, interface
        (n, 2) outer and inner side of the dermis, mm, in the same direction.
    inner, bone
        (n, 2) free inner side and tie to bone, mm. A straight cut joins bone and skin.
    margin
        Arc length of the lip's edge along the skin, mm. The mesh is finest around it, where a
        package may touch.

    Raises
    ------
    RegionError
        If the dermis is thicker than the skin's curvature allows, or curves cross.
    """
    upper = name == "upper"
    mouth_end, cut_end = (0, -1) if upper else (-1, 0)
    return Section(
        name=name,
        curves={
            "skin": skin,
            "inner": inner,
            "bone": bone,
            "interface": interface,
            "dermis_end": np.array([skin[mouth_end], interface[mouth_end]]),
            "cut_dermis": np.array([skin[cut_end], interface[cut_end]]),
            "cut_bulk": np.array([interface[cut_end], bone[0] if upper else bone[-1]]),
        },
        loops=UPPER_LOOPS if upper else LOWER_LOOPS,
        boundary_curves={
            "skin": ("skin",),
            "inner": ("inner",),
            "bone": ("bone",),
            "cut": ("cut_dermis", "cut_bulk"),
        },
        focus=_reachable(name, skin, inner, margin),
        layer_curves=("skin", "interface", "inner"),
    )


def _reachable(name: str, skin: Array, inner: Array, margin: float) -> Array:
    """Return the points (n, 2) of skin and inner side that a package may touch."""
    skin, inner = resampled(skin, FOCUS_SPACING_MM), resampled(inner, FOCUS_SPACING_MM)
    along_skin, along_inner = arc_lengths(skin), arc_lengths(inner)
    if name == "upper":
        outwards, inwards = along_skin - margin, margin + along_inner[-1] - along_inner
    else:
        outwards, inwards = margin - along_skin, along_skin[-1] - margin + along_inner
    return np.concatenate(
        [skin[outwards <= OUTER_REACH_MM[name]], inner[inwards <= INNER_REACH_MM]]
    )
