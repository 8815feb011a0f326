"""A rectangle of pixels, and the coverage of polygons on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mocap.synthetic.camera import Camera
from mocap.synthetic.raster import coverage

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PixelWindow:
    """A rectangle of the picture: rows and columns, the last ones exclusive."""

    top: int
    left: int
    bottom: int
    right: int

    @classmethod
    def around(cls, corners_px: Array, margin: float, camera: Camera) -> PixelWindow:
        """Return the window of a polygon (n, 2), px, with a margin, px, inside the picture."""
        low = np.floor(corners_px.min(axis=0) - margin).astype(int)
        high = np.ceil(corners_px.max(axis=0) + margin).astype(int) + 1
        left, right = np.clip([low[0], high[0]], 0, camera.width)
        top, bottom = np.clip([low[1], high[1]], 0, camera.height)
        return cls(int(top), int(left), int(bottom), int(right))

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""
        return self.bottom - self.top, self.right - self.left

    def cut_to(self, other: PixelWindow) -> PixelWindow:
        """Return the intersection with another window."""
        top, left = max(self.top, other.top), max(self.left, other.left)
        bottom, right = min(self.bottom, other.bottom), min(self.right, other.right)
        return PixelWindow(top, left, max(bottom, top), max(right, left))

    def seen_from(self, other: PixelWindow) -> tuple[slice, slice]:
        """Return the slices of this window in an array that covers a larger window."""
        rows = slice(self.top - other.top, self.bottom - other.top)
        return rows, slice(self.left - other.left, self.right - other.left)

    @property
    def slices(self) -> tuple[slice, slice]:
        """Slices of this window in the picture."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def covered(self, corners_px: Array) -> NDArray[np.float32]:
        """Return the coverage (rows, columns) of a polygon (n, 2), px, on this window."""
        return coverage(corners_px - [self.left, self.top], self.shape).astype(np.float32)


def softened(window: PixelWindow, corners_px: Array, softness_px: float) -> NDArray[np.float32]:
    """Return the coverage of a polygon with a soft edge; wide edges use a coarser grid."""
    if softness_px <= 0 or 0 in window.shape:
        return window.covered(corners_px)
    import cv2

    coarse = max(1, int(softness_px / 2))
    rows, columns = (-(-n // coarse) + 1 for n in window.shape)
    local = (corners_px - [window.left, window.top] + 0.5) / coarse - 0.5
    small = coverage(local, (rows, columns)).astype(np.float32)
    small = np.asarray(cv2.GaussianBlur(small, (0, 0), softness_px / coarse), np.float32)
    whole = cv2.resize(small, (columns * coarse, rows * coarse), interpolation=cv2.INTER_LINEAR)
    return np.asarray(whole[: window.shape[0], : window.shape[1]], np.float32)
