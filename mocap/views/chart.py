"""The relative motion against time as a picture, with its uncertainty as a band."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mocap.motion.motion import Capture
from mocap.motion.phases import DrinkingFigures, drinking_figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PHASE_COLOURS = {
    "approach": "#e8eef5",
    "contact": "#fdebd0",
    "tilt": "#f9d7c3",
    "drink": "#f3bfb3",
    "release": "#e3ecd9",
}
LINE, BAND = "#1a365d", "#2b6cb0"


def write_chart(motion: Capture, path: Path, *, rendered: bool) -> None:
    """Write the picture of :func:`motion_figure` as a PNG."""
    motion_figure(motion, rendered=rendered).savefig(path, dpi=110)


def motion_figure(motion: Capture, *, rendered: bool) -> Figure:
    """Return position and turn of the package seen from the head against time.

    Parameters
    ----------
    motion
        The motion; its standard errors are drawn as bands of ±2σ, along each curve and, since they
        are narrow beside a motion of centimetres, once more on a scale of their own below it.
    rendered
        Whether the recording was drawn, which the title then says.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(6, 1, sharex=True, height_ratios=[3, 1] * 3)
    figures = drinking_figures(motion)
    rows = (
        ("x (mm)", "mm", motion.relative_mm[:, 0], motion.sigma[:, 0]),
        ("y (mm)", "mm", motion.relative_mm[:, 1], motion.sigma[:, 1]),
        ("turn (°)", "°", np.degrees(motion.relative_rad), np.degrees(motion.sigma[:, 2])),
    )
    for k, (label, unit, values, sigma) in enumerate(rows):
        panel, strip = axes[2 * k], axes[2 * k + 1]
        for place, middle in ((panel, values), (strip, np.zeros_like(values))):
            _shade(place, figures)
            place.fill_between(
                motion.time_s,
                middle - 2 * sigma,
                middle + 2 * sigma,
                color=BAND,
                alpha=0.45,
                lw=0,
                label="band",
            )
            place.grid(color="0.85", lw=0.6)
        panel.plot(motion.time_s, values, color=LINE, lw=1.4)
        panel.set_ylabel(label)
        strip.axhline(0.0, color=LINE, lw=0.8)
        strip.set_ylabel(f"±2σ ({unit})", fontsize=8)
        strip.tick_params(axis="y", labelsize=8)
        # A gap that was bridged would hide the rest: beyond this the band runs out of the strip.
        reach = float(min(2.6 * np.max(sigma), 12 * np.median(sigma)))
        strip.set_ylim(-reach, reach)
    axes[-1].set_xlabel("time (s)")
    axes[-1].set_xlim(motion.time_s[0], motion.time_s[-1])
    figure.align_ylabels(axes)
    said = " (rendered recording)" if rendered else ""
    reference, moving = motion.poses
    figure.suptitle(f"Motion of the {moving} seen from the {reference}{said}", fontsize=12)
    patches = [Patch(color=PHASE_COLOURS[name], label=name) for name in figures.phases_s]
    patches.append(Patch(color=BAND, alpha=0.45, label="±2σ, below each curve enlarged"))
    figure.legend(handles=patches, loc="outside lower center", ncols=6, frameon=False, fontsize=9)
    return figure


def _shade(panel, figures: DrinkingFigures) -> None:  # type: ignore[no-untyped-def]
    """Colour the phases behind a panel."""
    for name, (start, end) in figures.phases_s.items():
        panel.axvspan(start, end, color=PHASE_COLOURS[name], lw=0)
