"""Meshes and loads of the verification problems of tissue sections."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.loads.load import Load
from fem2d.materials.material import Array, Material
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.solvers.model import Model
from fem2d.solvers.static import StaticResult, kept_at, solve_static


def squares(element: str, x: Array, y: Array) -> skfem.Mesh:
    """Return a structured mesh of triangles or quadrilaterals, as the element asks."""
    kind = skfem.MeshTri if element[0] == "T" else skfem.MeshQuad
    return kind.init_tensor(x, y)


def mapped(mesh: skfem.Mesh, positions: Array) -> skfem.Mesh:
    return type(mesh)(positions, mesh.t)


def block(element: str, across: int, up: int) -> skfem.Mesh:
    """The block that other programs computed too: 20 × 12 mm, the top 10 % dermis."""
    mesh = squares(element, np.linspace(0, 20, across + 1), np.linspace(0, 12, up + 1))
    return mesh.with_subdomains(
        {"dermis": lambda x: x[1] > 10.8, "bulk": lambda x: x[1] < 10.8}
    ).with_boundaries({"bottom": lambda x: x[1] < 1e-9, "top": lambda x: x[1] > 12 - 1e-9})


def pressed_block(
    element: str,
    plane: Plane,
    materials: Mapping[str, Material],
    *,
    cells: tuple[int, int] = (50, 40),
    step: int,
) -> tuple[float, float]:
    """Return the force (N) on the top edge of the block after ``step`` of ten steps."""
    body = Body(block(element, *cells), materials, plane=plane, element=element)
    top, bottom = body.boundary_nodes("top"), body.boundary_nodes("bottom")
    share = step / 10
    fixed = np.concatenate([2 * bottom, 2 * bottom + 1, 2 * top, 2 * top + 1])
    values = np.concatenate(
        [
            np.zeros(2 * len(bottom)),
            np.full(len(top), 2.4 * share),
            np.full(len(top), -3.6 * share),
        ]
    )
    found = at_rest(body, fixed, values)
    force = found.reaction.reshape(-1, 2)[top].sum(axis=0)
    return float(force[0]), float(force[1])


def cook(element: str, cells: int, law: Material, load_mpa: float) -> tuple[float, float]:
    """Return how far the middle and the upper corner of Cook's membrane rise, mm."""
    grid = np.linspace(0, 1, cells + 1)
    mesh = squares(element, grid, grid)
    s, t = mesh.p
    mesh = mapped(mesh, np.stack([48 * s, 44 * t * (1 - s) + s * (44 + 16 * t)]))
    mesh = mesh.with_boundaries(
        {"left": lambda x: x[0] < 1e-9, "right": lambda x: x[0] > 48 - 1e-9}
    )
    body = Body(mesh, law, plane=Plane.STRAIN, element=element)
    load = body.surface("right").uniform_force([0.0, load_mpa])
    found = at_rest(body, body.dofs("left"), dead_n=load)
    rise = found.displacement[:, 1]
    middle, corner = (np.argmin(np.hypot(*(body.nodes - [48, y]).T)) for y in (52, 60))
    return float(rise[middle]), float(rise[corner])


def quarter_ring(element: str, inner: float, outer: float, cells: tuple[int, int]) -> skfem.Mesh:
    """Return a quarter ring about the origin, cells across the wall and around."""
    mesh = squares(
        element, np.linspace(inner, outer, cells[0] + 1), np.linspace(0, 1, cells[1] + 1)
    )
    r, angle = mesh.p[0], mesh.p[1] * np.pi / 2
    mesh = mapped(mesh, np.stack([r * np.cos(angle), r * np.sin(angle)]))
    # Straight edges: a chord's middle lies inside the circle by its sagitta.
    sagitta = outer * (1 - np.cos(np.pi / 4 / cells[1])) + 1e-9
    return mesh.with_boundaries(
        {
            "inner": lambda x: np.hypot(*x) < inner + 1e-9,
            "outer": lambda x: np.hypot(*x) > outer - sagitta,
            "flat": lambda x: x[1] < 1e-9,
            "upright": lambda x: x[0] < 1e-9,
        }
    )


def inflated(
    element: str,
    plane: Plane,
    law: Material,
    *,
    inner: float,
    outer: float,
    to: float,
    cells: tuple[int, int],
) -> tuple[float, float]:
    """Return the pressure (MPa) of a ring or sphere at inner radius ``to``, and the outer radius.

    The inner wall is moved; the pressure is the radial reaction over the deformed inner surface.
    """
    body = Body(quarter_ring(element, inner, outer, cells), law, plane=plane, element=element)
    wall = body.boundary_nodes("inner")
    flat = np.setdiff1d(body.boundary_nodes("flat"), wall)
    upright = np.setdiff1d(body.boundary_nodes("upright"), wall)
    position = body.nodes[wall]
    fixed = np.concatenate([2 * wall, 2 * wall + 1, 2 * flat + 1, 2 * upright])
    move = position * (to / inner - 1)
    values = np.concatenate([move[:, 0], move[:, 1], np.zeros(len(flat) + len(upright))])
    found = at_rest(body, fixed, values)
    outward = position / np.hypot(*position.T)[:, None]
    push = float(np.sum(found.reaction.reshape(-1, 2)[wall] * outward))
    surface = 2 * np.pi * to**2 if plane is Plane.AXISYMMETRIC else np.pi / 2 * to
    far = body.boundary_nodes("outer")
    radius = np.hypot(*(body.nodes + found.displacement)[far].T)
    return push / surface, float(radius.max())


def ring_pressure(inner: float, outer: float, now: float, mu: float) -> tuple[float, float]:
    """Return pressure and outer radius of an incompressible cylinder in plane strain.

    Neo-Hookean (Rivlin, *Phil. Trans. R. Soc. A* 242, 1949); ``now`` is the inner radius reached.
    """
    far = math.sqrt(outer**2 - inner**2 + now**2)
    c = now**2 - inner**2
    return (
        mu * (math.log(outer / inner) - math.log(far / now) + c / 2 * (1 / now**2 - 1 / far**2)),
        far,
    )


def sphere_pressure(inner: float, outer: float, now: float, mu: float) -> tuple[float, float]:
    """Return pressure and outer radius of an incompressible sphere (Green and Zerna, 1954)."""
    far = (outer**3 - inner**3 + now**3) ** (1 / 3)
    a, b = now / inner, far / outer
    return mu / 2 * ((b**-4 + 4 / b) - (a**-4 + 4 / a)), far


def locking_error(element: str, plane: Plane, poisson: float) -> float:
    """Return the relative error of the pressure of an inflated wall of 4 × 6 cells.

    The inner radius grows by half: of a cylinder in plane strain, of a sphere in axisymmetry. The
    closed form is that of an incompressible material.
    """
    ring = plane is Plane.STRAIN
    inner, outer, to = (7.0, 18.625, 10.2115) if ring else (1.0, 2.0, 1.5)
    mu = 200.0 if ring else 1.0
    exact = (ring_pressure if ring else sphere_pressure)(inner, outer, to, mu)[0]
    law = NeoHookean(mu / 2, poisson=poisson)
    found = inflated(element, plane, law, inner=inner, outer=outer, to=to, cells=(4, 6))
    return found[0] / exact - 1


def at_rest(
    body: Body,
    held: Array,
    held_mm: Array | float = 0.0,
    *,
    dead_n: Array | float = 0.0,
    start: Array | float = 0.0,
) -> StaticResult:
    """The equilibrium of a body alone, from a displacement to start from; it must be found."""
    model = Model(body, held=held)
    load = Load(held_mm=held_mm, dead_n=dead_n)
    found = solve_static(model, load, start=kept_at(model, start))
    assert found.converged, found.newton.status.value
    return found
