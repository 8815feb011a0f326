"""When a compressed surface creases: a fold that touches itself costs as little as staying flat.

A flat surface can be stable against small waves (:mod:`fem2d.analyses.wrinkling`) and yet prefer a
fold of finite depth. A half-space has no length of its own, so a crease of depth ``d`` costs

    ΔU(ε, d) = d² f(ε) more energy, per thickness, than the flat surface under the same compression

and the creasing strain is the root of ``f``: below it a crease of any size opens again, above it
one of any size grows (Hong, Zhao and Suo 2009). What deep inside is a half-space is any smooth
surface seen from near enough, so the compression *along the surface* decides, whatever lies below.

Here ``f`` comes from one fold of depth 1 in half of a large half-disc around its bottom. The fold
is symmetric, so its middle plane is a frictionless wall on which the surface may lie but which it
cannot pull: nodes of the surface are held on the wall while it pushes them and freed where it would
pull (an active set). The bottom of the fold is kept at its depth, the rim of the disc at the
homogeneous deformation. The mesh is a fan, finer towards the bottom of the fold by constant ratio,
for the solution there has no length of its own either.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import skfem
from numpy.typing import NDArray

from fem2d.analyses.wrinkling import free_height
from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.loads.load import Load
from fem2d.materials.material import Material
from fem2d.solvers.model import Model
from fem2d.solvers.static import StaticResult, kept_at, solve_static
from geometry2d.foundation.errors import DrinksimError

Array = NDArray[np.float64]
Index = NDArray[np.int64]

FINEST = 0.025
"""Radius of the innermost ring of elements, in depths of the fold."""
RIM = 80.0
"""Radius of the disc in depths of the fold; what is cut off counts with its inverse square."""
FIRST_STRAIN, DEEPEST_STRAIN = 0.3, 0.7
STRAIN_STEP, FINE_STEP = 0.02, 0.002
FIRST_FOLD = 0.5
"""Undeformed length of surface that is folded first, in depths."""
FIRST_STEPS = 24
TOUCH = 1e-9
STRAIN_TOLERANCE = 1e-5
ACTIVE_SET_LIMIT, SECANTS = 60, 20


class CreasingError(DrinksimError):
    """The creasing strain of a material cannot be found."""


@dataclass(frozen=True)
class Creasing:
    """The compression from which on a surface prefers a crease.

    Attributes
    ----------
    strain, log_strain
        Nominal compression 1 − λ along the surface, and −ln λ.
    folded
        Undeformed length of surface, on either side, that lies on the other: in depths of the fold.
    least_volume_ratio, flat_volume_ratio
        Smallest volume over undeformed volume at the crease's integration points, and that of the
        flat surface at the same compression: how far the material's compressibility was used.
    least_log_strain, largest_log_strain
        Extreme principal logarithmic strains at the crease's integration points.
    force
        Force that keeps the fold at its depth, over that depth and the energy density of the flat
        surface. At the creasing strain a fold of any depth costs the same, so none should be
        needed: what is left is the mesh's and the disc's.
    """

    strain: float
    log_strain: float
    folded: float
    least_volume_ratio: float
    flat_volume_ratio: float
    least_log_strain: float
    largest_log_strain: float
    force: float


def creasing(material: Material, *, plane: Plane, sectors: int = 16) -> Creasing:
    """Return at which compression a half-space creases.

    Parameters
    ----------
    material
        Of the half-space.
    plane
        Plane stress or plane strain.
    sectors
        Elements around the bottom of the fold, in the right angle between surface and middle plane;
        those along a ray follow.

    Raises
    ------
    CreasingError
        If the plane assumption is axisymmetry, no crease becomes favourable between
        ``FIRST_STRAIN`` and ``DEEPEST_STRAIN``, or equilibrium is lost before (the message says at
        which compression).
    """
    if plane is Plane.AXISYMMETRIC:
        raise CreasingError("plane = AXISYMMETRIC has no sideways compression: use STRESS, STRAIN")
    if sectors < 2:
        raise CreasingError(f"sectors = {sectors}: a fold needs at least 2, 16 are usual")
    half = _HalfDisc(Body(_fan(sectors), material, plane=plane))
    strain, fold = half.roughly(half.first_fold())
    fold = half.settled(strain, fold)
    cost, step = half.cost(strain, fold), FINE_STEP
    # The secant method: near the root, the cost of a fold in equilibrium is smooth and falls.
    for _ in range(SECANTS):
        strain, cost_before = strain + step, cost
        fold = half.settled(strain, fold)
        cost = half.cost(strain, fold)
        step = float(np.clip(cost * step / (cost_before - cost), -STRAIN_STEP, STRAIN_STEP))
        if abs(step) <= STRAIN_TOLERANCE:
            break
    else:
        raise CreasingError(f"the creasing strain did not settle; last tried {strain:.2%}")
    fields = half.body.fields(fold.displacement)
    volume = np.linalg.det(fields.deformation_gradient)
    flat = half.body.fields(half.flat(strain))
    return Creasing(
        strain,
        -math.log1p(-strain),
        float(half.body.nodes[fold.lying, 0].max(initial=0.0)),
        float(volume.min()),
        float(np.linalg.det(flat.deformation_gradient[0, 0])),
        float(fields.log_strain.min()),
        float(fields.log_strain.max()),
        fold.force / float(flat.energy_density[0, 0]),
    )


@dataclass(frozen=True)
class _Fold:
    """A fold.

    Displacement (n, 2), nodes that lie on its middle plane, and, in equilibrium, the force upwards
    that keeps it at its depth, N.
    """

    displacement: Array
    lying: Index
    force: float = 0.0


@dataclass(frozen=True)
class _HalfDisc:
    """Half of the half-disc around the bottom of a fold, the quarter x ≥ 0, y ≤ 0 of a disc."""

    body: Body
    surface: Index = field(init=False)
    """Nodes of the free surface without the bottom of the fold, which is node 0."""
    middle: Index = field(init=False)
    """Nodes of the middle plane below the fold."""
    rim: Index = field(init=False)

    def __post_init__(self) -> None:
        x, y = self.body.nodes.T
        rim = np.unique(self.body.edges("rim"))
        surface = np.flatnonzero((y == 0) & (x > 0))
        object.__setattr__(self, "rim", rim)
        object.__setattr__(self, "surface", np.setdiff1d(surface, rim))
        object.__setattr__(self, "middle", np.flatnonzero(x == 0))

    def flat(self, strain: float) -> Array:
        """Return the displacement (n, 2) of the flat surface under a compression."""
        height = free_height(self.body.materials[0], self.body.plane, 1 - strain)
        if height is None:
            raise CreasingError(
                f"a surface compressed by {strain:.1%} finds no height at which it is free of load"
            )
        flat: Array = self.body.nodes * [-strain, height[0] - 1]
        return flat

    def first_fold(self) -> _Fold:
        """Return a fold at the first strain, made by turning a piece of surface and sinking it."""
        nodes, flat = self.body.nodes, self.flat(FIRST_STRAIN)
        piece = self.surface[nodes[self.surface, 0] <= FIRST_FOLD]
        turned = np.append(piece, 0)
        along = nodes[turned, 0]
        displacement = flat
        for share in np.linspace(0, 1, FIRST_STEPS + 1)[1:]:
            angle = 0.5 * math.pi * share
            stretch = (1 - share) * (1 - FIRST_STRAIN) + share
            x = (1 - FIRST_STRAIN) * math.cos(angle) * along if share < 1 else 0 * along
            y = -math.sin(angle) * stretch * (FIRST_FOLD - along) - share * (1 - FIRST_FOLD)
            target = flat.copy()
            target[turned] = np.column_stack([x, y]) - nodes[turned]
            held = np.concatenate([2 * turned, 2 * turned + 1])
            displacement = self._rest(held, target, displacement, FIRST_STRAIN).displacement
        return _Fold(displacement, piece)

    def roughly(self, fold: _Fold) -> tuple[float, _Fold]:
        """Return about where the first fold stops to cost energy, and its form a little before.

        The fold is held on its middle plane all along, pulled or not.
        """
        strain, step = FIRST_STRAIN, STRAIN_STEP
        fold = _Fold(self._held(strain, fold).displacement, fold.lying)
        cost = self.cost(strain, fold)
        if cost <= 0:
            raise CreasingError(
                f"a crease is favourable at a compression of {strain:.0%} already: softer than "
                "any material that this search was made for"
            )
        while strain + step <= DEEPEST_STRAIN:
            try:
                deeper = _Fold(self._held(strain + step, fold).displacement, fold.lying)
            except CreasingError:
                step /= 2
                if step < FINE_STEP:
                    raise
                continue
            cost_before, cost = cost, self.cost(strain + step, deeper)
            if cost <= 0:
                return strain + step * cost_before / (cost_before - cost), fold
            strain, fold = strain + step, deeper
        raise CreasingError(f"no crease is favourable to a compression of {DEEPEST_STRAIN:.0%}")

    def settled(self, strain: float, fold: _Fold) -> _Fold:
        """Return the fold of depth 1 under a compression, searched from another one."""
        for _ in range(ACTIVE_SET_LIMIT):
            rest = self._held(strain, fold)
            pushed = fold.lying[rest.reaction[2 * fold.lying] > 0]
            x = self.body.nodes[self.surface, 0] + rest.displacement[self.surface, 0]
            lying = np.union1d(pushed, self.surface[x < -TOUCH])
            if np.array_equal(lying, fold.lying):
                return _Fold(rest.displacement, lying, float(rest.reaction[1]))
            fold = _Fold(rest.displacement, lying)
        raise CreasingError(
            f"where the fold touches itself did not settle at a compression of {strain:.1%}"
        )

    def _held(self, strain: float, fold: _Fold) -> StaticResult:
        """Return the equilibrium of depth 1 with a fold's nodes held on the middle plane."""
        target = self.flat(strain)
        target[0, 1] = -1.0
        target[fold.lying, 0] = -self.body.nodes[fold.lying, 0]
        held = np.append(2 * fold.lying, 1)
        return self._rest(held, target, fold.displacement, strain)

    def cost(self, strain: float, fold: _Fold) -> float:
        """Return the energy of a fold less that of the flat surface, N mm."""
        folded = self.body.response(fold.displacement).energy
        return folded - self.body.response(self.flat(strain)).energy

    def _rest(self, held: Index, target: Array, start: Array, strain: float) -> StaticResult:
        """Return the equilibrium with unknowns held at ``target``, besides rim and middle plane."""
        fixed = np.unique(np.concatenate([held, 2 * self.middle, 2 * self.rim, 2 * self.rim + 1]))
        model = Model(self.body, held=fixed)
        load = Load(held_mm=target.ravel()[fixed])
        rest = solve_static(model, load, start=kept_at(model, start))
        if not rest.converged:
            raise CreasingError(f"a fold found no equilibrium at a compression of {strain:.1%}")
        return rest


def _fan(sectors: int) -> skfem.MeshTri:
    """Return a quarter disc of rings that grow in proportion to their radius; node 0 its centre."""
    turn = 0.5 * math.pi / sectors
    rings = math.ceil(math.log(RIM / FINEST) / math.log1p(turn))
    radius = FINEST * (RIM / FINEST) ** (np.arange(rings + 1) / rings)
    angle = -turn * np.arange(sectors + 1)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    circle[0], circle[-1] = (1.0, 0.0), (0.0, -1.0)
    points = np.concatenate([np.zeros((1, 2)), (radius[:, None, None] * circle).reshape(-1, 2)])
    number = 1 + np.arange((rings + 1) * (sectors + 1)).reshape(rings + 1, sectors + 1)
    a, b = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
    c, d = number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    centre = np.column_stack([np.zeros(sectors, int), number[0, 1:], number[0, :-1]])
    # Diagonals alternate, so that the mesh prefers no direction.
    even = (np.add.outer(np.arange(rings), np.arange(sectors)) % 2 == 0).ravel()
    first = np.where(even[:, None], np.column_stack([a, d, b]), np.column_stack([a, c, b]))
    second = np.where(even[:, None], np.column_stack([b, d, c]), np.column_stack([a, d, c]))
    mesh = skfem.MeshTri(points.T.copy(), np.concatenate([centre, first, second]).T.copy())
    inside = 0.5 * (radius[-1] + radius[-2])
    return mesh.with_boundaries({"rim": lambda x: np.hypot(*x) > inside})
