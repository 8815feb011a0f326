"""Location of each marker in the first used frame, from rough positions or the usual layout."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mocap.tracking.detect import Blob, Detection, detect, fit_blob
from mocap.tracking.errors import TrackingError
from mocap.tracking.layout import assign_layout
from mocap.tracking.markers import MarkerFile

Image: TypeAlias = NDArray[np.uint8]

# Largest error of a rough position, as a share of the picture's longer side, and its least value.
ROUGH_SHARE = 0.035
LEAST_SEARCH_PX = 25.0
# Difference of the brightest and the darkest grey level below which a picture shows nothing.
BLACK_RANGE = 16


def locate_markers(
    image: Image,
    markers: MarkerFile,
    frame: int,
    *,
    taken: Mapping[str, Detection] = MappingProxyType({}),
) -> dict[str, Detection]:
    """Return the fit of every marker of the file.

    Parameters
    ----------
    image
        (height, width) grey levels of the first used frame.
    markers
        Names and rough positions. Markers without a position are located by the usual layout of
        face and package.
    frame
        The frame's number, for messages.
    taken
        Markers of other names whose spots are known.

    Raises
    ------
    TrackingError
        If a position lies off the picture, if no marker is near it, or if the layout does not
        identify the markers.
    """
    spread = float(np.percentile(image, 99.9)) - float(np.percentile(image, 0.1))
    if spread < BLACK_RANGE:
        raise TrackingError(
            f"frame {frame} shows nothing (brightness differs by {spread:.0f} of 255 grey levels): "
            "start later with --start"
        )
    given = {name: at for name, at in markers.positions_px.items() if at is not None}
    for name, at in given.items():
        _check_inside(name, at, image)
    found = _near_positions(image, given, markers.polarity, frame, taken)
    sought = [name for name in markers.names if name not in found]
    if sought:
        everything = detect(image, polarity=markers.polarity)
        found |= assign_layout(everything, {**taken, **found}, sought, markers, frame)
    return {name: found[name] for name in markers.names}


def fit_near(
    image: Image, at: tuple[float, float], polarity: str, appearance: Detection | None
) -> Detection | None:
    """Return the marker nearest to a position set by hand, px; None if there is none."""
    if appearance is not None and math.isfinite(appearance.contrast):
        blob = Blob(at[0], at[1], appearance.radius, appearance.contrast)
        found = fit_blob(image, blob, ring=appearance.ring)
        if found is not None and math.hypot(found.x - at[0], found.y - at[1]) < appearance.radius:
            return found
    near = _candidates(image, at, polarity)
    return min(near, key=lambda d: math.hypot(d.x - at[0], d.y - at[1]), default=None)


def _check_inside(name: str, at: tuple[float, float], image: Image) -> None:
    height, width = image.shape
    if not (0 <= at[0] <= width - 1 and 0 <= at[1] <= height - 1):
        raise TrackingError(
            f"[markers] {name} = [{at[0]:g}, {at[1]:g}] lies off the picture of {width} x {height} "
            "px: give its position in the first used frame, or leave it out to have it located"
        )


def _near_positions(
    image: Image,
    given: Mapping[str, tuple[float, float]],
    polarity: str,
    frame: int,
    known: Mapping[str, Detection],
) -> dict[str, Detection]:
    """Return the spot of each rough position; no spot is used twice."""
    search = _search_px(image)
    choices = []
    for name, at in given.items():
        for spot in _candidates(image, at, polarity):
            away = math.hypot(spot.x - at[0], spot.y - at[1])
            if away <= search:
                # Of two spots about as near, the one of higher contrast is taken.
                choices.append((away / search - abs(spot.contrast) / 512.0, name, spot))
    found: dict[str, Detection] = {}
    for _, name, spot in sorted(choices, key=lambda choice: choice[0]):
        taken = any(
            math.hypot(spot.x - other.x, spot.y - other.y) < spot.radius
            for other in (*known.values(), *found.values())
        )
        if name not in found and not taken:
            found[name] = spot
    for name, at in given.items():
        if name not in found:
            kind = {"auto": "dark or light spot", "ring": "ring"}.get(polarity, f"{polarity} spot")
            raise TrackingError(
                f"{name}: no {kind} of its own within {search:.0f} px of [{at[0]:g}, {at[1]:g}] in "
                f"frame {frame}; correct its position in the marker file, or start with --start at "
                "a frame that shows it"
            )
    return found


def _candidates(image: Image, at: tuple[float, float], polarity: str) -> list[Detection]:
    """Return the spots around a position."""
    reach = 2 * _search_px(image)
    left, top = max(int(at[0] - reach), 0), max(int(at[1] - reach), 0)
    part = image[top : int(at[1] + reach) + 1, left : int(at[0] + reach) + 1]
    return detect(part, polarity=polarity, offset=(left, top))


def _search_px(image: Image) -> float:
    return max(ROUGH_SHARE * float(max(image.shape)), LEAST_SEARCH_PX)
