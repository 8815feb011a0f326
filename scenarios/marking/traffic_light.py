"""A traffic light for each thing that a good measurement needs, with a sentence that says why.

Limits say where a doubt begins, not where an error is certain: whoever films can do something.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from geometry2d.foundation.errors import DrinksimError
from mocap.measurement import Measurement
from mocap.plausible import refuse_implausible
from mocap.tracking.detect import LEAST_CONTRAST
from mocap.tracking.tracks import Tracks
from mocap.views.depths import behind_warning, depth_effect
from scenarios.marking.film import Film
from scenarios.marking.marking import Marking
from scenarios.marking.pointing import SpotLook
from scenarios.marking.state import MarkingState, measured

Colour = Literal["green", "amber", "red", "grey"]

SEEN_SHARE = 0.97
LOST_SHARE = 0.1
LEAST_MARKS_PX = 15.0
SCALE_SIGMA = (0.01, 0.03)
SHARP, BLURRED = 3.0, 1.5
"""Radius of a dot over the standard deviation of its edge's blur: enough, and too little."""

SMEARED = (1.12, 1.5)
"""Ratio of a dot's axes over its usual one: smeared by its motion, and too much so."""

CLEAR_CONTRAST = 50.0
"""Grey levels between a dot and what surrounds it."""

LEVEL_DEG = 20.0
"""Angle of the line from ear to nose against the picture's rows; a head held straight has less."""


@dataclass(frozen=True)
class Lamp:
    """A traffic light.

    Attributes
    ----------
    about
        What it judges.
    colour
        "green", "amber", "red", or "grey" while nothing is known.
    sentence
        Why.
    """

    about: str
    colour: Colour
    sentence: str


@lru_cache(2)
def traffic_lights(state: MarkingState, film: Film) -> tuple[Lamp, ...]:
    """Return the lights of markers, scale, depth, blur, light and level."""
    result: Measurement | None = None
    fault = ""
    try:
        result = measured(state, film)
        if result is not None:
            refuse_implausible(result, state.marking.marker_file(film.path))
    except DrinksimError as error:
        fault = str(error).removeprefix(f"{film.path}: ")
    return (
        _markers(state),
        _scale(state, result, fault),
        _depth(state, film, result),
        _blur(state),
        _light(state),
        _level(state.marking),
    )


def _markers(state: MarkingState) -> Lamp:
    lacking = state.marking.lacking()
    if lacking:
        return Lamp("markers", "red", f"Not placed yet: {', '.join(lacking)}.")
    tracks = state.shown
    if tracks is None:
        return Lamp("markers", "amber", "All needed markers are placed. Track them now.")
    worst = min(tracks.names, key=lambda name: float(tracks.known(name).mean()))
    hidden = ~tracks.known(worst)
    lost = {name: int(np.sum(_status(tracks, name) == "lost")) for name in tracks.names}
    if any(lost.values()):
        name = max(lost, key=lambda marker: lost[marker])
        rows = np.flatnonzero(_status(tracks, name) == "lost")
        colour: Colour = "red" if lost[name] > LOST_SHARE * tracks.frame.size else "amber"
        return Lamp(
            "markers",
            colour,
            f"{name} is lost in {lost[name]} of {tracks.frame.size} frames, first at "
            f"{tracks.time_s[rows[0]]:.2f} s: go there and drag it to its place.",
        )
    if hidden.mean() > 1 - SEEN_SHARE:
        first = tracks.time_s[np.flatnonzero(hidden)[0]]
        return Lamp(
            "markers",
            "amber",
            f"{worst} is hidden in {int(hidden.sum())} of {tracks.frame.size} frames, first at "
            f"{first:.2f} s; its way is interpolated there. Drag it where you know better.",
        )
    share = 100 * float(tracks.known(worst).mean())
    return Lamp("markers", "green", f"Every marker is seen in {share:.0f} % of the frames or more.")


def _scale(state: MarkingState, result: Measurement | None, fault: str) -> Lamp:
    marking = state.marking
    body = marking.needs_length()
    if body is not None:
        pair = " and ".join(marking.given.bodies[body][:2])
        return Lamp("scale", "red", f"Give the distance between {pair}, or point at a ruler.")
    if fault:
        return Lamp("scale", "red", f"{fault[0].upper()}{fault[1:]}.")
    if result is None:
        return Lamp("scale", "amber", "A length is given. Track the markers to see if it fits.")
    scale = result.scales[marking.given.moving]
    mm = 1.0 / float(np.mean(scale.px_per_mm))
    share = scale.relative_sigma
    text = f"1 px is {mm:.3f} mm, known to {100 * share:.1f} %"
    apart = _pair_px(marking, marking.given.moving)
    if apart is not None and apart < LEAST_MARKS_PX:
        return Lamp("scale", "amber", f"{text}: the marks are only {apart:.0f} px apart.")
    if share > SCALE_SIGMA[0]:
        colour: Colour = "red" if share > SCALE_SIGMA[1] else "amber"
        return Lamp("scale", colour, f"{text}. Use a longer ruler, or measure the marks again.")
    return Lamp("scale", "green", f"{text}.")


def _depth(state: MarkingState, film: Film, result: Measurement | None) -> Lamp:
    if result is None:
        return Lamp("depth", "grey", "Known when the markers are tracked and a length is given.")
    markers = state.marking.marker_file(film.path)
    turned = [
        (body, len(scale.foreshortened) + len(scale.enlarged), scale.flattening.cause.value)
        for body, scale in result.scales.items()
        if scale.source == body and not markers.has_sticker(body)
    ]
    body, count, cause = max(turned, key=lambda item: item[1], default=("", 0, ""))
    if count:
        return Lamp("depth", "amber", f"The {body} changes its size in {count} frames: {cause}.")
    for said in behind_warning(result, markers):
        return Lamp("depth", "red", f"{said[0].upper()}{said[1:]}.")
    if markers.depth is not None:
        return Lamp("depth", "green", "The marker file states depths.")
    effect = depth_effect(result, markers)
    if not effect["own_scale_of_reference"]:
        if "error_per_percent_mm" not in effect:
            return Lamp("depth", "green", "Head and package are measured at one depth.")
        wrong = effect["error_per_percent_mm"]
        pair = markers.bodies[markers.reference][:2]
        remedy = f": give the distance between {' and '.join(pair)}" if len(pair) > 1 else ""
        remedy = "" if markers.reference in markers.scale_mm else remedy
        return Lamp(
            "depth",
            "amber",
            f"{markers.reference} and {markers.moving} are taken to be equally deep. For each 15 "
            f"mm that one is nearer (at 1.5 m), positions are wrong by {wrong:.1f} mm{remedy}.",
        )
    nearer = 100 * (effect["reference_over_moving_scale"] - 1)
    word = "larger" if nearer > 0 else "smaller"
    return Lamp(
        "depth",
        "green",
        f"The head appears {abs(nearer):.1f} % {word} than the package; each has its own scale.",
    )


def _blur(state: MarkingState) -> Lamp:
    looks = _looks(state.marking)
    if not looks:
        return Lamp("blur", "grey", "Known when markers are placed on round spots.")
    name = min(looks, key=lambda marker: looks[marker].radius_px / looks[marker].blur_px)
    sharp = looks[name].radius_px / looks[name].blur_px
    edge = f"{name}: radius {looks[name].radius_px:.1f} px, edge {looks[name].blur_px:.1f} px wide"
    if sharp < SHARP:
        colour: Colour = "red" if sharp < BLURRED else "amber"
        return Lamp("blur", colour, f"{edge}. Focus by hand, go nearer, or use larger dots.")
    smeared = None if state.tracks is None else _most_smeared(state.tracks)
    if smeared is not None and smeared[1] > SMEARED[0]:
        marker, stretch, time = smeared
        colour = "red" if stretch > SMEARED[1] else "amber"
        return Lamp(
            "blur",
            colour,
            f"{marker} is smeared to {stretch:.1f} times its length at {time:.2f} s. Film with a "
            "shorter exposure and more light.",
        )
    return Lamp("blur", "green", f"Edges are sharp ({edge}) and no dot is smeared.")


def _light(state: MarkingState) -> Lamp:
    looks = _looks(state.marking)
    if not looks:
        return Lamp("light", "grey", "Known when markers are placed on round spots.")
    name = min(looks, key=lambda marker: abs(looks[marker].contrast))
    contrast = abs(looks[name].contrast)
    text = f"{name} differs by {contrast:.0f} of 255 grey levels from what surrounds it"
    if contrast < CLEAR_CONTRAST:
        colour: Colour = "red" if contrast < 2 * LEAST_CONTRAST else "amber"
        return Lamp("light", colour, f"{text}. More light, or a dot on a plain white square.")
    return Lamp("light", "green", f"{text}; all others by more.")


def _level(marking: Marking) -> Lamp:
    at = _first(marking, ("ear", "nose"))
    if at is None:
        return Lamp("level", "grey", "Known when ear and nose are placed.")
    (x1, y1), (x2, y2) = at
    # Pictures count y downwards.
    angle = math.degrees(math.atan2(y1 - y2, abs(x2 - x1)))
    side = "" if x2 > x1 else " The person faces left and is mirrored."
    text = f"The line from ear to nose rises by {angle:.0f}°" if angle >= 0 else (
        f"The line from ear to nose falls by {-angle:.0f}°")  # fmt: skip
    if abs(angle) > LEVEL_DEG:
        return Lamp("level", "amber", f"{text}: is the camera level and the head straight?{side}")
    return Lamp("level", "green", f"{text}, as in a head held straight.{side}")


def _status(tracks: Tracks, name: str) -> np.ndarray:
    return np.asarray(tracks.status[:, tracks.names.index(name)])


def _looks(marking: Marking) -> Mapping[str, SpotLook]:
    """Return the looks of the markers that sit on round spots in the first frame."""
    return dict(_each_look(marking))


def _each_look(marking: Marking) -> Iterator[tuple[str, SpotLook]]:
    for name, places in marking.placed.items():
        first = places.get(marking.first_frame)
        if first is not None and first.look is not None:
            yield name, first.look


def _first(
    marking: Marking, names: tuple[str, ...]
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return where two markers are in the first frame, px; None if one is not placed."""
    found = [marking.placed.get(name, {}).get(marking.first_frame) for name in names]
    at = [placed.at for placed in found if placed is not None]
    return (at[0], at[1]) if len(at) == 2 else None


def _pair_px(marking: Marking, body: str) -> float | None:
    at = _first(marking, tuple(marking.given.bodies[body][:2]))
    return None if at is None else math.dist(*at)


def _most_smeared(tracks: Tracks) -> tuple[str, float, float] | None:
    """Return the marker whose dot is longest, how many times its usual shape, and when, s."""
    if tracks.ellipse is None:
        return None
    xx, xy, yy = np.moveaxis(tracks.ellipse, -1, 0)
    # Eigenvalues of the symmetric [[xx, xy], [xy, yy]] are the inverse semi-axes.
    middle, half = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    stretch = (middle + half) / (middle - half)
    best: tuple[str, float, float] | None = None
    for k, name in enumerate(tracks.names):
        known = np.isfinite(stretch[:, k])
        if not known.any():
            continue
        relative = np.where(known, stretch[:, k] / np.median(stretch[known, k]), 0.0)
        row = int(np.argmax(relative))
        if best is None or relative[row] > best[1]:
            best = name, float(relative[row]), float(tracks.time_s[row])
    return best
