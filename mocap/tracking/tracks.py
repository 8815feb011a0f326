"""Tracks: position, standard error and status of each marker in each frame."""

from __future__ import annotations

import csv
import itertools
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.delimited import NamedTable, read_named_table, safe_cell
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.text import quoted
from mocap.stickers.follow import StickerTracks

Array: TypeAlias = NDArray[np.float64]

COLUMNS = ("frame", "time_s", "marker", "x_px", "y_px", "sigma_px", "status")
STATUSES = ("seen", "predicted", "lost", "fixed")

MOST_FRAMES = 10**9
LARGEST_PX = 1e6
"""Bounds of a frame's number and of a place in a picture."""

PLACE_TOLERANCE, ROUNDED_S = 0.25, 1e-3
"""A row belongs to a frame if its time is so near: a share of the interval, and rounding."""

MOST_CELLS = 2_000_000
"""Frames times markers of a table; one with more rows than that may have as many."""

LONGEST_BRIDGE_S = 1.0
"""Dropouts up to this length are interpolated, s."""


class TracksError(DrinksimError):
    """A table of tracks that cannot be used."""


@dataclass(frozen=True)
class Tracks:
    """Positions of markers over the frames of a clip.

    Parameters
    ----------
    frame, time_s
        (n,) number in the file and time (s) of each frame, increasing.
    names
        The m markers.
    position_px, sigma_px
        (n, m, 2) positions and (n, m) standard error of a coordinate, px; nan if lost.
    status
        (n, m): "seen", "predicted" (interpolated), "lost", or "fixed" (set by hand).
    ellipse
        (n, m, 3) entries xx, xy, yy of the symmetric matrix G, 1/px, of each fit: |G (x − c)| = 1
        is the edge of the marker. nan where there is no fit; None for tracks from a file.
    stickers
        Corners of the coded stickers among the markers, if there are any.
    """

    frame: NDArray[np.int_]
    time_s: Array
    names: tuple[str, ...]
    position_px: Array
    sigma_px: Array
    status: NDArray[np.str_]
    ellipse: Array | None = None
    stickers: StickerTracks | None = None

    def of(self, name: str) -> tuple[Array, Array]:
        """Return position (n, 2) and standard error (n,) of one marker, px."""
        k = self.names.index(name)
        return self.position_px[:, k], self.sigma_px[:, k]

    def known(self, name: str) -> NDArray[np.bool_]:
        """Return (n,) whether a marker's position was measured or set by hand."""
        status = self.status[:, self.names.index(name)]
        known: NDArray[np.bool_] = (status == "seen") | (status == "fixed")
        return known

    def interpolated(
        self, *, longest_s: float = LONGEST_BRIDGE_S, acceleration_px: float | None = None
    ) -> Tracks:
        """Return the tracks with their dropouts interpolated by cubic curves.

        The standard error of an interpolated point is that of a motion with random acceleration
        that is known at both ends of the dropout.

        Parameters
        ----------
        longest_s
            Dropouts longer than this, s, stay empty.
        acceleration_px
            Standard deviation of the acceleration, px/s²; None: estimated from each track.
        """
        position, sigma = self.position_px.copy(), self.sigma_px.copy()
        status = self.status.copy()
        for k, name in enumerate(self.names):
            known = self.known(name)
            acceleration = acceleration_px or _usual_acceleration(
                self.time_s[known], position[known, k]
            )
            for first, last in _dropouts(known):
                if self.time_s[last] - self.time_s[first] > longest_s:
                    continue
                inside = np.arange(first + 1, last)
                points, spread = _interpolation(
                    self.time_s, position[:, k], sigma[:, k], (first, last), known, acceleration
                )
                position[inside, k], sigma[inside, k] = points, spread
                status[inside, k] = "predicted"
        return replace(self, position_px=position, sigma_px=sigma, status=status)

    def write(self, path: Path) -> None:
        """Write ``tracks.csv``, one row per marker per frame."""
        with path.open("w", newline="", encoding="utf-8") as handle:
            writer = csv.writer(handle, lineterminator="\n")
            writer.writerow(COLUMNS)
            for i, (frame, time) in enumerate(zip(self.frame, self.time_s, strict=True)):
                for k, name in enumerate(self.names):
                    x, y = self.position_px[i, k]
                    numbers = ("", "", "")
                    if math.isfinite(x):
                        numbers = (f"{x:.4f}", f"{y:.4f}", f"{self.sigma_px[i, k]:.4f}")
                    cells = [frame, f"{time:.6f}", safe_cell(name), *numbers, self.status[i, k]]
                    writer.writerow(cells)


def read_tracks(path: Path | str) -> Tracks:
    """Return the tracks in a ``tracks.csv``; rows may be missing, but none may be there twice.

    Cells may be separated by commas, semicolons or tabs (:mod:`geometry2d.foundation.delimited`).

    Raises
    ------
    TracksError
        Naming the file, the line, the value and the remedy.
    """
    file = Path(path)
    table = read_named_table(file, COLUMNS, what="table of tracks", error=TracksError)
    frames = _frame_numbers(table)
    times = table.numbers("time_s").tolist()
    position, sigma = _places(table)
    names: dict[str, int] = {}
    time_of: dict[int, float] = {}
    cell_of: dict[tuple[int, str], int] = {}
    rows = zip(table.rows, frames, times, table.texts("marker"), table.texts("status"), strict=True)
    for k, (row, frame, time, marker, status) in enumerate(rows):
        where = f"{file} line {row.line}"
        if not marker:
            raise TracksError(f"{where}: has no marker name; write one")
        if status not in STATUSES:
            raise TracksError(
                f"{where}: status {quoted(status)} is none of {', '.join(STATUSES)}; write one"
            )
        if (frame, marker) in cell_of:
            raise TracksError(
                f"{where}: frame {frame} of {quoted(marker)} is there twice; remove one row"
            )
        if time_of.setdefault(frame, time) != time:
            raise TracksError(
                f"{where}: frame {frame} has times {time_of[frame]} and {time} s; write one time"
            )
        if status != "lost" and not np.isfinite(position[k]).all():
            raise TracksError(f"{where}: is {status!r} without a position; write it or 'lost'")
        names.setdefault(marker, len(names))
        cell_of[frame, marker] = k
    if len(time_of) * len(names) > max(MOST_CELLS, len(table.rows)):
        raise TracksError(
            f"{file}: {len(table.rows)} rows name {len(names)} markers in {len(time_of)} frames, "
            "most of them once; a marker has the same name in every frame"
        )
    return _tracks(file, table, position, sigma, names, time_of, cell_of)


def placed_by_time(given: Tracks, frames: NDArray[np.int_], times_s: Array) -> Tracks:
    """Return tracks whose rows have the frames of a video that were shown at their times.

    Parameters
    ----------
    given
        Tracks with times, s, on the video's clock.
    frames, times_s
        (n,) numbers and times, s, of the video's frames.

    Raises
    ------
    TracksError
        If a row lies between two frames, or two rows belong to one frame.
    """
    nearest = np.abs(given.time_s[:, None] - times_s[None, :]).argmin(axis=1)
    away = np.abs(given.time_s - times_s[nearest])
    interval = float(np.median(np.diff(times_s))) if times_s.size > 1 else 0.0
    limit = PLACE_TOLERANCE * interval + ROUNDED_S
    if np.any(away > limit):
        row = int(np.argmax(away > limit))
        raise TracksError(
            f"--tracks: its row at {given.time_s[row]:g} s belongs to no frame of the video; the "
            f"nearest, {frames[nearest[row]]}, is at {times_s[nearest[row]]:g} s: its clock, its "
            "rate or the clip is another one"
        )
    doubled = np.flatnonzero(np.diff(nearest) == 0)
    if doubled.size:
        row = int(doubled[0])
        raise TracksError(
            f"--tracks: two rows, at {given.time_s[row]:g} and {given.time_s[row + 1]:g} s, belong "
            f"to frame {frames[nearest[row]]} of the video: its rate is another one"
        )
    return replace(given, frame=frames[nearest], time_s=times_s[nearest])


def _tracks(
    file: Path,
    table: NamedTable,
    positions: Array,
    sigmas: Array,
    names: dict[str, int],
    time_of: dict[int, float],
    cell_of: dict[tuple[int, str], int],
) -> Tracks:
    """Return the rows of a file as a table of frames and markers."""
    frames = sorted(time_of)
    time_s = np.array([time_of[frame] for frame in frames])
    if np.any(np.diff(time_s) <= 0):
        k = int(np.argmax(np.diff(time_s) <= 0))
        raise TracksError(
            f"{file}: frame {frames[k + 1]} ({time_s[k + 1]} s) is not later than frame "
            f"{frames[k]} ({time_s[k]} s); mend the times"
        )
    position = np.full((len(frames), len(names), 2), np.nan)
    sigma = np.full((len(frames), len(names)), np.nan)
    status = np.full((len(frames), len(names)), "lost", dtype="<U9")
    row_of = {frame: i for i, frame in enumerate(frames)}
    states = table.texts("status")
    for (frame, marker), row in cell_of.items():
        i, k = row_of[frame], names[marker]
        if states[row] != "lost":
            position[i, k], sigma[i, k] = positions[row], sigmas[row]
        status[i, k] = states[row]
    return Tracks(np.array(frames), time_s, tuple(names), position, sigma, status)


def _frame_numbers(table: NamedTable) -> list[int]:
    """Return the number of the frame of each row."""
    numbers = table.numbers("frame")
    wrong = (numbers != np.floor(numbers)) | (numbers < 0) | (numbers > MOST_FRAMES)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise TracksError(
            f"{table.file} line {table.rows[at].line}: frame = "
            f"{quoted(table.texts('frame')[at])} is not a frame number; write 0, 1, 2, …"
        )
    return [int(number) for number in numbers]


def _places(table: NamedTable) -> tuple[Array, Array]:
    """Return position (n, 2) and standard error (n,) of each row, px; nan where cells are empty."""
    x, y, sigma = (table.numbers(name, blank=True) for name in ("x_px", "y_px", "sigma_px"))
    for name, values, least in (("x_px", x, -LARGEST_PX), ("y_px", y, -LARGEST_PX),
                                ("sigma_px", sigma, 0.0)):  # fmt: skip
        wrong = (values < least) | (values > LARGEST_PX)
        if wrong.any():
            at = int(np.argmax(wrong))
            problem = "negative" if name == "sigma_px" and values[at] < 0 else "off every picture"
            raise TracksError(
                f"{table.file} line {table.rows[at].line}: {name} = {values[at]:g} is {problem}; "
                "write it in px"
            )
    return np.column_stack([x, y]), sigma


def _dropouts(known: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the indices of the last known sample before and the first one after each dropout."""
    at = np.flatnonzero(known)
    return [(int(a), int(b)) for a, b in itertools.pairwise(at) if b - a > 1]


def _usual_acceleration(time: Array, position: Array) -> float:
    """Return the 90th percentile of a track's acceleration, px/s², from its second differences."""
    if time.size < 4:
        return 1000.0
    velocity = np.diff(position, axis=0) / np.diff(time)[:, None]
    change = np.diff(velocity, axis=0) / (0.5 * (time[2:] - time[:-2]))[:, None]
    return float(max(np.percentile(np.abs(change), 90), 20.0))


def _interpolation(
    time: Array,
    position: Array,
    sigma: Array,
    dropout: tuple[int, int],
    known: NDArray[np.bool_],
    acceleration: float,
) -> tuple[Array, Array]:
    """Return positions and standard errors inside a dropout by cubic Hermite interpolation.

    End velocities come from up to three known samples on each side. The error is that of random
    acceleration with both ends known; it is largest in the middle of the dropout.
    """
    first, last = dropout
    ends = []
    for at, step in ((first, -1), (last, 1)):
        near = [at + step * k for k in range(3)]
        use = [k for k in near if 0 <= k < known.size and known[k]]
        if len(use) < 2:
            slope = (position[last] - position[first]) / (time[last] - time[first])
        else:
            slope = np.polyfit(time[use] - time[at], position[use], 1)[0]
        ends.append(slope)
    length = time[last] - time[first]
    inside = np.arange(first + 1, last)
    s = ((time[inside] - time[first]) / length)[:, None]
    points = (
        (1 + 2 * s) * (1 - s) ** 2 * position[first]
        + s * (1 - s) ** 2 * length * ends[0]
        + s**2 * (3 - 2 * s) * position[last]
        + s**2 * (s - 1) * length * ends[1]
    )
    edge = np.hypot(sigma[first], sigma[last]) / math.sqrt(2)
    spread = np.sqrt(edge**2 + (acceleration * (length * s[:, 0] * (1 - s[:, 0])) ** 2) ** 2)
    return points, spread
