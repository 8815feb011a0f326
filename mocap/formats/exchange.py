"""Marker positions from and to the files of other programs.

Readers: TRC, C3D, BVH, DeepLabCut and SLEAP (CSV and HDF5), Kinovea (kinematics CSV, trajectory
text and annotations) and Tracker (text). Writers: TRC and C3D. Kinovea, DeepLabCut and SLEAP count
pixels from the centre of the first one, as this program does; Tracker counts from its corner, so
its coordinates are larger by half a pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.delimited import header_line
from mocap.formats import bvh, c3d, kinovea_kva, pose_h5, pose_tables, spreadsheets, trc
from mocap.formats.marker_table import ExchangeError, MarkerTable, text_of
from mocap.motion.motion import Motion
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

# Standard error of positions from programs that state none, px.
FOREIGN_SIGMA_PX = 0.5


def read_positions(path: Path | str) -> MarkerTable:
    """Return the marker positions in a file; its format follows from its ending and content.

    Raises
    ------
    ExchangeError
        If the file is missing, of unknown format, or broken; the message names file and line.
    """
    file = Path(path)
    if not file.is_file():
        raise ExchangeError(f"{file}: no such file; check the path")
    return _reader_for(file)(file)


def _reader_for(file: Path) -> Callable[[Path], MarkerTable]:
    ending = file.suffix.lower()
    if ending == ".c3d":
        return c3d.read_c3d
    if ending == ".trc":
        return trc.read_trc
    if ending == ".bvh":
        return bvh.read_bvh
    if ending in (".kva", ".xml"):
        return kinovea_kva.read_kva
    if ending in (".h5", ".hdf5"):
        return pose_h5.read_pose_h5
    if ending in (".csv", ".txt", ".tsv"):
        first = header_line(text_of(file)).lstrip()
        if first.lower().startswith("scorer"):
            return pose_tables.read_deeplabcut
        if "frame_idx" in first.lower():
            return pose_tables.read_sleap
        if first.startswith("#Kinovea"):
            return spreadsheets.read_kinovea_text
        if "time" in first.lower():
            return spreadsheets.read_kinovea
        return spreadsheets.read_tracker
    raise ExchangeError(
        f"{file}: ending {ending or '(empty)'} is not known; known are .trc, .c3d, .bvh, .csv, "
        ".txt, .kva, .xml and .h5"
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
        Whether the program counts from the corner of the first pixel (Tracker), not its centre.
    height_px
        Height of the picture, px, if the program's y points up; None if it points down.

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
        frame=np.rint(table.time_s * table.rate_hz).astype(int)
        if table.frame is None
        else table.frame,
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


def motion_table(motion: Motion, markers: MarkerFile) -> MarkerTable:
    """Return a motion as markers (mm, y up, z 0) that move rigidly with their bodies.

    A body has two markers: its first one, and a point 100 mm from it along the body's x axis.
    """
    names: list[str] = []
    columns = []
    for body, rigid, start in (
        (markers.reference, motion.head, np.zeros(2)),
        (markers.moving, motion.package, motion.package_mm[0]),
    ):
        names += [markers.bodies[body][0], f"{body}_axis"]
        columns.append(rigid.apply(np.array([start, start + np.array([100.0, 0.0])])))
    plane = np.concatenate(columns, axis=1)
    positions = np.concatenate([plane, np.zeros((*plane.shape[:2], 1))], axis=2)
    return MarkerTable(motion.time_s, tuple(names), positions, "mm")
