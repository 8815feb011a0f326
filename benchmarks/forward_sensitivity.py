"""Derivatives of felt measures by a neck's radius: forward sensitivities beside differences.

python -m benchmarks.forward_sensitivity

A soft block is pressed by a wall with a rounded rim and dragged along it, with friction. The steps
are frozen; each is differentiated implicitly. With the residual R(u, s, p) of a step, whose
friction remembers s, K du = -(∂R/∂s ds + ∂R/∂p), where K is the step's tangent, and the bracket is
one central difference of the residual (semi-analytic; Michaleris, Tortorelli and Vidal 1994,
"Tangent operators and design sensitivity formulations for transient non-linear coupled problems").
What friction remembers is differentiated along the same direction.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from fem2d.body.surface import Surface
from fem2d.contact.rigid import RigidContact, RigidContactResponse, RigidContactState
from fem2d.loads.load import Load
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.state import State
from fem2d.solvers.static import StaticResult, StaticSettings, kept_at, static_step
from geometry2d.outline import Outline
from geometry2d.rigid import RigidPlacement
from scenarios.sip.contact_line import line_on_neck
from tests.support.contact_models import block, graded, linear_elastic

Array = NDArray[np.float64]

FRICTION, BETWEEN_NODES = 0.5, 2
DEPTH_MM, DRAG_MM = 0.3, 0.6
PRESSING, DRAGGING = 20, 30
STEP = 1e-7
"""Half of the difference by which a residual is differentiated, in units of the parameter."""

SETTINGS = StaticSettings(first_contact=False)


@dataclass(frozen=True)
class Derivatives:
    """Measures (k, m) after each step, and their derivatives (k, m) by the parameter."""

    values: Array
    slopes: Array
    path_s: float
    slopes_s: float


def model_of(radius_mm: float, edge_mm: float = 0.2) -> Model:
    """Return a block under a wall 2 mm thick whose rim has a radius."""
    body = block(
        np.linspace(-3, 3, round(6 / edge_mm) + 1),
        -graded(3, edge_mm, 1.0, 1.2)[::-1],
        linear_elastic(0.05, 0.45),
        element="T6",
    )
    wall = Outline.from_corners([[-1, 0], [1, 0], [1, 3], [-1, 3]], radius_mm)
    top = body.surface("top", at_nodes=True, between_nodes=BETWEEN_NODES)
    contact = RigidContact(top, wall, friction=FRICTION, name="rim")
    return Model(body, contacts=[contact], held=body.dofs("bottom"))


def path() -> list[Load]:
    """Return the loads: down, then along."""
    downs = [(0.0, -DEPTH_MM * k / PRESSING) for k in range(1, PRESSING + 1)]
    alongs = [(DRAG_MM * k / DRAGGING, -DEPTH_MM) for k in range(1, DRAGGING + 1)]
    return [Load.at(RigidPlacement(0.0, shift), 0.0) for shift in (*downs, *alongs)]


def followed(model: Model, loads: Sequence[Load]) -> list[StaticResult]:
    """Return the equilibria of a path, the undeformed one first."""
    solver = fastest_solver()
    results = [kept_at(model)]
    for load in loads:
        results.append(static_step(model, results[-1], load, solver=solver, settings=SETTINGS))
        if not results[-1].converged:
            raise SystemExit(f"no equilibrium at {load.placement}")
    return results


def measured(response: RigidContactResponse) -> Array:
    """Return pressure over 0.5 mm, MPa, and the force on the tissue, N."""
    touching = response.contact.surface
    skin = Surface(touching.edges, touching.nodes, at_nodes=True)
    line = line_on_neck(skin, [response], response.displacement)
    force = response.force.reshape(-1, 2).sum(axis=0)
    return np.array([line.highest_window(), *force])


def derivatives(make: Callable[[float], Model], parameter: float) -> Derivatives:
    """Return measures along the path and, by forward sensitivities, their derivatives."""
    began = time.process_time()
    results = followed(make(parameter), path())
    path_s, began = time.process_time() - began, time.process_time()
    ends = make(parameter - STEP), make(parameter + STEP)
    memory = [_differenced([model.at_rest().contacts[0] for model in ends])]
    values, slopes = [], []
    for before, after in pairwise(results):
        here = [_changed(before.state, sign * STEP, memory[-1]) for sign in (-1, 1)]
        still = [
            model.balance(after.displacement, after.load, state).forces
            for model, state in zip(ends, here, strict=True)
        ]
        change = _moved(after, (still[1] - still[0]) / (2 * STEP))
        touched = [
            model.contact_responses(
                after.displacement + sign * STEP * change, after.load.placement, state
            )[0]
            for model, state, sign in zip(ends, here, (-1, 1), strict=True)
        ]
        memory.append(_differenced([touch.state for touch in touched]))
        values.append(measured(after.contacts[0]))
        low, high = (measured(touch) for touch in touched)
        slopes.append((high - low) / (2 * STEP))
    slopes_s = time.process_time() - began
    return Derivatives(np.array(values), np.array(slopes), path_s, slopes_s)


def _moved(after: StaticResult, residual_slope: Array) -> Array:
    """Return the derivative (n, 2) of the displacement of a step."""
    free = after.balance.model.free
    tangent = after.balance.stiffness(False)[free][:, free].tocsc()
    moved = np.zeros(free.size)
    moved[free] = -splu(tangent).solve(residual_slope[free])
    return moved.reshape(-1, 2)


def _differenced(states: Sequence[RigidContactState]) -> RigidContactState:
    """Return the derivative of what friction remembers, from both ends of a difference."""
    low, high = states
    return RigidContactState(
        (high.body_position - low.body_position) / (2 * STEP),
        (high.traction - low.traction) / (2 * STEP),
    )


def _changed(state: State, by: float, slope: RigidContactState) -> State:
    """Return a state whose friction remembers what it would at another parameter."""
    (memory,) = state.contacts
    moved = RigidContactState(
        memory.body_position + by * slope.body_position, memory.traction + by * slope.traction
    )
    return replace(state, contacts=(moved,))


def differences(make: Callable[[float], Model], parameter: float, half: float) -> Array:
    """Return the derivatives (k, m) of the measures by central differences of whole paths."""
    low, high = (
        np.array([measured(r.contacts[0]) for r in followed(make(parameter + by), path())[1:]])
        for by in (-half, half)
    )
    return (high - low) / (2 * half)


def main() -> None:
    """Print how far derivatives are apart, and what they cost."""
    radius = 0.6
    found = derivatives(model_of, radius)
    print(f"{len(found.values)} steps, {found.path_s:.2f} s; derivatives {found.slopes_s:.2f} s")
    for half in (1e-2, 1e-3, 1e-4, 1e-5):
        wanted = differences(model_of, radius, half)
        scale = np.abs(wanted).max(axis=0)
        away = np.abs(found.slopes - wanted) / scale
        print(
            f"half difference {half:g} mm: window, force along, force up: mean apart "
            + ", ".join(f"{v:.1e}" for v in away.mean(axis=0))
            + "; largest "
            + ", ".join(f"{v:.1e}" for v in away.max(axis=0))
        )


if __name__ == "__main__":
    main()
