"""A cube under homogeneous stretch against the closed forms, and rubber against Treloar."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from fem2d.analyses.homogeneous import Mode, homogeneous_response
from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.library import material_named
from fem2d.materials.material import Array
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden

STRETCHES = np.array([0.6, 0.8, 0.9, 0.99, 1.01, 1.05, 1.1, 1.2, 1.3, 1.5, 2.0])
# Exponent of the free sides' stretch, for each mode: λ, other loaded or held side, free thickness.
SIDES = {Mode.UNIAXIAL: (-0.5, -0.5), Mode.EQUIBIAXIAL: (1.0, -2.0), Mode.PLANAR: (0.0, -1.0)}
NEARLY = 1e-13
"""D (1/MPa) that stands for incompressible: pressures stay exact, ln J is the unknown."""


@pytest.mark.parametrize("mode", list(SIDES), ids=lambda mode: mode.name.lower())
@pytest.mark.parametrize("alpha", [2.0, 10.789, -3.0])
def test_incompressible_ogden_and_neo_hookean(mode: Mode, alpha: float) -> None:
    """Nominal stress Σ (2μ/α)(λ^(α−1) − λ^m), m = −α/2−1, −2α−1, −α−1
    (Ogden, *Non-Linear Elastic Deformations*, 1984, chapter 7)."""
    mu = 0.05
    exponent = {
        Mode.UNIAXIAL: -alpha / 2 - 1,
        Mode.EQUIBIAXIAL: -2 * alpha - 1,
        Mode.PLANAR: -alpha - 1,
    }[mode]
    expected = 2 * mu / alpha * (STRETCHES ** (alpha - 1) - STRETCHES**exponent)
    laws: list[Ogden | NeoHookean] = [Ogden((mu,), (alpha,), (NEARLY,))]
    if alpha == 2:
        laws.append(NeoHookean(mu / 2, NEARLY))
    for law in laws:
        curve = homogeneous_response(law, mode, STRETCHES)
        np.testing.assert_allclose(curve.nominal_mpa, expected, rtol=1e-8)
        J = np.prod(curve.stretches, axis=1)
        np.testing.assert_allclose(curve.cauchy_mpa, expected * STRETCHES / J, rtol=1e-8)


@pytest.mark.parametrize("mode", list(SIDES), ids=lambda mode: mode.name.lower())
def test_incompressible_isotropic_fibres(mode: Mode) -> None:
    """Nominal stress 2(λ − λᵉ)[C10 + (k1/3) E exp(k2 E²)] with E = (I1 − 3)/3, from the
    energy of Gasser, Ogden and Holzapfel (2006) with κ = 1/3."""
    C10, k1, k2 = 0.025, 24.491, 0.1327
    law = HolzapfelGasserOgden(C10, k1, k2, 1 / 3, NEARLY)
    side, thickness = (STRETCHES**power for power in SIDES[mode])
    I1 = STRETCHES**2 + side**2 + thickness**2
    E = (I1 - 3) / 3
    exponent = {Mode.UNIAXIAL: -2, Mode.EQUIBIAXIAL: -5, Mode.PLANAR: -3}[mode]
    slope = C10 + k1 / 3 * E * np.exp(k2 * E**2)
    expected = 2 * (STRETCHES - STRETCHES**exponent) * slope
    curve = homogeneous_response(law, mode, STRETCHES)
    np.testing.assert_allclose(curve.nominal_mpa, expected, rtol=1e-8)


def kirchhoff(law: Ogden, stretches: tuple[float, float, float]) -> Array:
    """Principal Kirchhoff stresses as the textbook writes them, term by term."""
    J = math.prod(stretches)
    bar = np.array(stretches) / J ** (1 / 3)
    tau = np.zeros(3)
    for mu, alpha in zip(law.mu_mpa, law.alpha, strict=True):
        tau += 2 * mu / alpha * (bar**alpha - np.mean(bar**alpha))
    for k, D in enumerate(law.D_per_mpa, start=1):
        tau += J * 2 * k / D * (J - 1) ** (2 * k - 1)
    return tau


@pytest.mark.parametrize("mode", list(SIDES), ids=lambda mode: mode.name.lower())
@pytest.mark.parametrize(
    "law",
    [
        Ogden((0.05,), (10.789,), poisson=0.49),
        Ogden((0.0084,), (2.0,), poisson=0.49),
        Ogden((0.4, -0.1), (1.5, -2.0), (0.06, 0.5)),
    ],
    ids=["dermis", "neo-hookean", "two terms"],
)
def test_compressible_laws_against_an_independent_root(mode: Mode, law: Ogden) -> None:
    curve = homogeneous_response(law, mode, STRETCHES)
    for stretch, nominal in zip(STRETCHES, curve.nominal_mpa, strict=True):

        def free(t: float, stretch: float = stretch) -> tuple[float, float, float]:
            return {
                Mode.UNIAXIAL: (stretch, t, t),
                Mode.EQUIBIAXIAL: (stretch, stretch, t),
                Mode.PLANAR: (stretch, 1.0, t),
            }[mode]

        thickness = brentq(lambda t: kirchhoff(law, free(t))[2], 0.1, 6.0, xtol=1e-15, rtol=1e-15)
        assert nominal == pytest.approx(kirchhoff(law, free(thickness))[0] / stretch, rel=1e-8)


def test_the_tables_of_facts_section_3() -> None:
    """Lateral stretch, J and nominal stress (kPa) at ν = 0.49, to all printed digits."""
    for law, rows in (
        (
            material_named("L2-Ogden/dermis"),
            {
                0.6: (1.278499, 0.980735, -234.593),
                0.8: (1.115785, 0.995981, -37.2739),
                1.1: (0.954744, 1.002691, 18.2721),
                1.2: (0.916562, 1.008103, 50.7129),
                1.3: (0.885367, 1.019038, 111.1769),
                1.5: (0.845265, 1.071709, 381.695),
            },
        ),
        (
            material_named("L2-Ogden/bulk"),
            {
                0.6: (1.285302, 0.991200, -18.5935),
                0.8: (1.115747, 0.995913, -6.5082),
                1.1: (0.954416, 1.002001, 2.3309),
                1.5: (0.820731, 1.010399, 8.9592),
            },
        ),
    ):
        curve = homogeneous_response(law, Mode.UNIAXIAL, list(rows))
        lateral, J, nominal = np.array(list(rows.values())).T
        np.testing.assert_allclose(curve.stretches[:, 1], lateral, atol=6e-7)
        np.testing.assert_allclose(np.prod(curve.stretches, axis=1), J, atol=6e-7)
        np.testing.assert_allclose(1e3 * curve.nominal_mpa, nominal, rtol=1.5e-5)


def test_fibre_card_along_and_across_the_langer_lines() -> None:
    """Computed apart from the energy, incompressible, two families at ± 41°: nominal MPa."""
    card = material_named("ni-annaidh-2012/dermis")
    assert isinstance(card, HolzapfelGasserOgden)
    law = dataclasses.replace(card, D_per_mpa=NEARLY)
    stretches = [1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.4, 1.5]
    along = [0.0806, 0.3126, 1.172, 2.743, 4.796, 7.310, 13.79, 22.40]
    across = [0.0348, 0.0793, 0.1519, 0.3220, 0.8784, 2.029, 5.486, 10.37]
    for axis, expected in ((0, along), (1, across)):
        curve = homogeneous_response(law, Mode.UNIAXIAL, stretches, axis=axis)
        np.testing.assert_allclose(curve.nominal_mpa, expected, rtol=1e-3)


def test_isotropic_fibre_cards() -> None:
    """Nominal kPa at λ = 1.05, 1.1, 1.2, 1.3, 1.5, from the closed form for κ = 1/3."""
    stretches = [1.05, 1.1, 1.2, 1.3, 1.5]
    for name, expected in (
        ("ni-annaidh-2012/isotropic", [34.45, 97.12, 395.8, 1025, 3586]),
        ("L2-GOH/dermis", [12.80, 55.64, 318.8, 916.8, 3421]),
    ):
        card = material_named(name)
        assert isinstance(card, HolzapfelGasserOgden)
        law = dataclasses.replace(card, D_per_mpa=NEARLY)
        curve = homogeneous_response(law, Mode.UNIAXIAL, stretches)
        np.testing.assert_allclose(1e3 * curve.nominal_mpa, expected, rtol=5e-4)


def test_simple_shear_of_the_neo_hookean_law() -> None:
    """σ12 = 2 C10 γ and σ11 − σ22 = 2 C10 γ²."""
    law, shear = NeoHookean(0.3, 0.01), 0.7
    F = np.eye(3)
    F[0, 1] = shear
    sigma = law.first_piola_kirchhoff(F) @ F.T
    assert sigma[0, 1] == pytest.approx(0.6 * shear, rel=1e-12)
    assert sigma[0, 0] - sigma[1, 1] == pytest.approx(0.6 * shear**2, rel=1e-12)


TRELOAR = {
    Mode.UNIAXIAL: """1.02 0.0255; 1.125 0.1344; 1.24 0.2256; 1.39 0.3169; 1.585 0.4081;
        1.90 0.5003; 2.18 0.5886; 2.42 0.6769; 3.02 0.8633; 3.57 1.0497;
        4.03 1.2263; 4.76 1.5892; 5.36 1.9522;
        5.75 2.3152; 6.15 2.6879; 6.40 3.0411; 6.60 3.4139; 6.85 3.7769; 7.05 4.1300""",
    Mode.EQUIBIAXIAL: """1.03 0.0925; 1.065 0.1570; 1.115 0.2387; 1.14 0.2570; 1.20 0.3282;
        1.31 0.4364; 1.42 0.5146; 1.68 0.6557; 1.94 0.7652; 2.49 0.9617; 3.03 1.2386; 3.43 1.4401;
        3.75 1.7096; 4.07 1.9845; 4.26 2.2065; 4.45 2.4426""",
    Mode.PLANAR: """1.03 0.0667; 1.12 0.1589; 1.19 0.2453; 1.31 0.3326; 1.46 0.4189; 1.84 0.5925;
        2.38 0.7652; 2.97 0.9418; 3.47 1.1183; 3.95 1.2851; 4.37 1.4617; 4.69 1.6285;
        4.97 1.8050""",
}


@pytest.mark.parametrize("mode", list(TRELOAR), ids=lambda mode: mode.name.lower())
def test_ogdens_rubber_follows_treloars_measurements(mode: Mode) -> None:
    points = np.array([list(map(float, pair.split())) for pair in TRELOAR[mode].split(";")])
    curve = homogeneous_response(material_named("ogden-1972/rubber"), mode, points[:, 0])
    # Below a stretch of 1.1 the thickness of a printed point is itself some 10 % of the stress.
    readable = points[:, 0] > 1.1
    relative = np.abs(curve.nominal_mpa[readable] / points[readable, 1] - 1)
    # Within 12 %, but for one point: at uniaxial 1.90 the set itself lies 13.8 % above the rubber.
    allowed = np.where((points[readable, 0] == 1.90) & (mode is Mode.UNIAXIAL), 0.14, 0.12)
    assert np.all(relative < allowed)


def test_ogdens_rubber_at_the_values_computed_by_hand() -> None:
    rubber = material_named("ogden-1972/rubber")
    for mode, stretches, expected in (
        (Mode.UNIAXIAL, [1.24, 3.02, 6.4, 7.05], [0.2373, 0.8854, 3.0933, 4.0811]),
        (Mode.EQUIBIAXIAL, [3.03], [1.2459]),
        (Mode.PLANAR, [3.47], [1.0875]),
    ):
        curve = homogeneous_response(rubber, mode, stretches)
        np.testing.assert_allclose(curve.nominal_mpa, expected, rtol=2e-4)


def test_instability_is_found_where_the_tangent_loses_definiteness() -> None:
    """A two-term law that softens: the strain reported is where the closed form turns."""
    soft = Ogden((1.2, -0.2), (0.5, -4.0), (1e-6,))
    curve = homogeneous_response(soft, Mode.UNIAXIAL, np.linspace(0.3, 4, 371))
    compression, tension = curve.unstable_log_strain
    assert math.isfinite(compression) or math.isfinite(tension)
    strain = compression if math.isfinite(compression) else tension
    e = np.array([strain, -strain / 2, -strain / 2])
    bar = np.exp(np.outer([0.5, -4.0], e))
    h = 2 * np.array([1.2, -0.2]) @ bar
    across = np.array([[1, -1, 0], [1, 1, -2]]) / np.sqrt([[2], [6]])
    reduced = across @ np.diag(h) @ across.T
    assert np.linalg.eigvalsh(reduced)[0] == pytest.approx(0, abs=0.02)
    assert any("unstable" in said for said in curve.warnings())


def test_stable_curves_say_nothing() -> None:
    curve = homogeneous_response(material_named("L1"), Mode.UNIAXIAL, np.linspace(0.1, 4, 79))
    assert curve.warnings() == []
    assert np.all(np.diff(curve.nominal_mpa) > 0)
