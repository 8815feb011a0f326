"""Package necks from named measurements: two walls of a threaded tube, cut through its axis.

Neck frame: origin at the lower mark on the visible side of the neck, x along the neck's axis into
the package, y across it. At angle 0 the opening faces −x, towards the mouth of a person who faces
+x, and the lower wall has the lower y. All lengths in mm.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import check_ranges, measured, setting
from geometry2d.outline import Outline, OutlineError

Array = NDArray[np.float64]

SP_38_400 = "SP 38-400 as published in the BOSL2 library"
PCO_1881 = "PCO 1881 as published in the BOSL2 library, scaled by 26/27.4"
ESTIMATE = "estimate; the real neck's drawing is not public"


class NeckError(DrinksimError):
    """Measurements that describe no neck."""


_measured = partial(measured, above=0.0)


@dataclass(frozen=True)
class NeckMeasurements:
    """Named measurements of a neck; the defaults are the A38's, `DC_NECK` the smaller one's."""

    thread_diameter_mm: float = _measured(37.2, "mm", SP_38_400, "outer diameter of the thread")
    root_diameter_mm: float = _measured(34.8, "mm", SP_38_400, "diameter between the threads")
    pitch_mm: float = _measured(4.233, "mm", SP_38_400, "distance from crest to crest")
    crests: int = setting(
        default=2,
        source="two turns, as 38 mm necks with 650-720°",
        description="thread crests cut on each side; 0 is a neck without a thread",
        minimum=0,
    )
    flank_deg: float = _measured(30.0, "deg", SP_38_400, "flank from the radial direction")
    crest_width_mm: float = _measured(
        1.01, "mm", f"{SP_38_400}: base 2.39 and flank 30°", "flat crest between the flanks"
    )
    land_mm: float = _measured(1.3, "mm", f"{SP_38_400}: 1.17, rounded up", "rim to first thread")
    wall_thickness_mm: float = _measured(1.8, "mm", ESTIMATE, "wall between the threads")
    rim_radius_mm: float = _measured(0.75, "mm", ESTIMATE, "round-over of both edges of the rim")
    crest_radius_mm: float = _measured(0.4, "mm", "BOSL2: thread corner 0.5", "edges of the crests")
    root_radius_mm: float = _measured(0.3, "mm", ESTIMATE, "fillets at the foot of the thread")
    length_mm: float = _measured(28.0, "mm", ESTIMATE, "rim to where the walls are cut off")
    mark_distance_mm: float = _measured(14.0, "mm", "the recordings", "between the two marks")
    mark_behind_thread_mm: float = _measured(
        3.5, "mm", "the recordings: a few mm", "last thread to the marks, along the axis"
    )
    package_width_mm: float = _measured(50.0, "mm", "Tetra Top 200 ml, rounded", "carton's width")
    package_height_mm: float = _measured(
        110.0, "mm", "Tetra Top 200 ml, rounded", "carton's height, shoulder included"
    )
    shoulder_mm: float = _measured(15.0, "mm", ESTIMATE, "height of the sloping shoulder")

    def __post_init__(self) -> None:
        check_ranges(self, NeckError)
        if self.thread_diameter_mm <= self.root_diameter_mm:
            raise NeckError(
                f"thread_diameter_mm is {self.thread_diameter_mm}, not more than "
                f"root_diameter_mm {self.root_diameter_mm}: the thread is higher than its root"
            )
        if 2 * self.rim_radius_mm >= self.wall_thickness_mm:
            raise NeckError(
                f"rim_radius_mm is {self.rim_radius_mm} but the wall only "
                f"{self.wall_thickness_mm} mm thick: use less than half the thickness"
            )
        if 2 * self.wall_thickness_mm >= self.root_diameter_mm:
            raise NeckError(
                f"wall_thickness_mm is {self.wall_thickness_mm}: it leaves no bore in a neck of "
                f"{self.root_diameter_mm} mm"
            )
        if self.mark_distance_mm >= self.root_diameter_mm:
            raise NeckError(
                f"mark_distance_mm is {self.mark_distance_mm}: the marks do not fit on a neck of "
                f"{self.root_diameter_mm} mm"
            )
        if self.length_mm <= self.mark_depth_mm:
            raise NeckError(
                f"length_mm is {self.length_mm} but the marks lie {self.mark_depth_mm:.1f} mm "
                "from the rim: use a longer neck"
            )

    @property
    def thread_depth_mm(self) -> float:
        """Height of the thread over its root, mm."""
        return 0.5 * (self.thread_diameter_mm - self.root_diameter_mm)

    @property
    def thread_base_mm(self) -> float:
        """Width of the thread at its foot, mm."""
        return self.crest_width_mm + 2 * self.thread_depth_mm * math.tan(
            math.radians(self.flank_deg)
        )

    @property
    def carton_from_mm(self) -> float:
        """Distance of the carton's shoulder from the marks along the axis, mm."""
        return self.mark_behind_thread_mm + 2.0

    @property
    def mark_depth_mm(self) -> float:
        """Distance of the marks from the rim along the axis, mm."""
        thread_end = self.land_mm
        if self.crests > 0:
            thread_end = thread_end + self.thread_base_mm + (self.crests - 0.5) * self.pitch_mm
        return thread_end + self.mark_behind_thread_mm


A38_NECK = NeckMeasurements()
"""The 38 mm neck."""

DC_NECK = NeckMeasurements(
    thread_diameter_mm=26.0,
    root_diameter_mm=23.0,
    pitch_mm=2.56,
    crests=1,
    flank_deg=15.0,
    crest_width_mm=0.9,
    land_mm=1.6,
    wall_thickness_mm=1.5,
    rim_radius_mm=0.6,
    crest_radius_mm=0.35,
    length_mm=26.0,
)
"""The 26 mm neck, with a single turn (fewer threads than the A38)."""

RIM_DEPTH_MM = 0.9
"""Depth behind the rim at which the outside of a wall is measured, mm: behind the rim's rounding
and before the first thread."""

RIM_SPACING_MM = 0.02

NECKS: Mapping[str, NeckMeasurements] = {"A38": A38_NECK, "DC": DC_NECK}
NECK_SOURCES: Mapping[str, str] = {"A38": SP_38_400, "DC": PCO_1881}


@dataclass(frozen=True)
class NeckSection:
    """A neck cut through its axis, in the neck frame.

    Attributes
    ----------
    upper_wall, lower_wall
        The two walls as closed outlines.
    upper_stretches, lower_stretches
        Arc-length intervals (from, to), mm, of the outline by name: "rim", "land", "crest_1",
        "root_1", ..., "plain". The rest is the bore and the closed end.
    upper_mark, lower_mark
        (2,) marks on the visible side; the lower one is the origin.
    silhouette
        (n, 2) visible outline of neck and package, for drawing.
    """

    upper_wall: Outline
    lower_wall: Outline
    upper_stretches: Mapping[str, tuple[float, float]]
    lower_stretches: Mapping[str, tuple[float, float]]
    upper_mark: Array
    lower_mark: Array
    silhouette: Array

    def rim_edge(self, wall: str) -> Array:
        """Return the outer edge (2,), mm, of a wall's rim without its rounding.

        There the plane of the rim meets the outside of the wall, as measured `RIM_DEPTH_MM` behind
        it.

        Parameters
        ----------
        wall
            "upper" or "lower".
        """
        outline: Outline = getattr(self, f"{wall}_wall")
        points = outline.sampled(RIM_SPACING_MM)
        rim = points[:, 0].min()
        height = points[points[:, 0] <= rim + RIM_DEPTH_MM, 1]
        return np.array([rim, height.max() if wall == "upper" else height.min()])


def neck_section(measurements: NeckMeasurements | None = None) -> NeckSection:
    """Return the neck that the measurements describe.

    Raises
    ------
    NeckError
        If roundings and threads do not fit on the wall.
    """
    m = NeckMeasurements() if measurements is None else measurements
    upper_wall, upper_stretches = _wall(m, upper=True)
    lower_wall, lower_stretches = _wall(m, upper=False)
    return NeckSection(
        upper_wall=upper_wall,
        lower_wall=lower_wall,
        upper_stretches=upper_stretches,
        lower_stretches=lower_stretches,
        upper_mark=np.array([0.0, m.mark_distance_mm]),
        lower_mark=np.zeros(2),
        silhouette=_silhouette(m, upper_wall, lower_wall),
    )


def _crest_depths(m: NeckMeasurements, *, upper: bool) -> Array:
    """Return the depth of each crest's middle below the rim, mm; half a turn adds half a pitch."""
    first = m.land_mm + 0.5 * m.thread_base_mm
    depths: Array = first + m.pitch_mm * (np.arange(float(m.crests)) + (0.0 if upper else 0.5))
    return depths


def _placed(m: NeckMeasurements, depth_radius: Array, *, upper: bool) -> Array:
    """Return points (n, 2) of the neck frame from depths below the rim and radii (n, 2), mm."""
    side = 1.0 if upper else -1.0
    axis = 0.5 * m.mark_distance_mm
    return np.column_stack([depth_radius[:, 0] - m.mark_depth_mm, axis + side * depth_radius[:, 1]])


def _wall(m: NeckMeasurements, *, upper: bool) -> tuple[Outline, dict[str, tuple[float, float]]]:
    root, crest = 0.5 * m.root_diameter_mm, 0.5 * m.thread_diameter_mm
    bore = root - m.wall_thickness_mm
    half_base, half_crest = 0.5 * m.thread_base_mm, 0.5 * m.crest_width_mm
    depths = _crest_depths(m, upper=upper)
    outside: list[tuple[float, float, float]] = [(0.0, root, m.rim_radius_mm)]
    for depth in depths:
        outside += [
            (depth - half_base, root, m.root_radius_mm),
            (depth - half_crest, crest, m.crest_radius_mm),
            (depth + half_crest, crest, m.crest_radius_mm),
            (depth + half_base, root, m.root_radius_mm),
        ]
    end_radius = 0.3 * m.wall_thickness_mm
    outside.append((m.length_mm, root, end_radius))
    # From the closed end along the bore to the rim and back outside; clockwise for the upper wall.
    corners = np.array([(m.length_mm, bore, end_radius), (0.0, bore, m.rim_radius_mm), *outside])
    if upper:
        corners = np.concatenate([corners[:1], corners[:0:-1]])
    try:
        outline = Outline.from_corners(_placed(m, corners[:, :2], upper=upper), corners[:, 2])
    except OutlineError as error:
        raise NeckError(
            f"the threads or roundings do not fit on a neck with pitch_mm {m.pitch_mm}, "
            f"crest_width_mm {m.crest_width_mm} and land_mm {m.land_mm}: {error}"
        ) from error
    middle = 0.5 * (root + crest)
    half_middle = 0.5 * (half_base + half_crest)
    borders = [(m.rim_radius_mm, bore), (m.rim_radius_mm, root)]
    names = ["rim", "land" if m.crests else "plain"]
    for k, depth in enumerate(depths, start=1):
        borders += [(depth - half_middle, middle), (depth + half_middle, middle)]
        names += [f"crest_{k}", f"root_{k}" if k < m.crests else "plain"]
    borders.append((m.length_mm - end_radius, root))
    at = outline.project(_placed(m, np.array(borders), upper=upper)).arc_length
    stretches = {
        name: (float(min(a, b)), float(max(a, b)))
        for name, a, b in zip(names, at[:-1], at[1:], strict=True)
    }
    return outline, stretches


def _silhouette(m: NeckMeasurements, upper_wall: Outline, lower_wall: Outline) -> Array:
    """Return the outside of the walls with shoulder and carton, counter-clockwise (n, 2), mm."""
    reach = m.carton_from_mm
    axis = 0.5 * m.mark_distance_mm
    upper, lower = (wall.sampled(0.25) for wall in (upper_wall, lower_wall))
    upper_side = upper[(upper[:, 1] >= axis + 0.5 * m.root_diameter_mm - m.rim_radius_mm)]
    lower_side = lower[(lower[:, 1] <= axis - 0.5 * m.root_diameter_mm + m.rim_radius_mm)]
    upper_side = upper_side[upper_side[:, 0] <= reach]
    lower_side = lower_side[lower_side[:, 0] <= reach]
    return with_carton(
        m,
        lower_side[np.argsort(lower_side[:, 0], kind="stable")],
        upper_side[np.argsort(-upper_side[:, 0], kind="stable")],
        reach_mm=reach,
        axis_mm=axis,
    )


def with_carton(
    m: NeckMeasurements, lower_side: Array, upper_side: Array, *, reach_mm: float, axis_mm: float
) -> Array:
    """Return the silhouette (n, 2) of a neck and the carton behind it, counter-clockwise, mm.

    Parameters
    ----------
    m
        The measurements, for width, height and shoulder of the carton.
    lower_side, upper_side
        (k, 2) outside of the neck, mm: from the rim to the carton below, and back above.
    reach_mm, axis_mm
        Start of the shoulder along x and height of the axis, mm.
    """
    half = 0.5 * m.package_width_mm
    end = reach_mm + m.package_height_mm
    carton = [
        (reach_mm + m.shoulder_mm, axis_mm - half),
        (end, axis_mm - half),
        (end, axis_mm + half),
        (reach_mm + m.shoulder_mm, axis_mm + half),
    ]
    return np.concatenate([lower_side, np.array(carton), upper_side])
