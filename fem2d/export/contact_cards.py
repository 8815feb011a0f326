"""Cards of a deck for contact: surfaces, rigid outlines, and pairs with their laws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np

from fem2d.body.body import Body
from fem2d.body.surface import Surface
from fem2d.contact.laws import NormalLaw, pressure_of_gap
from fem2d.contact.rigid import RigidContact, rigid_contacts
from fem2d.contact.self_contact import self_contacts
from fem2d.export.tissue_cards import DeckError, corners_first
from fem2d.solvers.model import Model
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion

FACES = ("S1", "S2", "S3")
"""Faces of a triangle: nodes 1-2, 2-3, 3-1."""

LONGEST_ARC_RAD = np.deg2rad(150.0)
"""Abaqus requires arcs below half a circle."""


def surface_cards(body: Body, surfaces: Mapping[str, Surface]) -> Iterator[str]:
    """Yield deformable surfaces by the faces of their elements."""
    triangles = corners_first(body)
    sides = {
        (int(nodes[k]), int(nodes[(k + 1) % 3])): (element + 1, FACES[k])
        for element, nodes in enumerate(triangles)
        for k in range(3)
    }
    for name, surface in surfaces.items():
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        for first, last in surface.edges[:, :2].tolist():
            element, face = sides[first, last]
            yield f"{element}, {face}"


def contact_surfaces(model: Model) -> dict[str, Surface]:
    """Return deformable surfaces by name; pairs that share one name it once."""
    surfaces: dict[str, Surface] = {}
    for surface in (surface for contact in model.contacts for surface in contact.surfaces):
        surfaces.setdefault(_surface_name(model.body, surface), surface)
    return surfaces


def _surface_name(body: Body, surface: Surface) -> str:
    """Return a name made of those of the boundaries that the surface consists of."""
    wanted = {tuple(edge) for edge in surface.edges.tolist()}
    parts = {
        name: edges
        for name in sorted(body.mesh.boundaries or {})
        if (edges := {tuple(edge) for edge in body.edges(name).tolist()}) <= wanted
    }
    if set().union(*parts.values()) != wanted:
        raise DeckError(
            "a contact surface consists of no named boundaries of the mesh: name its parts"
        )
    return "_".join([*(name.upper() for name in parts), "FACES"])


def outlines_at_start(model: Model, motion: RigidMotion, start_s: float) -> dict[str, Outline]:
    """Return rigid outlines where they are at the start, by the last word of their pairs' names."""
    start = motion.at(start_s)
    outlines: dict[str, Outline] = {}
    for pair in rigid_contacts(model.contacts):
        placed = pair.outline
        if pair.moving:
            placed = placed.moved(start.angle_rad, start.shift_mm)
        known = outlines.setdefault(rigid_name(pair), placed)
        if not np.array_equal(known.start, placed.start):
            raise DeckError(f"two rigid outlines are called {rigid_name(pair)}: rename a pair")
    return outlines


def rigid_name(pair: RigidContact) -> str:
    """Return the name of a contact's outline: the last word of its own."""
    return pair.name.split()[-1].upper()


def reference_nodes(body: Body, outlines: Mapping[str, Outline]) -> dict[str, int]:
    """Return the number of the node that moves each rigid outline, behind those of the tissue."""
    return {name: len(body.nodes) + k for k, name in enumerate(outlines, start=1)}


def rigid_body_cards(
    model: Model, outlines: Mapping[str, Outline], motion: RigidMotion, start_s: float
) -> Iterator[str]:
    """Yield rigid outlines as analytical surfaces, each with the node that moves it."""
    moving = {rigid_name(pair) for pair in rigid_contacts(model.contacts) if pair.moving}
    references = reference_nodes(model.body, outlines)
    for name, outline in outlines.items():
        x, y = motion.at(start_s).shift_mm if name in moving else outline.start[0].tolist()
        yield f"*NODE, NSET={name}_REF"
        yield f"{references[name]}, {x:.12g}, {y:.12g}"
        yield f"*SURFACE, NAME={name}, TYPE=SEGMENTS"
        yield from _segments(outline)
        yield f"*RIGID BODY, REF NODE={references[name]}, ANALYTICAL SURFACE={name}"


def _segments(outline: Outline) -> Iterator[str]:
    """Yield an outline travelled clockwise, its outside on the left."""
    first = outline.start[0]
    yield f"START, {first[0]:.12g}, {first[1]:.12g}"
    count = len(outline.start)
    for piece in range(count - 1, -1, -1):
        x, y = outline.start[piece]
        bend, (cx, cy) = outline.curvature[piece], outline.centre[piece]
        if bend == 0:
            yield f"LINE, {x:.12g}, {y:.12g}"
            continue
        low, high = outline.breaks[piece], outline.breaks[piece + 1]
        parts = int(np.ceil(abs(bend) * (high - low) / LONGEST_ARC_RAD))
        for px, py in outline.point_at(np.linspace(high, low, parts + 1)[1:])[0]:
            yield f"CIRCL, {px:.12g}, {py:.12g}, {cx:.12g}, {cy:.12g}"


def contact_cards(model: Model, ramp_points: int) -> Iterator[str]:
    """Yield contact pairs, each with its friction and its pressure against overclosure."""
    body = model.body
    pairs = [
        (_surface_name(body, pair.surface), rigid_name(pair), pair.normal, pair.friction)
        for pair in rigid_contacts(model.contacts)
    ]
    for contact in self_contacts(model.contacts):
        names = [_surface_name(body, surface) for surface in contact.surfaces]
        pairs += [(*both, contact.normal, contact.friction) for both in combinations(names, 2)]
        if contact.same_surface:
            pairs += [(name, "", contact.normal, contact.friction) for name in names]
    for number, (name, other, normal, friction) in enumerate(pairs, start=1):
        yield f"*SURFACE INTERACTION, NAME=INTERACTION_{number}"
        yield f"{body.thickness_mm:.12g}"
        yield "*FRICTION"
        yield f"{friction.coefficient:.12g}"
        yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR"
        yield from _pressure_overclosure(normal, ramp_points)
        yield f"*CONTACT PAIR, INTERACTION=INTERACTION_{number}, TYPE=SURFACE TO SURFACE"
        yield f"{name}, {other}"


def _pressure_overclosure(law: NormalLaw, points: int) -> Iterator[str]:
    """Yield pressure against overclosure: points on the ramp, then a straight line."""
    ramp = law.ramp_mm
    for overclosure in (*np.linspace(0.0, ramp, points + 1), 2.0 * ramp):
        _, pressure, _ = pressure_of_gap(-float(overclosure), law.stiffness_mpa_per_mm, law.ramp_mm)
        yield f"{pressure:.12g}, {overclosure:.12g}"
