"""What is known exactly about a rendered frame, and its tables."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geometry2d.rigid import RigidPlacement


@dataclass(frozen=True)
class MarkerTruth:
    """A marker in a frame: mean position over the exposure, px, and its visible fraction."""

    x_px: float
    y_px: float
    visible: float


@dataclass(frozen=True)
class Truth:
    """A frame: its number, time (s), markers and the placement of each body."""

    frame: int
    time_s: float
    markers: Mapping[str, MarkerTruth]
    placements: Mapping[str, RigidPlacement]


def write_truth(markers_file: Path, bodies_file: Path, truths: Iterable[Truth]) -> None:
    """Write the truth of all frames as two tables.

    ``markers_file``: ``frame,time_s,marker,x_px,y_px,visible``. ``bodies_file``:
    ``frame,time_s,body,theta_deg,x_mm,y_mm``, the placement x = R(theta) X + (x_mm, y_mm) of body
    points X in the world plane.
    """
    with markers_file.open("w", newline="") as first, bodies_file.open("w", newline="") as second:
        markers, bodies = (csv.writer(f, lineterminator="\n") for f in (first, second))
        markers.writerow(["frame", "time_s", "marker", "x_px", "y_px", "visible"])
        bodies.writerow(["frame", "time_s", "body", "theta_deg", "x_mm", "y_mm"])
        for truth in truths:
            head = [truth.frame, f"{truth.time_s:.6f}"]
            for name, m in truth.markers.items():
                markers.writerow(
                    [*head, name, f"{m.x_px:.4f}", f"{m.y_px:.4f}", f"{m.visible:.3f}"]
                )
            for name, p in truth.placements.items():
                shift = [f"{value:.5f}" for value in p.shift_mm]
                bodies.writerow([*head, name, f"{np.degrees(p.angle_rad):.6f}", *shift])
