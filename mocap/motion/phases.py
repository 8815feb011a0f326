"""Drinking figures of a motion: phases, tilt, pitch, closest approach, drinking style.

The package is *at the mouth* in the interval around its closest approach to the head in which its
reference point stays within ``AT_MOUTH_MM`` of that position. The *tilt* is the rotation of the
package in the world since the start of that interval: it moves the liquid. The phases are

=========  =====================================================================
approach   from the first movement (10 % of the largest speed) to the mouth
contact    at the mouth, below 10 % of the largest tilt
tilt       from 10 % to 90 % of the largest tilt
drink      above 90 % of the largest tilt
release    from then until the package leaves the mouth
=========  =====================================================================

The styles suck, pour and pull differ in which lip seals (thesis §4.1). In 'suck' both lips close
around the package, in 'pour' the upper lip does not touch it, in 'pull' the upper lip meets the
liquid. Marks on head and neck do not show the lips. The marker file may give the positions of upper
lip and rim in the first frame; the rigid motions carry them along. The position of the lip at the
opening then gives the style, unless it lies within ``WALL_MM`` of the rim's upper edge: there the
lip may be on either side of the wall. Without those points only 'suck' is recognised: nothing runs
out of an upright package.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.rigid import RigidMotion

Array: TypeAlias = NDArray[np.float64]

AT_MOUTH_MM = 15.0
MOVING_SHARE = 0.1
# Between two sips the package is at least this much farther from the head than at its closest, mm.
LEAVES_MM = 80.0
TILT_SHARE = 0.1
# A tilt at the mouth below this, degrees, does not count: gravity does not empty the package.
NO_TILT_DEG = 3.0
# Level liquid in a cylinder 2.5 times as high as wide and 90 % full reaches the rim at a tilt of
# atan(0.5) = 27°. Nothing runs out while the opening points higher above level than 63°.
UPRIGHT_DEG = 63.0
# The upper lip is clear of the rim if its foremost point is farther off than this, mm.
CLEAR_MM = 3.0
# Walls of necks are 1.5 to 3 mm thick. Points read off a picture, and a lip that moves on the
# skull, have errors of 2 mm. An upper lip nearer than this below the rim's upper edge may be in the
# opening or on the rim.
WALL_MM = 5.0
# Marks across the neck: one above the other when the package lies level.
ACROSS_THE_NECK = ("package_lower", "package_upper")
PHASES = ("approach", "contact", "tilt", "drink", "release")


@dataclass(frozen=True)
class DrinkingFigures:
    """Figures of a drinking motion.

    Attributes
    ----------
    phases_s
        Start and end, s, of each phase that occurs, by name.
    duration_at_mouth_s
        Length of the interval at the mouth, s.
    closest_s, closest_mm
        Time of the closest approach and distance of the reference points then.
    neck_tilt_deg, package_tilt_deg
        Largest rotation of the package at the mouth, seen from the head and in the world.
    head_pitch_deg
        Range of the head's rotation.
    style, style_reason
        "suck", "pour", "pull" or "unknown", and the observation it follows from.
    """

    phases_s: dict[str, tuple[float, float]]
    duration_at_mouth_s: float
    closest_s: float
    closest_mm: float
    neck_tilt_deg: float
    package_tilt_deg: float
    head_pitch_deg: float
    style: str
    style_reason: str

    def as_json(self) -> dict[str, Any]:
        """Return the figures as values for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class LipAtRim:
    """Position of the upper lip's foremost point relative to the opening of the package.

    Attributes
    ----------
    past_mm
        (n,) distance past the rim along the neck.
    outside_mm
        (n,) distance beyond the rim's upper edge; negative in the opening.
    inclination_deg
        Angle of the opening above level in the first frame.
    """

    past_mm: Array
    outside_mm: Array
    inclination_deg: float


def lip_at_rim(
    head: RigidMotion, package: RigidMotion, lip_mm: Array, rim_mm: Array, mark_mm: Array
) -> LipAtRim:
    """Return the position of the upper lip relative to the rim; each moves with its body.

    Parameters
    ----------
    head, package
        Motions of points that are given by their positions in the first frame.
    lip_mm, rim_mm, mark_mm
        (2,), (2, 2), lower end first, and (2,): positions of the upper lip, of the rim's ends and
        of the package's first mark in the first frame, mm from the head's mark.
    """
    lip = head.apply(lip_mm[None])[:, 0]
    rim = package.apply(rim_mm)
    across = rim[:, 1] - rim[:, 0]
    across /= np.hypot(*across.T)[:, None]
    inwards = np.column_stack([across[:, 1], -across[:, 0]])
    # The marks sit on the neck, inwards of the rim.
    inwards *= np.sign(np.sum(inwards[0] * (mark_mm - rim_mm[0])))
    return LipAtRim(
        past_mm=np.sum((lip - rim[:, 0]) * inwards, axis=1),
        outside_mm=np.sum((lip - rim[:, 1]) * across, axis=1),
        inclination_deg=float(np.degrees(np.arctan2(-inwards[0, 1], inwards[0, 0]))),
    )


def figures_of(
    time_s: Array,
    relative_mm: Array,
    relative_rad: Array,
    head_rad: Array,
    *,
    inclination_deg: float | None = None,
    lip: LipAtRim | None = None,
) -> DrinkingFigures:
    """Return the figures of a motion given as arrays.

    Parameters
    ----------
    time_s
        (n,) times, s.
    relative_mm, relative_rad
        (n, 2) mm and (n,) rad: the package seen from the head. For a package of unknown rotation
        the latter is −``head_rad``, as if it did not turn in the world.
    head_rad
        (n,) rotation of the head, rad.
    inclination_deg
        Angle of the opening above level in the first frame, if known.
    lip
        Position of the upper lip at the rim, if known.
    """
    distance = np.hypot(*relative_mm.T)
    closest = int(np.argmin(distance))
    near = np.hypot(*(relative_mm - relative_mm[closest]).T) < AT_MOUTH_MM
    first, last = _run_around(near, closest)
    neck = np.degrees(relative_rad[first : last + 1] - relative_rad[first])
    turned = np.degrees(relative_rad + head_rad)
    change = turned[first : last + 1] - turned[first]
    most = float(change[np.argmax(np.abs(change))])
    phases = _phases(time_s, relative_mm, first, last, change, most)
    lowest = None
    if inclination_deg is not None:
        lowest = inclination_deg - float((turned[first : last + 1] - turned[0]).max())
    drunk = slice(first, last + 1)
    if "drink" in phases:
        start, end = phases["drink"]
        drunk = slice(int(np.searchsorted(time_s, start)), int(np.searchsorted(time_s, end)) + 1)
    style, reason = _style(lowest, lip, drunk)
    return DrinkingFigures(
        phases_s=phases,
        duration_at_mouth_s=float(time_s[last] - time_s[first]),
        closest_s=float(time_s[closest]),
        closest_mm=float(distance[closest]),
        neck_tilt_deg=float(neck[np.argmax(np.abs(neck))]),
        package_tilt_deg=most,
        head_pitch_deg=float(np.degrees(np.ptp(head_rad))),
        style=style,
        style_reason=reason,
    )


def sips_of(
    time_s: Array, relative_mm: Array, relative_rad: Array, head_rad: Array
) -> list[DrinkingFigures]:
    """Return the figures of every sip of a longer recording, in order of time.

    Two sips are separate if the package leaves the mouth by ``LEAVES_MM`` in between. Arguments as
    in :func:`figures_of`.
    """
    distance = np.hypot(*relative_mm.T)
    away = distance > distance.min() + LEAVES_MM
    edges = np.flatnonzero(np.diff(np.concatenate([[True], away, [True]]).astype(int)))
    arrivals, leavings = edges[::2], edges[1::2]
    # The interval of a sip starts where the previous sip ends and ends where the next one starts.
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


def _style(lowest_deg: float | None, lip: LipAtRim | None, drunk: slice) -> tuple[str, str]:
    """Return the style and the observation it follows from.

    Parameters
    ----------
    lowest_deg
        Smallest angle of the opening above level at the mouth, if known.
    lip
        Position of the upper lip at the rim, if known.
    drunk
        The frames of the drink phase.
    """
    upright = lowest_deg is not None and lowest_deg > UPRIGHT_DEG
    if lip is None:
        if upright:
            return "suck", f"the opening stays {lowest_deg:.0f}° above level: nothing runs out"
        return "unknown", "the position of the upper lip at the rim is not known: see [style]"
    past = float(np.median(lip.past_mm[drunk]))
    outside = float(np.median(lip.outside_mm[drunk]))
    if past < -CLEAR_MM:
        clear = f"the upper lip stays {-past:.0f} mm off the rim"
        if lowest_deg is None or upright:
            return "unknown", f"{clear} and nothing runs out of the package"
        return "pour", f"{clear} while the opening comes to {lowest_deg:.0f}° from level"
    if outside > 0 and past > CLEAR_MM:
        return "suck", (
            f"the rim is {past:.0f} mm inside the upper lip, which lies {outside:.0f} mm outside "
            "of its upper edge"
        )
    if outside < -WALL_MM and past > 0 and not upright:
        return "pull", (
            f"the upper lip is {past:.0f} mm inside the opening, {-outside:.0f} mm below the rim's "
            "upper edge: it meets the liquid"
        )
    return "unknown", (
        f"the upper lip lies {past:.0f} mm past the rim and {outside:.0f} mm from its upper edge: "
        "it may be on either side of the wall"
    )
