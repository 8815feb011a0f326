"""Derivatives by differences, and contact forces to take them of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem2d.contact.contact import ContactResponse
from geometry2d.rigid import RigidPlacement


def central_differences(
    value: Callable[[np.ndarray], Any], displacement: np.ndarray, step: float
) -> np.ndarray:
    """Return the derivative of a value (…) by each unknown of a displacement (n, 2): (…, 2n)."""
    columns = []
    for dof in range(displacement.size):
        shift = np.zeros(displacement.size)
        shift[dof] = step
        shift = shift.reshape(displacement.shape)
        columns.append((value(displacement + shift) - value(displacement - shift)) / (2 * step))
    return np.stack(columns, axis=-1)


def total_force(
    contact: Any, displacement: np.ndarray, history: Any, placement: RigidPlacement
) -> tuple[np.ndarray, ContactResponse]:
    """Return the contact force (2n,), N, and the response that it comes from."""
    response = contact.evaluate(displacement, placement, history)
    force = np.zeros(displacement.size)
    np.add.at(force, response.dofs, response.force)
    return force, response


def stiffness_and_differences(
    contact: Any, displacement: np.ndarray, history: Any, placement: RigidPlacement
) -> tuple[np.ndarray, np.ndarray]:
    """Return a contact's assembled tangent (2n, 2n) and the differences of its force, N/mm."""
    _, response = total_force(contact, displacement, history, placement)
    stiffness = np.zeros((displacement.size, displacement.size))
    for dofs, block in zip(response.dofs, contact.tangent(response), strict=True):
        np.add.at(stiffness, np.ix_(dofs, dofs), block)
    numeric = central_differences(
        lambda u: total_force(contact, u, history, placement)[0], displacement, 1e-7
    )
    return stiffness, numeric
