"""The motion of head and package from their tracks: smoothed poses with standard errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.rigid import rotated
from mocap.motion.coded import CodedBody, OutOfPlanePose, plane_poses, pose_known
from mocap.motion.motion import MarkedBody, Motion
from mocap.motion.perspective import Perspective
from mocap.motion.picture import PictureScale
from mocap.motion.poses import Poses, body_poses, carried_by_two, usable_rows
from mocap.motion.scale import BodyScale
from mocap.motion.smooth import WORSE, Smoothed, removes_motion, smoothed
from mocap.tracking.markers import MarkerFile
from mocap.tracking.noise import repeats
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

COORDINATES = ("x_mm", "y_mm", "theta_rad")


@dataclass(frozen=True)
class Capture:
    """The motion of head and package with the data it is computed from.

    Attributes
    ----------
    motion
        Motion of the marker file's reference body (head) and moving body (package).
    frame
        (n,) numbers of the motion's frames in the recording.
    origin_mm
        (2,) position of the head's first marker in the first frame, from the camera's axis.
    poses
        Measured poses by body: reference, then moving body.
    smoothing
        Smoothed coordinates by ``<body>_<coordinate>``.
    others
        Poses of the other bodies, such as the jaw, whose skin slides.
    out_of_plane
        Depth and tilt of the bodies that carry coded stickers, by body.
    """

    motion: Motion
    frame: NDArray[np.int_]
    origin_mm: Array
    poses: Mapping[str, Poses]
    smoothing: Mapping[str, Smoothed]
    others: Mapping[str, Poses]
    out_of_plane: Mapping[str, OutOfPlanePose]


def capture(
    tracks: Tracks,
    markers: MarkerFile,
    world_mm: Array,
    scales: Mapping[str, BodyScale],
    coded: Mapping[str, CodedBody],
    perspective: Perspective,
) -> Capture:
    """Return the smoothed motion of both bodies and of the package seen from the head.

    Parameters
    ----------
    tracks
        Tracks with their dropouts interpolated.
    markers
        The marker file, for the bodies.
    world_mm
        (n, m, 2) marker positions, mm from the camera's axis, y up.
    scales
        Scale of each body, for its standard error.
    coded
        Poses in space of the bodies that carry coded stickers.
    perspective
        What is known of the depths of the other bodies' marks.
    """
    known = {body: pose_known(poses.spatial, tracks.time_s) for body, poses in coded.items()}
    for body in (markers.reference, markers.moving):
        two = carried_by_two(tracks, markers.bodies[body])
        if body not in coded and two is not None:
            known[body] = two
    rows = usable_rows(tracks, markers, known)
    time = tracks.time_s[rows]
    poses: dict[str, Poses] = {}
    smoothing: dict[str, Smoothed] = {}
    smooth: list[_SmoothPose] = []
    out_of_plane: dict[str, OutOfPlanePose] = {}
    for body in (markers.reference, markers.moving):
        names = markers.bodies[body]
        if body in coded:
            pose, out_of_plane[body] = plane_poses(body, names, coded[body], time, rows)
        else:
            pose = _poses_of(body, names, tracks, world_mm, scales[body], rows)
            pair = _first_two(pose, tracks, world_mm)
            shared = perspective.shared_covariance(
                body, pair, scales[body], rows, is_moving=body == markers.moving
            )
            pose = replace(pose, shared_covariance=shared)
        columns = [tracks.names.index(name) for name in pose.markers]
        same = repeats(tracks.position_px[rows][:, columns])
        poses[body] = pose
        smoothing |= _smoothed_coordinates(time, pose, same)
        smooth.append(_SmoothPose.of(pose, smoothing))
    head, package = smooth
    origin = head.position_mm[0]
    pixels = tracks.position_px[rows, tracks.names.index(package.marked.markers[0])]
    shown = np.isfinite(pixels[:, 0])
    motion = Motion(
        time_s=time,
        relative_mm=rotated(package.position_mm - head.position_mm, -head.angle_rad),
        relative_rad=package.angle_rad - head.angle_rad,
        sigma=_relative_sigma(head, package, scales),
        head_mm=head.position_mm - origin,
        head_rad=head.angle_rad,
        package_mm=package.position_mm - origin,
        package_rad=package.angle_rad,
        head_body=head.marked,
        package_body=package.marked,
        picture=PictureScale.fitted(pixels[shown], (package.position_mm - origin)[shown]),
        rendered=markers.rendered,
    )
    return Capture(
        motion=motion,
        frame=tracks.frame[rows],
        origin_mm=origin,
        poses=poses,
        smoothing=smoothing,
        others=_other_poses(tracks, markers, world_mm, scales, rows),
        out_of_plane=out_of_plane,
    )


@dataclass(frozen=True)
class _SmoothPose:
    """Smoothed pose of a body: position (n, 2), angle since the first frame (n,), covariance."""

    marked: MarkedBody
    position_mm: Array
    angle_rad: Array
    covariance: Array

    @classmethod
    def of(cls, pose: Poses, smoothing: Mapping[str, Smoothed]) -> _SmoothPose:
        """Return a pose with its coordinates, and their standard errors, replaced by smooth ones.

        The correlations of the coordinates stay those of the measured pose.
        """
        values = np.column_stack([pose.position_mm, pose.angle_rad])
        ratio = np.ones_like(values)
        for k, name in enumerate(COORDINATES):
            smooth = smoothing.get(f"{pose.body}_{name}")
            if smooth is not None:
                values[:, k] = smooth.values
                # Angles count from the first frame: its error is in all others, zero in itself.
                angle = name == "theta_rad"
                sigma = smooth.sigma_since_first if angle else smooth.sigma
                # Errors that frames share are lessened by smoothing only over more frames than
                # those; a difference of two frames has at most both their errors.
                most = np.sqrt(2.0) if angle else 1.0
                own = sigma / np.sqrt(pose.covariance[:, k, k])
                together = np.minimum(own * np.sqrt(pose.persistence), np.maximum(own, most))
                ratio[:, k] = together
        start = float(values[0, 2])
        axis = pose.axis_rad + start if pose.turns else None
        return cls(
            MarkedBody(pose.body, pose.markers, axis),
            values[:, :2],
            values[:, 2] - start,
            pose.covariance * ratio[:, :, None] * ratio[:, None, :] + pose.shared_covariance,
        )


def _smoothed_coordinates(time: Array, pose: Poses, same: Array) -> dict[str, Smoothed]:
    """Return the smoothed coordinates of a body; the angle only where it is known."""
    raw = np.column_stack([pose.position_mm, pose.angle_rad])
    spread = np.sqrt(np.einsum("nii->ni", pose.covariance))
    found = {}
    for k, name in enumerate(COORDINATES):
        if name == "theta_rad" and not pose.turns:
            continue
        smooth = smoothed(time, raw[:, k], spread[:, k], repeats=same, noise_known=pose.noise_known)
        if pose.stretch is not None and not pose.noise_known:
            inner = smoothed(
                time, pose.stretch, spread[:, 2], repeats=same, cutoff_hz=smooth.cutoff_hz
            )
            if removes_motion(smooth, inner):
                error = spread[:, k] * max(inner.noise_factor, 1.0)
                smooth = smoothed(time, raw[:, k], error, repeats=same, noise_known=True)
                smooth = _not_better_between(smooth, error)
        found[f"{pose.body}_{name}"] = smooth
    return found


def _not_better_between(smooth: Smoothed, error: Array) -> Smoothed:
    """Return the signal with the errors (n,) of its interpolated samples, which smoothing keeps.

    Nothing tells where a body that trembles was while its marks were hidden, and the interpolated
    samples of a dropout err together.
    """
    least = np.where(error > WORSE * np.median(error), error, 0.0)
    return replace(
        smooth,
        sigma=np.maximum(smooth.sigma, least),
        sigma_since_first=np.maximum(smooth.sigma_since_first, least),
    )


def _other_poses(
    tracks: Tracks,
    markers: MarkerFile,
    world_mm: Array,
    scales: Mapping[str, BodyScale],
    rows: slice,
) -> dict[str, Poses]:
    """Return the poses of all bodies but reference and moving that have all their markers."""
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


def _first_two(pose: Poses, tracks: Tracks, world_mm: Array) -> Array:
    """Return the places (n, 2, 2) of a body's first two marks, mm; twice the first if alone."""
    first = pose.position_mm
    if not pose.turns:
        return np.stack([first, first], axis=1)
    columns = [tracks.names.index(name) for name in pose.markers[:2]]
    apart = np.hypot(*np.diff(world_mm[:, columns], axis=1)[:, 0].T)
    direction = pose.axis_rad + pose.angle_rad
    line = np.nanmedian(apart) * np.column_stack([np.cos(direction), np.sin(direction)])
    return np.stack([first, first + line], axis=1)


def _relative_sigma(
    head: _SmoothPose, package: _SmoothPose, scales: Mapping[str, BodyScale]
) -> Array:
    """Return the standard errors (n, 3), mm and rad, of R(−θ)(p − e) and of the relative angle."""
    apart, head_angle = package.position_mm - head.position_mm, head.angle_rad
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
    covariance = np.einsum("nij,njk,nlk->nil", to_package, package.covariance, to_package)
    covariance += np.einsum("nij,njk,nlk->nil", to_head, head.covariance, to_head)
    sigma = np.asarray(np.sqrt(np.einsum("nii->ni", covariance)))
    of_scales = _scale_error(
        package.position_mm,
        head.position_mm,
        scales[package.marked.name],
        scales[head.marked.name],
    )
    sigma[:, :2] = np.hypot(sigma[:, :2], of_scales)
    return sigma


def _scale_error(package_at: Array, head_at: Array, package: BodyScale, head: BodyScale) -> Array:
    """Return the standard error (n, 2), mm, of p − e that is due to the scales."""
    if package.source == head.source:
        return np.abs(package_at - head_at) * package.relative_sigma
    return np.hypot(package_at * package.relative_sigma, head_at * head.relative_sigma)
