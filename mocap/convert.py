"""A video with a marker file becomes tracks, rigid motions, tables and an overlay."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.settings import setting
from mocap.formats.boundary import write_boundary_conditions
from mocap.formats.c3d import write_c3d
from mocap.formats.exchange import motion_table, read_positions, tracks_from
from mocap.formats.trc import write_trc
from mocap.measurement import Measurement, measure
from mocap.motion.motion import Motion
from mocap.motion.scale import Picture
from mocap.tracking.follow import follow
from mocap.tracking.markers import MarkerFile, read_markers
from mocap.tracking.noise import with_noise_in_time
from mocap.tracking.tracks import Tracks, read_tracks
from mocap.video.frames import Video
from mocap.views.overlay import write_overlay
from mocap.views.summary import summary, write_summary

# Called with what is being done, how much of it is done and how much there is (0: not known).
Progress = Callable[[str, int, int], None]

MARK_OF_A_RESULT = "summary.json"


class OutputError(DrinksimError):
    """A folder that results cannot be written to."""


@dataclass(frozen=True)
class ConvertOptions:
    """What can be chosen for a conversion besides the files."""

    start_s: float | None = setting(
        default=None, unit="s", description="first used instant, on the video's own clock"
    )
    end_s: float | None = setting(
        default=None, unit="s", description="last used instant, on the video's own clock"
    )
    tracks: Path | None = setting(
        default=None,
        description="a tracks.csv corrected by hand: rows 'fixed' and 'seen' are kept, rows "
        "'predicted' are bridged, missing and 'lost' ones are tracked anew",
    )
    fps: float | None = setting(
        default=None,
        unit="frames/s",
        description="rate at which the camera captured, for slow motion",
    )


@dataclass(frozen=True)
class ConvertResult:
    """What a conversion found; ``out`` is the folder that holds it.

    ``motion`` is the motion as its file holds it, ``measured`` all that it rests on.
    """

    out: Path
    motion: Motion
    measured: Measurement
    summary: dict[str, Any]

    @property
    def tracks(self) -> Tracks:
        """The tracks of all markers."""
        return self.measured.tracks


def convert(
    video: Path | str,
    markers: Path | str,
    out: Path | str,
    *,
    start_s: float | None = None,
    end_s: float | None = None,
    tracks: Path | str | None = None,
    fps: float | None = None,
    progress: Progress | None = None,
) -> ConvertResult:
    """Track the markers of a video and write their rigid motions to a folder.

    Parameters
    ----------
    video, markers, out
        The recording, its marker file, and the folder to write; a former result there is replaced.
    start_s, end_s, tracks, fps
        As in :class:`ConvertOptions`.
    progress
        Told what is being done and how far it is.

    Raises
    ------
    ValueError
        If an input cannot be used (VideoError, MarkerFileError, TrackingError, ScaleError,
        MotionError, TracksError) or the folder cannot be written (OutputError). Nothing is left
        behind then.
    """
    say = progress or (lambda _what, _done, _total: None)
    folder = Path(out)
    _check_replaceable(folder)
    marker_file = read_markers(markers)
    given = given_tracks(tracks) if tracks is not None else None
    film = Video(video, fps=fps)
    raw = follow(film, marker_file, start_s=start_s, end_s=end_s, given=given, progress=say)
    timing = film.timing
    picture = Picture(film.info.width, film.info.height, film.info.pixel_aspect)
    tracks_found = with_noise_in_time(raw, key_frames=film.key_frames).bridged()
    measured = measure(tracks_found, marker_file, picture)
    report = summary(film.info, timing, marker_file, measured, picture)
    with _NewFolder(folder) as partial:
        measured.tracks.write(partial / "tracks.csv")
        measured.motion.write(partial / "motion.csv")
        measured.motion.plot().savefig(partial / "motion.png", dpi=110)
        tables = partial / "boundary_conditions"
        write_boundary_conditions(measured.motion, tables)
        write_motion_files(measured.motion, marker_file, tables)
        write_overlay(
            Video(video, fps=fps),
            measured.tracks,
            measured.capture,
            marker_file,
            partial / "overlay.mp4",
            progress=lambda done: say("drawing the overlay", done, timing.frames),
        )
        write_summary(report, partial / MARK_OF_A_RESULT)
    return ConvertResult(folder, measured.motion.rounded(), measured, report)


def given_tracks(path: Path | str) -> Tracks:
    """Return tracks to start from: a ``tracks.csv``, or picture positions of another program.

    Tracker's positions are taken to count from a pixel's corner, all others from its centre.

    Raises
    ------
    TracksError, ExchangeError
        If the file is broken or holds lengths instead of pixels.
    """
    file = Path(path)
    if file.suffix.lower() == ".csv" and file.is_file():
        with file.open(encoding="utf-8-sig", errors="replace") as handle:
            header = handle.readline()
        foreign = header.lower().startswith("scorer") or "time (" in header.lower()
        if not foreign:
            return read_tracks(file)
    elif not file.is_file():
        return read_tracks(file)
    found = tracks_from(read_positions(file), corner_origin=file.suffix.lower() == ".txt")
    # Other programs count time in their own ways: frames are what is trusted.
    return replace(found, time_s=np.full_like(found.time_s, np.nan))


def write_motion_files(motion: Motion, markers: MarkerFile, folder: Path) -> None:
    """Write the motion as TRC and, where its frames are even in time, as C3D."""
    table = motion_table(motion, markers)
    write_trc(table, folder / "motion.trc")
    if table.even:
        write_c3d(table, folder / "motion.c3d")


def option_names() -> list[str]:
    """Return the names of all options, for whoever derives flags from them."""
    return [option.name for option in fields(ConvertOptions)]


def _check_replaceable(folder: Path) -> None:
    """Refuse a folder that holds something else than a former result."""
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"--out {folder}: is a file; name a folder")
    if folder.exists() and any(folder.iterdir()) and not (folder / MARK_OF_A_RESULT).exists():
        raise OutputError(
            f"--out {folder}: holds files that are no former result; name a new folder"
        )
    parent = next(p for p in (folder, *folder.absolute().parents) if p.exists())
    if not os.access(parent, os.W_OK):
        raise OutputError(f"--out {folder}: {parent} cannot be written to; name another folder")


class _NewFolder:
    """A folder that takes its final name only when everything in it is complete."""

    def __init__(self, final: Path) -> None:
        self.final = final.absolute()
        self.partial = self.final.parent / f".{self.final.name}.partial-{os.getpid()}"

    def __enter__(self) -> Path:
        try:
            self.final.parent.mkdir(parents=True, exist_ok=True)
            shutil.rmtree(self.partial, ignore_errors=True)
            self.partial.mkdir()
        except OSError as error:
            raise OutputError(
                f"--out {self.final}: cannot be written ({error.strerror}); name another folder"
            ) from None
        return self.partial

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            shutil.rmtree(self.partial, ignore_errors=True)
            return
        former = self.final.parent / f".{self.final.name}.former-{os.getpid()}"
        if self.final.exists():
            self.final.rename(former)
        self.partial.rename(self.final)
        shutil.rmtree(former, ignore_errors=True)
