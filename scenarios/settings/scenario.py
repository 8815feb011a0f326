"""A drinking scenario: what is filmed, who drinks from what, and how it is solved.

A scenario is read from TOML, checked once, and never changes afterwards. Each table of the file
is a frozen dataclass whose fields carry unit, range, meaning and source; how such tables are read
and written is in :mod:`scenarios.settings.tables`.
"""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Literal

from geometry2d.anatomy.anthropometry import HeadMeasurements
from geometry2d.anatomy.head import HeadSection, head_section
from geometry2d.drawings.drawn_head import drawn_head
from geometry2d.drawings.drawn_neck import drawn_neck
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting
from geometry2d.neck import NECKS, NeckMeasurements, NeckSection, neck_section
from scenarios.settings.tables import (
    SettingError,
    Value,
    nearest,
    split_override,
    table_from,
    toml_lines,
    toml_value,
)

DRAWN_HEAD_KEYS = ("dermis_thickness_mm", "tie_fade_mm")
"""Measurements that a drawing of the head leaves open."""

LIBRARY = Path(str(files("scenarios") / "library"))
"""Folder of the built-in scenarios, one folder each."""


class ScenarioError(DrinksimError):
    """A scenario cannot be found or read, or contradicts itself."""


@dataclass(frozen=True)
class Recording:
    """The video of the sip, and where its markers are."""

    video: str = setting(description="video file, beside the scenario file or absolute")
    markers: str = setting(description="marker file, beside the scenario file or absolute")
    start_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="first time used; from the start if absent"
    )
    end_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="last time used; to the end if absent"
    )


@dataclass(frozen=True)
class MotionFile:
    """A motion that has been measured already: it is replayed instead of the recording's."""

    file: str = setting(description="motion.csv, beside the scenario file or absolute")


@dataclass(frozen=True)
class Package:
    """The neck of the package: a named one and its measurements, or the user's own drawing.

    With an ``outline`` (SVG or DXF; :mod:`geometry2d.drawings.drawn_neck` says what it holds) the
    measurements only describe the carton behind the neck.
    """

    neck: str
    measurements: NeckMeasurements
    outline: str | None = None

    def section(self) -> NeckSection:
        """Return the neck, cut through its axis.

        Raises
        ------
        geometry2d.drawings.chains.DrawingError, geometry2d.neck.NeckError
            If the drawing or the measurements do not describe a neck.
        """
        if self.outline is None:
            return neck_section(self.measurements)
        return drawn_neck(Path(self.outline), carton=self.measurements)


@dataclass(frozen=True)
class Skin:
    """What the soft tissue is made of."""

    configuration: str = setting(
        default="L2-Ogden",
        choices=("L1", "L2-GOH", "L2-Ogden", "L3"),
        description="materials of dermis and bulk",
        source="thesis, Table 3.5",
    )
    dermis_stiffness: float = setting(
        default=1.0,
        minimum=0.01,
        maximum=100.0,
        description="factor on every stress of the dermis",
    )


@dataclass(frozen=True)
class Contact:
    """Coulomb friction of the pairs that touch."""

    friction: float = setting(
        default=1.0,
        minimum=0.0,
        maximum=3.0,
        description="friction coefficient between lip and package",
        source="thesis, section 4.2",
    )
    teeth_friction: float = setting(
        default=0.0,
        minimum=0.0,
        maximum=3.0,
        description="friction coefficient between lip and teeth",
        source="thesis, section 4.2",
    )
    lip_friction: float = setting(
        default=0.3,
        minimum=0.0,
        maximum=3.0,
        description="friction coefficient between lip and lip, and in folds",
        source="assumed: wet with saliva",
    )


@dataclass(frozen=True)
class Placement:
    """Where neck and lower face are put in the head section, beyond what the recording says.

    Axes are those of the head in its natural position: x forward, y up. What is "auto" is found
    from [first_contact] (:mod:`scenarios.sip.placement`).
    """

    shift_x_mm: float | Literal["auto"] = setting(
        default=0.0, unit="mm", minimum=-30.0, maximum=30.0, description="package forward"
    )
    shift_y_mm: float | Literal["auto"] = setting(
        default=0.0, unit="mm", minimum=-30.0, maximum=30.0, description="package upward"
    )
    turn_deg: float | Literal["auto"] = setting(
        default=0.0,
        unit="deg",
        minimum=-45.0,
        maximum=45.0,
        description="package turned counter-clockwise about the lower mark",
    )
    lower_face_x_mm: float | Literal["auto"] = setting(
        default=0.0,
        unit="mm",
        minimum=-20.0,
        maximum=20.0,
        description="lower lip, jaw and tooth forward",
    )
    lower_face_y_mm: float | Literal["auto"] = setting(
        default=0.0,
        unit="mm",
        minimum=-20.0,
        maximum=20.0,
        description="lower lip, jaw and tooth upward",
    )
    at_most_mm: float = setting(
        default=10.0, unit="mm", minimum=0.1, maximum=20.0, description="bound of every auto shift"
    )
    at_most_deg: float = setting(
        default=10.0, unit="deg", minimum=0.1, maximum=20.0, description="bound of an auto turn"
    )


@dataclass(frozen=True)
class FirstContact:
    """When and where the neck was seen to touch each lip first.

    Places are arc lengths along the lip's skin from its margin: positive towards the face,
    negative into the mouth.
    """

    lower_time_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="first contact with the lower lip"
    )
    lower_place_mm: float | None = setting(
        default=None, unit="mm", description="where on the lower lip"
    )
    upper_time_s: float | None = setting(
        default=None, unit="s", minimum=0.0, description="first contact with the upper lip"
    )
    upper_place_mm: float | None = setting(
        default=None, unit="mm", description="where on the upper lip"
    )
    time_sigma_s: float = setting(
        default=0.04,
        unit="s",
        minimum=1e-3,
        description="standard deviation of the times",
        source="one picture of a film with 25 a second",
    )
    place_sigma_mm: float = setting(
        default=1.5,
        unit="mm",
        minimum=0.01,
        description="standard deviation of the places",
        source="estimate: a lip read off by eye",
    )
    skin_sigma_mm: float = setting(
        default=0.3,
        unit="mm",
        minimum=0.01,
        description="standard deviation of where the skin is",
        source="estimate: how well a section fits a face",
    )

    def __post_init__(self) -> None:
        for lip in ("lower", "upper"):
            if getattr(self, f"{lip}_place_mm") is not None and (
                getattr(self, f"{lip}_time_s") is None
            ):
                raise SettingError(
                    f"first_contact.{lip}_place_mm has no {lip}_time_s: say when it was touched"
                )


@dataclass(frozen=True)
class Muscle:
    """A pseudo-muscle: a load that draws one lip out of the neck's way, until it is relaxed.

    It acts on a stretch of the lip's skin, given by its arc length from the lip's margin: positive
    towards the face, negative into the mouth.
    """

    tense_from_s: tuple[float, ...] = setting(
        unit="s", minimum=0.0, description="when it begins to pull, each time, in the recording"
    )
    tense_to_s: tuple[float, ...] = setting(
        unit="s", minimum=0.0, description="when it pulls in full"
    )
    relax_from_s: tuple[float, ...] = setting(
        unit="s", minimum=0.0, description="when it begins to let go"
    )
    relax_to_s: tuple[float, ...] = setting(unit="s", minimum=0.0, description="when it has let go")
    lip: str = setting(
        default="upper", choices=("upper", "lower"), description="the lip that is drawn"
    )
    from_mm: float = setting(
        default=-4.0, unit="mm", description="where the loaded stretch begins, from the margin"
    )
    to_mm: float = setting(default=8.0, unit="mm", description="where it ends")
    fade_mm: float = setting(
        default=2.0, unit="mm", minimum=0.1, description="over which the load fades at its ends"
    )
    traction_kpa: float | Literal["auto"] = setting(
        default="auto",
        unit="kPa",
        minimum=0.0,
        maximum=50.0,
        description="force per undeformed area; auto: the smallest that clears the neck",
    )
    direction_deg: float | Literal["auto"] = setting(
        default="auto",
        unit="deg",
        minimum=-180.0,
        maximum=180.0,
        description="of the pull, from forward (0) to upward (90); auto: where least is needed",
    )
    clearance_mm: float = setting(
        default=0.5,
        unit="mm",
        minimum=0.0,
        maximum=5.0,
        description="between the drawn lip and the neck, for auto",
    )

    def __post_init__(self) -> None:
        names = ("tense_from_s", "tense_to_s", "relax_from_s", "relax_to_s")
        counts = [len(getattr(self, name)) for name in names]
        if len(set(counts)) > 1 or 0 in counts:
            raise SettingError(
                f"muscle.{', '.join(names)} hold {counts} times: give one in each for every pull"
            )
        if any(b <= a for a, b in itertools.pairwise(self.instants_s)):
            raise SettingError(
                f"muscle.{', '.join(names)} give the instants "
                f"{', '.join(f'{time:g}' for time in self.instants_s)} s: each must be later than "
                "the one before"
            )
        if self.to_mm - self.from_mm < 2 * self.fade_mm:
            raise SettingError(
                f"muscle.fade_mm = {self.fade_mm:g} does not fit twice between from_mm = "
                f"{self.from_mm:g} and to_mm = {self.to_mm:g}"
            )

    @property
    def instants_s(self) -> tuple[float, ...]:
        """Instants in order, s: begins to pull, pulls in full, begins to let go, has let go, ..."""
        pulls = zip(
            self.tense_from_s, self.tense_to_s, self.relax_from_s, self.relax_to_s, strict=True
        )
        return tuple(itertools.chain.from_iterable(pulls))


@dataclass(frozen=True)
class Solver:
    """How the section is idealised and how finely it is divided."""

    plane: str = setting(
        default="stress",
        choices=("stress", "strain"),
        description="plane stress or plane strain",
        source="thesis, section 4.2",
    )
    resolution: str = setting(
        default="standard",
        choices=("coarse", "standard", "fine", "thesis"),
        description="element size; thesis has about 20,000 elements in the head",
    )
    thickness_mm: float = setting(
        default=1.0,
        unit="mm",
        minimum=1e-3,
        maximum=1e3,
        description="thickness of the section; forces are proportional to it",
        source="Abaqus default",
    )


@dataclass(frozen=True)
class Scenario:
    """Everything a replay depends on, checked.

    File names are absolute. At least one of ``recording`` and ``motion`` is given; the motion wins,
    and the recording then only supplies pictures. With a ``head_outline`` (SVG or DXF;
    :mod:`geometry2d.drawings.drawn_head` says what it holds) only `DRAWN_HEAD_KEYS` of ``head`` are
    used.
    """

    name: str
    description: str
    recording: Recording | None
    motion: MotionFile | None
    head: HeadMeasurements
    package: Package
    skin: Skin
    contact: Contact
    placement: Placement
    first_contact: FirstContact
    muscle: Muscle | None
    solver: Solver
    head_outline: str | None = None

    def head_section(self) -> HeadSection:
        """Return the head, cut through its middle.

        Raises
        ------
        geometry2d.drawings.chains.DrawingError, geometry2d.anatomy.head.HeadError
            If the drawing or the measurements do not describe a head.
        """
        if self.head_outline is None:
            return head_section(self.head)
        return drawn_head(
            Path(self.head_outline),
            dermis_mm=self.head.dermis_thickness_mm,
            tie_fade_mm=self.head.tie_fade_mm,
        )

    def with_motion(self, file: Path) -> Scenario:
        """Return this scenario driven by the given ``motion.csv``."""
        return replace(self, motion=MotionFile(str(file.resolve())))


def library_names() -> list[str]:
    """Return the names of the built-in scenarios, sorted."""
    return sorted(path.parent.name for path in LIBRARY.glob("*/scenario.toml"))


def read_scenario(name_or_file: str, overrides: Sequence[str] = ()) -> Scenario:
    """Return the scenario of a built-in name or of a TOML file, with ``table.key=value`` laid over.

    Raises :class:`ScenarioError` if there is no such scenario or the file is not TOML, and
    :class:`scenarios.settings.tables.SettingError` if a setting is unknown, missing or out of
    range.
    """
    file = _scenario_file(name_or_file)
    try:
        document = tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{file} is not valid TOML: {error}") from error
    for text in overrides:
        _lay_over(document, text)
    return scenario_from(document, folder=file.resolve().parent)


def scenario_from(document: Mapping[str, Value], *, folder: Path) -> Scenario:
    """Return the checked scenario of a parsed document; relative files lie in ``folder``."""
    known = ("name", "description", *_TABLES)
    for key in document:
        if key not in known:
            raise SettingError(f"unknown table or key {key!r}: {nearest(key, known)}")
    tables: dict[str, Mapping[str, Value]] = {}
    for key in _TABLES:
        table = document.get(key, {})
        if not isinstance(table, Mapping):
            raise SettingError(f"{key} = {table!r}: write it as a table, [{key}]")
        tables[key] = table
    scenario = Scenario(
        name=_text(document, "name"),
        description=_text(document, "description", default=""),
        recording=_recording(tables["recording"], folder) if tables["recording"] else None,
        motion=_motion(tables["motion"], folder) if tables["motion"] else None,
        head=_head(tables["head"]),
        head_outline=_outline(tables["head"], folder, "head"),
        package=_package(tables["package"], folder),
        skin=table_from(Skin, tables["skin"], where="skin"),
        contact=table_from(Contact, tables["contact"], where="contact"),
        placement=table_from(Placement, tables["placement"], where="placement"),
        first_contact=table_from(FirstContact, tables["first_contact"], where="first_contact"),
        muscle=table_from(Muscle, tables["muscle"], where="muscle") if tables["muscle"] else None,
        solver=table_from(Solver, tables["solver"], where="solver"),
    )
    if scenario.recording is None and scenario.motion is None:
        raise ScenarioError(
            f"scenario {scenario.name!r} has neither a [recording] nor a [motion]: "
            'give one, e.g. [motion] file = "motion.csv"'
        )
    return scenario


def resolved_toml(scenario: Scenario) -> str:
    """Return the scenario as TOML with every value written out: enough to repeat the run."""
    lines = [f"name = {toml_value(scenario.name)}"]
    if scenario.description:
        lines.append(f"description = {toml_value(scenario.description)}")
    for name, table_lines in resolved_tables(scenario):
        lines += ["", f"[{name}]", *table_lines]
    return "\n".join(lines) + "\n"


def resolved_tables(scenario: Scenario) -> Iterator[tuple[str, list[str]]]:
    """Yield every table's name with its lines of key, value, unit, meaning and source."""
    for name in _TABLES:
        table = getattr(scenario, name)
        if isinstance(table, Package):
            neck = f"neck = {toml_value(table.neck)}"
            lines = [f"{neck:<38} # library neck it started from"]
            if table.outline is not None:
                lines.append(f"outline = {toml_value(table.outline)} # drawing of the neck")
            yield name, [*lines, *toml_lines(table.measurements)]
        elif name == "head" and scenario.head_outline is not None:
            outline = f"outline = {toml_value(scenario.head_outline)} # drawing of the head"
            lines = [line for line in toml_lines(table) if line.split(" ")[0] in DRAWN_HEAD_KEYS]
            yield name, [outline, *lines]
        elif table is not None:
            yield name, toml_lines(table)


_TABLES = (
    "recording",
    "motion",
    "head",
    "package",
    "skin",
    "contact",
    "placement",
    "first_contact",
    "muscle",
    "solver",
)


def _scenario_file(name_or_file: str) -> Path:
    built_in = LIBRARY / name_or_file / "scenario.toml"
    if name_or_file in library_names():
        return built_in
    path = Path(name_or_file)
    if path.is_file():
        return path
    if path.suffix == ".toml" or len(path.parts) > 1:
        raise ScenarioError(f"no scenario file {name_or_file}: check the path")
    raise ScenarioError(
        f"no scenario {name_or_file!r}: {nearest(name_or_file, library_names())} "
        "(or give the path of a scenario file)"
    )


def _lay_over(document: dict[str, Value], text: str) -> None:
    (*tables, key), value = split_override(text)
    if len(tables) > 1:
        raise SettingError(f"--set {text!r} has too many dots: settings are table.key=value")
    place = document
    for name in tables:
        inner = place.setdefault(name, {})
        if not isinstance(inner, dict):
            raise SettingError(f"--set {text!r}: {name!r} is not a table")
        place = inner
    place[key] = value


def _text(document: Mapping[str, Value], key: str, default: str | None = None) -> str:
    value = document.get(key, default)
    if not isinstance(value, str) or (default is None and not value):
        raise SettingError(f'{key} = {value!r}: give a text, e.g. {key} = "A38-F"')
    return value


def _recording(values: Mapping[str, Value], folder: Path) -> Recording:
    table = table_from(Recording, values, where="recording")
    if table.start_s is not None and table.end_s is not None and table.start_s >= table.end_s:
        raise ScenarioError(
            f"recording.start_s = {table.start_s:g} s is not before end_s = {table.end_s:g} s"
        )
    return replace(table, video=str(folder / table.video), markers=str(folder / table.markers))


def _motion(values: Mapping[str, Value], folder: Path) -> MotionFile:
    table = table_from(MotionFile, values, where="motion")
    return replace(table, file=str(folder / table.file))


def _package(values: Mapping[str, Value], folder: Path) -> Package:
    neck = values.get("neck", "A38")
    if neck not in NECKS:
        raise SettingError(f"package.neck = {neck!r} is not known: {nearest(str(neck), NECKS)}")
    measured = {key: value for key, value in values.items() if key not in ("neck", "outline")}
    base = NECKS[str(neck)]
    return Package(
        str(neck),
        table_from(NeckMeasurements, measured, where="package", base=base),
        _outline(values, folder, "package"),
    )


def _head(values: Mapping[str, Value]) -> HeadMeasurements:
    measured = {key: value for key, value in values.items() if key != "outline"}
    if "outline" in values:
        for key in measured:
            if key not in DRAWN_HEAD_KEYS and key in HeadMeasurements.__dataclass_fields__:
                raise SettingError(
                    f"head.{key} says nothing beside head.outline, as the drawing says it: give "
                    f"one of them (with a drawing there are only {' and '.join(DRAWN_HEAD_KEYS)})"
                )
    return table_from(HeadMeasurements, measured, where="head")


def _outline(values: Mapping[str, Value], folder: Path, table: str) -> str | None:
    outline = values.get("outline")
    if outline is not None and not (isinstance(outline, str) and outline):
        example = {"package": "neck.svg", "head": "head.svg"}[table]
        raise SettingError(f'{table}.outline = {outline!r}: give a drawing, e.g. "{example}"')
    return None if outline is None else str(folder / outline)
