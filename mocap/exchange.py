"""Marker positions to and from other programs' files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.markers import MarkerFile
from mocap.motion import Capture

Array: TypeAlias = NDArray[np.float64]


class ExchangeError(ValueError):
    """A file of marker positions that cannot be used."""


@dataclass(frozen=True)
class MarkerTable:
    """Marker positions over time, as other programs keep them.

    Parameters
    ----------
    time_s
        (n,) increasing times, s.
    names
        The m markers.
    positions
        (n, m, 3) positions in ``unit``; nan where a marker is missing.
    unit
        "mm", "m", "cm" or "px".
    """

    time_s: Array
    names: tuple[str, ...]
    positions: Array
    unit: str

    @property
    def rate_hz(self) -> float:
        """Median rate, frames/s."""
        if self.time_s.size < 2:
            return 1.0
        return float(1 / np.median(np.diff(self.time_s)))


def write_trc(table: MarkerTable, path: Path) -> None:
    """Write a table as TRC (tab-separated, version 4), which OpenSim and Mokka read."""
    rate = f"{table.rate_hz:.6g}"
    count, markers = len(table.time_s), len(table.names)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        f"{rate}\t{rate}\t{count}\t{markers}\t{table.unit}\t{rate}\t1\t{count}",
        "Frame#\tTime\t" + "\t\t\t".join(table.names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{k + 1}" for k in range(markers) for axis in "XYZ"),
        "",
    ]
    for i, time in enumerate(table.time_s):
        cells = ["" if np.isnan(v) else f"{v:.6f}" for v in table.positions[i].ravel()]
        lines.append(f"{i + 1}\t{time:.6f}\t" + "\t".join(cells))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def motion_table(motion: Capture, markers: MarkerFile) -> MarkerTable:
    """Return a motion as markers (mm, y up, z = 0) that move rigidly with their bodies.

    Each body's first marker, and a second point 100 mm from it along the body's x axis.
    """
    names, columns = [], []
    for body, rigid, start in (
        (markers.reference, motion.head, np.zeros(2)),
        (markers.moving, motion.package, motion.package_start_mm),
    ):
        names += [markers.bodies[body][0], f"{body}_axis"]
        columns.append(rigid.apply(np.array([start, start + np.array([100.0, 0.0])])))
    plane = np.concatenate(columns, axis=1)
    positions = np.concatenate([plane, np.zeros((*plane.shape[:2], 1))], axis=2)
    return MarkerTable(motion.time_s, tuple(names), positions, "mm")


def write_motion_trc(motion: Capture, markers: MarkerFile, path: Path) -> None:
    """Write ``motion.trc``: both bodies in the world plane, mm."""
    write_trc(motion_table(motion, markers), path)
