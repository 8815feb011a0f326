"""Figure of the relative motion against time, with its standard error as a band."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array: TypeAlias = NDArray[np.float64]

PHASE_COLOURS = {
    "approach": "#e8eef5",
    "contact": "#fdebd0",
    "tilt": "#f9d7c3",
    "drink": "#f3bfb3",
    "release": "#e3ecd9",
}
LINE, BAND = "#1a365d", "#2b6cb0"


def relative_figure(
    time_s: Array,
    relative_mm: Array,
    relative_rad: Array,
    sigma: Array,
    *,
    title: str,
    phases_s: Mapping[str, tuple[float, float]],
) -> Figure:
    """Return position and rotation of the package seen from the head against time.

    Parameters
    ----------
    time_s, relative_mm, relative_rad
        (n,) s, (n, 2) mm and (n,) rad: the motion.
    sigma
        (n, 3) its standard errors, mm and rad. Bands of ±2σ lie along each curve, where they are
        narrow beside a motion of centimetres, and enlarged below it.
    title
        Title of the figure.
    phases_s
        Start and end of each phase, s; phases are shaded.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(6, 1, sharex=True, height_ratios=[3, 1] * 3)
    rows = (
        ("x (mm)", "mm", relative_mm[:, 0], sigma[:, 0]),
        ("y (mm)", "mm", relative_mm[:, 1], sigma[:, 1]),
        ("turn (°)", "°", np.degrees(relative_rad), np.degrees(sigma[:, 2])),
    )
    for k, (label, unit, values, error) in enumerate(rows):
        panel, strip = axes[2 * k], axes[2 * k + 1]
        for place, middle in ((panel, values), (strip, np.zeros_like(values))):
            _shade(place, phases_s)
            place.fill_between(
                time_s,
                middle - 2 * error,
                middle + 2 * error,
                color=BAND,
                alpha=0.45,
                lw=0,
                label="band",
            )
            place.grid(color="0.85", lw=0.6)
        panel.plot(time_s, values, color=LINE, lw=1.4)
        panel.set_ylabel(label)
        strip.axhline(0.0, color=LINE, lw=0.8)
        strip.set_ylabel(f"±2σ ({unit})", fontsize=8)
        strip.tick_params(axis="y", labelsize=8)
        # A long dropout has a wide band; it may leave the strip, so that the rest stays visible.
        reach = float(min(2.6 * np.max(error), 12 * np.median(error)))
        if reach > 0:
            strip.set_ylim(-reach, reach)
    axes[-1].set_xlabel("time (s)")
    axes[-1].set_xlim(time_s[0], time_s[-1])
    figure.align_ylabels(axes)
    figure.suptitle(title, fontsize=12)
    patches = [Patch(color=PHASE_COLOURS[name], label=name) for name in phases_s]
    patches.append(Patch(color=BAND, alpha=0.45, label="±2σ, below each curve enlarged"))
    figure.legend(handles=patches, loc="outside lower center", ncols=6, frameon=False, fontsize=9)
    return figure


def _shade(panel, phases_s: Mapping[str, tuple[float, float]]) -> None:  # type: ignore[no-untyped-def]
    """Colour the phases behind a panel."""
    for name, (start, end) in phases_s.items():
        panel.axvspan(start, end, color=PHASE_COLOURS[name], lw=0)
