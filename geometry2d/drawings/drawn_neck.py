"""A neck from a drawing (SVG or DXF) in place of the measured one.

The drawing holds two closed curves named ``upper_wall`` and ``lower_wall`` and, where the two marks
of the recording are, two circles ``upper_mark`` and ``lower_mark``. Names are labels or ids in SVG,
layers in DXF. The neck may lie anywhere and at any angle on the sheet: the marks give its position
and direction. With the lower mark below the upper one, the opening is on the left, as in the
recordings. Everything else in the drawing is ignored.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry2d.drawings.chains import DrawingError
from geometry2d.drawings.drawing_file import drawn_outlines
from geometry2d.drawings.joined import NamedOutline, centre_of
from geometry2d.neck import NeckMeasurements, NeckSection, with_carton
from geometry2d.outline import Outline
from geometry2d.rigid import rotated

Array = NDArray[np.float64]

WALLS = ("upper_wall", "lower_wall")
MARKS = ("upper_mark", "lower_mark")
CONTOUR_STEP_MM = 0.1


def drawn_neck(
    file: Path, *, unit_mm: float | None = None, carton: NeckMeasurements | None = None
) -> NeckSection:
    """Return the neck of a drawing in the neck frame.

    Parameters
    ----------
    file
        SVG or DXF with the curves that the module docstring names.
    unit_mm
        Unit of the drawing, mm, if the file does not state it.
    carton
        Measurements of the package behind the neck, for pictures; its others are not used.

    Raises
    ------
    DrawingError
        If the drawing cannot be read, or a wall or mark is missing, doubled or in the wrong place.
    """
    found = drawn_outlines(file, unit_mm=unit_mm, names=(*WALLS, *MARKS))
    by_name = {name: _only(found, name, file.name) for name in (*WALLS, *MARKS)}
    upper_mark, lower_mark = (centre_of(by_name[name]) for name in MARKS)
    distance = float(np.hypot(*(upper_mark - lower_mark)))
    if distance < 1.0:
        raise DrawingError(
            f"{file.name}: the marks are {distance:.3g} mm apart, too near to give the direction "
            "of the neck: move them to their places in the recording"
        )
    turn = 0.5 * np.pi - float(np.arctan2(*(upper_mark - lower_mark)[::-1]))
    shift = -rotated(lower_mark[None], turn)[0]
    upper, lower = (by_name[name].moved(turn, shift) for name in WALLS)
    _refuse_misplaced(upper, lower, file.name)
    return NeckSection(
        upper_wall=upper,
        lower_wall=lower,
        upper_stretches={},
        lower_stretches={},
        upper_mark=np.array([0.0, distance]),
        lower_mark=np.zeros(2),
        silhouette=_silhouette(upper, lower, carton or NeckMeasurements()),
    )


def _only(found: list[NamedOutline], name: str, file: str) -> Outline:
    outlines = [outline for called, outline in found if called.lower() == name]
    if len(outlines) != 1:
        raise DrawingError(
            f"{file} has {len(outlines)} closed curves named {name!r} (id or label in SVG, layer "
            "in DXF): it must have one"
        )
    return outlines[0]


def _refuse_misplaced(upper: Outline, lower: Outline, file: str) -> None:
    above, below = (shapely.Polygon(wall.sampled(CONTOUR_STEP_MM)) for wall in (upper, lower))
    if above.intersects(below):
        raise DrawingError(f"{file}: upper_wall and lower_wall overlap: draw them apart")
    if above.centroid.y < below.centroid.y:
        raise DrawingError(
            f"{file}: with lower_mark below upper_mark, upper_wall lies below lower_wall: "
            "exchange the names of the walls or those of the marks"
        )


def _silhouette(upper: Outline, lower: Outline, carton: NeckMeasurements) -> Array:
    top = _outermost(upper.sampled(CONTOUR_STEP_MM), +1.0)
    bottom = _outermost(lower.sampled(CONTOUR_STEP_MM), -1.0)
    return with_carton(
        carton,
        bottom,
        top[::-1],
        reach_mm=float(max(top[-1, 0], bottom[-1, 0])),
        axis_mm=float(0.5 * (top[:, 1].max() + bottom[:, 1].min())),
    )


def _outermost(points: Array, side: float) -> Array:
    """Return the outermost point (n, 2), mm, of a wall in each step along the axis."""
    column = np.floor(points[:, 0] / (2 * CONTOUR_STEP_MM)).astype(int)
    order = np.lexsort((-side * points[:, 1], column))
    first = np.unique(column[order], return_index=True)[1]
    return points[order][first]
