"""The parts of which films and contact sheets are laid out: recording, model, histories, colours.

Places are given in px from the upper left corner: left, top, width, height.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from geometry2d.rigid import RigidPlacement
from scenarios.results.solution import Snapshot
from scenarios.views.filmed import Crop, Image
from scenarios.views.labels import Closer, PartLabels, halo
from scenarios.views.run_view import RunView, Window
from scenarios.views.scene import SectionArtists
from scenarios.views.themes import Theme

Array = NDArray[np.float64]
Place = tuple[float, float, float, float]

CLOSER_SHARE = 0.36
"""Side of the closer look over the height of the panel that it lies in."""


def axes_at(figure: Figure, place: Place) -> Axes:
    """Return axes at ``place`` on a figure."""
    width, height = figure.get_size_inches() * figure.dpi
    left, top, wide, high = place
    return figure.add_axes((left / width, 1.0 - (top + high) / height, wide / width, high / height))


class ModelPanel:
    """The model in the world, with its name and a scale bar."""

    def __init__(
        self,
        figure: Figure,
        place: Place,
        run_view: RunView,
        *,
        label: str = "model",
        names: bool = False,
        closer: bool = False,
        faded: bool = False,
    ) -> None:
        theme = run_view.theme
        self.axes = _framed(axes_at(figure, place), theme)
        window = run_view.window(place[2] / place[3])
        self.axes.set_xlim(window.left, window.left + window.width)
        self.axes.set_ylim(window.bottom, window.bottom + window.height)
        self.scene = SectionArtists(
            self.axes,
            run_view.solution.snapshot(0),
            run_view.shown,
            run_view.limits,
            theme=theme,
        )
        if faded:
            self.scene.fade()
        self.artists: list[Artist] = [*self.scene.artists, *_scale_bar(self.axes, window, theme)]
        if label:
            self.artists.append(_label(self.axes, label, theme))
        self._names = PartLabels(self.axes, size=11, theme=theme) if names else None
        self.artists += self._names.artists if self._names else []
        self._closer = _closer(figure, place, self.axes, run_view) if closer else None
        self.artists += self._closer.artists if self._closer else []

    def show(self, snapshot: Snapshot, head: RigidPlacement) -> None:
        """Show the model at one instant, with the head at ``head`` in the world."""
        for part in (self.scene, self._names, self._closer):
            if part is not None:
                part.show(snapshot, head)


def _closer(figure: Figure, place: Place, whole: Axes, run_view: RunView) -> Closer:
    """Return a closer look at what is pressed most, in the lower right corner of a panel."""
    left, top, width, height = place
    side = CLOSER_SHARE * height
    corner = (left + width - side - 8, top + height - side - 8, side, side)
    axes = _framed(axes_at(figure, corner), run_view.theme)
    axes.set_zorder(3)
    return Closer.on(
        axes, whole, run_view.solution, run_view.shown, run_view.limits, run_view.theme
    )


class Picture(Artist):
    """An image shown pixel for pixel, its lower left corner at a place of the canvas, px.

    matplotlib's own images are resampled whenever they are drawn, which takes longer than
    everything else in a frame together.
    """

    def __init__(self, corner_px: tuple[float, float], image: Image) -> None:
        super().__init__()
        self._corner_px = corner_px
        self.set_image(image)

    def set_image(self, image: Image) -> None:
        """Show another image (rows, columns, 3), RGB."""
        opaque = np.full((*image.shape[:2], 1), 255, np.uint8)
        self._rgba = np.ascontiguousarray(np.concatenate([image, opaque], axis=2)[::-1])

    def draw(self, renderer: RendererBase) -> None:
        """Copy the image onto the canvas."""
        if self.get_visible():
            renderer.draw_image(renderer.new_gc(), *self._corner_px, self._rgba)


class RecordingPanel:
    """A part of the recording, with the model's window outlined where its scale is known."""

    def __init__(
        self,
        figure: Figure,
        place: Place,
        run_view: RunView,
        *,
        aspect: float,
        label: str | None = None,
        whole_window: bool = False,
    ) -> None:
        self.axes = _framed(axes_at(figure, place), run_view.theme)
        self._size = (round(place[2]), round(place[3]))
        self._run_view = run_view
        self._aspect = aspect
        self._crop = run_view.window_px(aspect) if whole_window else None
        title = "" if whole_window else run_view.recording_title
        self.axes.set_xlim(0.0, self._size[0])
        self.axes.set_ylim(self._size[1], 0.0)
        blank = np.full((self._size[1], self._size[0], 3), 235, np.uint8)
        bottom = round(figure.get_figheight() * figure.dpi - place[1] - place[3])
        self._image = Picture((round(place[0]), bottom), blank)
        self.axes.add_artist(self._image)
        self._outline = Rectangle((0, 0), 0, 0, fill=False, ec="white", lw=1.6, visible=False)
        self.axes.add_patch(self._outline)
        title = label if label is not None else title
        self.artists: list[Artist] = [self._image, self._outline]
        if title:
            self.artists.append(_label(self.axes, title, run_view.theme))

    def show(self, picture: Image) -> None:
        """Show one picture of the recording (rows, columns, 3)."""
        if self._crop is None:
            self._frame_mouth(picture)
        assert self._crop is not None
        self._image.set_image(self._crop.scaled(picture, self._size))

    def _frame_mouth(self, picture: Image) -> None:
        """Choose the part of the picture to show: around the mouth, or else the whole picture."""
        rows, columns = picture.shape[:2]
        window = self._run_view.window_px(self._aspect)
        self._crop = Crop.around(
            window, picture=(columns, rows), aspect=self._size[0] / self._size[1]
        )
        if window is not None:
            scale = self._size[0] / self._crop.width
            self._outline.set_bounds(
                (window.left - self._crop.left) * scale,
                (window.top - self._crop.top) * scale,
                window.width * scale,
                window.height * scale,
            )
            self._outline.set_visible(True)


def colour_bars(
    figure: Figure,
    scene: SectionArtists,
    run_view: RunView,
    places: Sequence[Place],
    *,
    size: float,
) -> None:
    """Draw what the colours of the tissue and of the contact mean, one bar at each place."""
    shown, ink = run_view.shown, run_view.theme.ink
    unit = f", {shown.unit}" if shown.unit else ""
    bars: tuple[tuple[ScalarMappable, str, float], ...] = (
        (scene.element_colours, shown.title + unit, shown.centre),
        (scene.pressure_colours, "contact pressure, kPa", 0.0),
    )
    for (colours, title, centre), place, highest, largest in zip(
        bars, places, run_view.limits, run_view.largest, strict=True
    ):
        axes = axes_at(figure, place)
        bar = figure.colorbar(colours, cax=axes, orientation="horizontal")
        ticks, labels = _ticks(colours.get_clim(), centre, highest, cut=largest > highest)
        bar.set_ticks(ticks, labels=labels)
        bar.outline.set_visible(False)
        axes.tick_params(labelsize=size, colors=ink, length=3, pad=2)
        most = f"{largest:.2g}" if largest < 1 else f"{largest:.0f}"
        around = f"{centre:g} ± " if centre else ""
        axes.set_title(f"{title}: up to {around}{most}", size=size, color=ink, loc="left", pad=4)


def _ticks(
    ends: tuple[float | None, float | None], centre: float, highest: float, *, cut: bool
) -> tuple[list[float], list[str]]:
    """Return three values of a bar and what they are called; the last says what the bar cuts."""
    if centre:
        around = [centre - highest, centre, centre + highest]
        less, more = ("≤ ", "≥ ") if cut else ("", "")
        return around, [f"{less}{around[0]:g}", f"{centre:g}", f"{more}{around[2]:g}"]
    above = "≥ " if cut else ""
    values = [ends[0] or 0.0, highest / 2, highest]
    return values, ["0", f"{highest / 2:g}", f"{above}{highest:g}"]


def _framed(axes: Axes, theme: Theme) -> Axes:
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_facecolor(theme.panel)
    for spine in axes.spines.values():
        spine.set_color(theme.line)
    return axes


def _label(axes: Axes, text: str, theme: Theme) -> Artist:
    return axes.annotate(
        text,
        (0.0, 1.0),
        xycoords="axes fraction",
        xytext=(9, -9),
        textcoords="offset points",
        ha="left",
        va="top",
        size=12,
        color=theme.ink,
        zorder=9,
        bbox={"boxstyle": "round,pad=0.35", "fc": theme.paper, "ec": "none", "alpha": 0.85},
    )


def _scale_bar(axes: Axes, window: Window, theme: Theme, length_mm: float = 10.0) -> list[Artist]:
    x = window.left + 0.03 * window.width
    y = window.bottom + 0.045 * window.height
    (bar,) = axes.plot(
        [x, x + length_mm], [y, y], color=theme.ink, lw=3, zorder=9, solid_capstyle="butt"
    )
    text = axes.text(
        x + length_mm / 2,
        y + 0.02 * window.height,
        f"{length_mm:g} mm",
        ha="center",
        va="bottom",
        size=11,
        color=theme.ink,
        zorder=9,
        path_effects=halo(theme),
    )
    return [bar, text]
