"""Rotation out of the plane and motion in depth, told apart by the shape of the marks.

Both change the apparent distance d of a pair of marks. A body that moves in depth changes the size
of its dots equally in all directions. A body that turns out of the plane, about an axis across the
line through its marks, shortens the dots along that line by the same factor, cos φ, as the line.
Let a and b be the extents of the dots along and across the line. The regression over the frames

    log(a/b) = β log d + γ (v_a² − v_b²) + const

has β = 1 for a rotation and β = 0 for motion in depth. The second term is motion blur, which
stretches dots along their velocity v. The constant holds the shape of the dots at rest, such as
flattening on a curved neck.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

# Least number of frames for the regression.
LEAST_FRAMES = 10
# Standard error of β from blur and from the model of a flat dot, added to that of the regression.
MODEL_SIGMA = 0.1
# Least distance of β from one half for a decision, in standard errors.
CLEARLY = 2.0


class Cause(Enum):
    """Cause of a change of the apparent distance; the value is its description."""

    TURNING = "the dots flatten with it: it is a rotation out of the plane"
    DEPTH = "the dots change their size with it: it is a motion in depth"
    UNKNOWN = "a rotation out of the plane or a motion in depth: the dots do not decide"


@dataclass(frozen=True)
class Flattening:
    """β of the module's regression and its standard error; both nan if there are too few frames."""

    share: float
    sigma: float

    @property
    def cause(self) -> Cause:
        """Cause of the change of distance."""
        away = (self.share - 0.5) / self.sigma
        if away > CLEARLY:
            return Cause.TURNING
        return Cause.DEPTH if away < -CLEARLY else Cause.UNKNOWN


def flattening(time_s: Array, position_px: Array, ellipse: Array) -> Flattening:
    """Return the regression of the dots' flattening on the distance of two marks.

    Parameters
    ----------
    time_s
        (n,) times of the frames in which both marks are detected, s.
    position_px
        (n, 2, 2) positions of the two marks, px.
    ellipse
        (n, 2, 3) entries xx, xy, yy of the symmetric matrix G, 1/px; |G (x − c)| = 1 is a dot's
        edge.
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
