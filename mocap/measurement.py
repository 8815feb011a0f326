"""Scales and motions of one recording from its tracks and its marker file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mocap.motion.capture import Capture, capture
from mocap.motion.coded import coded_bodies
from mocap.motion.jaw import JAW, JawOpening
from mocap.motion.motion import Motion
from mocap.motion.perspective import Perspective
from mocap.motion.phases import LipAtRim, lip_at_rim
from mocap.motion.projection import PictureFormat, at_frame_times, axis_px, corrected
from mocap.motion.scale import BodyScale, body_scales, positions_mm
from mocap.tracking.markers import DEFAULT_BODIES, MarkerFile
from mocap.tracking.tracks import Tracks

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Measurement:
    """Tracks, scales and motion of one recording.

    Attributes
    ----------
    tracks
        Tracks with their dropouts interpolated.
    scales
        Scale of each body.
    capture
        The motion and the data it is computed from.
    lip
        Position of the upper lip at the rim, None if the marker file has no ``[style]``.
    corrected_px, centre_px
        (n, m, 2) positions of the markers, corrected for lens and depth, and (2,) of the camera's
        axis, px.
    perspective
        What is known of the depths of their marks.
    mirrored
        Whether left and right were exchanged, because the person faces left.
    """

    tracks: Tracks
    scales: dict[str, BodyScale]
    capture: Capture
    lip: LipAtRim | None
    corrected_px: Array
    centre_px: Array
    perspective: Perspective
    mirrored: bool = False

    @property
    def motion(self) -> Motion:
        """The motion of head and package."""
        return self.capture.motion

    @property
    def jaw_opening(self) -> JawOpening | None:
        """How much farther the jaw opens; None if its two marks are not always seen."""
        jaw = self.capture.others.get(JAW)
        if jaw is None or len(jaw.markers) < 2:
            return None
        columns = [self.tracks.names.index(name) for name in jaw.markers[:2]]
        row = int(np.flatnonzero(self.tracks.frame == self.capture.frame[0])[0])
        apart_px = np.subtract(*self.corrected_px[row, columns])
        return JawOpening.of(
            self.capture, float(np.hypot(*apart_px) / self.scales[JAW].px_per_mm[row])
        )


def measure(tracks: Tracks, markers: MarkerFile, picture: PictureFormat) -> Measurement:
    """Return scales and motions from tracks whose dropouts are interpolated.

    Raises
    ------
    ScaleError, MotionError
        If the marks give no scale, or the tracks no motion.
    """
    mirrored = faces_left(tracks, markers)
    picture = replace(picture, mirrored=mirrored)
    timed = tracks
    if markers.lens.readout_s:
        at_once = at_frame_times(
            tracks.position_px, tracks.time_s, markers.lens.readout_s, picture.height
        )
        timed = replace(tracks, position_px=at_once)
    flat = corrected(timed.position_px, markers, picture)
    centre = corrected(axis_px(markers.lens, picture), markers, picture)
    coded = coded_bodies(tracks, markers, picture)
    of_stickers = {body: poses.scale for body, poses in coded.items()}
    perspective = Perspective.of(tracks, markers, flat, centre, picture)
    flat = perspective.level(flat, tracks, markers, centre)
    scales = body_scales(tracks, markers, flat, of_stickers, larger=perspective.larger)
    perspective = perspective.checked(markers, scales)
    world = positions_mm(flat, tracks.names, markers, scales, centre)
    shown = _mirrored(timed, picture) if mirrored else timed
    captured = capture(shown, markers, world, scales, coded, perspective)
    if mirrored and captured.motion.picture is not None:
        scale = replace(captured.motion.picture, mirrored=True)
        captured = replace(captured, motion=replace(captured.motion, picture=scale))
    lip = _lip(captured, tracks, markers, scales, picture, centre)
    return Measurement(tracks, scales, captured, lip, flat, centre, perspective, mirrored)


def faces_left(tracks: Tracks, markers: MarkerFile) -> bool:
    """Whether the person faces left: the nose, or else the package, is mostly left of the ear."""
    ear, nose = DEFAULT_BODIES["head"]
    front = (nose, *DEFAULT_BODIES["package"])
    ahead = next((name for name in front if name in tracks.names), None)
    if markers.bodies[markers.reference][0] != ear or ahead is None:
        return False
    from_ear = (tracks.of(ahead)[0] - tracks.of(ear)[0])[:, 0]
    known = np.isfinite(from_ear)
    return bool(known.any() and np.median(from_ear[known]) < 0)


def _mirrored(tracks: Tracks, picture: PictureFormat) -> Tracks:
    """Return the tracks in the picture with left and right exchanged."""
    across = np.array([picture.width - 1.0, 0.0])
    return replace(tracks, position_px=across + tracks.position_px * picture.sides)


def _lip(
    captured: Capture,
    tracks: Tracks,
    markers: MarkerFile,
    scales: Mapping[str, BodyScale],
    picture: PictureFormat,
    centre: Array,
) -> LipAtRim | None:
    """Return the position of the upper lip at the rim; both are at the package's depth."""
    if markers.style is None or captured.frame[0] != tracks.frame[0]:
        return None
    points = markers.style
    clicked = [points.upper_lip, points.rim_lower, points.rim_upper]
    scale = scales[markers.moving].px_per_mm[0]
    away = (corrected(clicked, markers, picture) - centre) / scale * [1.0, -1.0]
    from_mark = away - captured.origin_mm
    motion = captured.motion
    return lip_at_rim(
        motion.head, motion.package, from_mark[0], from_mark[1:], motion.package_mm[0]
    )
