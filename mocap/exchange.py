"""Marker positions from and to other programs' files.

Reads TRC, C3D, BVH, DeepLabCut CSV, Kinovea (kinematics CSV and trajectory text) and Tracker
(text); writes TRC and C3D. Pictures' conventions differ: Kinovea and DeepLabCut count from the
centre of a pixel as this program does; Tracker counts from its corner, half a pixel more each way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.markers import MarkerFile
from mocap.motion import Capture
from mocap.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

MM_PER = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
AXES = {"X": 0, "Y": 1, "Z": 2}
# Standard error (px) of positions from programs that state none.
FOREIGN_SIGMA_PX = 0.5


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
        The m markers, each name once.
    positions
        (n, m, 3) positions in ``unit``; nan where a marker is missing. Picture positions have z 0
        and y down.
    unit
        "mm", "cm", "m" or "px"; "" if the file does not say.
    """

    time_s: Array
    names: tuple[str, ...]
    positions: Array
    unit: str

    @property
    def rate_hz(self) -> float:
        """Mean rate, frames/s; 1 for a single frame."""
        if self.time_s.size < 2:
            return 1.0
        return float((self.time_s.size - 1) / (self.time_s[-1] - self.time_s[0]))

    @property
    def even(self) -> bool:
        """Whether the intervals between frames agree within 1 %."""
        intervals = np.diff(self.time_s)
        return intervals.size == 0 or bool(np.ptp(intervals) <= 0.01 * np.median(intervals))

    def in_mm(self) -> MarkerTable:
        """Return the table with positions in mm.

        Raises
        ------
        ExchangeError
            If the unit is no length.
        """
        if self.unit not in MM_PER:
            raise ExchangeError(f"positions in {self.unit or 'no unit'} are not lengths in mm")
        return replace(self, positions=self.positions * MM_PER[self.unit], unit="mm")

    def of(self, name: str) -> Array:
        """Return the positions (n, 3) of one marker."""
        if name not in self.names:
            raise ExchangeError(f"no marker {name!r}; there are {', '.join(self.names)}")
        return self.positions[:, self.names.index(name)]


def plane_positions(table: MarkerTable, *, right: str, up: str) -> Array:
    """Return positions (n, m, 2), mm, in the plane of two axes of a table.

    Parameters
    ----------
    table
        In a unit of length.
    right, up
        Which axis of the file points right and which up, with a sign: "-Z", "+X".
    """
    parts = []
    for axis in (right, up):
        letter = axis.lstrip("+-").upper()
        if letter not in AXES:
            raise ExchangeError(f"axis {axis!r}: write X, Y or Z, with - in front to turn it round")
        parts.append(
            (-1.0 if axis.startswith("-") else 1.0) * table.in_mm().positions[..., AXES[letter]]
        )
    return np.stack(parts, axis=-1)


def read_positions(path: Path | str) -> MarkerTable:
    """Return the marker positions in a file of any format known here, told by ending and content.

    Raises
    ------
    ExchangeError
        If the file is missing, of no known format, or broken; the message names file and place.
    """
    file = Path(path)
    if not file.is_file():
        raise ExchangeError(f"{file}: no such file; check the path")
    return _reader_for(file)(file)


def _reader_for(file: Path) -> Callable[[Path], MarkerTable]:
    from mocap import bvh, c3d, spreadsheets, trc

    ending = file.suffix.lower()
    if ending == ".c3d":
        return c3d.read_c3d
    if ending == ".trc":
        return trc.read_trc
    if ending == ".bvh":
        return bvh.read_bvh
    if ending in (".csv", ".txt", ".tsv"):
        head = spreadsheets.text_of(file)[:4000].lstrip("\ufeff").lstrip()
        first = head.splitlines()[0] if head else ""
        if first.lower().startswith("scorer"):
            return spreadsheets.read_deeplabcut
        if first.startswith("#Kinovea"):
            return spreadsheets.read_kinovea_text
        if "time" in first.lower():
            return spreadsheets.read_kinovea
        return spreadsheets.read_tracker
    raise ExchangeError(
        f"{file}: ending {ending or '(none)'} is not known; known are .trc, .c3d, .bvh, .csv and "
        ".txt"
    )


def tracks_from(
    table: MarkerTable, *, corner_origin: bool = False, height_px: int | None = None
) -> Tracks:
    """Return picture positions of another program as tracks.

    Parameters
    ----------
    table
        Positions in px.
    corner_origin
        Whether the program counts from the corner of the first pixel (Tracker) rather than its
        centre.
    height_px
        Height of the picture where the program's y points up; None if it points down.

    Raises
    ------
    ExchangeError
        If the positions are lengths.
    """
    if table.unit not in ("px", ""):
        raise ExchangeError(f"positions are in {table.unit}: tracks need px")
    position = table.positions[..., :2].copy()
    if height_px is not None:
        position[..., 1] = height_px - position[..., 1]
    if corner_origin:
        position -= 0.5
    known = np.isfinite(position).all(axis=-1)
    position[~known] = np.nan
    return Tracks(
        frame=np.rint(table.time_s * table.rate_hz).astype(int),
        time_s=table.time_s,
        names=table.names,
        position_px=position,
        sigma_px=np.where(known, FOREIGN_SIGMA_PX, np.nan),
        status=np.where(known, "seen", "lost").astype("<U9"),
    )


def table_from(tracks: Tracks) -> MarkerTable:
    """Return tracks as a table in px, y down, z 0."""
    flat = np.zeros((*tracks.position_px.shape[:2], 1))
    flat[~np.isfinite(tracks.position_px[..., :1])] = np.nan
    positions = np.concatenate([tracks.position_px, flat], axis=2)
    return MarkerTable(tracks.time_s, tracks.names, positions, "px")


def motion_table(motion: Capture, markers: MarkerFile) -> MarkerTable:
    """Return a motion as markers (mm, y up, z 0) that move rigidly with their bodies.

    Each body's first marker, and a second point 100 mm from it along the body's x axis.
    """
    names: list[str] = []
    columns = []
    for body, rigid, start in (
        (markers.reference, motion.head, np.zeros(2)),
        (markers.moving, motion.package, motion.package_start_mm),
    ):
        names += [markers.bodies[body][0], f"{body}_axis"]
        columns.append(rigid.apply(np.array([start, start + np.array([100.0, 0.0])])))
    plane = np.concatenate(columns, axis=1)
    positions = np.concatenate([plane, np.zeros((*plane.shape[:2], 1))], axis=2)
    return MarkerTable(motion.time_s, tuple(names), positions, "mm")


def checked_table(
    file: Path, time: Array, names: list[str], positions: Array, unit: str
) -> MarkerTable:
    """Return a table after the checks that all formats share.

    Raises
    ------
    ExchangeError
        If there is no frame, a marker is there twice, or times do not increase.
    """
    if time.size == 0:
        raise ExchangeError(f"{file}: holds no frame")
    doubled = [name for name in names if names.count(name) > 1]
    if doubled:
        raise ExchangeError(f"{file}: marker {doubled[0]!r} is there twice; rename one")
    if not np.isfinite(time).all():
        raise ExchangeError(f"{file}: row {int(np.argmin(np.isfinite(time))) + 1} has no time")
    if np.any(np.diff(time) <= 0):
        row = int(np.argmax(np.diff(time) <= 0)) + 2
        raise ExchangeError(
            f"{file}: the time of row {row} ({time[row - 1]:g} s) is not after the one before "
            f"({time[row - 2]:g} s); rows are doubled or out of order"
        )
    return MarkerTable(time, tuple(names), positions, unit)
