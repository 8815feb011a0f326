"""Pieces of tissue that share no element: each comes to rest by itself while they do not touch.

Two lips apart are two problems: the one that just lies there needs no iterations because the other
slides. A piece is a system of its own, with the surfaces, ties, loads and memories of the whole
that lie on it. What it finds is where the whole starts from, so contact between pieces, which they
do not know of, is never missed: it only costs iterations of the whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from fem2d.body.body import Response
from fem2d.body.surface import Surface
from fem2d.contact.self_contact import NONE, SelfContact, SelfContactHistory, SelfContactResponse
from fem2d.solvers.model import System
from fem2d.solvers.state import State

Array = NDArray[np.float64]
Index = NDArray[np.intp]

ELSEWHERE = NONE
"""Number of a node or an edge that lies on another piece: an anchor there is none."""


@dataclass(frozen=True, eq=False)
class SelfContactOfComponent:
    """A contact of tissue with tissue as far as it lies on one piece.

    Attributes
    ----------
    whole
        Which of the whole system's it is.
    pair
        The contact on the piece.
    number
        (m,) number on the piece of each of the whole contact's edges, `ELSEWHERE` for others.
    """

    whole: int
    pair: SelfContact
    number: Index

    def history(self, whole: SelfContactHistory) -> SelfContactHistory:
        """Return what the piece remembers of it; anchors on other pieces are forgotten."""
        edges = self.number != ELSEWHERE
        here = edges[whole.edge]
        anchored = whole.anchor[here]
        return SelfContactHistory(
            self.number[whole.edge[here]],
            whole.local[here],
            whole.weight[here],
            np.where(anchored == NONE, NONE, self.number[anchored]),
            whole.anchor_local[here],
            whole.traction[here],
            whole.places[edges],
            whole.depth[edges],
        )


@dataclass(frozen=True, eq=False)
class Component:
    """A piece of a system's tissue as a system of its own.

    Attributes
    ----------
    system
        The piece with all that acts on it.
    nodes
        (n,) which of the whole's nodes it has, ascending.
    contacts
        Which of the whole's contact pairs act on it.
    folds
        Contacts of its surfaces with one another and with themselves.
    dofs
        (2n,) which of the whole's unknowns it has.
    entries
        (nnz,) where the entries of its stiffness lie in the whole's.
    """

    system: System
    nodes: Index
    contacts: tuple[int, ...]
    folds: tuple[SelfContactOfComponent, ...]
    dofs: Index
    entries: Index

    def state(self, whole: State) -> State:
        """Return what the piece is like where the whole is in a state."""
        return replace(
            whole,
            displacement=whole.displacement[self.nodes],
            velocity=whole.velocity[self.nodes],
            acceleration=whole.acceleration[self.nodes],
            histories=tuple(whole.histories[pair] for pair in self.contacts),
            fold_histories=tuple(f.history(whole.fold_histories[f.whole]) for f in self.folds),
        )

    def response(self, whole: Response) -> Response:
        """Return the piece's share of a response, but with the energy of the whole."""
        return Response(whole.energy, whole.force[self.dofs], whole.stiffness[self.entries])


def components_of(system: System) -> tuple[Component, ...]:
    """Return the pieces of a system, the largest first; none if it is of one piece.

    None either if a surface, tie or load spans several, or if a kind of system that knows other
    forces is given: what belongs to which piece could not be told.
    """
    if type(system) is not System:
        return ()
    piece = component_of_node(system)
    count = int(piece.max()) + 1
    surfaces = [
        *(pair.surface for pair in system.contacts),
        *(tie.surface for tie in system.ties),
        *(load.surface for load in system.loads),
        *(surface for fold in system.folds for surface in fold.surfaces),
    ]
    if count == 1 or any(len(np.unique(piece[s.edges])) > 1 for s in surfaces):
        return ()
    largest_first = np.argsort(-np.bincount(piece), kind="stable")
    return tuple(_part(system, np.flatnonzero(piece == number)) for number in largest_first)


def component_of_node(system: System) -> Index:
    """Return the number (n,) of the piece that each node belongs to."""
    pattern = system.body.pattern
    _, label = connected_components(pattern.matrix(np.ones(pattern.nonzeros)), directed=False)
    return np.asarray(label[::2], np.intp)


def components_touch(piece: Index, folded: Sequence[SelfContactResponse]) -> bool:
    """Whether tissue of one piece touches that of another."""
    for response in folded:
        edges, before = response.pair.edges, response.before
        here = piece[edges[before.edge[response.touching], 0]]
        there = piece[edges[response.points.met_edge[response.touching], 0]]
        if np.any(here != there):
            return True
    return False


def gather(parts: Sequence[Component], displacements: Sequence[Array], count: int) -> Array:
    """Return the displacements (count, 2) of the whole from those of its parts."""
    whole = np.empty((count, 2))
    for part, displacement in zip(parts, displacements, strict=True):
        whole[part.nodes] = displacement
    return whole


def _part(system: System, nodes: Index) -> Component:
    body = system.body.piece(nodes)
    number = np.full(len(system.body.nodes), ELSEWHERE)
    number[nodes] = np.arange(len(nodes))

    def here(surface: Surface) -> bool:
        return bool(number[surface.edges[0, 0]] != ELSEWHERE)

    def moved(surface: Surface) -> Surface:
        return replace(surface, edges=number[surface.edges], nodes=body.nodes)

    folds = []
    for index, fold in enumerate(system.folds):
        own = tuple(moved(surface) for surface in fold.surfaces if here(surface))
        if len(own) + fold.itself >= 2:
            on_piece = number[fold.edges[:, 0]] != ELSEWHERE
            edge = np.where(on_piece, np.cumsum(on_piece) - 1, ELSEWHERE)
            folds.append(SelfContactOfComponent(index, replace(fold, surfaces=own), edge))
    dofs = (2 * nodes[:, None] + np.arange(2)).ravel()
    whole = system.body.pattern
    entries = np.concatenate([np.arange(whole.indptr[dof], whole.indptr[dof + 1]) for dof in dofs])
    contacts = [i for i, pair in enumerate(system.contacts) if here(pair.surface)]
    alone = System(
        body,
        tuple(
            replace(system.contacts[i], surface=moved(system.contacts[i].surface)) for i in contacts
        ),
        tuple(replace(t, surface=moved(t.surface)) for t in system.ties if here(t.surface)),
        system.inertia,
        tuple(fold.pair for fold in folds),
        tuple(replace(d, surface=moved(d.surface)) for d in system.loads if here(d.surface)),
    )
    return Component(alone, nodes, tuple(contacts), tuple(folds), dofs, entries)
