"""Tracks after a correction: only what depends on a position set by hand is tracked again.

A correction of one marker in one frame changes its own track from there on: in a dropout up to
where it is seen again, elsewhere up to the next position set by hand. It may bring back marks of
its body that were lost meanwhile. Every other position was measured before and is taken as it is,
without a look at the picture. The pass ends where it finds again what was found before, or where it
has not found the marker for as long as dropouts are bridged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.progress import Progress
from mocap.tracking.detect import Detection, unseen_at
from mocap.tracking.link import SAME_PLACE_PX, Guide, Tracker
from mocap.tracking.locate import fit_near
from mocap.tracking.markers import MarkerFile
from mocap.tracking.tracks import LONGEST_BRIDGE_S, Tracks
from mocap.video.channels import Pixels
from mocap.video.frames import Frame, Video

FRAMES_ALIKE = 5
"""The pass ends after so many frames in a row in which it finds what was found before."""

FARTHEST_LOOK_BACK = 50
"""The pass starts at most so many frames earlier, where the whole body and its look are seen."""


@dataclass(frozen=True)
class Correction:
    """A position of one marker, set by hand in one frame.

    Attributes
    ----------
    marker, frame
        The marker and the number of the frame.
    position_px, sigma_px
        The position and the standard error of a coordinate, px. None takes back what was set there:
        the marker is searched for.
    """

    marker: str
    frame: int
    position_px: tuple[float, float] | None
    sigma_px: float = math.nan


def retrack(
    video: Video,
    markers: MarkerFile,
    tracks: Tracks,
    correction: Correction,
    *,
    start_s: float | None = None,
    end_s: float | None = None,
    progress: Progress | None = None,
) -> Tracks:
    """Return the tracks with a correction and what follows from it; dropouts stay empty.

    Parameters
    ----------
    video, markers
        The recording, and the bodies and polarity of its markers.
    tracks
        The tracks before, their dropouts "lost"; the corrected marker may be new.
    correction
        What was set by hand.
    start_s, end_s
        First and last used instant on the file's own clock, s.
    progress
        Called with the share of the frames that is done.

    Raises
    ------
    VideoError
        If the video cannot be read.
    """
    draft = _Draft.of(tracks, correction)
    if correction.marker in markers.coded:
        return draft.now
    first = draft.first_row(markers)
    tracker: Tracker | None = None
    alike, row = 0, first
    for row, frame in enumerate(video.frames(start_s=start_s, end_s=end_s)):
        if row < first:
            continue
        if row >= draft.end:
            break
        if tracker is None:
            tracker = _started(frame, markers, draft.now, row)
        depends = draft.depends(row, markers)
        tracker.process(
            frame.index,
            frame.time_s,
            frame.picture,
            guides=dict(draft.guides(tracker, row, depends)),
        )
        draft.record(tracker, row, depends)
        alike = alike + 1 if draft.finds_the_same(row) else 0
        if alike == FRAMES_ALIKE:
            break
        if draft.searched_s(row) > LONGEST_BRIDGE_S:
            draft.lose(row + 1)
            break
        if progress is not None:
            progress((row + 1 - first) / (draft.end - first), "tracking again")
    draft.distrust(video.timing.distrusted)
    return draft.now


def _started(frame: Frame, markers: MarkerFile, tracks: Tracks, row: int) -> Tracker:
    """Return a tracker whose markers look as they do in this frame, where they are known."""
    followed = [name for name in tracks.names if name not in markers.coded]
    return Tracker(
        starts={name: _look(frame.picture, markers, tracks, name, row) for name in followed},
        bodies=markers.bodies,
        picture=(frame.image.shape[0], frame.image.shape[1]),
        polarity=markers.polarity,
        fit_near=_fitting(markers.polarity),
    )


def _fitting(
    polarity: str,
) -> Callable[[Pixels, tuple[float, float], Detection | None], Detection | None]:
    return lambda shown, at, look: fit_near(shown, at, polarity, look)


def _look(shown: Pixels, markers: MarkerFile, tracks: Tracks, name: str, row: int) -> Detection:
    """Return the spot of a marker in a frame, or a stand-in where none is known."""
    position, _ = tracks.of(name)
    if not tracks.known(name)[row]:
        known = np.flatnonzero(tracks.known(name))
        at = position[known[np.abs(known - row).argmin()]] if known.size else np.zeros(2)
        return unseen_at((float(at[0]), float(at[1])))
    x, y = (float(value) for value in position[row])
    found = fit_near(shown, (x, y), markers.polarity, None)
    near = found is not None and math.hypot(found.x - x, found.y - y) < found.radius
    return found if found is not None and near else unseen_at((x, y))


@dataclass(frozen=True)
class _Draft:
    """Tracks that are being corrected.

    Attributes
    ----------
    before, now
        The tracks before the correction, and with it; the arrays of ``now`` are filled in place.
    marker
        The column of the corrected marker.
    row, end
        The corrected row, and the first one after it that does not depend on it.
    by_hand
        Whether the correction sets a position.
    """

    before: Tracks
    now: Tracks
    marker: int
    row: int
    end: int
    by_hand: bool

    @classmethod
    def of(cls, tracks: Tracks, correction: Correction) -> _Draft:
        before = _with_marker(tracks, correction.marker)
        now = replace(
            before,
            position_px=before.position_px.copy(),
            sigma_px=before.sigma_px.copy(),
            status=before.status.copy(),
            ellipse=None if before.ellipse is None else before.ellipse.copy(),
        )
        k = now.names.index(correction.marker)
        row = int(np.flatnonzero(now.frame == correction.frame)[0])
        at = correction.position_px
        draft = cls(before, now, k, row, _end(before.status[:, k], row), at is not None)
        if at is None:
            draft.write(row, k, math.nan, math.nan, math.nan, "lost")
        else:
            draft.write(row, k, *at, correction.sigma_px, "fixed")
        return draft

    def write(self, row: int, k: int, x: float, y: float, sigma: float, status: str) -> None:
        """Set one row of one marker."""
        assert self.now.ellipse is not None
        self.now.position_px[row, k] = x, y
        self.now.sigma_px[row, k] = sigma
        self.now.status[row, k] = status
        self.now.ellipse[row, k] = np.nan

    def first_row(self, markers: MarkerFile) -> int:
        """Return the last row up to the corrected one in which the marker's whole body is seen."""
        name = self.now.names[self.marker]
        body = markers.body_of(name)
        members = markers.bodies[body] if body is not None else (name,)
        mates = [m for m in members if m in self.now.names and m not in markers.coded]
        seen = np.all([self.now.known(mate) for mate in mates], axis=0)
        least = max(self.row - FARTHEST_LOOK_BACK, 0)
        rows = np.flatnonzero(seen[least : self.row + 1])
        return least + int(rows[-1]) if rows.size else self.row

    def depends(self, row: int, markers: MarkerFile) -> frozenset[int]:
        """Return the columns that are tracked again in a row."""
        if row < self.row or row >= self.end:
            return frozenset()
        body = markers.body_of(self.now.names[self.marker])
        mates = {
            k
            for k, name in enumerate(self.now.names)
            if k != self.marker
            and body is not None
            and markers.body_of(name) == body
            and self.before.status[row, k] == "lost"
            and name not in markers.coded
        }
        own = {self.marker} if row > self.row or not self.by_hand else set()
        return frozenset(mates | own)

    def guides(
        self, tracker: Tracker, row: int, depends: frozenset[int]
    ) -> Iterator[tuple[str, Guide]]:
        """Yield what is known of the other markers in a row; a new position is looked at."""
        for name, follower in tracker.followers.items():
            k = self.now.names.index(name)
            status = str(self.now.status[row, k])
            if k in depends:
                continue
            if status == "lost":
                yield name, Guide(None, math.nan, "predicted")
                continue
            x, y = (float(value) for value in self.now.position_px[row, k])
            spot = None
            if (row, k) != (self.row, self.marker):
                spot = _measured(follower.appearance, x, y, self.now, row, k)
            yield name, Guide((x, y), float(self.now.sigma_px[row, k]), status, spot)

    def record(self, tracker: Tracker, row: int, depends: frozenset[int]) -> None:
        """Copy what the tracker found in its last frame of the columns that depend on it."""
        assert self.now.ellipse is not None
        for k in depends:
            found = tracker.last(self.now.names[k])
            self.write(row, k, *found.position_px, found.sigma_px, found.status)
            self.now.ellipse[row, k] = found.ellipse

    def finds_the_same(self, row: int) -> bool:
        """Whether the marker is seen in a row, where it was seen before."""
        k = self.marker
        if row <= self.row or "lost" in (self.now.status[row, k], self.before.status[row, k]):
            return False
        away = self.now.position_px[row, k] - self.before.position_px[row, k]
        return math.hypot(*away) < SAME_PLACE_PX

    def searched_s(self, row: int) -> float:
        """Return how long the marker has been lost in a row since it was known, s."""
        known = np.flatnonzero(self.now.known(self.now.names[self.marker])[self.row : row + 1])
        since = self.row + (int(known[-1]) if known.size else 0)
        return float(self.now.time_s[row] - self.now.time_s[since])

    def lose(self, first: int) -> None:
        """Drop what the marker's earlier track says from a row on, as far as it depended."""
        for row in range(first, self.end):
            self.write(row, self.marker, math.nan, math.nan, math.nan, "lost")

    def distrust(self, frames: frozenset[int]) -> None:
        """Drop what is seen in repeated or blended frames and was not seen there before."""
        doubtful = np.isin(self.now.frame, list(frames))[:, None]
        new = (self.now.status == "seen") & (self.before.status == "lost") & doubtful
        for row, k in np.argwhere(new):
            self.write(int(row), int(k), math.nan, math.nan, math.nan, "lost")


def _end(status: NDArray[np.str_], row: int) -> int:
    """Return the first row that does not depend on a marker's position in a row.

    In a dropout that is where the marker is known again, otherwise its next position set by hand.
    """
    in_dropout = status[row] == "lost" or (
        status[row] == "fixed" and "lost" in status[row + 1 : row + 2]
    )
    ends = (status[row + 1 :] != "lost") if in_dropout else (status[row + 1 :] == "fixed")
    return row + 1 + int(np.argmax(ends)) if ends.any() else status.size


def _measured(look: Detection, x: float, y: float, tracks: Tracks, row: int, k: int) -> Detection:
    """Return the spot that an earlier pass measured."""
    assert tracks.ellipse is not None
    parameters = look.parameters.copy()
    parameters[:2] = x, y
    if np.isfinite(tracks.ellipse[row, k]).all():
        parameters[2:5] = tracks.ellipse[row, k]
    covariance = float(tracks.sigma_px[row, k]) ** 2 * np.eye(2)
    return replace(look, x=x, y=y, covariance=covariance, parameters=parameters)


def _with_marker(tracks: Tracks, marker: str) -> Tracks:
    """Return the tracks, with a lost marker of this name if it has none."""
    n, m = tracks.status.shape
    ellipse = np.full((n, m, 3), np.nan) if tracks.ellipse is None else tracks.ellipse
    if marker in tracks.names:
        return replace(tracks, ellipse=ellipse)

    def widened(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([values, np.full((n, 1, *values.shape[2:]), np.nan)], axis=1)

    return replace(
        tracks,
        names=(*tracks.names, marker),
        position_px=widened(tracks.position_px),
        sigma_px=widened(tracks.sigma_px),
        status=np.concatenate([tracks.status, np.full((n, 1), "lost", dtype="<U9")], axis=1),
        ellipse=widened(ellipse),
    )
