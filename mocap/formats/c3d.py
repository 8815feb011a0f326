"""C3D, the binary standard of motion laboratories, through ezc3d."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from mocap.formats.marker_table import ExchangeError, MarkerTable, checked_table


def read_c3d(path: Path | str) -> MarkerTable:
    """Return the points of a C3D file; points marked invalid (residual −1) are nan.

    Raises
    ------
    ExchangeError
        If it is no C3D file, holds no points, or ends before the frame its header names last.
    """
    import ezc3d

    file = Path(path)
    if not file.is_file():
        raise ExchangeError(f"{file}: no such file; check the path")
    _check_length(file)
    try:
        content = ezc3d.c3d(str(file))
    except (OSError, RuntimeError, ValueError, IndexError, KeyError, MemoryError) as error:
        reason = str(error).splitlines()[0].split(". If")[0] if str(error) else "unreadable"
        raise ExchangeError(f"{file}: is no C3D file, or was cut short ({reason})") from None
    points = np.asarray(content["data"]["points"], float)
    residual = np.asarray(content["data"]["meta_points"]["residuals"], float)[0]
    header = content["header"]["points"]
    declared = int(header["last_frame"]) - int(header["first_frame"]) + 1
    rate = float(header["frame_rate"])
    if points.shape[1] == 0:
        raise ExchangeError(f"{file}: holds no points, only analogue data")
    if points.shape[2] < declared:
        raise ExchangeError(
            f"{file}: announces {declared} frames and holds {points.shape[2]}: it was cut short"
        )
    if rate <= 0:
        raise ExchangeError(f"{file}: its frame rate is {rate}")
    parameters = content["parameters"]["POINT"]
    names = [str(name) for name in parameters["LABELS"]["value"]][: points.shape[1]]
    names += [f"point_{k + 1}" for k in range(len(names), points.shape[1])]
    units = parameters.get("UNITS", {}).get("value", [""])
    positions = np.moveaxis(points[:3], [0, 1, 2], [2, 1, 0]).copy()
    positions[(residual < 0).T] = np.nan
    time = (int(header["first_frame"]) + np.arange(points.shape[2])) / rate
    return checked_table(file, time, names, positions, str(units[0]) if units else "")


def _check_length(file: Path) -> None:
    """Refuse a file shorter than its header says, before it is handed to the library.

    Words of the first block (C3D user guide, 2008): 1 place of the parameters and the number 80,
    2 points, 3 analogue values a frame, 4 and 5 first and last frame, 7-8 scale (negative: real
    numbers), 9 first block of data.
    """
    size = file.stat().st_size
    with file.open("rb") as handle:
        head = handle.read(512)
        if size < 512 or head[1] != 80:
            raise ExchangeError(f"{file}: is no C3D file, or was cut short in its header")
        handle.seek((max(head[0], 1) - 1) * 512 + 3)
        processor = handle.read(1)
    if processor == b"":
        raise ExchangeError(f"{file}: was cut short in its parameters")
    if processor != b"\x54":
        return
    points, analogue, first, last = struct.unpack("<4H", head[2:10])
    scale = struct.unpack("<f", head[12:16])[0]
    start = struct.unpack("<H", head[16:18])[0]
    width = 4 if scale < 0 else 2
    needed = (start - 1) * 512 + (last - first + 1) * (4 * points + analogue) * width
    # Longer recordings overflow the header's count; the library reads theirs elsewhere.
    if last < 65535 and size < needed:
        raise ExchangeError(
            f"{file}: holds {size} bytes and announces frames for {needed}: it was cut short"
        )


def write_c3d(table: MarkerTable, path: Path) -> None:
    """Write a table as C3D with an even rate; missing markers get residual −1.

    Raises
    ------
    ExchangeError
        If the times are uneven by more than 1 %: C3D knows only a rate.
    """
    import ezc3d

    intervals = np.diff(table.time_s)
    if not table.even:
        raise ExchangeError(
            f"{path}: C3D needs an even rate, but intervals run from {intervals.min():.4g} to "
            f"{intervals.max():.4g} s; resample the motion or write TRC"
        )
    content = ezc3d.c3d()
    missing = np.isnan(table.positions).any(axis=2).T
    points = np.ones((4, len(table.names), len(table.time_s)))
    points[:3] = np.moveaxis(np.nan_to_num(table.positions), [0, 1, 2], [2, 1, 0])
    content["parameters"]["POINT"]["RATE"]["value"] = [table.rate_hz]
    content["parameters"]["POINT"]["LABELS"]["value"] = tuple(table.names)
    content["parameters"]["POINT"]["UNITS"]["value"] = (table.unit,)
    content["header"]["points"]["first_frame"] = round(table.time_s[0] * table.rate_hz)
    content["data"]["points"] = points
    content["data"]["meta_points"] = {
        "residuals": np.where(missing, -1.0, 0.0)[None],
        "camera_masks": np.zeros((7, *missing.shape), bool),
    }
    content.write(str(path))
