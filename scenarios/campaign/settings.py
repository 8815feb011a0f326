"""The file of a study: a base scenario, and what is laid over it for each sip.

Tables are dataclasses like those of a scenario (:mod:`scenarios.settings.tables`). Only ``[vary]``
and ``[set]`` are free: their keys are the settings of a scenario.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from geometry2d.anatomy.population import Sexes
from geometry2d.foundation.errors import naming
from geometry2d.foundation.settings import setting
from geometry2d.foundation.toml import read_toml, shown
from scenarios.campaign.variation import StudyError, VariedSetting, variations
from scenarios.settings.names import nearest
from scenarios.settings.tables import Value, table_from


@dataclass(frozen=True)
class PeopleSettings:
    """The panel: heads sampled from the spreads and correlations of a population."""

    count: int = setting(minimum=1, maximum=10000, description="how many people drink")
    sex: Sexes = setting(default="both", description="whose norms; both takes them in turn")
    seed: int = setting(
        default=1, minimum=0, maximum=2**31, description="of the random numbers of the panel"
    )
    spread: float = setting(
        default=1.0,
        minimum=0.0,
        maximum=2.0,
        description="factor on the standard deviations among people",
    )


@dataclass(frozen=True)
class DoubtSettings:
    """What the recording leaves open, sampled anew for each person; every neck meets the same."""

    draws: int = setting(
        default=0,
        minimum=0,
        maximum=1000,
        description="whole motions sampled for each person; 0: the measured motion",
    )
    seed: int = setting(
        default=1, minimum=0, maximum=2**31, description="of the random numbers of the draws"
    )
    placement_sigma_mm: float = setting(
        default=0.3,
        unit="mm",
        minimum=0.0,
        maximum=10.0,
        description="standard deviation of where the neck is in the head, forward and up",
        source="first_contact.skin_sigma_mm: how well a section fits a face",
    )
    skin: str | None = setting(
        default=None,
        example="fit/calibration.json",
        description="calibration whose confidence region the parameters of the skin are sampled "
        "from, anew for each draw",
    )


@dataclass(frozen=True)
class DesignSettings:
    """How values of [vary] are combined."""

    kind: Literal["grid", "latin_hypercube", "sobol"] = setting(
        default="grid",
        description="grid: every value with every other; latin_hypercube: samples that fill the "
        "ranges; sobol: samples for indices of sensitivity",
    )
    samples: int = setting(
        default=64,
        minimum=2,
        maximum=2**16,
        description="of a latin_hypercube; of sobol, a power of two, each solved 2 + number of "
        "varied settings times",
    )
    seed: int = setting(
        default=1, minimum=0, maximum=2**31, description="of the random numbers of the samples"
    )


@dataclass(frozen=True)
class MeetingSettings:
    """How a person meets a neck."""

    at: Literal["lower_lip", "as_filmed"] = setting(
        default="lower_lip",
        description="lower_lip: the rim comes to the place on the person's own lower lip that it "
        "has on the filmed one; as_filmed: to the place in the head",
    )
    hand: Literal["force", "same", "recorded"] = setting(
        default="force",
        description="force: each lip bears what it bore in the filmed sip; same: the hand yields "
        "as in the filmed sip; recorded: the neck follows the film",
    )


@dataclass(frozen=True)
class LimitSettings:
    """What one sip may take."""

    time_s: float = setting(
        default=1800.0, unit="s", above=0.0, description="after which a sip is given up"
    )
    memory_mb: float = setting(
        default=3000.0, unit="MB", minimum=200.0, description="beyond which a sip is given up"
    )
    retries: int = setting(
        default=2,
        minimum=0,
        maximum=20,
        description="how often a sip is tried again whose worker was lost",
    )


@dataclass(frozen=True)
class StudySettings:
    """Everything a study depends on.

    Attributes that a file gives as free tables: ``necks`` and ``motions`` (each a list), ``vary``,
    ``settings`` (the table ``[set]``).
    """

    base: str
    folder: Path
    necks: tuple[str | Mapping[str, Value], ...] = ()
    motions: tuple[str, ...] = ()
    people: PeopleSettings | None = None
    vary: tuple[VariedSetting, ...] = ()
    settings: Mapping[str, Value] | None = None
    doubt: DoubtSettings = DoubtSettings()
    design: DesignSettings = DesignSettings()
    meeting: MeetingSettings = MeetingSettings()
    limits: LimitSettings = LimitSettings()
    keep: Literal["numbers", "histories", "runs"] = "numbers"
    name: str = "study"

    def __post_init__(self) -> None:
        _refuse_contradictions(self)


TABLES = {
    "people": PeopleSettings,
    "doubt": DoubtSettings,
    "design": DesignSettings,
    "meeting": MeetingSettings,
    "limits": LimitSettings,
}
"""Tables of a study whose keys are fixed."""

LISTS = ("necks", "motions")
KEEP = ("numbers", "histories", "runs")
NAMES = ("name", "base", "keep", *LISTS, "people", "vary", "set", "doubt", "design", "meeting",
         "limits")  # fmt: skip

STUDY_FILE = "study.toml"


def read_study(file: Path) -> StudySettings:
    """Return the study of a file; relative paths in it start from its folder.

    Raises
    ------
    StudyError
        If it is no study, or contradicts itself.
    SettingError
        If a setting is unknown, missing or out of range.
    """
    document = read_toml(file, what="study file", error=StudyError)
    with naming(file):
        return study_from(document, folder=file.resolve().parent, name=file.stem)


def study_from(document: Mapping[str, Any], *, folder: Path, name: str) -> StudySettings:
    """Return the study of a document; errors as of :func:`read_study`.

    Parameters
    ----------
    document
        As a file holds it.
    folder
        What relative paths start from.
    name
        What the study is called unless the document says it.
    """
    for key in document:
        if key not in NAMES:
            raise StudyError(f"unknown key {key}: {nearest(key, NAMES)}")
    base = document.get("base")
    if not isinstance(base, str) or not base:
        raise StudyError('base is missing: the scenario to start from, e.g. base = "A38-F"')
    keep = document.get("keep", "numbers")
    if keep not in KEEP:
        raise StudyError(f"keep = {shown(keep)} is not a choice: {nearest(str(keep), KEEP)}")
    tables: dict[str, Any] = {
        table: table_from(kind, document[table], where=table)
        for table, kind in TABLES.items()
        if table in document
    }
    return StudySettings(
        name=str(document.get("name", name)),
        base=base,
        folder=folder,
        keep=keep,
        necks=_list_of("necks", document, (str, Mapping)),
        motions=_list_of("motions", document, (str,)),
        vary=variations(document.get("vary", {})),
        settings=document.get("set", {}),
        **tables,
    )


def _list_of(table: str, document: Mapping[str, Any], kinds: tuple[type, ...]) -> tuple[Any, ...]:
    if table not in document:
        return ()
    given = document[table]
    if not isinstance(given, Mapping) or set(given) - {"list"}:
        raise StudyError(f'[{table}] holds one key, list, e.g. list = ["A38", "mine.dxf"]')
    entries = given.get("list")
    if not isinstance(entries, Sequence) or isinstance(entries, str) or not entries:
        raise StudyError(f"{table}.list = {shown(entries)}: give a list that is not empty")
    for entry in entries:
        if not isinstance(entry, kinds):
            raise StudyError(f"{table}.list holds {shown(entry)}: give names, files or tables")
    return tuple(entries)


def _refuse_contradictions(study: StudySettings) -> None:
    continuous = [each for each in study.vary if each.is_continuous]
    if study.design.kind == "sobol":
        if not study.vary:
            raise StudyError('design.kind = "sobol" needs something in [vary]')
        if study.design.samples & (study.design.samples - 1):
            raise StudyError(
                f"design.samples = {study.design.samples} is no power of two, which Sobol' needs: "
                f"use {1 << study.design.samples.bit_length()}"
            )
        if len(continuous) < len(study.vary):
            level = next(each for each in study.vary if not each.is_continuous)
            raise StudyError(
                f'vary."{level.path}" is a list, but indices of sensitivity need a range or a '
                "distribution: give {from, to}"
            )
    if study.design.kind == "latin_hypercube" and not study.vary:
        raise StudyError('design.kind = "latin_hypercube" needs something in [vary]')
    if study.doubt.skin is not None and study.doubt.draws == 0:
        raise StudyError("doubt.skin has no effect without draws: give doubt.draws = 1 or more")
    necks = any(each.path.startswith("package.") for each in study.vary)
    drawn = [n for n in study.necks if isinstance(n, str) and n.lower().endswith((".dxf", ".svg"))]
    if necks and drawn:
        raise StudyError(
            f"[vary] changes measurements of the neck, but necks.list holds the drawing "
            f"{drawn[0]}, which has none: leave one of them out"
        )
    for each in study.vary:
        if each.path.startswith("head.") and study.people is not None:
            raise StudyError(
                f'vary."{each.path}" and [people] contradict one another: people differ in it '
                "already; leave one of them out"
            )
        if each.path.startswith(("hand.", "placement.", "motion.", "recording.", "filmed.")):
            raise StudyError(
                f'vary."{each.path}" is decided by [meeting], [motions] and [doubt]: leave it out'
            )
        if study.settings and each.path in _paths(study.settings):
            raise StudyError(f"{each.path} stands in [vary] and in [set]: leave it out of one")


def _paths(document: Mapping[str, Any], prefix: str = "") -> set[str]:
    paths: set[str] = set()
    for name, value in document.items():
        paths.add(f"{prefix}{name}")
        if isinstance(value, Mapping):
            paths |= _paths(value, f"{prefix}{name}.")
    return paths
