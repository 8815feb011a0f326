"""What one Newton iteration costs against the number of triangles, and how fast it grows.

    python -m benchmarks.newton_cost [--repeats 5] [--largest 50000] [--plot newton_cost.png]

The block of the lip press in quadratic triangles, plane stress, indented and sheared under the
circle with friction 1, so that the tangent is unsymmetric. An iteration is what the solver does in
one: forces and stiffness, contact, the tangent put together, its factors, one solution to the
residual of a Newton step. Medians in milliseconds of processor time on one thread; the pattern is
analysed before. The last line is the slope of a straight line through the totals, log over log.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import skfem

from fem2d.body.body import Body
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.loads.load import Load
from fem2d.loads.tie import ElasticTie
from fem2d.solvers.linear import fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.newton_settings import NewtonSettings
from geometry2d.rigid import RigidPlacement
from tests.support.contact_models import (
    LIP_PRESS,
    LIP_PRESS_CIRCLE,
    LIP_PRESS_LAYERS,
    LIP_PRESS_MATERIALS,
    LIP_PRESS_SIZE_MM,
)

SIZES = (1000, 2000, 5000, 10000, 20000, 50000)
INDENTED_MM = 0.5


def block(triangles: int) -> Model:
    """Return the lip press on about so many triangles."""
    width, height = LIP_PRESS_SIZE_MM
    rows = max(4, round((triangles / 2 * height / width) ** 0.5))
    columns = round(triangles / (2 * rows))
    mesh = (
        skfem.MeshTri.init_tensor(
            np.linspace(0, width, columns + 1), np.linspace(0, height, rows + 1)
        )
        .with_boundaries(
            {"top": lambda p: np.isclose(p[1], height), "bottom": lambda p: np.isclose(p[1], 0)}
        )
        .with_subdomains(LIP_PRESS_LAYERS)
    )
    body = Body(mesh, LIP_PRESS_MATERIALS, plane="stress")
    circle = RigidContact(
        body.surface("top", at_nodes=True),
        LIP_PRESS_CIRCLE,
        normal=NormalLaw(10.0, 1e-9),
        friction=FrictionLaw(1.0, 10.0),
        name="circle",
    )
    return Model(
        body, contacts=(circle,), ties=(ElasticTie(body.surface("bottom"), 1e4, name="bottom"),)
    )


def indented(model: Model) -> np.ndarray:
    """Return a smooth displacement (n, 2), mm, of a block that is dented and sheared."""
    _, height = LIP_PRESS_SIZE_MM
    x, y = model.body.nodes.T
    depth = (y / height) ** 2 * np.exp(-(((x - LIP_PRESS.at(0.0).shift_mm[0]) / 4.0) ** 2))
    return np.column_stack([0.1 * depth, -INDENTED_MM * depth])


def phases(model: Model, repeats: int) -> dict[str, float]:
    """Return the milliseconds of each part of an iteration."""
    displacement, touching = indented(model), LIP_PRESS.at(0.0)
    x, y = touching.shift_mm
    lowered = RigidPlacement(touching.angle_rad, (x + 0.05, y - INDENTED_MM - 0.02))
    load, before = Load.at(lowered, 0.01), model.at_rest(Load.at(touching, 0.0))
    solver, residual = fastest_solver(), NewtonSettings().step_residual
    balance = model.balance(displacement, load, before, 0.01)
    assert sum(touch.force.size for touch in balance.contacts) > 0, "nothing touches"
    matrix = balance.tangent(False).matrix
    solver.factorise(matrix)
    parts: dict[str, Callable[[], object]] = {
        "body": lambda: model.body.response(displacement),
        "contact, rest": lambda: model.balance(displacement, load, before, 0.01, body=balance.body),
        "tangent": lambda: balance.tangent(False),
        "factors": lambda: solver.factorise(matrix),
        "solution": lambda: solver.solve(balance.residual, residual=residual),
    }
    return {name: _milliseconds(part, repeats) for name, part in parts.items()}


def _milliseconds(part: Callable[[], object], repeats: int) -> float:
    taken = []
    for _ in range(repeats):
        begin = time.thread_time()
        part()
        taken.append(time.thread_time() - begin)
    return 1e3 * statistics.median(taken)


def draw(sizes: list[int], totals: list[float], slope: float, path: Path) -> None:
    """Draw the totals, log over log, with the fitted line."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(5, 4))
    axes.loglog(sizes, totals, "o", label="one Newton iteration")
    middle = np.exp(np.mean(np.log(totals)))
    line = middle * (np.array(sizes) / np.exp(np.mean(np.log(sizes)))) ** slope
    axes.loglog(sizes, line, "-", label=f"slope {slope:.2f}")
    axes.set_xlabel("triangles")
    axes.set_ylabel("processor time, ms")
    axes.legend()
    figure.savefig(path, dpi=150, bbox_inches="tight")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, and draw it if ``--plot`` names a file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--largest", type=int, default=SIZES[-1])
    parser.add_argument("--plot", type=Path)
    options = parser.parse_args(arguments)
    sizes, totals = [], []
    for wanted in (size for size in SIZES if size <= options.largest):
        model = block(wanted)
        taken = phases(model, options.repeats)
        if not totals:
            print(f"{'triangles':>9}{'unknowns':>9}" + "".join(f"{name:>15}" for name in taken)
                  + f"{'all':>9}")  # fmt: skip
        sizes.append(len(model.body.tables.connectivity))
        totals.append(sum(taken.values()))
        row = "".join(f"{value:>15.2f}" for value in taken.values())
        print(f"{sizes[-1]:>9}{model.body.pattern.size:>9}{row}{totals[-1]:>9.1f}", flush=True)
    if len(sizes) > 1:
        slope = float(np.polyfit(np.log(sizes), np.log(totals), 1)[0])
        print(f"slope of log time over log triangles: {slope:.2f}")
        if options.plot:
            draw(sizes, totals, slope, options.plot)


if __name__ == "__main__":
    main()
