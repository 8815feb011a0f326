"""What a search for the best dimensions of a neck found."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geometry2d.neck import NeckSection, neck_section
from scenarios.decision.messages import is_lower_gentler, meaning
from scenarios.messages.lines import MESH_DOUBT
from scenarios.optimum.search import Trial, Values
from scenarios.optimum.settings import CLOSURES, OptimumSettings

TRIALS_FILE = "trials.csv"
PICTURE_FILE = "search.svg"
BEST = "best"
PAGE_FILE = "optimum.html"

DIGITS = 4
"""Significant digits of a proposed measurement; a micrometre is more than a mould keeps."""


@dataclass(frozen=True)
class Optimum:
    """What a search found.

    Attributes
    ----------
    settings
        Of the optimisation.
    trials
        All that were tried.
    best
        Those that nothing feasible beats: one, or a Pareto front of several objectives.
    folder
        Where drawings and scenario files of the best are.
    """

    settings: OptimumSettings
    trials: tuple[Trial, ...]
    best: tuple[Trial, ...]
    folder: Path

    def measures(self, trial: Trial) -> dict[str, float]:
        """Return what came out of a trial, by objective."""
        return {
            name: value * sign_of(name)
            for name, value in zip(
                self.settings.objectives, trial.evaluation.objectives, strict=True
            )
        }

    def section(self, trial: Trial) -> NeckSection:
        """Return the neck of a trial, cut through its middle."""
        return neck_section(self.settings.measurements(rounded(trial.values)))

    def place(self, trial: Trial) -> str:
        """Return where the files of a best neck are in the folder, without their endings."""
        return f"{BEST}/trial-{trial.number:03d}"


def rounded(values: Values) -> dict[str, float]:
    """Return values with as many digits as a drawing states.

    >>> rounded({"rim_radius_mm": 0.612345})
    {'rim_radius_mm': 0.6123}
    """
    return {name: float(f"{value:.{DIGITS}g}") for name, value in values.items()}


def package_of(wanted: OptimumSettings, values: Values) -> dict[str, Any]:
    """Return the keys of ``[package]`` of the neck of some values."""
    fixed = CLOSURES.get(wanted.constraints.closure or "", {})
    return {"neck": wanted.neck, **fixed, **values}


def sign_of(measure: str) -> float:
    """Return by what an objective that is to be small is multiplied to be a measure."""
    return 1.0 if is_lower_gentler(measure) else -1.0


def mesh_sentence(found: Optimum) -> str | None:
    """Return for which of the best necks the mesh is too coarse, if for any."""
    doubts = {trial.number: trial.evaluation.mesh_doubt or 0.0 for trial in found.best}
    rough = [number for number, doubt in doubts.items() if doubt > MESH_DOUBT]
    if not rough:
        return None
    necks = "neck" if len(rough) == 1 else "necks"
    return (
        f"The mesh is too coarse for the highest pressure of {necks} "
        f"{', '.join(map(str, rough))}: in one sip or more two measures of it differ by up to "
        f"{100 * max(doubts.values()):.0f} %; replay the best on a finer one "
        "(numerics.mesh.layer_mm) before you choose."
    )


def optimum_message(found: Optimum) -> str:
    """Return what a search found, in lines."""
    wanted = found.settings
    if not found.best:
        return f"{found.folder}: none of {len(found.trials)} necks meets every constraint"
    lines = [
        f"{found.folder}: {PAGE_FILE}, {TRIALS_FILE}, {PICTURE_FILE}, drawings and scenario files "
        f"in {BEST}/; {len(found.trials)} necks were tried"
    ]
    for trial in found.best:
        values = ", ".join(f"{name} = {value:g}" for name, value in rounded(trial.values).items())
        results = ", ".join(
            f"{name} {value * sign_of(name):.4g}"
            for name, value in zip(wanted.objectives, trial.evaluation.objectives, strict=True)
        )
        lines.append(f"  trial {trial.number}: {values}: {results}")
    lines.append("  " + "; ".join(f"{name}: {meaning(name)}" for name in wanted.objectives))
    if (rough := mesh_sentence(found)) is not None:
        lines.append(rough)
    return "\n".join(lines)
