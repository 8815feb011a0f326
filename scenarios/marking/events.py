"""What a page asks to be done, read from JSON: each event becomes a change of the state."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from geometry2d.foundation.progress import Progress
from geometry2d.foundation.text import quoted
from mocap.motion.projection import corrected as corrected_px
from mocap.tracking.retrack import Correction
from scenarios.marking.film import Film
from scenarios.marking.marking import Marking
from scenarios.marking.pointing import (
    Length,
    MarkingError,
    PlacedPoint,
    Point,
    Ruler,
    Touch,
    length_by_ruler,
)
from scenarios.marking.session import Change
from scenarios.marking.spots import named_by_layout, placed_at
from scenarios.marking.state import MarkingState, corrected, tracked, without_track

MOST_CHARACTERS = 200


class Event:
    """An event whose values are checked when they are asked for."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = values

    def text(self, key: str) -> str:
        """Return a text."""
        value = self._values.get(key)
        if not isinstance(value, str) or len(value) > MOST_CHARACTERS:
            raise MarkingError(f"{key}: is no short text")
        return value

    def number(self, key: str) -> float:
        """Return a finite number."""
        value = self._values.get(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise MarkingError(f"{key}: is no number")
        if not math.isfinite(value):
            raise MarkingError(f"{key}: is not finite")
        return float(value)

    def frame(self, film: Film, key: str = "frame") -> int:
        """Return the number of a used frame."""
        value = self._values.get(key)
        if isinstance(value, bool) or not isinstance(value, int) or value not in film.frames:
            raise MarkingError(f"{key}: {value!s:.20} is no used frame of the film")
        return value

    def flag(self, key: str) -> bool:
        """Return whether something is said; not saying it is no."""
        return self._values.get(key) is True

    def place(self, film: Film, x: str = "x", y: str = "y") -> Point:
        """Return a place in the picture, px."""
        at = self.number(x), self.number(y)
        if not (-0.5 <= at[0] <= film.info.width - 0.5 and -0.5 <= at[1] <= film.info.height - 0.5):
            raise MarkingError(
                f"[{at[0]:g}, {at[1]:g}] lies off the picture of {film.info.width} x "
                f"{film.info.height} px"
            )
        return at


def change_for(values: Mapping[str, Any]) -> Change:
    """Return the change that an event asks for.

    Raises
    ------
    MarkingError
        If there is no such event.
    """
    event = Event(values)
    name = event.text("do")
    if name not in CHANGES:
        raise MarkingError(f"{quoted(name)} is nothing that can be done")
    change = CHANGES[name]
    return lambda state, film, progress: change(event, state, film, progress)


def _place(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    """Put a marker on the spot that was pointed at, or exactly there."""
    marker, frame, at = event.text("marker"), event.frame(film), event.place(film)
    placed = PlacedPoint(at)
    if not event.flag("free"):
        placed = placed_at(film.shown(frame), at, state.marking.polarity)
    marking = state.marking.with_marker(marker, frame, placed)
    correction = Correction(marker, frame, placed.at, placed.sigma_px)
    return corrected(state, film, correction, marking, progress)


def _forget(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    """Take back what was set by hand in a frame; in the first one, the whole marker."""
    marker, frame = event.text("marker"), event.frame(film)
    marking = state.marking.without_marker(marker, frame)
    if marker not in marking.placed:
        return replace(state, marking=marking, tracks=without_track(state.tracks, marker))
    return corrected(state, film, Correction(marker, frame, None), marking, progress)


def _suggest(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    """Name the spots of the first frame where their layout leaves no doubt."""
    marking = state.marking
    sought = marking.lacking()
    if marking.needs_length() is not None:
        raise MarkingError("give the distance of the package's marks first: sizes follow from it")
    if not sought:
        return state
    shown = film.shown(marking.first_frame)
    found = named_by_layout(shown, marking.marker_file(film.path), sought, marking.first_frame)
    if not found:
        raise MarkingError("the layout of the spots leaves doubts: click on each marker")
    for name, placed in found.items():
        marking = marking.with_marker(name, marking.first_frame, placed)
    return replace(state, marking=marking)


def _length(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    body = event.text("body")
    marking = state.marking.with_length(body, Length(event.number("mm")))
    return replace(state, marking=marking)


def _no_length(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    return replace(state, marking=state.marking.without_length(event.text("body")))


def _ruler(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    """Measure the distance of a body's marks with two points of known distance."""
    body, frame = event.text("body"), event.frame(film)
    ends = event.place(film, "x1", "y1"), event.place(film, "x2", "y2")
    ruler = Ruler(frame, ends, event.number("mm"))
    marks = _marks(state, body, frame)
    markers = state.marking.marker_file(film.path)
    flat = [corrected_px(np.array(points), markers, film.format) for points in (ends, marks)]
    length = length_by_ruler(flat[0], flat[1], ruler.length_mm)
    return replace(state, marking=state.marking.with_length(body, length, ruler))


def _marks(state: MarkingState, body: str, frame: int) -> tuple[Point, Point]:
    """Return where the first two marks of a body are in a frame, px."""
    if body not in state.marking.scaled_bodies():
        raise MarkingError(f"{quoted(body)} has no two marks whose distance gives a scale")
    found: list[Point] = []
    for name in state.marking.given.bodies[body][:2]:
        placed = state.marking.placed.get(name, {}).get(frame)
        if placed is not None:
            found.append(placed.at)
            continue
        tracks = state.tracks
        if tracks is not None and name in tracks.names:
            row = int(np.searchsorted(tracks.frame, frame))
            x, y = (float(value) for value in tracks.of(name)[0][row])
            if math.isfinite(x):
                found.append((x, y))
                continue
        raise MarkingError(f"{name}: is not placed in frame {frame}; place it, then the ruler")
    return found[0], found[1]


def _style(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    marking = state.marking.with_style(event.text("name"), event.place(film))
    return replace(state, marking=marking)


def _touch(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    touch = Touch(event.frame(film), event.place(film))
    return replace(state, marking=state.marking.with_touch(event.text("lip"), touch))


def _no_touch(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    return replace(state, marking=state.marking.with_touch(event.text("lip"), None))


def _polarity(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    return replace(state, marking=state.marking.with_polarity(event.text("polarity")))


def _track(event: Event, state: MarkingState, film: Film, progress: Progress) -> MarkingState:
    return tracked(state, film, progress)


CHANGES: Mapping[str, Callable[[Event, MarkingState, Film, Progress], MarkingState]] = {
    "place": _place,
    "forget": _forget,
    "suggest": _suggest,
    "length": _length,
    "no length": _no_length,
    "ruler": _ruler,
    "style": _style,
    "touch": _touch,
    "no touch": _no_touch,
    "polarity": _polarity,
    "track": _track,
}
"""Every event by its name."""


def with_spots(film: Film, marking: Marking) -> Marking:
    """Return a marking whose rough positions in the first frame lie on the spots they mean."""
    shown = film.shown(marking.first_frame)
    for name, places in marking.placed.items():
        rough = places.get(marking.first_frame)
        if rough is not None and rough.look is None:
            placed = placed_at(shown, rough.at, marking.polarity)
            marking = marking.with_marker(name, marking.first_frame, placed)
    return marking
