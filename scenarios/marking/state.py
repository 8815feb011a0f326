"""What was said about a film and the tracks that follow from it: a value, and how it changes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.progress import Progress
from mocap.measurement import Measurement, measure
from mocap.tracking.follow import follow, without_frames
from mocap.tracking.noise import with_temporal_noise
from mocap.tracking.retrack import Correction, retrack
from mocap.tracking.tracks import Tracks
from scenarios.marking.film import Film
from scenarios.marking.marking import Marking
from scenarios.marking.pointing import MarkingError


@dataclass(frozen=True, eq=False)
class MarkingState:
    """What was said about a film, and the tracks that follow from it.

    Attributes
    ----------
    marking
        What was said.
    tracks
        The tracks, their dropouts "lost"; None before the film is tracked.
    key_frames
        Frames compressed without reference to others.
    """

    marking: Marking
    tracks: Tracks | None = None
    key_frames: frozenset[int] = frozenset()

    @cached_property
    def shown(self) -> Tracks | None:
        """The tracks with their errors and interpolated dropouts, as ``convert`` has them.

        A spot that was pointed at has the noise of every other one.
        """
        if self.tracks is None:
            return None
        on_spots = replace(
            self.tracks, status=np.where(self._pointed_spots(), "seen", self.tracks.status)
        )
        noisy = with_temporal_noise(
            on_spots, bodies=self.marking.given.rigid_bodies, key_frames=self.key_frames
        )
        return replace(noisy, status=self.tracks.status).interpolated()

    def table(self) -> Tracks:
        """Return the tracks to be written, from which ``convert`` makes those that are shown.

        It adds the noise to what is seen, and leaves alone what was set by hand.
        """
        assert self.tracks is not None
        assert self.shown is not None
        fixed = self.tracks.status == "fixed"
        sigma = np.where(fixed, self.shown.sigma_px, self.tracks.sigma_px)
        return replace(self.tracks, sigma_px=sigma).interpolated()

    def _pointed_spots(self) -> NDArray[np.bool_]:
        """Return (n, m) where a marker was put on a spot."""
        assert self.tracks is not None
        pointed = np.zeros(self.tracks.status.shape, bool)
        for k, name in enumerate(self.tracks.names):
            places = self.marking.placed.get(name, {})
            on_spot = [frame for frame, placed in places.items() if placed.look is not None]
            pointed[:, k] = np.isin(self.tracks.frame, on_spot)
        return np.asarray(pointed & (self.tracks.status == "fixed"))


def tracked(state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    """Return the state with the tracks of all markers through the film.

    Raises
    ------
    MarkingError
        If a marker has no position in the first frame.
    TrackingError, VideoError
        As :func:`mocap.tracking.follow.follow`.
    """
    marking = state.marking
    lacking = marking.lacking()
    if lacking:
        raise MarkingError(
            f"{', '.join(lacking)}: no position yet; go to the first frame and click on it"
        )
    video = film.video()
    found = follow(
        video,
        marking.marker_file(film.path),
        start_s=film.start_s,
        end_s=film.end_s,
        given=by_hand(marking, film),
        progress=progress,
    )
    tracks = _first_spots_seen(without_frames(found, video.timing.distrusted), marking)
    return replace(state, tracks=tracks, key_frames=video.key_frames)


def corrected(
    state: MarkingState, film: Film, correction: Correction, marking: Marking, progress: Progress
) -> MarkingState:
    """Return the state with another marking; what depends on the correction is tracked again."""
    if state.tracks is None:
        return replace(state, marking=marking)
    tracks = retrack(
        film.video(),
        marking.marker_file(film.path),
        state.tracks,
        correction,
        start_s=film.start_s,
        end_s=film.end_s,
        progress=progress,
    )
    return replace(state, marking=marking, tracks=_first_spots_seen(tracks, marking))


def _first_spots_seen(tracks: Tracks, marking: Marking) -> Tracks:
    """Return the tracks; spots named in the first frame are seen, as those of a marker file are."""
    status = tracks.status.copy()
    row = int(np.searchsorted(tracks.frame, marking.first_frame))
    for k, name in enumerate(tracks.names):
        first = marking.placed.get(name, {}).get(marking.first_frame)
        if first is not None and first.look is not None:
            status[row, k] = "seen"
    return replace(tracks, status=status)


def without_track(tracks: Tracks | None, marker: str) -> Tracks | None:
    """Return the tracks without those of one marker."""
    if tracks is None or marker not in tracks.names:
        return tracks
    kept = [k for k, name in enumerate(tracks.names) if name != marker]
    return replace(
        tracks,
        names=tuple(tracks.names[k] for k in kept),
        position_px=tracks.position_px[:, kept],
        sigma_px=tracks.sigma_px[:, kept],
        status=tracks.status[:, kept],
        ellipse=None if tracks.ellipse is None else tracks.ellipse[:, kept],
    )


def by_hand(marking: Marking, film: Film) -> Tracks | None:
    """Return the positions set by hand as a table of tracks; None if there are none."""
    if not any(marking.placed.values()):
        return None
    frames = sorted({frame for places in marking.placed.values() for frame in places})
    names = [name for name in marking.names if name in marking.placed]
    position = np.full((len(frames), len(names), 2), np.nan)
    sigma = np.full((len(frames), len(names)), np.nan)
    status = np.full((len(frames), len(names)), "lost", dtype="<U9")
    time_of = film.time_of()
    for k, name in enumerate(names):
        for frame, placed in marking.placed[name].items():
            row = frames.index(frame)
            position[row, k], sigma[row, k] = placed.at, placed.sigma_px
            status[row, k] = "fixed"
    times = np.array([time_of[frame] for frame in frames])
    return Tracks(np.array(frames, int), times, tuple(names), position, sigma, status)


def measured(state: MarkingState, film: Film) -> Measurement | None:
    """Return scales and motion of a state; None before it is tracked.

    Raises
    ------
    DrinksimError
        If the tracks give no scale, or no motion.
    """
    if state.shown is None or state.marking.needs_length() is not None:
        return None
    return measure(state.shown, state.marking.marker_file(film.path), film.format)


def opened_state(film: Film, marking: Marking, tracks: Tracks | None) -> MarkingState:
    """Return the state of a marking that was saved earlier, with its tracks."""
    if tracks is None:
        return MarkingState(marking, key_frames=film.key_frames)
    position = np.where((tracks.status == "predicted")[..., None], math.nan, tracks.position_px)
    status = np.where(tracks.status == "predicted", "lost", tracks.status)
    sigma = np.where(tracks.status == "predicted", math.nan, tracks.sigma_px)
    raw = replace(tracks, position_px=position, status=status, sigma_px=sigma)
    return MarkingState(marking, raw, film.key_frames)
