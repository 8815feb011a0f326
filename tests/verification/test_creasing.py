"""Creases: where a fold costs as much energy as a flat surface."""

from __future__ import annotations

import pytest

from fem2d.analyses.creasing import CreasingError, CreasingSettings, creasing
from fem2d.analyses.wrinkling import Layer, wrinkling
from fem2d.body.kinematics import Plane
from fem2d.materials.library import material_named
from fem2d.materials.neo_hookean import NeoHookean

pytestmark = pytest.mark.slow

NEARLY_INCOMPRESSIBLE = NeoHookean(0.005, poisson=0.49)


def test_a_neo_hookean_half_space_creases_where_published() -> None:
    """Incompressible, plane strain: 0.354 (Hong, Zhao and Suo 2009 print 0.35)."""
    found = creasing(
        NEARLY_INCOMPRESSIBLE, plane=Plane.STRAIN, settings=CreasingSettings(sectors=8)
    )
    assert found.strain == pytest.approx(0.354, rel=0.005)
    # A fold of any depth costs the same there, so none need be held; the search does not use this.
    # 0.005 is what 0.2 % in strain would need.
    assert abs(found.force) < 0.005


def test_creases_come_before_waves_on_the_homogeneous_skin_and_do_not_know_its_stiffness() -> None:
    law = material_named("L1")
    for plane in (Plane.STRESS, Plane.STRAIN):
        found = creasing(law, plane=plane, settings=CreasingSettings(sectors=6))
        waves = wrinkling([Layer(law, 12.0)], plane=plane, wavelengths_mm=[1.0])
        assert 0.7 * waves.strain < found.strain < 0.9 * waves.strain
    stiff = creasing(
        NeoHookean(0.5, poisson=0.49), plane=Plane.STRAIN, settings=CreasingSettings(sectors=6)
    )
    assert stiff.strain == pytest.approx(found.strain, abs=2e-5)


def test_nonsense_is_refused() -> None:
    with pytest.raises(CreasingError, match="AXISYMMETRIC"):
        creasing(NEARLY_INCOMPRESSIBLE, plane=Plane.AXISYMMETRIC)
    with pytest.raises(CreasingError, match="sectors = 1"):
        creasing(NEARLY_INCOMPRESSIBLE, plane=Plane.STRAIN, settings=CreasingSettings(sectors=1))
