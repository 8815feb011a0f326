"""The printed codes: which pattern names which marker, and how large it is.

The patterns are the first forty of OpenCV's dictionary ``DICT_4X4_50``: a black square of 6 × 6
cells, of which the inner 4 × 4 carry the code, on a white margin of one cell. The number of a
pattern tells the marker (its last digit) and the side of the black square (its first digit), so
that neither has to be written into a file.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError

Array: TypeAlias = NDArray[np.float64]

CODED_MARKERS = ("ear", "nose", "package_lower", "package_upper", "jaw_front", "jaw_back")
"""Markers that have a code, by the last digit of its number."""

SIDES_MM = (8.0, 10.0, 12.0, 14.0)
"""Sides of the black square, mm, by the first digit of a code's number."""

CELLS = 6
"""Cells along a side of the black square, its border included."""

MARGIN_CELLS = 1
"""Width of the white margin, cells."""


BAR_MM = 100.0
"""Length of the bar on a sheet by which its print is checked, mm."""


class StickerError(DrinksimError):
    """A sticker that does not exist or cannot be used."""


@dataclass(frozen=True)
class StickerCode:
    """A pattern: its number, the marker that it names, and the side of its black square, mm."""

    number: int
    marker: str
    side_mm: float

    @property
    def dark(self) -> NDArray[np.bool_]:
        """(6, 6) which cells are black, rows from the top."""
        return _dark_cells(self.number)


def code_of(marker: str, side_mm: float) -> StickerCode:
    """Return the code of a marker in a size.

    Raises
    ------
    StickerError
        If the marker has no code or the size is not printed.
    """
    if marker not in CODED_MARKERS:
        raise StickerError(f"{marker!r} has no code; coded markers: {', '.join(CODED_MARKERS)}")
    if side_mm not in SIDES_MM:
        sizes = ", ".join(f"{side:g}" for side in SIDES_MM)
        raise StickerError(f"there is no sticker of {side_mm:g} mm; sizes: {sizes} mm")
    number = 10 * SIDES_MM.index(side_mm) + CODED_MARKERS.index(marker)
    return StickerCode(number, marker, side_mm)


@cache
def codes_by_number() -> dict[int, StickerCode]:
    """Return all codes by their number."""
    codes = (code_of(marker, side) for side in SIDES_MM for marker in CODED_MARKERS)
    return {code.number: code for code in codes}


@cache
def _dark_cells(number: int) -> NDArray[np.bool_]:
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    drawn = cv2.aruco.generateImageMarker(dictionary, number, CELLS)
    dark: NDArray[np.bool_] = np.asarray(drawn) < 128
    dark.setflags(write=False)
    return dark
