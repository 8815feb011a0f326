"""Components that only share further unknowns, balanced together.

Two lips on a neck in a yielding hand touch one another only through the few coordinates of the
neck. Their balances are evaluated, and their tangents built and factorised, each alone and in
parallel; Newton's method iterates on both at once, with the exact tangent of the whole
(`fem2d.solvers.bordered`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Response
from fem2d.loads.load import Load
from fem2d.solvers.bordered import AtRest, JoinedTangent, Tangent
from fem2d.solvers.model import FurtherUnknowns, ModelBalance
from fem2d.solvers.newton import Balance
from fem2d.threads import Threads

Array = NDArray[np.float64]


Evaluation: TypeAlias = Callable[[Array, Load, Response | None], ModelBalance]
"""The balance of a component at its displacements (2n,), mm, under a load of the whole; the body's
response there, if known."""


@dataclass(frozen=True, eq=False)
class JoinedBalance(Balance):
    """Unbalanced forces of components, then what is left of the equations they share.

    Attributes
    ----------
    components
        Balance of each component.
    load
        What acts on the whole, with the values of the further unknowns.
    """

    components: tuple[ModelBalance, ...]
    load: Load


def joined(
    components: Sequence[ModelBalance], load: Load, further: FurtherUnknowns, enough: float
) -> JoinedBalance:
    """Return the balance of components that share further unknowns.

    A component whose largest unbalanced force, over the largest force that acts on any, is at most
    ``enough``, and which no further unknown acts on, is left at rest by the tangent.
    """
    scale = max(each.force_scale for each in components)
    alone, corner = further.alone(load)
    equations = alone + sum(further.residual(each) for each in components)

    def tangent(psd: bool) -> JoinedTangent:
        return JoinedTangent(
            tuple(partial(_tangent, each, further, enough * scale, psd) for each in components),
            corner,
        )

    return JoinedBalance(
        np.concatenate([*(each.residual for each in components), equations]),
        scale,
        tangent,
        tuple(components),
        load,
    )


def _tangent(
    balance: ModelBalance, further: FurtherUnknowns, enough_n: float, psd: bool
) -> Tangent | AtRest:
    border = further.border(balance, psd=psd)
    balances = np.max(np.abs(balance.residual), initial=0.0) <= enough_n
    if balances and not border.columns.any() and not border.rows.any():
        return AtRest(balance.residual.size)
    return balance.model.eliminated(Tangent(balance.stiffness(psd), border))


def _same_response(before: ModelBalance | None, displacement: Array) -> Response | None:
    """Return the body's response of the last trial, if the component has not moved since then."""
    if before is None or not np.array_equal(before.displacement.ravel(), displacement):
        return None
    return before.body


def joined_at(
    evaluations: Sequence[Evaluation],
    counts: Sequence[int],
    load: Load,
    further: FurtherUnknowns,
    enough: float,
    threads: Threads,
) -> Callable[[Array], JoinedBalance]:
    """Return the joined balance as a function of all unknowns.

    Parameters
    ----------
    evaluations
        Return the balance of each component.
    counts
        How many displacements each component has.
    load
        What acts, but for the further unknowns.
    further
        Unknowns of the load and their equations.
    enough
        As of `joined`.
    threads
        That share the components.
    """
    ends = np.cumsum(counts)
    last: Sequence[ModelBalance | None] = [None] * len(counts)

    def balance_at(unknowns: Array) -> JoinedBalance:
        nonlocal last
        *displacements, values = np.split(unknowns, ends)
        there = further.applied(load, values)
        tasks = [
            partial(at, u, there, _same_response(before, u))
            for at, u, before in zip(evaluations, displacements, last, strict=True)
        ]
        balances = threads.run(tasks)
        last = balances
        return joined(balances, there, further, enough)

    return balance_at
