"""The suction test: the four printed optima, what mechanics demands, files, refusals."""

from __future__ import annotations

import csv
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from fem2d.materials.library import configuration
from fem2d.materials.material import MaterialError
from scenarios.cli.main import main
from scenarios.studies.aspiration import COLUMNS, CONFIGURATIONS, aspiration_study
from scenarios.studies.sensitivity import SensitivityError, sensitivity_study
from scenarios.studies.suction import SuctionError, SuctionOptions, slab_mesh
from scenarios.studies.suction_curve import Aspiration, AspirationOptions, aspirated

COARSE = AspirationOptions(edge_mm=0.5, search_kpa=0.0)
FEW = dataclasses.replace(COARSE, edge_mm=0.8, points=2)


@pytest.fixture(scope="module")
def curves() -> dict[str, Aspiration]:
    return {name: aspirated(configuration(name), COARSE) for name in CONFIGURATIONS}


def test_the_four_printed_optima_give_one_nearly_straight_curve(curves):
    for name in CONFIGURATIONS[1:]:
        assert curves["L1"].difference(curves[name]) <= 0.025, name
    assert all(curve.nonlinearity < 0.1 for curve in curves.values())
    assert curves["L1"].nonlinearity < 0.03


def test_curves_rise_and_strains_of_the_dermis_grow(curves):
    for curve in curves.values():
        assert np.all(np.diff(curve.apex_mm) > 0)
        assert np.all(np.diff(curve.max_log_strain) > 0)
        assert curve.min_log_strain[-1] == curve.min_log_strain.min() < -0.03
        assert np.all(curve.softest > 0)


def test_the_highest_suctions_of_the_thesis_are_reached_in_stable_equilibrium(curves):
    high = aspirated(configuration("L1"), dataclasses.replace(FEW, suction_kpa=12.0))
    assert high.loss is None
    assert high.suction_kpa[-1] == pytest.approx(12.0)
    assert high.softest.min() > 0.5 * high.softest[0]


def test_a_test_of_twice_the_size_lifts_twice_as_far():
    small = FEW
    lengths = ("aperture_radius_mm", "rim_fillet_mm", "cup_radius_mm", "slab_radius_mm",
               "slab_height_mm", "dermis_mm", "hypodermis_mm", "clearance_mm")  # fmt: skip
    large = dataclasses.replace(small, **{k: 2 * getattr(small, k) for k in lengths})
    apex = [aspirated(configuration("L2-Ogden"), o).apex_mm[-1] for o in (small, large)]
    assert apex[1] == pytest.approx(2 * apex[0], rel=0.01)


def test_what_holds_the_slab_balances_the_cup_and_the_suction(curves):
    curve = curves["L1"]
    system, last = curve.model.fem_model, curve.last
    reaction = last.reaction.reshape(-1, 2)[:, 1].sum()
    on_tissue = sum(touch.force[:, 1::2].sum() for touch in last.contacts)
    suction = system.load_force(last.displacement, last.load)[1::2].sum()
    assert suction > 0 > on_tissue
    assert reaction + on_tissue + suction == pytest.approx(0.0, abs=1e-6 * suction)
    # Suction acts on no more than the cup covers, and on most of what lies inside its aperture.
    options = COARSE
    lift = 7.3e-3 * np.pi * np.array([5.9, options.aperture_radius_mm + options.rim_fillet_mm]) ** 2
    assert lift[0] < suction < lift[1]


def test_mesh_has_the_layers_asked_for():
    mesh = slab_mesh(SuctionOptions(edge_mm=0.8), ["dermis", "hypodermis", "muscle"])
    depth = {n: -mesh.p[1, mesh.t[:, e]].min() for n, e in mesh.subdomains.items()}
    assert depth == pytest.approx({"dermis": 1.195, "hypodermis": 4.065, "muscle": 20.0})
    assert len(np.concatenate(list(mesh.subdomains.values()))) == mesh.t.shape[1]


def test_study_writes_what_it_promises(tmp_path: Path):
    result = aspiration_study("L2-Ogden", tmp_path / "out", FEW)
    assert result.complete
    with (tmp_path / "out" / "aspiration.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert [float(row["pressure_kpa"]) for row in rows] == pytest.approx([0.0, 3.65, 7.3])
    assert float(rows[0]["apex_mm"]) == 0.0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert summary["loss"] is None
    assert summary["layers"]["dermis"]["alpha"] == [10.789]
    assert {"aspiration.png", "field.png"} <= {p.name for p in (tmp_path / "out").iterdir()}


def test_a_tissue_of_your_own_is_sucked_like_the_library(tmp_path: Path):
    own = tmp_path / "own.toml"
    own.write_text('[tissue]\nlaw = "neo-hookean"\nC10_mpa = 0.0049767\npoisson = 0.49\n')
    result = aspiration_study(str(own), tmp_path / "out", FEW)
    library = aspirated(configuration("L1"), FEW)
    assert f"apex {library.apex_mm[-1]:.3f} mm" in result.messages[0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"slab_height_mm": 3.0}, "dermis and hypodermis are 4.065 mm thick, the slab only 3 mm"),
        ({"aperture_radius_mm": 40.0}, "do not fit on a slab of radius 30 mm"),
        ({"aperture_radius_mm": 15.0}, "a cup of radius 16.5 mm has no room for an aperture"),
    ],
)
def test_sizes_that_do_not_fit_are_refused(changes, message):
    with pytest.raises(SuctionError, match=message):
        aspirated(configuration("L3"), dataclasses.replace(FEW, **changes))


def test_a_layer_without_thickness_is_refused():
    layers = {"fat": configuration("L1")["bulk"], "muscle": configuration("L1")["bulk"]}
    with pytest.raises(SuctionError, match="layer 'fat' has no thickness"):
        aspirated(layers, FEW)


def test_command_line_refuses_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    out = str(tmp_path / "out")
    assert main(["aspirate", "L3", "--slab-height-mm", "3", "--out", out]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "make slab_height_mm larger" in error
    assert main(["aspirate", "L2-Odgen", "--out", out]) == 2
    assert "did you mean 'L2-Ogden'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_thickness_matters_less_for_ogden_than_for_gasser(tmp_path: Path):
    effect = {}
    for name in ("L2-Ogden", "L2-GOH"):
        sensitivity_study(name, "thickness", tmp_path / name, FEW)
        with (tmp_path / name / "ranking.csv").open(encoding="utf-8") as file:
            effect[name] = float(next(csv.DictReader(file))["largest_rms_percent"])
    assert 1.0 < effect["L2-Ogden"] < effect["L2-GOH"]


@pytest.mark.slow
def test_the_bulk_dominates_the_dermis(tmp_path: Path):
    sensitivity_study("L2-Ogden", "parameters", tmp_path / "out", FEW)
    with (tmp_path / "out" / "ranking.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["factor"] for row in rows] == ["bulk.C10_mpa", "dermis.mu_mpa", "dermis.alpha"]
    assert float(rows[0]["largest_rms_percent"]) > 5 * float(rows[1]["largest_rms_percent"])


def test_a_sensitivity_without_anything_to_vary_is_refused(tmp_path: Path):
    with pytest.raises(SensitivityError, match="single layer"):
        sensitivity_study("L1", "thickness", tmp_path / "out", FEW)
    with pytest.raises(SensitivityError, match="unknown: choose thickness"):
        sensitivity_study("L1", "colour", tmp_path / "out", FEW)
    with pytest.raises(MaterialError):
        sensitivity_study("L9", "mesh", tmp_path / "out", FEW)
    assert not (tmp_path / "out").exists()
