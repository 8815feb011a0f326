"""The table of depth and tilt of bodies that carry coded stickers."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from mocap.motion.capture import Capture

COLUMNS = (
    "frame",
    "time_s",
    "body",
    "depth_mm",
    "tilt_x_deg",
    "tilt_y_deg",
    "sigma_depth_mm",
    "sigma_tilt_x_deg",
    "sigma_tilt_y_deg",
)


def write_out_of_plane(captured: Capture, path: Path) -> None:
    """Write ``out_of_plane.csv``, one row per body per frame.

    Depth and tilt count from the first frame: depth away from the camera, tilt as an axis-angle
    vector about the world's x (to the right) and y (up).
    """
    with path.open("w", newline="", encoding="utf-8") as handle:
        writer = csv.writer(handle, lineterminator="\n")
        writer.writerow(COLUMNS)
        for i, (frame, time) in enumerate(zip(captured.frame, captured.motion.time_s, strict=True)):
            for body, pose in captured.out_of_plane.items():
                numbers = [
                    pose.depth_mm[i],
                    *np.degrees(pose.tilt_rad[i]),
                    pose.depth_sigma_mm[i],
                    *np.degrees(pose.tilt_sigma_rad[i]),
                ]
                cells = [f"{value:.4f}" for value in numbers]
                writer.writerow([frame, f"{time:.6f}", body, *cells])
