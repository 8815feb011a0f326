"""The single-element study writes what it promises, and the thesis' figures look as it says."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from fem2d.analyses.homogeneous import HomogeneousError, Mode, homogeneous_response
from fem2d.body.elements import ELEMENTS
from fem2d.materials.library import material_named
from fem2d.materials.material import MaterialError
from geometry2d.foundation.output import OutputError
from scenarios.studies.element import (
    COLUMNS,
    ElementOptions,
    ElementStudyError,
    cube_curve,
    element_study,
    figure_materials,
)
from scenarios.studies.element_types import beam_tip, square_stresses, zero_energy_modes
from tests.support.marks import slow


def rows_of(path: Path) -> tuple[list[str], np.ndarray]:
    with path.open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, float)


@pytest.mark.parametrize("mode", ["uniaxial", *map(slow, ("equibiaxial", "planar", "compression"))])
def test_files_of_a_study(tmp_path: Path, mode: str) -> None:
    out = tmp_path / "study"
    options = ElementOptions(mode=mode, points=40)  # type: ignore[arg-type]
    result = element_study("L2-Ogden/dermis", out, options)
    files = {path.name for path in out.iterdir()}
    assert files == {".drinksim", "element.csv", "element.png", "summary.json"}
    header, rows = rows_of(out / "element.csv")
    assert tuple(header) == COLUMNS
    stretch, strain, nominal, cauchy = rows.T
    assert stretch[0] == pytest.approx(0.1)
    assert stretch[-1] == pytest.approx(1.0 if mode == "compression" else 4.0)
    np.testing.assert_allclose(strain, np.log(stretch), atol=1e-15)
    assert np.all(nominal[stretch < 1 - 1e-9] < 0) and np.all(nominal[stretch > 1 + 1e-9] > 0)
    assert np.all(np.sign(nominal) == np.sign(cauchy))
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["poisson"] == pytest.approx(0.49)
    assert summary["remarks"] == list(result.messages)
    assert any("unstable in compression" in said for said in result.messages)
    assert summary["unstable_log_strain_compression"] < 0


def test_a_study_replaces_its_own_results_and_nothing_else(tmp_path: Path) -> None:
    options = ElementOptions(points=5, from_mm=-0.1, to_mm=0.1)
    element_study("L1", tmp_path / "study", options)
    element_study("L1", tmp_path / "study", options)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("keep")
    with pytest.raises(OutputError):
        element_study("L1", tmp_path / "mine", options)
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["letter.txt"]


def test_nonsense_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ElementStudyError, match="first must be below"):
        element_study("L1", tmp_path / "a", ElementOptions(from_mm=1.0, to_mm=0.5))
    with pytest.raises(ElementStudyError, match="below 0"):
        element_study("L1", tmp_path / "a", ElementOptions(mode="compression", from_mm=1.0))
    with pytest.raises(ElementStudyError, match="to_mm = 2 mm has no effect in compression"):
        element_study("L1", tmp_path / "a", ElementOptions(mode="compression", to_mm=2.0))
    with pytest.raises(MaterialError, match="L1/bulk"):
        element_study("L7", tmp_path / "a")
    with pytest.raises(HomogeneousError, match="not positive"):
        homogeneous_response(material_named("L1"), Mode.UNIAXIAL, [0.0])
    assert not (tmp_path / "a").exists()


def test_stiffness_of_fibres_is_in_the_order_the_thesis_reports() -> None:
    """Tension: parallel, orthogonal, isotropic, XY; compression: XY is the stiffest (3.2.1)."""
    options = ElementOptions(direction="z", points=79)
    curves = {name: cube_curve(law, options) for name, law in figure_materials()["3.8"][1].items()}
    pulled = {n: np.interp(2.0, c.stretch, c.nominal_mpa) for n, c in curves.items()}
    order = sorted(pulled, key=lambda name: -pulled[name])
    assert order == ["xz plane, parallel", "xz plane, orthogonal", "isotropic", "xy plane"]
    pressed = {n: np.interp(0.7, c.stretch, c.nominal_mpa) for n, c in curves.items()}
    assert min(pressed, key=lambda name: pressed[name]) == "xy plane"


def test_stiffness_scales_with_c10_and_alpha_matters_in_tension() -> None:
    options = ElementOptions(direction="z", points=79)
    figures = figure_materials()
    soft, mean, stiff = (cube_curve(law, options) for law in figures["3.7"][1].values())
    for curve, ratio in ((soft, 3.2 / 5.6), (stiff, 7.6 / 5.6)):
        expected = ratio * mean.nominal_mpa
        np.testing.assert_allclose(curve.nominal_mpa, expected, rtol=1e-9, atol=1e-15)
    ogden = {name: cube_curve(law, options) for name, law in figures["3.9"][1].items()}
    at = {n: np.interp([0.7, 1.5], c.stretch, c.nominal_mpa) for n, c in ogden.items()}
    change = at["α + 10 %"] / at["standard"] - 1
    assert change[1] > 0.2 and abs(change[1]) > abs(change[0])


def test_every_element_gives_the_same_under_homogeneous_strain_but_not_in_bending() -> None:
    expected = square_stresses("Q8")
    for name in ("Q4", "Q4M", "Q8R", "T6"):
        np.testing.assert_allclose(square_stresses(name), expected, rtol=1e-9)
    fine = beam_tip("Q8", (40, 4))
    assert beam_tip("Q4", (10, 1)) < 0.2 * fine  # shear locking
    assert beam_tip("T6", (10, 1)) == pytest.approx(fine, rel=0.12)
    assert beam_tip("T6M", (10, 1)) > 1.5 * fine  # one pressure cannot follow bending
    assert beam_tip("T6", (20, 2)) == pytest.approx(fine, rel=0.03)


def test_zero_energy_modes() -> None:
    modes = {name: zero_energy_modes(name) for name in ELEMENTS}
    assert modes["Q4R"] == 2 and modes["Q8R"] == 1
    assert {modes[name] for name in ("T3", "T6", "T6R", "Q4", "Q4M", "Q8")} == {0}
