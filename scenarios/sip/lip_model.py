"""The lips of a scenario as a mechanical model: tissue, ties, contacts and what pulls on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.body.body import Body
from fem2d.body.surface import Surface
from fem2d.contact.rigid import RigidContact
from fem2d.contact.self_contact import SelfContact
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.dead import DeadLoad
from fem2d.loads.driven import DrivenAnchor, DrivenOutline
from fem2d.loads.liquid import LiquidLoad
from fem2d.loads.load import AppliedForce
from fem2d.loads.muscle import MuscleLoad
from fem2d.loads.tie import ElasticTie
from fem2d.materials.library import configuration_cards
from fem2d.materials.material import Material, stiffened
from fem2d.solvers.inertia import QUASI_STATIC
from fem2d.solvers.model import Model
from geometry2d.anatomy.head import HeadSection
from geometry2d.anatomy.muscles import muscle_regions
from geometry2d.curves import arc_lengths
from geometry2d.mesh import section_mesh
from geometry2d.neck import NeckSection
from geometry2d.rigid import rotated
from scenarios.placing.lip_skin import LipSkin
from scenarios.results.increment import SectionModel
from scenarios.results.quantities import JAW_HINGE, LIPS, WALLS
from scenarios.settings.scenario import Liquid, Muscle, Scenario, ScenarioError, Skin
from scenarios.sip.jaw import JawCourse
from scenarios.sip.lip_muscles import lip_muscles
from scenarios.sip.skin_tension import TenseLips, tense_lips
from scenarios.sip.tilted_liquid import TiltedLiquid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pull:
    """A pseudo-muscle whose size and direction are known.

    Attributes
    ----------
    muscle
        Where and when it pulls.
    traction_kpa, direction_deg
        Force per undeformed area where it pulls in full, and its direction in the head section.
    """

    muscle: Muscle
    traction_kpa: float
    direction_deg: float

    @property
    def amplitude(self) -> Amplitude:
        """How much of it acts, against time."""
        return Amplitude(
            self.muscle.instants_s, (0.0, 1.0, 1.0, 0.0) * len(self.muscle.tense_from_s)
        )


@dataclass(frozen=True)
class Lips:
    """The mechanical model of a scenario, in the frame of the head section, and its parts' names.

    Attributes
    ----------
    scenario
        What it is made from.
    head, neck
        Their sections, each in its own frame.
    pull
        What pulls a lip out of the neck's way; None if nothing does.
    activations
        How active each muscle is against time (`scenarios.sip.lip_muscles.PARTS`).
    liquid
        The pressure of the content at each instant; None if it is neglected.
    jaw
        Where the lower jaw is at each instant; None if it stays where it is.
    present
        Which lips are modelled.
    """

    scenario: Scenario
    head: HeadSection
    neck: NeckSection
    pull: Pull | None = None
    activations: Mapping[str, Amplitude] = field(default_factory=dict)
    liquid: TiltedLiquid | None = None
    jaw: JawCourse | None = None
    present: tuple[str, ...] = LIPS

    def with_(self, **changes: Any) -> Lips:
        """Return the model with some of its attributes changed.

        What is not changed is not meshed anew.
        """
        changed = replace(self, **changes)
        if not changes.keys() & {"scenario", "head", "present"}:
            for name in ("tense", "_free_body"):
                if name in self.__dict__:
                    changed.__dict__[name] = self.__dict__[name]
        return changed

    @property
    def body(self) -> Body:
        """The lips, meshed; under stress as they are drawn if the skin has a tension."""
        return self._free_body if self.tense is None else self.tense.body

    @cached_property
    def tense(self) -> TenseLips | None:
        """What the tension of the skin does to the lips; None without one."""
        tension_kpa = self.scenario.skin.tension_kpa
        if not tension_kpa:
            return None
        return tense_lips(self._free_body, self.head, self.present, 1e-3 * tension_kpa)

    @cached_property
    def _free_body(self) -> Body:
        """The lips, meshed, free of stress."""
        numerics = self.scenario.numerics
        sections = tuple(getattr(self.head, lip) for lip in self.present)
        mesh = section_mesh(sections, numerics.mesh)
        return Body(
            mesh,
            _materials(self.scenario.skin, self.present),
            plane=numerics.plane,
            thickness_mm=numerics.thickness_mm,
        )

    def surface(self, name: str) -> Surface:
        """Return a named stretch of boundary with its integration points."""
        return self.body.surface(name)

    def free_edges(self, lip: str) -> NDArray[np.intp]:
        """Return the edges (m, 3) of a lip that may touch: its skin and, behind it, its inner side.

        In order along the boundary, the tissue on the left.
        """
        skin, inner = (self.body.edges(f"{lip}_{part}") for part in ("skin", "inner"))
        inner_first = inner[-1, 1] == skin[0, 0]
        return np.concatenate([inner, skin] if inner_first else [skin, inner])

    def free_surface(self, lip: str, *, at_nodes: bool = True, between_nodes: int = 0) -> Surface:
        """Return the surface of a lip that may touch, by default with its nodes as points."""
        return Surface(
            self.free_edges(lip),
            self.body.nodes,
            self.scenario.numerics.thickness_mm,
            at_nodes=at_nodes,
            between_nodes=between_nodes,
        )

    @cached_property
    def fem_model(self) -> Model:
        """Lips, ties, and what they touch."""
        contact, numerics = self.scenario.contact, self.scenario.numerics
        normal = numerics.penalty
        on_neck, on_lip = (
            replace(numerics.stick, coefficient=coefficient)
            for coefficient in (contact.friction, contact.lip_friction)
        )
        on_walls = [
            RigidContact(
                surface,
                getattr(self.neck, wall),
                normal=normal,
                search=numerics.search,
                friction=on_neck,
                name=f"{lip} lip on {wall}",
            )
            for lip, surface in self._touched.items()
            for wall in WALLS
        ]
        on_teeth = [
            self._on_tooth(lip, moving=False)
            for lip in self.present
            if self.jaw is None or lip == "upper"
        ]
        lips = SelfContact(
            tuple(self.free_surface(lip, at_nodes=False) for lip in self.present),
            normal=normal,
            search=numerics.search,
            friction=on_lip,
            reach_mm=numerics.lips.self_contact_reach_mm,
            same_surface=True,
            name="lip on lip",
        )
        return Model(
            self.body,
            contacts=(*on_walls, *on_teeth, lips),
            ties=self._ties,
            inertia=numerics.inertia,
            loads=self.loads,
            prony=self.scenario.skin.prony,
        )

    @cached_property
    def _touched(self) -> dict[str, Surface]:
        """The free surface of each lip with all points at which contact is looked for."""
        between = self.scenario.numerics.lips.points_between_nodes
        return {lip: self.free_surface(lip, between_nodes=between) for lip in self.present}

    def _on_tooth(self, lip: str, *, moving: bool) -> RigidContact:
        numerics = self.scenario.numerics
        return RigidContact(
            self._touched[lip],
            getattr(self.head, f"{lip}_tooth"),
            normal=numerics.penalty,
            search=numerics.search,
            friction=replace(numerics.stick, coefficient=self.scenario.contact.teeth_friction),
            moving=moving,
            name=f"{lip} lip on {lip}_tooth",
        )

    @cached_property
    def _ties(self) -> tuple[ElasticTie, ...]:
        return tuple(
            ElasticTie(
                self.surface(f"{lip}_{part}"),
                self.scenario.numerics.lips.bone_stiffness_mpa_per_mm,
                fade_mm=self.head.tie_fade_mm if part == "bone" else 0.0,
                name=f"{lip}_{part}",
            )
            for lip in self.present
            for part in ("bone", "cut")
        )

    @property
    def quasi_static(self) -> Model:
        """The same without inertia."""
        return replace(self.fem_model, inertia=QUASI_STATIC)

    @cached_property
    def loads(self) -> tuple[AppliedForce, ...]:
        """What acts on the lips: the skin's tension at its anchors, a pull, muscles, liquid."""
        pulls = () if self.pull is None else (self.load(self.pull),)
        anchors = () if self.tense is None else (self.tense.anchors,)
        return (*anchors, *pulls, *self.muscles, *self.liquid_loads, *self.jaw_loads)

    def with_jaw_at(self, time_s: float) -> Lips:
        """Return the model with a jaw that stays where it is at a time, s."""
        return self if self.jaw is None else replace(self, jaw=self.jaw.resting(time_s))

    @cached_property
    def jaw_loads(self) -> tuple[AppliedForce, ...]:
        """What a jaw that turns does to the lower lip: its ties and the tooth go with it."""
        if self.jaw is None or "lower" not in self.present:
            return ()
        anchors = [
            DrivenAnchor(tie, self.jaw) for tie in self._ties if tie.name.startswith("lower")
        ]
        return (*anchors, DrivenOutline(self._on_tooth("lower", moving=True), self.jaw))

    @cached_property
    def liquid_loads(self) -> tuple[LiquidLoad, ...]:
        """The pressure of the liquid on the skin and the inner side that it wets."""
        settings, liquid = self.scenario.liquid, self.liquid
        if settings is None or liquid is None:
            return ()
        return tuple(self._wetted(lip, settings, liquid) for lip in self.present)

    def _wetted(self, lip: str, settings: Liquid, liquid: TiltedLiquid) -> LiquidLoad:
        surface, skin = self.free_surface(lip, at_nodes=False), LipSkin.of(self.head, lip)
        whole = float(np.sum(surface.weight)) / surface.thickness_mm
        inner = whole - float(arc_lengths(skin.points)[-1])
        outwards = skin.arc_mm(settings.wet_to_mm)
        # The upper lip's free surface starts with its inner side, the lower one's with its skin.
        upper = (-settings.wet_fade_mm, inner + outwards)
        ends = upper if lip == "upper" else (outwards, whole + settings.wet_fade_mm)
        return LiquidLoad(f"liquid on the {lip} lip", surface, *ends, settings.wet_fade_mm, liquid)

    @cached_property
    def muscles(self) -> tuple[MuscleLoad, ...]:
        """The muscles that act."""
        settings = self.scenario.muscles
        if settings is None or not self.activations:
            return ()
        return lip_muscles(
            self.body,
            muscle_regions(self.head, settings.places),
            self.activations,
            fibre=settings.fibre,
            corner_stretch=settings.corner_stretch,
        )

    def load(self, pull: Pull) -> DeadLoad:
        """Return the dead load of a pull on a lip."""
        muscle = pull.muscle
        line = LipSkin.of(self.head, muscle.lip)
        ends = sorted(line.arc_mm(place) for place in (muscle.from_mm, muscle.to_mm))
        direction = np.deg2rad(pull.direction_deg)
        size_mpa = 1e-3 * pull.traction_kpa
        return DeadLoad(
            self.surface(f"{muscle.lip}_skin"),
            from_mm=ends[0],
            to_mm=ends[1],
            fade_mm=muscle.fade_mm,
            traction_mpa=(
                size_mpa * float(np.cos(direction)),
                size_mpa * float(np.sin(direction)),
            ),
            amplitude=pull.amplitude,
            name=f"pull on the {muscle.lip} lip",
        )

    def model(self, head_angle_rad: float) -> SectionModel:
        """Return the section as the solution keeps it, turned by an angle."""
        body = self.body
        names = tuple(f"{lip}_{part}" for lip in self.present for part in ("dermis", "bulk"))
        region = np.zeros(len(body.tables.connectivity), np.int64)
        for number, name in enumerate(names):
            region[body.elements_of(name)] = number
        turned = {
            name: rotated(line, head_angle_rad)
            for name, line in {
                "upper_tooth": self.head.upper_tooth.sampled(0.2),
                "lower_tooth": self.head.lower_tooth.sampled(0.2),
                "upper_jaw": self.head.upper_jaw,
                "lower_jaw": self.head.lower_jaw,
                "profile": self.head.profile,
            }.items()
        }
        if self.jaw is not None:
            turned[JAW_HINGE] = rotated(self.jaw.hinge_mm[None], head_angle_rad)
        walls = {wall: getattr(self.neck, wall).sampled(0.1) for wall in WALLS}
        walls["package"] = self.neck.silhouette
        return SectionModel(
            nodes=rotated(body.nodes, head_angle_rad),
            triangles=body.tables.connectivity,
            region=region,
            region_names=names,
            skin={lip: self.free_edges(lip) for lip in self.present},
            outlines=turned | walls,
        )


def without_neck(model: Model) -> Model:
    """Return a model without moving outlines."""
    contacts = [
        contact
        for contact in model.contacts
        if not (isinstance(contact, RigidContact) and contact.moving)
    ]
    return replace(model, contacts=contacts)


def _materials(skin: Skin, lips: tuple[str, ...]) -> dict[str, Material]:
    name = skin.file or skin.configuration
    layers = [card.material for card in configuration_cards(name).values()]
    if len(layers) > 2:
        setting = "skin.configuration" if skin.file is None else "skin.file"
        raise ScenarioError(
            f"{setting} = {name!r} has {len(layers)} layers, the lips have two: choose L1, "
            "L2-GOH or L2-Ogden, or give a file with [dermis] and [bulk]"
        )
    parts = {"dermis": stiffened(layers[0], skin.dermis_stiffness), "bulk": layers[-1]}
    return {f"{lip}_{part}": material for lip in lips for part, material in parts.items()}
