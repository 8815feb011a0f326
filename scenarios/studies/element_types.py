"""Which element type answers how: one square, a bending beam, Cook's membrane, in plane strain.

The thesis pulled one cube of eight kinds of element (linear and quadratic, full and reduced
integration, with and without a separate pressure) and saw no difference. Under homogeneous strain
there is none, and this study shows it; bending and constraint tell the kinds apart.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import skfem

from fem2d.body.body import Body
from fem2d.body.elements import ELEMENTS
from fem2d.loads.load import Load
from fem2d.materials.material import Array
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.solvers.model import Model
from fem2d.solvers.static import kept_at, solve_static
from geometry2d.foundation.progress import Progress, no_progress

THESIS_SOFT = NeoHookean(0.0056, 3.5608)
"""Of the thesis' element study: ν is 0.4901."""
COOK_LAW = NeoHookean(80.1938 / 2, poisson=0.49)
COOK_LOAD_MPA = 6.25
COOK_MIDDLE_MM = 7.05
BEAM_LENGTH_MM = 10.0
BEAM_LOAD_MPA = 4e-6
KINDS = ("Q4", "Q4R", "Q8", "Q8R", "Q4M", "Q4RM", "Q8M", "Q8RM", "T3", "T6", "T6R", "T6M")


@dataclass(frozen=True)
class ElementTypeRow:
    """What one kind of element answers.

    Attributes
    ----------
    element
        Name, see :mod:`fem2d.body.elements`.
    integration_points
        Per element.
    separate_pressure
        Whether volume changes are those of the element's mean.
    zero_energy_modes
        Deformations of a single free element that cost nothing, rigid motions not counted.
    square_stress_difference
        Largest relative difference of nominal stress from Q8's over displacements −0.9 … 3.0 of a
        unit square.
    beam_tip_error
        Relative error of a cantilever's tip, one layer of ten cells, against a fine mesh; nan where
        the element's zero-energy modes leave no solution.
    cook_error, cook_seconds
        Relative error of Cook's membrane at ν = 0.49, 16 × 16 cells, and what it took.
    """

    element: str
    integration_points: int
    separate_pressure: bool
    zero_energy_modes: int
    square_stress_difference: float
    beam_tip_error: float
    cook_error: float
    cook_seconds: float


def element_type_rows(
    cook_cells: int = 16, *, progress: Progress = no_progress
) -> list[ElementTypeRow]:
    """Return one row a kind of element, in plane strain."""
    square = square_stresses("Q8")
    beam = beam_tip("Q8", (40, 4))
    rows = []
    for number, name in enumerate(KINDS):
        progress(number / len(KINDS), f"element type {name}")
        kind = ELEMENTS[name]
        tip = beam_tip(name, (10, 1))
        start = time.perf_counter()
        cook = cook_rise(name, cook_cells)
        end = time.perf_counter()
        rows.append(
            ElementTypeRow(
                name,
                kind.quadrature[1].size,
                kind.mean_dilatation,
                zero_energy_modes(name),
                float(np.abs(square_stresses(name) / square - 1).max()),
                tip / beam - 1,
                cook / COOK_MIDDLE_MM - 1,
                end - start,
            )
        )
    return rows


def zero_energy_modes(element: str) -> int:
    """Return how many deformations of one free element cost nothing (rigid motions not counted)."""
    mesh = _grid(element, np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    if element[0] == "T":
        mesh = mesh.restrict(np.array([0]))
    body = Body(mesh, THESIS_SOFT, plane="strain", element=element)
    stiffness = body.pattern.matrix(body.response(np.zeros(body.nodes.shape)).stiffness)
    values = np.linalg.eigvalsh(stiffness.toarray())
    return int(np.sum(np.abs(values) < 1e-10 * values[-1])) - 3


def square_stresses(element: str) -> Array:
    """Return nominal stress (MPa) of a unit square on rollers at displacements −0.9 … 3.0."""
    mesh = _grid(element, np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    body = Body(mesh, THESIS_SOFT, plane="strain", element=element)
    left, low = body.dofs("left", along="x"), body.dofs("bottom", along="y")
    right = body.dofs("right", along="x")
    fixed = np.concatenate([left, low, right])
    model = Model(body, held=fixed)
    stresses = []
    for branch in (np.linspace(-0.1, -0.9, 9), np.linspace(0.25, 3.0, 12)):
        rest = kept_at(model)
        for move in branch:
            load = Load(held_mm=np.where(np.isin(fixed, right), move, 0.0))
            rest = solve_static(model, load, start=rest)
            if not rest.converged:
                return np.full(21, np.nan)
            stresses.append(rest.reaction[right].sum())
    return np.array(stresses)


def beam_tip(element: str, cells: tuple[int, int]) -> float:
    """Return how far (mm) the tip of a cantilever 10 × 1 mm sinks under a dead load."""
    mesh = _grid(
        element,
        np.linspace(0, BEAM_LENGTH_MM, cells[0] + 1),
        np.linspace(0, 1, cells[1] + 1),
    )
    body = Body(mesh, THESIS_SOFT, plane="strain", element=element)
    tip = body.boundary_nodes("right")
    model = Model(body, held=body.dofs("left"))
    load = body.surface("right").uniform_force([0.0, -BEAM_LOAD_MPA])
    rest = solve_static(model, Load(dead_n=load))
    return float(-rest.displacement[tip, 1].mean()) if rest.converged else float("nan")


def cook_rise(element: str, cells: int) -> float:
    """Return how far (mm) the middle of Cook's membrane rises under 6.25 MPa at ν = 0.49."""
    grid = np.linspace(0, 1, cells + 1)
    mesh = _grid(element, grid, grid)
    s, t = mesh.p
    positions = np.stack([48 * s, 44 * t * (1 - s) + s * (44 + 16 * t)])
    mesh = type(mesh)(positions, mesh.t).with_boundaries(
        {"left": lambda x: x[0] < 1e-9, "right": lambda x: x[0] > 48 - 1e-9}
    )
    body = Body(mesh, COOK_LAW, plane="strain", element=element)
    model = Model(body, held=body.dofs("left"))
    load = body.surface("right").uniform_force([0.0, COOK_LOAD_MPA])
    rest = solve_static(model, Load(dead_n=load))
    middle = np.argmin(np.hypot(body.nodes[:, 0] - 48, body.nodes[:, 1] - 52))
    return float(rest.displacement[middle, 1]) if rest.converged else float("nan")


def _grid(element: str, x: Array, y: Array) -> skfem.Mesh:
    kind = skfem.MeshTri if element[0] == "T" else skfem.MeshQuad
    far = float(x[-1])
    return kind.init_tensor(x, y).with_boundaries(
        {
            "left": lambda at: at[0] < 1e-9,
            "right": lambda at: at[0] > far - 1e-9,
            "bottom": lambda at: at[1] < 1e-9,
        }
    )
