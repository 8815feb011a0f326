"""Identification of markers without a given position by the layout of a face and a package.

The person faces right, and the package is on the right. The package marks are the pair whose
distance is least for its size. Ear and nose are the widest pair on the other side, about level. Jaw
markers lie below the line from ear to nose.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

from mocap.tracking.detect import Detection
from mocap.tracking.errors import TrackingError, UnnamedSpotsError
from mocap.tracking.markers import DEFAULT_BODIES, MarkerFile

# Range of the distance from ear to nose of adults, mm, with a wide margin.
EAR_NOSE_MM = (75.0, 150.0)
# Range of a marker's radius, mm, with a wide margin; smaller and larger spots are texture.
DOT_MM = (0.8, 8.0)
# Largest ratio of sizes and of contrasts of the two marks of a body.
PAIR_SIZE_RATIO = 1.6
PAIR_CONTRAST_RATIO = 1.8
# Least ratio of the contrasts of head and package: who puts on markers uses one kind of them, if
# not on one ground.
ONE_KIND = 0.2
MOST_SPOTS = 40
# Markers are placed below the line from ear to nose, on the jaw, and not above it.
COST_OF_A_SPOT_ABOVE = 0.15
# An arrangement is taken only if every other one costs so much more: where prints and freckles make
# rivals, right and wrong ones differ by less than 0.11. One that costs more itself is as far from a
# usual face: right ones cost 0.04 to 0.13 in rendered recordings.
SURE_MARGIN = 0.2
MOST_LISTED = 12


def assign_layout(
    spots: Sequence[Detection],
    known: Mapping[str, Detection],
    sought: Sequence[str],
    markers: MarkerFile,
    frame: int,
) -> dict[str, Detection]:
    """Return the spot of each marker that is sought.

    Parameters
    ----------
    spots
        All spots of the picture that resemble markers.
    known
        Markers already located.
    sought
        Names of the markers to assign.
    markers
        The marker file, for distances in mm.
    frame
        Number of the frame, for messages.

    Raises
    ------
    UnnamedSpotsError
        If no arrangement of the spots is a face with a package, or several could be.
    TrackingError
        If a marker is none of those of face and package.
    """
    free = [
        spot
        for spot in spots
        if all(math.hypot(spot.x - k.x, spot.y - k.y) > spot.radius for k in known.values())
    ]
    free = sorted(free, key=lambda spot: -abs(spot.contrast) / (1 + 20 * spot.misfit))[:MOST_SPOTS]
    standard = {name for members in DEFAULT_BODIES.values() for name in members}
    if not set(sought) <= standard:
        raise TrackingError(
            f"{sorted(set(sought) - standard)[0]}: give its position in [markers]; only the usual "
            "markers of face and package are recognised by their layout"
        )
    if len(free) < len(sought):
        raise _unnamed(
            f"frame {frame}: {len(free)} round spots were found for {len(sought)} markers "
            f"({', '.join(sought)}); give their positions in [markers], or start at a frame "
            "that shows them with --start",
            free,
            frame,
        )
    found: list[tuple[float, dict[str, Detection]]] = []
    for package in _package_choices(free, known, sought):
        for head in _head_choices(free, known, sought, package, markers):
            chosen = {**known, **package, **head}
            jaw = _jaw_choice(free, chosen, sought)
            if jaw is None or not _sized_like_markers({**chosen, **jaw}, markers):
                continue
            if not _of_one_kind(list(chosen.values())):
                continue
            cost = _cost(chosen, markers) + COST_OF_A_SPOT_ABOVE * _spots_above(free, chosen)
            found.append((cost, {**package, **head, **jaw}))
    if not found:
        raise _unnamed(
            f"frame {frame}: {len(free)} round spots were found, but no arrangement of them is a "
            f"face with a package to its right (with {', '.join(sought)}); give the positions in "
            "[markers]",
            free,
            frame,
        )
    found.sort(key=lambda item: item[0])
    if found[0][0] > SURE_MARGIN:
        raise _unnamed(
            f"frame {frame}: the spots that are most like a face with a package are unlike one: "
            f"give the positions of {', '.join(sought)} in [markers]",
            free,
            frame,
        )
    if len(found) > 1 and found[1][0] - found[0][0] < SURE_MARGIN:
        raise _unsure(found, sought, free, frame)
    return {name: found[0][1][name] for name in sought}


def _unsure(
    found: Sequence[tuple[float, Mapping[str, Detection]]],
    sought: Sequence[str],
    free: Sequence[Detection],
    frame: int,
) -> UnnamedSpotsError:
    """Return which spots could be markers, for a user who says which they are."""
    rivals = [chosen for cost, chosen in found if cost - found[0][0] < SURE_MARGIN]
    return _unnamed(
        f"frame {frame}: {len(rivals)} arrangements of spots could be a face with a package, and "
        f"none is clearly better: give the positions of {', '.join(sought)} in [markers]",
        free,
        frame,
    )


def _unnamed(message: str, free: Sequence[Detection], frame: int) -> UnnamedSpotsError:
    """Return an error whose message lists the spots by numbers, from left to right."""
    places = sorted((spot.x, spot.y) for spot in free)
    listed = ", ".join(
        f"{number} [{x:.0f}, {y:.0f}]" for number, (x, y) in enumerate(places[:MOST_LISTED], 1)
    )
    more = ", …" if len(places) > MOST_LISTED else ""
    spots = f"; the spots are {listed}{more}" if places else ""
    return UnnamedSpotsError(f"{message}{spots}", frame=frame, places_px=places)


def _package_choices(
    free: Sequence[Detection], known: Mapping[str, Detection], sought: Sequence[str]
) -> list[dict[str, Detection]]:
    """Return the possible pairs of package marks, by increasing distance over size."""
    lower, upper = known.get("package_lower"), known.get("package_upper")
    lowers = [lower] if lower is not None else list(free)
    uppers = [upper] if upper is not None else list(free)
    pairs = []
    for one, other in itertools.product(lowers, uppers):
        if one is other or not alike(one, other):
            continue
        if lower is None and upper is None and one.y < other.y:
            continue
        distance = math.hypot(one.x - other.x, one.y - other.y)
        size = one.radius + other.radius
        if distance > 1.2 * size:
            pairs.append((distance / size, {"package_lower": one, "package_upper": other}))
    pairs.sort(key=lambda pair: pair[0])
    return [pair for _, pair in pairs[:12]]


def _head_choices(
    free: Sequence[Detection],
    known: Mapping[str, Detection],
    sought: Sequence[str],
    package: Mapping[str, Detection],
    markers: MarkerFile,
) -> list[dict[str, Detection]]:
    """Return the possible pairs of ear and nose to the left of a pair of package marks."""
    lower, upper = package["package_lower"], package["package_upper"]
    unit = math.hypot(lower.x - upper.x, lower.y - upper.y) / markers.scale_mm["package"]
    rest = [spot for spot in free if spot not in (lower, upper)]
    ears = [known["ear"]] if "ear" in known else rest
    noses = [known["nose"]] if "nose" in known else rest
    least, most = EAR_NOSE_MM
    if "head" in markers.scale_mm:
        least, most = 0.85 * markers.scale_mm["head"], 1.2 * markers.scale_mm["head"]
    choices = []
    for ear, nose in itertools.product(ears, noses):
        if ear is nose or ear.x >= nose.x or nose.x > max(lower.x, upper.x) + 60 * unit:
            continue
        distance = math.hypot(ear.x - nose.x, ear.y - nose.y)
        tilted = abs(ear.y - nose.y) > 0.7 * distance
        if least * unit <= distance <= most * unit and not tilted and alike(ear, nose):
            choices.append({"ear": ear, "nose": nose})
    return choices


def _jaw_choice(
    free: Sequence[Detection], chosen: Mapping[str, Detection], sought: Sequence[str]
) -> dict[str, Detection] | None:
    """Return the jaw markers below the line from ear to nose; jaw_back is nearer to the ear.

    None if there are too few spots.
    """
    wanted = [name for name in ("jaw_back", "jaw_front") if name in sought]
    if not wanted:
        return {}
    ear, nose = chosen["ear"], chosen["nose"]
    along = (nose.x - ear.x, nose.y - ear.y)
    length = math.hypot(*along)
    below = []
    for spot in free:
        if any(spot is other for other in chosen.values()) or not alike(spot, ear):
            continue
        u = ((spot.x - ear.x) * along[0] + (spot.y - ear.y) * along[1]) / length**2
        v = ((spot.y - ear.y) * along[0] - (spot.x - ear.x) * along[1]) / length**2
        if 0.2 < u < 1.25 and 0.5 < v < 1.8:
            below.append((u, spot))
    if len(below) < len(wanted):
        return None
    below.sort(key=lambda item: item[0])
    ends = [below[0][1], below[-1][1]] if len(wanted) == 2 else [below[-1][1]]
    return dict(zip(wanted, ends, strict=True))


def _spots_above(free: Sequence[Detection], chosen: Mapping[str, Detection]) -> int:
    """Return the number of spots on the face above the line from ear to nose."""
    ear, nose = chosen["ear"], chosen["nose"]
    along = (nose.x - ear.x, nose.y - ear.y)
    length = math.hypot(*along)
    others = [spot for spot in free if all(spot is not taken for taken in chosen.values())]
    count = 0
    for spot in others:
        u = ((spot.x - ear.x) * along[0] + (spot.y - ear.y) * along[1]) / length**2
        v = ((spot.y - ear.y) * along[0] - (spot.x - ear.x) * along[1]) / length**2
        count += 0.2 < u < 1.4 and -1.0 < v < -0.1 and alike(spot, ear)
    return count


def _cost(chosen: Mapping[str, Detection], markers: MarkerFile) -> float:
    """Return the cost of an arrangement: its distance from usual proportions."""
    lower, upper = chosen["package_lower"], chosen["package_upper"]
    unit = math.hypot(lower.x - upper.x, lower.y - upper.y) / markers.scale_mm["package"]
    ear, nose = chosen["ear"], chosen["nose"]
    width = math.hypot(ear.x - nose.x, ear.y - nose.y) / unit
    usual = markers.scale_mm.get("head", 105.0)
    unlike = abs(math.log(lower.radius / upper.radius)) + abs(math.log(ear.radius / nose.radius))
    return abs(math.log(width / usual)) + unlike + 0.2 * abs(ear.y - nose.y) / (unit * width)


def _sized_like_markers(chosen: Mapping[str, Detection], markers: MarkerFile) -> bool:
    """Whether all spots have the size of markers, by the scale of the package marks."""
    lower, upper = chosen["package_lower"], chosen["package_upper"]
    unit = math.hypot(lower.x - upper.x, lower.y - upper.y) / markers.scale_mm["package"]
    return all(DOT_MM[0] < spot.radius / unit < DOT_MM[1] for spot in chosen.values())


def _of_one_kind(spots: Sequence[Detection]) -> bool:
    """Whether all spots are dark, or all light, and none is much fainter than another."""
    contrasts = [spot.contrast for spot in spots]
    least, most = min(contrasts, key=abs), max(contrasts, key=abs)
    return all(c * most > 0 for c in contrasts) and abs(least) > ONE_KIND * abs(most)


def alike(one: Detection, other: Detection) -> bool:
    """Whether two spots have the sizes and the contrasts of markers of one kind."""
    size, contrast = one.radius / other.radius, one.contrast / other.contrast
    return (
        1 / PAIR_SIZE_RATIO < size < PAIR_SIZE_RATIO
        and 1 / PAIR_CONTRAST_RATIO < contrast < PAIR_CONTRAST_RATIO
    )
