"""Bone that moves on a course of its own: what it pulls by ties, and pushes with an outline.

The moving rigid bodies of a :class:`~fem2d.loads.load.Load` are one body: the neck. A jaw that
turns beside it follows time alone. It acts as two forces: the anchors of ties that go with it, and
an outline that tissue rests on without friction, so that the force depends on nothing but place and
time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import BodyComponent
from fem2d.body.sparse import SparsePattern
from fem2d.body.surface import Surface
from fem2d.contact.rigid import RigidContact, RigidContactResponse
from fem2d.loads.amplitude import LoadError
from fem2d.loads.load import Load
from fem2d.loads.tie import ElasticTie
from geometry2d.rigid import UNMOVED, RigidPlacement

Array = NDArray[np.float64]
Course = Callable[[float], RigidPlacement]
"""Where a body that was undeformed in its own frame is at a time, s."""


@dataclass(frozen=True, eq=False)
class DrivenAnchor:
    """The force by which a tie pulls its tissue along with bone that moves.

    Parameters
    ----------
    tie
        The tie, which holds the tissue to bone that stands still.
    course
        Where the bone is.
    """

    tie: ElasticTie
    course: Course

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The tied surface."""
        return (self.tie.surface,)

    def on_component(self, component: BodyComponent) -> DrivenAnchor | None:
        """Return the same force on a component that has its surface; see `AppliedForce`."""
        if not component.has(self.tie.surface):
            return None
        return replace(self, tie=replace(self.tie, surface=component.surface(self.tie.surface)))

    def force(self, displacement: Array, load: Load) -> Array:
        """Return the nodal forces (2n,), N, at the instant of a load; see `AppliedForce`."""
        force = np.zeros(displacement.size)
        dofs, nodal, _ = self._pull(load)
        np.add.at(force, dofs, nodal)
        return force

    def change(self, displacement: Array, before: Load, after: Load) -> Array:
        """Return the change of the forces (2n,), N, between the instants of two loads."""
        return self.force(displacement, after) - self.force(displacement, before)

    def add_stiffness(
        self, data: Array, pattern: SparsePattern, displacement: Array, load: Load, *, psd: bool
    ) -> None:
        """Add nothing: the stiffness is that of the tie, wherever its anchors are."""

    def energy(self, displacement: Array, load: Load) -> float:
        """Return what the moved anchors add to the energy of the tie, N mm."""
        dofs, nodal, stored = self._pull(load)
        return stored - float(np.sum(nodal * displacement.ravel()[dofs]))

    def _pull(self, load: Load) -> tuple[NDArray[np.intp], Array, float]:
        moving = replace(self.tie, attached_at=UNMOVED)
        return moving.pull(self.course(load.time_s))


@dataclass(frozen=True, eq=False)
class DrivenOutline:
    """The force with which an outline that moves with time pushes tissue, without friction.

    Parameters
    ----------
    contact
        The contact with the outline as a moving one; its friction is 0.
    course
        Where the outline is.

    Raises
    ------
    LoadError
        If the contact has friction, which would remember where the outline was.
    """

    contact: RigidContact
    course: Course

    def __post_init__(self) -> None:
        if self.contact.friction.coefficient != 0 or not self.contact.moving:
            raise LoadError(
                f"{self.contact.name}: an outline on a course of its own is a moving one without "
                "friction: set moving=True and the coefficient to 0"
            )

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surface that it pushes."""
        return (self.contact.surface,)

    def on_component(self, component: BodyComponent) -> DrivenOutline | None:
        """Return the same force on a component that has its surface; see `AppliedForce`."""
        part = self.contact.on_component(component)
        if part is None:
            return None
        assert isinstance(part.contact, RigidContact)  # a rigid contact remains one
        return replace(self, contact=part.contact)

    def response(self, displacement: Array, load: Load) -> RigidContactResponse:
        """Return the contact at displacements (n, 2), mm, at the instant of a load."""
        place = self.course(load.time_s)
        untouched = self.contact.initial_state(displacement, place)
        return self.contact.evaluate(displacement, place, untouched)

    def force(self, displacement: Array, load: Load) -> Array:
        """Return the nodal forces (2n,), N, at the instant of a load; see `AppliedForce`."""
        touch = self.response(displacement, load)
        return self._scattered(touch, touch.force, displacement)

    def change(self, displacement: Array, before: Load, after: Load) -> Array:
        """Return the first-order change of the forces (2n,), N, between two instants."""
        touch = self.response(displacement, before)
        moved = self.contact.force_of_motion(touch, self.course(after.time_s))
        return self._scattered(touch, moved, displacement)

    def add_stiffness(
        self, data: Array, pattern: SparsePattern, displacement: Array, load: Load, *, psd: bool
    ) -> None:
        """Add the stiffness of the contact, N/mm; see `AppliedForce`."""
        touch = self.response(displacement, load)
        if touch.force.size:
            slots = pattern.slots(touch.dofs)
            np.subtract.at(data, slots, self.contact.tangent(touch, psd=psd))

    def energy(self, displacement: Array, load: Load) -> float:
        """Return the energy of the penalty, N mm."""
        return self.response(displacement, load).energy

    def _scattered(self, touch: RigidContactResponse, nodal: Array, displacement: Array) -> Array:
        force = np.zeros(displacement.size)
        np.add.at(force, touch.dofs, nodal)
        return force
