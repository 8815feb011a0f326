"""What a run's numbers mean, in words: every sentence about a run is made here, from numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from scenarios.messages.verdict import FAILURE, PAIN, Verdict
from scenarios.results.quantities import LIPS

CRUSHED_MM = 0.1
"""Penetration that no pressure a lip can carry explains: some 5 MPa."""

MESH_DOUBT = 0.15
"""From here on two measures of one pressure differ by more than necks may be compared by."""

SHORT_EDGE_MM = 0.25
"""Two edges to the window over which pressure is averaged."""

FELT_CONTRAST = 0.1
"""From here on crests are said to be felt: pressures on skin are told apart from about 10 % on, an
estimate after Weber's law."""


def ending(
    status: str,
    *,
    increments: int,
    iterations: int,
    cutbacks: int,
    resumed_at_s: float | None,
    stopped_at_s: float | None,
    end_s: float,
) -> str:
    """Return how a replay ended.

    Parameters
    ----------
    status
        The solver's own words.
    increments, iterations, cutbacks
        What it took, since the replay was resumed if it was.
    resumed_at_s, stopped_at_s
        Where it went on, and where it stopped before its end; None if it did not.
    end_s
        End of the period to be replayed, s.
    """
    message = f"{status} in {increments} increments ({iterations} iterations, {cutbacks} cutbacks)"
    if resumed_at_s is not None:
        message += f" since it was resumed at {resumed_at_s:.3f} s"
    if stopped_at_s is not None:
        message += f", stopped at {stopped_at_s:.3f} s of {end_s:.3f} s"
    return message


def placement_message(about: Mapping[str, Any]) -> str | None:
    """Return what was moved before the replay, from the summary's ``placement``, if it was."""
    package = about["shift_x_mm"], about["shift_y_mm"]
    lower_face = about["lower_face_x_mm"], about["lower_face_y_mm"]
    moved = [
        f"{what} by ({x:+z.1f}, {y:+z.1f}) mm"
        for what, (x, y) in (("the package", package), ("the lower face", lower_face))
        if x or y
    ]
    if about["turn_deg"]:
        moved.append(f"the package turned by {about['turn_deg']:.1f}°")
    if not moved:
        return None
    how = "found from the first contacts" if about["found_with_sigma"] else "as the scenario says"
    return f"moved, {how}: {', '.join(moved)}"


def carried_message(about: Mapping[str, Any]) -> str | None:
    """Return how a neck that was not filmed is carried, from ``placement.carried``."""
    along, across = about["shift_along_axis_mm"], about["shift_across_axis_mm"]
    if not (along or across):
        return None
    held = {
        "lower_rim": "lower rim edge",
        "rim_centre": "rim centre",
        "marks": "lower mark",
    }[about["anchor"]]
    return (
        f"this neck was not filmed: its {held} is where the filmed neck's was, and its lower mark "
        f"({along:+z.1f}, {across:+z.1f}) mm along and across the axis from the filmed one's; if "
        "it was filmed, say so in [filmed]"
    )


def hand_message(about: Mapping[str, Any]) -> str:
    """Return how the package was carried, from the summary's ``hand``."""
    if about["mode"] == "same":
        return f"carried by the hand of the reference run {about['reference']}, which yields"
    if "upper_n" in about:
        return (
            f"each lip bore what was stated, {about['upper_n']:.2f} N the upper and "
            f"{about['lower_n']:.2f} N the lower"
        )
    return f"each lip bore what it bore in the reference run {about['reference']}"


def muscle_message(about: Mapping[str, Any]) -> str:
    """Return which lip is pulled how, from the summary's ``muscle``."""
    return (
        f"the {about['lip']} lip pulled with {about['traction_kpa']:.2f} kPa towards "
        f"{about['direction_deg']:.0f}°, {about['clearance_mm']:.1f} mm clear of the neck"
        f"{' (found)' if about['found'] else ''}"
    )


def skin_message(about: Mapping[str, float]) -> str:
    """Return under which tension the skin is as drawn, from the summary's ``skin``."""
    return f"the skin is under {about['mean_tension_kpa']:.1f} kPa of tension as it is drawn"


def muscles_message(about: Mapping[str, Mapping[str, float]]) -> str:
    """Return how active which muscles are at most, from the summary's ``muscles``."""
    active = [
        f"{name.replace('_', ' ')} {muscle['activation']:.2f} ({muscle['tension_n']:.1f} N)"
        for name, muscle in about.items()
    ]
    return f"muscles at most as active as: {', '.join(active)}"


def activations_message(about: Mapping[str, Mapping[str, Any]]) -> str:
    """Return which activations were found and by what, from the summary's ``activations``."""
    found = [_activation_found(name.replace("_", " "), each) for name, each in about.items()]
    return f"activations found: {'; '.join(found)}"


def _activation_found(muscle: str, about: Mapping[str, Any]) -> str:
    if about["least"] == 0:
        return f"{muscle} none, as the passive lip does what was seen ({about['fixed_by']})"
    return (
        f"{muscle} {about['least']:.3f}, the least that {about['fixed_by']} (up to "
        f"{about['twice']:.3f} would not contradict it)"
    )


def unstable_message(passages: Sequence[Mapping[str, Any]]) -> str | None:
    """Return when and where the equilibrium was unstable, from the summary's ``unstable``."""
    if not passages:
        return None
    longest = max(passages, key=lambda passage: passage["to_s"] - passage["from_s"])
    times = "once" if len(passages) == 1 else f"{len(passages)} times, longest"
    return (
        f"the equilibrium was unstable {times} from {longest['from_s']:.3f} to "
        f"{longest['to_s']:.3f} s, most of all the {longest['lip']} lip "
        f"{longest['arc_mm']:.1f} mm along its surface "
        f"({longest['x_mm']:.1f}, {longest['y_mm']:.1f} mm), and was passed with inertia"
    )


def crushed_message(deepest_mm: float) -> str | None:
    """Return that a lip was caught between neck and teeth, if it was."""
    if deepest_mm <= CRUSHED_MM:
        return None
    return (
        f"the neck went {deepest_mm:.2f} mm into a lip, as if driven into the teeth: do not "
        "trust what follows, and move the package with placement.shift_x_mm"
    )


def mesh_doubt(lip: str, about: Mapping[str, Any]) -> float:
    """Return by which share two measures of a lip's pressure over half a millimetre differ."""
    low, high = sorted(_two_ways(lip, about))
    return (high - low) / high if high > 0 else 0.0


def _two_ways(lip: str, about: Mapping[str, Any]) -> list[float]:
    return [about[f"highest_{way}_{lip}_lip_kpa"] for way in ("window", "recovered_window")]


def mesh_message(
    lip: str, about: Mapping[str, Any], *, contact_mm: float, layer_mm: float
) -> str | None:
    """Return that the mesh is too coarse for a lip's pressure over half a millimetre, if it is.

    Parameters
    ----------
    lip
        Which one.
    about
        Numbers for the summary, with both measures of that pressure.
    contact_mm, layer_mm
        Edge length at the lip's margin, and the largest one along the dermis, mm.
    """
    if mesh_doubt(lip, about) <= MESH_DOUBT:
        return None
    ways = _two_ways(lip, about)
    edge_mm = SHORT_EDGE_MM if layer_mm > SHORT_EDGE_MM else 0.5 * layer_mm
    remedy = f"numerics.mesh.layer_mm = {edge_mm:.2g}"
    if contact_mm > edge_mm:
        remedy += f" and contact_mm = {edge_mm:.2g}"
    return (
        f"the mesh is too coarse where the {lip} lip is pressed most: two measures of the same "
        f"forces say {ways[0]:.0f} and {ways[1]:.0f} kPa over half a millimetre; give {remedy} "
        "before you compare necks by that"
    )


def caught_message(lips: Sequence[str]) -> str | None:
    """Return that these lips hang on a neck that has left them, if there are any."""
    if not lips:
        return None
    return (
        f"the {' and '.join(lips)} lip still hung on the neck at the end, as if caught by the "
        "thread: a person would have let go, so do not trust how far it was pulled along"
    )


def lips_message(pulled: Sequence[bool], acting: Sequence[bool]) -> str:
    """Return how active lips are, given in which runs a load and in which muscles act on them."""
    if any(acting):
        where = "" if all(acting) else " in some of the runs"
        return (
            f"Muscles of the lips act{where}; how active a person's are is not known from one "
            "film. Nothing is pre-stressed."
        )
    if not any(pulled):
        return "The lips are passive: no muscle acts and nothing is pre-stressed."
    where = "" if all(pulled) else " in some of the runs"
    return (
        f"The lips are passive but for a load that stands for a muscle{where}; nothing is "
        "pre-stressed."
    )


def acting_message(summary: Mapping[str, Any]) -> str:
    """Return who carried the package of a run and how active its lips were, from its summary."""
    told = [
        hand_message(summary["hand"])
        if "hand" in summary
        else "the neck followed the film, whatever it took"
    ]
    if "activations" in summary:
        told.append(activations_message(summary["activations"]))
    elif "muscles" in summary:
        told.append(muscles_message(summary["muscles"]))
    return " ".join(f"{each[0].upper()}{each[1:]}." for each in told)


def felt_message(summary: Mapping[str, Any]) -> str:
    """Return what each lip feels, from a run's summary."""
    return " ".join(_felt_by(lip, summary) for lip in LIPS)


def _felt_by(lip: str, summary: Mapping[str, Any]) -> str:
    peak = summary[f"{lip}_lip_window_1_5mm_kpa"]
    if peak <= 0.0:
        return f"The {lip} lip feels nothing."
    mean, contrast = summary[f"{lip}_lip_mean_kpa"], summary[f"{lip}_lip_crest_contrast"]
    crests = (
        f"crests stand out of it by up to {100 * contrast:.0f} %, and are felt one by one"
        if contrast >= FELT_CONTRAST
        else f"crests hardly stand out of it ({100 * contrast:.0f} % at most)"
    )
    return (
        f"The {lip} lip feels up to {peak:.0f} kPa over the 1.5 mm that it resolves, and "
        f"{mean:.0f} kPa on average where it is touched; {crests}.{_seal_of(lip, summary)}"
    )


def _seal_of(lip: str, summary: Mapping[str, Any]) -> str:
    margin = summary.get(f"{lip}_lip_seal_margin_kpa")
    if margin is None:
        return ""
    if margin < 0:
        return f" It does not seal: the liquid presses {-margin:.1f} kPa more at some instant."
    return f" It seals with at least {margin:.1f} kPa to spare."


def verdict_message(verdict: Verdict) -> str:
    """Return what the peaks of a run mean beside what skin bears and what hurts."""
    return f"{_pressure_message(verdict)}; {_strain_message(verdict)}."


def _pressure_message(verdict: Verdict) -> str:
    pressure = verdict.pressure_kpa
    if pressure <= 0.0:
        return "The neck never presses a lip"
    pressed = (
        f"The {verdict.lip} lip is pressed most, with {pressure:.0f} kPa over half a millimetre, "
    )
    hurts = f"{PAIN.low:.0f} to {PAIN.high:.0f} kPa"
    if pressure < PAIN.low:
        share = 100 * pressure / PAIN.low
        return pressed + f"{share:.0f} % of the lowest pressure that hurt volunteers ({hurts})"
    if pressure < PAIN.high:
        return pressed + f"which is within the range that hurt volunteers ({hurts})"
    return pressed + f"which is above the whole range that hurt volunteers ({hurts})"


def _strain_message(verdict: Verdict) -> str:
    percent = 100 * math.expm1(verdict.log_strain)
    beyond = "below" if verdict.log_strain < FAILURE.low else "beyond"
    return (
        f"the dermis is stretched by up to {percent:.0f} % (log strain "
        f"{verdict.log_strain:.2f}), {beyond} the 54 % ({FAILURE.low:.2f}) at which skin tore"
    )
