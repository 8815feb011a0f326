"""Calibration: gradients, recovery, limits named, refusals, and going on after an interruption."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fem2d.materials.library import configuration_cards
from scenarios.studies.calibration import calibration_study
from scenarios.studies.curve_gradient import Evaluation, SuctionCurve
from scenarios.studies.files import write_table
from scenarios.studies.fit import (
    CalibrationError,
    CalibrationOptions,
    Parameter,
    Target,
    layers_with,
    parameters_of,
)
from scenarios.studies.identifiability import identifiability
from scenarios.studies.suction import SuctionModel

COARSE = CalibrationOptions(edge_mm=0.8)
SUCTIONS_KPA = np.array([2.0, 4.0, 6.0, 7.3])


def curve_of(name: str) -> SuctionCurve:
    cards = configuration_cards(name)
    parameters = parameters_of(cards)
    model = SuctionModel.of({k: c.material for k, c in cards.items()}, COARSE)
    return SuctionCurve(model, lambda v: layers_with(cards, parameters, v), SUCTIONS_KPA)


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """L1's curve as a file, with the row at rest."""
    apex = curve_of("L1").at(np.log([0.0049767])).apex_mm
    path = tmp_path_factory.mktemp("target") / "target.csv"
    rows = [(0.0, 0.0), *zip(SUCTIONS_KPA.tolist(), apex.tolist(), strict=True)]
    write_table(path, ("pressure_kpa", "apex_mm"), rows)
    return path


def test_gradients_are_those_of_the_curve():
    curve = curve_of("L2-Ogden")
    at = np.log([0.03, 9.0, 0.0045])
    gradient = curve.at(at).gradient
    step = 1e-3
    for p in range(3):
        move = step * np.eye(3)[p]
        difference = (curve.at(at + move).apex_mm - curve.at(at - move).apex_mm) / (2 * step)
        assert np.all(np.abs(difference) > 1e-4)
        # A contact point that opens within the difference leaves a trace in it.
        np.testing.assert_allclose(gradient[:, p], difference, rtol=1e-3)


def test_l1_comes_back_to_its_own_parameter(target: Path, tmp_path: Path):
    calibration_study("L1", target, tmp_path / "out", COARSE)
    result = json.loads((tmp_path / "out" / "calibration.json").read_text(encoding="utf-8"))
    assert result["parameters"]["bulk.C10_mpa"] == pytest.approx(0.0049767, rel=1e-6)
    assert result["r_squared"] > 0.999999
    assert result["at_limit"] == {}
    assert result["solves"] <= 10


@pytest.mark.slow
def test_l2_ogden_fits_within_forty_tests_and_names_its_limits(target: Path, tmp_path: Path):
    result = calibration_study("L2-Ogden", target, tmp_path / "out", COARSE)
    table = json.loads((tmp_path / "out" / "calibration.json").read_text(encoding="utf-8"))
    assert table["r_squared"] >= 0.999
    assert table["solves"] <= 40
    assert table["at_limit"] == {"dermis.alpha": "lower"}
    assert any("dermis.alpha ended on its lower limit, 2.5" in s for s in result.messages)
    freed = table["identifiability"]["relative_standard_error_with_limits_held"]
    assert set(freed) == {"dermis.mu_mpa", "bulk.C10_mpa"}
    assert (
        freed["bulk.C10_mpa"] < table["identifiability"]["relative_standard_error"]["bulk.C10_mpa"]
    )
    correlation = table["identifiability"]["correlation"]
    assert correlation["dermis.mu_mpa"]["bulk.C10_mpa"] < -0.9


@pytest.mark.slow
def test_an_interrupted_calibration_goes_on_where_it_was(target: Path, tmp_path: Path):
    class Stop(Exception):
        pass

    seen = []

    def stop_at_three(share: float, text: str) -> None:
        seen.append(text)
        if len(seen) == 3:
            raise Stop

    out = tmp_path / "out"
    with pytest.raises(Stop):
        calibration_study("L1", target, out, COARSE, progress=stop_at_three)
    assert not out.exists()
    computed = (tmp_path / "out.partial" / "evaluations.jsonl").read_text().splitlines()
    assert len(computed) == 3
    calibration_study("L1", target, out, COARSE)
    whole = calibration_study("L1", target, tmp_path / "whole", COARSE)
    tables = [
        json.loads((folder / "calibration.json").read_text(encoding="utf-8"))
        for folder in (out, whole.folder)
    ]
    assert tables[0]["parameters"] == pytest.approx(tables[1]["parameters"], rel=1e-9)
    assert not (tmp_path / "out.partial").exists()


def test_intervals_of_a_straight_line_are_the_textbook_ones():
    # One parameter and a linear curve: σ² = SSE/(k − 1), variance σ²/Σg².
    gradient = np.array([[1.0], [2.0], [2.0]])
    target = np.array([0.1, 0.0, -0.05])
    known = identifiability(Evaluation(np.zeros(1), np.zeros(3), gradient), target, 0.95)
    sigma = np.sqrt(np.sum(target**2) / 2)
    assert known.relative_error[0] == pytest.approx(sigma / 3)
    assert np.log(known.interval[0, 1]) == pytest.approx(4.302653 * sigma / 3, rel=1e-6)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([(1.0, 0.1), (3.0, 0.2), (2.0, 0.3)], "3 kPa is followed by 2 kPa"),
        ([(1.0, 0.1), (1.0, 0.2)], "does not increase"),
        ([(-1.0, 0.1), (1.0, 0.2)], "give positive suctions"),
        ([(1.0, 0.1)], "fewer than two points"),
        ([(1.0, 0.1), (2.0, float("nan"))], r"line 3: apex_mm = 'nan' is not a finite number"),
        ([(1.0, 0.1), (2.0, 1e6)], r"apex_mm = 1e\+06, beyond 1000: check the unit"),
        ([(1.0, 0.1), (20_000.0, 1.0)], "pressure_kpa = 20000, beyond 1000"),
        ([(1e-3 * (k + 1), 1.0) for k in range(2000)], "2000 points, more than 1000"),
    ],
)
def test_targets_that_are_no_curve_are_refused(tmp_path: Path, rows, message):
    path = tmp_path / "target.csv"
    write_table(path, ("pressure_kpa", "apex_mm"), rows)
    with pytest.raises(CalibrationError, match=rf"target\.csv.*{message}"):
        Target.read(path)


@pytest.mark.parametrize(
    "content",
    [
        b"pressure_kpa,apex_mm\n0,0\n1.5,0.25\n2.5,0.5\n",
        b"\xef\xbb\xbfpressure_kpa;apex_mm;note\r\n1,5;0,25;a\r\n2,5;0,5;b\r\n;;\r\n",
        b"sep=\t\napex_mm\tpressure_kpa\n0.25\t1.5\n0.5\t2.5",
    ],
)
def test_a_target_may_come_from_a_spreadsheet(tmp_path: Path, content: bytes):
    (tmp_path / "target.csv").write_bytes(content)
    target = Target.read(tmp_path / "target.csv")
    assert target.suction_kpa.tolist() == [1.5, 2.5] and target.apex_mm.tolist() == [0.25, 0.5]


@given(st.lists(st.tuples(st.floats(1e-6, 9.0), st.floats(-900, 900)), min_size=2, max_size=20))
def test_any_curve_comes_back_from_its_file(steps: list[tuple[float, float]]):
    suction = np.cumsum([step for step, _ in steps])
    apex = np.array([value for _, value in steps])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "target.csv"
        write_table(file, ("pressure_kpa", "apex_mm"), list(zip(suction, apex, strict=True)))
        read = Target.read(file)
    assert np.array_equal(read.suction_kpa, suction) and np.array_equal(read.apex_mm, apex)


def test_no_spreadsheet_computes_a_word_of_a_table(tmp_path: Path):
    write_table(tmp_path / "t.csv", ("layer", "mm"), [("=1+1", -1.5), ("@a", "-2"), ("bulk", 3)])
    assert (tmp_path / "t.csv").read_text() == "layer,mm\n'=1+1,-1.5\n'@a,-2\nbulk,3\n"


def test_a_target_without_its_columns_is_refused(tmp_path: Path):
    path = tmp_path / "target.csv"
    path.write_text("pressure,apex_mm\n1,2\n")
    with pytest.raises(CalibrationError, match="lacks pressure_kpa"):
        Target.read(path)


def test_limits_that_exclude_the_guess_are_refused():
    with pytest.raises(CalibrationError, match=r"first guess 0\.5 of dermis.mu_mpa is outside"):
        Parameter("dermis", "mu_mpa", 0.1, 0.5, 0.4)
