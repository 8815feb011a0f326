"""The file of an optimisation: bounds of measurements, what is to be small, what must hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from itertools import islice, product
from pathlib import Path
from typing import Any

from geometry2d.foundation.errors import naming
from geometry2d.foundation.settings import range_error, setting
from geometry2d.foundation.toml import read_toml, shown
from geometry2d.neck import NECKS, NeckMeasurements
from scenarios.campaign.films import scenarios_of
from scenarios.campaign.measures import HEADLINE, MEASURES
from scenarios.campaign.settings import StudySettings, study_from
from scenarios.campaign.variation import StudyError
from scenarios.optimum.search import ImpossibleError, Values
from scenarios.settings.names import nearest
from scenarios.settings.tables import table_from

CLOSURES: Mapping[str, Mapping[str, float]] = {
    "SP 38-400": {
        "thread_diameter_mm": 37.2,
        "root_diameter_mm": 34.8,
        "pitch_mm": 4.233,
        "flank_deg": 30.0,
    },
    "PCO 1881": {
        "thread_diameter_mm": 27.4,
        "root_diameter_mm": 24.2,
        "pitch_mm": 2.7,
        "flank_deg": 15.0,
    },
}
"""Measurements that a closure fixes, as published in the BOSL2 library."""

NEW_TABLES = ("bounds", "objectives", "constraints", "search")
NOT_HERE = ("necks", "vary", "design")


MOST_CHOICES = 3**6
"""Necks that are looked at to tell whether bounds leave any: three values of each of seven."""


@dataclass(frozen=True)
class ConstraintSettings:
    """What the best neck must have."""

    least_wall_mm: float = setting(
        default=1.0, unit="mm", minimum=0.0, description="wall between the threads"
    )
    least_engagement_mm: float = setting(
        default=0.0,
        unit="mm",
        minimum=0.0,
        description="length of thread along the axis that a closure holds: crests times pitch",
    )
    least_thread_depth_mm: float = setting(
        default=0.0, unit="mm", minimum=0.0, description="height of the thread over its root"
    )
    least_seal_kpa: float | None = setting(
        default=None,
        unit="kPa",
        description="smallest pressure beyond the liquid's, mean over people; needs [liquid]",
    )
    closure: str | None = setting(
        default=None, example="SP 38-400", description="standard whose thread the neck keeps"
    )


@dataclass(frozen=True)
class TrialSettings:
    """How long the search goes on."""

    trials: int = setting(default=40, minimum=1, maximum=5000, description="necks that are tried")
    seed: int = setting(
        default=1, minimum=0, maximum=2**31, description="of the random numbers of the search"
    )


@dataclass(frozen=True)
class OptimumSettings:
    """Everything an optimisation depends on.

    Attributes
    ----------
    study
        Base, people, hand and all else that a study has.
    neck
        Name of the library's neck whose measurements are changed.
    bounds
        By measurement.
    objectives
        Names of measures.
    constraints, search
        The tables.
    """

    study: StudySettings
    neck: str
    bounds: Mapping[str, tuple[float, float]]
    objectives: tuple[str, ...]
    constraints: ConstraintSettings
    search: TrialSettings

    def measurements(self, values: Values) -> NeckMeasurements:
        """Return the neck of some values.

        Raises
        ------
        ImpossibleError
            If they make none, or one that breaks a constraint on measurements.
        """
        fixed = CLOSURES.get(self.constraints.closure or "", {})
        changes: dict[str, Any] = {**fixed, **values}
        try:
            neck = replace(NECKS[self.neck], **changes)
        except ValueError as error:
            raise ImpossibleError(str(error)) from error
        limits = self.constraints
        found = {
            "least_wall_mm": (neck.wall_thickness_mm, limits.least_wall_mm),
            "least_engagement_mm": (neck.crests * neck.pitch_mm, limits.least_engagement_mm),
            "least_thread_depth_mm": (neck.thread_depth_mm, limits.least_thread_depth_mm),
        }
        for name, (value, least) in found.items():
            if value < least - 1e-9:
                raise ImpossibleError(f"constraints.{name} = {least:g} mm is missed: {value:g} mm")
        return neck


def read_optimum(file: Path) -> OptimumSettings:
    """Return the optimisation of a file.

    Raises
    ------
    StudyError
        If it is none, or contradicts itself.
    SettingError
        If a setting is unknown, missing or out of range.
    """
    document = read_toml(file, what="optimisation file", error=StudyError)
    with naming(file):
        return optimum_from(document, folder=file.resolve().parent, name=file.stem)


def optimum_from(document: Mapping[str, Any], *, folder: Path, name: str) -> OptimumSettings:
    """Return the optimisation of a document; errors as of :func:`read_optimum`."""
    for table in NOT_HERE:
        if table in document:
            raise StudyError(f"[{table}] has no place in an optimisation: give [bounds]")
    rest = {key: value for key, value in document.items() if key not in (*NEW_TABLES, "neck")}
    neck = document.get("neck", "A38")
    if neck not in NECKS:
        raise StudyError(f"neck = {shown(neck)} is not a neck: {nearest(str(neck), NECKS)}")
    constraints = table_from(
        ConstraintSettings, document.get("constraints", {}), where="constraints"
    )
    closure = constraints.closure
    if closure is not None and closure not in CLOSURES:
        raise StudyError(f"constraints.closure = {shown(closure)}: {nearest(closure, CLOSURES)}")
    found = OptimumSettings(
        study=study_from(rest, folder=folder, name=name),
        neck=str(neck),
        bounds=_bounds(document.get("bounds", {}), closure),
        objectives=_objectives(document.get("objectives", {})),
        constraints=constraints,
        search=table_from(TrialSettings, document.get("search", {}), where="search"),
    )
    _refuse_impossible_bounds(found)
    _refuse_seal_without_liquid(found)
    return found


def _refuse_impossible_bounds(settings: OptimumSettings) -> None:
    """Refuse an end of bounds that makes no neck, wherever within theirs the others are."""
    others = {name: (*ends, 0.5 * sum(ends)) for name, ends in settings.bounds.items()}
    for name, ends in settings.bounds.items():
        for word, end in zip(("from", "to"), ends, strict=True):
            choices = {**others, name: (end,)}
            reasons = []
            for values in islice(product(*choices.values()), MOST_CHOICES):
                try:
                    settings.measurements(dict(zip(choices, values, strict=True)))
                    break
                except ImpossibleError as error:
                    reasons.append(str(error))
            else:
                raise StudyError(
                    f"bounds.{name}: {word} = {end:g} makes no neck, whatever the others are: "
                    f"{reasons[0]}"
                )


def _refuse_seal_without_liquid(settings: OptimumSettings) -> None:
    """Refuse a seal that is asked for while there is nothing to hold back."""
    asked = [name for name in settings.objectives if "seal_margin" in name]
    if settings.constraints.least_seal_kpa is not None:
        asked.append("constraints.least_seal_kpa")
    if asked and any(scenario.liquid is None for scenario in scenarios_of(settings.study)):
        raise StudyError(f"{asked[0]} needs a liquid: give [set.liquid] volume_ml")


def _bounds(table: Any, closure: str | None) -> dict[str, tuple[float, float]]:
    known = {field.name: field for field in fields(NeckMeasurements) if field.type == "float"}
    if not isinstance(table, Mapping) or not table:
        raise StudyError("[bounds] is missing: e.g. rim_radius_mm = {from = 0.4, to = 0.85}")
    found = {}
    for name, value in table.items():
        if name not in known:
            raise StudyError(f"bounds.{name} is no measurement of a neck: {nearest(name, known)}")
        if closure is not None and name in CLOSURES[closure]:
            raise StudyError(f'bounds.{name} is fixed by constraints.closure = "{closure}"')
        if not isinstance(value, Mapping) or set(value) != {"from", "to"}:
            raise StudyError(f"bounds.{name} = {shown(value)}: give {{from = …, to = …}}")
        low, high = value["from"], value["to"]
        for end in (low, high):
            if isinstance(end, bool) or not isinstance(end, int | float):
                raise StudyError(f"bounds.{name} holds {shown(end)}: give numbers")
            wrong = range_error(float(end), known[name].metadata)
            if wrong is not None:
                raise StudyError(f"bounds.{name} = {end:g} mm {wrong}")
        if low >= high:
            raise StudyError(f"bounds.{name}: from = {low:g} is not less than to = {high:g}")
        found[name] = (float(low), float(high))
    return found


def _objectives(table: Any) -> tuple[str, ...]:
    if not isinstance(table, Mapping) or set(table) - {"list"}:
        raise StudyError(f'[objectives] holds one key, list, e.g. list = ["{HEADLINE}"]')
    names = table.get("list", [HEADLINE])
    if not isinstance(names, list) or not names:
        raise StudyError(f"objectives.list = {shown(names)}: give a list that is not empty")
    for name in names:
        if name not in MEASURES:
            raise StudyError(f"objectives.list holds {shown(name)}: {nearest(str(name), MEASURES)}")
    return tuple(names)
