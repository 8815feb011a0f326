"""What a recording says of the neck: its motion in the head section's frame, its marks and rim."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.anatomy.head import HeadSection
from geometry2d.neck import NeckSection
from geometry2d.rigid import RigidMotion, rotated
from mocap.motion.motion import MarkedBody
from mocap.tracking.marker_file import read_markers
from mocap.tracking.markers import DEFAULT_BODIES, MarkerFile
from scenarios.settings.scenario import MotionFile, Scenario, ScenarioError

Array = NDArray[np.float64]

ANGLE_DIGITS, PLACE_DIGITS = 11, 9
"""Decimals of rad and mm that are kept of a motion: a millionth of its uncertainty, and far above
rounding."""


@dataclass(frozen=True)
class RecordedMotion:
    """Motion of the neck as it was recorded.

    Attributes
    ----------
    neck
        In the head section's own frame.
    head_angle_rad
        Turn of the head section's frame into the head frame of the recording, whose axes are the
        picture's. The solver works in the former; results are given in the latter.
    """

    neck: RigidMotion
    head_angle_rad: float


def recorded_motion(scenario: Scenario, neck: NeckSection, head: HeadSection) -> RecordedMotion:
    """Return the motion of a neck in a head section from the scenario's motion.

    The result must not depend on the camera's orientation, not even by rounding, which slip and
    instability would amplify: the motion is rounded to `ANGLE_DIGITS` and `PLACE_DIGITS`.

    Raises
    ------
    ScenarioError, MotionError
        If there is no motion file, or it is broken, or lacks the bodies' directions.
    """
    motion = scenario.known_motion()
    head_axis, package_axis = (_axis(b, scenario) for b in (motion.head_body, motion.package_body))
    marks = np.asarray(neck.upper_mark) - np.asarray(neck.lower_mark)
    nose = head.landmarks["nose"] - head.landmarks["ear"]
    head_angle = head_axis - _angle(nose)
    angle = motion.relative_rad + package_axis - _angle(marks)
    position = rotated(motion.relative_mm, -head_angle)
    placed = RigidMotion.of_reference_point(
        motion.time_s,
        np.round(angle - head_angle, ANGLE_DIGITS),
        np.round(position, PLACE_DIGITS),
        np.asarray(neck.lower_mark),
    )
    return RecordedMotion(placed, head_angle)


def _axis(body: MarkedBody, scenario: Scenario) -> float:
    """Return the direction of a body's axis in the first frame, rad."""
    if body.axis_rad is None:
        motion = scenario.motion
        named = motion.file if isinstance(motion, MotionFile) else f"{motion!r}"
        raise ScenarioError(
            f"{named} does not say how {body.name} was turned in the first frame: make it with "
            f"drinksim convert, with two markers on {body.name}"
        )
    return body.axis_rad


def _angle(vector: Array) -> float:
    return float(np.arctan2(vector[1], vector[0]))


@dataclass(frozen=True)
class RecordedNeck:
    """The filmed neck as a marker file has it; what it does not say is None.

    Attributes
    ----------
    mark_distance_mm
        Distance of the two marks, mm.
    rim_mm
        (2, 2) lower and upper end of the rim in the neck frame, mm, as read off the picture.
    """

    mark_distance_mm: float | None = None
    rim_mm: Array | None = None

    @classmethod
    def of(cls, scenario: Scenario) -> RecordedNeck:
        """Return what a scenario's marker file says; nothing without such a file."""
        recording = scenario.recording
        if recording is None or recording.markers is None or not Path(recording.markers).is_file():
            return cls()
        markers = read_markers(recording.markers)
        distance = markers.scale_mm.get(markers.moving)
        return cls(distance, None if distance is None else _rim_mm(markers, distance))


def _rim_mm(markers: MarkerFile, mark_distance_mm: float) -> Array | None:
    """Return the ends (2, 2) of the rim in the neck frame, None if they were not marked."""
    marks = [markers.positions_px.get(name) for name in DEFAULT_BODIES["package"]]
    if markers.style is None or markers.plane is not None or None in marks:
        return None
    # Pictures count y downwards.
    lower, upper, *rim = (
        np.array(at, float) * (1.0, -1.0)
        for at in (*marks, markers.style.rim_lower, markers.style.rim_upper)
    )
    length_px = float(np.linalg.norm(upper - lower))
    across = (upper - lower) / length_px
    along = np.array([across[1], -across[0]])
    away = (np.array(rim) - lower) * (mark_distance_mm / length_px)
    return np.column_stack([away @ along, away @ across])
