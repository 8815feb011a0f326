"""Who drinks in a study, with which motion: all of its sips but for the neck.

It is made once; every neck meets the same panel.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.population import Person, sampled_people
from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.progress import Progress
from mocap.motion.motion import Motion
from mocap.motion.sampling import sampled_motion
from scenarios.campaign.films import MOTIONS, NAME_LENGTH, FilmedSip, filmed_sips
from scenarios.campaign.meeting import direction_of_nose
from scenarios.campaign.settings import DoubtSettings, StudySettings
from scenarios.campaign.skin_draws import SkinRegion
from scenarios.campaign.variation import StudyError
from scenarios.settings.person import Head
from scenarios.settings.scenario import Scenario

SKINS = "skins"
"""Folder of a study's directory with sampled skins."""


@dataclass(frozen=True)
class Drinker:
    """A person with a motion, before a neck.

    Attributes
    ----------
    film
        The motion of the study.
    person
        Who drinks; None if it is the filmed one.
    draw
        Number of the sampled motion; None if it is the measured one.
    scenario
        The sip, with the neck of the study's base.
    """

    film: FilmedSip
    person: Person | None
    draw: int | None
    scenario: Scenario


@dataclass(frozen=True)
class Panel:
    """Everybody who drinks in a study.

    Attributes
    ----------
    settings
        Of the study.
    films, people
        What is combined; without people, the filmed person drinks.
    drinkers
        Each person with each motion.
    out
        The study's directory.
    """

    settings: StudySettings
    films: tuple[FilmedSip, ...]
    people: tuple[Person, ...]
    drinkers: tuple[Drinker, ...]
    out: Path


def panel_of(study: StudySettings, out: Path, progress: Progress) -> Panel:
    """Return the panel of a study; motions are put into its directory.

    Raises
    ------
    DrinksimError
        If a film contradicts itself.
    """
    out = out.resolve()
    films = filmed_sips(study, out, progress)
    people = _people(study, films[0].scenario)
    drinkers = tuple(_drinkers(study, films, people, out, progress))
    return Panel(study, films, people, drinkers, out)


def _drinkers(
    study: StudySettings,
    films: Sequence[FilmedSip],
    people: Sequence[Person],
    out: Path,
    progress: Progress,
) -> Iterator[Drinker]:
    draws = range(1, study.doubt.draws + 1) if study.doubt.draws else (None,)
    for film in films:
        sampling = _Sampling.of(study, film, out)
        for number, person in enumerate(people or (None,)):
            progress(number / max(len(people), 1), "building people")
            drinks = _filmed_person(study, film) if person is None else _met(study, film, person)
            nose = direction_of_nose(drinks.head.section())
            for draw in draws:
                yield Drinker(film, person, draw, sampling.sip(drinks, nose, person, draw))


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


@dataclass(frozen=True)
class _Sampling:
    """What is sampled for each draw of a film, and the folder that its files go to."""

    doubt: DoubtSettings
    film: FilmedSip
    skin: SkinRegion | None
    out: Path

    @classmethod
    def of(cls, study: StudySettings, film: FilmedSip, out: Path) -> _Sampling:
        file = study.doubt.skin
        skin = None if file is None else SkinRegion.read(study.folder / file, film.scenario.skin)
        return cls(study.doubt, film, skin, out)

    def sip(
        self, drinks: Scenario, nose_rad: float, person: Person | None, draw: int | None
    ) -> Scenario:
        """Return the sip of a person with motion, place and skin of a draw, put into files."""
        if person is None and draw is None:
            return drinks
        motion: Motion | None = None
        if draw is not None:
            number = 0 if person is None else person.number
            random = np.random.default_rng([self.doubt.seed, number, draw])
            by = self.doubt.placement_sigma_mm * random.standard_normal(2)
            motion = sampled_motion(self.film.meeting.motion, random)
            drinks = self._with_skin(_shifted(drinks, by), random)
        text = self.film.meeting.motion_for(nose_rad, motion).text()
        return drinks.with_motion(_kept(text, self.out / MOTIONS, ".csv"))

    def _with_skin(self, drinks: Scenario, random: np.random.Generator) -> Scenario:
        if self.skin is None:
            return drinks
        text = self.skin.text(self.skin.sampled(random))
        return drinks.with_(skin={"file": str(_kept(text, self.out / SKINS, ".toml"))})


def _kept(text: str, folder: Path, ending: str) -> Path:
    """Return the file of a text, named by its content, which is written if it is not there."""
    file = folder / f"{hashlib.sha256(text.encode()).hexdigest()[:NAME_LENGTH]}{ending}"
    if not file.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        with file_at_once(file) as partial:
            partial.write_text(text, encoding="utf-8")
    return file


def _shifted(scenario: Scenario, by_mm: NDArray[np.float64]) -> Scenario:
    """Return a sip whose neck is (2,) farther forward and up in the head."""
    return scenario.with_(
        placement={
            "shift_x_mm": float(_shift(scenario, "x") + by_mm[0]),
            "shift_y_mm": float(_shift(scenario, "y") + by_mm[1]),
        },
        first_contact=None,
    )


def _shift(scenario: Scenario, axis: str) -> float:
    """Return a shift of a placement that is known in numbers, mm."""
    value = getattr(scenario.placement, f"shift_{axis}_mm")
    assert not isinstance(value, str)  # the meeting has found it
    return float(value)
