"""Stress and tangent are derivatives of the energy; rotations do not matter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.material import (
    Array,
    Material,
    MaterialError,
    compressibility,
    poisson_ratio,
)
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden

C, S = math.cos(math.radians(41)), math.sin(math.radians(41))
LAWS: dict[str, Material] = {
    "neo-hookean": NeoHookean(0.005, poisson=0.49),
    "ogden-1": Ogden((0.05,), (10.789,), poisson=0.49),
    "ogden-3": Ogden((0.4095, 0.003, 0.01), (1.3, 5.0, -2.0), (0.05, 0.2, 3.0)),
    "hgo-two": HolzapfelGasserOgden(
        0.1007, 0.5, 0.1327, 0.1404, fibres=((C, S, 0.0), (C, -S, 0.0)), poisson=0.45
    ),
    "hgo-aligned": HolzapfelGasserOgden(
        0.1, 0.3, 0.05, 0.0, fibres=((1.0, 2.0, 2.0),), poisson=0.4
    ),
    "hgo-isotropic": HolzapfelGasserOgden(0.1, 0.3, 0.05, 1 / 3, poisson=0.49),
}


def rotation(rng: np.random.Generator) -> Array:
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    if np.linalg.det(q) < 0:
        q[:, 0] *= -1
    return q


def stretched(rng: np.random.Generator, stretches: Array) -> Array:
    return rotation(rng) @ np.diag(stretches) @ rotation(rng).T


def gradients() -> dict[str, Array]:
    """J in 0.6 … 1.6, stretches to 3, coincident ones, pure rotations."""
    rng = np.random.default_rng(2)
    cases = {}
    for i in range(6):
        e = rng.uniform(-0.7, 0.7, 3)
        e += (math.log(rng.uniform(0.6, 1.6)) - e.sum()) / 3
        cases[f"random {i}"] = stretched(rng, np.exp(e))
    cases["stretch 3"] = stretched(rng, np.array([3.0, 0.6, 1.6 / 1.8]))
    cases["two alike"] = stretched(rng, np.array([1.3, 1.3, 0.7]))
    cases["two nearly alike"] = stretched(rng, np.array([1.3, 1.3 * (1 + 1e-9), 0.7]))
    cases["two almost alike"] = stretched(rng, np.array([1.3, 1.3 * (1 + 1e-5), 0.7]))
    cases["all alike"] = stretched(rng, np.array([1.1, 1.1, 1.1]))
    cases["rotation"] = rotation(rng)
    cases["identity"] = np.eye(3)
    return cases


@pytest.fixture(params=gradients().items(), ids=lambda item: item[0])
def gradient(request: pytest.FixtureRequest) -> Array:
    F: Array = request.param[1]
    return F


def differences(function, F: Array, step: float) -> Array:
    """Fourth-order central differences of ``function`` by the entries of F, added as last axes."""
    columns = []
    for i in range(3):
        for J in range(3):
            d = np.zeros((3, 3))
            d[i, J] = step
            columns.append(
                (
                    8 * (function(F + d) - function(F - d))
                    - function(F + 2 * d)
                    + function(F - 2 * d)
                )
                / (12 * step)
            )
    stacked = np.stack(columns, axis=-1)
    return stacked.reshape(*stacked.shape[:-1], 3, 3)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_stress_is_the_derivative_of_energy(law: Material, gradient: Array) -> None:
    P = law.first_piola_kirchhoff(gradient)
    expected = differences(law.energy, gradient, 2e-4)
    # Where fibres begin to carry, the energy's third derivative jumps under the differences.
    kinked = isinstance(law, HolzapfelGasserOgden) and fibre_strain_is_zero(law, gradient)
    size = max(np.abs(P).max(), law.shear_modulus_mpa)
    assert np.abs(P - expected).max() <= (1e-4 if kinked else 1e-6) * size


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_tangent_is_the_derivative_of_stress(law: Material, gradient: Array) -> None:
    if isinstance(law, HolzapfelGasserOgden) and fibre_strain_is_zero(law, gradient):
        pytest.skip("fibres begin to carry here: the tangent jumps")
    A = law.tangent(gradient)
    expected = differences(law.first_piola_kirchhoff, gradient, 2e-4)
    assert np.abs(A).max() > 0.1 * law.shear_modulus_mpa
    assert np.abs(A - expected).max() <= 1e-6 * np.abs(A).max()
    assert np.abs(A - np.einsum("iJkL->kLiJ", A)).max() <= 1e-13 * np.abs(A).max()


def fibre_strain_is_zero(law: HolzapfelGasserOgden, F: Array) -> bool:
    unimodular = F / np.linalg.det(F) ** (1 / 3)
    strains = [np.trace(unimodular @ M @ unimodular.T) - 1 for M in law.structure]
    return bool(np.min(np.abs(strains)) < 1e-2)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_energy_does_not_see_rotations_and_stress_turns_with_them(law: Material) -> None:
    rng = np.random.default_rng(3)
    F, Q = stretched(rng, np.array([1.4, 0.8, 0.95])), rotation(rng)
    assert law.energy(Q @ F) == pytest.approx(law.energy(F), rel=1e-12)
    P = law.first_piola_kirchhoff(F)
    np.testing.assert_allclose(
        law.first_piola_kirchhoff(Q @ F), Q @ P, atol=1e-12 * np.abs(P).max()
    )
    kirchhoff = P @ F.T
    np.testing.assert_allclose(kirchhoff, kirchhoff.T, atol=1e-12 * np.abs(P).max())
    assert np.abs(law.first_piola_kirchhoff(Q)).max() < 1e-12 * law.bulk_modulus_mpa


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_tangent_at_rest_is_linear_elasticity_with_the_named_moduli(law: Material) -> None:
    if isinstance(law, HolzapfelGasserOgden):
        law = HolzapfelGasserOgden(law.C10_mpa, 0.0, law.k2, law.kappa, law.D_per_mpa, law.fibres)
    one = np.eye(3)
    mu, bulk = law.shear_modulus_mpa, law.bulk_modulus_mpa
    expected = (bulk - 2 * mu / 3) * np.einsum("ij,kl->ijkl", one, one) + mu * (
        np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one)
    )
    np.testing.assert_allclose(law.tangent(one), expected, atol=1e-13 * bulk)


def test_many_points_at_once_give_what_single_points_give() -> None:
    F = np.stack(list(gradients().values()))[:12].reshape(3, 4, 3, 3)
    for law in LAWS.values():
        assert law.energy(F).shape == (3, 4)
        assert law.first_piola_kirchhoff(F).shape == (3, 4, 3, 3)
        assert law.tangent(F).shape == (3, 4, 3, 3, 3, 3)
        np.testing.assert_allclose(law.tangent(F)[1, 2], law.tangent(F[1, 2]), rtol=1e-12)


@given(
    ratio=st.floats(-14, -1),
    alpha=st.floats(-12, 12).filter(lambda a: abs(a) > 0.1),
    stretch=st.floats(0.5, 2.0),
)
@settings(max_examples=60, deadline=None)
def test_the_stress_quotient_is_smooth_across_equal_stretches(
    ratio: float, alpha: float, stretch: float
) -> None:
    """(τ₁ − τ₂)/(λ₁² − λ₂²) enters as A_1212: it tends to its limit like the distance."""
    law = Ogden((0.1,), (alpha,), poisson=0.45)
    apart = 10.0**ratio
    limit = law.tangent(np.diag([stretch, stretch, 1.0]))[0, 1, 0, 1]
    near = law.tangent(np.diag([stretch * (1 + apart), stretch, 1.0]))[0, 1, 0, 1]
    assert near == pytest.approx(limit, rel=20 * apart + 1e-13)


def test_neo_hookean_is_the_ogden_law_with_alpha_two() -> None:
    F = gradients()["random 1"]
    one, other = NeoHookean(0.4, 0.3), Ogden((0.8,), (2.0,), (0.3,))
    assert one.energy(F) == pytest.approx(other.energy(F), rel=1e-14)
    J = np.linalg.det(F)
    I1 = np.sum(F**2) / J ** (2 / 3)
    assert one.energy(F) == pytest.approx(0.4 * (I1 - 3) + (J - 1) ** 2 / 0.3, rel=1e-12)


def test_ogden_volumetric_terms_have_the_exponents_2_4_6() -> None:
    law = Ogden((1.0, 1.0, 1.0), (2.0, 4.0, -2.0), (0.5, 0.25, 0.125))
    w = 0.2
    F = np.eye(3) * (1 + w) ** (1 / 3)
    assert law.energy(F) == pytest.approx(w**2 / 0.5 + w**4 / 0.25 + w**6 / 0.125, rel=1e-13)


def test_ogden_conventions_convert() -> None:
    law = Ogden.from_ogden_convention((0.63, 0.0012, -0.01), (1.3, 5.0, -2.0), (1.0,))
    assert law.mu_mpa == pytest.approx((0.4095, 0.003, 0.01))
    assert law.shear_modulus_mpa == pytest.approx(0.4225)


def test_hgo_energy_is_the_printed_formula() -> None:
    law = LAWS["hgo-two"]
    assert isinstance(law, HolzapfelGasserOgden)
    F = np.array([[1.2, 0.1, 0.0], [0.05, 0.95, 0.02], [0.0, 0.1, 0.9]])
    J = np.linalg.det(F)
    right = F.T @ F / J ** (2 / 3)
    expected = law.C10_mpa * (np.trace(right) - 3) + ((J**2 - 1) / 2 - np.log(J)) / law.D_per_mpa
    loaded = 0
    for fibre in law.fibres:
        strain = law.kappa * (np.trace(right) - 3) + (1 - 3 * law.kappa) * (
            fibre @ right @ fibre - 1
        )
        loaded += strain > 0
        expected += law.k1_mpa / (2 * law.k2) * (np.exp(law.k2 * max(strain, 0.0) ** 2) - 1)
    assert loaded >= 1
    assert law.energy(F) == pytest.approx(expected, rel=1e-12)


def test_shortened_fibres_carry_nothing() -> None:
    with_fibres = HolzapfelGasserOgden(0.1, 5.0, 0.3, 0.0, 0.2, ((1.0, 0.0, 0.0),))
    without = HolzapfelGasserOgden(0.1, 0.0, 0.3, 0.0, 0.2, ((1.0, 0.0, 0.0),))
    F = np.diag([0.8, 1.1, 1.1])
    assert with_fibres.energy(F) == without.energy(F)
    assert with_fibres.energy(np.diag([1.2, 1.0, 0.9])) > without.energy(np.diag([1.2, 1.0, 0.9]))


def test_isotropic_dispersion_forgets_the_direction() -> None:
    F = gradients()["random 2"]
    energies = [
        HolzapfelGasserOgden(0.1, 2.0, 0.3, 1 / 3, 0.2, (direction,)).energy(F)
        for direction in ((1.0, 0.0, 0.0), (0.3, -2.0, 1.0))
    ]
    assert energies[0] == pytest.approx(energies[1], rel=1e-13)


def test_poissons_ratio_there_and_back() -> None:
    for nu in (0.0, 0.3, 0.49, 0.4999):
        D = compressibility(0.02, nu)
        assert poisson_ratio(0.02, 2 / D) == pytest.approx(nu, abs=1e-12)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: NeoHookean(-0.1, 1.0), ("C10_mpa", "-0.1", "positive")),
        (lambda: NeoHookean(0.1, 0.0), ("D1_per_mpa", "0", "poisson")),
        (lambda: NeoHookean(0.1, poisson=0.5), ("poisson", "0.5", "0.49")),
        (lambda: Ogden((0.1, -0.2), (1.0, 2.0), (1.0,)), ("mu_mpa", "-0.1", "sum")),
        (lambda: Ogden((0.1,), (1.0, 2.0), (1.0,)), ("alpha", "2", "one alpha for each")),
        (lambda: Ogden((0.1,), (0.0,), (1.0,)), ("alpha", "0", "leave")),
        (lambda: Ogden((0.1,), (2.0,), (0.0,)), ("D_per_mpa", "0", "poisson")),
        (
            lambda: HolzapfelGasserOgden(0.1, 1.0, 1.0, 0.34, 1.0),
            ("kappa", "0.34", "1/3"),
        ),
        (
            lambda: HolzapfelGasserOgden(0.1, 1.0, 1.0, -0.1, 1.0),
            ("kappa", "-0.1", "aligned"),
        ),
        (
            lambda: HolzapfelGasserOgden(0.1, 1.0, 1.0, 1 / 3, 1.0, ((1, 0, 0), (0, 1, 0))),
            ("kappa", "2 families", "leave out"),
        ),
        (
            lambda: HolzapfelGasserOgden(0.1, 1.0, 1.0, 0.1, 1.0, ((0, 0, 0),)),
            ("fibres", "no length"),
        ),
        (
            lambda: LAWS["ogden-1"].energy(-np.eye(3)),
            ("deformation gradient", "-1", "positive"),
        ),
        (
            lambda: HolzapfelGasserOgden(0.1, 1.0, 1.0, 0.1, 1.0, ((1, 0, 1),)).packed(),
            ("fibres", "mirror"),
        ),
    ],
)
def test_nonsense_is_refused_with_name_value_and_remedy(build, words: tuple[str, ...]) -> None:
    with pytest.raises(MaterialError) as error:
        build()
    for word in words:
        assert word in str(error.value)


def test_a_negative_term_is_fine_as_long_as_the_sum_is_positive() -> None:
    assert Ogden((0.3, -0.1), (2.0, -3.0), (1.0,)).shear_modulus_mpa == pytest.approx(0.2)
