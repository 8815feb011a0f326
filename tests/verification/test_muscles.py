"""Muscles against closed forms: sleeves on tubes, a free ring, a free strip.

A sleeve of fibres around a rigid tube, isometric, presses on it with ``p = S ln(b/a)``: from
``dσ_r/dr = (σ_θ − σ_r)/r`` with ``σ_θ = S + σ_r``. A thin ring, or a strip, of neo-Hookean tissue
that nothing holds shortens until ``2 C₁₀ (λ − λ⁻²) + α σ₀ f(λ) = 0``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import skfem

from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.loads.amplitude import Amplitude
from fem2d.loads.muscle import FibresAcross, FibresInPlane, MuscleLoad
from fem2d.loads.muscle_law import MuscleFibre
from fem2d.materials.neo_hookean import NeoHookean
from tests.support.muscle_problems import at_rest

C10 = 0.004292
NEARLY_INCOMPRESSIBLE = 0.4999
HEIGHT_MM = 2.0


@dataclass(frozen=True)
class Sleeve:
    """A sleeve between two radii, mm, its inner side on a rigid tube, its ends on rollers."""

    inner_mm: float
    outer_mm: float
    stress_mpa: float

    @property
    def pressure_mpa(self) -> float:
        return self.stress_mpa * float(np.log(self.outer_mm / self.inner_mm))

    def body(self, plane: Plane, material: NeoHookean) -> Body:
        radii = np.linspace(self.inner_mm, self.outer_mm, 13)
        mesh = skfem.MeshQuad.init_tensor(radii, np.linspace(0.0, HEIGHT_MM, 4)).with_boundaries(
            {
                "tube": lambda x: x[0] < self.inner_mm + 1e-9,
                "ends": lambda x: (x[1] < 1e-9) | (x[1] > HEIGHT_MM - 1e-9),
            }
        )
        return Body(mesh, material, plane=plane, element="Q8")

    def pressure_on_tube(self, plane: Plane, material: NeoHookean, depth_mm: float) -> float:
        """Return the mean pressure, MPa, over the inner side of ``depth_mm``."""
        body = self.body(plane, material)
        muscle = hoop(body, self.stress_mpa)
        tube, ends = body.boundary_nodes("tube"), body.boundary_nodes("ends")
        held = np.concatenate([2 * tube, 2 * ends + 1])
        found = at_rest(body, muscle, held)
        return float(found.reaction[2 * tube].sum()) / (depth_mm * HEIGHT_MM)


def hoop(body: Body, stress_mpa: float) -> MuscleLoad:
    """Return fibres everywhere that run around the axis x = 0, half active."""
    radius = body.tables.points[..., 0]
    curvature = np.stack([-1 / radius, np.zeros_like(radius)], axis=-1)
    law = MuscleFibre(2 * stress_mpa)
    share = np.ones(body.weights.shape)
    return MuscleLoad(
        "sleeve", body, share, FibresAcross(curvature), law, Amplitude((0.0,), (0.5,))
    )


SLEEVES = (
    pytest.param(Sleeve(13.0, 21.0, 0.020), 9.6e-3, id="marginal"),
    pytest.param(Sleeve(19.0, 27.0, 0.020), 7.0e-3, id="peripheral"),
    pytest.param(Sleeve(6.0, 16.0, 0.0272), 26.7e-3, id="lips on a tube"),
)


@pytest.mark.parametrize(("sleeve", "published"), SLEEVES)
def test_a_sleeve_presses_on_a_rigid_tube_in_axisymmetry(sleeve, published):
    """Tissue that cannot change its volume cannot move, so the fibres stay at their length.

    With ν = 0.4999 tissue still gives way by a few parts in ten thousand.
    """
    material = NeoHookean(C10, poisson=NEARLY_INCOMPRESSIBLE)
    pressure = sleeve.pressure_on_tube(Plane.AXISYMMETRIC, material, 2 * np.pi * sleeve.inner_mm)
    assert pressure == pytest.approx(sleeve.pressure_mpa, rel=5e-4)
    assert sleeve.pressure_mpa == pytest.approx(published, rel=5e-3)


@pytest.mark.parametrize("plane", [Plane.STRESS, Plane.STRAIN])
@pytest.mark.parametrize(("sleeve", "published"), SLEEVES)
def test_a_section_feels_the_curvature_of_fibres_across_it_as_that_pressure(
    sleeve, published, plane
):
    """The section knows no hoop stress: the pressure is ∫ S/R dR, carried inwards by stiff tissue.

    Tissue of C₁₀ = 1 MPa moves by hundredths of a millimetre, and f is 1 less 4 (u/R)².
    """
    material = NeoHookean(1.0, poisson=0.3)
    pressure = sleeve.pressure_on_tube(plane, material, 1.0)
    assert pressure == pytest.approx(sleeve.pressure_mpa, rel=1e-5)
    assert pressure == pytest.approx(published, rel=5e-3)


SHORTENINGS = ((0.9, 2.99e-3), (0.8, 7.79e-3), (0.7, 17.98e-3))


def needed_mpa(stretch: float) -> float:
    """Return α σ₀ that holds incompressible neo-Hookean tissue at a stretch, MPa."""
    return 2 * C10 * (stretch**-2 - stretch) / (1 - 4 * (1 - stretch) ** 2)


@pytest.mark.parametrize(("stretch", "published"), SHORTENINGS)
def test_a_free_thin_ring_shortens_until_tissue_and_fibres_balance(stretch, published):
    active = needed_mpa(stretch)
    assert active == pytest.approx(published, rel=2e-3)
    mesh = skfem.MeshQuad.init_tensor(np.array([10.0, 10.01]), np.array([0.0, 0.01]))
    bottom = mesh.with_boundaries({"bottom": lambda x: x[1] < 1e-9})
    material = NeoHookean(C10, poisson=NEARLY_INCOMPRESSIBLE)
    body = Body(bottom, material, plane=Plane.AXISYMMETRIC, element="Q8")
    found = at_rest(body, hoop(body, active), 2 * body.boundary_nodes("bottom") + 1, steps=8)
    radius = body.nodes[:, 0] + found.displacement[:, 0]
    assert np.mean(radius / body.nodes[:, 0]) == pytest.approx(stretch, abs=2e-5)


@pytest.mark.parametrize(("stretch", "published"), SHORTENINGS)
@pytest.mark.parametrize("angle_deg", [0.0, 35.0])
def test_a_free_strip_shortens_along_fibres_in_the_plane(stretch, published, angle_deg):
    """Plane stress: the strip is free in width and thickness, so it is in uniaxial stress."""
    active = needed_mpa(stretch)
    angle = np.deg2rad(angle_deg)
    along = np.array([np.cos(angle), np.sin(angle)])
    mesh = skfem.MeshTri.init_tensor(np.linspace(0, 4, 5), np.linspace(0, 2, 4))
    turn = np.array([[along[0], -along[1]], [along[1], along[0]]])
    body = Body(
        type(mesh)(turn @ mesh.p, mesh.t),
        NeoHookean(C10, poisson=NEARLY_INCOMPRESSIBLE),
        plane=Plane.STRESS,
    )
    direction = np.broadcast_to(along, (*body.weights.shape, 2))
    law, on = MuscleFibre(active), Amplitude((0.0,), (1.0,))
    strip = MuscleLoad(
        "strip", body, np.ones(body.weights.shape), FibresInPlane(direction), law, on
    )
    corner = int(np.argmin(np.hypot(*body.nodes.T)))
    end = int(np.argmin(np.hypot(*(body.nodes - 4 * along).T)))
    across = np.array([-along[1], along[0]])
    # Held at one corner, and the far corner of the same side against turning.
    held = np.array([2 * corner, 2 * corner + 1])
    found = at_rest(body, strip, held, roller=(end, across), steps=8)
    moved = (body.nodes + found.displacement) @ along
    assert np.ptp(moved) / 4.0 == pytest.approx(stretch, abs=2e-5)
    assert published == pytest.approx(active, rel=2e-3)
