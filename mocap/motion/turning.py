"""Whether two marks change their distance by coming nearer or by turning out of the plane.

Both change the apparent distance d of a pair. A body that moves in depth changes the size of its
dots with it, evenly in all directions. One that turns out of the plane, about an axis across the
line through its marks, flattens them along that line as much as it shortens the line (by cos φ).
With a and b the extents of the dots along and across the line, the regression over the frames

    log(a/b) = β log d + γ (v_a² − v_b²) + const

has β = 1 for turning and 0 for depth. The second term is the blur by motion, which stretches dots
along their speed v. What dots look like at rest, such as flattened on a curved neck, is in the
constant.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

# Fewer frames than this show nothing.
LEAST_FRAMES = 10
# Error of β from blur and from the model of a flat dot, beside that of the regression.
MODEL_SIGMA = 0.1
# β has to be this many standard errors from one half.
CLEARLY = 2.0


class Cause(Enum):
    """What changes an apparent distance; the value says it in words."""

    TURNING = "the dots flatten with it: turned out of the plane"
    DEPTH = "the dots change their size with it: moved in depth"
    UNKNOWN = "turned out of the plane or moved in depth: the dots do not tell"


@dataclass(frozen=True)
class Flattening:
    """β of the module's regression with its standard error, both nan if nothing could be told."""

    share: float
    sigma: float

    @property
    def cause(self) -> Cause:
        """What the dots say."""
        away = (self.share - 0.5) / self.sigma
        if away > CLEARLY:
            return Cause.TURNING
        return Cause.DEPTH if away < -CLEARLY else Cause.UNKNOWN


def flattening(time_s: Array, position_px: Array, ellipse: Array) -> Flattening:
    """Return how much of a pair's change of distance shows as flattening of its dots.

    Parameters
    ----------
    time_s
        (n,) times of the frames in which both marks are seen.
    position_px
        (n, 2, 2) positions of the two marks.
    ellipse
        (n, 2, 3) entries xx, xy, yy of the symmetric G whose |G (x − c)| = 1 is a dot's edge.
    """
    known = np.isfinite(ellipse).all(axis=(1, 2))
    if np.count_nonzero(known) < LEAST_FRAMES:
        return Flattening(np.nan, np.nan)
    time, position = time_s[known], position_px[known]
    line = position[:, 1] - position[:, 0]
    distance = np.hypot(*line.T)
    along = line / distance[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    xx, xy, yy = np.moveaxis(ellipse[known], -1, 0)
    g = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)
    squared = np.linalg.inv(g @ g)
    ratio = np.zeros(time.size)
    for mark in (0, 1):
        a2 = np.einsum("ni,nij,nj->n", along, squared[:, mark], along)
        b2 = np.einsum("ni,nij,nj->n", across, squared[:, mark], across)
        ratio += 0.25 * np.log(a2 / b2)
    speed = np.gradient(position.mean(axis=1), time, axis=0)
    blur = np.sum(speed * along, axis=1) ** 2 - np.sum(speed * across, axis=1) ** 2
    logarithm = np.log(distance / distance.mean())
    terms = np.column_stack([logarithm, blur / max(np.abs(blur).max(), 1e-12), np.ones(time.size)])
    coefficients = np.linalg.lstsq(terms, ratio)[0]
    left = ratio - terms @ coefficients
    variance = float(left @ left) / (time.size - terms.shape[1])
    spread = variance * np.linalg.pinv(terms.T @ terms)[0, 0]
    return Flattening(float(coefficients[0]), float(np.sqrt(spread + MODEL_SIGMA**2)))
