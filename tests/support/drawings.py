"""Drawings of the library's necks as SVG sheets."""

from __future__ import annotations

import numpy as np

from geometry2d.neck import A38_NECK, NeckMeasurements, neck_section


def neck_drawing(
    measured: NeckMeasurements = A38_NECK,
    *,
    unit: str = "mm",
    scale: float = 1.0,
    mirrored: bool = False,
    marks_mm: float | None = None,
    shift_mm: float = 0.0,
) -> str:
    """Return the drawing of a neck.

    Parameters
    ----------
    measured
        The neck.
    unit, scale
        Unit that the sheet states, and factor of its numbers.
    mirrored
        Turn the rim to the package.
    marks_mm
        Another distance of the marks.
    shift_mm
        Way of the walls, not of the marks, along the axis.
    """
    neck, side = neck_section(measured), -1.0 if mirrored else 1.0
    shapes = []
    for name in ("upper_wall", "lower_wall"):
        points = getattr(neck, name).sampled(0.5) + np.array([shift_mm, 0.0])
        points = points * (scale * side, -scale)
        data = "M" + " L".join(f"{x:.4f} {y:.4f}" for x, y in points) + " Z"
        shapes.append(f'<path id="{name}" d="{data}"/>')
    for name in ("upper_mark", "lower_mark"):
        x, y = getattr(neck, name)
        if marks_mm is not None and name == "upper_mark":
            y = marks_mm
        shapes.append(
            f'<circle id="{name}" cx="{scale * x:g}" cy="{-scale * y:g}" r="{1.5 * scale:g}"/>'
        )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="200{unit}" height="200{unit}" '
        f'viewBox="-100 -100 200 200">{"".join(shapes)}</svg>'
    )
