"""Rigid motions of head and package from marker positions, with residual and uncertainty.

The pose of a body in a frame is the angle θ and the position that bring its shape X_i nearest to
the measured x_i in the least-squares sense, weights w_i = 1/σ_i². With both taken from their
weighted means and as complex numbers, θ = arg Σ w_i x_i X̄_i (a rotation, never a reflection),
σ_θ² = 1/Σ w_i|X_i|², and σ² = 1/Σ w_i for the mean. The shape is the average over all frames
(generalised Procrustes, Gower 1975), so that no single frame's noise is in all angles.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidMotion, rotated
from mocap.motion.scale import BodyScale
from mocap.motion.smooth import Smoothed, smoothed
from mocap.tracking.markers import MarkerFile
from mocap.tracking.noise import repeats
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

COLUMNS = (
    "time_s",
    "head_x_mm",
    "head_y_mm",
    "head_theta_deg",
    "package_x_mm",
    "package_y_mm",
    "package_theta_deg",
    "rel_x_mm",
    "rel_y_mm",
    "rel_theta_deg",
    "sigma_x_mm",
    "sigma_y_mm",
    "sigma_theta_deg",
)
# A body whose markers miss their rigid places by this many stated errors is not rigid.
RIGID_LIMIT = 5.0
# ... and by more than this (mm), since stated errors may be very small.
RIGID_LEAST_MM = 0.3
# Standard errors over the usual one from which on a marker was bridged rather than seen.
BRIDGED = 4.0


class MotionError(DrinksimError):
    """Tracks from which no motion can be had."""


@dataclass(frozen=True)
class Poses:
    """Pose of one body in every frame, as measured.

    ``position_mm`` (n, 2) is that of the first marker, ``angle_rad`` (n,) the rotation since the
    first frame; ``covariance`` (n, 3, 3) belongs to (x, y, angle). ``residual_mm`` (n,) is the RMS
    distance of the markers from their rigid places, nan where one of them is bridged and not seen:
    its standard error is then more than ``BRIDGED`` usual ones. ``turns`` is False for a single
    marker. ``axis_rad`` is the direction from the first marker to the last where ``angle_rad`` is
    zero, counter-clockwise from the world's x, from all frames together (0 for a single marker).
    """

    body: str
    markers: tuple[str, ...]
    position_mm: Array
    angle_rad: Array
    covariance: Array
    residual_mm: Array
    expected_residual_mm: float
    turns: bool
    axis_rad: float

    @property
    def residual_rms_mm(self) -> float:
        """RMS distance of the markers from their rigid places where they are seen, mm."""
        return float(np.sqrt(np.nanmean(self.residual_mm**2)))

    @property
    def rigid(self) -> bool:
        """Whether the markers keep their distances as well as their errors allow."""
        limit = max(RIGID_LIMIT * self.expected_residual_mm, RIGID_LEAST_MM)
        return self.residual_rms_mm <= limit


@dataclass(frozen=True)
class Capture:
    """The motions of both bodies in the world plane and what is known about them.

    ``head`` and ``package`` stand for the reference and the moving body of the marker file. Both
    motions are the identity in the first frame. ``origin_mm`` (2,) is where the head's first marker
    then is, from the camera's axis; ``package_start_mm`` (2,) is the moving body's, from there.
    ``relative_mm`` (n, 2), ``relative_rad`` (n,) and ``sigma`` (n, 3: mm, mm, rad) are the motion
    of the package seen from the head. ``axis_rad`` holds, by body, the direction from its first
    marker to its last in the first frame. ``others`` are the poses of bodies that take no part in
    the motion, such as the jaw, whose skin slides.
    """

    frame: NDArray[np.int_]
    time_s: Array
    head: RigidMotion
    package: RigidMotion
    origin_mm: Array
    package_start_mm: Array
    relative_mm: Array
    relative_rad: Array
    sigma: Array
    poses: Mapping[str, Poses]
    smoothing: Mapping[str, Smoothed]
    axis_rad: Mapping[str, float]
    others: Mapping[str, Poses]

    @property
    def head_mm(self) -> Array:
        """Position (n, 2) of the head's first marker since the first frame, mm."""
        return self.head.shift_mm

    @property
    def package_mm(self) -> Array:
        """Position (n, 2) of the package's first marker from the origin, mm."""
        return self.package.apply(self.package_start_mm)[:, 0]

    def write(self, path: Path) -> None:
        """Write ``motion.csv``."""
        table = np.column_stack(
            [
                self.time_s,
                self.head_mm,
                np.degrees(self.head.angle_rad),
                self.package_mm,
                np.degrees(self.package.angle_rad),
                self.relative_mm,
                np.degrees(self.relative_rad),
                self.sigma[:, :2],
                np.degrees(self.sigma[:, 2]),
            ]
        )
        with path.open("w", newline="", encoding="utf-8") as handle:
            writer = csv.writer(handle, lineterminator="\n")
            writer.writerow(COLUMNS)
            writer.writerows([[f"{value:.6f}" for value in row] for row in table])


def usable_rows(tracks: Tracks, markers: MarkerFile) -> slice:
    """Return the frames over which both bodies have all their markers, seen or bridged.

    Raises
    ------
    MotionError
        If there are fewer than two such frames in a row.
    """
    needed = [*markers.bodies[markers.reference], *markers.bodies[markers.moving]]
    columns = [tracks.names.index(name) for name in needed]
    complete = np.isfinite(tracks.position_px[:, columns, 0]).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], complete, [False]]).astype(int)))
    if edges.size == 0:
        never = [name for name in needed if not tracks.known(name).any()]
        culprit = f": {', '.join(never)} never seen" if never else ""
        raise MotionError(f"no frame in which both bodies have all their markers{culprit}")
    runs = edges.reshape(-1, 2)
    first, last = max(runs, key=lambda run: run[1] - run[0])
    if last - first < 2:
        gone = [name for name in needed if tracks.known(name).sum() < 2]
        raise MotionError(
            "both bodies have all their markers in a single frame only "
            f"(frame {tracks.frame[first]}); lost at once: {', '.join(gone) or 'one after another'}"
        )
    return slice(int(first), int(last))


def body_poses(body: str, names: tuple[str, ...], positions_mm: Array, sigma_mm: Array) -> Poses:
    """Return the pose of a body in every frame.

    Parameters
    ----------
    body, names
        The body and its markers.
    positions_mm, sigma_mm
        (n, m, 2) and (n, m) marker positions and standard errors, mm.
    """
    measured = positions_mm[..., 0] + 1j * positions_mm[..., 1]
    weight = 1 / np.maximum(sigma_mm, 1e-6) ** 2
    total = weight.sum(axis=1)
    mean = (weight * measured).sum(axis=1) / total
    shape = measured[0] - measured[0].mean()
    angle = np.zeros(measured.shape[0])
    for _ in range(10 if len(names) > 1 else 1):
        offset = shape - (weight * shape).sum(axis=1, keepdims=True) / total[:, None]
        if len(names) > 1:
            turned = (weight * (measured - mean[:, None]) * offset.conj()).sum(axis=1)
            angle = np.unwrap(np.angle(turned))
        back = (measured - mean[:, None]) * np.exp(-1j * angle)[:, None] + (shape - offset)
        before = shape
        shape = (weight * back).sum(axis=0) / weight.sum(axis=0)
        shape = shape - shape.mean()
        if np.abs(shape - before).max() < 1e-10:
            break
    offset = shape - (weight * shape).sum(axis=1, keepdims=True) / total[:, None]
    turn = np.exp(1j * angle)
    rigid = mean[:, None] + offset * turn[:, None]
    inertia = (weight * np.abs(offset) ** 2).sum(axis=1)
    arm = offset[:, 0] * turn
    covariance = _pose_covariance(total, inertia, arm, turns=len(names) > 1)
    count = max(2 * len(names) - 3, 0)
    return Poses(
        body=body,
        markers=names,
        position_mm=np.column_stack([rigid[:, 0].real, rigid[:, 0].imag]),
        angle_rad=angle - angle[0],
        covariance=covariance,
        residual_mm=np.where(
            (sigma_mm > BRIDGED * np.median(sigma_mm, axis=0)).any(axis=1),
            np.nan,
            np.sqrt(np.mean(np.abs(measured - rigid) ** 2, axis=1)),
        ),
        expected_residual_mm=float(np.sqrt(np.median(sigma_mm) ** 2 * count / max(len(names), 1))),
        turns=len(names) > 1,
        axis_rad=float(np.angle(shape[-1] - shape[0]) + angle[0]) if len(names) > 1 else 0.0,
    )


def _pose_covariance(
    total: Array, inertia: Array, arm: NDArray[np.complex128], *, turns: bool
) -> Array:
    """Return the covariance (n, 3, 3) of x, y and angle of the marker at ``arm`` from the mean."""
    covariance = np.zeros((total.size, 3, 3))
    covariance[:, 0, 0] = covariance[:, 1, 1] = 1 / total
    if turns:
        lever = np.stack([-arm.imag, arm.real, np.ones_like(arm.real)], axis=1)
        covariance += lever[:, :, None] * lever[:, None, :] / inertia[:, None, None]
    return covariance


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
    axis = {body: pose.axis_rad + float(smooth[body][1][0]) for body, pose in poses.items()}
    head_angle, package_angle = head_angle - head_angle[0], package_angle - package_angle[0]
    origin = head_at[0]
    relative = rotated(package_at - head_at, -head_angle)
    sigma = _relative_sigma(package_at - head_at, head_angle, head_covariance, package_covariance)
    sigma[:, :2] = np.hypot(
        sigma[:, :2],
        _scale_error(package_at, head_at, scales[markers.moving], scales[markers.reference]),
    )
    return Capture(
        frame=tracks.frame[rows],
        time_s=time,
        head=RigidMotion(time, head_angle, head_at - origin),
        package=RigidMotion.of_reference_point(
            time, package_angle, package_at - origin, package_at[0] - origin
        ),
        origin_mm=origin,
        package_start_mm=package_at[0] - origin,
        relative_mm=relative,
        relative_rad=package_angle - head_angle,
        sigma=sigma,
        poses=poses,
        smoothing=smoothing,
        axis_rad=axis,
        others=_other_poses(tracks, markers, world_mm, scales, rows),
    )


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
