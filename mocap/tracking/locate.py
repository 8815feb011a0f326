"""Location of each marker in the first used frame, from rough positions or the usual layout."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from mocap.tracking.detect import Blob, Detection, detect, fit_blob
from mocap.tracking.errors import TrackingError
from mocap.tracking.explain import explained
from mocap.tracking.layout import alike, assign_layout
from mocap.tracking.markers import MarkerFile
from mocap.video.channels import COLOURS, GREY, Pixels

# Largest error of a rough position, as a share of the picture's longer side, and its least value.
ROUGH_SHARE = 0.035
LEAST_SEARCH_PX = 25.0
# A spot of larger misfit may be hair or print: it has to be like a marker that fits better.
RAGGED = 0.1
# Difference of the brightest and the darkest grey level below which a picture shows nothing.
BLACK_RANGE = 16
# Least contrast of a spot seen in colour: that of a clearly coloured sticker, not of skin.
LEAST_COLOUR = 25.0
# Largest radius of such a spot over the picture's longer side: lips and thumbs are larger.
COLOUR_RADIUS_SHARE = 0.02


def locate_markers(
    shown: Pixels,
    markers: MarkerFile,
    frame: int,
    *,
    taken: Mapping[str, Detection] = MappingProxyType({}),
) -> dict[str, Detection]:
    """Return the fit of every marker of the file.

    Parameters
    ----------
    shown
        The picture of the first used frame.
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
    spread = float(np.percentile(shown.grey, 99.9)) - float(np.percentile(shown.grey, 0.1))
    if spread < BLACK_RANGE:
        raise TrackingError(
            f"frame {frame} shows nothing (brightness differs by {spread:.0f} of 255 grey levels): "
            "start later with --start"
        )
    given = {name: at for name, at in markers.positions_px.items() if at is not None}
    for name, at in given.items():
        _check_inside(name, at, shown)
    found = _near_positions(shown, given, markers.polarity, frame, taken)
    sought = [name for name in markers.names if name not in found]
    if sought:
        everything = detect(shown.grey, polarity=markers.polarity)
        found |= assign_layout(everything, {**taken, **found}, sought, markers, frame)
    return {name: _explained(shown, found[name]) for name in markers.names}


def _explained(shown: Pixels, found: Detection) -> Detection:
    """Return a marker as it is under the light that passes over it, if any does."""
    part = shown.seen_in(found.channel)
    better = explained(part, found, found.parameters, np.zeros(2), believed=True)
    return found if better is None else replace(better, channel=found.channel)


def fit_near(
    shown: Pixels, at: tuple[float, float], polarity: str, appearance: Detection | None
) -> Detection | None:
    """Return the marker nearest to a position set by hand, px; None if there is none.

    What was seen in grey levels before is looked for in grey levels only: a thumb has a colour.
    """
    if appearance is not None and math.isfinite(appearance.contrast):
        blob = Blob(at[0], at[1], appearance.radius, appearance.contrast)
        seen = shown.seen_in(appearance.channel)
        found = fit_blob(seen, blob, ring=appearance.ring)
        if found is not None and math.hypot(found.x - at[0], found.y - at[1]) < appearance.radius:
            return replace(found, channel=appearance.channel)
        if appearance.channel == GREY:
            shown = Pixels(shown.grey)
    near = _candidates(shown, at, polarity)
    return min(near, key=lambda d: math.hypot(d.x - at[0], d.y - at[1]), default=None)


def _check_inside(name: str, at: tuple[float, float], shown: Pixels) -> None:
    height, width = shown.shape
    if not (0 <= at[0] <= width - 1 and 0 <= at[1] <= height - 1):
        raise TrackingError(
            f"[markers] {name} = [{at[0]:g}, {at[1]:g}] lies off the picture of {width} x {height} "
            "px: give its position in the first used frame, or leave it out to have it located"
        )


def _near_positions(
    shown: Pixels,
    given: Mapping[str, tuple[float, float]],
    polarity: str,
    frame: int,
    known: Mapping[str, Detection],
) -> dict[str, Detection]:
    """Return the spot of each rough position; no spot is used twice."""
    search = _search_px(shown)
    choices = []
    for name, at in given.items():
        for spot in _candidates(shown, at, polarity):
            away = math.hypot(spot.x - at[0], spot.y - at[1])
            if away <= search:
                # Of two spots about as near, the one of higher contrast is taken.
                choices.append((away / search - abs(spot.contrast) / 512.0, name, spot))
    found = _nearest_apart(choices, known)
    strange = {name for name, spot in found.items() if _ragged_and_unlike(spot, found)}
    if strange:
        choices = [choice for choice in choices if not _ragged_and_unlike(choice[2], found)]
        found = _nearest_apart(choices, known)
    for name, at in given.items():
        if name not in found:
            kinds = {"auto": "dark, light or coloured spot", "ring": "ring"}
            kind = kinds.get(polarity, f"{polarity} spot")
            where = f"within {search:.0f} px of [{at[0]:g}, {at[1]:g}] in frame {frame}"
            if name in strange:
                raise TrackingError(
                    f"{name}: the spots {where} fit badly and are unlike the other markers, as "
                    "hair and print are; stick it on bare skin, correct its position, or leave out "
                    "a marker of the jaw"
                )
            raise TrackingError(
                f"{name}: no {kind} of its own {where}; correct its position in the marker file, "
                "or start with --start at a frame that shows it"
            )
    return found


def _nearest_apart(
    choices: Sequence[tuple[float, str, Detection]], known: Mapping[str, Detection]
) -> dict[str, Detection]:
    """Return the spot of least cost of each marker; no spot is used twice."""
    found: dict[str, Detection] = {}
    for _, name, spot in sorted(choices, key=lambda choice: choice[0]):
        taken = any(
            math.hypot(spot.x - other.x, spot.y - other.y) < spot.radius
            for other in (*known.values(), *found.values())
        )
        if name not in found and not taken:
            found[name] = spot
    return found


def _ragged_and_unlike(spot: Detection, found: Mapping[str, Detection]) -> bool:
    """Whether a spot may be hair or print: it fits badly, and no marker that fits is like it.

    Contrasts in different colours are not compared.
    """
    usual = [
        other
        for other in found.values()
        if other.misfit <= RAGGED and other.channel == spot.channel
    ]
    return spot.misfit > RAGGED and bool(usual) and not any(alike(spot, each) for each in usual)


def _candidates(shown: Pixels, at: tuple[float, float], polarity: str) -> list[Detection]:
    """Return the spots around a position: in grey levels, or in the colour that shows it best.

    Colours are looked at only where no spot in grey levels covers the position and one in colour
    does, or where there is none in grey levels at all. What has a grey spot on it is the patch of a
    dot.
    """
    reach = 2 * _search_px(shown)
    grey = _spots(shown, GREY, at, reach, polarity)
    if polarity != "auto" or shown.colour is None or any(_covers(spot, at) for spot in grey):
        return grey
    coloured = [
        spot
        for channel in COLOURS
        for spot in _spots(shown, channel, at, reach, polarity)
        if abs(spot.contrast) >= LEAST_COLOUR
        and spot.radius <= COLOUR_RADIUS_SHARE * max(shown.shape)
        and not any(_covers(spot, (dot.x, dot.y)) for dot in grey)
    ]
    covering = [spot for spot in coloured if _covers(spot, at)]
    if covering:
        return [min(covering, key=lambda spot: spot.sigma_px)]
    return grey or coloured


def _spots(
    shown: Pixels, channel: str, at: tuple[float, float], reach: float, polarity: str
) -> list[Detection]:
    """Return the spots within a square around a position, as they are seen in a channel."""
    left, top = max(int(at[0] - reach), 0), max(int(at[1] - reach), 0)
    part = shown.seen_in(channel)[top : int(at[1] + reach) + 1, left : int(at[0] + reach) + 1]
    found = detect(part, polarity=polarity, offset=(left, top))
    return [replace(spot, channel=channel) for spot in found]


def _covers(spot: Detection, at: tuple[float, float]) -> bool:
    return math.hypot(spot.x - at[0], spot.y - at[1]) <= spot.radius


def _search_px(shown: Pixels) -> float:
    return max(ROUGH_SHARE * float(max(shown.shape)), LEAST_SEARCH_PX)
