"""The imprint as a table, and the pictures for slides: what they hold is what the run holds."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from scenarios.cli.main import main
from scenarios.export.imprint import COLUMNS
from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution
from scenarios.views.plots import imprint
from tests.support.optional import needed_module


def test_the_table_holds_the_imprint(run_directory: Path, tmp_path: Path) -> None:
    out = tmp_path / "imprint.csv"
    assert main(["export", str(run_directory), "--format", "imprint", "--out", str(out)]) == 0
    with out.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert tuple(rows[0]) == COLUMNS
    solution = Solution.load(run_directory)
    for lip in LIPS:
        contour, pressure = imprint(solution, lip)
        of_lip = [row for row in rows if row["lip"] == lip]
        assert len(of_lip) == np.count_nonzero(pressure) > 50
        highest = max(of_lip, key=lambda row: float(row["pressure_kpa"]))
        assert float(highest["pressure_kpa"]) == pytest.approx(pressure.max(), rel=1e-5)
        index, at = np.unravel_index(pressure.argmax(), pressure.shape)
        assert float(highest["contour_mm"]) == pytest.approx(contour[at], abs=1e-3)
        assert float(highest["time_s"]) == pytest.approx(solution.time_s[index])


def test_a_parquet_table_is_the_same(run_directory: Path, tmp_path: Path) -> None:
    parquet = needed_module("pyarrow.parquet")
    files = tmp_path / "imprint.csv", tmp_path / "imprint.parquet"
    for out in files:
        assert main(["export", str(run_directory), "--format", "imprint", "--out", str(out)]) == 0
    table = parquet.read_table(files[1]).to_pydict()
    with files[0].open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert tuple(table) == COLUMNS
    assert table["stretch"] == [row["stretch"] for row in rows]
    assert table["pressure_kpa"] == [float(row["pressure_kpa"]) for row in rows]


def test_another_ending_is_one_line(
    run_directory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "imprint.xls"
    assert main(["export", str(run_directory), "--format", "imprint", "--out", str(out)]) == 2
    assert "must end in .csv or .parquet" in capsys.readouterr().err


@pytest.mark.slow
def test_pictures_fill_slides(run_directory: Path, tmp_path: Path) -> None:
    out = tmp_path / "slides"
    assert main(["export", str(run_directory), "--format", "pictures", "--out", str(out)]) == 0
    names = {path.name for path in out.glob("*.png")}
    instants = {f"instant_{number}.png" for number in range(1, 7)}
    assert names == instants | {"six_instants.png", "histories.png", "imprint.png"}
    for name in instants:
        with Image.open(out / name) as picture:
            assert picture.size == (1280, 720)
