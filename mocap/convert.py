"""Conversion of a video and its marker file to tracks, scales and rigid motions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from geometry2d.foundation.delimited import header_line
from geometry2d.foundation.output import (
    RESULT_MARK,
    check_replaceable,
    directory_at_once,
    file_at_once,
)
from geometry2d.foundation.progress import ProgressOption, chosen_progress, part_of
from geometry2d.foundation.settings import setting
from mocap.formats.boundary import write_boundary_conditions
from mocap.formats.c3d import write_c3d
from mocap.formats.exchange import motion_table, read_positions, tracks_from
from mocap.formats.marker_table import ExchangeError, text_of
from mocap.formats.trc import write_trc
from mocap.measurement import Measurement, measure
from mocap.motion.motion import Motion
from mocap.motion.out_of_plane_file import write_out_of_plane
from mocap.motion.projection import PictureFormat
from mocap.motion.scale import BodyScale
from mocap.plausible import distance_warnings, refuse_implausible, refuse_impossible_lens
from mocap.tracking.errors import UnnamedSpotsError
from mocap.tracking.follow import follow, stickers_in
from mocap.tracking.marker_file import read_markers
from mocap.tracking.markers import MarkerFile, markers_of_stickers
from mocap.tracking.noise import with_temporal_noise
from mocap.tracking.tracks import Tracks, placed_by_time, read_tracks
from mocap.video.frames import Video
from mocap.views.overlay import write_overlay
from mocap.views.spots import write_numbered_spots
from mocap.views.summary import summary, write_summary

SPOTS = "spots.png"
"""Picture of the spots that were found where it is not sure which marker each is."""

TRACKING_SHARE = 0.7
"""Share of the time that tracking takes if files are written too."""


@dataclass(frozen=True)
class ConvertOptions:
    """Options of a conversion."""

    start_s: float | None = setting(
        default=None, unit="s", description="first used instant, on the video's own clock"
    )
    end_s: float | None = setting(
        default=None, unit="s", description="last used instant, on the video's own clock"
    )
    tracks: Path | None = setting(
        default=None,
        description="a tracks.csv corrected by hand: rows 'fixed' and 'seen' are kept, rows "
        "'predicted' are interpolated, missing and 'lost' ones are tracked again",
    )
    fps: float | None = setting(
        default=None,
        unit="frames/s",
        description="capture rate of the camera, for slow motion",
    )


@dataclass(frozen=True, repr=False)
class ConvertResult:
    """Result of a conversion, in memory; :func:`write_conversion` writes it.

    Attributes
    ----------
    motion
        Motion of head and package with standard errors, rounded as in ``motion.csv``.
    measured
        Tracks, scales, and the motion before rounding.
    summary
        Contents of ``summary.json``.
    video, fps, markers
        The recording, the given capture rate, if any, and the marker file.
    """

    motion: Motion
    measured: Measurement
    summary: dict[str, Any]
    video: Path
    fps: float | None
    markers: MarkerFile

    @property
    def tracks(self) -> Tracks:
        """Tracks of all markers."""
        return self.measured.tracks

    @property
    def scales(self) -> dict[str, BodyScale]:
        """Scale of each body, by name."""
        return self.measured.scales

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the recording and the measurement, one sentence each."""
        return tuple(self.summary["warnings"])

    def __repr__(self) -> str:
        warnings = f"{len(self.warnings)} warnings"
        return f"ConvertResult({self.video.name}, {len(self.tracks.names)} markers, {warnings})"


def convert(
    video: Path | str,
    markers: Path | str | None = None,
    *,
    out: Path | str | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    tracks: Path | str | None = None,
    fps: float | None = None,
    progress: ProgressOption = None,
) -> ConvertResult:
    """Track the markers of a video and return their rigid motions.

    Parameters
    ----------
    video, markers
        The recording and its marker file; without one, the coded stickers seen in the film are
        the markers.
    out
        A directory to write with :func:`write_conversion`; None writes nothing.
    start_s, end_s, tracks, fps
        As in :class:`ConvertOptions`.
    progress
        True shows a line on the terminal or in the notebook; a function is called with the share
        that is done and what is being done.

    Raises
    ------
    DrinksimError
        If an input cannot be used (VideoError, MarkerFileError, TrackingError, ScaleError,
        MotionError, TracksError) or ``out`` cannot be written (OutputError). Nothing is left
        behind then, but a picture with numbered spots if it is not sure which marker each is.
    """
    if out is not None:
        check_replaceable(Path(out))
    with chosen_progress(progress, "convert") as show:
        last = 1.0 if out is None else TRACKING_SHARE
        if markers is not None:
            marker_file = read_markers(markers)
        else:
            seen = stickers_in(Video(video, fps=fps), start_s=start_s, end_s=end_s)
            marker_file = markers_of_stickers(seen)
        given = given_tracks(tracks, Video(video, fps=fps)) if tracks is not None else None
        film = Video(video, fps=fps)
        picture = PictureFormat(film.info.width, film.info.height, film.info.pixel_aspect)
        refuse_impossible_lens(marker_file, picture)
        try:
            raw = follow(
                film,
                marker_file,
                start_s=start_s,
                end_s=end_s,
                given=given,
                progress=part_of(show, 0.0, last),
            )
        except UnnamedSpotsError as error:
            if out is None or not error.places_px:
                raise
            raise _pictured(error, Video(video, fps=fps), Path(out)) from None
        tracks_found = with_temporal_noise(
            raw, bodies=marker_file.rigid_bodies, key_frames=film.key_frames
        ).interpolated()
        measured = measure(tracks_found, marker_file, picture)
        refuse_implausible(measured, marker_file)
        report = summary(film.info, film.timing, marker_file, measured, picture)
        report["warnings"] += distance_warnings(measured, marker_file)
        motion = measured.motion.rounded()
        result = ConvertResult(motion, measured, report, Path(video), fps, marker_file)
        if out is not None:
            write_conversion(result, out, progress=part_of(show, last, 1.0))
    return result


def _pictured(error: UnnamedSpotsError, video: Video, out: Path) -> UnnamedSpotsError:
    """Write the numbered spots into ``out``, and return the error that says where they are."""
    frame = next(frame for frame in video.frames() if frame.index == error.frame)
    if out.is_dir():
        # Beside an earlier result, which stays.
        with file_at_once(out / SPOTS) as file:
            write_numbered_spots(frame.colour(), error.places_px, file)
    else:
        with directory_at_once(out) as folder:
            write_numbered_spots(frame.colour(), error.places_px, folder / SPOTS)
    return UnnamedSpotsError(
        f"{error}; {out / SPOTS} shows them: write, for instance, ear = "
        f"[{error.places_px[0][0]:.0f}, {error.places_px[0][1]:.0f}] if the ear is spot 1, or "
        "click on them with 'drinksim mark'",
        frame=error.frame,
        places_px=error.places_px,
    )


def write_conversion(
    result: ConvertResult, out: Path | str, *, progress: ProgressOption = None
) -> None:
    """Write a conversion to a directory; an earlier result there is replaced.

    The files are ``tracks.csv``, ``motion.csv``, ``motion.png``, ``overlay.mp4``, ``summary.json``,
    ``jaw.csv`` if the jaw has two marks, and ``boundary_conditions``: tables, a TRC file and, if
    the frames are evenly spaced in time, a C3D file.

    Raises
    ------
    OutputError
        If the directory holds anything but a result, or cannot be written.
    VideoError
        If the video cannot be read.
    """
    measured, markers = result.measured, result.markers
    with (
        chosen_progress(progress, "write") as show,
        directory_at_once(Path(out)) as folder,
    ):
        measured.tracks.write(folder / "tracks.csv")
        measured.motion.write(folder / "motion.csv")
        measured.motion.plot().savefig(folder / "motion.png", dpi=110)
        tables = folder / "boundary_conditions"
        write_boundary_conditions(measured.motion, tables)
        if measured.capture.out_of_plane:
            write_out_of_plane(measured.capture, folder / "out_of_plane.csv")
        if (jaw := measured.jaw_opening) is not None:
            jaw.write(folder / "jaw.csv")
        table = motion_table(measured.motion, markers)
        write_trc(table, tables / "motion.trc")
        if table.even:
            write_c3d(table, tables / "motion.c3d")
        write_overlay(
            Video(result.video, fps=result.fps),
            measured.tracks,
            measured.capture,
            markers,
            folder / "overlay.mp4",
            progress=show,
        )
        write_summary(result.summary, folder / RESULT_MARK)


def given_tracks(path: Path | str, video: Video | None = None) -> Tracks:
    """Return tracks from a ``tracks.csv`` or from picture positions of another program.

    The positions of the program Tracker count from a pixel's corner, all others from its centre.
    Rows keep the frame that their file names. Where it names times only, ``video`` gives the frames
    that were shown at these.

    Raises
    ------
    TracksError, ExchangeError
        If the file is broken or holds lengths instead of pixels.
    """
    file = Path(path)
    if file.suffix.lower() == ".csv" and file.is_file():
        header = header_line(text_of(file)).lower()
        if "frame_idx" not in header and "scorer" not in header and "time" not in header:
            return read_tracks(file)
        if "marker" in header and "frame" in header:
            return read_tracks(file)
    elif not file.is_file():
        return read_tracks(file)
    table = read_positions(file)
    try:
        found = tracks_from(table, corner_origin=file.suffix.lower() == ".txt")
    except ExchangeError as error:
        raise ExchangeError(f"{file}: {error}") from None
    if table.frame is not None:
        return replace(found, time_s=np.full_like(found.time_s, np.nan))
    if video is None:
        return found
    frames = [(frame.index, frame.time_s) for frame in video.frames()]
    return placed_by_time(
        found, np.array([index for index, _ in frames]), np.array([time for _, time in frames])
    )
