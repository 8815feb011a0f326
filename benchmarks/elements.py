"""Accuracy per second of the element types: why every model uses the six-node triangle.

    OMP_NUM_THREADS=1 python -m benchmarks.elements

Three problems of the library's own tissue, all in plane strain at ν = 0.49: Cook's membrane; a
strip of dermis, two cells thick, that bends under its own edge load; and the two-material block
pressed by 30 %, where what counts is how far a run gets and in how many increments.
"""

from __future__ import annotations

import time

import numpy as np
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.loads.load import Load
from fem2d.materials.library import material_named
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.static import StaticResult, kept_at, solve_static, static_path
from scenarios.studies.element_types import COOK_MIDDLE_MM, cook_rise

# (element, cells): about the same numbers of unknowns in a row
COOK = {
    "Q4": (32, 64), "Q4M": (32, 64), "Q8R": (18, 37), "Q8": (18, 37), "Q8M": (18, 37),
    "T3": (32, 64), "T6": (16, 32), "T6R": (16, 32), "T6M": (16, 32),
}  # fmt: skip


def grid(element: str, x: np.ndarray, y: np.ndarray) -> skfem.Mesh:
    return (skfem.MeshTri if element[0] == "T" else skfem.MeshQuad).init_tensor(x, y)


def strip_tip(element: str, along: int, across: int) -> float:
    """Sideways displacement of the end of a strip of dermis, 12 × 1.2 mm."""
    mesh = grid(element, np.linspace(0, 12, along + 1), np.linspace(0, 1.2, across + 1))
    mesh = mesh.with_boundaries(
        {"left": lambda x: x[0] < 1e-9, "right": lambda x: x[0] > 12 - 1e-9}
    )
    body = Body(mesh, material_named("L2-Ogden/dermis"), plane=Plane.STRAIN, element=element)
    model = Model(body, held=body.dofs("left"))
    load = body.surface("right").uniform_force([0.0, -1e-5 / 1.2])
    found = solve_static(model, Load(dead_n=load))
    return float(-found.displacement[body.boundary_nodes("right"), 1].mean())


def pressed(
    element: str, plane: Plane, across: int, up: int
) -> tuple[list[StaticResult], float, float]:
    mesh = grid(element, np.linspace(0, 20, across + 1), np.linspace(0, 12, up + 1))
    mesh = mesh.with_subdomains(
        {"dermis": lambda x: x[1] > 10.8, "bulk": lambda x: x[1] < 10.8}
    ).with_boundaries({"bottom": lambda x: x[1] < 1e-9, "top": lambda x: x[1] > 12 - 1e-9})
    laws = {
        "dermis": material_named("L2-Ogden/dermis"),
        "bulk": NeoHookean(0.0041867, poisson=0.49),
    }
    body = Body(mesh, laws, plane=plane, element=element)
    top, low = body.boundary_nodes("top"), body.boundary_nodes("bottom")
    fixed = np.concatenate([2 * low, 2 * low + 1, 2 * top, 2 * top + 1])
    values = np.repeat([0.0, 2.4, -3.6], [2 * len(low), len(top), len(top)])
    model, solver = Model(body, held=fixed), fastest_solver()
    found = [kept_at(model)]
    for share in np.linspace(0, 1, 11)[1:]:
        load = Load(held_mm=share * values)
        way = static_path(model, load, start=found[-1], solver=solver)
        found += [result for result in way if result.converged]
    reached = float(found[-1].displacement[top, 1].mean()) / -3.6
    return found[1:], reached, float(found[-1].reaction[2 * top + 1].sum())


def main() -> None:
    print("Cook's membrane, middle 7.05 mm: cells, error, seconds")
    for element, sizes in COOK.items():
        cells = []
        for n in sizes:
            start = time.perf_counter()
            rise = cook_rise(element, n)
            cells.append(
                f"{n:3d} {100 * (rise / COOK_MIDDLE_MM - 1):+7.2f} %"
                f" {time.perf_counter() - start:6.2f} s"
            )
        print(f"  {element:<5}", "   ".join(cells))

    reference = strip_tip("Q8", 80, 8)
    print(f"\nbending strip of dermis, tip {reference:.4f} mm: error with 1, 2, 4 cells across")
    for element in COOK:
        errors = [strip_tip(element, 10 * n, n) / reference - 1 for n in (1, 2, 4)]
        print(f"  {element:<5}", "  ".join(f"{100 * e:+8.2f} %" for e in errors))

    print("\nblock pressed by 30 %: share reached, increments, Newton iterations, force")
    for plane in (Plane.STRAIN, Plane.STRESS):
        for element, across, up in (
            ("Q4", 50, 40), ("Q4M", 50, 40), ("T6", 25, 20), ("T6R", 25, 20), ("Q8R", 25, 20),
        ):  # fmt: skip
            if plane is Plane.STRESS and element == "Q4M":
                continue
            start = time.perf_counter()
            found, share, force = pressed(element, plane, across, up)
            iterations = sum(state.iterations for state in found)
            print(
                f"  {plane.name.lower():<7}{element:<5}{100 * share:6.1f} %"
                f"{len(found):5d}{iterations:6d}{force:12.6f} N"
                f"{time.perf_counter() - start:8.1f} s"
            )


if __name__ == "__main__":
    main()
