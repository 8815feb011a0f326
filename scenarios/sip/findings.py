"""What is odd, or wrong, about a neck, a head and a motion, before anything is computed.

A finding that contradicts the recording is an error: nothing that is computed from it could be
believed. One that is merely unusual is a warning: it stays in the summary and in the report. All
checks are geometric, with undeformed lips and everything rigid, and take a fraction of a second.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry2d.anatomy.head import HeadSection
from geometry2d.crests import crests_behind_marks, end_fullness
from geometry2d.neck import NeckSection
from geometry2d.outline import Outline
from geometry2d.rigid import RigidMotion
from mocap.motion.jaw import JawOpening
from scenarios.placing.recorded_motion import RecordedNeck
from scenarios.results.quantities import WALLS
from scenarios.settings.person import JAW_INTERVAL_S, Head
from scenarios.sip.clearance import Approach

Array = NDArray[np.float64]

SPACING_MM = 0.3
"""Distance of the points of a wall that are looked at."""

TOUCHED_MM = 0.5
"""A lip that the neck never comes nearer than this, undeformed, is not touched."""

OVERLAP_MM = 0.5
"""Rigid bodies that overlap by more than this cannot have been where they are said to be."""

DEEP_MM = 6.0
"""Indentation of an undeformed lip from which on it is half its thickness."""

STARTS_FREE_MM = 1.0
"""Indentation of an undeformed lip in the first instant that no free neck has."""

MARKS_APART = 0.1
"""Relative difference between the marks' distance and the recording's that no ruler explains."""

DIAMETERS = (15.0, 80.0)
"""Outer diameters of openings that people drink from, mm."""

OTHER_RIM = 1.25
"""Ratio of a rim's width to the one read off the film, or of that to it, that no eye makes."""

RIM_OFF_MM = 5.0
"""A rim's edge so far from where it was read off the film is another neck's."""

FULLER = 0.08
"""Share of a wall's thickness by which a cut end is fuller than a rounded rim."""

IN_NOSE_MM = 2.0
"""A neck that goes so deep into a nose at rest pushes it aside, which is not computed."""

OTHER_DIAMETER = 1.5
"""Ratio to the filmed neck's diameter, or of that to it, that is worth a second look."""

UNITS_MM = {"cm": 10.0, "inch": 25.4, "m": 1000.0, "µm": 1e-3}

LONGEST_INTERVAL_S = 0.2
"""Longer intervals between the samples of a motion resolve no sip."""

LONGEST_MOTION_S = 120.0
NOSE_ABOVE_MM = 10.0
"""The tip of a nose is at least so far above the mouth."""

LEAST_WAY_MM = 5.0
"""A neck that travels less than this does not come to a mouth and leave it."""

LEAST_REACH = 0.5
"""A package's mark that stays nearer to the ear than this share of the mouth's distance is in
another unit."""

TEETH_APART_MM = 2.0
"""Incisors that are nearer to one another leave no way to a mouth that drinks."""

NEAR_MM = 2.5
"""A neck that never comes nearer to any lip than this never touches one."""

LEAST_TURN_DEG = 4.0
"""A sip turns the package by tens of degrees; a turn smaller than this, as large as it is in
radians, is one in radians."""

GAP_RATIO = 3.5
"""An interval so many times the usual one is a hole in the motion."""


class Severity(Enum):
    """Whether a finding stops a replay; the value is the word that reports use."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong or odd.

    Attributes
    ----------
    severity
        Whether it contradicts the recording.
    subject
        The setting or file that it is about.
    message
        What is the case, with its value, and what to do.
    """

    severity: Severity
    subject: str
    message: str

    def __str__(self) -> str:
        return f"{self.subject}: {self.message}"


def findings_of(
    approach: Approach,
    *,
    filmed: NeckSection,
    recorded: RecordedNeck,
) -> tuple[Finding, ...]:
    """Return what is wrong or odd, errors first.

    Parameters
    ----------
    approach
        Of the neck to the head.
    filmed
        The neck that was filmed; the approach's own if no other one is carried by it.
    recorded
        What the recording says of the filmed neck.
    """
    found = [
        *time_findings(approach.motion.time_s),
        *_size_findings(approach.head, approach.motion),
        *neck_findings(approach.neck, filmed, recorded),
        *jaw_findings(approach.head),
    ]
    if not any(finding.severity is Severity.ERROR for finding in found):
        found += _path_findings(approach)
    return tuple(sorted(found, key=lambda finding: finding.severity is Severity.WARNING))


def time_findings(time_s: Array) -> Iterator[Finding]:
    """Yield what is odd about the times (n,) of a motion, in s if they are what they should be."""
    intervals = np.diff(time_s)
    usual, longest = float(np.median(intervals)), float(intervals.max())
    if usual > LONGEST_INTERVAL_S or time_s[-1] - time_s[0] > LONGEST_MOTION_S:
        unit = "frame numbers" if np.allclose(intervals, 1.0) else "milliseconds"
        yield Finding(
            Severity.ERROR,
            "time_s",
            f"the samples of the motion are {usual:g} s apart and span "
            f"{time_s[-1] - time_s[0]:g} s; these look like {unit}: give times in seconds",
        )
    elif longest > GAP_RATIO * usual:
        at = float(time_s[int(intervals.argmax())])
        yield Finding(
            Severity.WARNING,
            "time_s",
            f"the motion has a hole of {longest:.3g} s at {at:.3f} s (usual interval {usual:.3g} "
            "s): rows are missing, and what is between them is interpolated",
        )


def neck_findings(
    neck: NeckSection, filmed: NeckSection, recorded: RecordedNeck
) -> Iterator[Finding]:
    """Yield what is odd about a neck, beside the one that was filmed."""
    diameter, reference = diameter_mm(neck), diameter_mm(filmed)
    low, high = DIAMETERS
    if not low <= diameter <= high:
        units = [unit for unit, mm in UNITS_MM.items() if low <= diameter * mm <= high]
        remedy = f"; it looks like a drawing in {units[0]}" if units else ""
        yield Finding(
            Severity.ERROR,
            "package",
            f"the neck is {diameter:.3g} mm in diameter, outside {low:g} to {high:g} mm that "
            f"people drink from{remedy}: state the drawing's unit, or correct its scale",
        )
    elif max(diameter, reference) > OTHER_DIAMETER * min(diameter, reference):
        yield Finding(
            Severity.WARNING,
            "package",
            f"the neck is {diameter:.1f} mm in diameter and the filmed one {reference:.1f} mm: "
            "a person would hold another mouth, and this one keeps the filmed one's",
        )
    if low <= diameter <= high:
        yield from _end_findings(neck)
    own, theirs = (float(np.linalg.norm(n.upper_mark - n.lower_mark)) for n in (neck, filmed))
    if low <= diameter <= high and abs(own - theirs) > MARKS_APART * theirs:
        yield _other_marks(own, theirs, drawn=not neck.upper_stretches)
    yield from _recorded_findings(filmed, recorded)


def _other_marks(own_mm: float, filmed_mm: float, *, drawn: bool) -> Finding:
    """Return that a neck has other marks than the filmed one: a drawing repeats these."""
    told = f"marks are {own_mm:.1f} mm apart and those of the filmed one {filmed_mm:.1f} mm: "
    if drawn:
        remedy = "draw upper_mark and lower_mark where the recording has its two marks"
        return Finding(Severity.ERROR, "package", f"the drawn neck's {told}{remedy}")
    remedy = "only the filmed neck's say where it was; if they were measured anew, change [filmed]"
    return Finding(Severity.WARNING, "package", f"the neck's {told}{remedy}")


def _recorded_findings(filmed: NeckSection, recorded: RecordedNeck) -> Iterator[Finding]:
    """Yield what contradicts the marker file about the neck that is said to be filmed."""
    mark_distance_mm = recorded.mark_distance_mm
    if mark_distance_mm is not None:
        drawn = float(np.linalg.norm(filmed.upper_mark - filmed.lower_mark))
        if abs(drawn - mark_distance_mm) > MARKS_APART * mark_distance_mm:
            yield Finding(
                Severity.ERROR,
                "package",
                f"the marks of the filmed neck are {drawn:.1f} mm apart, and the recording's scale "
                f"says {mark_distance_mm:.1f} mm: correct the drawing's marks, or [scale] in the "
                "marker file",
            )
    if recorded.rim_mm is not None:
        yield from _rim_findings(filmed, recorded.rim_mm)


def _rim_findings(filmed: NeckSection, rim_mm: Array) -> Iterator[Finding]:
    """Yield a finding if the rim in the film, ends (2, 2), is not that of the filmed neck."""
    edges = np.array([filmed.rim_edge(wall) for wall in ("lower", "upper")])
    drawn, seen = (float(np.linalg.norm(ends[1] - ends[0])) for ends in (edges, rim_mm))
    remedy = "state the neck that was filmed in [filmed], or correct [style] in the marker file"
    if max(drawn, seen) > OTHER_RIM * min(drawn, seen):
        yield Finding(
            Severity.ERROR,
            "package",
            f"the rim of the filmed neck is {drawn:.1f} mm wide and the film's, by rim_lower and "
            f"rim_upper, {seen:.1f} mm: {remedy}",
        )
        return
    off = np.linalg.norm(edges - rim_mm, axis=1)
    if off.max() > RIM_OFF_MM:
        end = "lower" if off[0] > off[1] else "upper"
        yield Finding(
            Severity.WARNING,
            "package",
            f"the {end} edge of the filmed neck's rim is {off.max():.1f} mm from rim_{end} in the "
            f"film, seen from the marks: {remedy}",
        )


def _end_findings(neck: NeckSection) -> Iterator[Finding]:
    """Yield a finding if the rim seems to be at the package's end, as in a mirrored drawing."""
    crests = crests_behind_marks(neck)
    if crests:
        yield Finding(
            Severity.ERROR if crests > 1 else Severity.WARNING,
            "package",
            f"the neck has {crests} of its crests behind the marks and none before them: the rim "
            "is at the wrong end; mirror the drawing, so that the rim is at the smallest x",
        )
        return
    measured = bool(neck.upper_stretches)
    rim, end = (0.0, 0.0) if measured else end_fullness(neck)
    if rim - end > FULLER:
        yield Finding(
            Severity.WARNING,
            "package",
            f"the end at the smallest x, which is taken for the rim, is {100 * rim:.0f} % as thick "
            f"as the wall behind it and the other end {100 * end:.0f} %: rims are the rounder end; "
            "mirror the drawing if it shows the neck the other way round",
        )


def diameter_mm(neck: NeckSection) -> float:
    """Return the outer diameter of a neck's section, mm."""
    upper, lower = (getattr(neck, wall).sampled(SPACING_MM)[:, 1] for wall in WALLS)
    return float(upper.max() - lower.min())


def _size_findings(head: HeadSection, motion: RigidMotion) -> Iterator[Finding]:
    way = float(np.max(np.ptp(motion.shift_mm, axis=0)))
    turn = float(np.ptp(np.rad2deg(motion.angle_rad)))
    reach = float(np.max(np.hypot(*motion.shift_mm.T)))
    least = LEAST_REACH * float(np.hypot(*(_mouth(head) - head.landmarks["ear"])))
    units = [unit for unit, mm in UNITS_MM.items() if least < reach * mm < 20 * least]
    if way < LEAST_WAY_MM or reach < least:
        remedy = f"these look like {units[0]}" if reach < least and units else "nothing is drunk"
        yield Finding(
            Severity.ERROR,
            "rel_x_mm, rel_y_mm",
            f"the neck travels {way:.3g} mm in all, at most {reach:.3g} mm from the ear; {remedy}: "
            "give lengths in mm",
        )
    elif turn < LEAST_TURN_DEG < float(np.rad2deg(turn)):
        yield Finding(
            Severity.ERROR,
            "rel_theta_deg",
            f"the package turns by {turn:.3g}° in all while it travels {way:.0f} mm; this looks "
            "like radians: give angles in degrees",
        )


def _mouth(head: HeadSection) -> Array:
    mouth: Array = 0.5 * (head.landmarks["stomion_upper"] + head.landmarks["stomion_lower"])
    return mouth


def jaw_findings(head: HeadSection) -> Iterator[Finding]:
    """Yield a finding if the jaw is shut."""
    upper, lower = (
        shapely.Polygon(tooth.sampled(SPACING_MM)) for tooth in (head.upper_tooth, head.lower_tooth)
    )
    apart = float(upper.distance(lower))
    if apart < TEETH_APART_MM:
        yield Finding(
            Severity.WARNING,
            "head",
            f"the jaw is shut: the incisors are {apart:.1f} mm apart, and who drinks opens the "
            "mouth; set head.jaw_opening_deg, 7 just before contact, or draw the jaw open",
        )


def jaw_file_findings(head: Head) -> Iterator[Finding]:
    """Yield a finding if a filmed jaw turns by less than its marks can tell."""
    if head.jaw_file is None:
        return
    jaw = JawOpening.read(Path(head.jaw_file))
    turn = float(np.degrees(np.ptp(jaw.means(JAW_INTERVAL_S)[1])))
    error = float(np.degrees(jaw.sigma_rad.max()))
    if turn < error:
        yield Finding(
            Severity.WARNING,
            "head.jaw_file",
            f"in {Path(head.jaw_file).name} the jaw turns by {turn:.1f}°, and its standard error "
            f"is {error:.1f}°, as skin slides over the bone: the film does not tell that it turns; "
            "leave the file out to keep it where it is",
        )


def _path_findings(approach: Approach) -> Iterator[Finding]:
    """Yield what is odd about where the neck goes."""
    yield from _turned_findings(approach)
    walls = np.concatenate([getattr(approach.neck, wall).sampled(SPACING_MM) for wall in WALLS])
    points = np.stack([place.apply(walls) for place in approach.placements])
    yield from _bone_findings(approach, points)
    yield from _nose_findings(approach, points)
    yield from _lip_findings(approach)


def _turned_findings(approach: Approach) -> Iterator[Finding]:
    """Yield a finding if not the rim but the package's end of the neck is at the mouth."""
    left, bottom, right, top = _box(approach.neck)
    middle = 0.5 * (bottom + top)
    mouth, places = _mouth(approach.head), approach.placements
    rim, end = (
        np.array([np.hypot(*(place.apply(np.array([[x, middle]]))[0] - mouth)) for place in places])
        for x in (left, right)
    )
    nearest = int(np.argmin(np.minimum(rim, end)))
    if end[nearest] < rim[nearest]:
        yield Finding(
            Severity.ERROR,
            "package",
            f"the end of the neck that joins the package comes within {end[nearest]:.0f} mm of the "
            f"mouth and its rim stays {rim[nearest]:.0f} mm away: the rim is at the smallest x of "
            "the neck; mirror the drawing, or exchange its marks",
        )


def _bone_findings(approach: Approach, points: Array) -> Iterator[Finding]:
    """Yield a finding for each hard part of the head that points (t, p, 2) of the neck go into."""
    head, neck, times = approach.head, approach.neck, approach.time_s
    hard = {
        "the upper incisor": head.upper_tooth,
        "the lower incisor": head.lower_tooth,
        "the upper jaw": shapely.Polygon(head.upper_jaw),
        "the lower jaw": shapely.Polygon(head.lower_jaw),
    }
    for name, part in hard.items():
        depth = _depths(points, part)
        worst = int(np.argmax(depth))
        if depth[worst] > OVERLAP_MM:
            yield Finding(
                Severity.ERROR,
                "placement",
                f"the neck, {diameter_mm(neck):.1f} mm in diameter, goes {depth[worst]:.1f} mm "
                f"into {name} at {times[worst]:.2f} s, lips aside: correct the marks or the scale, "
                "or move the package with placement.shift_x_mm and shift_y_mm",
            )


def _nose_findings(approach: Approach, points: Array) -> Iterator[Finding]:
    """Yield a finding if points (t, p, 2) of the neck go into the nose."""
    nose = nose_profile(approach.head)
    deepest = _polygon_depths(points, shapely.Polygon(nose), shapely.LineString(nose))
    worst = int(np.argmax(deepest))
    if deepest[worst] > IN_NOSE_MM:
        yield Finding(
            Severity.ERROR if deepest[worst] > DEEP_MM else Severity.WARNING,
            "placement",
            f"the neck, {diameter_mm(approach.neck):.1f} mm in diameter, goes {deepest[worst]:.1f} "
            f"mm into the nose at rest at {approach.time_s[worst]:.2f} s: correct the marks or the "
            "scale, or move the package with placement.shift_x_mm and shift_y_mm",
        )


def nose_profile(head: HeadSection) -> Array:
    """Return the profile (n, 2) of the nose, from its back to where it meets the lip, mm."""
    profile, lip = head.profile, head.landmarks["stomion_upper"]
    # The profile runs from the forehead down.
    above = profile[: int(np.argmin(np.hypot(*(profile - lip).T)))]
    tip = int(np.argmax(np.where(above[:, 1] > lip[1] + NOSE_ABOVE_MM, above[:, 0], -np.inf)))
    along, up = (above[tip:] - above[tip]).T
    inside = along * up[-1] - up * along[-1]
    base = tip + int(np.argmax(inside))
    back = int(np.argmin(np.abs(above[: tip + 1, 1] - (2 * above[tip, 1] - above[base, 1]))))
    nose: Array = above[back : base + 1]
    return nose


def _lip_findings(approach: Approach) -> Iterator[Finding]:
    gaps, times = approach.gaps_mm, approach.time_s
    if all(gap[0] < -STARTS_FREE_MM for gap in gaps.values()):
        yield Finding(
            Severity.ERROR,
            "motion",
            "the neck is inside both lips in the first instant: start the film, or --start, "
            "before the package is at the mouth",
        )
        return
    smallest = np.min(list(gaps.values()), axis=0)
    nearest = int(np.argmin(smallest))
    if smallest[nearest] > NEAR_MM:
        yield Finding(
            Severity.ERROR,
            "motion",
            f"the neck stays {smallest[nearest]:.1f} mm away from both lips (nearest at "
            f"{times[nearest]:.2f} s) and never touches one: check the scale and the units, or "
            "shift the package with placement.shift_x_mm and shift_y_mm",
        )
        return
    for lip, gap in gaps.items():
        yield from _touch_findings(lip, gap, times)


def _touch_findings(lip: str, gap: Array, times: Array) -> Iterator[Finding]:
    """Yield what is odd about how near the neck comes to a lip: gap (n,), mm, at times (n,), s."""
    nearest = int(np.argmin(gap))
    if gap[nearest] > TOUCHED_MM:
        yield Finding(
            Severity.WARNING,
            f"{lip} lip",
            f"is never touched while it is at rest: the neck stays {gap[nearest]:.1f} mm away "
            f"(nearest at {times[nearest]:.2f} s); move the package with placement.shift_y_mm if "
            "the film shows otherwise",
        )
    elif gap[nearest] < -DEEP_MM:
        yield Finding(
            Severity.WARNING,
            f"{lip} lip",
            f"would be indented {-gap[nearest]:.1f} mm if it were rigid (at {times[nearest]:.2f} "
            "s), more than half its thickness: look at the scale and the placement",
        )
    for end, word in ((0, "first"), (-1, "last")):
        if gap[end] < 0:
            yield Finding(
                Severity.WARNING,
                "motion",
                f"touches the {lip} lip in its {word} instant ({times[end]:.2f} s): the film, or "
                "the table, may be cut short",
            )


def _depths(points: Array, part: Outline | shapely.Polygon) -> Array:
    """Return how deep the deepest of points (t, p, 2) lies in a rigid part, (t,), mm, or 0."""
    if isinstance(part, shapely.Polygon):
        return _polygon_depths(points, part, part.exterior)
    left, bottom, right, top = part.box
    x, y = np.moveaxis(points, -1, 0)
    near = (x > left) & (x < right) & (y > bottom) & (y < top)
    depth = np.zeros(points.shape[:2])
    depth[near] = -part.project(points[near]).distance
    deepest: Array = np.maximum(depth, 0.0).max(axis=1)
    return deepest


def _polygon_depths(points: Array, inside: shapely.Polygon, skin: shapely.LineString) -> Array:
    """Return how far the deepest of points (t, p, 2) in a polygon is from its skin, (t,), mm."""
    within = shapely.contains_xy(inside, points[..., 0], points[..., 1])
    depth = np.zeros(points.shape[:2])
    depth[within] = shapely.distance(skin, shapely.points(points[within]))
    deepest: Array = depth.max(axis=1)
    return deepest


def _box(neck: NeckSection) -> tuple[float, float, float, float]:
    """Return left, bottom, right, top of a neck's walls, mm."""
    upper, lower = neck.upper_wall.box, neck.lower_wall.box
    return (
        float(min(upper[0], lower[0])),
        float(lower[1]),
        float(max(upper[2], lower[2])),
        float(upper[3]),
    )
