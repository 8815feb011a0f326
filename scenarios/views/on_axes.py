"""One history or one snapshot on matplotlib axes, as a notebook shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from geometry2d.rigid import UNMOVED
from scenarios.results.increment import SectionModel, SolutionError
from scenarios.results.quantities import LIPS
from scenarios.results.skin_line import SkinLine
from scenarios.settings.names import nearest
from scenarios.views.limits import upper_limit
from scenarios.views.scene import SectionArtists
from scenarios.views.shown import SHOWN, Shown
from scenarios.views.themes import INK, QUIET, UPPER

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from scenarios.results.solution import History, Snapshot

Array = NDArray[np.float64]

AROUND_MOUTH_MM, AROUND_CONTACT_MM = 20.0, 12.0
"""How far the view reaches from the mouth, and from what is pressed."""

MOST = 0.98
"""Share of the coloured elements whose values lie within the colours."""


def plot_history(history: History, axes: Axes | None = None) -> Axes:
    """Draw an output against time and return the axes, new ones of pyplot by default."""
    if axes is None:
        axes = _new_axes((7.0, 3.0))
    quantity = history.quantity
    axes.plot(history.time_s, history.values, color=UPPER, lw=1.6, label=quantity.name)
    axes.set_xlabel("time, s", color=INK)
    axes.set_ylabel(quantity.label, color=INK)
    axes.set_title(quantity.meaning, color=INK, size=10, loc="left")
    axes.grid(axis="y", color="#e4e1db", lw=0.8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(QUIET)
    return axes


def plot_snapshot(snapshot: Snapshot, field: str, axes: Axes | None = None) -> Axes:
    """Draw the section at one instant in the head frame and return the axes.

    Parameters
    ----------
    snapshot
        What to draw.
    field
        What tissue is coloured by: one of :data:`scenarios.views.shown.SHOWN`, with or without
        its unit.
    axes
        Where; new ones of pyplot by default.

    Raises
    ------
    SolutionError
        If there is no such field, or not in this run.
    """
    shown = shown_field(field)
    if axes is None:
        axes = _new_axes((7.6, 4.8))
    if shown.field not in snapshot.element:
        raise SolutionError(f"{snapshot!r} holds no {field}: replay the run again")
    values = shown.values(snapshot.element[shown.field][shown.tissue(snapshot.model)])
    away = shown.reach(values).round(9)
    pressure = max(1e3 * float(pressure.max()) for pressure in snapshot.pressure_mpa.values())
    limits = upper_limit([float(np.quantile(away, MOST))]), upper_limit([pressure])
    artists = SectionArtists(axes, snapshot, shown, limits)
    artists.show(snapshot, UNMOVED)
    (left, bottom), (right, top) = _view(snapshot)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    axes.set_aspect("equal")
    axes.set_xlabel("head frame, x forward, mm", color=INK)
    axes.set_ylabel("y up, mm", color=INK)
    axes.set_title(f"{snapshot.time_s:.2f} s", color=INK, size=10, loc="left")
    figure = axes.figure
    unit = f", {shown.unit}" if shown.unit else ""
    figure.colorbar(artists.element_colours, ax=axes, label=shown.title + unit, pad=0.02)
    if pressure > 0.0:
        pressed = artists.pressure_colours
        figure.colorbar(pressed, ax=axes, label="contact pressure, kPa", pad=0.02)
    return axes


def shown_field(name: str) -> Shown:
    """Return how a field is shown, named with or without its unit.

    >>> shown_field("von_mises").field
    'von_mises_mpa'

    Raises
    ------
    SolutionError
        If there is no such field.
    """
    for field, shown in SHOWN.items():
        if name in (field, field.removesuffix("_mpa")):
            return shown
    raise SolutionError(f"no field {name!r} to show: {nearest(name, SHOWN)}")


def _view(snapshot: Snapshot) -> tuple[Array, Array]:
    """Return the lower left and the upper right corner (2,) of what is shown, mm."""
    model = snapshot.model
    mouth = _mouth(model)[None]
    corners = [mouth - AROUND_MOUTH_MM, mouth + AROUND_MOUTH_MM]
    for lip, arc_mm in snapshot.arc_mm.items():
        points = SkinLine(model, model.skin[lip], arc_mm).points(
            model.nodes + snapshot.displacement
        )
        pressed = points[snapshot.pressure_mpa[lip] > 0]
        corners += [pressed - AROUND_CONTACT_MM, pressed + AROUND_CONTACT_MM]
    all_corners = np.concatenate(corners)
    return all_corners.min(axis=0), all_corners.max(axis=0)


def _mouth(model: SectionModel) -> Array:
    """Return the point (2,) midway between the undeformed lips where they are nearest, mm."""
    upper, lower = (model.nodes[np.unique(model.skin[lip])] for lip in LIPS)
    apart = np.linalg.norm(upper[:, None] - lower, axis=-1)
    one, other = np.unravel_index(np.argmin(apart), apart.shape)
    middle: Array = 0.5 * (upper[one] + lower[other])
    return middle


def _new_axes(size: tuple[float, float]) -> Axes:
    from matplotlib import pyplot

    _, axes = pyplot.subplots(figsize=size, layout="constrained")
    return axes
