"""Tables of the person who drinks: the head section, its soft tissue, and what pulls a lip."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Literal

import numpy as np

from fem2d.loads.amplitude import Amplitude
from fem2d.materials.prony import PronySeries
from geometry2d.anatomy.anthropometry import HeadMeasurements
from geometry2d.anatomy.head import HeadSection, head_section
from geometry2d.drawings.drawn_head import drawn_head
from geometry2d.foundation.settings import setting
from mocap.motion.jaw import JawOpening
from scenarios.settings.culprit import built
from scenarios.settings.tables import SettingError

DRAWN_HEAD_KEYS = ("dermis_thickness_mm", "tie_fade_mm")
"""Measurements that a drawing of the head leaves open."""

OPENING_DEG = (0.0, 25.0)
"""How far a jaw opens by turning alone, at least and at most."""

JAW_INTERVAL_S = 0.25
"""Over which a filmed jaw's openings are averaged, s: longer than noise, shorter than a gulp."""


@dataclass(frozen=True)
class Jaw:
    """How far the jaw is open against time; it turns about its hinge with lower tooth and lip.

    Between two instants it turns smoothly; before the first and after the last it rests.
    """

    time_s: tuple[float, ...] = setting(
        unit="s", minimum=0.0, description="instants of the openings, in the recording"
    )
    opening_deg: tuple[float, ...] = setting(
        unit="deg",
        minimum=OPENING_DEG[0],
        maximum=OPENING_DEG[1],
        description="opening of the jaw at each instant",
    )

    def __post_init__(self) -> None:
        if len(self.time_s) != len(self.opening_deg) or not self.time_s:
            raise SettingError(
                f"opening_deg holds {len(self.opening_deg)} openings and time_s "
                f"{len(self.time_s)} instants: give one opening for each instant"
            )
        if any(b <= a for a, b in itertools.pairwise(self.time_s)):
            raise SettingError(
                f"time_s = {list(self.time_s)} s: each instant must be later than the one before"
            )

    @property
    def turns(self) -> bool:
        """Whether it ever does."""
        return any(opening != self.opening_deg[0] for opening in self.opening_deg)

    @property
    def amplitude(self) -> Amplitude:
        """Its opening, degrees, against time."""
        return Amplitude(self.time_s, self.opening_deg)


@dataclass(frozen=True)
class Head:
    """The head: measurements of an adult man unless they are changed, or the user's own drawing.

    :mod:`geometry2d.drawings.drawn_head` says what a drawing holds.
    """

    outline: str | None = setting(
        default=None,
        file=True,
        example="head.svg",
        replaces=tuple(
            field.name for field in fields(HeadMeasurements) if field.name not in DRAWN_HEAD_KEYS
        ),
        description="drawing of the head, SVG or DXF, in place of its measurements",
    )
    measurements: HeadMeasurements = setting(
        default=HeadMeasurements(), inline=True, description="measurements of the head"
    )
    jaw: Jaw | None = setting(
        default=None,
        tables="jaw_opening_deg",
        description="a jaw that turns, in place of a number for jaw_opening_deg; "
        "[head.jaw_opening_deg] means the same",
    )
    jaw_file: str | None = setting(
        default=None,
        file=True,
        example="jaw.csv",
        description="how the jaw turns, from its marks in a film, as convert writes it: means over "
        "0.25 s on jaw_opening_deg, which is its opening in the first frame",
    )

    def __post_init__(self) -> None:
        if self.jaw is not None and self.jaw_file is not None:
            raise SettingError(
                f"head.jaw and head.jaw_file = {self.jaw_file} contradict each other: both say how "
                "the jaw turns; give one of them"
            )
        given = "head.jaw" if self.jaw is not None else "head.jaw_file"
        if self.jaw_turns and self.outline is not None:
            raise SettingError(
                f"{given} needs the hinge of the jaw, which head.outline does not draw: use the "
                "measurements of a head, or leave the jaw where it is drawn"
            )

    @property
    def jaw_turns(self) -> bool:
        """Whether the jaw is said to turn, by a table or a file."""
        return self.jaw is not None or self.jaw_file is not None

    def jaw_course(self) -> Jaw | None:
        """Return how the jaw turns, from its table or its file; None if neither is given.

        Raises
        ------
        MotionError
            If the file is not what ``convert`` writes.
        SettingError
            If it opens the jaw farther than a jaw opens, or closes it beyond its teeth.
        """
        if self.jaw_file is None:
            return self.jaw
        times, opened = JawOpening.read(Path(self.jaw_file)).means(JAW_INTERVAL_S)
        opening = self.measurements.jaw_opening_deg + np.degrees(opened)
        low, high = OPENING_DEG
        worst = int(np.argmax(np.maximum(opening - high, low - opening)))
        if not low <= opening[worst] <= high:
            raise SettingError(
                f"head.jaw_file = {Path(self.jaw_file).name}: on head.jaw_opening_deg = "
                f"{self.measurements.jaw_opening_deg:g}° its opening is {opening[worst]:.1f}° at "
                f"{times[worst]:.2f} s, and a jaw opens by {low:g} to {high:g}°: give the opening "
                "of its first frame"
            )
        return Jaw(tuple(times.tolist()), tuple(opening.tolist()))

    def section(self) -> HeadSection:
        """Return the head, cut through its middle.

        Raises
        ------
        SettingError
            If the measurements do not describe a head: it names one of them.
        geometry2d.drawings.chains.DrawingError
            If the drawing does not.
        """
        measured = self.measurements
        if self.jaw is not None:
            measured = replace(measured, jaw_opening_deg=self.jaw.opening_deg[0])
        if self.outline is None:
            return built(head_section, measured, HeadMeasurements(), where="head")
        return drawn_head(
            Path(self.outline),
            dermis_mm=measured.dermis_thickness_mm,
            tie_fade_mm=measured.tie_fade_mm,
        )


@dataclass(frozen=True)
class Skin:
    """What the soft tissue is made of."""

    configuration: Literal["L1", "L2-GOH", "L2-Ogden"] = setting(
        default="L2-Ogden",
        description="materials of dermis and bulk",
        source="thesis, Table 3.5",
    )
    file: str | None = setting(
        default=None,
        file=True,
        example="skin.toml",
        replaces=("configuration",),
        description="file with the materials of dermis and bulk, in place of a configuration",
    )
    dermis_stiffness: float = setting(
        default=1.0,
        minimum=0.01,
        maximum=100.0,
        description="factor on every stress of the dermis",
    )
    tension_kpa: float = setting(
        default=0.0,
        unit="kPa",
        minimum=0.0,
        maximum=60.0,
        description="tension along the skin in the shape as drawn, mean over the dermis; "
        "7 was estimated at the lip, 53 in the cheek",
        source="Flynn et al. 2018, 10.1007/978-3-319-59764-5_6",
    )
    overstress: tuple[float, ...] = setting(
        default=(),
        above=0.0,
        maximum=100.0,
        description="viscosity, branch by branch: what a sudden stretch adds to the lasting "
        "stress, over that stress; empty: elastic",
    )
    relaxation_s: tuple[float, ...] = setting(
        default=(),
        unit="s",
        above=0.0,
        maximum=1e4,
        description="relaxation time of each branch of viscosity",
    )

    def __post_init__(self) -> None:
        if len(self.overstress) != len(self.relaxation_s):
            raise SettingError(
                f"skin.overstress holds {len(self.overstress)} branches and skin.relaxation_s "
                f"{len(self.relaxation_s)}: give one time for each overstress"
            )

    @property
    def prony(self) -> PronySeries | None:
        """How stresses relax; None for elastic tissue."""
        return PronySeries(self.overstress, self.relaxation_s) if self.overstress else None


@dataclass(frozen=True)
class Muscle:
    """A pseudo-muscle: a load that pulls one lip out of the neck's way, until it is relaxed.

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
    lip: Literal["upper", "lower"] = setting(default="upper", description="the lip that is pulled")
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
        description="between the lip and the neck while the muscle holds, for auto",
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
