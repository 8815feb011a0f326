"""Markers of one video: dots from the first used frame on, coded stickers wherever they appear."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from geometry2d.foundation.progress import Progress
from geometry2d.foundation.text import listed
from mocap.stickers.detect import find_stickers
from mocap.stickers.follow import StickerTracker, StickerTracks
from mocap.tracking.detect import Detection, unseen_at
from mocap.tracking.errors import TrackingError
from mocap.tracking.link import Guide, Tracker
from mocap.tracking.locate import fit_near, locate_markers
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import Tracks, TracksError
from mocap.video.frames import Frame, Video

# Standard error (px) of a position set by hand without one.
HAND_SIGMA_PX = 0.5
# Times of a frame in a table and in the video may differ by this (s), for rounding.
TIME_TOLERANCE_S = 1e-3
# Stickers are looked for in every frame of this number when no marker file names them.
LOOK_EVERY = 10


def stickers_in(
    video: Video, *, start_s: float | None = None, end_s: float | None = None
) -> frozenset[str]:
    """Return the markers whose coded stickers are seen in a video."""
    names: set[str] = set()
    for number, frame in enumerate(video.frames(start_s=start_s, end_s=end_s)):
        if number % LOOK_EVERY == 0:
            names |= find_stickers(frame.image).keys()
    return frozenset(names)


def follow(
    video: Video,
    markers: MarkerFile,
    *,
    start_s: float | None = None,
    end_s: float | None = None,
    given: Tracks | None = None,
    progress: Progress | None = None,
) -> Tracks:
    """Return the tracks of all markers through a video; dropouts stay empty.

    Parameters
    ----------
    video
        The recording; frames are decoded once, in order.
    markers
        Names, bodies and rough positions of the markers.
    start_s, end_s
        First and last used instant on the file's own clock, s.
    given
        Tracks corrected by hand. Positions with status "seen" or "fixed" are kept, those with
        "predicted" stay empty, to be interpolated, and all others are tracked.
    progress
        Called with the share of the film that is decoded.

    Raises
    ------
    TrackingError
        If a marker is not found in the first used frame.
    TracksError
        If the given tracks have other markers, frames or times, or positions off the picture.
    VideoError
        If the video cannot be read.
    """
    _check_names(given, markers)
    tracker: Tracker | None = None
    dots = [name for name in markers.names if name not in markers.coded]
    stickers = StickerTracker(tuple(name for name in markers.names if name in markers.coded))
    placed: list[_PlacedByHand] = []
    for frame in video.frames(start_s=start_s, end_s=end_s):
        guides = _guides(given, frame)
        by_hand = {name: guides.pop(name) for name in stickers.names if name in guides}
        placed.append(_PlacedByHand(frame.index, frame.time_s, by_hand))
        if dots:
            if tracker is None:
                tracker = _started(frame, markers, guides)
            tracker.process(frame.index, frame.time_s, frame.picture, guides=guides)
        if stickers.names:
            stickers.process(frame.time_s, frame.image)
        if progress is not None:
            progress(video.share(end_s), "tracking the markers")
    tracks = _together(tracker.tracks() if tracker else None, stickers.tracks(), placed, markers)
    if len(tracks.frame) < 2:
        why = "only one frame is used; a motion needs at least two: widen --start and --end"
        if start_s is None and end_s is None:
            why = "holds a single frame; a motion needs at least two"
        raise TrackingError(f"{video.path}: {why}")
    if given is not None and not np.isin(given.frame, tracks.frame).any():
        raise TracksError(
            f"--tracks: none of its frames ({given.frame[0]} to {given.frame[-1]}) is used "
            f"({tracks.frame[0]} to {tracks.frame[-1]}): it belongs to another video or interval"
        )
    if given is not None:
        _refuse_unplaced(given, tracks, to_the_end=end_s is None)
    return tracks if given is not None else without_frames(tracks, video.timing.distrusted)


def _refuse_unplaced(given: Tracks, tracks: Tracks, *, to_the_end: bool) -> None:
    """Refuse positions in frames that the used interval of the video should have and has not."""
    first, last = int(tracks.frame[0]), int(tracks.frame[-1])
    inside = (given.frame >= first) & ((given.frame <= last) | to_the_end)
    unplaced = given.frame[inside & ~np.isin(given.frame, tracks.frame)]
    if unplaced.size:
        raise TracksError(
            f"--tracks: frame {unplaced[0]} is not in the video, which has frames {first} to "
            f"{last}: the table belongs to another video, or counts its frames in another way"
        )


def _at_hand(frame: Frame, at: tuple[float, float], polarity: str) -> Detection:
    """Return the fit of the spot at a position set by hand; where there is none, one made up.

    Its look is then that of no marker, so that nothing is taken for it before a spot is seen at a
    position set by hand.
    """
    found = fit_near(frame.picture, at, polarity, None)
    if found is not None and math.hypot(found.x - at[0], found.y - at[1]) < found.radius:
        return found
    return unseen_at(at)


@dataclass(frozen=True)
class _PlacedByHand:
    """Number and time of a frame, and the stickers whose centres a table places there."""

    index: int
    time_s: float
    guides: dict[str, Guide]


def _together(
    dots: Tracks | None,
    stickers: StickerTracks,
    placed: list[_PlacedByHand],
    markers: MarkerFile,
) -> Tracks:
    """Return the tracks of dots and stickers in the order of the marker file."""
    n, m = len(placed), len(markers.names)
    position, sigma = np.full((n, m, 2), np.nan), np.full((n, m), np.nan)
    status = np.full((n, m), "lost", dtype="<U9")
    ellipse = np.full((n, m, 3), np.nan)
    for k, name in enumerate(markers.names):
        if name not in stickers.names:
            assert dots is not None and dots.ellipse is not None
            at = dots.names.index(name)
            position[:, k], sigma[:, k] = dots.position_px[:, at], dots.sigma_px[:, at]
            status[:, k], ellipse[:, k] = dots.status[:, at], dots.ellipse[:, at]
            continue
        centre, spread = stickers.centres(name)
        position[:, k], sigma[:, k] = centre, spread
        status[np.isfinite(spread), k] = "seen"
        for row, frame in enumerate(placed):
            guide = frame.guides.get(name)
            if guide is not None and guide.position_px is not None:
                position[row, k], sigma[row, k] = guide.position_px, guide.sigma_px
                status[row, k] = guide.status
    return Tracks(
        frame=np.array([frame.index for frame in placed], int),
        time_s=np.array([frame.time_s for frame in placed]),
        names=markers.names,
        position_px=position,
        sigma_px=sigma,
        status=status,
        ellipse=ellipse,
        stickers=stickers if stickers.names else None,
    )


def _started(frame: Frame, markers: MarkerFile, guides: dict[str, Guide]) -> Tracker:
    """Return a tracker that starts from the markers located in the first frame."""
    placed = dict(markers.positions_px)
    for name in markers.coded:
        del placed[name]
    by_hand = {
        name: _at_hand(frame, guide.position_px, markers.polarity)
        for name, guide in guides.items()
        if guide.position_px is not None
    }
    for name in by_hand:
        del placed[name]
    rest = replace(markers, positions_px=placed)
    starts = by_hand | locate_markers(frame.picture, rest, frame.index, taken=by_hand)
    starts = {name: starts[name] for name in markers.names if name in starts}
    return Tracker(
        starts=starts,
        bodies=markers.bodies,
        picture=(frame.image.shape[0], frame.image.shape[1]),
        polarity=markers.polarity,
        fit_near=lambda shown, at, look: fit_near(shown, at, markers.polarity, look),
    )


def _check_names(given: Tracks | None, markers: MarkerFile) -> None:
    if given is None:
        return
    unknown = [name for name in given.names if name not in markers.names]
    if unknown:
        raise TracksError(
            f"--tracks: marker {unknown[0]!r} is not in {markers.path}; "
            f"known: {listed(markers.names)}"
        )


def _guides(given: Tracks | None, frame: Frame) -> dict[str, Guide]:
    """Return the positions set by hand in one frame, by marker."""
    if given is None:
        return {}
    row = int(np.searchsorted(given.frame, frame.index))
    if row >= given.frame.size or given.frame[row] != frame.index:
        return {}
    if abs(given.time_s[row] - frame.time_s) > TIME_TOLERANCE_S:
        raise TracksError(
            f"--tracks: frame {frame.index} is at {given.time_s[row]:g} s there and at "
            f"{frame.time_s:g} s in the video: it belongs to another video or another --fps"
        )
    height, width = frame.image.shape
    guides = {}
    for k, name in enumerate(given.names):
        status = str(given.status[row, k])
        if status in ("seen", "fixed"):
            x, y = (float(v) for v in given.position_px[row, k])
            if not (-0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5):
                raise TracksError(
                    f"--tracks: {name} in frame {frame.index} lies at [{x:g}, {y:g}], off the "
                    f"picture of {width} x {height} px: correct the row, or set it to 'lost'"
                )
            sigma = float(given.sigma_px[row, k])
            guides[name] = Guide((x, y), sigma if math.isfinite(sigma) else HAND_SIGMA_PX, status)
        elif status == "predicted":
            guides[name] = Guide(None, math.nan, status)
    return guides


def without_frames(tracks: Tracks, distrusted: frozenset[int]) -> Tracks:
    """Return the tracks without the detections in repeated or blended frames."""
    rows = np.isin(tracks.frame, list(distrusted))
    drop = rows[:, None] & (tracks.status == "seen")
    if not drop.any():
        return tracks
    status = np.where(drop, "lost", tracks.status)
    position = np.where(drop[..., None], np.nan, tracks.position_px)
    return replace(
        tracks,
        status=status,
        position_px=position,
        sigma_px=np.where(drop, np.nan, tracks.sigma_px),
    )
