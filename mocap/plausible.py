"""Whether markers can be where they are said to be, on a person who drinks from a package.

Only bodies with the standard markers are looked at: ear and nose on the head, the lower and the
upper mark on the package. What contradicts a recording is an error: with two markers exchanged a
replay would turn the neck round, and compute a pressure all the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from geometry2d.rigid import rotated
from mocap.measurement import Measurement
from mocap.motion.projection import PictureFormat
from mocap.tracking.marker_file import PLAUSIBLE_MM
from mocap.tracking.markers import DEFAULT_BODIES, MarkerFile, MarkerFileError

Array = NDArray[np.float64]

HEAD, PACKAGE = DEFAULT_BODIES["head"], DEFAULT_BODIES["package"]

MOUTH = (0.9, -0.45)
"""The mouth from the ear, along the line to the nose and across it, as shares of its length."""

LEAST_IN_FRONT = 0.25
"""A package is never less far in front of the ear, as a share of the distance to the nose."""

MOST_DEPTH_RATIO = 1.35
"""Head and package are in the hand and face of one person: neither is so many times as far from
the camera as the other."""

MOST_DEPTH_RATIO_OF_CLICKS = 1.6
"""The same for positions that were read off by eye."""

LEAST_FOCAL_SHARE = 0.3
"""A focal length below this share of the picture's width is a view of more than 118 degrees."""

FARTHEST_MM = 100.0
"""A package whose mark stays so far from the mouth is not drunk from."""


def refuse_impossible_lens(markers: MarkerFile, picture: PictureFormat) -> None:
    """Refuse a camera that no recording has; :class:`MarkerFileError` if a length is not in px."""
    fx = markers.lens.fx
    if fx is not None and fx < LEAST_FOCAL_SHARE * picture.width:
        angle = 2 * math.degrees(math.atan(0.5 * picture.width / fx))
        raise MarkerFileError(
            f"{markers.path}: [lens] fx = {fx:g} would be a view of {angle:.0f}° in a picture of "
            f"{picture.width} px: give the focal length in px, not in mm"
        )


def doubts(markers: MarkerFile) -> Iterator[str]:
    """Yield what looks wrong in the first used frame, as the marker file describes it."""
    clicked = [markers.positions_px.get(name) for name in (*HEAD, *PACKAGE)]
    if not _standard(markers) or any(at is None for at in clicked):
        return
    ends = [at for at in clicked if at is not None]
    if markers.plane is None:
        spans = math.dist(*ends[:2]), math.dist(*ends[2:])
        doubt = _depth_fault(markers, *spans, MOST_DEPTH_RATIO_OF_CLICKS)
        if doubt:
            yield f"{markers.path}: {doubt}"
    # Pictures count y downwards; a person who faces left is mirrored.
    side = 1 if ends[1][0] >= ends[0][0] else -1
    ear, nose, lower, upper = (np.array(at) * (side, -1) for at in ends)
    axis = (nose - ear) / np.linalg.norm(nose - ear)
    length = float(np.linalg.norm(nose - ear))
    if (lower - ear) @ axis < -LEAST_IN_FRONT * length:
        yield (
            f"{markers.path}: in the first frame the package is behind the ear: exchange the "
            "positions of ear and nose if they were mixed up"
        )
        return
    into = rotated(upper - lower, -0.5 * np.pi)
    mouth = ear + length * (MOUTH[0] * axis + MOUTH[1] * np.array([-axis[1], axis[0]]))
    if into @ (lower - mouth) < 0:
        yield (
            f"{markers.path}: in the first frame the neck looks away from the mouth: exchange the "
            "positions of package_lower and package_upper if they were mixed up"
        )


def refuse_implausible(measured: Measurement, markers: MarkerFile) -> None:
    """Refuse a motion that no person who drinks can have.

    Raises
    ------
    MarkerFileError
        If the scales put head or package at an impossible distance, markers are exchanged, or the
        picture is upside down.
    """
    if not _standard(markers):
        return
    if markers.plane is None:
        head_px, package_px = (_distance_px(measured, pair) for pair in (HEAD, PACKAGE))
        fault = _depth_fault(markers, head_px, package_px, MOST_DEPTH_RATIO)
        if fault:
            raise MarkerFileError(f"{markers.path}: {fault}")
    from_ear = _from_ear(measured)
    nearest = int(np.argmin(np.hypot(*from_ear.T)))
    if from_ear[:, 0].max() < LEAST_IN_FRONT:
        raise MarkerFileError(
            f"{markers.path}: the package stays behind the ear, seen towards the nose: ear and "
            "nose are mixed up; exchange their positions"
        )
    if np.median(from_ear[:, 1]) > 0 and from_ear[nearest, 1] > 0:
        raise MarkerFileError(
            f"{markers.path}: the package is above the line from ear to nose: the picture is "
            "upside down, or ear and nose are mixed up; turn the film, or exchange their positions"
        )
    motion = measured.motion
    assert motion.head_body.axis_rad is not None and motion.package_body.axis_rad is not None
    into = motion.relative_rad + motion.package_body.axis_rad - motion.head_body.axis_rad
    away = from_ear - np.array(MOUTH)
    # The neck's axis leads into the package, a quarter turn clockwise from the marks' line.
    along = np.sin(into) * away[:, 0] - np.cos(into) * away[:, 1]
    if along[nearest] < 0 and np.median(along) < 0:
        raise MarkerFileError(
            f"{markers.path}: the neck looks away from the mouth: package_lower and package_upper "
            "are mixed up; exchange their positions"
        )


def distance_warnings(measured: Measurement, markers: MarkerFile) -> list[str]:
    """Return a warning if the package never comes near the mouth."""
    if not _standard(markers):
        return []
    length = _distance_px(measured, HEAD) / float(
        np.median(measured.scales[markers.reference].px_per_mm)
    )
    away = length * np.hypot(*(_from_ear(measured) - MOUTH).T)
    nearest = int(np.argmin(away))
    if away[nearest] < FARTHEST_MM:
        return []
    return [
        f"the package's lower mark stays {away[nearest]:.0f} mm from the mouth (nearest at "
        f"{measured.motion.time_s[nearest]:.2f} s), so nothing is drunk: look at the scale, and "
        "at --start and --end"
    ]


def _standard(markers: MarkerFile) -> bool:
    """Whether both bodies are seen by the standard markers."""
    pairs = (markers.bodies[body][:2] for body in (markers.reference, markers.moving))
    return tuple(pairs) == (HEAD, PACKAGE)


def _distance_px(measured: Measurement, pair: tuple[str, ...]) -> float:
    """Return the median distance of two markers, px."""
    first, second = (measured.tracks.names.index(name) for name in pair)
    flat = measured.corrected_px
    return float(np.nanmedian(np.hypot(*(flat[:, first] - flat[:, second]).T)))


def _from_ear(measured: Measurement) -> Array:
    """Return the package's lower mark (n, 2) from the ear: towards the nose and across that.

    Lengths are shares of the distance from ear to nose.
    """
    motion = measured.motion
    scale = float(np.median(measured.scales[motion.head_body.name].px_per_mm))
    assert motion.head_body.axis_rad is not None  # it has two markers
    turned: Array = rotated(motion.relative_mm, -motion.head_body.axis_rad)
    return turned / (_distance_px(measured, HEAD) / scale)


def _depth_fault(markers: MarkerFile, head_px: float, package_px: float, most: float) -> str:
    """Return how lengths contradict the picture, empty if the bodies can be so deep in it.

    Neither body may be ``most`` times as far from the camera as the other.
    """
    head_mm, package_mm = (markers.scale_mm.get(b) for b in (markers.reference, markers.moving))
    if package_mm is None:
        return ""
    if head_mm is None:
        low, high = PLAUSIBLE_MM[HEAD]
        implied = head_px * package_mm / package_px
        if low <= implied <= high:
            return ""
        return (
            f"by [scale] package = {package_mm:g} ear and nose are {implied:.0f} mm apart, and "
            f"people's {low:g} to {high:g} mm: measure the distance of the package's marks again"
        )
    ratio = (head_px / head_mm) / (package_px / package_mm)
    if 1 / most <= ratio <= most:
        return ""
    far, near = ("package", "head") if ratio > 1 else ("head", "package")
    return (
        f"by [scale] package = {package_mm:g} and head = {head_mm:g} the {far} is "
        f"{max(ratio, 1 / ratio):.1f} times as far away from the camera as the {near}: measure "
        "both distances again, in mm, and look at the markers' positions"
    )
