"""The pictures of a report, as bytes to embed: line drawings as SVG, pictures as PNG or JPEG."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from PIL import Image as Pillow

from geometry2d.foundation.progress import Progress
from geometry2d.neck import NeckSection
from geometry2d.outline import Outline
from scenarios.views.animation import telling_times
from scenarios.views.colours import PRESSURE_COLOURS
from scenarios.views.filmed import Crop, Image
from scenarios.views.page.embedded import Embedded
from scenarios.views.panels import ModelPanel
from scenarios.views.plots import imprint_maps
from scenarios.views.run_view import RunView
from scenarios.views.themes import INK, NECK, NECK_EDGE, PAPER, QUIET, RUN_COLOURS

Array = NDArray[np.float64]

DPI = 100
CELL_PX = (480, 400)
SNAPSHOTS = 6
TEXT = 10.5
CURVE_INCHES = (4.7, 2.5)
IMPRINT_INCHES = (6.0, 5.2)
CONTOUR_INCHES = 4.8
CONTOUR_TITLE_INCHES = 0.35
CONTOUR_SHOWN_MM = 19.0
CONTOUR_MARGIN_MM = 0.7
CONTOUR_HEIGHT_MM = 3.2
"""How far the highest pressure stands off the contour."""

BAND_ALPHA = 0.22

DASHES: tuple[tuple[float, ...], ...] = ((), (5.0, 2.0), (1.5, 1.5), (7.0, 2.0, 1.5, 2.0))
"""On and off lengths of the lines of runs, in widths of the line; no lengths: a whole line."""


@dataclass(frozen=True)
class RunCurve:
    """One run in a figure that compares runs: ``values`` (k,) against ``relative_time`` (k,).

    ``band`` holds what the recording leaves open, from (k,) to (k,), if that is known.
    """

    relative_time: Array
    values: Array
    band: tuple[Array, Array] | None = None


@dataclass(frozen=True)
class InstantPicture:
    """One instant: its time, s, the model, and the recording's picture if there is one."""

    time_s: float
    model: Embedded
    recording: Embedded | None


def line_style(index: int) -> tuple[str, tuple[float, ...]]:
    """Return colour and dashes of run ``index``; they tell runs apart also without colour."""
    return RUN_COLOURS[index % len(RUN_COLOURS)], DASHES[index % len(DASHES)]


def curves(runs: Sequence[RunCurve], *, label: str, shows: str) -> Embedded:
    """Return a figure with one curve for each run, against relative time.

    Parameters
    ----------
    runs
        in the order of :func:`line_style`.
    label
        of the values' axis, with the unit.
    shows
        the figure in words.
    """
    figure = new_figure(CURVE_INCHES)
    axes = figure.subplots()
    for index, run in enumerate(runs):
        colour, dashes = line_style(index)
        if run.band is not None:
            axes.fill_between(run.relative_time, *run.band, color=colour, alpha=BAND_ALPHA, lw=0)
        axes.plot(
            run.relative_time,
            run.values,
            color=colour,
            lw=1.7,
            ls=(0, dashes) if dashes else "-",
        )
    axes.axhline(0.0, color=QUIET, lw=0.8, zorder=0)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylabel(label, color=INK, size=TEXT)
    axes.set_xlabel("relative time", color=INK, size=TEXT)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.grid(axis="y", color="#e4e1db", lw=0.8)
    quieten(axes)
    return svg(figure, shows)


def imprint_figure(
    run_view: RunView, neck: NeckSection, *, highest_kpa: float, shows: str
) -> tuple[Embedded, Embedded]:
    """Return the imprint of a run: pressure along the contour against time, and its maximum.

    Parameters
    ----------
    run_view
        the run.
    neck
        the neck that is drawn.
    highest_kpa
        the pressure at the end of the colours, kPa.
    shows
        the imprint in words.
    """
    figure = new_figure(IMPRINT_INCHES, dpi=150)
    maps = imprint_maps(figure, run_view.solution, neck, highest_kpa=highest_kpa)
    bands = {
        lip: _Band.on(getattr(neck, f"{lip}_wall"), arc, pressure.max(axis=0), highest_kpa)
        for lip, (arc, pressure) in maps.items()
    }
    return (
        png(figure, f"Contact pressure along the neck's contour against time: {shows}"),
        svg(
            _contour_figure(bands, highest_kpa),
            f"Highest contact pressure along the neck's contour: {shows}",
        ),
    )


def snapshots(run_view: RunView, progress: Progress) -> Iterator[InstantPicture]:
    """Yield the telling instants of a run, the model and the recording's picture of each.

    ``progress`` is that of the pictures.
    """
    width, height = CELL_PX
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor=PAPER)
    canvas = cast(Any, FigureCanvasAgg(figure))
    panel = ModelPanel(figure, (1, 1, width - 2, height - 2), run_view, label="")
    times = telling_times(run_view.solution, SNAPSHOTS)
    for number, (time, picture) in enumerate(zip(times, run_view.pictures(times), strict=True)):
        progress(number / times.size, f"instant {number + 1} of {times.size}")
        panel.show(run_view.solution.at(float(time)), run_view.head.at(float(time)))
        canvas.draw()
        drawn = Pillow.fromarray(np.array(canvas.buffer_rgba())[..., :3])
        paletted = drawn.quantize(255, dither=Pillow.Dither.NONE)
        yield InstantPicture(
            float(time),
            Embedded(_saved(paletted, "PNG", optimize=True), "image/png", f"model, {time:.2f} s"),
            None if picture is None else _filmed(run_view, picture, float(time)),
        )


def _filmed(run_view: RunView, picture: Image, time_s: float) -> Embedded:
    rows, columns = picture.shape[:2]
    aspect = CELL_PX[0] / CELL_PX[1]
    crop = Crop.around(run_view.window_px(aspect), picture=(columns, rows), aspect=aspect)
    shown = Pillow.fromarray(crop.scaled(picture, CELL_PX))
    return Embedded(
        _saved(shown, "JPEG", quality=86),
        "image/jpeg",
        f"{run_view.recording_title}, {time_s:.2f} s",
    )


@dataclass(frozen=True)
class _Band:
    """A wall near its opening (n, 2), and pressure (a,), kPa, that stands off it from foot to tip.

    ``foot`` and ``tip`` are (a, 2) mm of the neck frame.
    """

    wall: Array
    foot: Array
    tip: Array
    pressure: Array

    @classmethod
    def on(cls, outline: Outline, arc: Array, pressure: Array, highest_kpa: float) -> _Band:
        foot, normal = outline.point_at(np.mod(arc, outline.length))
        height = CONTOUR_HEIGHT_MM * pressure / highest_kpa
        return cls(outline.sampled(0.1), foot, foot + normal * height[:, None], pressure)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, bottom, right, top of what is shown, mm."""
        pressed = self.tip[self.pressure > 0]
        drawn = np.vstack([self.wall, pressed])
        left, bottom = drawn.min(axis=0) - CONTOUR_MARGIN_MM
        top = drawn[:, 1].max() + CONTOUR_MARGIN_MM
        return float(left), float(bottom), float(left + CONTOUR_SHOWN_MM), float(top)


def _contour_figure(bands: Mapping[str, _Band], highest_kpa: float) -> Figure:
    """Return both walls at one scale, one above the other."""
    left = min(band.box[0] for band in bands.values())
    heights = [band.box[3] - band.box[1] for band in bands.values()]
    inches_per_mm = CONTOUR_INCHES / CONTOUR_SHOWN_MM
    figure = new_figure(
        (CONTOUR_INCHES, sum(heights) * inches_per_mm + CONTOUR_TITLE_INCHES * len(bands))
    )
    panels = figure.subplots(len(bands), 1, height_ratios=heights)
    for axes, (lip, band) in zip(panels, bands.items(), strict=True):
        _draw_band(axes, band, highest_kpa)
        _, bottom, _, top = band.box
        axes.set(xlim=(left, left + CONTOUR_SHOWN_MM), ylim=(bottom, top), aspect="equal")
        axes.set_axis_off()
        highest = band.pressure.max()
        highest_text = f"up to {highest:.0f} kPa" if highest > 0 else "not touched"
        axes.set_title(f"{lip} wall, {highest_text}", size=TEXT, color=INK, loc="left")
    x, y = left + CONTOUR_SHOWN_MM - 6.0, band.box[1] + 0.15
    axes.plot([x, x + 5.0], [y, y], color=INK, lw=2.5, solid_capstyle="butt")
    axes.text(x + 2.5, y + 0.2, "5 mm", size=TEXT - 1, color=INK, ha="center", va="bottom")
    return figure


def _draw_band(axes: Axes, band: _Band, highest_kpa: float) -> None:
    axes.fill(*band.wall.T, facecolor=NECK, edgecolor=NECK_EDGE, lw=1.0, alpha=0.45)
    pressed = (band.pressure[:-1] > 0) & (band.pressure[1:] > 0)
    foot, tip = band.foot, band.tip
    quads = np.stack([foot[:-1], tip[:-1], tip[1:], foot[1:]], axis=1)[pressed]
    filled = PolyCollection(
        cast(Any, quads),
        edgecolors="face",
        linewidths=0.3,
        cmap=PRESSURE_COLOURS,
        norm=Normalize(0.0, highest_kpa),
    )
    filled.set_array(((band.pressure[:-1] + band.pressure[1:]) / 2)[pressed])
    axes.add_collection(filled)
    edge = LineCollection(list(np.stack([tip[:-1], tip[1:]], axis=1)[pressed]), colors=INK, lw=0.8)
    axes.add_collection(edge)


def gradient(mappable: ScalarMappable, stops: int = 9) -> str:
    """Return the colours of a mappable as a CSS gradient, linear in the value."""
    low, high = mappable.get_clim()
    rgba = mappable.to_rgba(np.linspace(low or 0.0, high or 1.0, stops))
    colours = [matplotlib.colors.to_hex(colour) for colour in cast(Any, rgba)]
    return f"linear-gradient(to right, {', '.join(colours)})"


def new_figure(inches: tuple[float, float], dpi: int = DPI) -> Figure:
    """Return an empty white figure."""
    figure = Figure(figsize=inches, dpi=dpi, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def quieten(axes: Axes) -> None:
    """Give axes the looks of a page: two spines, small labels."""
    axes.tick_params(labelsize=TEXT - 0.5, colors=INK, length=3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(QUIET)


def svg(figure: Figure, shows: str) -> Embedded:
    """Return a figure as a drawing; the same figure gives the same bytes."""
    stream = io.BytesIO()
    # Without a salt of our own, the same run would give different bytes each time.
    with matplotlib.rc_context({"svg.hashsalt": "drinksim", "svg.fonttype": "path"}):
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return Embedded(stream.getvalue(), "image/svg+xml", shows)


def png(figure: Figure, shows: str) -> Embedded:
    """Return a figure as a picture."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return Embedded(stream.getvalue(), "image/png", shows)


def _saved(picture: Pillow.Image, kind: str, **how: Any) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, kind, **how)
    return stream.getvalue()
