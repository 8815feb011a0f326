"""A suction curve as a function of material parameters, with its exact gradient."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fem2d.materials.material import Material
from fem2d.solvers.static import StaticResult, static_step
from geometry2d.foundation.errors import DrinksimError
from scenarios.studies.suction import SuctionModel

Array = NDArray[np.float64]

DIFFERENCE = 1e-4
"""Relative change of a parameter in the central difference of the internal forces."""


class CalibrationStopped(DrinksimError):
    """The suction test could not be computed for some parameters on the way."""


@dataclass(frozen=True)
class Evaluation:
    """One computed suction test.

    Attributes
    ----------
    logarithms
        (p,) of the parameters.
    apex_mm
        (k,) at the target's suctions.
    gradient
        (k, p) its derivative by the logarithms, mm.
    """

    logarithms: Array
    apex_mm: Array
    gradient: Array


@dataclass
class SuctionCurve:
    """Apex displacement and its gradient as a function of the parameters.

    Each evaluation starts from the equilibria of the one before, moved along their derivatives,
    which is what makes it cheap; that memory is its only state.

    Parameters
    ----------
    model
        The suction test; its materials are replaced.
    materials
        Returns the materials by layer for parameters (p,).
    suction_kpa
        (k,) where the curve is wanted.
    """

    model: SuctionModel
    materials: Callable[[Array], Mapping[str, Material]]
    suction_kpa: Array
    computed: int = 0
    _before: tuple[Array, list[StaticResult], list[Array]] | None = field(default=None, repr=False)

    def at(self, logarithms: Array) -> Evaluation:
        """Return curve and gradient.

        Raises
        ------
        CalibrationStopped
            If no equilibrium is found at one of the suctions.
        """
        model = self.model.with_materials(self.materials(np.exp(logarithms)))
        states = self._equilibria(model, logarithms)
        varied = [self._varied(logarithms, p) for p in range(len(logarithms))]
        slopes = [self._slope(model, state, varied) for state in states]
        self._before = (logarithms.copy(), states, slopes)
        self.computed += 1
        unknown = 2 * model.apex + 1
        return Evaluation(
            logarithms.copy(),
            np.array([model.apex_mm(state) for state in states]),
            np.array([slope[unknown] for slope in slopes]),
        )

    def _varied(self, logarithms: Array, p: int) -> tuple[SuctionModel, SuctionModel]:
        step = np.zeros(len(logarithms))
        step[p] = DIFFERENCE
        more, less = (self.materials(np.exp(logarithms + s)) for s in (step, -step))
        return self.model.with_materials(more), self.model.with_materials(less)

    def _equilibria(self, model: SuctionModel, logarithms: Array) -> list[StaticResult]:
        if self._before is not None:
            before, states, slopes = self._before
            found = []
            for state, slope in zip(states, slopes, strict=True):
                move = (slope @ (logarithms - before)).reshape(-1, 2)
                guess = state.displacement + move
                found.append(
                    static_step(
                        model.fem_model,
                        state,
                        state.load,
                        solver=self.model.solver,
                        guess=guess,
                        threads=self.model.threads,
                    )
                )
                if not found[-1].converged:
                    break
            else:
                return found
        states = list(model.solve_at_suctions(self.suction_kpa))
        if not states[-1].converged:
            raise CalibrationStopped(
                f"no equilibrium at {self.suction_kpa[len(states) - 1]:.2f} kPa with "
                f"parameters {np.exp(logarithms).round(6).tolist()}"
            )
        return states

    def _slope(
        self,
        model: SuctionModel,
        state: StaticResult,
        varied: Sequence[tuple[SuctionModel, SuctionModel]],
    ) -> Array:
        """Return ∂u/∂(log θ), (2n, p), mm."""
        solver = self.model.solver
        solver.factorise(state.balance.tangent(False).matrix)
        columns = []
        for more, less in varied:
            change = (
                more.fem_model.body.energy_and_force(state.displacement).force
                - less.fem_model.body.energy_and_force(state.displacement).force
            ) / (2 * DIFFERENCE)
            columns.append(-solver.solve(np.where(model.fem_model.free, change, 0.0)))
        return np.column_stack(columns)
