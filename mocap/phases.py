"""Drinking figures from a motion: phases, tilt, pitch, closest approach, and the style.

The package is *at the mouth* while its reference point is within ``AT_MOUTH_MM`` of the place of
closest approach to the head's reference point, in one stretch around that instant. Within that
stretch the *tilt* is the package's rotation seen from the head, counted from its arrival towards
its largest amount. Then

=========  =====================================================================
approach   from the first movement (10 % of the largest speed) to the mouth
contact    at the mouth, before a tenth of the tilt
tilt       from a tenth to nine tenths of the tilt
drink      as long as nine tenths of the tilt are kept
release    from then until the mouth is left
=========  =====================================================================

Suck, pour and pull differ in which lip seals (thesis §4.1): 'suck' closes both lips around the
package, 'pour' leaves the upper lip off, 'pull' seals the upper lip with the liquid. None of that
can be seen from rigid motions, but how the flow is driven can: nothing runs out of a package that
is kept upright, so it is sucked; it runs by itself from one turned down steeply. So a style is
named only where the motion excludes the others, and is ``unknown`` otherwise. 'pull' is never
named: it moves as the others do, and the liquid on the upper lip, which tells it, is not seen.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.motion import Capture

Array: TypeAlias = NDArray[np.float64]

AT_MOUTH_MM = 15.0
MOVING_SHARE = 0.1
# Between two sips the package goes at least this much (mm) further away than its closest place.
LEAVES_MM = 80.0
TILT_SHARE = 0.1
# A package tilted less than this (degrees) while at the mouth is not emptied by gravity.
NO_TILT_DEG = 3.0
# Level liquid in a cylinder 2.5 times as high as wide and nine tenths full reaches the rim when
# tilted by atan(0.5) = 27°: nothing runs out while the opening points higher above level than this.
UPRIGHT_DEG = 63.0
# Gravity alone empties a package whose opening is turned down at least this far below level.
STEEP_DEG = 25.0
# Marks that lie across the neck, one above the other when the package lies level.
ACROSS_THE_NECK = ("package_lower", "package_upper")
PHASES = ("approach", "contact", "tilt", "drink", "release")


@dataclass(frozen=True)
class DrinkingFigures:
    """What a drinking motion looks like in numbers.

    ``phases_s`` (start and end by name; phases that do not occur are left out) and times in s,
    angles in degrees, lengths in mm. ``style`` is "suck", "pour" or "unknown"; ``style_reason``
    says by which observation.
    """

    phases_s: dict[str, tuple[float, float]]
    duration_at_mouth_s: float
    closest_s: float
    closest_mm: float
    neck_tilt_deg: float
    head_pitch_deg: float
    style: str
    style_reason: str

    def as_json(self) -> dict[str, Any]:
        """Return the figures as plain values."""
        return asdict(self)


def drinking_figures(motion: Capture, *, inclination_deg: float | None = None) -> DrinkingFigures:
    """Return the figures of a captured motion.

    Parameters
    ----------
    motion
        Head and package.
    inclination_deg
        How far the opening points above level in the first frame, if known: the style can be told
        only then. None: from the standard marks, which lie across the neck, the camera held level.
    """
    if inclination_deg is None:
        inclination_deg = _inclination_of_marks(motion)
    return figures_of(
        motion.time_s,
        motion.relative_mm,
        motion.relative_rad,
        motion.head.angle_rad,
        inclination_deg=inclination_deg,
    )


def _inclination_of_marks(motion: Capture) -> float | None:
    """Return how far above level (deg) an opening points that faces left, square to its marks."""
    for body, pose in motion.poses.items():
        if pose.markers == ACROSS_THE_NECK:
            across = np.pi / 2 - motion.axis_rad[body]
            return float(np.degrees(np.arctan2(np.sin(across), np.cos(across))))
    return None


def figures_of(
    time_s: Array,
    relative_mm: Array,
    relative_rad: Array,
    head_rad: Array,
    *,
    inclination_deg: float | None = None,
) -> DrinkingFigures:
    """Return the figures of a motion given as arrays.

    Parameters
    ----------
    time_s
        (n,) times, s.
    relative_mm, relative_rad
        (n, 2) and (n,): the package seen from the head.
    head_rad
        (n,) rotation of the head; its range is the head's pitch.
    inclination_deg
        As in :func:`drinking_figures`.
    """
    distance = np.hypot(*relative_mm.T)
    closest = int(np.argmin(distance))
    near = np.hypot(*(relative_mm - relative_mm[closest]).T) < AT_MOUTH_MM
    first, last = _run_around(near, closest)
    change = np.degrees(relative_rad[first : last + 1] - relative_rad[first])
    most = float(change[np.argmax(np.abs(change))])
    phases = _phases(time_s, relative_mm, first, last, change, most)
    turned = np.degrees(relative_rad + head_rad)[first : last + 1]
    style, reason = _style(turned - np.degrees(relative_rad + head_rad)[0], inclination_deg)
    return DrinkingFigures(
        phases_s=phases,
        duration_at_mouth_s=float(time_s[last] - time_s[first]),
        closest_s=float(time_s[closest]),
        closest_mm=float(distance[closest]),
        neck_tilt_deg=most,
        head_pitch_deg=float(np.degrees(np.ptp(head_rad))),
        style=style,
        style_reason=reason,
    )


def sips_of(
    time_s: Array, relative_mm: Array, relative_rad: Array, head_rad: Array
) -> list[DrinkingFigures]:
    """Return the figures of every sip of a longer recording, in order of time.

    A sip is a stretch at the mouth; two are apart if the package leaves the mouth in between by
    ``LEAVES_MM``. Arguments as in :func:`figures_of`.
    """
    distance = np.hypot(*relative_mm.T)
    away = distance > distance.min() + LEAVES_MM
    edges = np.flatnonzero(np.diff(np.concatenate([[True], away, [True]]).astype(int)))
    arrivals, leavings = edges[::2], edges[1::2]
    # Each sip has the time from when the one before was over to when the next begins.
    starts = np.concatenate([[0], leavings[:-1]])
    ends = np.concatenate([arrivals[1:], [time_s.size]])
    return [
        figures_of(time_s[a:b], relative_mm[a:b], relative_rad[a:b], head_rad[a:b])
        for a, b in zip(starts, ends, strict=True)
    ]


def _run_around(mask: NDArray[np.bool_], at: int) -> tuple[int, int]:
    """Return the first and last index of the run of true values that holds ``at``."""
    first = last = at
    while first > 0 and mask[first - 1]:
        first -= 1
    while last < mask.size - 1 and mask[last + 1]:
        last += 1
    return first, last


def _phases(
    time: Array, relative: Array, first: int, last: int, change: Array, most: float
) -> dict[str, tuple[float, float]]:
    """Return start and end (s) of each phase that occurs."""
    speed = np.hypot(*np.gradient(relative, time, axis=0).T) if time.size > 1 else np.zeros(1)
    moving = np.flatnonzero(speed[: first + 1] > MOVING_SHARE * speed.max())
    phases: dict[str, tuple[float, float]] = {}
    if first > 0 and moving.size:
        phases["approach"] = (float(time[moving[0]]), float(time[first]))
    share = change / most if abs(most) > NO_TILT_DEG else np.zeros_like(change)
    tilted = np.flatnonzero(share > TILT_SHARE)
    full = np.flatnonzero(share > 1 - TILT_SHARE)
    if tilted.size == 0:
        phases["contact"] = (float(time[first]), float(time[last]))
        return phases
    begin, reached, left = first + tilted[0], first + full[0], first + full[-1]
    marks = {
        "contact": (first, begin),
        "tilt": (begin, reached),
        "drink": (reached, left),
        "release": (left, last),
    }
    for name, (start, end) in marks.items():
        if end > start:
            phases[name] = (float(time[start]), float(time[end]))
    return phases


def _style(turned_deg: Array, inclination_deg: float | None) -> tuple[str, str]:
    """Return the style and the observation it rests on.

    ``turned_deg`` is the package's rotation in the world since the first frame while at the mouth:
    counter-clockwise, it lowers an opening that faces left, to a mouth that faces right.
    """
    if inclination_deg is None:
        return "unknown", "how far the opening points above level is not known"
    lowest = inclination_deg - float(turned_deg.max())
    if lowest > UPRIGHT_DEG:
        return "suck", f"the opening stays {lowest:.0f}° above level: nothing runs out by itself"
    if lowest < -STEEP_DEG:
        return "pour", f"the opening points {-lowest:.0f}° below level: liquid runs out by itself"
    return "unknown", f"the opening comes to {lowest:.0f}° from level: any style is possible"
