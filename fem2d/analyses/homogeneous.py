"""A cube of one material under homogeneous stretch: the single-element test.

All modes leave at least one pair of faces free, so the cube is one integration point in plane
stress: the thickness is the free direction, and the code computed with is that of every body.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from fem2d.body.assembly import section_response, work_space
from fem2d.body.kinematics import STRESS
from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.material import Array, Material
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting

COLLAPSED = 0.5
"""Volume ratio below which a curve is called collapsed."""

ROUNDING = 4 * float(np.finfo(float).eps)


class HomogeneousError(DrinksimError):
    """A homogeneous test is described in a way that makes no sense."""


@dataclass(frozen=True)
class CubeSettings:
    """How the response of a cube is followed from stretch to stretch.

    Parameters
    ----------
    longest_step
        Longest step of the logarithmic stretch.
    search_limit
        Largest distance from its last value within which the stretch of a free side is searched
        for, as a logarithm.
    refinements
        Tenfold refinements of the stretch at which the material becomes unstable.
    """

    longest_step: float = setting(
        default=0.02, above=0.0, maximum=1.0, description="longest step of the logarithmic stretch"
    )
    search_limit: float = setting(
        default=3.0,
        above=0.0,
        maximum=100.0,
        description="largest change of the logarithmic stretch of a free side in a step",
    )
    refinements: int = setting(
        default=4,
        minimum=1,
        maximum=12,
        description="tenfold refinements of the stretch at which the material becomes unstable",
    )


class Mode(Enum):
    """Loading of the cube; the value describes it."""

    UNIAXIAL = "pulled or pressed along one axis, the other four faces free"
    EQUIBIAXIAL = "stretched alike along two axes, the third free"
    PLANAR = "stretched along one axis, held along the second, the third free (pure shear)"
    COMPRESSION = "pressed along one axis, the other four faces free"


@dataclass(frozen=True)
class Curve:
    """The response of a cube at a series of stretches.

    Attributes
    ----------
    stretch, log_strain
        (n,) of the loaded axis.
    nominal_mpa, cauchy_mpa
        (n,) force over undeformed and over deformed area, MPa.
    stretches
        (n, 3) along the loaded, the second and the thickness axis.
    stiffness_mpa
        (n,) smallest eigenvalue of ∂τ_i/∂ ln λ_j, MPa: Drucker's and Hill's condition for the
        three stretches. The material is unstable where it is not positive.
    unstable_log_strain
        Log strains nearest to zero at which it changes sign, in compression and in tension; nan
        where it stays stable.
    missing
        Stretches at which no equilibrium was found.
    """

    stretch: Array
    log_strain: Array
    nominal_mpa: Array
    cauchy_mpa: Array
    stretches: Array
    stiffness_mpa: Array
    unstable_log_strain: tuple[float, float]
    missing: tuple[float, ...]

    def warnings(self) -> list[str]:
        """Return warnings about the curve, one sentence each."""
        warnings = []
        for strain, word in zip(self.unstable_log_strain, ("compression", "tension"), strict=True):
            if math.isfinite(strain):
                warnings.append(
                    f"the material becomes unstable in {word} at logarithmic strain {strain:.3f} "
                    f"(stretch {math.exp(strain):.3f})"
                )
        ratio = np.prod(self.stretches, axis=1)
        collapsed = self.log_strain[ratio < COLLAPSED]
        if collapsed.size:
            strain = float(collapsed[np.argmin(np.abs(collapsed))])
            warnings.append(
                f"from logarithmic strain {strain:.3f} (stretch {math.exp(strain):.3f}) on the "
                f"volume is below {COLLAPSED:g} of what it was: there the curve shows the "
                "compressibility law, not the tissue"
            )
        if self.missing:
            warnings.append(
                f"no equilibrium was found at {len(self.missing)} stretches between "
                f"{min(self.missing):.3f} and {max(self.missing):.3f}: they are left out"
            )
        return warnings


def homogeneous_response(
    material: Material,
    mode: Mode,
    stretches: ArrayLike,
    *,
    axis: int = 0,
    settings: CubeSettings | None = None,
) -> Curve:
    """Return the response of a cube of ``material`` at ``stretches`` (n,) of the loaded axis.

    Parameters
    ----------
    material
        Any law; families of fibres must be symmetric about the planes between the axes.
    mode
        What is done to the cube.
    stretches
        Stretches of the loaded axis, positive.
    axis
        The loaded axis; the next one (cyclically) is the second, the one after it the thickness.
    settings
        How stretches follow one another.

    Raises
    ------
    HomogeneousError
        If a stretch is not positive, or above 1 in a compression test.
    """
    wanted = np.unique(np.asarray(stretches, float))
    if wanted.size == 0 or not np.all(wanted > 0):
        raise HomogeneousError(
            f"stretch {wanted.min() if wanted.size else None} is not positive: "
            "displacements of a unit cube stay above -1"
        )
    if mode is Mode.COMPRESSION and wanted.max() > 1:
        raise HomogeneousError(f"compression up to stretch {wanted.max():g}: give stretches ≤ 1")
    cube = _turned(material, axis)
    chosen = settings or CubeSettings()
    solved, missing = _solved(cube, mode, wanted, chosen)
    log_strain: Array = np.log(solved.stretches[:, 0])
    crossings = (
        _crossing(cube, mode, log_strain[::-1], solved.stiffness[::-1], -1, chosen),
        _crossing(cube, mode, log_strain, solved.stiffness, 1, chosen),
    )
    stretch = solved.stretches[:, 0].copy()
    cauchy = solved.nominal * stretch / np.prod(solved.stretches, axis=1)
    return Curve(
        stretch,
        log_strain,
        solved.nominal,
        cauchy,
        solved.stretches,
        solved.stiffness,
        crossings,
        missing,
    )


@dataclass(frozen=True)
class _Solved:
    """States in the order of their stretches: (n, 3) stretches, nominal stress, log stiffness."""

    stretches: Array
    nominal: Array
    stiffness: Array


def _solved(
    cube: Material, mode: Mode, wanted: Array, settings: CubeSettings
) -> tuple[_Solved, tuple[float, ...]]:
    """Return the states found at ascending stretches, and the stretches where none was."""
    packed = cube.packed()
    above, below = wanted[wanted >= 1], wanted[wanted < 1][::-1]
    states = _followed(packed, mode, above, settings) | _followed(packed, mode, below, settings)
    found = [state for s in wanted if (state := states[float(s)]) is not None]
    missing = tuple(float(s) for s in wanted if states[float(s)] is None)
    sides = np.array([state[0] for state in found]).reshape(-1, 3)
    F = sides[:, :, None] * np.eye(3)
    stiffness = np.asarray(np.linalg.eigvalsh(_log_stiffness(cube, F, sides))[:, 0], np.float64)
    return _Solved(sides, np.array([state[1] for state in found]), stiffness), missing


CubeState: TypeAlias = tuple[tuple[float, float, float], float]
"""Stretches and nominal stress, MPa."""


def _followed(
    packed: Array, mode: Mode, targets: Array, settings: CubeSettings
) -> dict[float, CubeState | None]:
    """Return the state at each target, reached from the undeformed cube in small steps."""
    states: dict[float, CubeState | None] = {}
    log_side, side_slope, at = 0.0, 0.0, 0.0
    for target in targets:
        goal = math.log(target)
        steps = max(1, math.ceil(abs(goal - at) / settings.longest_step))
        state: CubeState | None = None
        for e in np.linspace(at, goal, steps + 1)[1:]:
            state = _state(packed, mode, float(e), log_side + side_slope * (e - at), settings)
            if state is None:
                break
            new = math.log(state[0][1])
            if e != at:
                side_slope = (new - log_side) / (e - at)
            log_side, at = new, float(e)
        states[float(target)] = state
    return states


def _state(
    packed: Array, mode: Mode, log_stretch: float, guess: float, settings: CubeSettings
) -> CubeState | None:
    """Return the stretches and nominal stress at a logarithmic stretch, None if not found."""
    stretch = math.exp(log_stretch)
    x = np.array([stretch, 0.0, 0.0, stretch, 1.0])
    P, A = np.zeros(5), np.zeros((5, 5))
    block, scratch = work_space(len(packed))

    def evaluate(log_side: float) -> tuple[float, bool]:
        x[3] = math.exp(log_side)
        _, admissible = section_response(
            packed, STRESS, x, 0.0, False, 2, False, P, A, block, scratch, True
        )
        return x[3] * P[3], admissible

    if mode is Mode.EQUIBIAXIAL:
        admissible = evaluate(log_stretch)[1]
    elif mode is Mode.PLANAR:
        admissible = evaluate(0.0)[1]
    else:
        root = _free_side(evaluate, guess, settings.search_limit)
        if root is None:
            return None
        admissible = evaluate(root)[1]
    if not admissible:
        return None
    return (stretch, float(x[3]), float(x[4])), float(P[0])


def _free_side(
    evaluate: Callable[[float], tuple[float, bool]], guess: float, limit: float
) -> float | None:
    """Return the log stretch nearest to ``guess`` at which a free side carries no force.

    The force must increase with the stretch there; otherwise the side would be unstable.
    """
    width = 1e-3
    while width < limit:
        low, high = guess - width, guess + width
        at_low, at_high = evaluate(low), evaluate(high)
        if at_low[1] and at_high[1] and at_low[0] <= 0 <= at_high[0]:
            root = brentq(lambda e: evaluate(e)[0], low, high, xtol=1e-15, rtol=ROUNDING)
            return float(root)
        width *= 2
    return None


def _turned(material: Material, axis: int) -> Material:
    """Return the material with the loaded axis first."""
    if isinstance(material, HolzapfelGasserOgden):
        fibres = np.roll(np.asarray(material.fibres), -axis, axis=1)
        return dataclasses.replace(material, fibres=tuple(map(tuple, fibres.tolist())))
    return material


def _log_stiffness(material: Material, F: Array, sides: Array) -> Array:
    """Return ∂τ_i/∂ ln λ_j (n, 3, 3) = λ_i λ_j A_iijj + δ_ij τ_i."""
    A = np.einsum("...iijj->...ij", material.tangent(F))
    tau = sides * np.einsum("...ii->...i", material.first_piola_kirchhoff(F))
    stiffness: Array = sides[:, :, None] * sides[:, None] * A + np.eye(3) * tau[:, None]
    return stiffness


def _crossing(
    cube: Material,
    mode: Mode,
    log_strain: Array,
    stiffness: Array,
    sign: int,
    settings: CubeSettings,
) -> float:
    """Return the strain at which the stiffness first stops being positive on one branch, or nan.

    Strains are given outwards from zero (and beyond it on the other branch, which is left out).
    """
    branch = sign * log_strain >= 0
    e, s = log_strain[branch], stiffness[branch]
    for _ in range(settings.refinements):
        lost = np.flatnonzero(s <= 0)
        if lost.size == 0:
            return math.nan
        i = int(lost[0])
        if i == 0:
            return float(e[0])
        inside = np.exp(np.sort(np.linspace(e[i - 1], e[i], 11)))
        solved, _ = _solved(cube, mode, inside, settings)
        e, s = np.log(solved.stretches[::sign, 0]), solved.stiffness[::sign]
    return float(e[int(np.argmax(s <= 0))]) if np.any(s <= 0) else math.nan
