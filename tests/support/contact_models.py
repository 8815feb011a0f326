"""Blocks, supports and loads that the verification problems of contact are built from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.loads.load import Load, Loading
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden
from fem2d.solvers.commit import Commit
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.march import MarchStatus, march
from fem2d.solvers.model import Model
from fem2d.solvers.newton_settings import NewtonSettings
from fem2d.solvers.state import State
from fem2d.solvers.step_control import StepSettings
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion, rotated

FINE = NewtonSettings(tolerance=1e-8, force_floor_n=1e-3, iterations=40)
"""Balance to round-off: the closed forms are what is tested, not the tolerance."""


@dataclass(frozen=True)
class LoadedModel:
    """A model and what acts on it besides rigid bodies, against time.

    ``load`` gives dead nodal forces (2n,), N; ``path`` displacements of the held unknowns, mm.
    """

    model: Model
    load: Callable[[float], np.ndarray] | None = None
    path: Callable[[float], np.ndarray] | None = None

    def loading(self, motion: RigidMotion) -> Loading:
        def at(time_s: float) -> Load:
            return replace(
                Load.at(motion.at(time_s), time_s),
                dead_n=0.0 if self.load is None else self.load(time_s),
                held_mm=0.0 if self.path is None else self.path(time_s),
            )

        return at


def loaded(body: Body, *, load=None, path=None, **members) -> LoadedModel:
    """A loaded model of a body and its contacts, supports and so on."""
    return LoadedModel(Model(body, **members), load, path)


def linear_elastic(young_mpa: float, poisson: float) -> NeoHookean:
    """The neo-Hookean law that has these constants at small strain."""
    return NeoHookean(young_mpa / (4 * (1 + poisson)), poisson=poisson)


def block(
    x,
    y,
    material,
    *,
    plane=Plane.STRAIN,
    element="Q4",
    distortion=0.0,
    angle=0.0,
    layers=None,
    **options,
) -> Body:
    """A block on the grid lines ``x`` and ``y`` with its four sides named.

    ``distortion`` shifts nodes by that share of the smallest spacing: inside anywhere, on the
    sides along them. ``angle`` turns the block about the origin.
    """
    mesh = (skfem.MeshTri if element[0] == "T" else skfem.MeshQuad).init_tensor(x, y)
    sides = {
        "left": lambda p: np.isclose(p[0], x[0]),
        "right": lambda p: np.isclose(p[0], x[-1]),
        "bottom": lambda p: np.isclose(p[1], y[0]),
        "top": lambda p: np.isclose(p[1], y[-1]),
    }
    mesh = mesh.with_boundaries(sides)
    if layers:
        mesh = mesh.with_subdomains(layers)
    if distortion:
        points = mesh.p.copy()
        rng = np.random.default_rng(4)
        for axis, line in enumerate((x, y)):
            inside = (points[axis] > line[0] + 1e-9) & (points[axis] < line[-1] - 1e-9)
            reach = distortion * np.min(np.diff(line))
            points[axis, inside] += rng.uniform(-reach, reach, np.count_nonzero(inside))
        mesh = type(mesh)(points, mesh.t, _boundaries=mesh.boundaries, _subdomains=mesh.subdomains)
    if angle:
        mesh = type(mesh)(
            rotated(mesh.p.T, angle).T,
            mesh.t,
            _boundaries=mesh.boundaries,
            _subdomains=mesh.subdomains,
        )
    return Body(mesh, material, plane=plane, element=element, **options)


def graded(half_width: float, finest: float, inside: float, ratio: float = 1.15) -> np.ndarray:
    """Grid lines from 0 to ``half_width``: ``finest`` apart up to ``inside``, then coarser."""
    lines = list(np.arange(0, inside + 0.5 * finest, finest))
    step = finest
    while lines[-1] < half_width:
        step *= ratio
        lines.append(lines[-1] + step)
    # The last step is stretched to end where it should.
    tail = np.array(lines)
    start = round(inside / finest)
    scale = (half_width - tail[start]) / (tail[-1] - tail[start])
    tail[start:] = tail[start] + scale * (tail[start:] - tail[start])
    return tail


def unknowns(body: Body, side: str, component: int) -> np.ndarray:
    """Unknowns of one component (0 along x, 1 along y) on a named side."""
    return body.dofs(side, along="xy"[component])


def side_pressure(body: Body, side: str, traction: tuple[float, float]) -> np.ndarray:
    """Nodal forces (2n,) of a uniform dead traction, MPa, on a named side."""
    return body.surface(side).uniform_force(traction)


def plane_below(y: float = 0.0, *, reach: float = 1000.0) -> Outline:
    """A rigid half-plane (a large rectangle) whose upper face is at ``y``."""
    return Outline.from_corners(
        [[-reach, y - reach], [reach, y - reach], [reach, y], [-reach, y]], 0
    )


def still(end_s: float = 1.0) -> RigidMotion:
    """A motion that stays where it is."""
    return RigidMotion(np.array([0.0, end_s]), np.zeros(2), np.zeros((2, 2)))


def path(times, positions) -> RigidMotion:
    """Straight lines from point to point at constant speed, without turning.

    A spline through corners would overshoot; many samples on each line keep it straight.
    """
    fine = np.unique(np.concatenate([np.linspace(a, b, 201) for a, b in pairwise(times)]))
    columns = [np.interp(fine, times, c) for c in np.transpose(positions)]
    return RigidMotion(fine, np.zeros_like(fine), np.column_stack(columns))


def followed(
    problem: Model | LoadedModel,
    motion: RigidMotion,
    *,
    increments: int,
    newton: NewtonSettings = FINE,
    start: State | None = None,
    end_s: float | None = None,
    step_s: float | None = None,
    solver=None,
) -> list[Commit]:
    """March in equal increments (or of ``step_s``) and return all of them; it must arrive."""
    last = float(motion.time_s[-1]) if end_s is None else end_s
    step = last / increments if step_s is None else step_s
    if isinstance(problem, Model):
        problem = LoadedModel(problem)
    loading = problem.loading(motion)
    if start is None:
        start = problem.model.at_rest(loading(0.0), next_step_s=step)
    commits: list[Commit] = []
    result = march(
        problem.model,
        loading,
        start,
        solver=solver or fastest_solver(),
        end_s=last,
        steps=StepSettings(
            longest_s=step, travel_mm=np.inf, accuracy_mm=np.inf, easy_iterations=newton.iterations
        ),
        newton=newton,
        on_commit=commits.append,
    )
    assert result.status is MarchStatus.FINISHED, f"{result.status} at {result.state.time_s} s"
    return commits


def force_on_tissue(commit: Commit) -> np.ndarray:
    """Sum of all contact forces on the tissue (2,), N."""
    total = np.zeros(2)
    for contact in commit.contacts:
        total += contact.force.reshape(-1, 2).sum(axis=0)
    return total


LIP_PRESS = path([0, 1, 2], [[0, 0], [0, -3], [4, -3]])
"""Three millimetres down, four sideways."""

LIP_PRESS_SIZE_MM = (20.0, 12.0)
LIP_PRESS_CIRCLE = Outline.circle([10, 16], 4)
LIP_PRESS_LAYERS = {"dermis": lambda p: p[1] > 10.8, "bulk": lambda p: p[1] < 10.8}
LIP_PRESS_MATERIALS = {
    "dermis": Ogden((0.05,), (10.789,), poisson=0.49),
    "bulk": NeoHookean(0.0041867, poisson=0.49),
}


def lip_press(columns=50, rows=40, *, plane=Plane.STRAIN, element="Q4", angle=0.0, **options):
    """The peers' benchmark: a circle of radius 4 mm pressed and dragged over a skin-like block.

    20 mm × 12 mm, bottom fixed, the upper tenth Ogden skin of ν = 0.49; friction 1; penalties of
    10 MPa/mm. ``angle`` turns the whole problem. Returns the system; `LIP_PRESS` is the motion.
    """
    x, y = (
        np.linspace(0, size, count + 1)
        for size, count in zip(LIP_PRESS_SIZE_MM, (columns, rows), strict=True)
    )
    body = block(
        x, y, LIP_PRESS_MATERIALS, plane=plane, element=element, angle=angle,
        layers=LIP_PRESS_LAYERS,
    )  # fmt: skip
    top = body.surface("top", points_per_edge=options.pop("points", 2))
    lip = LIP_PRESS_CIRCLE.moved(angle, [0, 0])
    normal = options.pop("normal", NormalLaw(10.0, 1e-9))
    friction = options.pop("friction", FrictionLaw(1.0, 10.0))
    held = np.concatenate([unknowns(body, "bottom", 0), unknowns(body, "bottom", 1)])
    pair = RigidContact(top, lip, normal=normal, friction=friction, name="circle")
    return Model(body, contacts=(pair,), held=held)
