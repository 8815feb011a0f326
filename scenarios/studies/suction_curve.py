"""The curve of a suction test, and the suction at which equilibrium is lost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem2d.loads.load import Load
from fem2d.materials.material import Material
from fem2d.solvers.static import StaticResult, eigenvalue_nearest_zero, kept_at, solve_static
from geometry2d.foundation.progress import Progress, no_progress
from geometry2d.foundation.settings import setting
from scenarios.studies.suction import MPA_PER_KPA, SuctionModel, SuctionOptions

Array = NDArray[np.float64]

SHORTEST_PATH_STEP_MM = 1e-4
PATH_STEPS = 60
"""The way round a limit point ends where its steps become shorter, or after so many of them."""


@dataclass(frozen=True)
class CurveOptions(SuctionOptions):
    """Sizes of the test, and the suctions of its curve."""

    suction_kpa: float = setting(
        default=7.3, unit="kPa", minimum=0.01, maximum=101.3,
        description="largest suction", source="Luboz et al. 2014",
    )  # fmt: skip
    points: int = setting(
        default=10, minimum=1, maximum=1000, description="suctions of the curve, evenly spaced"
    )
    path_step_mm: float = setting(
        default=0.02, unit="mm", above=0.0, maximum=1.0,
        description="longest step of the apex where the suction cannot be raised any further",
    )  # fmt: skip


@dataclass(frozen=True)
class AspirationOptions(CurveOptions):
    """A curve, and up to where the loss of equilibrium is searched."""

    search_kpa: float = setting(
        default=25.0, unit="kPa", minimum=0.0, maximum=101.3,
        description="up to where to search for the loss of equilibrium; 101.3 is a vacuum",
    )  # fmt: skip


SEARCH_STEP_KPA = 2.5
"""Longest step of the suction in which the loss of equilibrium is searched."""


@dataclass(frozen=True)
class Loss:
    """Where equilibrium is lost.

    Attributes
    ----------
    suction_kpa
        The highest suction at which an equilibrium was found.
    apex_mm
        The apex displacement there.
    physical
        Whether the body loses equilibrium, not the solver.
    message
        What shows it.
    path
        (k, 3) beyond the last step of the suction: apex displacement, mm; suction, kPa; eigenvalue
        of the tangent nearest to zero over its first value.
    """

    suction_kpa: float
    apex_mm: float
    physical: bool
    message: str
    path: Array


@dataclass(frozen=True)
class Aspiration:
    """A suction test as computed.

    Attributes
    ----------
    suction_kpa, apex_mm, min_log_strain, max_log_strain
        (k,) the curve from rest on; strains are the extremes in the dermis.
    max_mises_kpa
        (k,) largest von Mises stress in the dermis under the aperture.
    softest
        (k,) eigenvalue of the tangent nearest to zero, N/mm.
    last
        The last equilibrium found.
    model
        What was sucked.
    loss
        Where equilibrium is lost; None if it is not, up to where it was searched.
    """

    suction_kpa: Array
    apex_mm: Array
    min_log_strain: Array
    max_log_strain: Array
    max_mises_kpa: Array
    softest: Array
    last: StaticResult
    model: SuctionModel
    loss: Loss | None

    @property
    def nonlinearity(self) -> float:
        """Largest distance of the curve from the chord between its ends, over its range."""
        chord = self.apex_mm[-1] * self.suction_kpa / self.suction_kpa[-1]
        return float(np.max(np.abs(self.apex_mm - chord)) / self.apex_mm[-1])

    def difference(self, other: Aspiration) -> float:
        """Return the RMS difference of two curves of the same suctions over this one's range."""
        apart = self.apex_mm[1:] - other.apex_mm[1:]
        return float(np.sqrt(np.mean(apart**2)) / self.apex_mm[-1])


def aspirated(
    layers: Mapping[str, Material],
    options: CurveOptions,
    *,
    search_kpa: float = 0.0,
    progress: Progress = no_progress,
) -> Aspiration:
    """Return the suction test on layers of material.

    Parameters
    ----------
    layers
        Materials by layer, outermost first.
    options
        Sizes and suctions.
    search_kpa
        Up to where the loss of equilibrium is searched beyond the curve.
    progress
        Told how far it is.

    Raises
    ------
    SuctionError
        If device, slab and layers do not fit one another.
    """
    model = SuctionModel.of(layers, options)
    wanted = np.linspace(0.0, options.suction_kpa, options.points + 1)[1:]
    rest = kept_at(model.fem_model)
    found = [rest]
    loss = None
    for result in model.solve_at_suctions(wanted, start=rest):
        if not result.converged:
            loss = _loss(model, found[-1], options.path_step_mm)
            break
        found.append(result)
        progress(0.8 * len(found) / len(wanted), f"{suction_of(result):.2f} kPa")
    if loss is None and search_kpa > options.suction_kpa:
        loss = _searched(model, found[-1], search_kpa, options.path_step_mm, progress)
    suction, apex, low, high, mises, softest = np.array([_row(model, s) for s in found]).T
    return Aspiration(suction, apex, low, high, mises, softest, found[-1], model, loss)


def suction_of(result: StaticResult) -> float:
    """Return the suction of an equilibrium, kPa."""
    return -result.load.pressure_mpa / MPA_PER_KPA


def _row(model: SuctionModel, result: StaticResult) -> tuple[float, ...]:
    fields = model.fem_model.body.fields(result.displacement)
    strain = fields.log_strain[model.upper]
    mises = fields.von_mises[model.sucked]
    return (
        suction_of(result) + 0.0,
        model.apex_mm(result),
        float(strain.min()),
        float(strain.max()),
        float(mises.max()) / MPA_PER_KPA,
        eigenvalue_nearest_zero(result, solver=model.solver),
    )


def _searched(
    model: SuctionModel,
    start: StaticResult,
    to_kpa: float,
    path_step_mm: float,
    progress: Progress,
) -> Loss | None:
    """Return where equilibrium is lost between ``start`` and a suction, None if nowhere."""
    last = start
    first = suction_of(start)
    steps = max(1, int(np.ceil((to_kpa - first) / SEARCH_STEP_KPA)))
    for suction in np.linspace(first, to_kpa, steps + 1)[1:]:
        load = Load(pressure_mpa=-suction * MPA_PER_KPA)
        last = solve_static(
            model.fem_model, load, start=last, solver=model.solver, threads=model.threads
        )
        if not last.converged:
            return _loss(model, last, path_step_mm)
        progress(0.8 + 0.2 * suction / to_kpa, f"{suction:.1f} kPa, searching for the loss")
    return None


def _loss(model: SuctionModel, last: StaticResult, longest_mm: float) -> Loss:
    """Return what happens where the suction could not be raised any further.

    The apex is raised instead, and the suction solved for: a limit point is gone round, and the
    eigenvalue nearest to zero shows whether the tangent becomes singular.
    """
    path = _path_round(model, last, longest_mm)
    apex, suction, softest = path.T
    top = int(np.argmax(suction))
    turned, singular = top < len(path) - 1, bool(np.min(softest) < 0.5)
    if turned:
        message = (
            f"a limit point: raising the apex beyond {apex[top]:.2f} mm lowers the suction, to "
            f"{suction[-1]:.2f} kPa at {apex[-1]:.2f} mm"
        )
    elif singular:
        message = (
            f"the tangent becomes singular: its eigenvalue nearest to zero falls to "
            f"{np.min(softest):.2f} of its value within {suction[-1] - suction[0]:.2f} kPa"
        )
    else:
        message = (
            "the solver gave up: no limit point was passed and the tangent's eigenvalue nearest to "
            f"zero only falls to {np.min(softest):.2f} of its value"
        )
    return Loss(float(suction[top]), float(apex[top]), turned or singular, message, path)


def _path_round(model: SuctionModel, last: StaticResult, longest_mm: float) -> Array:
    """Return apex, suction and relative eigenvalue (k, 3) where the apex is raised step by step."""
    path, state, step = [_step_of_path(model, last)], last, longest_mm
    for _ in range(PATH_STEPS):
        (raised,) = model.raised_to([model.apex_mm(state) + step], start=state)
        if raised.converged and 0 < suction_of(raised) < 2 * path[0][1]:
            state, step = raised, min(1.5 * step, longest_mm)
            path.append(_step_of_path(model, state))
        elif step > SHORTEST_PATH_STEP_MM:
            step /= 2
        else:
            break
    apex, suction, softest = np.array(path).T
    return np.column_stack([apex, suction, softest / softest[0]])


def _step_of_path(model: SuctionModel, result: StaticResult) -> tuple[float, float, float]:
    softest = eigenvalue_nearest_zero(result, solver=model.solver)
    return model.apex_mm(result), suction_of(result), softest
