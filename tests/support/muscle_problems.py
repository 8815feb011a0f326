"""Equilibrium of a body and a muscle in it, by Newton's method and nothing else."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from fem2d.body.body import Body
from fem2d.loads.muscle import MuscleLoad

Array = np.ndarray
ITERATIONS = 30
TOLERANCE_MM = 1e-10
"""Largest step that Newton's method still takes."""


class Equilibrium(NamedTuple):
    """Displacement (n, 2), mm, and what holds the body there (2n,), N."""

    displacement: Array
    reaction: Array


def at_rest(
    body: Body,
    muscle: MuscleLoad,
    held: Array,
    *,
    roller: tuple[int, Array] | None = None,
    steps: int = 1,
) -> Equilibrium:
    """Return where body and muscle balance with unknowns ``held`` (h,) at rest.

    The activation is raised in equal steps. ``roller`` is a node and the direction in which it
    cannot move.
    """
    constraint = np.zeros((0, body.nodes.size))
    if roller is not None:
        constraint = np.zeros((1, body.nodes.size))
        constraint[0, 2 * roller[0] : 2 * roller[0] + 2] = roller[1]
    rows = [sp.csr_matrix(([1.0], ([0], [dof])), shape=(1, body.nodes.size)) for dof in held]
    fixed = sp.vstack([*rows, sp.csr_matrix(constraint)]).tocsr()
    u = np.zeros(body.nodes.size)
    for step in range(1, steps + 1):
        u, reaction = _balanced(body, muscle, fixed, u, step / steps)
    return Equilibrium(u.reshape(-1, 2), reaction)


def _balanced(
    body: Body, muscle: MuscleLoad, fixed: sp.csr_matrix, start: Array, share: float
) -> tuple[Array, Array]:
    u = start
    for _ in range(ITERATIONS):
        tissue, fibres = body.response(u), muscle.response(u, 0.0)
        force = tissue.force + share * fibres.force
        matrix = body.pattern.matrix(tissue.stiffness + share * fibres.stiffness)
        saddle = sp.bmat([[matrix, fixed.T], [fixed, None]]).tocsc()
        step = spsolve(saddle, np.concatenate([-force, -fixed @ u]))
        u, hold = u + step[: u.size], step[u.size :]
        if np.abs(step[: u.size]).max() < TOLERANCE_MM:
            return u, -(fixed.T @ hold)
    raise AssertionError(f"no equilibrium: the last step was {np.abs(step).max():.3g}")
