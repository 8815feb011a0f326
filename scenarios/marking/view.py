"""A session as the page reads it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mocap.tracking.marker_file import STYLE_KEYS
from mocap.tracking.tracks import Tracks
from scenarios.marking.film import Film
from scenarios.marking.marking import LIPS, Marking
from scenarios.marking.session import MARKERS, TRACKS, Session
from scenarios.marking.spots import spots_in
from scenarios.marking.traffic_light import traffic_lights

LETTERS = {"seen": "s", "predicted": "p", "lost": "l", "fixed": "f"}
DECIMALS = 2


def page_state(session: Session) -> dict[str, Any]:
    """Return all that a page shows, as values for JSON."""
    state, film = session.state, session.film
    marking = state.marking
    return {
        "film": {
            "name": film.path.name,
            "width": film.info.width,
            "height": film.info.height,
            "frames": film.frames,
            "times": [round(time, 6) for time in film.times_s],
            "first": marking.first_frame,
        },
        "markers": [_marker(marking, name) for name in marking.names],
        "lengths": {body: _length(marking, body) for body in marking.scaled_bodies()},
        "needs_length": marking.needs_length(),
        "style": {name: marking.style.get(name) for name in STYLE_KEYS},
        "touches": {
            lip: asdict(marking.touches[lip]) if lip in marking.touches else None for lip in LIPS
        },
        "polarity": marking.polarity,
        "tracks": None if state.shown is None else _tracks(state.shown),
        "lights": [asdict(light) for light in traffic_lights(state, film)],
        "undo": bool(session.past),
        "redo": bool(session.future),
        "saved": session.saved is state,
        "out": str(session.out),
        "files": [MARKERS, TRACKS],
        "converted": None
        if session.converted is None
        else {
            "motion": str(session.converted.motion),
            "warnings": list(session.converted.warnings),
        },
    }


def progress_state(session: Session) -> dict[str, Any]:
    """Return what is being done, and how much of it."""
    work = session.work
    return {
        "busy": work is not None,
        "text": "" if work is None else work.text,
        "share": 0.0 if work is None else work.share,
    }


@lru_cache(8)
def page_spots(film: Film, frame: int, polarity: str) -> list[dict[str, float]]:
    """Return place and radius of the round spots of a frame, px."""
    return [
        {
            "x": round(spot.at[0], 3),
            "y": round(spot.at[1], 3),
            "radius": round(spot.look.radius_px, 2),
        }
        for spot in spots_in(film.shown(frame), polarity)
        if spot.look is not None
    ]


def _marker(marking: Marking, name: str) -> dict[str, Any]:
    return {
        "name": name,
        "body": next(b for b, members in marking.given.bodies.items() if name in members),
        "optional": marking.optional(name),
        "coded": name in marking.given.coded,
        "placed": {
            str(frame): [round(placed.at[0], DECIMALS), round(placed.at[1], DECIMALS),
                         placed.look is not None]
            for frame, placed in marking.placed.get(name, {}).items()
        },
    }  # fmt: skip


def _length(marking: Marking, body: str) -> dict[str, Any]:
    length, ruler = marking.lengths.get(body), marking.rulers.get(body)
    return {
        "pair": list(marking.given.bodies[body][:2]),
        "mm": None if length is None else round(length.mm, 3),
        "sigma_mm": None if length is None else round(length.sigma_mm, 3),
        "ruler": None if ruler is None else asdict(ruler),
    }


def _tracks(tracks: Tracks) -> Mapping[str, Any]:
    return {
        name: {
            "x": _numbers(tracks.position_px[:, k, 0]),
            "y": _numbers(tracks.position_px[:, k, 1]),
            "status": "".join(LETTERS[str(status)] for status in tracks.status[:, k]),
        }
        for k, name in enumerate(tracks.names)
    }


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    return [round(float(v), DECIMALS) if math.isfinite(v) else None for v in values]
