"""A block on its clamped bottom and dead forces on its top, and an arch that snaps."""

from __future__ import annotations

import numpy as np
import skfem

from fem2d.body.body import Body
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.solvers.model import Model


def clamped_block(**members) -> Model:
    """A block 2 mm wide and 1 mm high whose bottom is held."""
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 2, 5), np.linspace(0, 1, 3))
    mesh = mesh.with_boundaries(
        {"bottom": lambda x: np.isclose(x[1], 0), "top": lambda x: np.isclose(x[1], 1)}
    )
    body = Body(mesh, NeoHookean(0.5, poisson=0.3), plane="strain")
    return Model(body, held=body.dofs("bottom"), **members)


def on_top(model: Model, traction: tuple[float, float]) -> np.ndarray:
    """Nodal forces (2n,), N, of a traction, MPa, on the block's top."""
    return model.body.surface("top").uniform_force(traction)


def arch() -> tuple[Model, np.ndarray]:
    """A clamped arch, 20 mm wide, 2 mm high, 0.6 mm thick, and 1 N down at its crown."""
    flat = skfem.MeshTri.init_tensor(np.linspace(-10, 10, 17), np.linspace(-0.3, 0.3, 2))
    x, y = flat.p
    mesh = skfem.MeshTri(np.stack([x, y + 2.0 * (1 - (x / 10) ** 2)]), flat.t)
    mesh = mesh.with_boundaries({"ends": lambda at: abs(at[0]) > 10 - 1e-9})
    body = Body(mesh, NeoHookean(1.0, poisson=0.3), plane="strain")
    force = np.zeros(body.nodes.size)
    force[2 * int(np.argmax(body.nodes[:, 1])) + 1] = -1.0
    return Model(body, held=body.dofs("ends")), force
