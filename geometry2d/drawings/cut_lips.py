"""Curves of a lip from its outline in a cut through a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from geometry2d.drawings.chains import DrawingError
from geometry2d.drawings.joined import JOIN_MM
from geometry2d.outline import Outline

Array = NDArray[np.float64]

LIP_CURVES = ("skin", "inner", "bone")


def lip_curves(
    lip: str,
    loop: Outline,
    *,
    skin_end: ArrayLike,
    dermis_end: ArrayLike,
    bone_start: ArrayLike,
    bone_end: ArrayLike,
) -> dict[str, Array]:
    """Return the three curves of a lip from its outline, which is a cut through a surface.

    Parameters
    ----------
    lip
        "upper" or "lower".
    loop
        Outline of the lip's tissue, as `geometry2d.drawings.stl.cut` returns it.
    skin_end, dermis_end, bone_start, bone_end
        (2,) points near the outline, mm, in this order along it: the cut of the section at the
        skin; the end of the dermis inside the mouth; the start of the bone behind the free inner
        side; the cut of the section at the bone.

    Returns
    -------
    dict
        Curves "LIP_skin", "LIP_inner" and "LIP_bone" for a `HeadDrawing`.

    Raises
    ------
    DrawingError
        If the points have another order along the outline.
    """
    places = [np.asarray(p, float) for p in (skin_end, dermis_end, bone_start, bone_end)]
    at = loop.project(np.array(places)).arc_length
    for way in (1, -1):
        steps = np.mod(way * np.diff(at), loop.length)
        if np.sum(steps) < loop.length and np.all(steps > 0):
            starts = at[0] + way * np.concatenate([[0.0], np.cumsum(steps)])
            return {
                f"{lip}_{name}": _stretch_of(loop, first, last)
                for name, first, last in zip(LIP_CURVES, starts[:-1], starts[1:], strict=True)
            }
    raise DrawingError(
        f"the four points of the {lip} lip lie {np.round(at, 2).tolist()} mm along its outline of "
        f"{loop.length:.2f} mm: give them in the order skin_end, dermis_end, bone_start, bone_end"
    )


def _stretch_of(loop: Outline, first: float, last: float) -> Array:
    """Return the points (n, 2) of a polygon between two arc lengths: its corners and both ends."""
    low, high = sorted((first, last))
    joints = np.concatenate([loop.breaks[:-1] + turn * loop.length for turn in (-1, 0, 1)])
    between = joints[(joints > low + JOIN_MM) & (joints < high - JOIN_MM)]
    points = loop.point_at(np.concatenate([[low], between, [high]]))[0]
    return points if first < last else points[::-1]
