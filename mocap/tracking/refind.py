"""Identification of lost markers, body by body.

Candidate spots are combined into hypotheses: one spot, or none, for each lost marker of a body. A
hypothesis must keep the body's distances and approximately its direction. Of all sets of hypotheses
that use no spot twice, the one of least cost is taken. A single spot is accepted only so near to
its expected position that it cannot be another marker of the same body.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from mocap.tracking.detect import Detection

# Largest relative change of a body's distances during a dropout, to which two pixels are added.
DISTANCE_SHARE = 0.08
# Largest rotation of a body during a dropout: a constant (rad) and a rate (rad/s).
TURN = 0.5
TURN_PER_S = 4.0
# Cost of a marker that is not found: that of a spot at this distance, in gates.
COST_OF_MISSING = 1.3
# Largest distance of a single spot from its expected position, as a share of the distance between
# the marker and a lost one of its body.
LONE_SHARE = 0.35
MOST_HYPOTHESES = 24
MOST_CANDIDATES = 8

Hypothesis = dict[str, Detection]


@dataclass(frozen=True)
class LostMarker:
    """A lost marker.

    Attributes
    ----------
    name, body
        The marker and its body.
    expected
        Its expected position, px.
    gate_px
        Largest distance from there, px.
    dropout_s
        Time since it was last detected, s.
    candidates
        The spots there.
    """

    name: str
    body: str | None
    expected: tuple[float, float]
    gate_px: float
    dropout_s: float
    candidates: tuple[Detection, ...]


@dataclass(frozen=True)
class MarkerVectors:
    """Vectors between markers of a body, px, when both were last detected."""

    px: Mapping[tuple[str, str], tuple[float, float]]

    def between(self, one: str, other: str) -> tuple[float, float] | None:
        """Return the vector from one marker to another, px; None if it is not known."""
        if (one, other) in self.px:
            return self.px[one, other]
        if (other, one) in self.px:
            x, y = self.px[other, one]
            return -x, -y
        return None


def reidentified(
    lost: Sequence[LostMarker],
    seen: Mapping[str, Detection],
    bodies: Mapping[str, str | None],
    vectors: MarkerVectors,
) -> dict[str, Detection]:
    """Return the lost markers that are identified with confidence.

    Parameters
    ----------
    lost
        The lost markers.
    seen
        Markers already detected in this picture.
    bodies
        The body of each marker.
    vectors
        The vectors between the markers of a body.
    """
    groups: dict[str, list[LostMarker]] = {}
    for marker in lost:
        groups.setdefault(marker.body or f"alone: {marker.name}", []).append(marker)
    choices = []
    for body, markers in groups.items():
        mates = {name: spot for name, spot in seen.items() if bodies[name] == body}
        hypotheses = sorted(_hypotheses(markers, mates, vectors), key=lambda item: item[0])
        choices.append(hypotheses[:MOST_HYPOTHESES])
    best: tuple[float, Hypothesis] = (math.inf, {})
    for combination in itertools.product(*choices):
        cost = sum(item[0] for item in combination)
        spots = [spot for _, hypothesis in combination for spot in hypothesis.values()]
        if cost < best[0] and _all_apart(spots, list(seen.values())):
            best = (cost, {k: v for _, hypothesis in combination for k, v in hypothesis.items()})
    return best[1]


def _hypotheses(
    markers: Sequence[LostMarker], mates: Mapping[str, Detection], vectors: MarkerVectors
) -> Iterator[tuple[float, Hypothesis]]:
    """Yield the admissible hypotheses about one body with their costs."""
    options = []
    for marker in markers:
        near = sorted(marker.candidates, key=lambda spot: _away(marker, spot))[:MOST_CANDIDATES]
        options.append([None, *(spot for spot in near if _away(marker, spot) <= marker.gate_px)])
    for spots in itertools.product(*options):
        chosen = {m.name: s for m, s in zip(markers, spots, strict=True) if s is not None}
        if not _all_apart(list(chosen.values()), []):
            continue
        dropout_s = max(marker.dropout_s for marker in markers)
        if not _keeps_shape(chosen, mates, vectors, dropout_s):
            continue
        if not mates and len(chosen) == 1 and not _beyond_doubt(markers, chosen, vectors):
            continue
        cost = sum(
            COST_OF_MISSING if s is None else (_away(m, s) / m.gate_px) ** 2
            for m, s in zip(markers, spots, strict=True)
        )
        yield cost, chosen


def _keeps_shape(
    chosen: Mapping[str, Detection],
    mates: Mapping[str, Detection],
    vectors: MarkerVectors,
    dropout_s: float,
) -> bool:
    """Whether all distances within a body are kept and no pair has turned too far."""
    everyone = {**mates, **chosen}
    for one, other in itertools.combinations(everyone, 2):
        usual = vectors.between(one, other)
        if usual is None or (one in mates and other in mates):
            continue
        dx, dy = everyone[other].x - everyone[one].x, everyone[other].y - everyone[one].y
        length, now = math.hypot(*usual), math.hypot(dx, dy)
        if abs(now - length) > DISTANCE_SHARE * length + 2.0:
            return False
        turn = math.atan2(usual[0] * dy - usual[1] * dx, usual[0] * dx + usual[1] * dy)
        if abs(turn) > TURN + TURN_PER_S * dropout_s:
            return False
    return True


def _beyond_doubt(
    markers: Sequence[LostMarker], chosen: Mapping[str, Detection], vectors: MarkerVectors
) -> bool:
    """Whether a single spot is too near to its expected position to be another marker."""
    (name, spot), *_ = chosen.items()
    marker = next(m for m in markers if m.name == name)
    for other in markers:
        usual = vectors.between(name, other.name) if other.name != name else None
        if usual is not None and _away(marker, spot) > LONE_SHARE * math.hypot(*usual):
            return False
    return True


def _away(marker: LostMarker, spot: Detection) -> float:
    return math.hypot(spot.x - marker.expected[0], spot.y - marker.expected[1])


def overlap(one: Detection, other: Detection) -> bool:
    """Whether two detections are the same spot."""
    return math.hypot(one.x - other.x, one.y - other.y) < 0.7 * (one.radius + other.radius)


def _all_apart(spots: Sequence[Detection], others: Sequence[Detection]) -> bool:
    return not any(overlap(a, b) for a, b in itertools.combinations(spots, 2)) and not any(
        overlap(a, b) for a in spots for b in others
    )
