"""From detections to tracks: markers are followed from frame to frame, dropouts stay empty.

Every marker has a Kalman filter, which predicts its position and the radius of the search. A
detection there is accepted if it resembles the marker in polarity, size, contrast and shape, and is
no other marker. A marker that is not detected is searched for where its body, or its own motion,
has carried it by then.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from mocap.tracking.detect import Detection, detect, refit
from mocap.tracking.explain import explained
from mocap.tracking.follower import LEAST_GATE_PX, Follower
from mocap.tracking.kalman import KalmanState
from mocap.tracking.refind import LostMarker, MarkerVectors, overlap, reidentified
from mocap.tracking.tracks import Tracks
from mocap.video.channels import Pixels

# Standard deviation of the acceleration, picture heights per s².
ACCELERATION = 9.0
# Standard deviation of the speed of a marker seen once, picture heights per s.
FIRST_SPEED = 1.0
# Allowed ratios of size and contrast for a marker that comes back after a dropout.
RETURN_SIZE = (0.82, 1.22)
RETURN_CONTRAST = (0.65, 1.45)
# A spot this near to a position from a table is what the table saw, px.
SAME_PLACE_PX = 0.05
# Largest radius of the search for a lost marker, as a share of the picture's width.
WIDEST_SEARCH = 0.22


@dataclass(frozen=True)
class Guide:
    """A marker's position in one frame as set by hand.

    Attributes
    ----------
    position_px
        The position, px; None if the marker is not to be searched for.
    sigma_px
        Its standard error, px.
    status
        "seen", "fixed" or "predicted".
    spot
        The spot there if an earlier pass measured it: it is not fitted again.
    """

    position_px: tuple[float, float] | None
    sigma_px: float
    status: str
    spot: Detection | None = None


@dataclass(frozen=True)
class LastFound:
    """What was found of a marker in the frame that was processed last.

    Attributes
    ----------
    position_px, sigma_px
        Position and standard error of a coordinate, px; nan if lost.
    status
        "seen", "fixed" or "lost".
    ellipse
        As in :class:`Tracks`.
    """

    position_px: tuple[float, float]
    sigma_px: float
    status: str
    ellipse: tuple[float, ...]


@dataclass
class Tracker:
    """Follows markers from frame to frame: :meth:`process` frames in order, then ask for tracks.

    Parameters
    ----------
    starts
        Fit of each marker in the first frame.
    bodies
        Markers by body; lost markers of one body are searched for together.
    picture
        Height and width, px.
    polarity
        As in the marker file.
    fit_near
        Fits the marker next to a position set by hand, which gives its appearance there.
    """

    starts: Mapping[str, Detection]
    bodies: Mapping[str, tuple[str, ...]]
    picture: tuple[int, int]
    polarity: str
    fit_near: Callable[[Pixels, tuple[float, float], Detection | None], Detection | None]
    _followers: dict[str, Follower] = field(default_factory=dict)
    _vectors: dict[tuple[str, str], tuple[float, float]] = field(default_factory=dict)
    _rows: dict[str, list[tuple[float, float, float, str]]] = field(default_factory=dict)
    _ellipses: dict[str, list[tuple[float, ...]]] = field(default_factory=dict)
    _frames: list[int] = field(default_factory=list)
    _times: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        speed = FIRST_SPEED * self.picture[0]
        for name, found in self.starts.items():
            body = next((b for b, members in self.bodies.items() if name in members), None)
            motion = KalmanState.at_rest(found.x, found.y, speed)
            self._followers[name] = Follower(name, body, motion, found)
            self._rows[name] = []
            self._ellipses[name] = []

    def process(
        self,
        index: int,
        time_s: float,
        shown: Pixels,
        *,
        guides: Mapping[str, Guide] = MappingProxyType({}),
    ) -> None:
        """Follow all markers into the next frame.

        Parameters
        ----------
        index, time_s
            Number of the frame and its time, s.
        shown
            The frame's picture.
        guides
            Positions set by hand, by marker; they replace the search.
        """
        if self._times:
            for follower in self._followers.values():
                follower.predict(time_s - self._times[-1], ACCELERATION * self.picture[0])
        self._frames.append(index)
        self._times.append(time_s)
        evidence = {
            name: self._given(self._followers[name], guide, shown)
            for name, guide in guides.items()
            if guide.position_px is not None and name in self._followers
        }
        found = self._found(shown, guides, evidence) if len(guides) < len(self._followers) else {}
        self._record_vectors(evidence | found)
        for name, follower in self._followers.items():
            guide, detection = guides.get(name), found.get(name)
            if guide is not None and guide.position_px is not None:
                self._guided(follower, guide, evidence[name], time_s)
                follower.seen_s = time_s
                row = (*guide.position_px, guide.sigma_px, guide.status)
            elif detection is not None:
                follower.accept(detection, time_s)
                row = (detection.x, detection.y, detection.sigma_px, "seen")
            else:
                follower.missing += 1
                row = (math.nan, math.nan, math.nan, "lost")
            self._rows[name].append(row)
            fitted = detection is not None and row[3] == "seen" and guide is None
            self._ellipses[name].append(
                tuple(detection.parameters[2:5]) if detection and fitted else (math.nan,) * 3
            )

    @property
    def followers(self) -> Mapping[str, Follower]:
        """The markers that are followed."""
        return MappingProxyType(self._followers)

    def last(self, name: str) -> LastFound:
        """Return what was found of a marker in the frame that was processed last."""
        x, y, sigma, status = self._rows[name][-1]
        return LastFound((x, y), sigma, status, self._ellipses[name][-1])

    def _record_vectors(self, found: Mapping[str, Detection]) -> None:
        """Record the vectors between markers of one body that are detected together."""
        for one, other in itertools.combinations(found, 2):
            body = self._followers[one].body
            if body is not None and body == self._followers[other].body:
                vector = found[other].x - found[one].x, found[other].y - found[one].y
                self._vectors[one, other] = vector
                self._vectors[other, one] = (-vector[0], -vector[1])

    def _given(self, follower: Follower, guide: Guide, shown: Pixels) -> Detection:
        """Return the spot at a position from a table; where none is seen, the look it had before.

        A position set by hand may show the marker in a new look, any other one only its own.
        """
        assert guide.position_px is not None
        if guide.spot is not None:
            return guide.spot
        x, y = guide.position_px
        found = None
        if guide.status == "fixed":
            found = self.fit_near(shown, (x, y), follower.appearance)
        else:
            start = follower.appearance.parameters.copy()
            start[:2] = x, y
            found = _refitted(shown, follower.appearance, start)
            if found is not None and not follower.resembles(found):
                found = None
        if found is not None and math.hypot(found.x - x, found.y - y) < found.radius:
            return found
        parameters = follower.appearance.parameters.copy()
        parameters[:2] = x, y
        return replace(follower.appearance, x=x, y=y, parameters=parameters)

    def _guided(self, follower: Follower, guide: Guide, spot: Detection, time_s: float) -> None:
        """Move a marker to its position from a table and take on its look there."""
        assert guide.position_px is not None
        x, y = guide.position_px
        if guide.status == "seen" and math.hypot(spot.x - x, spot.y - y) < SAME_PLACE_PX:
            follower.accept(spot, time_s)
            return
        spread = max(guide.sigma_px, 0.01) ** 2
        follower.kalman = follower.kalman.corrected(x, y, spread * np.eye(2))
        jumped = math.hypot(follower.kalman.state[0] - x, follower.kalman.state[1] - y)
        if jumped > LEAST_GATE_PX:
            follower.kalman = KalmanState.at_rest(x, y, FIRST_SPEED * self.picture[0])
        if guide.status == "fixed":
            follower.appearance = follower.clean = spot
        follower.missing = 0

    def tracks(self) -> Tracks:
        """Return the tracks so far; dropouts are "lost" and nan."""
        names = tuple(self._followers)
        shape = (len(self._frames), len(names))
        rows = np.array([[row[:3] for row in self._rows[name]] for name in names], float)
        rows = rows.reshape(*shape[::-1], 3)
        status = np.array([[row[3] for row in self._rows[name]] for name in names], dtype="<U9").T
        return Tracks(
            frame=np.array(self._frames, int),
            time_s=np.array(self._times, float),
            names=names,
            position_px=np.swapaxes(rows[:, :, :2], 0, 1).copy(),
            sigma_px=rows[:, :, 2].T.copy(),
            status=status,
            ellipse=np.swapaxes(np.array([self._ellipses[name] for name in names]), 0, 1),
        )

    def _found(
        self, shown: Pixels, guides: Mapping[str, Guide], evidence: Mapping[str, Detection]
    ) -> dict[str, Detection]:
        """Return the markers detected in a picture: near their predictions, then by search.

        What a table says of other markers is evidence: their spots are taken, and a body keeps its
        distances from them.
        """
        found: dict[str, Detection] = {}
        for name, follower in self._followers.items():
            if follower.missing == 0 and name not in guides:
                near = self._near_prediction(shown, follower)
                if near is not None:
                    found[name] = near
        found = _each_once(found, self._followers, evidence)
        missing = [f for name, f in self._followers.items() if name not in (*found, *guides)]
        if missing:
            found |= self._searched(shown, missing, {**evidence, **found})
        return found

    def _near_prediction(self, shown: Pixels, follower: Follower) -> Detection | None:
        start = follower.appearance.parameters.copy()
        start[:2] = follower.kalman.state[:2]
        plain = _refitted(shown, follower.appearance, start)
        for found in _readings(shown, follower, plain, start):
            if follower.resembles(found) or follower.unveiled(found) or follower.veiled(found):
                away = math.hypot(*(np.array([found.x, found.y]) - follower.kalman.state[:2]))
                return found if away <= follower.gate_px(self._limit) else None
        return None

    @property
    def _limit(self) -> float:
        return WIDEST_SEARCH * self.picture[1]

    def _searched(
        self, shown: Pixels, missing: list[Follower], found: Mapping[str, Detection]
    ) -> dict[str, Detection]:
        """Return the lost markers that are identified among all spots within their gates."""
        lost = []
        for follower in missing:
            expected = self._expected(follower, found)
            gate = follower.gate_px(self._limit)
            spots = [
                spot
                for spot in self._candidates(shown, expected, gate, follower)
                if follower.resembles(spot, RETURN_SIZE, RETURN_CONTRAST)
            ]
            dropout_s = self._times[-1] - follower.seen_s
            lost.append(
                LostMarker(follower.name, follower.body, expected, gate, dropout_s, tuple(spots))
            )
        bodies = {name: follower.body for name, follower in self._followers.items()}
        return reidentified(lost, found, bodies, MarkerVectors(self._vectors))

    def _candidates(
        self, shown: Pixels, at: tuple[float, float], gate: float, follower: Follower
    ) -> list[Detection]:
        look = follower.appearance
        if not math.isfinite(look.contrast):
            return []  # nothing resembles a marker of which no look is known
        margin = gate + 3 * look.radius + 6
        height, width = shown.shape
        left, right = max(int(at[0] - margin), 0), min(int(at[0] + margin) + 1, width)
        top, bottom = max(int(at[1] - margin), 0), min(int(at[1] + margin) + 1, height)
        if right - left < 12 or bottom - top < 12:
            return []
        polarity = "dark" if look.contrast < 0 else "light"
        if look.ring:
            polarity = "ring"
        part = shown.seen_in(look.channel)[top:bottom, left:right]
        found = detect(part, polarity=polarity, offset=(left, top), radius_px=look.radius)
        return [replace(spot, channel=look.channel) for spot in found]

    def _expected(self, follower: Follower, found: Mapping[str, Detection]) -> tuple[float, float]:
        """Return the expected position, px; detected markers of its body carry a lost one along."""
        mates = [
            (self._followers[name], detection)
            for name, detection in found.items()
            if self._followers[name].body == follower.body and follower.body is not None
        ]
        x, y = float(follower.kalman.state[0]), float(follower.kalman.state[1])
        if not mates or follower.missing == 0:
            return x, y
        shift = np.mean(
            [[d.x - f.kalman.state[0], d.y - f.kalman.state[1]] for f, d in mates], axis=0
        )
        return x + float(shift[0]), y + float(shift[1])


def _refitted(shown: Pixels, look: Detection, start: NDArray[np.float64]) -> Detection | None:
    """Return the marker fitted from starting parameters, in what it was seen in before."""
    found = refit(shown.seen_in(look.channel), start, ring=look.ring)
    return None if found is None else replace(found, channel=look.channel)


def _readings(
    shown: Pixels, follower: Follower, plain: Detection | None, start: NDArray[np.float64]
) -> Iterator[Detection]:
    """Yield what a marker next to its prediction may be, the best explanation first."""
    believed = plain is not None and follower.resembles(plain)
    if plain is None or not (believed and follower.is_clean(plain)):
        look = follower.appearance
        now = start[:2] if plain is None else np.array([plain.x, plain.y])
        path = now - np.array([look.x, look.y])
        part = shown.seen_in(look.channel)
        better = explained(part, plain, start, path, believed=believed)
        if better is not None:
            yield replace(better, channel=look.channel)
    if plain is not None:
        yield plain


def _each_once(
    found: Mapping[str, Detection],
    followers: Mapping[str, Follower],
    evidence: Mapping[str, Detection],
) -> dict[str, Detection]:
    """Return the detections without overlaps; of two markers, the better predicted one keeps it."""

    def deviation(name: str) -> float:
        state = followers[name].kalman.state
        return math.hypot(found[name].x - state[0], found[name].y - state[1])

    kept: dict[str, Detection] = {}
    for name in sorted(found, key=deviation):
        others = (*evidence.values(), *kept.values())
        if not any(overlap(found[name], other) for other in others):
            kept[name] = found[name]
    return kept
