"""Lost markers found again: whole bodies are looked for, not single spots.

Spots that look right are combined into hypotheses, one place (or none) for each lost marker of a
body. A hypothesis must keep the body's distances and its rough direction; the best set of
hypotheses, no spot used twice, is taken. A lone spot is believed only so near to where it was
expected that it cannot be another marker of the same body.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from mocap.tracking.detect import Detection

# A body's distances may change by this share, plus two pixels, while its markers are not seen.
DISTANCE_SHARE = 0.08
# It may turn by this much (rad), plus this much for every second.
TURN = 0.5
TURN_PER_S = 4.0
# Not finding a marker costs as much as finding it this far (in gates) from where it should be.
COST_OF_NONE = 1.3
# A lone spot must be nearer to its place than this share of the distance to its lost neighbour.
LONE_SHARE = 0.35
MOST_HYPOTHESES = 24
MOST_CANDIDATES = 8

Hypothesis = dict[str, Detection]


@dataclass(frozen=True)
class Lost:
    """A marker that is looked for: where it should be (px), how far off at most, what is there."""

    name: str
    body: str | None
    expected: tuple[float, float]
    gate_px: float
    gap_s: float
    candidates: tuple[Detection, ...]


@dataclass(frozen=True)
class MarkerVectors:
    """Vectors (px) between markers when both were last seen."""

    px: Mapping[tuple[str, str], tuple[float, float]]

    def between(self, one: str, other: str) -> tuple[float, float] | None:
        """Return the vector from one marker to another, if it was ever seen."""
        if (one, other) in self.px:
            return self.px[one, other]
        if (other, one) in self.px:
            x, y = self.px[other, one]
            return -x, -y
        return None


def found_again(
    lost: Sequence[Lost],
    seen: Mapping[str, Detection],
    bodies: Mapping[str, str | None],
    vectors: MarkerVectors,
) -> dict[str, Detection]:
    """Return the lost markers that can be told with confidence.

    Parameters
    ----------
    lost
        Markers looked for.
    seen
        Markers found in this picture already.
    bodies
        The body of each marker.
    vectors
        How the markers of a body lie to each other.
    """
    groups: dict[str, list[Lost]] = {}
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
    markers: Sequence[Lost], mates: Mapping[str, Detection], vectors: MarkerVectors
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
        gap = max(marker.gap_s for marker in markers)
        if not _keeps_shape(chosen, mates, vectors, gap):
            continue
        if not mates and len(chosen) == 1 and not _beyond_doubt(markers, chosen, vectors):
            continue
        cost = sum(
            COST_OF_NONE if s is None else (_away(m, s) / m.gate_px) ** 2
            for m, s in zip(markers, spots, strict=True)
        )
        yield cost, chosen


def _keeps_shape(
    chosen: Mapping[str, Detection],
    mates: Mapping[str, Detection],
    vectors: MarkerVectors,
    gap_s: float,
) -> bool:
    """Whether all distances within a body are what they were, and no pair has turned too far."""
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
        if abs(turn) > TURN + TURN_PER_S * gap_s:
            return False
    return True


def _beyond_doubt(
    markers: Sequence[Lost], chosen: Mapping[str, Detection], vectors: MarkerVectors
) -> bool:
    """Whether a lone spot is near enough to its place to be no other marker of its body."""
    (name, spot), *_ = chosen.items()
    marker = next(m for m in markers if m.name == name)
    for other in markers:
        usual = vectors.between(name, other.name) if other.name != name else None
        if usual is not None and _away(marker, spot) > LONE_SHARE * math.hypot(*usual):
            return False
    return True


def _away(marker: Lost, spot: Detection) -> float:
    return math.hypot(spot.x - marker.expected[0], spot.y - marker.expected[1])


def overlap(one: Detection, other: Detection) -> bool:
    """Whether two detections are one spot."""
    return math.hypot(one.x - other.x, one.y - other.y) < 0.7 * (one.radius + other.radius)


def _all_apart(spots: Sequence[Detection], others: Sequence[Detection]) -> bool:
    return not any(overlap(a, b) for a, b in itertools.combinations(spots, 2)) and not any(
        overlap(a, b) for a in spots for b in others
    )
