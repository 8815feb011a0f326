"""What the studies' pictures share: a figure to draw on and a deformed body coloured by a field."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fem2d.body.body import Body
from scenarios.views.themes import INK, LOWER, UPPER

Array = NDArray[np.float64]

DPI = 130
STRAIN_COLOURS = "viridis"
COLOURS = (INK, UPPER, LOWER, "#5b8c4a", "#8e4585", "#9a7d2e", "#555b66", "#2c8c99")


def blank_figure(width_in: float, height_in: float) -> Figure:
    """Return a figure that can be saved without a screen."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def finish(figure: Figure, path: Path) -> None:
    """Write a figure to a file."""
    figure.savefig(path, dpi=DPI)


def labelled(axes: Axes, x: str, y: str) -> Axes:
    """Name the axes and take their frame away."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.spines[["top", "right"]].set_visible(False)
    return axes


def draw_field(
    axes: Axes,
    body: Body,
    displacement: Array,
    values: Array,
    *,
    mirrored: bool = False,
    largest: float | None = None,
) -> ScalarMappable:
    """Draw a deformed body coloured by element values and return what explains the colours.

    Parameters
    ----------
    axes
        Where to draw; data units are mm.
    body
        Its corners are joined by straight lines.
    displacement
        (n, 2), mm.
    values
        (e,) one for each element.
    mirrored
        Whether to draw the other half of an axisymmetric body too.
    largest
        Value of the strongest colour; the largest value if absent.
    """
    corners = body.mesh.t.shape[0]
    deformed = (body.nodes + displacement)[body.tables.connectivity[:, :corners]]
    scale = Normalize(min(0.0, float(values.min())), largest or float(values.max()))
    for side in (1.0, -1.0) if mirrored else (1.0,):
        cells = PolyCollection(
            deformed * np.array([side, 1.0]), array=values, cmap=STRAIN_COLOURS, norm=scale
        )
        cells.set_edgecolor("face")
        cells.set_linewidth(0.2)
        axes.add_collection(cells)
    axes.set_aspect("equal")
    return ScalarMappable(scale, STRAIN_COLOURS)
