"""The motion of head and package from their tracked markers: poses, smoothed, with errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.rigid import rotated
from mocap.motion.motion import MarkedBody, Motion
from mocap.motion.picture import PictureScale
from mocap.motion.poses import Poses, body_poses, usable_rows
from mocap.motion.scale import BodyScale
from mocap.motion.smooth import Smoothed, smoothed
from mocap.tracking.markers import MarkerFile
from mocap.tracking.noise import repeats
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Capture:
    """The motion of head and package, and what it rests on.

    Attributes
    ----------
    motion
        Head, package, and the package seen from the head; the marker file's reference and moving
        body. Rotations count from the first frame.
    frame
        (n,) numbers of the motion's frames in the recording.
    origin_mm
        (2,) place of the head's first marker in the first frame, from the camera's axis.
    poses
        Poses of both bodies as measured, by name: reference, then moving body.
    smoothing
        How each coordinate of each body was smoothed, by ``<body>_<coordinate>``.
    others
        Poses of bodies that take no part in the motion, such as the jaw, whose skin slides.
    """

    motion: Motion
    frame: NDArray[np.int_]
    origin_mm: Array
    poses: Mapping[str, Poses]
    smoothing: Mapping[str, Smoothed]
    others: Mapping[str, Poses]


def capture(
    tracks: Tracks,
    markers: MarkerFile,
    world_mm: Array,
    scales: Mapping[str, BodyScale],
    *,
    cutoff_hz: float | None = None,
) -> Capture:
    """Return the smoothed motions of both bodies and of one seen from the other.

    Parameters
    ----------
    tracks
        Tracks with gaps bridged.
    markers
        The bodies and which is seen from which.
    world_mm
        (n, m, 2) marker positions, mm from the camera's axis, y up.
    scales
        Scale of each body, for the errors.
    cutoff_hz
        Cutoff of the smoothing; chosen from the data if None.
    """
    rows = usable_rows(tracks, markers)
    poses = {
        body: _poses_of(body, markers.bodies[body], tracks, world_mm, scales[body], rows)
        for body in (markers.reference, markers.moving)
    }
    time = tracks.time_s[rows]
    smoothing: dict[str, Smoothed] = {}
    smooth: dict[str, tuple[Array, Array, Array]] = {}
    for body, pose in poses.items():
        columns = [tracks.names.index(name) for name in pose.markers]
        same = repeats(tracks.position_px[rows][:, columns])
        values, covariance = _smoothed_pose(time, pose, same, smoothing, cutoff_hz)
        smooth[body] = (values[:, :2], values[:, 2], covariance)
    head_at, head_angle, head_covariance = smooth[markers.reference]
    package_at, package_angle, package_covariance = smooth[markers.moving]
    axis = {
        body: pose.axis_rad + float(smooth[body][1][0]) if pose.turns else None
        for body, pose in poses.items()
    }
    head_angle, package_angle = head_angle - head_angle[0], package_angle - package_angle[0]
    origin = head_at[0]
    sigma = _relative_sigma(package_at - head_at, head_angle, head_covariance, package_covariance)
    sigma[:, :2] = np.hypot(
        sigma[:, :2],
        _scale_error(package_at, head_at, scales[markers.moving], scales[markers.reference]),
    )
    motion = Motion(
        time_s=time,
        relative_mm=rotated(package_at - head_at, -head_angle),
        relative_rad=package_angle - head_angle,
        sigma=sigma,
        head_mm=head_at - origin,
        head_rad=head_angle,
        package_mm=package_at - origin,
        package_rad=package_angle,
        head_body=_marked(poses[markers.reference], axis),
        package_body=_marked(poses[markers.moving], axis),
        picture=_picture(tracks, rows, markers.bodies[markers.moving][0], package_at - origin),
        rendered=markers.rendered,
    )
    return Capture(
        motion=motion,
        frame=tracks.frame[rows],
        origin_mm=origin,
        poses=poses,
        smoothing=smoothing,
        others=_other_poses(tracks, markers, world_mm, scales, rows),
    )


def _marked(pose: Poses, axis: Mapping[str, float | None]) -> MarkedBody:
    return MarkedBody(pose.body, pose.markers, axis[pose.body])


def _picture(tracks: Tracks, rows: slice, marker: str, places_mm: Array) -> PictureScale | None:
    """Return the picture's scale at the depth of a marker whose places (n, 2) are known."""
    pixels = tracks.position_px[rows, tracks.names.index(marker)]
    return PictureScale.fitted(pixels, places_mm)


def _other_poses(
    tracks: Tracks,
    markers: MarkerFile,
    world_mm: Array,
    scales: Mapping[str, BodyScale],
    rows: slice,
) -> dict[str, Poses]:
    """Return the poses of the bodies beside the two, where all their markers are known."""
    others = {}
    for body, names in markers.bodies.items():
        columns = [tracks.names.index(name) for name in names]
        complete = bool(np.isfinite(world_mm[rows][:, columns]).all())
        if body not in (markers.reference, markers.moving) and complete:
            others[body] = _poses_of(body, names, tracks, world_mm, scales[body], rows)
    return others


def _poses_of(
    body: str,
    names: tuple[str, ...],
    tracks: Tracks,
    world_mm: Array,
    scale: BodyScale,
    rows: slice,
) -> Poses:
    columns = [tracks.names.index(name) for name in names]
    sigma = tracks.sigma_px[rows][:, columns] / scale.px_per_mm[rows, None]
    return body_poses(body, names, world_mm[rows][:, columns], sigma)


def _smoothed_pose(
    time: Array,
    pose: Poses,
    same: Array,
    smoothing: dict[str, Smoothed],
    cutoff_hz: float | None,
) -> tuple[Array, Array]:
    """Return x, y and angle (n, 3) smoothed, and their covariance (n, 3, 3)."""
    raw = np.column_stack([pose.position_mm, pose.angle_rad])
    values = raw.copy()
    ratio = np.ones_like(raw)
    for k, name in enumerate(("x_mm", "y_mm", "theta_rad")):
        if name == "theta_rad" and not pose.turns:
            continue
        stated = np.sqrt(pose.covariance[:, k, k])
        result = smoothed(time, raw[:, k], stated, repeats=same, cutoff_hz=cutoff_hz)
        smoothing[f"{pose.body}_{name}"] = result
        values[:, k] = result.values
        # Angles count from the first frame, so its error is in all of them and none in itself.
        angle = name == "theta_rad"
        ratio[:, k] = (result.sigma_since_first if angle else result.sigma) / stated
    return values, pose.covariance * ratio[:, :, None] * ratio[:, None, :]


def _relative_sigma(
    apart: Array, head_angle: Array, head_covariance: Array, package_covariance: Array
) -> Array:
    """Return the standard errors (n, 3) of R(−θ)(p − e) and of the relative angle."""
    n = head_angle.size
    c, s = np.cos(head_angle), np.sin(head_angle)
    back = np.zeros((n, 2, 2))
    back[:, 0, 0], back[:, 0, 1], back[:, 1, 0], back[:, 1, 1] = c, s, -s, c
    to_package = np.zeros((n, 3, 3))
    to_package[:, :2, :2] = back
    to_package[:, 2, 2] = 1.0
    # ∂/∂θ of R(−θ) d is R(−θ) (d_y, −d_x).
    quarter = np.stack([apart[:, 1], -apart[:, 0]], axis=1)
    to_head = -to_package
    to_head[:, :2, 2] = np.einsum("nij,nj->ni", back, quarter)
    covariance = np.einsum("nij,njk,nlk->nil", to_package, package_covariance, to_package)
    covariance += np.einsum("nij,njk,nlk->nil", to_head, head_covariance, to_head)
    return np.asarray(np.sqrt(np.einsum("nii->ni", covariance)))


def _scale_error(package_at: Array, head_at: Array, package: BodyScale, head: BodyScale) -> Array:
    """Return the error (n, 2), mm, that the scales' own errors bring into p − e."""
    if package.source == head.source:
        return np.abs(package_at - head_at) * package.relative_sigma
    return np.hypot(package_at * package.relative_sigma, head_at * head.relative_sigma)
