"""A soft block under the flat crest of a thread: how finely contact must be sampled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Body
from fem2d.body.surface import Surface
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.solvers.commit import Commit
from geometry2d.outline import Outline
from scenarios.sip.contact_line import ContactLine
from tests.support.contact_models import (
    LoadedModel,
    block,
    followed,
    graded,
    linear_elastic,
    loaded,
    path,
    unknowns,
)

Array = NDArray[np.float64]
NO_FRICTION = FrictionLaw(0.0)


def supported(
    body: Body, pairs: Sequence[Any], *, symmetric: bool = False, **options: Any
) -> LoadedModel:
    """A model on a fixed bottom, the left side on rollers if it is a plane of symmetry."""
    held = [unknowns(body, "bottom", 0), unknowns(body, "bottom", 1)]
    if symmetric:
        held.append(unknowns(body, "left", 0))
    return loaded(body, contacts=tuple(pairs), held=np.unique(np.concatenate(held)), **options)


def pressed_by_crest(edge: float, *, aside: float = 0.0, **points: Any) -> tuple[Surface, Commit]:
    """A soft quadratic block under the crest: its surface and the last commit.

    The crest is 1.6 mm wide, its middle ``aside`` of the block's, its corners are of 0.4 mm;
    ``points`` are those of :meth:`Body.surface`.
    """
    body = block(
        np.linspace(-3, 3, round(6 / edge) + 1),
        -graded(3, edge, 1.0, 1.2)[::-1],
        linear_elastic(0.1, 0.45),
        element="T6",
    )
    top = body.surface("top", **points)
    motion = path([0, 1], [[0, 0], [0, -0.3]])
    return top, followed(supported(body, [_crest(top, aside)]), motion, increments=6)[-1]


def _crest(top: Surface, aside: float) -> RigidContact:
    crest = Outline.from_corners([[-0.8, 0], [0.8, 0], [0.8, 3], [-0.8, 3]], 0.4)
    return RigidContact(
        top, crest.moved(0.0, [aside, 0.0]), normal=NormalLaw(), friction=NO_FRICTION, name="crest"
    )


def pressure_under_crest(edge: float, **points: Any) -> tuple[Array, Array]:
    """Places, mm, and pressures, kPa, each place once, from the middle of the crest outwards."""
    top, last = pressed_by_crest(edge, **points)
    place, first = np.unique(np.round(top.nodal(top.arc_length) - 3.0, 9), return_index=True)
    pressure = 1e3 * top.nodal(last.contacts[0].points.pressure).ravel()[first]
    return place[place >= 0], pressure[place >= 0]


def length_under_crest(edge: float, aside: float) -> float:
    """Length of contact, mm."""
    top, last = pressed_by_crest(edge, aside=aside, at_nodes=True)
    place = top.positions(last.state.displacement)[..., 0]
    points = last.contacts[0].points
    # The top runs from right to left.
    line = ContactLine(points.pressure * top.weight, top.weight, -place, points.gap)
    return line.contact_length()
