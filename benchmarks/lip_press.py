"""The peers' lip press: a circle pressed 3 mm into skin and dragged 4 mm with friction 1.

    python -m benchmarks.lip_press [--repeats 3] [--fine] [CASE ...]

Block 20 mm × 12 mm, upper tenth Ogden skin (μ 0.05 MPa, α 10.789), ν = 0.49, bottom fixed, penalty
10 MPa/mm normal and tangential, 30 + 40 steps: the settings at which DOLFINx, GetFEM, FElupe, FEBio
and CalculiX were measured (docs/verification/contact.md has their numbers beside ours). "own" is
the same problem at our own settings: penalty 50 MPa/mm, and steps that adapt. "graded" keeps the
peers' penalty and steps, on quadratic triangles that are smallest where the circle touches: what
the same accuracy costs where a mesh need not be a grid.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import time
from dataclasses import dataclass

import numpy as np
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.loads.load import Load
from fem2d.loads.tie import ElasticTie
from fem2d.solvers.commit import Commit
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.march import MarchStatus, march
from fem2d.solvers.model import Model
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.state import State
from fem2d.solvers.step_control import StepSettings
from geometry2d.mesh import polygon_mesh
from tests.support.contact_models import (
    LIP_PRESS,
    LIP_PRESS_CIRCLE,
    LIP_PRESS_LAYERS,
    LIP_PRESS_MATERIALS,
    LIP_PRESS_SIZE_MM,
)


@dataclass(frozen=True)
class Case:
    """One way to run the problem; ``edge_mm`` is that of graded triangles under the circle."""

    columns: int
    rows: int
    plane: Plane
    element: str = "Q4"
    penalty_mpa_per_mm: float = 10.0
    own_steps: bool = False
    edge_mm: float | None = None


CASES = {
    "coarse strain": Case(50, 40, Plane.STRAIN),
    "coarse stress": Case(50, 40, Plane.STRESS),
    "coarse own": Case(50, 40, Plane.STRAIN, "Q4M", 50.0, True),
    "fine strain": Case(200, 100, Plane.STRAIN),
    "fine stress": Case(200, 100, Plane.STRESS),
    "fine own": Case(200, 100, Plane.STRAIN, "Q4M", 50.0, True),
} | {
    f"{edge_mm} mm graded {plane.name.lower()}": Case(0, 0, plane, "T6", edge_mm=edge_mm)
    for plane in (Plane.STRAIN, Plane.STRESS)
    for edge_mm in (0.4, 0.2, 0.1, 0.05)
}


def graded(edge_mm: float) -> skfem.MeshTri:
    """Return the block in triangles that grow with the distance from where the circle touches.

    Their edges are ``edge_mm`` times 1 there and 1 more for every mm away, up to 7.5.
    """

    def size_mm(points: np.ndarray) -> np.ndarray:
        beside = np.maximum(np.maximum(8.0 - points[:, 0], points[:, 0] - 15.0), 0.0)
        return edge_mm * np.minimum(1.0 + np.hypot(beside, 12.0 - points[:, 1]), 7.5)

    return polygon_mesh(
        {
            "bulk": [(0, 0), (20, 0), (20, 10.8), (0, 10.8)],
            "dermis": [(0, 10.8), (20, 10.8), (20, 12), (0, 12)],
        },
        size_mm,
    )


def model(name: str) -> Model:
    case = CASES[name]
    width, height = LIP_PRESS_SIZE_MM
    if case.edge_mm is None:
        mesh = skfem.MeshQuad.init_tensor(
            np.linspace(0, width, case.columns + 1), np.linspace(0, height, case.rows + 1)
        )
    else:
        mesh = graded(case.edge_mm)
    mesh = mesh.with_boundaries(
        {"top": lambda p: np.isclose(p[1], height), "bottom": lambda p: np.isclose(p[1], 0)}
    ).with_subdomains(LIP_PRESS_LAYERS)
    body = Body(mesh, LIP_PRESS_MATERIALS, plane=case.plane, element=case.element)
    top = body.surface("top", points_per_edge=2, at_nodes=case.edge_mm is not None)
    pair = RigidContact(
        top,
        LIP_PRESS_CIRCLE,
        normal=NormalLaw(case.penalty_mpa_per_mm, 1e-9 if not case.own_steps else 1e-3),
        friction=FrictionLaw(1.0, 10.0),
        name="circle",
    )
    bottom = body.surface("bottom")
    return Model(body, contacts=(pair,), ties=(ElasticTie(bottom, 1e4, name="bottom"),))


def pressed(
    system: Model, end_s: float, *, increments: int, start: State | None = None, commits=None
) -> State:
    """March to ``end_s`` in equal increments and return the state there."""
    begin = 0.0 if start is None else start.time_s
    step = (end_s - begin) / increments
    if start is None:
        start = system.at_rest(Load.at(LIP_PRESS.at(0.0), 0.0), next_step_s=step)
    kept: list[Commit] = [] if commits is None else commits
    result = march(
        system,
        LIP_PRESS,
        start,
        solver=fastest_solver(threads=2),
        end_s=end_s,
        steps=StepSettings(
            longest_s=step, travel_mm=np.inf, accuracy_mm=np.inf, easy_iterations=100
        ),
        newton=NewtonSettings(tolerance=1e-8),
        on_commit=kept.append,
    )
    if result.status is not MarchStatus.FINISHED:
        raise RuntimeError(f"stopped at {result.state.time_s:.3f} s: {result.status.value}")
    return result.state


def run(system: Model, own_steps: bool) -> tuple[list[Commit], float, float]:
    """Return all increments, seconds on the wall and seconds of processor."""
    commits: list[Commit] = []
    begin, begin_processor = time.perf_counter(), time.process_time()
    if own_steps:
        start = system.at_rest(Load.at(LIP_PRESS.at(0.0), 0.0), next_step_s=0.05)
        result = march(
            system, LIP_PRESS, start, solver=fastest_solver(threads=2),
            steps=StepSettings(longest_s=0.06, travel_mm=0.2, accuracy_mm=np.inf),
            on_commit=commits.append,
        )  # fmt: skip
        if result.status is not MarchStatus.FINISHED:
            raise RuntimeError(f"stopped at {result.state.time_s:.3f} s: {result.status.value}")
    else:
        middle = pressed(system, 1.0, increments=30, commits=commits)
        pressed(system, 2.0, increments=40, start=middle, commits=commits)
    return commits, time.perf_counter() - begin, time.process_time() - begin_processor


def force(commit: Commit) -> np.ndarray:
    return commit.contacts[0].force.reshape(-1, 2).sum(axis=0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--fine", action="store_true", help="the fine mesh too")
    options = parser.parse_args()
    names = options.cases or [n for n in CASES if options.fine or n.startswith("coarse")]
    for name in names:
        system = model(name)
        system.body.response(np.zeros_like(system.body.nodes))  # compile before the clock starts
        runs = [run(system, CASES[name].own_steps) for _ in range(options.repeats)]
        commits = runs[0][0]
        middle = min(commits, key=lambda c: abs(c.state.time_s - 1))
        iterations = sum(c.newton.iterations for c in commits)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{name:<14} Fn {-force(middle)[1]:.6f}  Fn {-force(commits[-1])[1]:.6f} "
            f"Ft {force(commits[-1])[0]:.6f} N  steps {len(commits)}  iterations {iterations}  "
            f"cutbacks {sum(c.cutbacks for c in commits)}  "
            f"{statistics.median(wall for _, wall, _ in runs):.2f} s  "
            f"processor {statistics.median(busy for _, _, busy in runs):.2f} s  {memory:.0f} MB",
            flush=True,
        )


if __name__ == "__main__":
    main()
