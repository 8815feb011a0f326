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

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Body
from fem2d.contact.rigid import rigid_contacts
from fem2d.export.contact_cards import (
    contact_cards,
    contact_surfaces,
    outlines_at_start,
    reference_nodes,
    rigid_body_cards,
    rigid_name,
    surface_cards,
)
from fem2d.export.tissue_cards import DeckError, spring_cards, tissue_cards
from fem2d.loads.dead import DeadLoad
from fem2d.loads.tie import ElasticTie
from fem2d.solvers.model import Model
from geometry2d.foundation.settings import setting
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion

Array = NDArray[np.float64]
Index = NDArray[np.int64]

AMPLITUDES = ("MOVE_U1", "MOVE_U2", "MOVE_UR3")
LARGEST_RESIDUAL, LARGEST_CORRECTION = 1e-6, 1e-6
"""Where iterations end: residual over average force, and correction over increment. Unasked, both
programs leave displacements in error by up to a hundredth of what the last increment moved."""


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
    outlines = outlines_at_start(model, motion, start_s)
    lines = [
        *_comment(
            title,
            "units: mm, s, N, MPa, tonne; origin at the ear, x forward, y up",
            "ties to bone are grounded springs, lumped at the nodes",
            "rigid surfaces run so that the tissue is on their left, where their normal points",
        ),
        *tissue_cards(model.body, density=model.inertia.density_tonne_per_mm3,
                 beta=model.inertia.relaxation_s),
        *spring_cards(model.body, model.ties),
        *surface_cards(model.body, contact_surfaces(model)),
        *rigid_body_cards(model, outlines, motion, start_s),
        *contact_cards(model, chosen.ramp_points),
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
        *tissue_cards(body, density=0.0, beta=0.0),
        *spring_cards(body, ties),
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
    references = reference_nodes(model.body, outlines)
    moving = {rigid_name(pair) for pair in rigid_contacts(model.contacts) if pair.moving}
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
    if model.prony is not None:
        raise DeckError("the tissue is viscous: a deck has elastic tissue only")
    for tie in model.ties:
        if tie.attached_at is not None or tie.only_along is not None:
            raise DeckError(
                f"tie {tie.name!r} moves with the package or holds one direction only: "
                "a deck has grounded springs"
            )
