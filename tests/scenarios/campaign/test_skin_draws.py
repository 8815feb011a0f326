"""Skins sampled from a calibration: its errors and correlations, within its limits."""

import json

import numpy as np
import pytest

from fem2d.materials.library import configuration_cards
from geometry2d.foundation.errors import DrinksimError
from scenarios.campaign.plan import planned
from scenarios.campaign.settings import read_study
from scenarios.campaign.sip import scenario_in
from scenarios.campaign.skin_draws import SkinRegion
from scenarios.settings.person import Skin
from scenarios.settings.scenario import load_scenario
from scenarios.sip.lip_model import Lips
from tests.support.approach import write_base

SKIN = """
[dermis]
law = "ogden"
mu_mpa = [0.02]
alpha = [10.0]
poisson = 0.49
range.mu_mpa = [0.005, 0.02, 0.05]
range.alpha = [2.0, 10.0, 15.0]

[bulk]
law = "neo-hookean"
C10_mpa = 0.004
poisson = 0.49
"""
NAMES = ("dermis.mu_mpa", "dermis.alpha")
VALUES, ERRORS, CORRELATION = (0.02, 10.0), (0.1, 0.05), -0.8


def quiet(share, text):
    pass


def write_calibration(folder, *, errors=ERRORS, names=NAMES):
    (folder / "skin.toml").write_text(SKIN)
    rows = [[1.0, CORRELATION], [CORRELATION, 1.0]]
    known = {
        "relative_standard_error": dict(zip(names, errors, strict=True)),
        "correlation": {
            n: dict(zip(names, row, strict=True)) for n, row in zip(names, rows, strict=True)
        },
    }
    file = folder / "calibration.json"
    found = {"parameters": dict(zip(names, VALUES, strict=True)), "identifiability": known}
    file.write_text(json.dumps(found))
    return file


def region(folder, **how):
    return SkinRegion.read(write_calibration(folder, **how), Skin(file=str(folder / "skin.toml")))


def test_samples_have_the_errors_and_correlations_of_the_calibration(tmp_path):
    skin, random = region(tmp_path), np.random.default_rng(3)
    drawn = np.log([list(skin.sampled(random).values()) for _ in range(4000)])
    standard_error = np.array(ERRORS) / np.sqrt(4000)
    assert np.abs(drawn.mean(axis=0) - np.log(VALUES)) == pytest.approx(
        0.0, abs=4 * standard_error.max()
    )
    assert drawn.std(axis=0) == pytest.approx(ERRORS, rel=0.05)
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(CORRELATION, abs=0.03)


def test_samples_stay_within_the_limits(tmp_path):
    skin, random = region(tmp_path, errors=(2.0, 1.0)), np.random.default_rng(3)
    drawn = np.array([list(skin.sampled(random).values()) for _ in range(300)])
    assert drawn.min(axis=0) == pytest.approx([0.005, 2.0], rel=0.5)
    assert np.all((drawn >= [0.005, 2.0]) & (drawn <= [0.05, 15.0]))


def test_a_sampled_skin_is_a_file_that_lips_are_made_of(tmp_path):
    skin = region(tmp_path)
    file = tmp_path / "drawn.toml"
    file.write_text(skin.text({"dermis.mu_mpa": 0.03, "dermis.alpha": 9.0}))
    cards = configuration_cards(str(file))
    assert (cards["dermis"].parameters["mu_mpa"], cards["dermis"].parameters["alpha"]) == (
        [0.03],
        [9.0],
    )
    assert cards["bulk"].parameters["C10_mpa"] == 0.004
    scenario = load_scenario("A38-F", [f"skin.file={file}", "numerics.resolution=coarse"])
    lips = Lips(scenario, scenario.head.section(), scenario.package.section())
    for part in ("dermis", "bulk"):
        (of_part,) = {int(lips.body.material_of[e]) for e in lips.body.elements_of(f"upper_{part}")}
        assert lips.body.materials[of_part] == cards[part].material


def scenario_of(case, out):
    folder = out / "runs" / case.identity
    folder.mkdir(parents=True, exist_ok=True)
    return scenario_in(folder, case.scenario_toml)


@pytest.mark.slow
def test_every_draw_of_a_study_has_another_skin_and_every_neck_the_same(tmp_path):
    write_base(tmp_path)
    write_calibration(tmp_path)
    study = (
        'base = "base.toml"\n[meeting]\nhand = "recorded"\n[necks]\nlist = ["A38", "DC"]\n'
        '[doubt]\ndraws = 3\nskin = "calibration.json"\n[set.skin]\nfile = "skin.toml"\n'
    )
    (tmp_path / "study.toml").write_text(study)
    plan = planned(read_study(tmp_path / "study.toml"), tmp_path / "out", quiet)
    skins = {}
    for case in plan.cases:
        scenario = scenario_of(case, tmp_path / "out")
        cards = configuration_cards(scenario.skin.file)
        skins.setdefault(case.factors["draw"], set()).add(cards["dermis"].parameters["mu_mpa"][0])
    assert sorted(skins) == [1, 2, 3]
    assert all(len(of_draw) == 1 for of_draw in skins.values())
    assert len(set.union(*skins.values())) == 3
    plain = study.replace('skin = "calibration.json"\n', "")
    (tmp_path / "plain.toml").write_text(plain)
    other = planned(read_study(tmp_path / "plain.toml"), tmp_path / "plain", quiet)
    moved, without = (
        {scenario_of(case, tmp_path / name).known_motion().text() for case in found.cases}
        for name, found in (("out", plan), ("plain", other))
    )
    assert moved == without


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (
            lambda f: f.write_text("{}"),
            r"is no calibration\.json: make one with drinksim calibrate",
        ),
        (lambda f: f.unlink(), r"is no calibration\.json"),
        (
            lambda f: f.write_text(f.read_text().replace("dermis.mu_mpa", "dermis.c1_mpa")),
            r"fitted dermis\.c1_mpa, which the skin of the study does not have",
        ),
        (
            lambda f: f.write_text(f.read_text().replace("0.05", "Infinity")),
            "a parameter has no finite error",
        ),
    ],
)
def test_what_is_no_region_of_this_skin_is_refused(tmp_path, change, told):
    file = write_calibration(tmp_path)
    change(file)
    with pytest.raises(DrinksimError, match=told):
        SkinRegion.read(file, Skin(file=str(tmp_path / "skin.toml")))


def test_a_region_outside_the_limits_is_refused(tmp_path):
    file = write_calibration(tmp_path, errors=(1e-6, 1e-6))
    file.write_text(file.read_text().replace("0.02", "0.5"))
    skin = SkinRegion.read(file, Skin(file=str(tmp_path / "skin.toml")))
    with pytest.raises(DrinksimError, match=r"none lies within the limits of dermis\.mu_mpa"):
        skin.sampled(np.random.default_rng(1))


def test_skins_without_draws_are_refused(tmp_path):
    (tmp_path / "study.toml").write_text('base = "A38-F"\n[doubt]\nskin = "calibration.json"\n')
    with pytest.raises(DrinksimError, match=r"doubt\.skin has no effect without draws"):
        read_study(tmp_path / "study.toml")
