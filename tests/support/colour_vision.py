"""Colours as people see them who lack one kind of cones, and how far apart colours look.

Matrices: Machado, Oliveira and Fernandes 2009, "A physiologically-based model for simulation of
color vision deficiency", IEEE Transactions on Visualization and Computer Graphics 15, table 1,
severity 1, for linear red, green and blue. Distances are those of CIE L*a*b* (CIE 15:2004), to
which OpenCV converts; 2.3 can just be noticed (Mahy, Van Eycken and Oosterlinck 1994).
"""

from collections.abc import Sequence

import cv2
import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

Array = NDArray[np.float64]

VISIONS = {
    "full": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}


def linear(rgb: Array) -> Array:
    """Return linear red, green, blue (..., 3) of sRGB in 0…1 (IEC 61966-2-1)."""
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def seen(colours: Sequence[str], vision: str) -> Array:
    """Return L*, a*, b* (n, 3) of colours as a vision of :data:`VISIONS` has them."""
    rgb = linear(np.array([to_rgb(colour) for colour in colours]))
    simulated = np.clip(rgb @ VISIONS[vision].T, 0.0, 1.0).astype(np.float32)
    # COLOR_LRGB2Lab takes linear values.
    lab: Array = cv2.cvtColor(simulated[None], cv2.COLOR_LRGB2Lab)[0].astype(float)
    return lab


def apart(colours: Sequence[str], vision: str) -> Array:
    """Return how far each of the colours looks from each other one, (n, n)."""
    lab = seen(colours, vision)
    return np.linalg.norm(lab[:, None] - lab, axis=-1)


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours, 1 to 21, as in WCAG 2.2 ("contrast ratio")."""
    weights = np.array([0.2126, 0.7152, 0.0722])
    light, dark = sorted(
        (weights @ linear(np.array(to_rgb(c))) for c in (one, other)), reverse=True
    )
    return float((light + 0.05) / (dark + 0.05))
