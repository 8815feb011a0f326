"""Curves of runs: seconds below, relative time above, and words that no line crosses."""

from __future__ import annotations

import dataclasses
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scenarios.results.solution import Solution
from scenarios.views.panels import ModelPanel
from scenarios.views.plots import histories_figure
from scenarios.views.run_view import RunView
from scenarios.views.strip import HistoryStrip


@pytest.fixture
def solution(run_directory: Path) -> Solution:
    return Solution.load(run_directory)


def of_another_film(solution: Solution, **changes: object) -> Solution:
    """Return a run whose package comes later by one millimetre."""
    moved = dataclasses.replace(solution.motion, package_mm=solution.motion.package_mm + 1.0)
    other = dataclasses.replace(solution, **changes)
    object.__setattr__(other, "motion", moved)
    return other


def test_runs_of_one_film_share_its_time(solution: Solution) -> None:
    half = dataclasses.replace(solution, time_s=0.5 * (solution.time_s[0] + solution.time_s))
    object.__setattr__(half, "motion", solution.motion)
    figure = histories_figure([solution, half])
    figure.draw_without_rendering()
    panel = figure.axes[0]
    assert figure.axes[-1].get_xlabel() == "time, s"
    for line, run in zip(panel.lines[:2], (solution, half), strict=True):
        np.testing.assert_allclose(line.get_xdata(), run.time_s)
    assert panel.get_xlim() == pytest.approx(tuple(solution.time_s[[0, -1]]))
    assert len(panel.child_axes) == 2


def test_runs_of_one_length_share_an_axis_of_relative_time(solution: Solution) -> None:
    figure = histories_figure([solution, of_another_film(solution)])
    assert figure.axes[-1].get_xlabel() == "time since the start of each replay, s"
    for line in figure.axes[0].lines[:2]:
        np.testing.assert_allclose(line.get_xdata(), solution.time_s - solution.time_s[0])
    (above,) = figure.axes[0].child_axes
    assert above.get_xlabel() == "relative time"


def test_runs_of_different_lengths_have_an_axis_of_relative_time_each(solution: Solution) -> None:
    begin, end = solution.time_s[[0, -1]]
    longer = of_another_film(solution, time_s=begin + 2.0 * (solution.time_s - begin))
    figure = histories_figure([solution, longer])
    figure.draw_without_rendering()
    panel = figure.axes[0]
    assert panel.get_xlim() == pytest.approx((0.0, 2.0 * (end - begin)))
    for above, last in zip(panel.child_axes, (end - begin, 2.0 * (end - begin)), strict=True):
        assert above.get_xlabel() == f"relative time, {solution.name}"
        at_one = above.transData.transform((1.0, 0.0))[0]
        assert at_one == pytest.approx(panel.transData.transform((last, 0.0))[0])
    one, other = (above.xaxis.label.get_color() for above in panel.child_axes)
    assert one != other


def test_no_marked_instant_crosses_the_words_above_the_curves(solution: Solution) -> None:
    figure = Figure(figsize=(15.0, 3.0))
    FigureCanvasAgg(figure)
    strip = HistoryStrip(figure, (80, 60, 1300, 150), solution, size=11)
    strip.mark([1.0, 1.3, 1.5, 1.7, 2.0], size=11)
    figure.draw_without_rendering()
    (pain,) = (text for text in strip.axes.texts if text.get_text().startswith("pain from"))
    words = pain.get_window_extent()
    dashed = [line for line in strip.axes.lines if line.is_dashed()]
    assert len(dashed) == 5
    tops = [line.get_window_extent().y1 for line in dashed]
    assert max(tops) < words.y0


def test_written_pressures_name_their_lip_and_keep_clear_of_other_words(solution: Solution) -> None:
    figure = Figure(figsize=(1280 / 100, 7.2), dpi=100)
    FigureCanvasAgg(figure)
    strip = HistoryStrip(figure, (78, 556, 760, 116), solution, size=11)
    strip.show(1.5)
    figure.draw_without_rendering()
    texts = [text for text in strip.axes.texts if text.get_text()]
    said = [text.get_text() for text in texts]
    assert said[1:] == ["upper 60 kPa", "lower 20 kPa"]
    boxes = [strip.axes.get_legend().get_window_extent(), *(t.get_window_extent() for t in texts)]
    assert all(one.x1 < other.x0 for one, other in pairwise(boxes))


def test_a_frame_on_the_section_shows_what_is_seen_closer(run_directory: Path) -> None:
    figure = Figure(figsize=(6.0, 4.0))
    FigureCanvasAgg(figure)
    run_view = RunView.of(run_directory, field="von_mises_mpa", beside_video=False)
    panel = ModelPanel(figure, (0, 0, 600, 400), run_view, closer=True)
    (closer,) = (axes for axes in figure.axes if axes is not panel.axes)
    (frame,) = panel.axes.patches[-1:]
    corners = []
    for time in (1.0, 2.0):
        panel.show(run_view.solution.at(time), run_view.head.at(time))
        x, y = frame.get_xy()
        assert closer.get_xlim() == pytest.approx((x, x + frame.get_width()))
        assert closer.get_ylim() == pytest.approx((y, y + frame.get_height()))
        corners.append((x, y))
    assert corners[0] != corners[1]
