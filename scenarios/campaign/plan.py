"""From the settings of a study to its cases: everything is built and checked before a sip runs."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from geometry2d.anatomy.population import Person, sampled_people
from geometry2d.foundation.errors import naming
from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.progress import Progress
from mocap.motion.motion import Motion
from mocap.motion.sampling import sampled_motion
from scenarios.campaign.cases import Case, case_of, identity_of
from scenarios.campaign.design import Point, design_points
from scenarios.campaign.meeting import Meeting, direction_of_nose
from scenarios.campaign.necks import NamedNeck, named_necks
from scenarios.campaign.settings import StudySettings
from scenarios.campaign.variation import StudyError
from scenarios.results.integrity import checksum
from scenarios.settings.files import file_layers
from scenarios.settings.hand import HandSettings
from scenarios.settings.inputs import input_files
from scenarios.settings.layers import SettingsLayer, values_by_path
from scenarios.settings.person import Head
from scenarios.settings.scenario import Scenario, scenario_from
from scenarios.sip.replay import neck_findings_of, refuse_contradictions, refuse_unusable
from scenarios.sip.run import with_known_motion

RUNS, MOTIONS, INPUTS, REFERENCES = "runs", "motions", "inputs", "references"
"""Folders of a study's directory."""

FILMED = "filmed"
"""How the person is called whose head the base scenario has."""

NAME_LENGTH = 16


@dataclass(frozen=True)
class FilmedSip:
    """A motion of the study, and where its rim meets its lower lip.

    Attributes
    ----------
    name
        How tables call it.
    scenario
        As it was filmed, with the settings of the study.
    base
        The scenario of the study with this motion: perhaps another neck than the filmed one.
    meeting
        Where they meet.
    reference
        Directory of the run whose forces are held; None if the neck follows the film.
    """

    name: str
    scenario: Scenario
    base: Scenario
    meeting: Meeting
    reference: Path | None


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
    out = out.resolve()
    films = tuple(
        _filmed_sip(study, name, out, progress) for name in study.motions or (study.base,)
    )
    _refuse_same_names([film.name for film in films])
    first = films[0].scenario
    necks = named_necks(study.necks, study.folder, base=_neck_name(films[0].base))
    necks = tuple(_kept(neck, out) for neck in necks)
    people = _people(study, first)
    cases = tuple(_cases(study, films, necks, people, out, progress))
    return Plan(study, films, necks, people, cases)


def _refuse_same_names(names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise StudyError(f"motions.list holds {name!r} twice: name every motion once")


def _neck_name(scenario: Scenario) -> str:
    outline = scenario.package.outline
    return scenario.package.neck if outline is None else Path(outline).stem


def _people(study: StudySettings, filmed: Scenario) -> tuple[Person, ...]:
    settings = study.people
    if settings is None:
        return ()
    if filmed.head.outline is not None:
        raise StudyError(
            f"[people] are sampled from measurements, but the base scenario's head is the drawing "
            f"{filmed.head.outline}: leave one of them out"
        )
    return sampled_people(
        settings.count,
        sex=settings.sex,
        seed=settings.seed,
        spread=settings.spread,
        base=filmed.head.measurements,
    )


def _filmed_sip(study: StudySettings, name: str, out: Path, progress: Progress) -> FilmedSip:
    """Return the filmed sip of a scenario's name or file, or of a motion.csv."""
    is_motion = name.lower().endswith(".csv")
    layers = file_layers(study.base if is_motion else name, study.folder)
    layers.append(SettingsLayer(study.settings or {}, study.folder, name="[set]"))
    if is_motion:
        layers.append(SettingsLayer({"motion": {"file": name}}, study.folder))
    scenario = scenario_from(layers)
    refuse_unusable(scenario)
    motion = _converted(scenario, out, progress)
    base = scenario.with_motion(motion).with_(recording=None)
    hand = base.hand if base.hand.mode != "recorded" else HandSettings(mode=study.meeting.hand)
    filmed = base.with_(
        package=base.filmed_package, filmed=None, hand=HandSettings(), name=f"{base.name}, filmed"
    )
    filmed = replace(filmed, filmed=None)
    reference = None
    if hand.mode != "recorded":
        made = out / REFERENCES / identity_of(values_by_path(filmed))
        reference = made if hand.reference is None else Path(hand.reference)
        if hand.upper_force_n is None:
            hand = replace(hand, reference=str(reference))
    return FilmedSip(
        Path(name).stem if is_motion else base.name,
        filmed,
        replace(base, hand=hand),
        Meeting.of(filmed),
        reference,
    )


def _converted(scenario: Scenario, out: Path, progress: Progress) -> Path:
    """Return the file of a scenario's motion in the study's directory."""
    content = "".join(checksum(file) for _, file in sorted(input_files(scenario).items()))
    recording = scenario.recording
    if scenario.motion is None and recording is not None:
        content += f"{recording.start_s} {recording.end_s}"
    known = out / MOTIONS / f"{hashlib.sha256(content.encode()).hexdigest()[:NAME_LENGTH]}.csv"
    if not known.is_file():
        known.parent.mkdir(parents=True, exist_ok=True)
        motion = with_known_motion(scenario, progress).known_motion()
        with file_at_once(known) as partial:
            motion.write(partial)
    return known


def _kept(neck: NamedNeck, out: Path) -> NamedNeck:
    """Return a neck whose drawing is in the study's directory."""
    outline = neck.package.get("outline")
    if outline is None:
        return neck
    drawing = Path(str(outline))
    if not drawing.is_file():
        raise StudyError(f"necks.list: no drawing {drawing}: check the path")
    kept = out / INPUTS / f"{checksum(drawing)[:NAME_LENGTH]}{drawing.suffix.lower()}"
    if not kept.is_file():
        kept.parent.mkdir(parents=True, exist_ok=True)
        with file_at_once(kept) as partial:
            shutil.copyfile(drawing, partial)
    return replace(neck, package={**neck.package, "outline": str(kept)})


def _cases(
    study: StudySettings,
    films: Sequence[FilmedSip],
    necks: Sequence[NamedNeck],
    people: Sequence[Person],
    out: Path,
    progress: Progress,
) -> Iterator[Case]:
    points = design_points(study.design, study.vary)
    draws = range(1, study.doubt.draws + 1) if study.doubt.draws else (None,)
    for film in films:
        _check_necks(film, necks, points)
        for number, person in enumerate(people or (None,)):
            progress(number / max(len(people), 1), "building people and necks")
            drinks = _filmed_person(study, film) if person is None else _met(study, film, person)
            nose = direction_of_nose(drinks.head.section())
            for draw in draws:
                moved = _with_motion(study, film, drinks, nose, person, draw, out)
                for neck in necks:
                    for point in points:
                        scenario = _varied(moved, neck, point)
                        factors = _factors(film, neck, person, draw, point, alone=len(films) == 1)
                        yield case_of(scenario, factors, out / RUNS, _references(films))


def _references(films: Sequence[FilmedSip]) -> dict[str, str]:
    """Return what a run that forces are taken from depends on, by its directory."""
    return {
        str(film.reference): film.reference.name
        for film in films
        if film.reference is not None and film.reference.parent.name == REFERENCES
    }


def _check_necks(film: FilmedSip, necks: Sequence[NamedNeck], points: Sequence[Point]) -> None:
    """Check every neck, with every value of its measurements, on the filmed head."""
    seen: list[Scenario] = []
    for neck in necks:
        for point in points:
            with naming(f"neck {neck.name}"):
                scenario = _varied(film.base, neck, point)
                if any(scenario.package == other.package for other in seen):
                    continue
                seen.append(scenario)
                scenario.package.section()
                refuse_contradictions(neck_findings_of(scenario))


def _filmed_person(study: StudySettings, film: FilmedSip) -> Scenario:
    """Return the sip of the filmed person, its placement in numbers where motions are sampled."""
    if study.doubt.draws == 0:
        return film.base
    return film.base.with_(placement=film.meeting.scenario.placement, first_contact=None)


def _met(study: StudySettings, film: FilmedSip, person: Person) -> Scenario:
    """Return the sip of a person, without a neck of the study yet."""
    if study.meeting.at == "as_filmed":
        head = Head(measurements=person.measurements)
        placed = film.meeting.scenario.placement
    else:
        met = film.meeting.met_by(person.measurements)
        head, placed = met.head, met.placement
    return film.base.with_(head=head, placement=placed, first_contact=None)


def _with_motion(
    study: StudySettings,
    film: FilmedSip,
    drinks: Scenario,
    nose_rad: float,
    person: Person | None,
    draw: int | None,
    out: Path,
) -> Scenario:
    """Return the sip of a person with the motion of a draw, which is put into a file."""
    if person is None and draw is None:
        return drinks
    motion: Motion | None = None
    if draw is not None:
        number = 0 if person is None else person.number
        random = np.random.default_rng([study.doubt.seed, number, draw])
        sigma = study.doubt.placement_sigma_mm
        by = sigma * random.standard_normal(2)
        motion = sampled_motion(film.meeting.motion, random)
        drinks = drinks.with_(
            placement={
                "shift_x_mm": float(_shift(drinks, "x") + by[0]),
                "shift_y_mm": float(_shift(drinks, "y") + by[1]),
            },
            first_contact=None,
        )
    seen = film.meeting.motion_for(nose_rad, motion)
    text = seen.text()
    name = hashlib.sha256(text.encode()).hexdigest()[:NAME_LENGTH]
    file = out / MOTIONS / f"{name}.csv"
    if not file.is_file():
        with file_at_once(file) as partial:
            partial.write_text(text, encoding="utf-8")
    return drinks.with_motion(file)


def _shift(scenario: Scenario, axis: str) -> float:
    """Return a shift of a placement that is known in numbers, mm."""
    value = getattr(scenario.placement, f"shift_{axis}_mm")
    assert not isinstance(value, str)  # the meeting has found it
    return float(value)


def _varied(scenario: Scenario, neck: NamedNeck, point: Point) -> Scenario:
    changes: dict[str, object] = dict(point.values)
    changed = scenario.with_(package=neck.package) if neck.package else scenario
    return changed.with_(**changes) if changes else changed


def _factors(
    film: FilmedSip,
    neck: NamedNeck,
    person: Person | None,
    draw: int | None,
    point: Point,
    *,
    alone: bool,
) -> Mapping[str, object]:
    factors: dict[str, object] = {
        "neck": neck.name,
        "person": FILMED if person is None else person.name,
    }
    if not alone:
        factors["motion"] = film.name
    if draw is not None:
        factors["draw"] = draw
    if point.sample is not None:
        factors["sample"] = point.sample
    if point.matrix:
        factors["matrix"] = point.matrix
    return factors | dict(point.values)
