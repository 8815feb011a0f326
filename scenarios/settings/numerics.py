"""Tables of everything that changes a result and is not above: idealisation, mesh, laws, solver.

The dataclasses of :mod:`fem2d` and :mod:`geometry2d` hold the defaults; here they are only put
together, and the few that a sip needs otherwise are replaced. A resolution stands for the keys in
which resolutions differ, and for no others: choosing it sets all of these, and each can be changed
by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.search import SearchSettings
from fem2d.solvers.inertia import Inertia
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.step_control import StepSettings
from geometry2d.foundation.settings import setting
from geometry2d.mesh import LEVELS, MeshSize
from scenarios.settings.searches import ActivationSearch, Period, PullSearch, ShiftSearch
from scenarios.settings.tables import SettingError


@dataclass(frozen=True)
class LipNumerics:
    """How the lips are tied to bone, and where contact is looked for."""

    bone_stiffness_mpa_per_mm: float = setting(
        default=1.0,
        unit="MPa/mm",
        above=0.0,
        description="elastic layer that ties tissue to bone",
        source="some 20 times stiffer than 10 mm of bulk tissue",
    )
    points_between_nodes: int = setting(
        default=2,
        minimum=0,
        maximum=20,
        description="points in each half of an edge at which contact with the neck is looked for",
        source="edges of 0.4 mm then sink over corners of that radius by less than 0.005 mm",
    )
    self_contact_reach_mm: float = setting(
        default=0.5,
        unit="mm",
        above=0.0,
        description="distance from a skin in which other skin is looked for",
        source="far more than any penetration",
    )


USUAL_STEPS = StepSettings(watch_stability=True)


@dataclass(frozen=True)
class Resolution:
    """What a resolution sets: tables of [numerics], by the names that they have there."""

    mesh: MeshSize
    steps: StepSettings = USUAL_STEPS
    newton: NewtonSettings = field(default=NewtonSettings())
    penalty: NormalLaw = field(default=NormalLaw())
    stick: FrictionLaw = field(default=FrictionLaw())
    lips: LipNumerics = field(default=LipNumerics())


QUICK = Resolution(
    MeshSize(0.35, 2.0, 8.0, 0.8, neck_reach_mm=0.3),
    replace(USUAL_STEPS, longest_s=0.2, travel_mm=1.0, accuracy_mm=0.05, stability_every_s=0.2),
    NewtonSettings(tolerance=1e-3),
    NormalLaw(stiffness_mpa_per_mm=5.0),
    FrictionLaw(stiffness_mpa_per_mm=1.0),
    LipNumerics(points_between_nodes=1),
)
"""To rank necks: fine only where the neck comes near the lips, longer steps, and contact that
yields by 0.01 mm, which takes half of the iterations (docs/verification/speed.md)."""

RESOLUTIONS: Mapping[str, Resolution] = {
    "quick": QUICK,
    **{name: Resolution(mesh) for name, mesh in LEVELS.items()},
}
"""By name, the fastest first."""

USUAL = RESOLUTIONS["standard"]


@dataclass(frozen=True)
class Numerics:
    """How the section is idealised, divided and solved."""

    plane: Literal["stress", "strain"] = setting(
        default="stress",
        description="plane stress or plane strain",
        source="thesis, section 4.2",
    )
    thickness_mm: float = setting(
        default=1.0,
        unit="mm",
        minimum=1e-3,
        maximum=1e3,
        description="thickness of the section; forces are proportional to it",
        source="Abaqus default",
    )
    resolution: str = setting(
        default="standard",
        presets=RESOLUTIONS,
        of=("mesh", "steps", "newton", "penalty", "stick", "lips"),
        description="how finely sips are computed: what it stands for can be changed key by key; "
        "quick ranks necks in the time of a sip, thesis has about 20,000 elements in the head",
    )
    mesh: MeshSize = setting(
        default=USUAL.mesh, description="sizes of elements; unless given, the resolution's"
    )
    steps: StepSettings = setting(
        default=USUAL.steps,
        omit=("watch_stability",),
        description="lengths of steps in time",
    )
    newton: NewtonSettings = setting(
        default=USUAL.newton, description="when forces balance, and when to give up"
    )
    penalty: NormalLaw = setting(
        default=USUAL.penalty, description="normal contact, wherever surfaces touch"
    )
    stick: FrictionLaw = setting(
        default=USUAL.stick, omit=("coefficient",), description="friction before it slips"
    )
    search: SearchSettings = setting(
        default=SearchSettings(), description="what counts as a surface that faces another"
    )
    inertia: Inertia = setting(
        default=Inertia(relaxation_s=0.02),
        description="time integration; tissue's density, and a relaxation that is short beside a "
        "sip",
    )
    lips: LipNumerics = setting(
        default=USUAL.lips, description="ties to bone, and where contact is looked for"
    )
    period: Period = setting(default=Period(), description="which part of the motion is replayed")
    pull_search: PullSearch = setting(
        default=PullSearch(), description='how an "auto" of [muscle] is found'
    )
    activation_search: ActivationSearch = setting(
        default=ActivationSearch(), description='how an "auto" of [muscles] is found'
    )
    shift_search: ShiftSearch = setting(
        default=ShiftSearch(),
        description='how first contacts are measured and an "auto" of [placement] is found',
    )

    def __post_init__(self) -> None:
        steps = self.steps
        if steps.shortest_s > steps.longest_s:
            raise SettingError(
                f"numerics.steps.shortest_s = {steps.shortest_s:g} s is more than longest_s = "
                f"{steps.longest_s:g} s"
            )
        if steps.easy_iterations >= steps.hard_iterations:
            raise SettingError(
                f"numerics.steps.easy_iterations = {steps.easy_iterations} is not less than "
                f"hard_iterations = {steps.hard_iterations}"
            )
