"""Components of a model that share no element, each a model of its own.

Two lips that do not touch are two problems: the one at rest needs no iterations because the other
one slides. A component has the surfaces, ties, loads and contacts of the whole model that lie on
it. The whole model starts from the results of its components; contact between components, which
they do not contain, costs iterations of the whole but is never missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from fem2d.body.body import Response
from fem2d.body.component import BodyComponent
from fem2d.contact.contact import ContactOnComponent
from fem2d.loads.load import Load
from fem2d.solvers.model import Model
from fem2d.solvers.state import State

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Component:
    """A component of a model as a model of its own.

    Attributes
    ----------
    model
        The component as a model.
    place
        The component as a part of the whole body.
    contacts
        Number of each contact of the whole model that lies on it, and the contact there.
    held
        Positions of the component's held unknowns among those of the whole model.
    """

    model: Model
    place: BodyComponent
    contacts: tuple[tuple[int, ContactOnComponent], ...]
    held: Index

    def load(self, whole: Load) -> Load:
        """Return the part of a load that acts on the component."""
        held, dead = whole.held_mm, whole.dead_n
        return replace(
            whole,
            held_mm=held[self.held] if isinstance(held, np.ndarray) and held.ndim else held,
            dead_n=dead[self.place.dofs] if isinstance(dead, np.ndarray) and dead.ndim else dead,
        )

    def state(self, whole: State) -> State:
        """Return the state of the component in a state of the whole model."""
        nodes, remembered = self.place.nodes, whole.overstress
        return replace(
            whole,
            load=self.load(whole.load),
            displacement=whole.displacement[nodes],
            velocity=whole.velocity[nodes],
            acceleration=whole.acceleration[nodes],
            contacts=tuple(part.state_of(whole.contacts[i]) for i, part in self.contacts),
            overstress=remembered and remembered.of_elements(self.place.elements),
        )

    def response(self, whole: Response) -> Response:
        """Return the component's part of a response; the energy remains that of the whole body."""
        place = self.place
        return Response(whole.energy, whole.force[place.dofs], whole.stiffness[place.entries])


def components_of(model: Model) -> tuple[Component, ...]:
    """Return the components of a model, the largest first.

    Empty if there is only one, or if a surface spans several.
    """
    number = component_of_node(model)
    count = int(number.max()) + 1
    surfaces = [
        *(surface for contact in model.contacts for surface in contact.surfaces),
        *(tie.surface for tie in model.ties),
        *(surface for load in model.loads for surface in load.surfaces),
    ]
    if count == 1 or any(len(np.unique(number[s.edges])) > 1 for s in surfaces):
        return ()
    largest_first = np.argsort(-np.bincount(number), kind="stable")
    return tuple(_component(model, np.flatnonzero(number == each)) for each in largest_first)


def component_of_node(model: Model) -> Index:
    """Return the number (n,) of the component that each node belongs to."""
    pattern = model.body.pattern
    _, label = connected_components(pattern.matrix(np.ones(pattern.nonzeros)), directed=False)
    return np.asarray(label[::2], np.intp)


def gather(components: Sequence[Component], displacements: Sequence[Array], count: int) -> Array:
    """Return the displacements (count, 2) of the whole from those of its components."""
    whole = np.empty((count, 2))
    for component, displacement in zip(components, displacements, strict=True):
        whole[component.place.nodes] = displacement
    return whole


def _component(model: Model, nodes: Index) -> Component:
    place = BodyComponent(model.body, nodes)
    on_it = ((i, contact.on_component(place)) for i, contact in enumerate(model.contacts))
    contacts = tuple((i, part) for i, part in on_it if part is not None)
    node = place.number[model.held // 2]
    held = np.flatnonzero(node >= 0)
    alone = Model(
        place.body,
        contacts=[part.contact for _, part in contacts],
        ties=[replace(t, surface=place.surface(t.surface)) for t in model.ties
              if place.has(t.surface)],
        loads=[force for load in model.loads if (force := load.on_component(place)) is not None],
        held=2 * node[held] + model.held[held] % 2,
        inertia=model.inertia,
        prony=model.prony,
    )  # fmt: skip
    return Component(alone, place, contacts, held)
