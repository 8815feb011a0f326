"""Measures of a contact along a line: pressure over edges and windows, traction, length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.body.surface import Surface
from fem2d.contact.rigid import RigidContactResponse

Array = NDArray[np.float64]

WINDOW_MM = 0.5
"""Length of deformed lip over which the window pressure is averaged (DESIGN, files)."""

SAMPLE_MM = 0.01
"""Steps in which a window moves over a recovered traction."""

TOUCHING_MM = 0.005
"""A smaller gap is none: the penalty lets surfaces overlap by up to that, and the lines of skin are
0.02 to 0.2 mm deep (Bibb, Eggbeer and Paterson, *Medical Modelling*, 2015, section 6.17.3). The
place where surfaces part by less than that converges slowly with the mesh
(docs/theory/contact.md)."""


@dataclass(frozen=True)
class ContactLine:
    """Load and gap along a surface, edges and points in order along it.

    Attributes
    ----------
    load
        (m, k) normal force per thickness that each node of an edge carries, N/mm.
    length
        (m, k) deformed length that each node stands for, mm.
    place
        (m, q) where each point that may touch lies along the deformed surface, mm, ascending.
    gap
        (m, q) distance of each of these points to the neck, mm, negative where it bears load.
    """

    load: Array
    length: Array
    place: Array
    gap: Array

    def top_two_edges(self) -> float:
        """Return the mean pressure, MPa, of the two edges with the highest mean pressure.

        This is the measure of the thesis (Figures 4.16 and 4.17). It rises as edges get shorter.
        """
        pressure = np.sort(self.load.sum(axis=1) / self.length.sum(axis=1))
        return float(np.mean(pressure[-2:]))

    def highest_window(self, window_mm: float = WINDOW_MM) -> float:
        """Return the highest mean pressure, MPa, over any ``window_mm`` of the deformed surface.

        The pressure is constant over the length that a node stands for, so the load up to a place
        is piecewise linear and the highest window starts or ends where two points meet.
        """
        ends = np.concatenate([[0.0], np.cumsum(self.length.ravel())])
        load = np.concatenate([[0.0], np.cumsum(self.load.ravel())])
        if ends[-1] <= window_mm:
            return float(load[-1] / ends[-1])
        starts = np.concatenate([ends, ends - window_mm])
        starts = starts[(starts >= 0) & (starts <= ends[-1] - window_mm)]
        within = np.interp(starts + window_mm, ends, load) - np.interp(starts, ends, load)
        return float(np.max(within)) / window_mm

    def recovered_window(self, window_mm: float = WINDOW_MM) -> float:
        """Return the highest mean, MPa, of the recovered traction over any ``window_mm``.

        Edges have a middle node. Both windows hold the same forces, :meth:`highest_window` as
        nodes carry them, this one as :func:`recovered_traction` spreads them. They tend to one
        another as edges get short beside the window; what they differ by is open until then.
        """
        edges = self.length.sum(axis=1)
        force = np.zeros(2 * len(edges) + 1)
        for local in range(3):
            np.add.at(force, 2 * np.arange(len(edges)) + local, self.load[:, local])
        ends = np.concatenate([[0.0], np.cumsum(edges)])
        place = np.empty(force.size)
        place[::2], place[1::2] = ends, 0.5 * (ends[1:] + ends[:-1])
        traction = recovered_traction(force, edges)
        if ends[-1] <= window_mm:
            return float(force.sum() / ends[-1])
        loaded = np.flatnonzero(traction > 0)
        if loaded.size == 0:
            return 0.0
        first, last = place[loaded[0]] - window_mm, place[loaded[-1]] + window_mm
        fine = np.linspace(first, last, int((last - first) / SAMPLE_MM) + 2)
        sampled = np.interp(fine, place, traction)
        steps = 0.5 * (sampled[1:] + sampled[:-1]) * np.diff(fine)
        load = np.concatenate([[0.0], np.cumsum(steps)])
        within = np.interp(fine + window_mm, fine, load) - load
        return float(np.max(within)) / window_mm

    def contact_length(self) -> float:
        """Return the deformed length that is nearer to the neck than `TOUCHING_MM`, mm.

        Beyond the end of a contact of round bodies the gap opens like the distance to the power of
        3/2 (Johnson, *Contact Mechanics*, 1985, section 5.1), so that its power of 2/3 is a
        straight line between points. If the point inside is closed, the line through the first two
        open ones is followed back. What bears no load at all does not touch.
        """
        if not self.load.any():
            return 0.0
        place, first = np.unique(self.place, return_index=True)  # edges may share their ends
        gap = self.gap.ravel()[first]
        near = np.concatenate([[False], gap < TOUCHING_MM, [False]])
        firsts = np.flatnonzero(near[1:] & ~near[:-1])
        lasts = np.flatnonzero(near[:-1] & ~near[1:]) - 1
        total = 0.0
        for begin, end in zip(firsts, lasts, strict=True):
            total += float(place[end] - place[begin])
            total += _beyond(place[end:], gap[end:])
            total += _beyond(-place[begin::-1], gap[begin::-1])
        return total


def recovered_traction(force: Array, length: Array) -> Array:
    """Return the traction at the nodes of quadratic edges in a row from the nodes' forces.

    The force on a node over the length that it stands for alternates between ends and middles of
    edges where the traction varies. What the forces do to displacements that are linear along each
    edge, they do exactly; over the length that such a displacement of one end stands for, half of
    both edges, that is a traction whose sum is the force and whose error is of second order. It
    keeps Coulomb's bound, and reaches at most one edge beyond the last node that bears load.

    Parameters
    ----------
    force
        (2m + 1,) of each node in the order end, middle, end, …, end.
    length
        (m,) of each edge, deformed; with a force in N and an area in mm² the traction is in MPa.

    Returns
    -------
    Array
        (2m + 1,) at the same nodes, linear along each edge.
    """
    ends, middles = force[::2], 0.5 * force[1::2]
    work = ends + np.append(middles, 0.0) + np.append(0.0, middles)
    half = 0.5 * length
    traction = np.empty_like(force)
    traction[::2] = work / (np.append(half, 0.0) + np.append(0.0, half))
    traction[1::2] = 0.5 * (traction[:-2:2] + traction[2::2])
    return traction


def _beyond(place: Array, gap: Array) -> float:
    """Return how far beyond the first of these points, the last near one, `TOUCHING_MM` is, mm."""
    if place.size == 1:
        return 0.0
    inside, outside = (0, 1) if gap[0] >= 0 else (1, 2)
    if outside == place.size or gap[outside] <= gap[inside]:
        return 0.5 * float(place[1] - place[0])  # it closes again: another stretch is next to this
    opening = np.cbrt(gap[inside : outside + 1]) ** 2
    share = (TOUCHING_MM ** (2 / 3) - opening[0]) / (opening[1] - opening[0])
    reached = place[inside] + share * (place[outside] - place[inside])
    return max(0.0, float(reached - place[0]))


def line_on_neck(
    skin: Surface, on_neck: Sequence[RigidContactResponse], displacement: Array
) -> ContactLine:
    """Return the contact of a lip with the walls of a neck along its skin.

    Parameters
    ----------
    skin
        The free surface of the lip, with its nodes as points.
    on_neck
        Its contacts with the walls.
    displacement
        (n, 2) displacements, mm.
    """
    load = np.sum([r.contact.surface.carried(r.points.pressure) for r in on_neck], axis=0)
    length = skin.weight * skin.stretch(displacement)
    position = on_neck[0].contact.surface.positions(displacement).reshape(-1, 2)
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    gap = np.min([response.points.gap for response in on_neck], axis=0)
    place = np.concatenate([[0.0], np.cumsum(steps)]).reshape(gap.shape)
    thickness = skin.thickness_mm
    return ContactLine(load / thickness, length / thickness, place, gap)
