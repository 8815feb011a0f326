"""Pose of a body in every frame from the positions of its markers, with its uncertainty.

The pose of a body in a frame is the angle θ and the position that bring its shape X_i nearest to
the measured x_i in the least-squares sense, weights w_i = 1/σ_i². With both taken from their
weighted means and as complex numbers, θ = arg Σ w_i x_i X̄_i (a rotation, never a reflection),
σ_θ² = 1/Σ w_i|X_i|², and σ² = 1/Σ w_i for the mean. The shape is the average over all frames
(generalised Procrustes, Gower 1975), so that no single frame's noise is in all angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.motion.errors import MotionError
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

# A body whose markers miss their rigid places by this many stated errors is not rigid.
RIGID_LIMIT = 5.0
# ... and by more than this (mm), since stated errors may be very small.
RIGID_LEAST_MM = 0.3
# Standard errors over the usual one from which on a marker was bridged rather than seen.
BRIDGED = 4.0


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
