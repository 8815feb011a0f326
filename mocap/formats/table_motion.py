"""Motion of head and package from positions in space that another system measured.

The plane of the sip is spanned by two axes of the file. What happens across it is told, not used.
The noise of the positions is estimated from their variation in time, as that of tracks is; they are
treated like the tracks of a camera that shows `PX_PER_MM`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.output import RESULT_MARK, directory_at_once
from geometry2d.foundation.settings import setting
from geometry2d.foundation.text import quoted
from mocap.formats.boundary import write_boundary_conditions
from mocap.formats.exchange import read_positions
from mocap.formats.marker_table import AXES, ExchangeError, MarkerTable, plane_positions
from mocap.motion.capture import capture
from mocap.motion.motion import Motion
from mocap.motion.perspective import Perspective
from mocap.motion.scale import BodyScale
from mocap.motion.turning import Flattening
from mocap.tracking.markers import unsaid_markers
from mocap.tracking.noise import with_temporal_noise
from mocap.tracking.tracks import Tracks

Array: TypeAlias = NDArray[np.float64]

ENDINGS = (".c3d", ".trc", ".bvh")
"""Files of positions in space."""

PX_PER_MM = 10.0
LEAST_SIGMA_MM = 1e-3
"""Standard error of a position whose noise is not seen."""

FLAT_SHARE = 0.1
"""A package that moves across the plane by more than this share of its way in it is told."""


@dataclass(frozen=True)
class PositionOptions:
    """How positions in space become a motion in a plane."""

    head: str = setting(
        default="ear,nose",
        description="for .c3d, .trc, .bvh: the head's markers, the first one its origin",
    )
    package: str = setting(
        default="package_lower,package_upper", description="likewise, the package's markers"
    )
    right: str = setting(
        default="X", description="likewise, axis of the file that points right, e.g. --right=-Z"
    )
    up: str = setting(default="Y", description="likewise, axis of the file that points up")
    unit: str | None = setting(
        default=None, description="likewise, unit of the file if it states none: mm, cm or m"
    )


@dataclass(frozen=True)
class MotionInSpace:
    """A motion in the plane, and what its reader must know."""

    motion: Motion
    warnings: tuple[str, ...]


def convert_positions(
    path: Path | str,
    options: PositionOptions,
    *,
    out: Path | str | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> MotionInSpace:
    """Return the motion of head and package in a C3D, TRC or BVH file.

    Parameters
    ----------
    path
        The file.
    options
        Markers of both bodies, and the plane.
    out
        A directory to write ``motion.csv``, ``motion.png`` and the tables into; None: nothing.
    start_s, end_s
        First and last used time of the file, s.

    Raises
    ------
    ExchangeError
        If the file is broken, lacks a marker, or its unit is not known.
    MotionError
        If the positions give no motion.
    OutputError
        If ``out`` cannot be written.
    """
    file = Path(path)
    table = read_positions(file)
    if options.unit is not None:
        table = replace(table, unit=options.unit)
    try:
        found = motion_in_plane(_between(table, start_s, end_s), options)
    except ExchangeError as error:
        raise ExchangeError(f"{file}: {error}") from None
    if out is not None:
        with directory_at_once(Path(out)) as folder:
            found.motion.write(folder / "motion.csv")
            found.motion.plot().savefig(folder / "motion.png", dpi=110)
            write_boundary_conditions(found.motion, folder / "boundary_conditions")
            (folder / RESULT_MARK).write_text("{}\n", encoding="utf-8")
    return found


def motion_in_plane(table: MarkerTable, options: PositionOptions) -> MotionInSpace:
    """Return the motion of head and package in the plane of two axes of a table.

    Raises
    ------
    ExchangeError
        If a marker is missing, the axes span no plane, or the unit is no length.
    MotionError
        If there is no interval in which both bodies are known.
    """
    bodies = {"head": _names(options.head), "package": _names(options.package)}
    names = [name for members in bodies.values() for name in members]
    columns = [_column(table, name) for name in names]
    if options.right.lstrip("+-").upper() == options.up.lstrip("+-").upper():
        raise ExchangeError(f"--right {options.right} and --up {options.up} are one axis")
    world = plane_positions(table, right=options.right, up=options.up)[:, columns]
    lower = len(bodies["head"])
    ahead = np.nanmedian(world[:, lower, 0] - world[:, 0, 0])
    warnings = []
    if ahead < 0:
        world = world * [-1.0, 1.0]
        warnings.append(
            "the person faces left: left and right are exchanged in the motion, so that x points "
            "to where the face looks"
        )
    tracks = with_temporal_noise(
        _tracks(table, names, world), bodies=bodies.values()
    ).interpolated()
    ones = np.ones(tracks.frame.size)
    scales = {
        body: BodyScale(ones, 0.0, body, 0.0, (), (), Flattening(np.nan, np.nan)) for body in bodies
    }
    known = tracks.position_px / PX_PER_MM * [1.0, -1.0]
    in_mm = replace(tracks, sigma_px=tracks.sigma_px / PX_PER_MM)
    motion = capture(
        in_mm, unsaid_markers("positions", bodies), known, scales, {}, Perspective({})
    ).motion
    warnings += _across(table.in_mm(), options, columns[0], columns[lower])
    return MotionInSpace(replace(motion.rounded(), picture=None), tuple(warnings))


def _between(table: MarkerTable, start_s: float | None, end_s: float | None) -> MarkerTable:
    start = -np.inf if start_s is None else start_s
    end = np.inf if end_s is None else end_s
    used = (table.time_s >= start - 1e-9) & (table.time_s <= end + 1e-9)
    if used.sum() < 2:
        raise ExchangeError(
            f"it runs from {table.time_s[0]:g} to {table.time_s[-1]:g} s: widen --start and --end"
        )
    return replace(table, time_s=table.time_s[used], positions=table.positions[used])


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


def _column(table: MarkerTable, name: str) -> int:
    if name not in table.names:
        listed = ", ".join(table.names[:12]) + (", …" if len(table.names) > 12 else "")
        raise ExchangeError(f"has no marker {quoted(name)}; name those of --head and --package "
                            f"among {listed}")  # fmt: skip
    return table.names.index(name)


def _tracks(table: MarkerTable, names: Sequence[str], world: Array) -> Tracks:
    """Return positions (n, m, 2), mm, y up, as the tracks of a camera."""
    known = np.asarray(np.isfinite(world).all(axis=2))
    return Tracks(
        frame=np.arange(table.time_s.size),
        time_s=table.time_s,
        names=tuple(names),
        position_px=np.where(known[..., None], world * [PX_PER_MM, -PX_PER_MM], np.nan),
        sigma_px=np.where(known, PX_PER_MM * LEAST_SIGMA_MM, np.nan),
        status=np.where(known, "seen", "lost").astype("<U9"),
    )


def _across(table: MarkerTable, options: PositionOptions, head: int, package: int) -> list[str]:
    """Return a warning if the package moves across the plane as seen from the head."""
    used = {AXES[axis.lstrip("+-").upper()] for axis in (options.right, options.up)}
    (across,) = set(AXES.values()) - used
    way = table.positions[:, package] - table.positions[:, head]
    way = way[np.isfinite(way).all(axis=1)]
    ranges = np.ptp(way, axis=0)
    in_plane = float(np.hypot(*ranges[sorted(used)]))
    if ranges[across] <= FLAT_SHARE * in_plane:
        return []
    letter = "XYZ"[across]
    return [
        f"the package moves by {ranges[across]:.0f} mm along {letter}, across the plane of the sip "
        f"({in_plane:.0f} mm in it): that is left out; look at --right and --up"
    ]
