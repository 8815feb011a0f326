"""What a person says about a film, as a value: every change returns a new one.

Positions are px in a frame of the film, which is named by its number in the file. A marker needs a
position in the first used frame; in any other frame a position corrects the track.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

from geometry2d.foundation.text import quoted
from mocap.tracking.marker_file import OPTIONAL_MARKERS, PLAUSIBLE_MM, POLARITIES, STYLE_KEYS
from mocap.tracking.markers import DEFAULT_BODIES, MarkerFile, StylePoints, unsaid_markers
from scenarios.marking.pointing import Length, MarkingError, PlacedPoint, Point, Ruler, Touch

Value = TypeVar("Value")

LIPS = ("lower", "upper")


def _nothing() -> Mapping[str, Value]:
    return MappingProxyType({})


@dataclass(frozen=True)
class Marking:
    """What was said about a film so far.

    Attributes
    ----------
    given
        The marker file from which the marking started: bodies, lens, and what is not asked here.
    first_frame
        Number of the first used frame.
    placed
        Positions given by hand, by marker and number of the frame.
    lengths
        Distance between the first two marks of a body, by body.
    rulers
        Rulers from which lengths came, by body.
    style
        Points of lip and rim in the first used frame, px, by their names in a marker file.
    touches
        First contact of each lip.
    polarity
        As in a marker file.
    """

    given: MarkerFile
    first_frame: int
    placed: Mapping[str, Mapping[int, PlacedPoint]] = field(default_factory=_nothing)
    lengths: Mapping[str, Length] = field(default_factory=_nothing)
    rulers: Mapping[str, Ruler] = field(default_factory=_nothing)
    style: Mapping[str, Point] = field(default_factory=_nothing)
    touches: Mapping[str, Touch] = field(default_factory=_nothing)
    polarity: str = "auto"

    @classmethod
    def of(cls, given: MarkerFile, first_frame: int) -> Marking:
        """Return the marking that a marker file says already."""
        style = given.style
        return cls(
            given=_with_jaw(given),
            first_frame=first_frame,
            placed={
                name: {first_frame: PlacedPoint(at)}
                for name, at in given.positions_px.items()
                if at is not None
            },
            lengths={
                body: Length(mm, given.scale_sigma_mm[body]) for body, mm in given.scale_mm.items()
            },
            style={} if style is None else {key: getattr(style, key) for key in STYLE_KEYS},
            polarity=given.polarity,
        )

    @property
    def names(self) -> tuple[str, ...]:
        """All markers that the bodies may have, in their order."""
        return tuple(name for members in self.given.bodies.values() for name in members)

    def optional(self, marker: str) -> bool:
        """Whether a film may do without this marker."""
        return marker in OPTIONAL_MARKERS and self.given.bodies.get("jaw", ()).count(marker) > 0

    def lacking(self) -> tuple[str, ...]:
        """Return the markers that need a position in the first used frame and have none."""
        return tuple(
            name
            for name in self.names
            if not self.optional(name)
            and name not in self.given.coded
            and self.first_frame not in self.placed.get(name, {})
        )

    def scaled_bodies(self) -> tuple[str, ...]:
        """Return the bodies whose length may be given: those with two marks."""
        return tuple(
            body
            for body, members in self.given.bodies.items()
            if len(members) > 1 and body in (self.given.moving, self.given.reference)
        )

    def needs_length(self) -> str | None:
        """Return the body whose length is needed and not given; None if there is none."""
        bodies = self.scaled_bodies()
        if any(self.given.has_sticker(body) for body in bodies):
            return None
        needed = next((b for b in (self.given.moving, self.given.reference) if b in bodies), None)
        return needed if needed is not None and needed not in self.lengths else None

    def with_marker(self, marker: str, frame: int, placed: PlacedPoint) -> Marking:
        """Return the marking with a position of a marker."""
        self._check_marker(marker)
        _check_point(marker, placed.at)
        if frame != self.first_frame and self.first_frame not in self.placed.get(marker, {}):
            raise MarkingError(
                f"{marker}: place it in the first frame ({self.first_frame}) before it is corrected"
            )
        for name, places in self.placed.items():
            other = places.get(frame)
            if name != marker and other is not None and math.dist(other.at, placed.at) < 2.0:
                raise MarkingError(
                    f"{marker}: {name} is at this place in frame {frame} already; move one of them"
                )
        places = {**self.placed.get(marker, {}), frame: placed}
        return replace(self, placed={**self.placed, marker: places})

    def without_marker(self, marker: str, frame: int) -> Marking:
        """Return the marking without a position; in the first frame, without all of the marker's.

        A marker that has no position in the first frame has none to be corrected.
        """
        self._check_marker(marker)
        places = dict(self.placed.get(marker, {}))
        if frame not in places:
            raise MarkingError(f"{marker}: nothing was set by hand in frame {frame}")
        rest = {name: at for name, at in self.placed.items() if name != marker}
        del places[frame]
        if frame != self.first_frame and places:
            rest[marker] = places
        return replace(self, placed=rest)

    def with_length(self, body: str, length: Length, ruler: Ruler | None = None) -> Marking:
        """Return the marking with the distance between a body's marks."""
        if body not in self.scaled_bodies():
            raise MarkingError(f"{quoted(body)} has no two marks whose distance gives a scale")
        pair = self.given.bodies[body][:2]
        low, high = PLAUSIBLE_MM.get(pair, (0.0, math.inf))
        if not (math.isfinite(length.mm) and length.mm > 0 and low <= length.mm <= high):
            raise MarkingError(
                f"{pair[0]} and {pair[1]} are {low:g} to {high:g} mm apart, not {length.mm:.4g} "
                "mm: measure again"
            )
        rulers = {name: kept for name, kept in self.rulers.items() if name != body}
        if ruler is not None:
            rulers[body] = ruler
        return replace(self, lengths={**self.lengths, body: length}, rulers=rulers)

    def without_length(self, body: str) -> Marking:
        """Return the marking without the distance between a body's marks."""
        return replace(
            self,
            lengths={name: kept for name, kept in self.lengths.items() if name != body},
            rulers={name: kept for name, kept in self.rulers.items() if name != body},
        )

    def with_style(self, name: str, at: Point) -> Marking:
        """Return the marking with a point of lip or rim."""
        if name not in STYLE_KEYS:
            raise MarkingError(f"{quoted(name)} is none of {', '.join(STYLE_KEYS)}")
        _check_point(name, at)
        return replace(self, style={**self.style, name: at})

    def with_touch(self, lip: str, touch: Touch | None) -> Marking:
        """Return the marking with the first contact of a lip, or without it."""
        if lip not in LIPS:
            raise MarkingError(f"{quoted(lip)} is no lip: lower or upper")
        others = {name: kept for name, kept in self.touches.items() if name != lip}
        if touch is None:
            return replace(self, touches=others)
        _check_point(f"{lip} lip", touch.at)
        return replace(self, touches={**others, lip: touch})

    def with_polarity(self, polarity: str) -> Marking:
        """Return the marking of dots of another kind."""
        if polarity not in POLARITIES:
            raise MarkingError(f"{quoted(polarity)} is none of {', '.join(POLARITIES)}")
        return replace(self, polarity=polarity)

    def marker_file(self, path: Path) -> MarkerFile:
        """Return the marker file that says the same of the first used frame."""
        kept = {
            name: places[self.first_frame].at
            for name, places in self.placed.items()
            if self.first_frame in places
        }
        names = [n for n in self.names if n in kept or not self.optional(n)]
        bodies = {
            body: tuple(name for name in members if name in names)
            for body, members in self.given.bodies.items()
        }
        lengths = {b: length for b, length in self.lengths.items() if len(bodies[b]) > 1}
        return replace(
            self.given,
            path=path,
            scale_mm={body: length.mm for body, length in lengths.items()},
            scale_sigma_mm={body: length.sigma_mm for body, length in lengths.items()},
            positions_px={name: kept.get(name) for name in names},
            bodies={body: members for body, members in bodies.items() if members},
            polarity=self.polarity,
            style=self._style_points(),
        )

    def _style_points(self) -> StylePoints | None:
        if any(key not in self.style for key in STYLE_KEYS):
            return None
        return StylePoints(**{key: self.style[key] for key in STYLE_KEYS})

    def _check_marker(self, marker: str) -> None:
        if marker not in self.names:
            raise MarkingError(f"{quoted(marker)} is none of {', '.join(self.names)}")
        if marker in self.given.coded:
            raise MarkingError(f"{marker} is a coded sticker: it is found by itself")


def _with_jaw(given: MarkerFile) -> MarkerFile:
    """Return a marker file of the standard bodies with the jaw's markers, which may be added."""
    others = {body: members for body, members in given.bodies.items() if body != "jaw"}
    standard = {body: members for body, members in DEFAULT_BODIES.items() if body != "jaw"}
    return replace(given, bodies=DEFAULT_BODIES) if others == standard else given


def plain_markers() -> MarkerFile:
    """Return what is known of a film of which nothing was said: the standard markers."""
    return unsaid_markers("markers.toml", DEFAULT_BODIES)


def _check_point(what: str, at: Point) -> None:
    if not all(math.isfinite(value) and abs(value) < 1e6 for value in at):
        raise MarkingError(f"{what}: {at} is no place in a picture")
