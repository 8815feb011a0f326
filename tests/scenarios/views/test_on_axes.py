"""What a notebook shows of a solution."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.collections import PolyCollection
from PIL import Image

from drinksim.values import Solution
from scenarios.results.increment import SolutionError


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    mpl.use("agg")
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def solution(run_directory: Path) -> Solution:
    return Solution.load(run_directory)


def test_a_history_is_drawn_with_name_unit_and_meaning(solution: Solution) -> None:
    axes = solution["upper_lip_window_kpa"].plot()
    (line,) = axes.lines
    np.testing.assert_array_equal(line.get_ydata(), solution.history["upper_lip_window_kpa"])
    assert axes.get_ylabel() == "upper_lip_window_kpa, kPa"
    assert axes.get_title(loc="left") == "highest mean pressure over 0.5 mm of deformed lip"
    again = solution["lower_lip_window_kpa"].plot(axes)
    assert again is axes
    assert len(axes.lines) == 2


@pytest.mark.parametrize("name", ["von_mises", "von_mises_mpa", "log_strain_max"])
def test_a_snapshot_is_coloured_by_a_field(solution: Solution, name: str) -> None:
    snapshot = solution.at(1.5)
    axes = snapshot.plot(name)
    dermis, _band = (item for item in axes.collections if isinstance(item, PolyCollection))
    field = "von_mises_mpa" if name.startswith("von") else name
    factor = 1e3 if name.startswith("von") else 1.0
    names = np.array(snapshot.model.region_names)[snapshot.model.region]
    expected = factor * snapshot.element[field][np.char.endswith(names, "dermis")]
    np.testing.assert_allclose(dermis.get_array(), expected)
    assert axes.get_title(loc="left") == "1.50 s"


def test_an_undeformed_snapshot_is_drawn_too(solution: Solution) -> None:
    assert solution.snapshot(0).pressure_mpa["upper"].max() == 0.0
    solution.snapshot(0).plot()


def test_an_unknown_field_names_the_nearest(solution: Solution) -> None:
    with pytest.raises(SolutionError, match="did you mean 'von_mises_mpa'"):
        solution.at(1.5).plot("von_mieses_mpa")


def test_a_notebook_shows_a_table_and_a_picture(solution: Solution) -> None:
    markup = solution._repr_html_()
    rows = re.findall(r"<tr><td>(.*?)</td><td>(.*?)</td></tr>", markup)
    assert ("upper lip, pressure over 0.5 mm", "60 kPa") in rows
    assert ("dermis, smallest log strain", "-0.40") in rows
    (picture,) = re.findall(r'<img src="data:image/png;base64,([^"]*)"', markup)
    image = Image.open(BytesIO(base64.b64decode(picture)))
    assert len(np.unique(np.asarray(image.convert("L")))) > 50
    assert "unfinished" not in markup
