"""A drinking scenario: what is filmed, who drinks from what, and how it is solved.

A scenario is read from TOML or made in memory, checked once, and never changes afterwards. Each
table is a frozen dataclass whose fields carry unit, range, meaning and source; how such tables are
read is in :mod:`scenarios.settings.tables`, how they are laid over one another in
:mod:`scenarios.settings.layers`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, is_dataclass, replace
from pathlib import Path, PurePath
from typing import Any, Protocol

from geometry2d.foundation.errors import DrinksimError, naming
from geometry2d.foundation.progress import ProgressOption
from geometry2d.foundation.provided import Provided
from geometry2d.foundation.settings import setting
from geometry2d.foundation.text import quoted
from geometry2d.foundation.toml import shown
from mocap.motion.motion import Motion
from scenarios.settings.effect import ineffective_keys
from scenarios.settings.files import (
    LIBRARY,
    SCENARIO_FILE,
    ScenarioError,
    document_from,
    file_layers,
    library_names,
    settings_layer,
)
from scenarios.settings.hand import HandSettings
from scenarios.settings.layers import (
    Given,
    SettingsLayer,
    Shape,
    document_of,
    laid_over,
    nested,
    values_by_path,
)
from scenarios.settings.liquid import Liquid
from scenarios.settings.motion import FirstContact, MotionFile, Placement, Recording
from scenarios.settings.muscles import Muscles
from scenarios.settings.names import nearest
from scenarios.settings.numerics import Numerics
from scenarios.settings.package import Friction, Package
from scenarios.settings.person import Head, Muscle, Skin
from scenarios.settings.tables import SettingError, check, keys_of, table_from
from scenarios.settings.writing import toml_lines

__all__ = [
    "LIBRARY",
    "FirstContact",
    "Friction",
    "Head",
    "Liquid",
    "MotionFile",
    "Muscle",
    "Muscles",
    "Numerics",
    "Package",
    "Placement",
    "Recording",
    "Scenario",
    "ScenarioError",
    "Skin",
    "library_names",
    "load_scenario",
    "resolved_toml",
    "scenario_from",
]


@dataclass(frozen=True, repr=False)
class Scenario:
    """Everything a replay depends on, checked.

    File names are absolute. At least one of ``recording`` and ``motion`` is given; the motion wins,
    and the recording then only supplies pictures. A motion may be a value instead of a file.
    """

    name: str = setting(example="A38-F", description="what it is called")
    description: str = setting(default="", description="what happens in it")
    recording: Recording | None = setting(
        default=None, description="the video of the sip and its markers"
    )
    motion: MotionFile | Motion | None = setting(
        default=None, description="a motion to replay in place of the recording's"
    )
    head: Head = setting(default=Head(), description="the head section")
    package: Package = setting(default=Package(), description="the package's neck")
    filmed: Package | None = setting(
        default=None,
        description="the neck that was filmed, where another one takes its place; if absent, the "
        "package's own",
    )
    skin: Skin = setting(default=Skin(), description="the soft tissue")
    contact: Friction = setting(default=Friction(), description="friction")
    hand: HandSettings = setting(default=HandSettings(), description="how the package is carried")
    placement: Placement = setting(
        default=Placement(), description="shifts of package and lower face"
    )
    first_contact: FirstContact = setting(
        default=FirstContact(), description="what was seen of the first contacts"
    )
    muscle: Muscle | None = setting(
        default=None, description="a pseudo-muscle that pulls a lip out of the neck's way"
    )
    muscles: Muscles | None = setting(
        default=None, description="the muscles of the lips, if they act"
    )
    liquid: Liquid | None = setting(
        default=None, description="the content of the package, if its pressure acts"
    )
    numerics: Numerics = setting(
        default=Numerics(), description="idealisation, mesh, laws and solver"
    )

    def __post_init__(self) -> None:
        check(self)
        if self.recording is None and self.motion is None:
            raise ScenarioError(
                f"scenario {quoted(self.name)} has neither a [recording] nor a [motion]: "
                'give one, e.g. [motion] file = "motion.csv"'
            )
        automatic = [
            key.field.name
            for key in keys_of(Placement)
            if getattr(self.placement, key.field.name) == "auto"
        ]
        if automatic and not self.first_contact.observed:
            raise SettingError(
                f'placement.{automatic[0]} = "auto" needs something observed: give '
                "first_contact.lower_time_s and upper_time_s, and the places where you saw them"
            )

        sealing = () if self.muscles is None else self.muscles.sealing
        if sealing and self.liquid is None:
            raise SettingError(
                f'muscles.{sealing[0]} = "auto" is the least that holds the liquid back: give '
                "[liquid] volume_ml too"
            )
        if self.head.jaw_turns and self.contact.teeth_friction != 0:
            raise SettingError(
                f"contact.teeth_friction = {self.contact.teeth_friction:g} and head.jaw contradict "
                "one another: teeth that turn with the jaw touch the lips without friction"
            )
        named = self.hand.reference_scenario
        if named is not None and named not in library_names():
            raise ScenarioError(
                f"hand.reference_scenario = {quoted(named)}: {nearest(named, library_names())}"
            )
        if self.hand.share_of_weight is not None and self.weight_n is None:
            missing = "[liquid] volume_ml" if self.liquid is None else "package.mass_g"
            raise SettingError(
                f"hand.share_of_weight = {shown(self.hand.share_of_weight)} is a share of an "
                f"unknown weight: give {missing} too"
            )

    def __repr__(self) -> str:
        moved = self.motion
        if moved is None:
            source = "" if self.recording is None else Path(self.recording.video).name
        else:
            source = repr(moved) if isinstance(moved, Motion) else Path(moved.file).name
        outline = self.package.outline
        neck = self.package.neck if outline is None else Path(outline).name
        settings = f"neck {neck}, {self.skin.configuration}, {self.numerics.resolution}"
        return f"<Scenario {self.name}: {source}, {settings}>"

    def with_(self, **changes: object) -> Scenario:
        """Return this scenario with some settings changed, checked like a file.

        Parameters
        ----------
        changes
            By table: a mapping of keys to values, a whole table (which replaces this one), or None
            for its defaults (or none, where it may be absent). By key joined with its tables by
            dots: a value. ``motion`` may be the path of a file, or a motion; it is of the package
            that the result has, while :meth:`with_motion` takes one of the scenario's own film.
            Relative paths start from the current directory.

        Examples
        --------
        >>> slippery = load_scenario("A38-F").with_(contact={"friction": 0.5})
        >>> slippery.contact.friction
        0.5
        """
        motion = changes.get("motion", self.motion)
        if isinstance(motion, Motion):
            if "motion" in changes:
                changes["motion"] = IN_MEMORY
            return replace(replace(self, motion=IN_MEMORY).with_(**changes), motion=motion)
        if isinstance(motion, str | PurePath):
            changes["motion"] = {"file": motion}
        resets = {name: None for name, value in changes.items() if is_dataclass(value)}
        plain = [
            (path, document_of(value) if is_dataclass(value) else value)
            for path, value in changes.items()
        ]
        here = Path.cwd()
        return scenario_from(
            [
                SettingsLayer(document_of(self), here),
                SettingsLayer(resets, here),
                SettingsLayer(document_from(plain), here),
            ]
        )

    def solve(
        self,
        *,
        out: Path | str | None = None,
        resume: bool = False,
        overwrite: bool = False,
        progress: ProgressOption = None,
    ) -> Any:
        """Replay the scenario and return its :class:`scenarios.results.solution.Solution`.

        Nothing is written unless ``out`` names a run directory; options and errors are those of
        :func:`scenarios.sip.run.solve`, which is provided by :mod:`drinksim.values`.
        """
        return SOLVER.function(self, out=out, resume=resume, overwrite=overwrite, progress=progress)

    def known_motion(self) -> Motion:
        """Return the motion, read from its file if it is not in memory, to the file's decimals.

        Raises
        ------
        ScenarioError
            If there is none: the recording is to be converted first.
        MotionError
            If there is no such file, or it is broken.
        """
        if self.motion is None:
            raise ScenarioError(
                f"scenario {self.name!r} has no motion yet: convert its recording first"
            )
        if isinstance(self.motion, Motion):
            return self.motion.rounded()
        return Motion.read(self.motion.file)

    def with_motion(self, motion: Motion | Path) -> Scenario:
        """Return this scenario driven by a motion, or a ``motion.csv``, of its own recording."""
        own = motion if isinstance(motion, Motion) else motion.resolve()
        return self.with_(motion=own, filmed=self.filmed)

    @property
    def weight_n(self) -> float | None:
        """Weight of package and content, N; None where one of them is unknown."""
        if self.liquid is None or self.package.mass_g is None:
            return None
        content_kg = 1e-6 * self.liquid.volume_ml * self.liquid.density_kg_per_m3
        return STANDARD_GRAVITY * (content_kg + 1e-3 * self.package.mass_g)

    @property
    def filmed_package(self) -> Package:
        """The package that the motion is of."""
        return self.package if self.filmed is None else self.filmed


STANDARD_GRAVITY = 9.80665
"""m/s²."""


class Solver(Protocol):
    """What replays a scenario: :func:`scenarios.sip.run.solve`."""

    def __call__(
        self,
        scenario: Scenario,
        *,
        out: Path | str | None = None,
        resume: bool = False,
        overwrite: bool = False,
        progress: ProgressOption = None,
    ) -> Any:
        """Return the scenario's solution."""


SOLVER: Provided[Solver] = Provided("Scenario.solve")

IN_MEMORY = MotionFile("motion.csv")
"""What stands for a motion in memory while settings are laid over one another."""

SHAPE = Shape.of(Scenario)

RUN_MOTION = "motion"
"""Folder of a run directory that keeps its motion."""

FILM = ("recording.", "motion.")
"""Beginnings of the paths of keys that say what was filmed."""


def load_scenario(name_or_file: str | Path, settings: Sequence[str] = ()) -> Scenario:
    """Return the scenario of a built-in name or of a TOML file, some settings changed.

    Parameters
    ----------
    name_or_file
        A name of the library, or the path of a file. Relative paths in a file start from the
        file's folder.
    settings
        Texts ``table.key=value``, as of ``--set``. Relative paths in them start from the current
        directory.

    Raises
    ------
    ScenarioError
        If there is no such scenario, the file is not TOML, or the scenario contradicts itself.
    scenarios.settings.tables.SettingError
        If a setting is unknown, missing, out of range or without effect.
    """
    here = Path.cwd()
    layers = [*file_layers(str(name_or_file), here), settings_layer(settings, here)]
    file = next((layer.name for layer in reversed(layers) if layer.name), "")
    # A setting given beside the file may be the culprit.
    with nullcontext() if settings or not file else naming(file):
        return scenario_from(layers)


def scenario_from(layers: Sequence[SettingsLayer]) -> Scenario:
    """Return the checked scenario of layers of settings; errors as of :func:`load_scenario`."""
    given = _with_filmed(layers, laid_over(SHAPE, layers))
    scenario = table_from(Scenario, nested(given), where="")
    dropped = _without_effect(scenario, given)
    if not dropped:
        return scenario
    kept = {path: each for path, each in given.items() if path not in dropped}
    return table_from(Scenario, nested(kept), where="")


def _with_filmed(layers: Sequence[SettingsLayer], given: Mapping[str, Given]) -> dict[str, Given]:
    """Return what is given with the filmed neck, where a later layer has put another in its place.

    The layer that names the film, or its motion, means the neck that was filmed, unless it says
    otherwise itself. A motion that lies in a run directory is of the neck of that run.
    """
    motion = given.get("motion.file")
    run = None if motion is None else _package_of_run(Path(str(motion.value)), layers[motion.layer])
    film = _layer_of_film(layers, given) if run is None or motion is None else motion.layer
    stated = {path: each for path, each in given.items() if path.split(".")[0] == "filmed"}
    if any(each.layer >= film for each in stated.values()):
        return dict(given)
    kept = {path: each for path, each in given.items() if path not in stated}
    now = table_from(Package, nested(given).get("package", {}), where="package")
    then = run
    if then is None:
        document = nested(laid_over(SHAPE, layers[: film + 1])).get("package", {})
        then = table_from(Package, document, where="package")
    if _same_neck(then, now):
        return kept
    return kept | {f"filmed.{path}": Given(v, film) for path, v in values_by_path(then).items()}


def _layer_of_film(layers: Sequence[SettingsLayer], given: Mapping[str, Given]) -> int:
    """Return the number of the last layer that says which sip was filmed."""
    films = {each.layer for path, each in given.items() if path.startswith(FILM)}
    own = [number for number, layer in enumerate(layers) if not layer.same_sip]
    return max((number for number in own if number in films), default=max(own, default=0))


def _package_of_run(motion: Path, layer: SettingsLayer) -> Package | None:
    """Return the filmed package of the run directory that a layer's motion lies in, if known.

    None too if the layer is that run's own scenario.
    """
    run = motion.parent.parent
    file = run / SCENARIO_FILE
    if motion.parent.name != RUN_MOTION or not file.is_file() or layer.folder == run:
        return None
    try:
        return load_scenario(file).filmed_package
    except DrinksimError:
        # Another version's run: its motion can be used, its settings are not known.
        return None


def _same_neck(one: Package, other: Package) -> bool:
    """Whether two packages have the same neck: measured alike, or drawn in equal files."""
    drawings = [package.outline for package in (one, other)]
    if None in drawings:
        return replace(one, mass_g=None) == replace(other, mass_g=None)
    drawn = [Path(str(drawing)) for drawing in drawings]
    if drawn[0] != drawn[1] and not all(file.is_file() for file in drawn):
        return False
    return drawn[0] == drawn[1] or drawn[0].read_bytes() == drawn[1].read_bytes()


def resolved_toml(scenario: Scenario) -> str:
    """Return the scenario as a TOML file with every value written out: enough to repeat a run."""
    return "\n".join(toml_lines(scenario)) + "\n"


def _without_effect(scenario: Scenario, given: Mapping[str, Given]) -> set[str]:
    """Return the paths of given values that other keys of later layers make ineffective.

    Raises
    ------
    SettingError
        If such a value, other than the default, is given in the same or a later layer.
    """
    dropped = set()
    for ineffective in ineffective_keys(
        motion=scenario.motion,
        placement=scenario.placement,
        first_contact=scenario.first_contact,
        hand=scenario.hand,
        muscle=scenario.muscle,
        muscles=scenario.muscles,
        head=scenario.head,
        numerics=scenario.numerics,
    ):
        decided = max((given[p].layer for p in ineffective.because if p in given), default=-1)
        for path in ineffective.keys:
            if path not in given or given[path].value in (None, SHAPE.keys[path].field.default):
                continue
            if given[path].layer >= decided:
                value = given[path].value
                raise SettingError(f"{path} = {shown(value)} has no effect, {ineffective.reason}")
            dropped.add(path)
    return dropped
