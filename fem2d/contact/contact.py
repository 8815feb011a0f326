"""The protocol of contact, with a rigid outline or between deformable surfaces.

The state of a contact holds what friction depends on. Evaluation is pure: it takes the state of the
last committed instant, and its response holds a trial state, which becomes committed only if the
caller keeps it.
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
    """What friction depends on at a committed instant: a frozen dataclass of arrays."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


class ContactResponse(Protocol):
    """Forces of a contact at a trial displacement."""

    @property
    def contact(self) -> Contact:
        """The contact."""
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
        """Whether it presses components on one another; (n,) component of each node."""
        ...


class Contact(Protocol):
    """Surfaces of a body that may touch something.

    ``placement`` is always that of the moving rigid bodies; other contacts ignore it.
    """

    within_elements: ClassVar[bool]
    """Whether its stiffness couples only unknowns of one element, as the body's does."""

    @property
    def name(self) -> str:
        """Name in reports."""
        ...

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surfaces of the body that may touch."""
        ...

    def initial_state(self, displacement: Array, placement: RigidPlacement) -> ContactState:
        """Return the state at a displacement (n, 2), mm, in which no friction acts yet."""
        ...

    def with_first_contact(
        self, state: Any, displacement: Array, predicted: Array, placement: RigidPlacement
    ) -> ContactState:
        """Return the state for a step that is predicted to end at other displacements.

        A point that meets something on its way sticks from there on. Counted from the start of the
        step, its slip would include the distance travelled through air: contact would begin at the
        limit of friction, and the result would depend on the length of the steps.

        Parameters
        ----------
        state
            At the committed instant.
        displacement, predicted
            (n, 2) at the committed instant, and as predicted for the end of the step, mm.
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
        """Return the part of the contact that lies on a component; None if none does."""
        ...


@dataclass(frozen=True)
class ContactOnComponent:
    """The part of a contact that lies on one component of the body.

    Attributes
    ----------
    contact
        The contact on the component.
    state_of
        Returns its state from that of the whole contact.
    """

    contact: Contact
    state_of: Callable[[Any], ContactState]
