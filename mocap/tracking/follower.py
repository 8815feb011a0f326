"""One marker that is followed: its Kalman filter, its appearance, how long it is missing."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mocap.tracking.detect import Detection, tinted
from mocap.tracking.kalman import KalmanState
from mocap.tracking.spot import CONTRAST

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
# A moving marker is smeared over at most its path between two frames: misfit that is added per
# squared ratio of that path to the marker's diameter, and the largest such ratio squared.
SMEAR_MISFIT = 0.03
MOST_SMEAR = 2.0
# The usual misfit grows to at most this ratio to that of clean fits, whatever passes before the
# marker; fits up to the second ratio are clean.
WORST_MISFIT = 1.5
CLEAN_MISFIT = 1.3
CLEAN_MARGIN = 0.004
# A marker that lay under a highlight from the start has more contrast without it, and fits better.
UNVEILED_CONTRAST = 4.0
UNVEILED_MISFIT = 0.5
# Range of a veiled marker's size over its own, and of its contrast over that of the frame before.
VEILED_SIZE = (0.8, 1.25)
VEILED_STEP = (0.4, 2.5)
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
    clean
        Its latest clean fit, averaged likewise: the look to which it returns behind a highlight, a
        shadow or a step of the exposure.
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
    clean: Detection | None = None
    smear: float = 0.0

    def __post_init__(self) -> None:
        self.clean = self.clean or self.appearance

    def resembles(
        self,
        found: Detection,
        sizes: tuple[float, float] = SIZE_RANGE,
        contrasts: tuple[float, float] = CONTRAST_RANGE,
    ) -> bool:
        """Whether a detection resembles this marker, or its clean look, within ranges of ratios."""
        assert self.clean is not None
        looks = [
            (look, UNVEILED_CONTRAST if tinted(look) else contrasts[1])
            for look in (self.appearance, self.clean)
        ]
        return (
            found.ring == self.appearance.ring
            and found.channel == self.appearance.channel
            and any(
                sizes[0] < found.radius / look.radius < sizes[1]
                and contrasts[0] < found.contrast / look.contrast < most
                for look, most in looks
            )
            and found.misfit
            < MISFIT_MARGIN + MISFIT_RATIO * self.appearance.misfit + SMEAR_MISFIT * self.smear
        )

    def is_clean(self, found: Detection) -> bool:
        """Whether a plain disc explains a detection as well as this marker's clean look."""
        assert self.clean is not None
        return found.misfit < CLEAN_MISFIT * self.clean.misfit + CLEAN_MARGIN

    def veiled(self, found: Detection) -> bool:
        """Whether a detection is this marker while a highlight or a shadow passes over it.

        It keeps its size and its place, its contrast changes little from one frame to the next, and
        the residual stays that of the marker.
        """
        assert self.clean is not None
        usual, last = self.clean, float(self.appearance.parameters[CONTRAST])
        away = math.hypot(found.x - self.kalman.state[0], found.y - self.kalman.state[1])
        return (
            found.ring == usual.ring
            and found.channel == usual.channel
            and VEILED_SIZE[0] < found.radius / usual.radius < VEILED_SIZE[1]
            and VEILED_STEP[0] < found.contrast / last < VEILED_STEP[1]
            and away < usual.radius
            and found.misfit * abs(found.contrast)
            < (MISFIT_MARGIN + MISFIT_RATIO * usual.misfit) * abs(usual.contrast)
        )

    def unveiled(self, found: Detection) -> bool:
        """Whether a detection at the expected place shows this marker cleaner than ever before.

        A clip may begin with a highlight or a shadow on the marker.
        """
        assert self.clean is not None
        return (
            found.ring == self.clean.ring
            and found.channel == self.clean.channel
            and SIZE_RANGE[0] < found.radius / self.clean.radius < SIZE_RANGE[1]
            and CONTRAST_RANGE[0] < found.contrast / self.clean.contrast < UNVEILED_CONTRAST
            and found.misfit < UNVEILED_MISFIT * self.clean.misfit
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
        path = math.hypot(*self.kalman.state[2:]) * interval_s
        self.smear = min((path / (2 * self.appearance.radius)) ** 2, MOST_SMEAR)
        self.kalman = self.kalman.after(interval_s, acceleration)

    def accept(self, found: Detection, time_s: float) -> None:
        """Accept a detection as this marker."""
        self.seen_s = time_s
        self.kalman = self.kalman.corrected(found.x, found.y, found.covariance)
        assert self.clean is not None
        if self.unveiled(found):
            self.clean = self.appearance = found
        if self.is_clean(found):
            self.clean = _averaged(self.clean, found)
        look = _averaged(self.appearance, found)
        worst = WORST_MISFIT * self.clean.misfit + CLEAN_MARGIN
        self.appearance = replace(look, misfit=min(look.misfit, worst))
        self.missing = 0


def _averaged(look: Detection, found: Detection) -> Detection:
    """Return a fit with radius, contrast and misfit averaged with those of a look."""
    m = APPEARANCE_MEMORY
    return replace(
        found,
        radius=(1 - m) * look.radius + m * found.radius,
        contrast=(1 - m) * look.contrast + m * found.contrast,
        misfit=(1 - m) * look.misfit + m * found.misfit,
    )
