"""What every contact offers, be it with a rigid outline or of deformable surfaces.

A contact remembers in a state what friction depends on. Evaluating is pure: the state handed in is
that of the last committed instant, the response holds a trial state, which becomes committed only
if the caller keeps it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from fem2d.body.component import BodyComponent
from fem2d.body.surface import Surface
from geometry2d.rigid import RigidPlacement

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class ContactState(Protocol):
    """What a contact remembers of a committed instant: a frozen dataclass of arrays."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


class ContactResponse(Protocol):
    """What a contact does at a trial displacement."""

    @property
    def contact(self) -> Contact:
        """The contact that answered."""
        ...

    @property
    def energy(self) -> float:
        """Energy stored in the normal penalty, N mm."""
        ...

    @property
    def dofs(self) -> Index:
        """(j, k) unknowns on which forces act; j is 0 where nothing touches."""
        ...

    @property
    def force(self) -> Array:
        """(j, k) forces on them, N."""
        ...

    @property
    def state(self) -> ContactState:
        """The trial state."""
        ...

    def joins(self, component: Index) -> bool:
        """Whether it presses one component of the body on another; (n,) which each node is of."""
        ...


class Contact(Protocol):
    """Surfaces of a body that may touch something.

    ``placement`` is that of the moving rigid bodies; a contact without one leaves it alone.
    """

    within_elements: ClassVar[bool]
    """Whether its stiffness couples only unknowns of one element, as the body's does."""

    @property
    def name(self) -> str:
        """What reports call it."""
        ...

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The body's surfaces that may touch."""
        ...

    def initial_state(self, displacement: Array, placement: RigidPlacement) -> ContactState:
        """Return the state at a displacement (n, 2), mm, in which no friction acts yet."""
        ...

    def with_first_contact(
        self, state: Any, displacement: Array, predicted: Array, placement: RigidPlacement
    ) -> ContactState:
        """Return the state for a step from ``displacement`` that is expected to end at others.

        A point that meets something on its way starts to stick where it does. Were its slip counted
        from the start of the step, the way travelled through air would count as slip: the point
        would begin its contact at the limit of friction, however it is touched, and what friction
        remembers of that would depend on the length of the steps.

        Parameters
        ----------
        state
            At the committed instant.
        displacement, predicted
            (n, 2) at the committed instant and, expected, at the end of the step, mm.
        placement
            At the end of the step.
        """
        ...

    def evaluate(
        self, displacement: Array, placement: RigidPlacement, before: Any
    ) -> ContactResponse:
        """Return forces and trial state at a displacement (n, 2), mm; ``before`` is committed."""
        ...

    def tangent(self, response: Any, *, psd: bool = False) -> Array:
        """Return the derivative (j, k, k) of the response's forces by the displacement, N/mm.

        With ``psd`` a symmetric, negative semi-definite stand-in for it: the penalty along the
        normal and the sticking resistance along the tangent, without the turning of the normal.
        """
        ...

    def held_friction(self, response: Any) -> ContactResponse:
        """Return the response with friction that slips held at its present value.

        Sliding friction follows the pressure, which has no potential; without that coupling the
        stiffness tells whether an equilibrium is a minimum.
        """
        ...

    def force_of_motion(self, response: Any, placement: RigidPlacement) -> Array:
        """Return the change (j, k) of the forces, N, when the rigid bodies go to ``placement``.

        To first order, while the tissue stands still.
        """
        ...

    def on_component(self, component: BodyComponent) -> ContactOnComponent | None:
        """Return the contact as far as it lies on a component; None if it does not touch it."""
        ...


@dataclass(frozen=True)
class ContactOnComponent:
    """A contact as far as it lies on one component of the body.

    Attributes
    ----------
    contact
        The contact on the component.
    state_of
        Returns its state from that of the whole contact.
    """

    contact: Contact
    state_of: Callable[[Any], ContactState]
