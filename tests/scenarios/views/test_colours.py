"""Colours tell apart what they stand for, also to eyes without one kind of cones, on any paper."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex

from scenarios.views.colours import (
    AROUND_COLOURS,
    DIFFERENCE_COLOURS,
    MUSCLE_COLOURS,
    PRESSURE_COLOURS,
    STRAIN_COLOURS,
    STRESS_COLOURS,
    pressure_colours,
)
from scenarios.views.themes import RUN_COLOURS, THEMES
from tests.support.colour_vision import VISIONS, apart, contrast, seen

ON_DARK = pressure_colours(THEMES["dark"])
SCALES = (STRESS_COLOURS, STRAIN_COLOURS, PRESSURE_COLOURS, ON_DARK, MUSCLE_COLOURS)
everyone = pytest.mark.parametrize("vision", VISIONS)


def steps(colours, count):
    return [to_hex(colour) for colour in colours(np.linspace(0.0, 1.0, count))]


def test_the_simulation_confuses_what_such_eyes_confuse() -> None:
    red, green = "#c04040", "#5c7a1f"
    full, *lacking = (apart([red, green], vision)[0, 1] for vision in VISIONS)
    assert full > 60.0
    assert max(lacking) < 0.5 * full
    for vision in VISIONS:
        # What has no hue has none to anybody: rows of the matrices sum to 1.
        grey = seen(["#000000", "#808080", "#ffffff"], vision)
        np.testing.assert_allclose(grey[:, 0], [0.0, 53.6, 100.0], atol=0.1)
        np.testing.assert_allclose(grey[:, 1:], 0.0, atol=0.1)


@everyone
@pytest.mark.parametrize("scale", SCALES, ids=lambda scale: scale.name)
def test_a_scale_goes_one_way_in_lightness(scale, vision: str) -> None:
    lab = seen(steps(scale, 9), vision)
    lightness = np.diff(lab[:, 0])
    assert np.all(lightness > 4.0) or np.all(lightness < -4.0)
    assert np.ptp(lab[:, 0]) > 65.0
    assert np.linalg.norm(np.diff(lab, axis=0), axis=1).min() > 6.0


@everyone
@pytest.mark.parametrize("scale", [AROUND_COLOURS, DIFFERENCE_COLOURS], ids=["around", "less"])
def test_above_is_told_from_below_and_both_from_the_middle(scale, vision: str) -> None:
    assert apart(steps(scale, 5), vision)[np.triu_indices(5, 1)].min() > 30.0


@everyone
def test_runs_are_told_apart(vision: str) -> None:
    assert apart(RUN_COLOURS, vision)[np.triu_indices(len(RUN_COLOURS), 1)].min() > 20.0
    assert min(contrast(colour, "#ffffff") for colour in RUN_COLOURS) >= 3.0


@everyone
@pytest.mark.parametrize("name", THEMES)
def test_a_theme_tells_its_lines_apart_and_can_be_read(name: str, vision: str) -> None:
    theme = THEMES[name]
    lines = (theme.upper, theme.lower, theme.warning)
    assert apart(lines, vision)[np.triu_indices(3, 1)].min() > 20.0
    for paper in (theme.paper, theme.panel):
        assert contrast(theme.ink, paper) >= 7.0
        assert contrast(theme.quiet, paper) >= 4.5
        assert min(contrast(line, paper) for line in lines) >= 3.0


@everyone
@pytest.mark.parametrize("name", THEMES)
def test_a_band_of_pressure_is_told_from_the_tissue_beside_it(name: str, vision: str) -> None:
    stress = steps(STRESS_COLOURS, 9)
    pressure = steps(pressure_colours(THEMES[name]), 9)
    between = apart([*stress, *pressure], vision)[:9, 9:]
    # Where pressure is highest, so is stress: equal places of both scales lie side by side.
    assert np.diagonal(between)[1:].min() > 15.0
    assert contrast(pressure[-1], THEMES[name].panel) > 4.5
