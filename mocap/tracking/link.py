"""From detections to tracks: each marker followed through the frames, gaps staying visible.

Every marker has a Kalman filter with constant velocity and random acceleration (Bar-Shalom, Li and
Kirubarajan 2001, ch. 6): it says where to look and how far. What is found there is taken only if it
looks like the marker did (polarity, size, contrast, shape) and is no other marker. A marker that is
not found is searched for around the place where its body, or it alone, should be by now.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from mocap.tracking.detect import Detection, detect, refit
from mocap.tracking.refind import Lost, MarkerVectors, found_again, overlap
from mocap.tracking.tracks import Tracks

Image: TypeAlias = NDArray[np.uint8]
Array: TypeAlias = NDArray[np.float64]

# Accelerations (picture heights per s²) that are expected, one standard deviation.
ACCELERATION = 9.0
# Speed (picture heights per s) a marker seen once may have, one standard deviation.
FIRST_SPEED = 1.0
# Deviations from the prediction beyond this many standard deviations are not the marker.
GATE = 4.0
LEAST_GATE_PX = 4.0
# A marker that comes back looks like itself: range of ratios to its usual size and contrast.
SIZE_RANGE = (0.7, 1.4)
CONTRAST_RANGE = (0.5, 1.7)
# ... and, when it was out of sight, more strictly.
RETURN_SIZE = (0.82, 1.22)
RETURN_CONTRAST = (0.65, 1.45)
# A marker partly covered fits several times worse than usual (seven tenths visible: six times) and
# would be displaced; whole ones stay below twice the usual misfit in all recordings at hand.
MISFIT_RATIO = 2.0
MISFIT_MARGIN = 0.012
# Out of sight a marker is expected to come to rest within this time (s): hands turn back.
REST_S = 0.25
# Share of the usual look that the newest detection replaces.
LOOK_MEMORY = 0.05
# The search around a lost marker grows no further than this share of the picture's width.
WIDEST_SEARCH = 0.22


class TrackingError(DrinksimError):
    """Markers that cannot be found or followed."""


@dataclass(frozen=True)
class Guide:
    """What a person said about a marker in one frame: its place (px), or None to look nowhere."""

    position_px: tuple[float, float] | None
    sigma_px: float
    status: str


@dataclass(frozen=True)
class KalmanState:
    """Expected position and velocity of a point (px, px/s) with covariance (4, 4)."""

    state: Array
    covariance: Array

    @classmethod
    def at_rest(cls, x: float, y: float, speed: float) -> KalmanState:
        """Return a point seen once, of unknown velocity up to about ``speed`` (px/s)."""
        return cls(np.array([x, y, 0.0, 0.0]), np.diag([1.0, 1.0, speed**2, speed**2]))

    def after(self, interval_s: float, acceleration: float) -> KalmanState:
        """Return the prediction after ``interval_s`` with random acceleration (px/s²)."""
        dt = interval_s
        step = np.eye(4)
        step[0, 2] = step[1, 3] = dt
        q = acceleration**2 * np.array([[dt**4 / 4, dt**3 / 2], [dt**3 / 2, dt**2]])
        noise = np.zeros((4, 4))
        noise[::2, ::2] = q
        noise[1::2, 1::2] = q
        return KalmanState(step @ self.state, step @ self.covariance @ step.T + noise)

    def corrected(self, x: float, y: float, covariance: Array) -> KalmanState:
        """Return the estimate after the point was measured at (x, y)."""
        total = self.covariance[:2, :2] + covariance
        gain = self.covariance[:, :2] @ np.linalg.inv(total)
        state = self.state + gain @ (np.array([x, y]) - self.state[:2])
        left = np.eye(4)
        left[:, :2] -= gain
        # Joseph's form keeps the covariance positive however sure the measurement is.
        return KalmanState(state, left @ self.covariance @ left.T + gain @ covariance @ gain.T)

    @property
    def spread_px(self) -> float:
        """Standard deviation of the position, px."""
        return math.sqrt(max(float(np.trace(self.covariance[:2, :2])) / 2, 0.0))


@dataclass
class Follower:
    """One marker on its way: what it looks like, where it should be, how long it is gone."""

    name: str
    body: str | None
    kalman: KalmanState
    look: Detection
    missing: int = 0
    seen_s: float = 0.0

    def resembles(
        self,
        found: Detection,
        sizes: tuple[float, float] = SIZE_RANGE,
        contrasts: tuple[float, float] = CONTRAST_RANGE,
    ) -> bool:
        """Whether a detection looks like this marker does, within ranges of ratios."""
        size, contrast = found.radius / self.look.radius, found.contrast / self.look.contrast
        return (
            found.ring == self.look.ring
            and sizes[0] < size < sizes[1]
            and contrasts[0] < contrast < contrasts[1]
            and found.misfit < MISFIT_MARGIN + MISFIT_RATIO * self.look.misfit
        )

    def gate_px(self, limit: float) -> float:
        """Return how far (px) from the prediction the marker may be."""
        return min(max(GATE * self.kalman.spread_px, LEAST_GATE_PX), limit)

    def pass_time(self, interval_s: float, acceleration: float) -> None:
        """Predict the motion; out of sight it slows down."""
        if self.missing:
            state = self.kalman.state.copy()
            state[2:] *= math.exp(-interval_s / REST_S)
            self.kalman = KalmanState(state, self.kalman.covariance)
        self.kalman = self.kalman.after(interval_s, acceleration)

    def take(self, found: Detection, time_s: float) -> None:
        """Accept a detection as this marker."""
        self.seen_s = time_s
        self.kalman = self.kalman.corrected(found.x, found.y, found.covariance)
        m = LOOK_MEMORY
        self.look = replace(
            found,
            radius=(1 - m) * self.look.radius + m * found.radius,
            contrast=(1 - m) * self.look.contrast + m * found.contrast,
            misfit=(1 - m) * self.look.misfit + m * found.misfit,
        )
        self.missing = 0


@dataclass
class Tracker:
    """Follows markers from frame to frame; feed frames in order, then ask for the tracks.

    Parameters
    ----------
    starts
        What each marker looks like in the first frame, and where.
    bodies
        Markers by body: those of one body are searched for together.
    picture
        Height and width, px.
    polarity
        As in the marker file.
    fit_near
        Finds the marker next to a position set by hand, to know what it looks like there.
    """

    starts: Mapping[str, Detection]
    bodies: Mapping[str, tuple[str, ...]]
    picture: tuple[int, int]
    polarity: str
    fit_near: Callable[[Image, tuple[float, float], Detection | None], Detection | None]
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

    def see(
        self,
        index: int,
        time_s: float,
        image: Image,
        *,
        guides: Mapping[str, Guide] = MappingProxyType({}),
    ) -> None:
        """Follow all markers into the next frame; guided ones are where the guide says."""
        if self._times:
            for follower in self._followers.values():
                follower.pass_time(time_s - self._times[-1], ACCELERATION * self.picture[0])
        self._frames.append(index)
        self._times.append(time_s)
        found = self._found(image, guides) if len(guides) < len(self._followers) else {}
        self._remember_shape(found)
        for name, follower in self._followers.items():
            guide, detection = guides.get(name), found.get(name)
            if guide is not None and guide.position_px is not None:
                self._guided(follower, guide, image)
                follower.seen_s = time_s
                row = (*guide.position_px, guide.sigma_px, guide.status)
            elif detection is not None:
                follower.take(detection, time_s)
                row = (detection.x, detection.y, detection.sigma_px, "seen")
            else:
                follower.missing += 1
                row = (math.nan, math.nan, math.nan, "lost")
            self._rows[name].append(row)
            fitted = detection is not None and row[3] == "seen" and guide is None
            self._ellipses[name].append(
                tuple(detection.parameters[2:5]) if detection and fitted else (math.nan,) * 3
            )

    def _remember_shape(self, found: Mapping[str, Detection]) -> None:
        """Keep the vectors between markers of one body that are seen together."""
        for one, other in itertools.combinations(found, 2):
            body = self._followers[one].body
            if body is not None and body == self._followers[other].body:
                vector = found[other].x - found[one].x, found[other].y - found[one].y
                self._vectors[one, other] = vector
                self._vectors[other, one] = (-vector[0], -vector[1])

    def _guided(self, follower: Follower, guide: Guide, image: Image) -> None:
        """Put a marker where a person says it is, and see what it looks like there."""
        assert guide.position_px is not None
        x, y = guide.position_px
        spread = max(guide.sigma_px, 0.01) ** 2
        follower.kalman = follower.kalman.corrected(x, y, spread * np.eye(2))
        jumped = math.hypot(follower.kalman.state[0] - x, follower.kalman.state[1] - y)
        if jumped > LEAST_GATE_PX:
            follower.kalman = KalmanState.at_rest(x, y, FIRST_SPEED * self.picture[0])
        if guide.status == "fixed":
            found = self.fit_near(image, (x, y), follower.look)
            if found is not None and math.hypot(found.x - x, found.y - y) < found.radius:
                follower.look = found
        follower.missing = 0

    def tracks(self) -> Tracks:
        """Return what was seen so far; where a marker was not seen its row is empty."""
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

    def _found(self, image: Image, guides: Mapping[str, Guide]) -> dict[str, Detection]:
        """Return the markers found in a picture: first near their predictions, then by search."""
        found: dict[str, Detection] = {}
        for name, follower in self._followers.items():
            if follower.missing == 0 and name not in guides:
                near = self._near_prediction(image, follower)
                if near is not None:
                    found[name] = near
        found = _each_once(found, self._followers)
        missing = [f for name, f in self._followers.items() if name not in (*found, *guides)]
        if missing:
            found |= self._searched(image, missing, found)
        return found

    def _near_prediction(self, image: Image, follower: Follower) -> Detection | None:
        start = follower.look.parameters.copy()
        start[:2] = follower.kalman.state[:2]
        found = refit(image, start, ring=follower.look.ring)
        if found is None or not follower.resembles(found):
            return None
        away = math.hypot(*(np.array([found.x, found.y]) - follower.kalman.state[:2]))
        return found if away <= follower.gate_px(self._limit) else None

    @property
    def _limit(self) -> float:
        return WIDEST_SEARCH * self.picture[1]

    def _searched(
        self, image: Image, missing: list[Follower], found: Mapping[str, Detection]
    ) -> dict[str, Detection]:
        """Return lost markers found again by looking at everything within their reach."""
        lost = []
        for follower in missing:
            expected = self._expected(follower, found)
            gate = follower.gate_px(self._limit)
            spots = [
                spot
                for spot in self._candidates(image, expected, gate, follower)
                if follower.resembles(spot, RETURN_SIZE, RETURN_CONTRAST)
            ]
            gap_s = self._times[-1] - follower.seen_s
            lost.append(Lost(follower.name, follower.body, expected, gate, gap_s, tuple(spots)))
        bodies = {name: follower.body for name, follower in self._followers.items()}
        return found_again(lost, found, bodies, MarkerVectors(self._vectors))

    def _candidates(
        self, image: Image, at: tuple[float, float], gate: float, follower: Follower
    ) -> list[Detection]:
        margin = gate + 3 * follower.look.radius + 6
        height, width = image.shape
        left, right = max(int(at[0] - margin), 0), min(int(at[0] + margin) + 1, width)
        top, bottom = max(int(at[1] - margin), 0), min(int(at[1] + margin) + 1, height)
        if right - left < 12 or bottom - top < 12:
            return []
        polarity = "dark" if follower.look.contrast < 0 else "light"
        if follower.look.ring:
            polarity = "ring"
        return detect(image[top:bottom, left:right], polarity=polarity, offset=(left, top))

    def _expected(self, follower: Follower, found: Mapping[str, Detection]) -> tuple[float, float]:
        """Return where a marker should be: carried along by those of its body that are seen."""
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


def _each_once(
    found: Mapping[str, Detection], followers: Mapping[str, Follower]
) -> dict[str, Detection]:
    """Return the detections with no two markers in one place: the better predicted one keeps it."""

    def surprise(name: str) -> float:
        state = followers[name].kalman.state
        return math.hypot(found[name].x - state[0], found[name].y - state[1])

    kept: dict[str, Detection] = {}
    for name in sorted(found, key=surprise):
        if not any(overlap(found[name], other) for other in kept.values()):
            kept[name] = found[name]
    return kept
