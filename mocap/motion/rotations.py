"""Rotations in space: axis-angle vectors, and their parts in and out of the picture's plane."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array: TypeAlias = NDArray[np.float64]


def rotation_of(vector: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of axis-angle vectors (..., 3), rad."""
    vectors = np.asarray(vector, float)
    matrices = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix()
    return np.asarray(matrices.reshape(*vectors.shape, 3))


def vector_of(matrix: Array) -> Array:
    """Return the axis-angle vectors (..., 3), rad, of rotation matrices (..., 3, 3)."""
    vectors = Rotation.from_matrix(np.reshape(matrix, (-1, 3, 3))).as_rotvec()
    return np.asarray(vectors.reshape(np.shape(matrix)[:-1]))


def swing_twist(matrix: Array) -> tuple[Array, Array]:
    """Return the parts of rotations (n, 3, 3) out of and in the picture's plane.

    Each rotation is a twist about z, the camera's axis, followed by a swing about an axis in the
    plane. The swing is (n, 2), an axis-angle vector about x and y, rad; the twist is (n,), rad.
    """
    quaternion = Rotation.from_matrix(matrix).as_quat()
    twist = 2 * np.arctan2(quaternion[:, 2], quaternion[:, 3])
    twist = np.asarray((twist + np.pi) % (2 * np.pi) - np.pi)
    flat = np.column_stack([0 * twist, 0 * twist, -twist])
    swing = vector_of(np.asarray(matrix) @ rotation_of(flat))
    return np.asarray(swing[:, :2]), twist
