"""Small bodies that the tests of this folder share."""

from __future__ import annotations

import math

import numpy as np
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.material import Array, Material
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden

SOFT = NeoHookean(0.0042, poisson=0.49)
STIFF = Ogden((0.05, 0.01), (10.789, -2.0), (0.8, 2.0))
C, S = math.cos(0.7), math.sin(0.7)
FIBROUS = HolzapfelGasserOgden(
    0.1, 2.4, 0.13, 0.14, fibres=((C, S, 0.0), (C, -0.5, 0.4), (C, -0.5, -0.4)), poisson=0.49
)
ELEMENTS = ("T3", "T6", "T6R", "T6M", "Q4", "Q4R", "Q4M", "Q8", "Q8R", "Q8M", "Q8RM")
CASES = [
    (plane, element)
    for plane in Plane
    for element in ELEMENTS
    if not (plane is Plane.STRESS and element.endswith("M"))
]


def distorted(element: str, *, cells: int = 2, seed: int = 0) -> skfem.Mesh:
    """Return a square of 2 × 1.5 mm off the axis, inner nodes moved, two named halves."""
    x, y = np.linspace(1.0, 3.0, 2 * cells + 1), np.linspace(0.0, 1.5, cells + 1)
    kind = skfem.MeshTri if element[0] == "T" else skfem.MeshQuad
    mesh = kind.init_tensor(x, y)
    p = mesh.p.copy()
    inside = np.setdiff1d(np.arange(p.shape[1]), mesh.boundary_nodes())
    shift = np.random.default_rng(seed).uniform(-0.25, 0.25, (2, len(inside)))
    p[:, inside] += shift / cells
    halves = {"left": lambda x: x[0] < 2.0, "right": lambda x: x[0] > 2.0}
    sides = {
        "inner": lambda x: x[0] < 1 + 1e-9,
        "outer": lambda x: x[0] > 3 - 1e-9,
        "bottom": lambda x: x[1] < 1e-9,
        "top": lambda x: x[1] > 1.5 - 1e-9,
    }
    return kind(p, mesh.t).with_boundaries(sides).with_subdomains(halves)


def body(
    plane: Plane, element: str, *, left: Material = SOFT, right: Material = STIFF, cells: int = 2
) -> Body:
    mesh = distorted(element, cells=cells)
    return Body(mesh, {"left": left, "right": right}, plane=plane, element=element)


def displacement(body: Body, *, size: float = 0.02, seed: int = 1) -> Array:
    """Return a smooth stretch and turn with noise on top, admissible for `size` up to some 0.03."""
    x, y = body.nodes.T
    smooth = np.stack([0.1 * x - 0.2 * y + 0.03 * x * y, 0.15 * x - 0.12 * y], axis=1)
    return smooth + size * np.random.default_rng(seed).standard_normal(body.nodes.shape)
