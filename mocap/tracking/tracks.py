"""Tracks: where each marker was in each frame, with its standard error and how that is known."""

from __future__ import annotations

import csv
import itertools
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError

Array: TypeAlias = NDArray[np.float64]

COLUMNS = ("frame", "time_s", "marker", "x_px", "y_px", "sigma_px", "status")
STATUSES = ("seen", "predicted", "lost", "fixed")


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
        (n, m, 2) and (n, m): where each is and the standard error of a coordinate; nan if lost.
    status
        (n, m): "seen", "predicted" (bridged), "lost", or "fixed" (set by hand).
    ellipse
        (n, m, 3) entries xx, xy, yy of the symmetric G whose |G (x − c)| = 1 is the edge of a
        marker that was fitted, 1/px, nan elsewhere; None where no picture was seen, as in a file.
    """

    frame: NDArray[np.int_]
    time_s: Array
    names: tuple[str, ...]
    position_px: Array
    sigma_px: Array
    status: NDArray[np.str_]
    ellipse: Array | None = None

    def of(self, name: str) -> tuple[Array, Array]:
        """Return position (n, 2) and standard error (n,) of one marker, px."""
        k = self.names.index(name)
        return self.position_px[:, k], self.sigma_px[:, k]

    def known(self, name: str) -> NDArray[np.bool_]:
        """Return (n,) where a marker's position was measured or set by hand."""
        status = self.status[:, self.names.index(name)]
        known: NDArray[np.bool_] = (status == "seen") | (status == "fixed")
        return known

    def bridged(self, *, longest_s: float = 1.0, acceleration_px: float | None = None) -> Tracks:
        """Return the tracks with gaps between sightings filled by cubic curves.

        The standard error of a bridged point is that of a motion with random acceleration pinned at
        both ends of the gap; gaps longer than ``longest_s`` stay empty. The acceleration (px/s²) is
        estimated from each track unless given.
        """
        position, sigma = self.position_px.copy(), self.sigma_px.copy()
        status = self.status.copy()
        for k, name in enumerate(self.names):
            known = self.known(name)
            acceleration = acceleration_px or _usual_acceleration(
                self.time_s[known], position[known, k]
            )
            for first, last in _gaps(known):
                if self.time_s[last] - self.time_s[first] > longest_s:
                    continue
                inside = np.arange(first + 1, last)
                points, spread = _bridge(
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
                    writer.writerow([frame, f"{time:.6f}", name, *numbers, self.status[i, k]])


def read_tracks(path: Path | str) -> Tracks:
    """Return the tracks in a ``tracks.csv``; rows may be missing, but none may be there twice.

    Raises
    ------
    TracksError
        Naming the file, the line, the value and the remedy.
    """
    file = Path(path)
    cells: dict[tuple[int, str], tuple[float, float, float, str]] = {}
    times: dict[int, float] = {}
    names: list[str] = []
    for line, row in _rows(file):
        where = f"{file} line {line}"
        frame, time, x, y, sigma = _numbers(where, row)
        marker, status = row["marker"].strip(), row["status"].strip()
        if not marker:
            raise TracksError(f"{where}: has no marker name")
        if status not in STATUSES:
            raise TracksError(f"{where}: status {status!r} is none of {', '.join(STATUSES)}")
        if (frame, marker) in cells:
            raise TracksError(f"{where}: frame {frame} of {marker} is there twice; remove one row")
        if times.setdefault(frame, time) != time:
            raise TracksError(f"{where}: frame {frame} has times {times[frame]} and {time} s")
        if status != "lost" and not (math.isfinite(x) and math.isfinite(y)):
            raise TracksError(f"{where}: is {status!r} without a position; write it or 'lost'")
        if marker not in names:
            names.append(marker)
        cells[frame, marker] = (x, y, sigma, status)
    if not cells:
        raise TracksError(f"{file}: holds no rows below its header")
    return _table(file, cells, times, names)


def _table(
    file: Path,
    cells: dict[tuple[int, str], tuple[float, float, float, str]],
    times: dict[int, float],
    names: list[str],
) -> Tracks:
    """Return the rows of a file as a table of frames and markers."""
    frames = sorted(times)
    time_s = np.array([times[frame] for frame in frames])
    if np.any(np.diff(time_s) <= 0):
        k = int(np.argmax(np.diff(time_s) <= 0))
        raise TracksError(
            f"{file}: frame {frames[k + 1]} ({time_s[k + 1]} s) is not later than frame "
            f"{frames[k]} ({time_s[k]} s)"
        )
    position = np.full((len(frames), len(names), 2), np.nan)
    sigma = np.full((len(frames), len(names)), np.nan)
    status = np.full((len(frames), len(names)), "lost", dtype="<U9")
    row_of = {frame: i for i, frame in enumerate(frames)}
    for (frame, marker), (x, y, spread, state) in cells.items():
        i, k = row_of[frame], names.index(marker)
        if state != "lost":
            position[i, k], sigma[i, k] = (x, y), spread
        status[i, k] = state
    return Tracks(np.array(frames), time_s, tuple(names), position, sigma, status)


def _rows(file: Path) -> list[tuple[int, dict[str, str]]]:
    """Return the rows of a CSV file with their line numbers, its header checked."""
    try:
        with file.open(newline="", encoding="utf-8-sig") as handle:
            reader = csv.DictReader(handle)
            header = tuple(reader.fieldnames or ())
            missing = [name for name in COLUMNS if name not in header]
            if missing:
                raise TracksError(
                    f"{file}: its header lacks {', '.join(missing)}; expected {','.join(COLUMNS)}"
                )
            rows = [(reader.line_num, row) for row in reader]
    except FileNotFoundError:
        raise TracksError(f"{file}: no such file of tracks; check the path") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise TracksError(f"{file}: cannot be read as CSV ({error})") from None
    for line, row in rows:
        if None in row.values() or None in row:
            raise TracksError(f"{file} line {line}: has not {len(header)} columns like the header")
    return rows


def _numbers(where: str, row: dict[str, str]) -> tuple[int, float, float, float, float]:
    """Return frame, time, x, y and standard error of a row; empty cells are nan."""
    values = []
    for column in ("frame", "time_s", "x_px", "y_px", "sigma_px"):
        text = row[column].strip()
        optional = column in ("x_px", "y_px", "sigma_px")
        try:
            value = math.nan if optional and not text else float(text)
        except ValueError:
            raise TracksError(f"{where}: {column} = {text!r} is not a number") from None
        if text and not math.isfinite(value):
            raise TracksError(f"{where}: {column} = {text!r} is not a finite number")
        values.append(value)
    if values[0] != int(values[0]) or values[0] < 0:
        raise TracksError(f"{where}: frame = {row['frame']!r} is not a frame number")
    if values[4] < 0:
        raise TracksError(f"{where}: sigma_px = {values[4]} is negative")
    return int(values[0]), values[1], values[2], values[3], values[4]


def _gaps(known: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (last known before, first known after) of every gap between known samples."""
    at = np.flatnonzero(known)
    return [(int(a), int(b)) for a, b in itertools.pairwise(at) if b - a > 1]


def _usual_acceleration(time: Array, position: Array) -> float:
    """Return a large but usual acceleration (px/s²) of a track, from its second differences."""
    if time.size < 4:
        return 1000.0
    velocity = np.diff(position, axis=0) / np.diff(time)[:, None]
    change = np.diff(velocity, axis=0) / (0.5 * (time[2:] - time[:-2]))[:, None]
    return float(max(np.percentile(np.abs(change), 90), 20.0))


def _bridge(
    time: Array,
    position: Array,
    sigma: Array,
    gap: tuple[int, int],
    known: NDArray[np.bool_],
    acceleration: float,
) -> tuple[Array, Array]:
    """Return positions and standard errors inside a gap from cubic Hermite interpolation.

    End velocities come from up to three known samples on each side. The error is that of random
    acceleration with both ends pinned: about acceleration · τ²(T − τ)²/(…T²), largest mid-gap.
    """
    first, last = gap
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
