"""Creasing of a compressed surface: when a fold in self-contact needs no more energy than flatness.

A flat surface can be stable against small waves (:mod:`fem2d.analyses.wrinkling`) and unstable
against a fold of finite depth. A half-space has no length scale, so a crease of depth ``d`` has

    ΔU(ε, d) = d² f(ε) more energy, per thickness, than the flat surface under the same compression

and the creasing strain is the root of ``f``: below it a crease of any size opens, above it one of
any size grows (Hong, Zhao and Suo 2009). Every smooth surface is a half-space on a small enough
scale, so the compression *along the surface* decides, whatever lies below.

Here ``f`` comes from one fold of depth 1 in half of a large half-disc around its bottom. The fold
is symmetric, so its middle plane is a frictionless wall that pushes the surface but cannot pull it:
nodes of the surface are held on the wall while it pushes them and freed where it would pull (an
active set). The bottom of the fold is held at its depth, the rim of the disc at the homogeneous
deformation. The mesh is a fan, refined towards the bottom of the fold by a constant ratio, because
the solution there has no length scale either.
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
from geometry2d.foundation.settings import setting

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class CreasingError(DrinksimError):
    """The creasing strain of a material cannot be found."""


@dataclass(frozen=True)
class CreasingSettings:
    """Mesh and search of the creasing strain; lengths in depths of the fold.

    Parameters
    ----------
    sectors
        Elements around the bottom of the fold, in the right angle between surface and middle plane.
    finest
        Radius of the innermost ring of elements.
    rim
        Radius of the disc; its error is proportional to the inverse square.
    first_strain, largest_strain
        Compressions at which the search begins and ends.
    strain_step, fine_step
        Step of the compression far from the root, and the first one of the secant method.
    first_fold, first_steps
        Undeformed length of surface that is folded at first, and the number of steps that fold it.
    overlap
        Overlap of the surface with the wall that counts as contact.
    strain_tolerance
        Error of the creasing strain.
    active_set_changes, secants
        Largest numbers of changes of the active set at one compression, and of secant steps.
    """

    sectors: int = setting(
        default=16, minimum=2, maximum=500, description="elements around the bottom of the fold"
    )
    finest: float = setting(
        default=0.025, above=0.0, maximum=1.0, description="radius of the innermost elements"
    )
    rim: float = setting(default=80.0, minimum=2.0, description="radius of the disc")
    first_strain: float = setting(
        default=0.3, above=0.0, maximum=0.99, description="compression at which the search begins"
    )
    largest_strain: float = setting(
        default=0.7, above=0.0, maximum=0.99, description="compression at which the search ends"
    )
    strain_step: float = setting(
        default=0.02, above=0.0, maximum=0.5, description="step of the compression"
    )
    fine_step: float = setting(
        default=0.002, above=0.0, maximum=0.5, description="first step of the secant method"
    )
    first_fold: float = setting(
        default=0.5, above=0.0, maximum=1.0, description="length of surface that is folded at first"
    )
    first_steps: int = setting(
        default=24, minimum=1, maximum=1000, description="steps in which it is folded"
    )
    overlap: float = setting(
        default=1e-9, above=0.0, maximum=0.1, description="overlap that counts as contact"
    )
    strain_tolerance: float = setting(
        default=1e-5, above=0.0, maximum=0.1, description="error of the creasing strain"
    )
    active_set_changes: int = setting(
        default=60, minimum=1, maximum=10_000, description="largest number of changes of contact"
    )
    secants: int = setting(
        default=20, minimum=1, maximum=1000, description="largest number of secant steps"
    )


@dataclass(frozen=True)
class Creasing:
    """The compression above which a surface creases.

    Attributes
    ----------
    strain, log_strain
        Nominal compression 1 − λ along the surface, and −ln λ.
    folded
        Undeformed length of surface, on either side, that lies on the other: in depths of the fold.
    least_volume_ratio, flat_volume_ratio
        Smallest volume ratio at the integration points of the crease, and that of the flat surface
        at the same compression.
    least_log_strain, largest_log_strain
        Extreme principal logarithmic strains at the crease's integration points.
    force
        Force that holds the fold at its depth, over that depth and the energy density of the flat
        surface. It vanishes at the creasing strain but for errors of mesh and disc.
    """

    strain: float
    log_strain: float
    folded: float
    least_volume_ratio: float
    flat_volume_ratio: float
    least_log_strain: float
    largest_log_strain: float
    force: float


def creasing(
    material: Material, *, plane: Plane, settings: CreasingSettings | None = None
) -> Creasing:
    """Return the compression at which a half-space creases.

    Parameters
    ----------
    material
        Of the half-space.
    plane
        Plane stress or plane strain.
    settings
        Mesh and search.

    Raises
    ------
    CreasingError
        If the plane assumption is axisymmetry, or no creasing strain is found between the first and
        the largest compression of the search.
    """
    if plane is Plane.AXISYMMETRIC:
        raise CreasingError("plane = AXISYMMETRIC has no sideways compression: use STRESS, STRAIN")
    chosen = settings or CreasingSettings()
    if chosen.sectors < 2:
        raise CreasingError(f"sectors = {chosen.sectors}: a fold needs at least 2, 16 are usual")
    half = _HalfDisc(Body(_fan(chosen), material, plane=plane), chosen)
    strain, fold = half.roughly(half.first_fold())
    fold = half.in_contact(strain, fold)
    cost, step = half.cost(strain, fold), chosen.fine_step
    # The secant method: near the root, the energy of a fold in equilibrium is smooth and falls.
    for _ in range(chosen.secants):
        strain, cost_before = strain + step, cost
        fold = half.in_contact(strain, fold)
        cost = half.cost(strain, fold)
        longest = chosen.strain_step
        step = float(np.clip(cost * step / (cost_before - cost), -longest, longest))
        if abs(step) <= chosen.strain_tolerance:
            break
    else:
        raise CreasingError(f"the search for the creasing strain did not converge at {strain:.2%}")
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
    settings: CreasingSettings
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
        """Return a fold at the first strain, made by turning some surface and lowering it."""
        first, folded = self.settings.first_strain, self.settings.first_fold
        nodes, flat = self.body.nodes, self.flat(first)
        lying = self.surface[nodes[self.surface, 0] <= folded]
        turned = np.append(lying, 0)
        along = nodes[turned, 0]
        displacement = flat
        for share in np.linspace(0, 1, self.settings.first_steps + 1)[1:]:
            angle = 0.5 * math.pi * share
            stretch = (1 - share) * (1 - first) + share
            x = (1 - first) * math.cos(angle) * along if share < 1 else 0 * along
            y = -math.sin(angle) * stretch * (folded - along) - share * (1 - folded)
            target = flat.copy()
            target[turned] = np.column_stack([x, y]) - nodes[turned]
            held = np.concatenate([2 * turned, 2 * turned + 1])
            displacement = self._rest(held, target, displacement, first).displacement
        return _Fold(displacement, lying)

    def roughly(self, fold: _Fold) -> tuple[float, _Fold]:
        """Return an estimate of the creasing strain, and the fold at a compression before it.

        The nodes of the fold are held on its middle plane, pushed or pulled.
        """
        settings = self.settings
        strain, step = settings.first_strain, settings.strain_step
        fold = _Fold(self._held(strain, fold).displacement, fold.lying)
        cost = self.cost(strain, fold)
        if cost <= 0:
            raise CreasingError(
                f"a crease forms below a compression of {strain:.0%}, where the search begins: "
                "use a smaller first_strain"
            )
        while strain + step <= settings.largest_strain:
            try:
                deeper = _Fold(self._held(strain + step, fold).displacement, fold.lying)
            except CreasingError:
                step /= 2
                if step < settings.fine_step:
                    raise
                continue
            cost_before, cost = cost, self.cost(strain + step, deeper)
            if cost <= 0:
                return strain + step * cost_before / (cost_before - cost), fold
            strain, fold = strain + step, deeper
        largest = settings.largest_strain
        raise CreasingError(f"no crease forms up to a compression of {largest:.0%}")

    def in_contact(self, strain: float, fold: _Fold) -> _Fold:
        """Return the fold of depth 1 in equilibrium at a compression, searched from another one."""
        for _ in range(self.settings.active_set_changes):
            rest = self._held(strain, fold)
            pushed = fold.lying[rest.reaction[2 * fold.lying] > 0]
            x = self.body.nodes[self.surface, 0] + rest.displacement[self.surface, 0]
            lying = np.union1d(pushed, self.surface[x < -self.settings.overlap])
            if np.array_equal(lying, fold.lying):
                return _Fold(rest.displacement, lying, float(rest.reaction[1]))
            fold = _Fold(rest.displacement, lying)
        raise CreasingError(
            f"the contact of the fold did not converge at a compression of {strain:.1%}"
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
            raise CreasingError(f"a fold has no equilibrium at a compression of {strain:.1%}")
        return rest


def _fan(settings: CreasingSettings) -> skfem.MeshTri:
    """Return a quarter disc of rings that grow in proportion to their radius; node 0 its centre."""
    sectors, growth = settings.sectors, settings.rim / settings.finest
    turn = 0.5 * math.pi / sectors
    rings = math.ceil(math.log(growth) / math.log1p(turn))
    radius = settings.finest * growth ** (np.arange(rings + 1) / rings)
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
