"""Pose of a body in every frame from the positions of its markers, with its standard error.

The pose of a body in a frame is the angle θ and the position that fit its shape X_i to the measured
x_i by least squares with weights w_i = 1/σ_i². As complex numbers relative to their weighted means,
θ = arg Σ w_i x_i X̄_i (a rotation, never a reflection), σ_θ² = 1/Σ w_i|X_i|², and σ² = 1/Σ w_i for
the mean. The shape is the average over all frames (generalised Procrustes analysis, Gower 1975):
no single frame's noise enters all angles.

The length of the same sum, Σ w_i x_i X̄_i e^(−iθ)/Σ w_i|X_i|², is how much larger than its shape the
body appears. It has the standard error of the angle. A rigid body turns and does not stretch, so
that what varies quickly in it is noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.motion.errors import MotionError
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

# A body is not rigid if its RMS residual exceeds this many expected residuals ...
RIGID_LIMIT = 5.0
# ... and this length, mm: expected residuals may be very small.
RIGID_LEAST_MM = 0.3
# A marker is interpolated if its standard error exceeds the median one by this factor.
INTERPOLATED = 4.0


@dataclass(frozen=True)
class Poses:
    """Measured pose of one body in every frame.

    Attributes
    ----------
    body, markers
        The body and its markers.
    position_mm
        (n, 2) position of the first marker, mm.
    angle_rad
        (n,) rotation since the first frame, rad.
    covariance
        (n, 3, 3) covariance of (x, y, angle): the part that differs from frame to frame.
    shared_covariance
        (n, 3, 3) the part that neighbouring frames share, which smoothing does not lessen.
    residual_mm
        (n,) RMS distance of the markers from the fitted shape, mm; nan where a marker is
        interpolated.
    expected_residual_mm
        The same as the standard errors let expect.
    turns
        Whether the rotation is known; False for a single marker.
    noise_known
        Whether the covariance is that of the noise, told from motion by what a rigid body's marks
        do not share.
    persistence
        How many neighbouring frames share an error: so many count as one measurement.
    stretch
        (n,) apparent size of the body over that of its shape; its standard error is the angle's.
        None if it is not known, as for a single marker.
    axis_rad
        Direction from the first to the last marker at ``angle_rad`` zero, counter-clockwise from
        the world's x, from all frames together; 0 for a single marker.
    """

    body: str
    markers: tuple[str, ...]
    position_mm: Array
    angle_rad: Array
    covariance: Array
    shared_covariance: Array
    residual_mm: Array
    expected_residual_mm: float
    turns: bool
    axis_rad: float
    stretch: Array | None = None
    noise_known: bool = False
    persistence: float = 1.0

    @property
    def residual_rms_mm(self) -> float:
        """RMS residual over the frames without interpolated markers, mm."""
        return float(np.sqrt(np.nanmean(self.residual_mm**2)))

    @property
    def rigid(self) -> bool:
        """Whether the markers keep their distances within their errors."""
        limit = max(RIGID_LIMIT * self.expected_residual_mm, RIGID_LEAST_MM)
        return self.residual_rms_mm <= limit


def usable_rows(
    tracks: Tracks,
    markers: MarkerFile,
    known: Mapping[str, NDArray[np.bool_]] = MappingProxyType({}),
) -> slice:
    """Return the longest interval of frames in which the poses of both bodies are known.

    Parameters
    ----------
    tracks, markers
        The tracks, and the marker file for the bodies.
    known
        (n,) in which frames a body's pose is known, for bodies that need not show all their
        markers.

    Raises
    ------
    MotionError
        If it is shorter than two frames.
    """
    needed = [*markers.bodies[markers.reference], *markers.bodies[markers.moving]]
    complete = np.ones(tracks.frame.size, bool)
    for body in (markers.reference, markers.moving):
        columns = [tracks.names.index(name) for name in markers.bodies[body]]
        every = np.isfinite(tracks.position_px[:, columns, 0]).all(axis=1)
        complete &= known.get(body, every)
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


def carried_by_two(tracks: Tracks, names: tuple[str, ...]) -> NDArray[np.bool_] | None:
    """Return (n,) in which frames two or more marks of a body are known; None if it has only two.

    All of them have to be known together once, which gives the body its shape.
    """
    columns = [tracks.names.index(name) for name in names]
    finite = np.isfinite(tracks.position_px[:, columns, 0])
    if len(names) < 3 or not finite.all(axis=1).any():
        return None
    return np.asarray(finite.sum(axis=1) >= 2)


def body_poses(body: str, names: tuple[str, ...], positions_mm: Array, sigma_mm: Array) -> Poses:
    """Return the pose of a body in every frame.

    Parameters
    ----------
    body, names
        The body and its markers.
    positions_mm, sigma_mm
        (n, m, 2) and (n, m) marker positions and standard errors, mm; nan where a marker of a body
        with three or more is hidden.

    Raises
    ------
    MotionError
        If no frame shows all markers.
    """
    known = np.isfinite(positions_mm[..., 0])
    if not known.all(axis=1).any():
        raise MotionError(f"{body}: no frame shows {', '.join(names)} together")
    measured = np.where(known, positions_mm[..., 0] + 1j * positions_mm[..., 1], 0.0)
    weight = np.where(known, 1 / np.maximum(sigma_mm, 1e-6) ** 2, 0.0)
    total = weight.sum(axis=1)
    mean = (weight * measured).sum(axis=1) / total
    whole = measured[int(np.argmax(known.all(axis=1)))]
    shape = whole - whole.mean()
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
    rigid_offset = offset * turn[:, None]
    rigid = mean[:, None] + rigid_offset
    inertia = (weight * np.abs(offset) ** 2).sum(axis=1)
    along = (weight * (measured - mean[:, None]) * rigid_offset.conj()).sum(axis=1).real
    arm = offset[:, 0] * turn
    covariance = _pose_covariance(total, inertia, arm, turns=len(names) > 1)
    count = max(2 * len(names) - 3, 0)
    return Poses(
        body=body,
        markers=names,
        position_mm=np.column_stack([rigid[:, 0].real, rigid[:, 0].imag]),
        angle_rad=angle - angle[0],
        covariance=covariance,
        shared_covariance=np.zeros_like(covariance),
        residual_mm=np.where(
            (sigma_mm > INTERPOLATED * np.nanmedian(sigma_mm, axis=0)).any(axis=1),
            np.nan,
            np.sqrt(np.nanmean(np.where(known, np.abs(measured - rigid) ** 2, np.nan), axis=1)),
        ),
        expected_residual_mm=float(
            np.sqrt(np.nanmedian(sigma_mm) ** 2 * count / max(len(names), 1))
        ),
        turns=len(names) > 1,
        axis_rad=float(np.angle(shape[-1] - shape[0]) + angle[0]) if len(names) > 1 else 0.0,
        stretch=along / inertia if len(names) > 1 else None,
    )


def _pose_covariance(
    total: Array, inertia: Array, arm: NDArray[np.complex128], *, turns: bool
) -> Array:
    """Return the covariance (n, 3, 3) of x, y and angle of the marker at ``arm`` from the mean.

    ``total`` and ``inertia`` are Σ w and Σ w|X|² (n,); ``arm`` (n,) is complex, mm.
    """
    covariance = np.zeros((total.size, 3, 3))
    covariance[:, 0, 0] = covariance[:, 1, 1] = 1 / total
    if turns:
        lever = np.stack([-arm.imag, arm.real, np.ones_like(arm.real)], axis=1)
        covariance += lever[:, :, None] * lever[:, None, :] / inertia[:, None, None]
    return covariance
