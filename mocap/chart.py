"""The relative motion against time as a picture, with its uncertainty as a band."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mocap.motion import Capture
from mocap.phases import DrinkingFigures, drinking_figures

PHASE_COLOURS = {
    "approach": "#e8eef5",
    "contact": "#fdebd0",
    "tilt": "#f9d7c3",
    "drink": "#f3bfb3",
    "release": "#e3ecd9",
}


def write_chart(motion: Capture, path: Path, *, rendered: bool) -> None:
    """Write position and turn of the package seen from the head as a PNG.

    Parameters
    ----------
    motion
        The motion; its standard errors are drawn as bands of ±2σ.
    path
        The file to write.
    rendered
        Whether the recording was drawn, which the title then says.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(3, 1, sharex=True)
    figures = drinking_figures(motion)
    turn = np.degrees(motion.relative_rad)
    rows = (
        ("x (mm)", motion.relative_mm[:, 0], motion.sigma[:, 0]),
        ("y (mm)", motion.relative_mm[:, 1], motion.sigma[:, 1]),
        ("turn (°)", turn, np.degrees(motion.sigma[:, 2])),
    )
    for panel, (label, values, sigma) in zip(axes, rows, strict=True):
        _shade(panel, figures, named=panel is axes[0])
        panel.fill_between(
            motion.time_s, values - 2 * sigma, values + 2 * sigma, color="#2b6cb0", alpha=0.35, lw=0
        )
        panel.plot(motion.time_s, values, color="#1a365d", lw=1.4)
        panel.set_ylabel(label)
        panel.grid(color="0.85", lw=0.6)
        panel.text(
            0.995,
            0.05,
            f"±2σ: {2 * float(np.median(sigma)):.2g}",
            transform=panel.transAxes,
            ha="right",
            fontsize=9,
            color="#2b6cb0",
        )
    axes[-1].set_xlabel("time (s)")
    axes[-1].set_xlim(motion.time_s[0], motion.time_s[-1])
    said = " (rendered recording)" if rendered else ""
    reference, moving = motion.poses
    figure.suptitle(f"Motion of the {moving} seen from the {reference}{said}", fontsize=12)
    figure.savefig(path, dpi=110)


def _shade(panel, figures: DrinkingFigures, *, named: bool) -> None:  # type: ignore[no-untyped-def]
    """Colour the phases behind a panel, with their names above the first."""
    for name, (start, end) in figures.phases_s.items():
        panel.axvspan(start, end, color=PHASE_COLOURS[name], lw=0)
        if named:
            panel.text(
                0.5 * (start + end),
                1.02,
                name,
                transform=panel.get_xaxis_transform(),
                ha="center",
                fontsize=9,
                color="0.3",
            )
