"""Linear stability of compressed surfaces: Biot's half-space, and the tangent of a meshed block."""

from __future__ import annotations

import numpy as np
import pytest

from fem2d.analyses.wrinkling import Layer, StabilityError, wrinkling
from fem2d.body.body import Body
from fem2d.body.kinematics import Plane
from fem2d.materials.library import configuration
from fem2d.materials.neo_hookean import NeoHookean
from tests.support.section_problems import at_rest, squares

BULK = NeoHookean(0.0041867, poisson=0.49)
SURFACE = [Layer(configuration("L2-Ogden")["dermis"], 1.2), Layer(BULK, 10.8)]


def test_biots_half_space() -> None:
    """Incompressible neo-Hookean in plane strain: λ = 0.5437 at every wavelength."""
    surface = [Layer(NeoHookean(0.01, poisson=0.49999), 12.0)]
    found = wrinkling(surface, plane=Plane.STRAIN, wavelengths_mm=[0.5, 1.0, 2.0])
    np.testing.assert_allclose(found.strains, 1 - 0.5437, atol=2e-4)
    assert np.ptp(found.strains) < 1e-4


@pytest.mark.parametrize(
    ("plane", "stable", "unstable"), [(Plane.STRESS, 0.18, 0.20), (Plane.STRAIN, 0.12, 0.16)]
)
def test_dermis_on_bulk_wrinkles_where_a_meshed_block_loses_stability(
    plane: Plane, stable: float, unstable: float
) -> None:
    """Half a wavelength between rollers: the tangent's lowest eigenvalue changes sign there."""
    lengths = np.geomspace(8, 32, 9)
    found = wrinkling(SURFACE, plane=plane, wavelengths_mm=lengths)
    assert stable < found.strain < unstable
    assert 10 < found.wavelength_mm < 20
    width = found.wavelength_mm / 2
    y = np.concatenate([np.linspace(0, 10.8, 9), np.linspace(10.8, 12, 4)[1:]])
    mesh = squares("T6", np.linspace(0, width, 9), y)
    mesh = mesh.with_subdomains(
        {"dermis": lambda x: x[1] > 10.8, "bulk": lambda x: x[1] < 10.8}
    ).with_boundaries(
        {
            "left": lambda x: x[0] < 1e-9,
            "right": lambda x: x[0] > width - 1e-9,
            "bottom": lambda x: x[1] < 1e-9,
        }
    )
    laws = {"dermis": SURFACE[0].material, "bulk": SURFACE[1].material}
    body = Body(mesh, laws, plane=plane)
    left, right, low = (body.boundary_nodes(name) for name in ("left", "right", "bottom"))
    fixed = np.concatenate([2 * left, 2 * right, 2 * low + 1])
    free = np.setdiff1d(np.arange(body.pattern.size), fixed)
    lowest = []
    for strain in (0.985 * found.strain, 1.015 * found.strain):
        values = np.where(np.isin(fixed, 2 * right), -strain * width, 0.0)
        rest = at_rest(body, fixed, values, start=homogeneous(body, strain))
        assert np.ptp(rest.displacement[body.nodes[:, 1] > 12 - 1e-9, 1]) < 1e-6
        stiffness = body.pattern.matrix(body.response(rest.displacement).stiffness)
        lowest.append(np.linalg.eigvalsh(stiffness[free][:, free].toarray())[0])
    assert lowest[0] > 0 > lowest[1]


def homogeneous(body: Body, strain: float) -> np.ndarray:
    """A flat start near the compressed state, so that Newton's method stays on the flat branch."""
    return body.nodes * [-strain, 0.6 * strain]


def test_a_thin_stiff_film_follows_the_sandwich_formula() -> None:
    """Strain (3 Eₛ/E_f)^(2/3)/4 and wavelength 2πh (E_f/3Eₛ)^(1/3) of plane-strain moduli."""
    ratio = 200.0
    film, deep = NeoHookean(1.0, poisson=0.49), NeoHookean(1.0 / ratio, poisson=0.49)
    found = wrinkling(
        [Layer(film, 0.1), Layer(deep, 12.0)],
        plane=Plane.STRAIN,
        wavelengths_mm=np.geomspace(1, 6, 15),
    )
    assert found.strain == pytest.approx((3 / ratio) ** (2 / 3) / 4, rel=0.04)
    assert found.wavelength_mm == pytest.approx(2 * np.pi * 0.1 * (ratio / 3) ** (1 / 3), rel=0.08)


def test_nonsense_is_refused() -> None:
    with pytest.raises(StabilityError, match="AXISYMMETRIC"):
        wrinkling(SURFACE, plane=Plane.AXISYMMETRIC)
    with pytest.raises(StabilityError, match="thickness_mm"):
        wrinkling([Layer(BULK, 0.0)], plane=Plane.STRAIN)
    with pytest.raises(StabilityError, match="at least one layer"):
        wrinkling([], plane=Plane.STRAIN)
