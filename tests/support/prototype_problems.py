"""Two problems of a skin that tears free, on which prototypes of this solver stopped.

A, "pressed and dragged": a block of 20 mm × 12 mm, its upper 1.2 mm L2-Ogden dermis, under the rim
and first thread of the A38 neck, which is tilted by 20°, pressed down and dragged backwards;
friction 1, so that nearly everything sticks. 90 steps of 1/30 s. Four-node elements, graded (equal
ones in the dermis, growing below) or 182 × 110 equal ones, the 20,020 that no prototype finished.

B, "snap-back": a lip of 8 mm × 14 mm with rounded edges in front of a rigid tooth. The neck hooks
its crest, pulls it along with friction 1 until it lets go, and the lip snaps back. 130 steps of
1/30 s; forwards (+x, away from the tooth) and backwards (−x, into the tooth and over it).

The prototypes clamped the block's bottom, and there, where a fixed edge meets a free one, their
fine mesh died. Here bone holds tissue as everywhere in this solver: by an elastic layer of 1 MPa/mm
that fades out over 1 mm (`fem2d.loads.tie`). Material, contact, inertia and viscosity are those of
a replay too, so that these runs say something about it. Of the prototypes' geometry only the block,
the element counts and the step counts are known; neck, lip and path are chosen here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.body.surface import Surface
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.contact.self_contact import SelfContact
from fem2d.loads.load import Load
from fem2d.loads.tie import ElasticTie
from fem2d.materials.library import configuration
from fem2d.solvers.commit import Commit
from fem2d.solvers.inertia import Inertia
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.march import MarchResult, march
from fem2d.solvers.model import Model
from fem2d.solvers.step_control import StepSettings
from geometry2d.mesh import block_mesh, polygon_mesh
from geometry2d.neck import neck_section
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion

STEP_S = 1 / 30
DERMIS_MM = 1.2
BONE_MPA_PER_MM, FADE_MM = 1.0, 1.0
TISSUE = Inertia(density_tonne_per_mm3=1e-9, spectral_radius=0.0, relaxation_s=0.02)


@dataclass(frozen=True)
class Case:
    """One run: a problem, its finest edge (0: uniform), friction, plane, and which way it drags."""

    problem: str
    edge_mm: float
    friction: float = 1.0
    plane: Plane = Plane.STRESS
    backwards: bool = False


def model(case: Case) -> tuple[Model, RigidMotion]:
    """Return what is in balance and how the neck moves."""
    return pressed_and_dragged(case) if case.problem == "A" else snap_back(case)


def pressed_and_dragged(case: Case) -> tuple[Model, RigidMotion]:
    """Problem A."""
    if case.edge_mm == 0:
        mesh = block_mesh(20, 12, 182, 110, layers={"dermis": DERMIS_MM / 12})
    else:
        mesh = _graded_block(20, 12, case.edge_mm)
    body = Body(
        mesh,
        configuration("L2-Ogden"),
        plane=case.plane,
        element="Q4" if case.plane is Plane.STRESS else "Q4M",
    )
    times = STEP_S * np.arange(91)
    down = np.interp(times, [0, 1.5], [0, 4.0])
    back = np.interp(times, [1.5, 3.0], [0, 5.0])
    return _system(case, body, "top", "bottom", neck_wall(20.0, (9.0, 12.0))), RigidMotion(
        times, np.zeros_like(times), np.column_stack([back, -down])
    )


def snap_back(case: Case) -> tuple[Model, RigidMotion]:
    """Problem B."""
    width, height, radius = 8.0, 14.0, 3.0
    regions = {
        "bulk": _profile(width, height, radius, case.edge_mm, DERMIS_MM),
        "dermis": np.concatenate(
            [
                _profile(width, height, radius, case.edge_mm, 0.0),
                _profile(width, height, radius, case.edge_mm, DERMIS_MM)[::-1],
            ]
        ),
    }

    def size(points: np.ndarray) -> np.ndarray:
        return np.asarray(2 * case.edge_mm * (1 + 0.2 * np.maximum(height - 2 - points[:, 1], 0)))

    mesh = polygon_mesh(
        regions,
        size,
        boundaries={
            "bottom": lambda middle: middle[:, 1] < 1e-9,
            "skin": lambda middle: middle[:, 1] > 1e-9,
        },
    )
    body = Body(
        mesh,
        configuration("L2-Ogden"),
        plane=case.plane,
        element="T6" if case.plane is Plane.STRESS else "T6M",
    )
    tooth = Outline.from_corners(
        [[-10, 0], [-0.2 - width / 2, 0], [-0.2 - width / 2, 11], [-10, 11]], 1.0
    )
    way = -1.0 if case.backwards else 1.0
    times = STEP_S * np.arange(131)
    down = np.interp(times, [0, 1.0], [0, 3.0])
    across = way * np.interp(times, [1.0, 130 * STEP_S], [0, 14.0])
    start = (-1.0, height)
    system = _system(case, body, "skin", "bottom", neck_wall(20.0, start), tooth)
    return system, RigidMotion(times, np.zeros_like(times), np.column_stack([across, -down]))


def neck_wall(tilt_deg: float, lowest_mm: tuple[float, float]) -> Outline:
    """Return the A38 neck's lower wall, tilted rim down, its lowest point where it is told."""
    wall = neck_section().lower_wall.moved(np.deg2rad(tilt_deg), (0.0, 0.0))
    points = wall.sampled(0.01)
    lowest = points[np.argmin(points[:, 1])]
    return wall.moved(0.0, np.asarray(lowest_mm) - lowest)


def run(case: Case) -> tuple[MarchResult, list[Commit]]:
    """March through the case in steps of 1/30 s at most."""
    system, motion = model(case)
    commits: list[Commit] = []
    result = march(
        system,
        motion,
        system.at_rest(Load.at(motion.at(0.0), 0.0), next_step_s=STEP_S),
        solver=fastest_solver(),
        steps=StepSettings(longest_s=STEP_S, travel_mm=np.inf, accuracy_mm=np.inf),
        on_commit=commits.append,
    )
    return result, commits


def force_on_tissue(commit: Commit) -> np.ndarray:
    """Return the neck's force on the tissue (2,), N."""
    force: np.ndarray = commit.contacts[0].force.reshape(-1, 2).sum(axis=0)
    return force


def penetration_mm(commits: list[Commit]) -> float:
    """Return the deepest penetration of neck or tooth over the run, mm."""
    return max(-float(touch.points.gap.min()) for c in commits for touch in c.contacts)


def _system(
    case: Case, body: Body, skin: str, bottom: str, wall: Outline, tooth: Outline | None = None
) -> Model:
    surface = partial(Surface, nodes=body.nodes, points_per_edge=4)
    normal, friction = NormalLaw(), FrictionLaw(case.friction)
    outside = surface(body.edges(skin))
    pairs = [RigidContact(outside, wall, normal=normal, friction=friction, name="neck")]
    if tooth is not None:
        pairs.append(
            RigidContact(
                outside, tooth, normal=normal, friction=FrictionLaw(0.0), moving=False, name="tooth"
            )
        )
    bone = ElasticTie(surface(body.edges(bottom)), BONE_MPA_PER_MM, fade_mm=FADE_MM, name="bone")
    fold = SelfContact(
        (outside,),
        normal=normal,
        friction=FrictionLaw(0.3),
        reach_mm=0.5,
        same_surface=True,
        name="fold",
    )
    return Model(body, contacts=(*tuple(pairs), *(fold,)), ties=(bone,), inertia=TISSUE)


def _graded_block(width: float, height: float, edge: float) -> skfem.MeshQuad:
    """Return four-node elements, equal in the dermis and growing below it.

    With an edge of 0.15 mm these are the 134 × 30 nodes of the prototypes.
    """
    rows = round(DERMIS_MM / edge)
    steps = [edge]
    growth = 1.11 ** (edge / 0.15)
    while sum(steps) < height - DERMIS_MM:
        steps.append(steps[-1] * growth)
    below = np.concatenate([[0.0], np.cumsum(steps)]) * (height - DERMIS_MM) / sum(steps)
    below = (height - DERMIS_MM) - below[::-1]
    top = height - DERMIS_MM + DERMIS_MM * np.arange(1, rows + 1) / rows
    y = np.concatenate([below, top])
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, width, round(width / edge) + 1), y)
    border = height - DERMIS_MM
    return mesh.with_subdomains(
        {"dermis": lambda p: p[1] > border, "bulk": lambda p: p[1] < border}
    ).with_boundaries(
        {"top": lambda p: np.isclose(p[1], height), "bottom": lambda p: np.isclose(p[1], 0)}
    )


def _profile(width: float, height: float, radius: float, edge: float, inset: float) -> np.ndarray:
    """Return a lip's outline (n, 2) from the right end of its bottom over the crest to the left."""
    count = max(6, int(np.ceil(0.5 * np.pi * radius / edge)))
    angle = np.linspace(0, 0.5 * np.pi, count + 1)
    corner = (radius - inset) * np.column_stack([np.cos(angle), np.sin(angle)])
    corner += [0.5 * width - radius, height - radius]
    foot = 0.5 * width - inset
    return np.concatenate([[[foot, 0.0]], corner, corner[::-1] * [-1, 1], [[-foot, 0.0]]])
