"""A body under stress in the shape in which it is drawn: what it was like when free of stress.

A picture shows tissue as it is, under the tension that it has. The prestretch G of every point is
updated until the drawn shape is in balance: with a trial G, the body deforms by F where its
supports hold it; then F G is the next trial (Gee, Förster and Wall 2010, "A computational strategy
for prestressing patient-specific biomechanical problems under finite deformation"). The pieces need
not fit together when free, as a skin under tension does not fit on what it covers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Body
from fem2d.loads.load import Load
from fem2d.solvers.model import Model
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.static import StaticSettings, solve_static
from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]
Index = NDArray[np.intp]

EXACTLY = StaticSettings(newton=NewtonSettings(tolerance=1e-9, force_floor_n=1e-4))


class PrestressError(DrinksimError):
    """No prestretch was found for which the drawn shape is in balance."""


@dataclass(frozen=True, eq=False)
class Prestress:
    """A body in balance in its drawn shape.

    Attributes
    ----------
    body
        The body, with its prestretch.
    support_n
        (2n,) forces of the supports on it, N.
    off_mm
        Largest displacement that was left in the last pass, mm.
    passes
        Equilibria that were solved.
    """

    body: Body
    support_n: Array
    off_mm: float
    passes: int


def balanced_as_drawn(
    body: Body, prestretch: Array, held: Index, *, accuracy_mm: float = 1e-8, most_passes: int = 60
) -> Prestress:
    """Return a body with a prestretch near a given one under which its drawn shape is in balance.

    Parameters
    ----------
    body
        The body, free of stress.
    prestretch
        (e, q, 5) first guess of G, see `Body.with_prestretch`.
    held
        (h,) unknowns that supports hold.
    accuracy_mm
        Largest displacement that may be left.
    most_passes
        Equilibria after which the search gives up.

    Raises
    ------
    PrestressError
        If there is no equilibrium, or the shape does not settle.
    """
    off_mm = np.inf
    for number in range(1, most_passes + 1):
        tensed = body.with_prestretch(prestretch)
        model = Model(tensed, held=held)
        result = solve_static(model, Load(), settings=EXACTLY)
        if not result.converged:
            raise PrestressError(
                f"the tensed tissue has no equilibrium near its drawn shape "
                f"({result.status.value}): give a smaller tension"
            )
        off_mm = float(np.abs(result.displacement).max())
        if off_mm <= accuracy_mm:
            support = np.where(model.free, 0.0, result.balance.forces)
            return Prestress(tensed, support, off_mm, number)
        prestretch = _components(tensed.fields(result.displacement).deformation_gradient)
    raise PrestressError(
        f"after {most_passes} equilibria the drawn shape is still {off_mm:.2g} mm off balance: "
        "give a smaller tension"
    )


def _components(F: Array) -> Array:
    """Return the five components (..., 5) of F (..., 3, 3)."""
    places = ((0, 0), (0, 1), (1, 0), (1, 1), (2, 2))
    return np.stack([F[..., i, j] for i, j in places], axis=-1)
