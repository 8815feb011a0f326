"""Maps from values to colours."""

from __future__ import annotations

from matplotlib import colormaps
from matplotlib.colors import Colormap, LinearSegmentedColormap

from scenarios.views.themes import LIGHT, Theme

STRESS_COLOURS = LinearSegmentedColormap.from_list(
    "stress", ["#fae6d8", "#f2b48c", "#dd6a4c", "#a8243f", "#4f0a2e"]
)
STRAIN_COLOURS = LinearSegmentedColormap.from_list(
    "strain", ["#f6efe2", "#c9d39a", "#7fae74", "#33775f", "#123f45"]
)
MUSCLE_COLOURS = LinearSegmentedColormap.from_list(
    "muscle", ["#f4e9e2", "#e3b3b4", "#c46a84", "#87316a", "#3b1149"]
)
AROUND_COLOURS = colormaps["PuOr_r"]
"""Around a value that is neither little nor much."""
DIFFERENCE_COLOURS = colormaps["RdBu_r"]


def pressure_colours(theme: Theme) -> Colormap:
    """Return the colours of contact on a theme's paper."""
    return LinearSegmentedColormap.from_list("pressure", list(theme.pressure))


PRESSURE_COLOURS = pressure_colours(LIGHT)
