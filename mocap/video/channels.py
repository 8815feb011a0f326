"""A picture in grey levels, and in the three colour contrasts that tell marks of any hue.

Grey levels show marks that are darker or lighter than their ground. A sticker that is as light as
the skin shows in colour only. The contrasts oppose each primary colour to the mean of both others:
blue to yellow, green to magenta, red to cyan. Every hue differs from grey in at least two of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Image: TypeAlias = NDArray[np.uint8]

GREY = "grey"
COLOURS = ("blue", "green", "red")

GAIN = 0.7
"""Levels of a colour contrast per level of a primary colour: as much as a usual sticker leaves
within 0 to 255. A picture without colour is 128 everywhere."""


@dataclass(frozen=True, eq=False)
class Pixels:
    """A picture whose colours are looked at only if they are needed.

    Attributes
    ----------
    grey
        (height, width) grey levels.
    colour
        Returns (height, width, 3) levels of blue, green, red; None: the picture has no colours.
    """

    grey: Image
    colour: Callable[[], Image] | None = None
    _seen: dict[str, Image] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width, px."""
        return self.grey.shape[0], self.grey.shape[1]

    def seen_in(self, channel: str) -> Image:
        """Return (height, width) levels of a channel: :data:`GREY` or one of :data:`COLOURS`."""
        if channel == GREY:
            return self.grey
        if channel not in self._seen:
            assert self.colour is not None
            own = COLOURS.index(channel)
            weights = np.full(3, -0.5 * GAIN, np.float32)
            weights[own] = GAIN
            self._seen[channel] = _weighted(self.colour(), weights)
        return self._seen[channel]


def _weighted(colour: Image, weights: NDArray[np.float32]) -> Image:
    """Return 128 and the weighted sum of the three colours, rounded to 0 to 255."""
    import cv2

    mixed = cv2.transform(colour, np.append(weights, np.float32(128.0))[None, :])
    return np.asarray(mixed, np.uint8)
