"""Round spots in a picture, suggested as markers."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mocap.tracking.detect import Detection, detect
from mocap.tracking.errors import TrackingError
from mocap.tracking.layout import assign_layout
from mocap.tracking.locate import fit_near
from mocap.tracking.markers import MarkerFile
from mocap.tracking.spot import SHARPNESS
from mocap.video.channels import Pixels
from scenarios.marking.pointing import PlacedPoint, Point, SpotLook

REACH_PX = 6.0
"""A spot whose edge is so near to the place that was pointed at is meant."""

MOST_SPOTS = 60


def spots_in(shown: Pixels, polarity: str) -> list[PlacedPoint]:
    """Return the spots of a picture that resemble markers, the clearest first."""
    found = detect(shown.grey, polarity=polarity)
    found.sort(key=lambda spot: -abs(spot.contrast) / (1 + 20 * spot.misfit))
    return [placed_on(spot) for spot in found[:MOST_SPOTS]]


def placed_at(shown: Pixels, at: Point, polarity: str) -> PlacedPoint:
    """Return the centre of the spot at a place, px; the place itself where there is none."""
    spot = fit_near(shown, at, polarity, None)
    if spot is None or math.dist((spot.x, spot.y), at) > spot.radius + REACH_PX:
        return PlacedPoint(at)
    return placed_on(spot)


def placed_on(spot: Detection) -> PlacedPoint:
    """Return a fitted spot as a position."""
    blur = spot.radius / max(float(spot.parameters[SHARPNESS]), 1e-9)
    look = SpotLook(spot.radius, spot.contrast, blur)
    return PlacedPoint((spot.x, spot.y), spot.sigma_px, look)


def named_by_layout(
    shown: Pixels, markers: MarkerFile, sought: Sequence[str], frame: int
) -> dict[str, PlacedPoint]:
    """Return the spots that the usual layout of face and package names; empty if it is not sure.

    Parameters
    ----------
    shown
        The picture.
    markers
        What is known so far: lengths, and positions of other markers.
    sought
        The markers to be named.
    frame
        Number of the frame.
    """
    known = {
        name: spot
        for name, at in markers.positions_px.items()
        if at is not None and (spot := fit_near(shown, at, markers.polarity, None)) is not None
    }
    try:
        found = assign_layout(
            detect(shown.grey, polarity=markers.polarity), known, sought, markers, frame
        )
    except TrackingError:
        return {}
    return {name: placed_on(spot) for name, spot in found.items()}
