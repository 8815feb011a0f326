"""One marker that is followed: its Kalman filter, its appearance, how long it is missing."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mocap.tracking.detect import Detection
from mocap.tracking.kalman import KalmanState

# A detection is the marker only within this many standard deviations of the prediction.
GATE = 4.0
LEAST_GATE_PX = 4.0
# Allowed ratios of a detection's size and contrast to the marker's usual ones.
SIZE_RANGE = (0.7, 1.4)
CONTRAST_RANGE = (0.5, 1.7)
# Largest ratio of a detection's misfit to the usual one, and a margin. A partly covered marker is
# displaced and fits worse: by a factor six with seven tenths visible. Whole markers stay below a
# factor two in all recordings at hand.
MISFIT_RATIO = 2.0
MISFIT_MARGIN = 0.012
# A marker that is not visible slows down with this time constant (s): hands turn back.
REST_S = 0.25
# Weight of the newest detection in the usual appearance.
APPEARANCE_MEMORY = 0.05


@dataclass
class Follower:
    """One marker that is followed.

    Attributes
    ----------
    name, body
        The marker and its body.
    kalman
        Its estimated position and velocity.
    appearance
        Its latest fit, with radius, contrast and misfit averaged over the past.
    missing
        Number of frames since it was last detected.
    seen_s
        Time of its last detection, s.
    """

    name: str
    body: str | None
    kalman: KalmanState
    appearance: Detection
    missing: int = 0
    seen_s: float = 0.0

    def resembles(
        self,
        found: Detection,
        sizes: tuple[float, float] = SIZE_RANGE,
        contrasts: tuple[float, float] = CONTRAST_RANGE,
    ) -> bool:
        """Whether a detection resembles this marker, within ranges of ratios."""
        size, contrast = (
            found.radius / self.appearance.radius,
            found.contrast / self.appearance.contrast,
        )
        return (
            found.ring == self.appearance.ring
            and sizes[0] < size < sizes[1]
            and contrasts[0] < contrast < contrasts[1]
            and found.misfit < MISFIT_MARGIN + MISFIT_RATIO * self.appearance.misfit
        )

    def gate_px(self, limit: float) -> float:
        """Return the largest distance, px, of the marker from its prediction."""
        return min(max(GATE * self.kalman.spread_px, LEAST_GATE_PX), limit)

    def predict(self, interval_s: float, acceleration: float) -> None:
        """Predict the state after ``interval_s``; a missing marker slows down."""
        if self.missing:
            state = self.kalman.state.copy()
            state[2:] *= math.exp(-interval_s / REST_S)
            self.kalman = KalmanState(state, self.kalman.covariance)
        self.kalman = self.kalman.after(interval_s, acceleration)

    def accept(self, found: Detection, time_s: float) -> None:
        """Accept a detection as this marker."""
        self.seen_s = time_s
        self.kalman = self.kalman.corrected(found.x, found.y, found.covariance)
        m = APPEARANCE_MEMORY
        self.appearance = replace(
            found,
            radius=(1 - m) * self.appearance.radius + m * found.radius,
            contrast=(1 - m) * self.appearance.contrast + m * found.contrast,
            misfit=(1 - m) * self.appearance.misfit + m * found.misfit,
        )
        self.missing = 0
