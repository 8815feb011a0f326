"""What a replay computes: the undeformed section once, then one increment after another."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidPlacement
from scenarios.results.quantities import HISTORY

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class SolutionError(DrinksimError):
    """A run does not hold what is asked of it."""


@dataclass(frozen=True, eq=False)
class SectionModel:
    """The undeformed section.

    Parameters
    ----------
    nodes
        (n, 2) positions in the head frame, mm.
    triangles
        (e, 6) nodes of quadratic triangles: corners 0, 1, 2, then the middles of 01, 12, 20.
    region, region_names
        (e,) index of the region of each triangle, and the names (``upper_dermis``, …).
    skin
        by lip, (m, 3) nodes (first, last, middle) of the edges that may touch, in order: the outer
        skin and the lip's free inner side. The arc length of contact fields starts at the first.
    outlines
        polylines (k, 2), mm. In the neck frame ``upper_wall``, ``lower_wall`` and ``package``, what
        one sees of it from the side; in the head frame ``upper_tooth``, ``lower_tooth``,
        ``upper_jaw``, ``lower_jaw`` and ``profile`` of the face, the lower ones as the jaw is
        built; ``jaw_hinge`` is one point, if the jaw turns. Any may be absent.
    """

    nodes: Array
    triangles: Integers
    region: Integers
    region_names: tuple[str, ...]
    skin: Mapping[str, Integers]
    outlines: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class ContactField:
    """Contact along the free surface of one lip, at its nodes in order.

    All arrays are (s,): ``arc_mm`` on the undeformed surface, increasing, ``pressure_mpa``,
    ``shear_mpa``, ``gap_mm`` and ``neck_arc_mm``, the arc length along the wall outline touched
    (nan where none). Pressure and shear are linear along each edge and recovered from the forces
    of the nodes, so they may reach an edge beyond the last node that touches.
    """

    arc_mm: Array
    pressure_mpa: Array
    shear_mpa: Array
    gap_mm: Array
    neck_arc_mm: Array


@dataclass(frozen=True, eq=False)
class LipContact:
    """Contact along one lip over a run: ``arc_mm`` (s,), and (k, s) fields by name."""

    arc_mm: Array
    fields: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Measured:
    """What is measured on a committed state: members as in :class:`Increment`.

    ``recovered_window_kpa`` is the pressure over 0.5 mm of each lip, measured in a second way.
    """

    element: Mapping[str, NDArray[Any]]
    contact: Mapping[str, ContactField]
    history: Mapping[str, float]
    recovered_window_kpa: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Increment:
    """One committed step of a replay.

    Parameters
    ----------
    time_s, relative_time
        time of the recording, s, and 0…1 over the replay.
    placement
        the neck frame in the head frame.
    displacement
        (n, 2) mm.
    element
        by name of :data:`ELEMENT_FIELDS`, (e,) element means.
    contact
        by lip.
    history
        by name of :data:`HISTORY`; time, package and iteration columns may be left out, because
        they follow from the other members.
    newton_iterations, cutbacks
        Newton iterations and rejected trials of the step.
    checkpoint
        arrays by name from which the solver goes on after this increment.
    """

    time_s: float
    relative_time: float
    placement: RigidPlacement
    displacement: Array
    element: Mapping[str, NDArray[Any]]
    contact: Mapping[str, ContactField]
    history: Mapping[str, float]
    newton_iterations: int
    cutbacks: int
    checkpoint: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def row(self) -> dict[str, float]:
        """Return the line of history.csv of this increment, by column."""
        known = {
            **self.history,
            "time_s": self.time_s,
            "relative_time": self.relative_time,
            "package_x_mm": self.placement.shift_mm[0],
            "package_y_mm": self.placement.shift_mm[1],
            "package_theta_deg": math.degrees(self.placement.angle_rad),
            "newton_iterations": self.newton_iterations,
            "cutbacks": self.cutbacks,
        }
        names = {quantity.name for quantity in HISTORY}
        if known.keys() != names:
            raise SolutionError(
                f"history columns missing: {sorted(names - known.keys())}, "
                f"unknown: {sorted(known.keys() - names)}"
            )
        return {quantity.name: float(known[quantity.name]) for quantity in HISTORY}
