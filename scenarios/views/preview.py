"""The preview of a scenario: head and neck at three instants, lips at rest, with findings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from geometry2d.anatomy.head import HeadSection
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import check_writable, file_at_once
from geometry2d.foundation.progress import Progress
from geometry2d.neck import NeckSection
from geometry2d.rigid import RigidMotion, RigidPlacement, rotated
from geometry2d.views.draw import draw_head, draw_neck
from scenarios.messages.lines import carried_message, placement_message
from scenarios.settings.inputs import check_inputs
from scenarios.settings.scenario import Scenario
from scenarios.sip.clearance import Approach
from scenarios.sip.findings import Finding, Severity
from scenarios.sip.replay import neck_findings_of, placed_neck
from scenarios.sip.run import with_known_motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, ALARM, NOTICE = "#2b2320", "#a3271c", "#8a5a00"

ENDINGS = (".png", ".svg", ".pdf")

HALF_VIEW_MM = 40.0
"""Half the width and the height of a panel."""

LINE_CHARACTERS = 118
DOTS_PER_INCH = 110
PANEL_INCHES = 4.2
ROW_INCHES = 0.24


class PreviewError(DrinksimError):
    """A preview cannot be drawn as it is asked for."""


def write_preview(scenario: Scenario, out: Path, *, progress: Progress) -> tuple[Finding, ...]:
    """Write the picture of a preview and return what is wrong or odd, errors first.

    Where the neck alone contradicts the recording, nothing is converted and no picture written.

    Parameters
    ----------
    scenario
        Its recording is converted first if it has no motion.
    out
        A file name, .png, .svg or .pdf.
    progress
        Told how far it is.

    Raises
    ------
    DrinksimError
        If an input cannot be used, or ``out`` has another ending or cannot be written.
    """
    if out.suffix.lower() not in ENDINGS:
        raise PreviewError(f"--out {out} must end in one of {', '.join(ENDINGS)}")
    check_writable(out)
    check_inputs(scenario)
    of_neck = neck_findings_of(scenario)
    if any(finding.severity is Severity.ERROR for finding in of_neck):
        return of_neck
    there = placed_neck(with_known_motion(scenario, progress))
    progress(1.0, "drawing")
    approach, placed, found = there.approach, there.placed, there.findings
    notes = [placement_message(placed.about()), carried_message(there.carried.about())]
    figure = preview_figure(
        f"{scenario.name}: {_neck_name(scenario)}",
        approach.head,
        approach.neck,
        approach.motion,
        _telling_instants(approach, near_mm=scenario.numerics.period.near_mm),
        head_angle_rad=placed.head_angle_rad,
        errors=[str(f) for f in found if f.severity is Severity.ERROR],
        warnings=[str(f) for f in found if f.severity is Severity.WARNING],
        notes=[note for note in notes if note],
    )
    with file_at_once(out) as partial:
        figure.savefig(partial, dpi=DOTS_PER_INCH)
    return found


def _neck_name(scenario: Scenario) -> str:
    package = scenario.package
    if package.outline is not None:
        return f"neck drawn in {Path(package.outline).name}"
    return f"neck {package.neck}" + ("" if scenario.filmed is None else ", changed")


def _telling_instants(approach: Approach, *, near_mm: float) -> list[float]:
    """Return when the neck first comes near the lips, half way, and when it last is near, s."""
    times, gap = approach.time_s, np.min(list(approach.gaps_mm.values()), axis=0)
    near = times[gap < near_mm]
    if near.size == 0:
        return [float(times[int(np.argmin(gap))])]
    return [float(near[0]), 0.5 * float(near[0] + near[-1]), float(near[-1])]


def preview_figure(
    title: str,
    head: HeadSection,
    neck: NeckSection,
    motion: RigidMotion,
    instants_s: Sequence[float],
    *,
    head_angle_rad: float,
    errors: Sequence[str] = (),
    warnings: Sequence[str] = (),
    notes: Sequence[str] = (),
) -> Figure:
    """Return a picture with one panel an instant and what is to be known below.

    Parameters
    ----------
    title
        Name of the scenario and of the neck.
    head, neck, motion
        The sections, and the motion of the neck in the frame of the head section.
    instants_s
        Times to show, s, such as first contact, half way and last contact.
    head_angle_rad
        Turn of the head section in the recording, rad: the panels are turned by it.
    errors, warnings, notes
        Sentences below the panels, in this order.
    """
    from matplotlib.figure import Figure

    sentences = [
        *((f"error: {text}", ALARM) for text in errors),
        *((f"warning: {text}", NOTICE) for text in warnings),
        *((text, INK) for text in notes),
    ]
    lines = [
        (line, colour)
        for text, colour in sentences
        for line in wrap(text, LINE_CHARACTERS, subsequent_indent="    ")
    ]
    below = ROW_INCHES * (len(lines) + 0.8)
    width, height = PANEL_INCHES * len(instants_s), PANEL_INCHES + 0.7 + below
    figure = Figure(figsize=(width, height), facecolor="white")
    figure.text(0.012, 1 - 0.32 / height, title, fontsize=13, color=INK, va="center")
    for column, time in enumerate(instants_s):
        axes = figure.add_axes(
            (
                (column + 0.02) / len(instants_s),
                (below + 0.05) / height,
                0.96 / len(instants_s),
                PANEL_INCHES / height,
            )
        )
        _draw_panel(axes, head, neck, motion.at(float(time)), head_angle_rad)
        axes.set_title(f"{time:.2f} s", fontsize=11, color=INK, pad=4)
    for row, (line, colour) in enumerate(lines):
        y = (below - ROW_INCHES * (row + 0.7)) / height
        figure.text(0.012, y, line, fontsize=10, color=colour, va="center")
    return figure


def _draw_panel(
    axes: Axes, head: HeadSection, neck: NeckSection, place: RigidPlacement, angle_rad: float
) -> None:
    from matplotlib.transforms import Affine2D

    draw_head(axes, head)
    draw_neck(axes, neck, place)
    turn = Affine2D().rotate(angle_rad)
    for artist in (*axes.patches, *axes.lines):
        artist.set_transform(turn + axes.transData)
    for text, name, offset in (
        ("upper lip", "stomion_upper", (-3.0, 13.0)),
        ("lower lip", "stomion_lower", (4.0, -15.0)),
    ):
        at = rotated(head.landmarks[name] + np.array(offset), angle_rad)
        axes.text(at[0], at[1], text, fontsize=8, color=INK, ha="center", va="center", zorder=9)
    left, bottom, right, top = _view(head, angle_rad)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_color("#d8d0cb")
    x, y = right - 14.0, bottom + 4.0
    axes.plot([x, x + 10.0], [y, y], color=INK, linewidth=2, zorder=9, solid_capstyle="butt")
    axes.text(x + 5.0, y + 1.5, "10 mm", fontsize=8, color=INK, ha="center", zorder=9)


def _view(head: HeadSection, angle_rad: float) -> tuple[float, float, float, float]:
    """Return left, bottom, right, top of a square about the mouth, mm."""
    mouth = 0.5 * (head.landmarks["stomion_upper"] + head.landmarks["stomion_lower"])
    middle, half = rotated(mouth + np.array([0.3 * HALF_VIEW_MM, 0.0]), angle_rad), HALF_VIEW_MM
    return (
        float(middle[0] - half),
        float(middle[1] - half),
        float(middle[0] + half),
        float(middle[1] + half),
    )
