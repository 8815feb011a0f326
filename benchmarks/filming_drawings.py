"""Drawings of the filming guide: the set-up, where dots go, and what dots look like to the camera.

The set-up is a sketch; the other two are what the virtual camera sees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, Polygon
from numpy.typing import NDArray

from geometry2d.anatomy.head import head_section
from mocap.synthetic.camera import Sensor
from mocap.synthetic.rendering import exposed, truth_at
from mocap.tracking.marker_file import read_markers
from mocap.video.frames import Image, Video
from scenarios.settings.scenario import load_scenario
from tests.support.clips import Clip

INK, SOFT, MARK = "#1d2126", "#6b7480", "#1b4fa8"
SHOWN_MM = 11.0
"""Half the side of a picture of a dot, mm."""

DOT = Clip(width=640, height=400, px_per_mm=3.0, frames=20, jaw=False, full_well_e=9000.0)
DOTS: Mapping[str, Clip] = {
    "good: 4 mm, sharp, on plain ground": DOT,
    "too small: 1 mm": replace(DOT, dot_radius_mm=0.6),
    "out of focus": replace(DOT, blur_px=7.0),
    "smeared: exposure 1/25 s": replace(DOT, exposure_s=0.04),
    "faint: grey on white": replace(DOT, mark_colour=(0.78, 0.78, 0.78)),
    "dark room": replace(DOT, full_well_e=150.0),
}
"""Dots of the package as the camera sees them in the middle of the sip."""


def draw_setup(file: Path) -> None:
    """Draw camera, person, lamp and ruler from the side and from above."""
    figure = Figure(figsize=(10.0, 4.7), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    _from_behind_the_camera(_axes(figure, 1, "what the camera sees", (-190, 330), (-260, 190)))
    _from_above(_axes(figure, 2, "from above", (-700, 800), (-1750, 330)))
    figure.savefig(file)


def _axes(
    figure: Figure, number: int, title: str, x: tuple[float, float], y: tuple[float, float]
) -> Axes:
    axes = figure.add_subplot(1, 2, number)
    axes.set_title(title, fontsize=11, color=INK)
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(*x)
    axes.set_ylim(*y)
    return axes


def _from_behind_the_camera(axes: Axes) -> None:
    frame = FancyBboxPatch((-180, -250), 500, 430, boxstyle="square", fill=False, ec=SOFT)
    axes.add_patch(frame)
    outline = head_section().profile
    axes.add_patch(Polygon(outline, closed=False, fill=False, ec=INK, lw=1.6))
    for name, at in {"ear": (0, 0), "nose": (84, 8)}.items():
        _dot(axes, at, name)
    neck = np.array([[112, -62], [128, -34], [205, -78], [292, -130], [262, -182], [176, -132]])
    axes.add_patch(Polygon(neck, fill=False, ec=INK, lw=1.6))
    _dot(axes, (140, -72), "package_lower", below=True)
    _dot(axes, (150, -54), "package_upper")
    axes.plot([200, 300], [40, 40], color=MARK, lw=5, solid_capstyle="butt")
    axes.text(312, 52, "ruler, as deep as the neck", ha="right", fontsize=8, color=MARK)
    axes.plot([-165, 305], [-225, -225], color=SOFT, lw=0.8, ls="--")
    axes.text(70, -244, "level; the head fills a third of the picture", ha="center", fontsize=8)


def _dot(axes: Axes, at: tuple[float, float], name: str, *, below: bool = False) -> None:
    axes.add_patch(Circle(at, 8, fc="white", ec=SOFT))
    axes.add_patch(Circle(at, 4, fc=INK))
    text = (at[0] - 60, at[1] - 84) if below else (at[0] + 14, at[1] + 10)
    line = {"arrowstyle": "-", "color": MARK, "shrinkB": 6} if below else None
    axes.annotate(name, at, text, fontsize=8, color=MARK, arrowprops=line)


def _from_above(axes: Axes) -> None:
    axes.add_patch(Circle((-60, 0), 85, fill=False, ec=INK, lw=1.6))
    axes.add_patch(Polygon([[22, 14], [52, 0], [22, -14]], fill=False, ec=INK, lw=1.6))
    axes.add_patch(FancyBboxPatch((60, -30), 190, 60, boxstyle="square", fill=False, ec=INK))
    axes.plot([-500, 500], [0, 0], color=MARK, lw=1, ls="--")
    axes.text(520, 0, "plane of the sip", va="center", fontsize=8, color=MARK)
    axes.add_patch(FancyBboxPatch((-20, -1640), 160, 110, boxstyle="square", fc="#d5dae0", ec=INK))
    axes.add_patch(FancyBboxPatch((20, -1530), 80, 60, boxstyle="square", fc="#d5dae0", ec=INK))
    axes.text(175, -1590, "camera on a tripod,\nfocus and exposure locked", fontsize=8, va="center")
    axes.plot([60, 60], [-1460, -20], color=SOFT, lw=1)
    axes.text(80, -480, "1.5 m or more,\nsquare to the plane", fontsize=8, va="center")
    for x in (-560, 560):
        axes.add_patch(Circle((x, -900), 55, fc="#ffe9a8", ec=INK))
        axes.plot([x, x * 0.4], [-840, -140], color="#d9a400", lw=1, ls=":")
    axes.text(-600, -1110, "light from both sides,\nnone of it flickering", fontsize=8)


def draw_places(file: Path) -> None:
    """Draw where dots go, on the first frame of a rendered recording."""
    recording = load_scenario("A38-F").recording
    assert recording is not None
    assert recording.markers is not None
    frame = next(iter(Video(recording.video).frames()))
    figure = Figure(figsize=(9.0, 5.06), dpi=110)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.imshow(frame.colour()[..., ::-1])
    axes.set_axis_off()
    below = {"nose": (40, -60), "ear": (-190, -70), "package_lower": (-260, 70)}
    style = {"arrowstyle": "-", "color": MARK}
    for name, at in read_markers(recording.markers).positions_px.items():
        assert at is not None
        dx, dy = below.get(name, (60, -50))
        axes.annotate(
            _said(name), at, (at[0] + dx, at[1] + dy), fontsize=10, color=MARK, arrowprops=style,
            bbox={"boxstyle": "round", "fc": "white", "ec": MARK, "alpha": 0.9},
        )  # fmt: skip
    figure.savefig(file)


def _said(name: str) -> str:
    where = {
        "ear": "ear: before the tragus",
        "nose": "nose: its wing, not the tip",
        "jaw_front": "jaw_front (optional)",
        "jaw_back": "jaw_back (optional)",
        "package_lower": "package_lower: behind the thread",
        "package_upper": "package_upper: across the neck",
    }
    return where[name]


def draw_dots(file: Path) -> None:
    """Draw good and poor dots as the virtual camera sees them, enlarged."""
    figure = Figure(figsize=(9.0, 6.4), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    for number, (name, clip) in enumerate(DOTS.items(), start=1):
        axes = figure.add_subplot(2, 3, number)
        axes.imshow(_package_dots(clip), interpolation="nearest")
        axes.set_title(name, fontsize=10, color=INK if number > 1 else MARK)
        axes.set_xticks([])
        axes.set_yticks([])
    figure.savefig(file)


def _package_dots(clip: Clip) -> Image:
    """Return what is seen of the package's dots while they move fastest, RGB."""
    time = 0.25 * clip.frames / clip.fps
    scene, camera = clip.scene(), clip.camera()
    sensor = Sensor(full_well_e=clip.full_well_e, read_noise_e=6.0, seed=1)
    picture: NDArray[np.uint8] = sensor.read_out(exposed(scene, camera, sensor, time), 0)
    marks = truth_at(scene, camera, time, 0).markers
    pair = [(marks[name].x_px, marks[name].y_px) for name in ("package_lower", "package_upper")]
    x, y = np.mean(pair, axis=0)
    half = round(SHOWN_MM * clip.px_per_mm)
    rows, columns = (slice(max(round(at) - half, 0), round(at) + half) for at in (y, x))
    return np.ascontiguousarray(picture[rows, columns])
