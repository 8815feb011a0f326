"""Input decks: a model for Abaqus, and its tissue alone for Abaqus and CalculiX.

Abaqus gets everything: tissue, elastic ties, rigid outlines as analytical surfaces, contact with
friction, the motion as amplitudes, and an implicit quasi-static step. CalculiX has no analytical
rigid surfaces and no Holzapfel law; `displaced_tissue_deck` leaves out contact and prescribes
displacements instead, which both programs read: it serves to compare them.

What the decks approximate:

* ties: grounded springs at the nodes, each with its share of the layer's stiffness, where the layer
  itself is integrated along the edges;
* normal contact: the penalty's pressure against overclosure in straight pieces; friction sticks
  with Abaqus' own elastic slip;
* relaxation: stiffness-proportional damping;
* the motion: straight lines between instants.

Dead loads are forces at the nodes with Abaqus' smooth step, which is the amplitude they have here.

Ties to the moving body are refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.body.surface import Surface
from fem2d.contact.laws import NormalLaw, pressure_of_gap
from fem2d.contact.rigid import RigidContact, rigid_contacts
from fem2d.contact.self_contact import self_contacts
from fem2d.loads.dead import DeadLoad
from fem2d.loads.tie import ElasticTie
from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.material import Material
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden
from fem2d.solvers.model import Model
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion

Array = NDArray[np.float64]
Index = NDArray[np.int64]

AMPLITUDES = ("MOVE_U1", "MOVE_U2", "MOVE_UR3")
LONGEST_ARC_RAD = np.deg2rad(150.0)
"""Abaqus requires arcs below half a circle."""
FACES = ("S1", "S2", "S3")
"""Faces of a triangle: nodes 1-2, 2-3, 3-1."""
LARGEST_RESIDUAL, LARGEST_CORRECTION = 1e-6, 1e-6
"""Where iterations end: residual over average force, and correction over increment. Unasked, both
programs leave displacements in error by up to a hundredth of what the last increment moved."""
CARD_WIDTH = 8
"""Most numbers in one line of material constants."""


class DeckError(DrinksimError):
    """The model has a member without counterpart in a deck."""


@dataclass(frozen=True)
class DeckSettings:
    """How finely a deck approximates the model.

    Parameters
    ----------
    amplitude_step_s
        Time between the points of the motion, s.
    ramp_points
        Points of the table of contact pressure over the ramp of the penalty.
    """

    amplitude_step_s: float = setting(
        default=0.01, unit="s", above=0.0, description="time between the points of the motion"
    )
    ramp_points: int = setting(
        default=8,
        minimum=1,
        maximum=1000,
        description="points of the contact pressure over the ramp of the penalty",
    )


def abaqus_deck(
    model: Model,
    motion: RigidMotion,
    *,
    start_s: float,
    end_s: float,
    title: str,
    settings: DeckSettings | None = None,
) -> str:
    """Return a whole model as an Abaqus/Standard input deck.

    Parameters
    ----------
    model
        Tissue, contacts, ties. Units stay mm, s, N, MPa, tonne.
    motion
        Of the moving rigid outlines, in the frame of the tissue.
    start_s, end_s
        Period of the motion; the tissue is undeformed at its start.
    title
        Heading.
    settings
        How finely the deck approximates the model.

    Raises
    ------
    DeckError
        If the model has an element, a material or a load without counterpart.
    """
    _check_expressible(model)
    chosen = settings or DeckSettings()
    outlines = _outlines(model, motion, start_s)
    lines = [
        *_comment(
            title,
            "units: mm, s, N, MPa, tonne; origin at the ear, x forward, y up",
            "ties to bone are grounded springs, lumped at the nodes",
            "rigid surfaces run so that the tissue is on their left, where their normal points",
        ),
        *_tissue(model.body, density=model.inertia.density_tonne_per_mm3,
                 beta=model.inertia.relaxation_s),
        *_springs(model.body, model.ties),
        *_surfaces(model.body, _contact_surfaces(model)),
        *_rigid_bodies(model, outlines, motion, start_s),
        *_contacts(model, chosen.ramp_points),
        *_amplitudes(motion, start_s, end_s, chosen.amplitude_step_s),
        *_pull_amplitudes(model, start_s),
        *_dynamic_step(model, outlines, start_s, end_s),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def displaced_tissue_deck(
    body: Body, ties: Iterable[ElasticTie], displaced: Mapping[int, Array], *, title: str
) -> str:
    """Return tissue and ties under prescribed displacements, for Abaqus and CalculiX alike.

    Parameters
    ----------
    body, ties
        The model.
    displaced
        Displacement (2,), mm, of the nodes (counted from 0) that are moved.
    title
        Heading.

    Raises
    ------
    DeckError
        If the model has an element or a material without counterpart.
    """
    lines = [
        *_comment(title, "units: mm, N, MPa"),
        *_tissue(body, density=0.0, beta=0.0),
        *_springs(body, ties),
        "*STEP, NLGEOM=YES, INC=1000",
        "*STATIC",
        "0.1, 1.0, 1e-6, 0.25",
        "*CONTROLS, PARAMETERS=FIELD",
        f"{LARGEST_RESIDUAL:g}, {LARGEST_CORRECTION:g}",
        "*BOUNDARY",
        *(
            f"{node + 1}, {axis + 1}, {axis + 1}, {shift[axis]:.12g}"
            for node, shift in sorted(displaced.items())
            for axis in (0, 1)
        ),
        "*NODE PRINT, NSET=TISSUE, FREQUENCY=1000",
        "U",
        "*END STEP",
    ]
    return "\n".join(lines) + "\n"


def _comment(title: str, *notes: str) -> list[str]:
    return ["*HEADING", title, *(f"** {note}" for note in notes)]


def _tissue(body: Body, *, density: float, beta: float) -> Iterator[str]:
    """Yield nodes, elements, sets, materials and sections."""
    if body.element.name not in ("T6", "T6R") or body.plane is Plane.AXISYMMETRIC:
        raise DeckError(
            f"a deck holds quadratic triangles in plane stress or strain, not {body.element.name} "
            f"in plane {body.plane.name.lower()}"
        )
    kind = "CPS6" if body.plane is Plane.STRESS else "CPE6"
    yield "*NODE, NSET=TISSUE"
    for number, (x, y) in enumerate(body.nodes, start=1):
        yield f"{number}, {x:.12g}, {y:.12g}"
    triangles = _corners_first(body)
    named = _names(body)
    for name, elements in named.items():
        yield f"*ELEMENT, TYPE={kind}, ELSET={name}"
        for element in elements:
            yield ", ".join(str(n) for n in (element + 1, *(triangles[element] + 1)))
    for name in sorted(body.mesh.boundaries or {}):
        yield f"*NSET, NSET={name.upper()}"
        yield from _rows(body.boundary_nodes(name) + 1)
    for name, elements in named.items():
        material = body.materials[int(body.material_of[elements[0]])]
        yield from _material(name, material, density, beta)
        oriented = f", ORIENTATION={name}_FIBRES" if _fibres(material) else ""
        yield f"*SOLID SECTION, ELSET={name}, MATERIAL={name}{oriented}"
        yield f"{body.thickness_mm:.12g}"


def _names(body: Body) -> dict[str, Index]:
    """Elements of every subdomain, by the set's name."""
    return {name.upper(): body.elements_of(name) for name in sorted(body.mesh.subdomains or {})}


def _corners_first(body: Body) -> Index:
    """(e, 6) nodes: corners counter-clockwise, then the middle nodes of sides 1-2, 2-3, 3-1."""
    triangles = body.tables.connectivity
    a, b, c = (body.nodes[triangles[:, k]] for k in range(3))
    clockwise = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    turned: Index = np.where(clockwise[:, None], triangles[:, [0, 2, 1, 5, 4, 3]], triangles)
    return turned


def _rows(numbers: Iterable[int]) -> Iterator[str]:
    listed = [str(number) for number in numbers]
    for first in range(0, len(listed), 16):
        yield ", ".join(listed[first : first + 16])


def _material(name: str, material: Material, density: float, beta: float) -> Iterator[str]:
    directions = _fibres(material)
    if directions:
        yield f"*ORIENTATION, NAME={name}_FIBRES, LOCAL DIRECTIONS={len(directions)}"
        yield "1., 0., 0., 0., 1., 0."
        yield "3, 0."
        for direction in directions:
            yield ", ".join(f"{x:.12g}" for x in direction)
    yield f"*MATERIAL, NAME={name}"
    if density > 0:
        yield "*DENSITY"
        yield f"{density:.12g}"
    if beta > 0:
        yield f"*DAMPING, BETA={beta:.12g}"
    match material:
        case NeoHookean():
            yield "*HYPERELASTIC, NEO HOOKE"
            yield from _constants([material.C10_mpa, material.D1_per_mpa])
        case Ogden():
            terms = [x for pair in zip(material.mu_mpa, material.alpha, strict=True) for x in pair]
            missing = len(material.mu_mpa) - len(material.D_per_mpa)
            yield f"*HYPERELASTIC, OGDEN, N={len(material.mu_mpa)}"
            yield from _constants([*terms, *material.D_per_mpa, *[0.0] * missing])
        case HolzapfelGasserOgden():
            yield f"*ANISOTROPIC HYPERELASTIC, HOLZAPFEL, LOCAL DIRECTIONS={len(directions)}"
            yield from _constants(
                [material.C10_mpa, material.D_per_mpa, material.k1_mpa, material.k2, material.kappa]
            )
        case _:
            raise DeckError(f"{name} is of {type(material).__name__}, which no deck can say")


def _fibres(material: Material) -> tuple[tuple[float, float, float], ...]:
    return material.fibres if isinstance(material, HolzapfelGasserOgden) else ()


def _constants(numbers: list[float]) -> Iterator[str]:
    for first in range(0, len(numbers), CARD_WIDTH):
        yield ", ".join(f"{x:.12g}" for x in numbers[first : first + CARD_WIDTH])


def _springs(body: Body, ties: Iterable[ElasticTie]) -> Iterator[str]:
    """Yield a grounded spring for each node and direction that ties hold."""
    stiffness = np.zeros(2 * len(body.nodes))
    for tie in ties:
        dofs, blocks = tie.blocks()
        rows = blocks.sum(axis=2)  # lumped; a tie along one direction only is refused
        np.add.at(stiffness, dofs, rows)
    number = len(body.tables.connectivity)
    for dof in np.flatnonzero(stiffness > 0):
        number += 1
        name = f"TIE_{dof // 2 + 1}_{dof % 2 + 1}"
        yield f"*ELEMENT, TYPE=SPRING1, ELSET={name}"
        yield f"{number}, {dof // 2 + 1}"
        yield f"*SPRING, ELSET={name}"
        yield f"{dof % 2 + 1}"
        yield f"{stiffness[dof]:.12g}"


def _surfaces(body: Body, surfaces: Mapping[str, Surface]) -> Iterator[str]:
    triangles = _corners_first(body)
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


def _contact_surfaces(model: Model) -> dict[str, Surface]:
    """Deformable surfaces by name; pairs that share one name it once."""
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


def _outlines(model: Model, motion: RigidMotion, start_s: float) -> dict[str, Outline]:
    """Rigid outlines where they are at the start, by the last word of their pairs' names."""
    start = motion.at(start_s)
    outlines: dict[str, Outline] = {}
    for pair in rigid_contacts(model.contacts):
        placed = pair.outline
        if pair.moving:
            placed = placed.moved(start.angle_rad, start.shift_mm)
        known = outlines.setdefault(_rigid_name(pair), placed)
        if not np.array_equal(known.start, placed.start):
            raise DeckError(f"two rigid outlines are called {_rigid_name(pair)}: rename a pair")
    return outlines


def _rigid_name(pair: RigidContact) -> str:
    return pair.name.split()[-1].upper()


def _reference_nodes(body: Body, outlines: Mapping[str, Outline]) -> dict[str, int]:
    return {name: len(body.nodes) + k for k, name in enumerate(outlines, start=1)}


def _rigid_bodies(
    model: Model, outlines: Mapping[str, Outline], motion: RigidMotion, start_s: float
) -> Iterator[str]:
    moving = {_rigid_name(pair) for pair in rigid_contacts(model.contacts) if pair.moving}
    references = _reference_nodes(model.body, outlines)
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


def _contacts(model: Model, ramp_points: int) -> Iterator[str]:
    body = model.body
    pairs = [
        (_surface_name(body, pair.surface), _rigid_name(pair), pair.normal, pair.friction)
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


def _amplitudes(motion: RigidMotion, start_s: float, end_s: float, step_s: float) -> Iterator[str]:
    """Yield the moving body's displacement and turn since the start, against step time."""
    count = int(np.ceil((end_s - start_s) / step_s)) + 1
    times = np.linspace(start_s, end_s, count)
    sampled = motion.resampled(times)
    moved = sampled.shift_mm - sampled.shift_mm[0]
    turned = sampled.angle_rad - sampled.angle_rad[0]
    for name, values in zip(AMPLITUDES, (*moved.T, turned), strict=True):
        yield f"*AMPLITUDE, NAME={name}, DEFINITION=TABULAR"
        pairs = [f"{t:.9g}, {v:.12g}" for t, v in zip(times - start_s, values, strict=True)]
        for first in range(0, count, 4):
            yield ", ".join(pairs[first : first + 4])


def _dead_loads(model: Model) -> list[DeadLoad]:
    return [load for load in model.loads if isinstance(load, DeadLoad)]


def _pull_amplitudes(model: Model, start_s: float) -> Iterator[str]:
    """Yield how much of each dead load acts, against step time."""
    for number, load in enumerate(_dead_loads(model), start=1):
        yield f"*AMPLITUDE, NAME=PULL_{number}, DEFINITION=SMOOTH STEP"
        amplitude = load.amplitude
        for time, factor in zip(amplitude.time_s, amplitude.factor, strict=True):
            yield f"{time - start_s:.9g}, {factor:.12g}"


def _pulls(model: Model) -> Iterator[str]:
    """Yield each dead load as forces at the nodes."""
    for number, load in enumerate(_dead_loads(model), start=1):
        force = load.surface.scattered(load.full_force)
        yield f"*CLOAD, AMPLITUDE=PULL_{number}"
        for dof in np.flatnonzero(force):
            yield f"{dof // 2 + 1}, {dof % 2 + 1}, {force[dof]:.12g}"


def _dynamic_step(
    model: Model, outlines: Mapping[str, Outline], start_s: float, end_s: float
) -> Iterator[str]:
    references = _reference_nodes(model.body, outlines)
    moving = {_rigid_name(pair) for pair in rigid_contacts(model.contacts) if pair.moving}
    yield "*STEP, NAME=SIP, NLGEOM=YES, INC=100000, UNSYMM=YES"
    yield "*DYNAMIC, APPLICATION=QUASI-STATIC"
    yield f"0.001, {end_s - start_s:.9g}, 1e-09, 0.02"
    still = [name for name in outlines if name not in moving]
    if still:
        yield "*BOUNDARY"
        yield from (f"{references[name]}, {dof}, {dof}" for name in still for dof in (1, 2, 6))
    for amplitude, dof in zip(AMPLITUDES, (1, 2, 6), strict=True):
        yield f"*BOUNDARY, AMPLITUDE={amplitude}"
        yield from (f"{references[name]}, {dof}, {dof}, 1." for name in outlines if name in moving)
    yield from _pulls(model)
    yield "*OUTPUT, FIELD, TIME INTERVAL=0.05"
    yield "*NODE OUTPUT"
    yield "U"
    yield "*ELEMENT OUTPUT"
    yield "S, LE"
    yield "*CONTACT OUTPUT"
    yield "CSTRESS, CDISP"
    yield "*OUTPUT, HISTORY, FREQUENCY=1"
    for name in outlines:
        yield f"*NODE OUTPUT, NSET={name}_REF"
        yield "RF1, RF2, RM3, U1, U2, UR3"
    yield "*END STEP"


def _check_expressible(model: Model) -> None:
    if len(_dead_loads(model)) < len(model.loads) or model.held.size:
        raise DeckError("the model has loads that are not dead, or held unknowns: a deck has none")
    for tie in model.ties:
        if tie.attached_at is not None or tie.only_along is not None:
            raise DeckError(
                f"tie {tie.name!r} moves with the package or holds one direction only: "
                "a deck has grounded springs"
            )
