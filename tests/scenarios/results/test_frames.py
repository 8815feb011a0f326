"""Solutions as tables and data sets."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from scenarios.results.history_file import COLUMNS
from scenarios.results.increment import SolutionError
from scenarios.results.solution import Solution

pytest.importorskip("pandas")
pytest.importorskip("xarray")


@pytest.fixture(scope="module")
def solution(run_directory: Path) -> Solution:
    return Solution.load(run_directory)


def test_a_table_holds_the_histories_and_their_units(solution: Solution) -> None:
    table = solution.to_dataframe()
    assert tuple(table.columns) == COLUMNS
    np.testing.assert_array_equal(
        table["upper_lip_window_kpa"], solution.history["upper_lip_window_kpa"]
    )
    assert table.attrs["units"]["upper_lip_window_kpa"] == "kPa"


def test_a_data_set_holds_fields_along_time(solution: Solution) -> None:
    data = solution.to_xarray()
    index = 5
    here = data.sel(time_s=solution.time_s[index])
    snapshot = solution.snapshot(index)
    np.testing.assert_array_equal(here["displacement_mm"], snapshot.displacement)
    np.testing.assert_array_equal(here["von_mises_mpa"], snapshot.element["von_mises_mpa"])
    np.testing.assert_array_equal(here["upper_lip_pressure_mpa"], snapshot.pressure_mpa["upper"])
    assert float(here["upper_lip_window_kpa"]) == solution["upper_lip_window_kpa"].values[index]
    assert data["von_mises_mpa"].attrs["units"] == "MPa"
    assert set(np.unique(data["region"])) == set(solution.model.region_names)
    assert data["displacement_mm"].dims == ("time_s", "node", "axis")


def test_what_is_not_installed_is_named_with_its_remedy(
    solution: Solution, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(SolutionError, match=r"pip install 'drinksim\[notebook\]'"):
        solution.to_dataframe()
