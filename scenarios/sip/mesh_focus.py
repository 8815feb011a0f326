"""Where a mesh of the lips is finest: on the skin that the neck comes near on its path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.head import HeadSection
from geometry2d.curves import resampled
from geometry2d.neck import NeckSection
from geometry2d.regions import Section
from geometry2d.rigid import RigidMotion

Array = NDArray[np.float64]

INSTANTS = 100
"""Of the motion, at which it is looked where the neck is."""

SPACING_MM = 0.05
"""Spacing of the points of skin that are looked at, mm, much smaller than an edge of any mesh."""


def focused_on_path(
    head: HeadSection, neck: NeckSection, motion: RigidMotion, reach_mm: float
) -> HeadSection:
    """Return a head whose mesh is finest where the neck comes near the lips at rest.

    Parameters
    ----------
    head
        The sections of the lips; what is left of the focus of each are the points that a wall of
        the neck comes nearer than ``reach_mm`` at any instant, or has inside it. A lip that it
        never comes so near keeps its whole focus.
    neck, motion
        The neck in its own frame, and its motion in the frame of the head section.
    reach_mm
        Distance, mm.
    """
    times = np.linspace(motion.time_s[0], motion.time_s[-1], INSTANTS)
    placements = [motion.at(float(time)) for time in times]

    def focused(section: Section) -> Section:
        skin = np.concatenate(
            [resampled(section.curves[name], SPACING_MM) for name in ("inner", "skin")]
        )
        near = np.zeros(len(skin), np.bool_)
        for place in placements:
            local = place.pull_back(skin)
            for wall in (neck.upper_wall, neck.lower_wall):
                left, low, right, high = wall.box
                beside = np.abs(local - np.clip(local, (left, low), (right, high)))
                maybe = np.flatnonzero(~near & np.all(beside < reach_mm, axis=1))
                near[maybe] = wall.project(local[maybe]).distance < reach_mm
        return replace(section, focus=skin[near]) if near.any() else section

    return replace(head, upper=focused(head.upper), lower=focused(head.lower))
