"""How far the jaw opens, from marks on the skin over it.

The skin slides over the bone when mouth and neck move: by about as much as it is seen to move on
the head, and each of two marks in its own way. That is the greater part of the standard error.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.delimited import read_named_table
from mocap.motion.capture import Capture
from mocap.motion.errors import MotionError
from mocap.motion.poses import Poses

Array = NDArray[np.float64]

JAW = "jaw"
SLIDING_MM = 2.0
"""Standard deviation of a mark's place over the bone, once the mouth has moved, mm; an estimate: in
the library's recordings, whose jaws rest, the skin slides by 1.5 to 2.1 mm."""

COLUMNS = ("frame", "time_s", "opening_deg", "sigma_deg")


@dataclass(frozen=True, eq=False)
class JawOpening:
    """How much farther the jaw is open than in the first frame.

    Attributes
    ----------
    frame, time_s
        (n,) the frames, and their times, s.
    opening_rad, sigma_rad
        (n,) turn of its marks on the head, positive where the mouth opens, and the standard error.
    """

    frame: NDArray[np.int_]
    time_s: Array
    opening_rad: Array
    sigma_rad: Array

    @classmethod
    def of(cls, captured: Capture, marks_apart_mm: float) -> JawOpening | None:
        """Return the opening of a captured jaw; None if it has no two marks that are always seen.

        Parameters
        ----------
        captured
            The motion, and the poses of the bodies. The face looks to the right.
        marks_apart_mm
            Distance of the jaw's marks.
        """
        jaw = captured.others.get(JAW)
        if jaw is None or not jaw.turns:
            return None
        head = captured.poses[captured.motion.head_body.name]
        sliding = np.sqrt(2.0) * SLIDING_MM / marks_apart_mm
        measured = [_turn_variance(pose) for pose in (jaw, head)]
        sigma = np.sqrt(np.sum(measured, axis=0) + sliding**2)
        sigma[0] = 0.0
        opening = -(jaw.angle_rad - captured.motion.head_rad)
        return cls(captured.frame, captured.motion.time_s, opening - opening[0], sigma)

    @classmethod
    def read(cls, path: Path) -> JawOpening:
        """Return what :meth:`write` wrote.

        Raises
        ------
        MotionError
            If the file is no such table, is cut, or its times do not increase.
        """
        table = read_named_table(path, COLUMNS, what="table of a jaw", error=MotionError)
        frame, time_s, opening, sigma = (table.numbers(name) for name in COLUMNS)
        if np.any(np.diff(time_s) <= 0.0):
            late = int(np.argmax(np.diff(time_s) <= 0.0)) + 1
            raise MotionError(
                f"{path} line {table.rows[late].line}: time_s = {time_s[late]:g} s does not come "
                "after the row above; sort the rows by time"
            )
        return cls(frame.astype(int), time_s, np.radians(opening), np.radians(sigma))

    def means(self, interval_s: float) -> tuple[Array, Array]:
        """Return times (k,), s, at most so far apart, and mean openings (k,), rad, about them.

        Noise from frame to frame is averaged; what a jaw does, it does more slowly. The first mean
        is that of the first frame alone, from which openings count.
        """
        since = self.time_s - self.time_s[0]
        step = since[-1] / max(1.0, np.ceil(since[-1] / interval_s)) or interval_s
        nearest, bins = np.unique(np.rint(since / step), return_inverse=True)
        means = np.bincount(bins, self.opening_rad) / np.bincount(bins)
        means[0] = self.opening_rad[0]
        return self.time_s[0] + nearest * step, means

    def write(self, path: Path) -> None:
        """Write ``jaw.csv``, one row a frame, angles in degrees."""
        angles = np.degrees([self.opening_rad, self.sigma_rad]).T
        with path.open("w", newline="", encoding="utf-8") as handle:
            writer = csv.writer(handle, lineterminator="\n")
            writer.writerow(COLUMNS)
            for frame, time, (opening, sigma) in zip(self.frame, self.time_s, angles, strict=True):
                writer.writerow([frame, f"{time:.6f}", f"{opening:.4f}", f"{sigma:.4f}"])


def _turn_variance(pose: Poses) -> Array:
    variance: Array = pose.covariance[:, 2, 2] + pose.shared_covariance[:, 2, 2]
    return variance
