"""Tables of everything that changes a result and is not above: idealisation, mesh, laws, solver.

The dataclasses of :mod:`fem2d` and :mod:`geometry2d` hold the defaults; here they are only put
together, and the few that a sip needs otherwise are replaced.
"""

from __future__ import annotations

from dataclasses import dataclass
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
        presets=LEVELS,
        of="mesh",
        description="sizes of the mesh, which [numerics.mesh] changes one by one; thesis has "
        "about 20,000 elements in the head",
    )
    mesh: MeshSize = setting(
        default=LEVELS["standard"], description="sizes of elements; unless given, the resolution's"
    )
    steps: StepSettings = setting(
        default=StepSettings(watch_stability=True),
        omit=("watch_stability",),
        description="lengths of steps in time",
    )
    newton: NewtonSettings = setting(
        default=NewtonSettings(), description="when forces balance, and when to give up"
    )
    penalty: NormalLaw = setting(
        default=NormalLaw(), description="normal contact, wherever surfaces touch"
    )
    stick: FrictionLaw = setting(
        default=FrictionLaw(), omit=("coefficient",), description="friction before it slips"
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
        default=LipNumerics(), description="ties to bone, and where contact is looked for"
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
