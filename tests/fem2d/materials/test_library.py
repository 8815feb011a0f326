"""Material files: what the library holds, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fem2d.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from fem2d.materials.library import (
    configuration,
    configuration_cards,
    library_materials,
    material_card,
    material_from,
    material_named,
)
from fem2d.materials.material import MaterialError, poisson_ratio, stiffened
from fem2d.materials.neo_hookean import NeoHookean
from fem2d.materials.ogden import Ogden


def test_every_card_loads_and_says_where_it_comes_from_and_what_was_read() -> None:
    names = library_materials()
    assert len(names) >= 20
    for name in names:
        card = material_card(name)
        assert card.material.shear_modulus_mpa > 0
        assert len(card.source) > 10 and len(card.reading) > 10, name


def test_the_configurations_are_those_of_table_3_5_with_its_rows_shifted_back() -> None:
    """E0 = 6 C10: 25.1 kPa is of L2 GOH and 25.8 kPa of L2 Ogden."""
    assert list(configuration("L3")) == ["dermis", "hypodermis", "muscle"]
    goh, ogden = configuration("L2-GOH"), configuration("L2-Ogden")
    assert isinstance(goh["bulk"], NeoHookean) and isinstance(ogden["bulk"], NeoHookean)
    assert round(6e3 * goh["bulk"].C10_mpa, 1) == 25.1
    assert round(6e3 * ogden["bulk"].C10_mpa, 1) == 25.8
    assert isinstance(ogden["dermis"], Ogden)
    assert ogden["dermis"].mu_mpa == (0.05,) and ogden["dermis"].alpha == (10.789,)
    assert isinstance(goh["dermis"], HolzapfelGasserOgden) and goh["dermis"].isotropic
    for law in (*goh.values(), *ogden.values(), material_named("L1")):
        nu = poisson_ratio(law.shear_modulus_mpa, law.bulk_modulus_mpa)
        assert nu == pytest.approx(0.49, abs=1e-12)


def test_the_calibration_ranges_are_those_of_table_3_3() -> None:
    assert material_card("L2-Ogden/dermis").ranges["mu_mpa"] == (0.005, 0.0113, 0.05)
    assert material_card("L1").ranges["C10_mpa"] == (0.0014, 0.0056, 0.0224)


def test_the_moduli_of_table_2_7_give_its_youngs_moduli() -> None:
    for name, youngs in (
        ("tran-2007/dermis", 6.50),
        ("tran-2007/hypodermis", 2.5e-3),
        ("tran-2007/muscle", 2.15e-2),
        ("luboz-2014/moduli", 3.28e-2),
        ("gluteus/hypodermis", 5.52e-4),
        ("gluteus/muscle", 1.0e-4),
    ):
        law = material_named(name)
        mu, bulk = law.shear_modulus_mpa, law.bulk_modulus_mpa
        assert 9 * bulk * mu / (3 * bulk + mu) == pytest.approx(youngs, rel=3e-3)


def test_a_file_is_read(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('law = "ogden"\nmu_mpa = [0.02, 0.01]\nalpha = [3, -2.5]\npoisson = 0.45\n')
    law = material_named(str(file))
    assert isinstance(law, Ogden) and law.alpha == (3.0, -2.5)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({}, ("law", "missing", "ogden")),
        ({"law": "odgen"}, ("odgen", "ogden")),
        ({"law": "ogden", "mu_mpa": 1.0, "poisson": 0.4}, ("alpha", "missing")),
        (
            {"law": "neo-hookean", "c10_mpa": 1.0, "poisson": 0.4},
            ("c10_mpa", "did you mean C10_mpa"),
        ),
        ({"law": "neo-hookean", "C10_mpa": 1.0}, ("compressibility", "poisson")),
        (
            {"law": "neo-hookean", "C10_mpa": 1.0, "poisson": 0.4, "D1_per_mpa": 1.0},
            ("D1_per_mpa and poisson", "not both"),
        ),
        ({"law": "neo-hookean", "C10_mpa": 1.0, "poisson": 0.5}, ("poisson", "0.5", "0.49")),
        ({"law": "neo-hookean", "C10_mpa": "1", "poisson": 0.4}, ("C10_mpa", '"1"', "number")),
        ({"law": "neo-hookean", "C10_mpa": -1, "poisson": 0.4}, ("C10_mpa", "-1", "positive")),
        (
            {"law": "ogden", "mu_mpa": [-1.0], "alpha": [2.0], "poisson": 0.4},
            ("mu_mpa", "-1", "sum"),
        ),
        (
            {
                "law": "holzapfel-gasser-ogden",
                "C10_mpa": 1,
                "k1_mpa": 1,
                "k2": 1,
                "kappa": 0.4,
                "poisson": 0.4,
            },
            ("kappa", "0.4", "1/3"),
        ),
    ],
)
def test_nonsense_is_refused_with_name_value_and_remedy(
    table: dict[str, object], words: tuple[str, ...]
) -> None:
    with pytest.raises(MaterialError) as error:
        material_from(table, "mine.toml: ")
    for word in ("mine.toml", *words):
        assert word in str(error.value)


SOUND = 'law = "neo-hookean"\nC10_mpa = 0.01\npoisson = 0.4\n'
OGDEN = 'law = "ogden"\npoisson = 0.4\n'
GOH = (
    'law = "holzapfel-gasser-ogden"\nC10_mpa = 1\nk1_mpa = 1\nk2 = 1\nkappa = 0.1\npoisson = 0.4\n'
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SOUND.replace("0.01", "9" * 5000), "a number has too many digits"),
        (SOUND.replace("0.01", "1e300"), r"C10_mpa = 1e\+300 is neither 0 nor between 1e-09 and"),
        (SOUND.replace("0.01", "nan"), "C10_mpa = nan is neither"),
        (SOUND.replace("0.01", "1e-300"), "C10_mpa = 1e-300 is neither"),
        (SOUND.replace("0.01", "[" * 9000), "nested more than 32 deep"),
        (SOUND.replace('"neo-hookean"', "[]"), r"law is missing|law = \[\] is unknown"),
        (SOUND.replace('"neo-hookean"', '{"a" = 1}'), r"law = {a = 1} is unknown"),
        (SOUND + f"{'k' * 5000} = 1", "k{40}… = 1 is no parameter of neo-hookean"),
        (SOUND + "source = 3", "source = 3: write a text in quotes"),
        (SOUND + "range = 3", "range = 3: write range.k2"),
        (SOUND + "range.C10_mpa = 3", "range.C10_mpa = 3: give lowest, first guess and highest"),
        (SOUND + "range.C10_mpa = [1, 2]", "give lowest, first guess and highest"),
        (SOUND + 'range.C10_mpa = [1, 2, "3"]', 'range.C10_mpa = "3" is not a number'),
        (SOUND + "range.k1 = [1, 2, 3]", r"range.k1 = \[1, 2, 3\]: there is no parameter"),
        (
            OGDEN + f"mu_mpa = {[0.1] * 999}\nalpha = {[2.0] * 999}",
            "mu_mpa has 999 terms: give 1 to",
        ),
        (OGDEN + "mu_mpa = []\nalpha = []", "mu_mpa has 0 terms"),
        (
            OGDEN + "mu_mpa = [1, 1]\nalpha = [2, 3]\nrange.alpha = [1, 2, 3]",
            "only a single number",
        ),
        (GOH + f"fibres = {[[1, 0, 0]] * 999}", "give one direction .* at most 20"),
        (GOH + "fibres = [[1, 0]]", r"fibres = \[\[1, 0\]\]: give one direction"),
        (GOH + "fibres = [[1, 0, true]]", "fibres = true is not a number"),
        (GOH + "fibres = 3", "fibres = 3: give one direction"),
        (GOH + "fibres = [[0, 0, 0]]", "has no length"),
    ],
)
def test_hostile_files_are_refused_by_key_and_value(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(MaterialError, match=rf"mine\.toml.*(?:{words})") as caught:
        material_card(str(file))
    assert str(caught.value).isprintable() and len(str(caught.value)) < 400


def test_a_configuration_is_tables_and_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(f"[dermis]\n{SOUND}[bulk]\n{SOUND}")
    assert list(configuration_cards(str(file))) == ["dermis", "bulk"]
    file.write_text(f"{SOUND}")
    with pytest.raises(MaterialError, match='law = "neo-hookean" belongs to no layer'):
        configuration_cards(str(file))
    file.write_text("".join(f"[l{k}]\n{SOUND}" for k in range(99)))
    with pytest.raises(MaterialError, match=r"mine\.toml: 99 layers"):
        configuration_cards(str(file))
    file.write_bytes("# é\n".encode("latin-1"))
    with pytest.raises(MaterialError, match=r"line 1: byte 0xe9 is not UTF-8.*Latin-1"):
        configuration_cards(str(file))


def test_unknown_names_get_the_nearest_one() -> None:
    with pytest.raises(MaterialError, match="did you mean 'L2-Ogden/dermis'"):
        material_named("L2-Ogden/dermi")
    with pytest.raises(MaterialError, match="did you mean 'L2-GOH'"):
        configuration("L2-GHO")
    with pytest.raises(MaterialError, match="does not exist"):
        material_named("nowhere.toml")


@pytest.mark.parametrize("name", ["L2-Ogden/dermis", "L2-Ogden/bulk", "L2-GOH/dermis"])
def test_a_stiffened_law_multiplies_every_stress(name: str) -> None:
    law = material_named(name)
    F = np.eye(3) + np.random.default_rng(2).uniform(-0.2, 0.2, (5, 3, 3))
    np.testing.assert_allclose(
        stiffened(law, 1.7).first_piola_kirchhoff(F), 1.7 * law.first_piola_kirchhoff(F), rtol=1e-12
    )
    with pytest.raises(MaterialError, match="positive"):
        stiffened(law, 0.0)
