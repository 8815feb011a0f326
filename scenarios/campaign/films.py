"""The motions of a study: each as a sip that was filmed, with what holds the neck."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.progress import Progress
from scenarios.campaign.cases import identity_of
from scenarios.campaign.meeting import Meeting
from scenarios.campaign.settings import StudySettings
from scenarios.campaign.variation import StudyError
from scenarios.results.integrity import checksum
from scenarios.settings.files import file_layers
from scenarios.settings.hand import HandSettings
from scenarios.settings.inputs import input_files
from scenarios.settings.layers import SettingsLayer, values_by_path
from scenarios.settings.scenario import Scenario, scenario_from
from scenarios.sip.replay import refuse_unusable
from scenarios.sip.run import with_known_motion

MOTIONS, REFERENCES = "motions", "references"
"""Folders of a study's directory."""

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


def filmed_sips(study: StudySettings, out: Path, progress: Progress) -> tuple[FilmedSip, ...]:
    """Return the motions of a study; converted ones are put into its directory ``out``.

    Raises
    ------
    DrinksimError
        If a film, or its neck, contradicts itself, or if two motions have the same name.
    """
    films = tuple(
        _filmed_sip(study, name, out, progress) for name in study.motions or (study.base,)
    )
    _refuse_same_names([film.name for film in films])
    return films


def _refuse_same_names(names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise StudyError(f"motions.list holds {name!r} twice: name every motion once")


def scenarios_of(study: StudySettings) -> tuple[Scenario, ...]:
    """Return what the motions of a study are part of, nothing converted yet."""
    return tuple(_scenario_of(study, name) for name in study.motions or (study.base,))


def _scenario_of(study: StudySettings, name: str) -> Scenario:
    """Return the scenario of a scenario's name or file, or of a motion.csv."""
    is_motion = _is_motion(name)
    layers = file_layers(study.base if is_motion else name, study.folder)
    layers.append(SettingsLayer(study.settings or {}, study.folder, name="[set]", same_sip=True))
    if is_motion:
        layers.append(SettingsLayer({"motion": {"file": name}}, study.folder, same_sip=True))
    return scenario_from(layers)


def _is_motion(name: str) -> bool:
    return name.lower().endswith(".csv")


def _filmed_sip(study: StudySettings, name: str, out: Path, progress: Progress) -> FilmedSip:
    """Return the filmed sip of a scenario's name or file, or of a motion.csv."""
    scenario = _scenario_of(study, name)
    refuse_unusable(scenario)
    motion = _converted(scenario, out, progress)
    base = scenario.with_motion(motion).with_(recording=None)
    hand = base.hand if base.hand.mode != "recorded" else HandSettings(mode=study.meeting.hand)
    filmed = base.with_(
        package=base.filmed_package, filmed=None, hand=HandSettings(), name=f"{base.name}, filmed"
    )
    reference = None
    if hand.mode != "recorded":
        made = out / REFERENCES / identity_of(values_by_path(filmed))
        reference = made if hand.reference is None else Path(hand.reference)
        if hand.upper_force_n is None:
            hand = replace(hand, reference=str(reference))
    return FilmedSip(
        Path(name).stem if _is_motion(name) else base.name,
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
