"""C3D, the binary standard of motion laboratories, through ezc3d.

A file is checked first (:mod:`mocap.formats.c3d_header`) and then read in a separate process
(:mod:`mocap.formats.c3d_child`). If that process crashes or reaches its limits, the result is an
ordinary error.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.text import bytes_of, quoted
from mocap.formats.c3d_header import check_c3d
from mocap.formats.marker_table import (
    LEAST_INTERVAL_S,
    ExchangeError,
    MarkerTable,
    checked_table,
)

Array: TypeAlias = NDArray[np.float64]

LONGEST_LABEL = 127
"""Largest number of bytes of a name: it is stored as a signed byte."""

CHILD = Path(__file__).with_name("c3d_child.py")

MEMORY_BYTES, MEMORY_PER_BYTE = 200_000_000, 30
CPU_SECONDS, BYTES_PER_CPU_SECOND = 4, 5_000_000
SECONDS = 120
"""Limits of the process: memory and processor time grow with the size of the file."""


def read_c3d(path: Path | str) -> MarkerTable:
    """Return the points of a C3D file; points marked invalid (residual −1) are nan.

    Raises
    ------
    ExchangeError
        If it is no C3D file, holds no points, or ends before the last frame that it announces.
    """
    file = Path(path)
    data = bytes_of(file, what="C3D file", error=ExchangeError)
    check_c3d(file, data)
    found = _read_in_a_child(file, len(data))
    points, residual = found["points"], found["residuals"]
    count, frames = points.shape[1:]
    rate = float(found["rate_hz"])
    if count == 0:
        raise ExchangeError(f"{file}: holds no points, only analogue data; export the points")
    if not 0 < rate <= 1 / LEAST_INTERVAL_S:
        raise ExchangeError(f"{file}: its frame rate is {rate:g}; export it again")
    names = [str(name) for name in found["names"][:count]]
    names += [f"point_{k + 1}" for k in range(len(names), count)]
    names = _each_once(names)
    positions = np.moveaxis(points[:3], [0, 1, 2], [2, 1, 0]).copy()
    positions[(residual < 0).T] = np.nan
    time = (int(found["first_frame"]) + np.arange(frames)) / rate
    unit = str(found["units"][0]) if found["units"].size else ""
    return checked_table(file, time, names, positions, unit)


def _each_once(names: list[str]) -> list[str]:
    """Return names of which none is there twice: later ones get a number.

    Laboratories leave points that they did not label, or labelled twice, in the file.

    >>> _each_once(["A", "B", "A", "A_2", "A"])
    ['A', 'B', 'A_3', 'A_2', 'A_4']
    """
    taken, found = set(names), list[str]()
    for name in names:
        new, number = name, 1
        while new in found or (number > 1 and new in taken):
            number += 1
            new = f"{name}_{number}"
        found.append(new)
    return found


def _read_in_a_child(file: Path, size: int) -> dict[str, Array]:
    """Return the arrays of a file, read by a separate process within limits."""
    memory = MEMORY_BYTES + MEMORY_PER_BYTE * size
    cpu = CPU_SECONDS + size // BYTES_PER_CPU_SECOND
    command = [sys.executable, "-P", str(CHILD), str(file.absolute()), str(memory), str(cpu)]
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            # Each thread of a linear algebra library reserves address space; none is needed.
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
            timeout=SECONDS + size // BYTES_PER_CPU_SECOND,
            check=True,
        )
        with np.load(io.BytesIO(done.stdout), allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except (subprocess.SubprocessError, zipfile.BadZipFile, ValueError, EOFError):
        raise ExchangeError(
            f"{file}: is damaged and cannot be read as C3D; copy it or export it again"
        ) from None


def write_c3d(table: MarkerTable, path: Path) -> None:
    """Write a table as C3D with an even rate; missing markers get residual −1.

    Raises
    ------
    ExchangeError
        If intervals differ by more than 1 %, since C3D holds only a rate, or a name is too long.
    """
    import ezc3d

    for name in table.names:
        if not name.strip() or name.strip() != name or len(name.encode()) > LONGEST_LABEL:
            raise ExchangeError(
                f"{path}: C3D cannot hold a marker called {quoted(name)}: rename the marker"
            )

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
