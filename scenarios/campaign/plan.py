"""From the settings of a study to its cases: everything is built and checked before a sip runs."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from geometry2d.anatomy.population import Person
from geometry2d.foundation.errors import naming
from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.progress import Progress
from scenarios.campaign.cases import Case, case_of
from scenarios.campaign.design import Point, design_points
from scenarios.campaign.films import NAME_LENGTH, REFERENCES, FilmedSip, scenarios_of
from scenarios.campaign.necks import NamedNeck, named_necks
from scenarios.campaign.panel import Drinker, Panel, panel_of
from scenarios.campaign.settings import StudySettings
from scenarios.campaign.variation import StudyError
from scenarios.results.integrity import checksum
from scenarios.settings.scenario import Scenario
from scenarios.sip.replay import neck_findings_of, refuse_contradictions

RUNS, INPUTS = "runs", "inputs"
"""Folders of a study's directory."""

FILMED = "filmed"
"""How the person is called whose head the base scenario has."""


@dataclass(frozen=True)
class Plan:
    """All that a study computes.

    Attributes
    ----------
    settings
        Of the study.
    films, necks, people
        What is combined; without people, the filmed person drinks.
    cases
        A case a sip, in the order of the table.
    """

    settings: StudySettings
    films: tuple[FilmedSip, ...]
    necks: tuple[NamedNeck, ...]
    people: tuple[Person, ...]
    cases: tuple[Case, ...]


def planned(study: StudySettings, out: Path, progress: Progress) -> Plan:
    """Return the plan of a study; motions and drawings are put into its directory.

    Raises
    ------
    DrinksimError
        If a sip contradicts itself; it is named.
    """
    # What can be known of the necks is known before a film is converted.
    scenarios = scenarios_of(study)
    necks = named_necks(study.necks, study.folder, base=_neck_name(scenarios[0]))
    points = design_points(study.design, study.vary)
    for scenario in scenarios:
        _check_necks(scenario, necks, points)
    panel = panel_of(study, out, progress)
    return plan_for(panel, [_kept(neck, panel.out) for neck in necks])


def plan_for(panel: Panel, necks: Sequence[NamedNeck]) -> Plan:
    """Return the plan in which a panel drinks from some necks.

    Raises
    ------
    DrinksimError
        If a neck cannot be met by the filmed person; it is named.
    """
    points = design_points(panel.settings.design, panel.settings.vary)
    for film in panel.films:
        _check_necks(film.base, necks, points)
    cases = tuple(_cases(panel, necks, points))
    return Plan(panel.settings, panel.films, tuple(necks), panel.people, cases)


def _neck_name(scenario: Scenario) -> str:
    outline = scenario.package.outline
    return scenario.package.neck if outline is None else Path(outline).stem


def _kept(neck: NamedNeck, out: Path) -> NamedNeck:
    """Return a neck whose drawing is in the study's directory."""
    outline = neck.package.get("outline")
    if outline is None:
        return neck
    drawing = Path(str(outline))
    if not drawing.is_file():
        raise StudyError(f"necks.list: no drawing {drawing}: check the path")
    kept = out / INPUTS / checksum(drawing)[:NAME_LENGTH] / drawing.name
    if not kept.is_file():
        kept.parent.mkdir(parents=True, exist_ok=True)
        with file_at_once(kept) as partial:
            shutil.copyfile(drawing, partial)
    return replace(neck, package={**neck.package, "outline": str(kept)})


def _cases(panel: Panel, necks: Sequence[NamedNeck], points: Sequence[Point]) -> Iterator[Case]:
    references, alone = _references(panel.films), len(panel.films) == 1
    for drinker in panel.drinkers:
        for neck in necks:
            for point in points:
                scenario = _varied(drinker.scenario, neck, point)
                factors = _factors(drinker, neck, point, alone=alone)
                yield case_of(scenario, factors, panel.out / RUNS, references)


def _references(films: Sequence[FilmedSip]) -> dict[str, str]:
    """Return what a run that forces are taken from depends on, by its directory."""
    return {
        str(film.reference): film.reference.name
        for film in films
        if film.reference is not None and film.reference.parent.name == REFERENCES
    }


def _check_necks(base: Scenario, necks: Sequence[NamedNeck], points: Sequence[Point]) -> None:
    """Check every neck, with every value of its measurements, on the filmed head."""
    seen: list[Scenario] = []
    for neck in necks:
        for point in points:
            with naming(f"neck {neck.name}"):
                scenario = _varied(base, neck, point)
                if any(scenario.package == other.package for other in seen):
                    continue
                seen.append(scenario)
                scenario.package.section()
                refuse_contradictions(neck_findings_of(scenario))


def _varied(scenario: Scenario, neck: NamedNeck, point: Point) -> Scenario:
    changes: dict[str, object] = dict(point.values)
    changed = scenario.with_(package=neck.package) if neck.package else scenario
    return changed.with_(**changes) if changes else changed


def _factors(
    drinker: Drinker, neck: NamedNeck, point: Point, *, alone: bool
) -> Mapping[str, object]:
    factors: dict[str, object] = {
        "neck": neck.name,
        "person": FILMED if drinker.person is None else drinker.person.name,
    }
    if not alone:
        factors["motion"] = drinker.film.name
    if drinker.draw is not None:
        factors["draw"] = drinker.draw
    if point.sample is not None:
        factors["sample"] = point.sample
    if point.matrix:
        factors["matrix"] = point.matrix
    return factors | dict(point.values)
