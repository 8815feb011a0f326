"""A model of the suction test: a layered slab of tissue under a rigid cup, axisymmetric.

Thesis section 3.1.2 and Figures 3.3 and 3.4: right side pinned, bottom fixed, axis guided,
frictionless contact, suction on the surface inside the cup. The figures that showed the sizes are
lost; the defaults here are assumed openly, and are those at which the thesis' four calibrated
configurations agree best with one another.

The axis is x = 0, the undeformed surface y = 0 and the tissue below it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import skfem
from numpy.typing import NDArray

from fem2d.body.body import Body
from fem2d.contact.laws import FrictionLaw, NormalLaw
from fem2d.contact.rigid import RigidContact
from fem2d.loads.load import Load
from fem2d.loads.pressure import Exposure, FollowerPressure
from fem2d.materials.material import Material
from fem2d.solvers.linear import DirectSolver, fastest_solver
from fem2d.solvers.model import Model
from fem2d.solvers.static import StaticResult, Steering, kept_at, solve_static, static_step
from fem2d.threads import Threads
from geometry2d.curves import graded
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting
from geometry2d.outline import Outline

Array = NDArray[np.float64]

MPA_PER_KPA = 1e-3
CUP_HEIGHT_MM = 20.0
"""Of the drawn and modelled part of the cup's wall; tissue never gets that far."""
ASSUMED = "assumed: the thesis' size is lost with its figure"


class SuctionError(DrinksimError):
    """A suction test was described that cannot be done."""


@dataclass(frozen=True)
class SuctionOptions:
    """Sizes of device and slab, and how finely they are computed."""

    aperture_radius_mm: float = setting(
        default=6.0, unit="mm", minimum=0.1, maximum=100.0,
        description="radius of the cup's opening", source=ASSUMED,
    )  # fmt: skip
    rim_fillet_mm: float = setting(
        default=1.2, unit="mm", minimum=0.01, maximum=20.0,
        description="rounding of the cup's rim", source=ASSUMED,
    )  # fmt: skip
    cup_radius_mm: float = setting(
        default=16.5, unit="mm", minimum=0.2, maximum=200.0,
        description="outer radius of the cup", source="LASTIC, 33 mm; not checked in print",
    )  # fmt: skip
    slab_radius_mm: float = setting(
        default=30.0, unit="mm", minimum=1.0, maximum=500.0,
        description="radius of the slab", source=ASSUMED,
    )  # fmt: skip
    slab_height_mm: float = setting(
        default=20.0, unit="mm", minimum=0.5, maximum=500.0,
        description="height of the slab", source=ASSUMED,
    )  # fmt: skip
    dermis_mm: float = setting(
        default=1.195, unit="mm", minimum=0.01, maximum=100.0,
        description="thickness of the dermis", source="thesis Table 3.4",
    )  # fmt: skip
    hypodermis_mm: float = setting(
        default=2.87, unit="mm", minimum=0.01, maximum=100.0,
        description="thickness of the hypodermis, where there is one", source="thesis Table 3.4",
    )  # fmt: skip
    edge_mm: float = setting(
        default=0.25, unit="mm", minimum=0.02, maximum=5.0,
        description="length of an element's edge at the rim",
    )  # fmt: skip
    element: Literal[
        "Q8R", "Q8", "Q8M", "Q8RM", "Q4", "Q4M", "Q4R", "T6", "T6M", "T3"
    ] = setting(
        default="Q8R", description="element type", source="the thesis' CAX8R",
    )  # fmt: skip
    contact_mpa_per_mm: float = setting(
        default=10.0, unit="MPa/mm", minimum=1e-3, maximum=1e4,
        description="stiffness of the contact penalty",
    )  # fmt: skip
    clearance_mm: float = setting(
        default=0.02, unit="mm", minimum=1e-4, maximum=1.0,
        description="gap to the rim at which the suction acts in full",
    )  # fmt: skip

    def __post_init__(self) -> None:
        if self.aperture_radius_mm + self.rim_fillet_mm >= self.slab_radius_mm:
            raise SuctionError(
                f"an aperture of radius {self.aperture_radius_mm:g} mm and its rim do not fit on a "
                f"slab of radius {self.slab_radius_mm:g} mm: make slab_radius_mm larger"
            )
        if self.aperture_radius_mm + 2 * self.rim_fillet_mm > self.cup_radius_mm:
            raise SuctionError(
                f"a cup of radius {self.cup_radius_mm:g} mm has no room for an aperture of radius "
                f"{self.aperture_radius_mm:g} mm and two fillets of {self.rim_fillet_mm:g} mm: "
                "make cup_radius_mm larger"
            )

    @property
    def cup(self) -> Outline:
        """The cup's wall, cut through the axis."""
        a, b, r = self.aperture_radius_mm, self.cup_radius_mm, self.rim_fillet_mm
        corners = [(a, 0.0), (b, 0.0), (b, CUP_HEIGHT_MM), (a, CUP_HEIGHT_MM)]
        return Outline.from_corners(corners, [r, r, 0.0, 0.0])

    def refuse_ineffective(self, layers: Sequence[str]) -> None:
        """Refuse the thickness of a layer that a configuration, outermost first, does not have.

        Raises
        ------
        SuctionError
            If it is not the usual one.
        """
        usual = type(self).hypodermis_mm
        if "hypodermis" not in layers[:-1] and self.hypodermis_mm != usual:
            raise SuctionError(
                f"hypodermis_mm = {self.hypodermis_mm:g} mm has no effect: the tissue has no "
                "hypodermis above its last layer"
            )

    def depths(self, layers: Sequence[str]) -> dict[str, float]:
        """Return the thickness of each layer, outermost first, mm; the last fills the slab.

        A slab of one layer is cut at the depth of the dermis all the same, so that its strains can
        be compared with a dermis'.

        Raises
        ------
        SuctionError
            If a layer has no thickness of its own, or the layers are thicker than the slab.
        """
        known = {"dermis": self.dermis_mm, "hypodermis": self.hypodermis_mm}
        upper = list(layers[:-1]) or ["dermis"]
        for layer in upper:
            if layer not in known:
                raise SuctionError(
                    f"layer {layer!r} has no thickness: call upper layers dermis or hypodermis; "
                    "the last one may have any name and fills the slab"
                )
        thickness = {layer: known[layer] for layer in upper}
        rest = self.slab_height_mm - sum(thickness.values())
        if rest <= 0:
            raise SuctionError(
                f"{' and '.join(upper)} are {sum(thickness.values()):g} mm thick, the slab only "
                f"{self.slab_height_mm:g} mm: make slab_height_mm larger or the layers thinner"
            )
        thickness["below" if len(layers) == 1 else layers[-1]] = rest
        return thickness


def slab_mesh(options: SuctionOptions, layers: Sequence[str]) -> skfem.Mesh:
    """Return the slab's mesh with a subdomain for each layer.

    A tensor grid, finest around the rim and below the surface. Boundaries are "axis", "side",
    "bottom" and "surface".
    """
    thickness = options.depths(layers)
    rim = options.aperture_radius_mm + 0.5 * options.rim_fillet_mm
    half = 0.5 * options.rim_fillet_mm + 0.3

    def radial(points: Array) -> Array:
        away = np.maximum(np.abs(points[:, 0] - rim) - half, 0.0)
        outside = points[:, 0] > rim
        size: Array = options.edge_mm * (1 + away * np.where(outside, 0.6, 0.35))
        return np.minimum(size, np.where(outside, np.inf, 3 * options.edge_mm))

    def vertical(points: Array) -> Array:
        size: Array = options.edge_mm * (1 + 0.5 * points[:, 0])
        return size

    x = graded(np.array([[0.0, 0.0], [options.slab_radius_mm, 0.0]]), radial)[:, 0]
    levels, top = [np.zeros(1)], 0.0
    for depth in thickness.values():
        levels.append(graded(np.array([[top, 0.0], [top + depth, 0.0]]), vertical)[1:, 0])
        top += depth
    y = -np.concatenate(levels)[::-1]
    mesh: skfem.Mesh = skfem.MeshQuad.init_tensor(x, y)
    if options.element.startswith("T"):
        mesh = mesh.to_meshtri(style="x")
    return _named(mesh, thickness, options)


def _named(mesh: skfem.Mesh, thickness: Mapping[str, float], options: SuctionOptions) -> skfem.Mesh:
    depth = -mesh.p[:, mesh.t].mean(axis=1)[1]
    below = np.cumsum([0.0, *thickness.values()])
    tiny = 1e-6
    return mesh.with_subdomains(
        {
            layer: np.flatnonzero((depth > below[k]) & (depth < below[k + 1]))
            for k, layer in enumerate(thickness)
        }
    ).with_boundaries(
        {
            "axis": lambda x: x[0] < tiny,
            "side": lambda x: x[0] > options.slab_radius_mm - tiny,
            "bottom": lambda x: x[1] < tiny - options.slab_height_mm,
            "surface": lambda x: x[1] > -tiny,
        }
    )


@dataclass(frozen=True)
class SuctionModel:
    """The slab under the cup, ready to be sucked.

    Attributes
    ----------
    fem_model
        The body, its supports, the cup and the suction.
    apex
        The node on the axis at the surface.
    upper
        Elements of the dermis (or of as deep a layer where there is none).
    sucked
        (e, q) which integration points lie in that layer under the aperture.
    """

    fem_model: Model
    apex: int
    upper: NDArray[np.int64]
    sucked: NDArray[np.bool_]

    @classmethod
    def of(cls, layers: Mapping[str, Material], options: SuctionOptions) -> SuctionModel:
        """Return the model for materials by layer, outermost first.

        Raises
        ------
        SuctionError
            If the layers do not fit the slab.
        """
        names = list(layers)
        mesh = slab_mesh(options, names)
        materials = dict(layers)
        if len(names) == 1:
            materials = {"dermis": layers[names[0]], "below": layers[names[0]]}
        body = Body(mesh, materials, plane="axisymmetric", element=options.element)
        held = np.union1d(body.dofs("axis", along="x"), body.dofs("side", "bottom"))
        surface = body.surface("surface")
        free_friction = FrictionLaw(coefficient=0.0)
        law = NormalLaw(options.contact_mpa_per_mm, 1e-2 / options.contact_mpa_per_mm)
        contact = RigidContact(
            surface, options.cup, normal=law, friction=free_friction, moving=False, name="cup"
        )
        sealed_from = options.aperture_radius_mm + options.rim_fillet_mm
        exposure = Exposure(options.cup, sealed_from, options.clearance_mm)
        on_axis = np.flatnonzero(np.all(np.abs(body.nodes) < 1e-9, axis=1))
        sucked = np.zeros(body.weights.shape, bool)
        sucked[body.elements_of("dermis")] = True
        sucked &= body.tables.points[..., 0] < options.aperture_radius_mm
        return cls(
            Model(
                body,
                contacts=(contact,),
                loads=(FollowerPressure(surface, exposure),),
                held=held,
            ),
            int(on_axis[0]),
            body.elements_of("dermis"),
            sucked,
        )

    def with_materials(self, layers: Mapping[str, Material]) -> SuctionModel:
        """Return the same model made of other materials for the same layers."""
        laws = tuple(layers.values())
        if len(laws) == 1:
            laws = (laws[0], laws[0])
        fem_model = self.fem_model
        body = fem_model.body.with_materials(laws)
        return replace(self, fem_model=replace(fem_model, body=body))

    def apex_mm(self, result: StaticResult) -> float:
        """Return how far the middle of the surface has risen, mm."""
        return float(result.displacement[self.apex, 1])

    @cached_property
    def threads(self) -> Threads:
        """The threads that share this model's work."""
        return Threads()

    @cached_property
    def solver(self) -> DirectSolver:
        """The solver that this model's matrices go through, analysed once."""
        return fastest_solver()

    def solve_at_suctions(
        self, suction_kpa: Iterable[float], *, start: StaticResult | None = None
    ) -> Iterator[StaticResult]:
        """Yield the equilibrium at each suction, kPa; ends early with one not found.

        Between suctions as many steps are taken as Newton's method needs.
        """
        state = start or kept_at(self.fem_model)
        for suction in suction_kpa:
            load = Load(pressure_mpa=-suction * MPA_PER_KPA)
            state = solve_static(
                self.fem_model, load, start=state, solver=self.solver, threads=self.threads
            )
            yield state
            if not state.converged:
                return

    def raised_to(self, apex_mm: Iterable[float], *, start: StaticResult) -> Iterator[StaticResult]:
        """Yield the equilibrium at each apex displacement, mm, the suction being solved for.

        Goes round limit points of the suction. Ends early with one not found.
        """
        state = start
        for apex in apex_mm:
            state = static_step(
                self.fem_model, state, state.load, solver=self.solver,
                further=Steering(2 * self.apex + 1, apex), threads=self.threads,
            )  # fmt: skip
            yield state
            if not state.converged:
                return
