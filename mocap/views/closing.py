"""What a conversion ends with in words: how well it went, and what to look at."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from geometry2d.foundation.text import counted
from mocap.tracking.tracks import Tracks

UNSEEN_MOST = 3
"""Markers that are named, with where they are not seen; the others are only counted."""


def closing_lines(report: Mapping[str, Any], tracks: Tracks) -> list[str]:
    """Return the lines that a conversion ends with.

    Parameters
    ----------
    report
        The summary, as of :func:`mocap.views.summary.summary`.
    tracks
        Of all markers.
    """
    motion = report["relative"]
    scales = [
        f"{body} {scale['px_per_mm_first']:.2f} px/mm"
        + ("" if scale["from_marks_of"] == body else f" (that of {scale['from_marks_of']})")
        for body, scale in report["scale"].items()
    ]
    drinking = report["drinking"]
    phases = [f"{name} {a:.2f} to {b:.2f}" for name, (a, b) in drinking["phases_s"].items()]
    return [
        _seen(tracks),
        f"scale: {', '.join(scales)}",
        "standard error of the motion, neck seen from the head: "
        f"{motion['sigma_x_mm_median']:.2f} mm in x, {motion['sigma_y_mm_median']:.2f} mm in y, "
        f"{motion['sigma_theta_deg_median']:.2f}°",
        _level(motion),
        f"phases, s: {', '.join(phases) or 'none found'}",
        f"style: {drinking['style']} ({drinking['style_reason']})",
        f"look at: {'; '.join(_to_look_at(report, tracks))}",
    ]


def _level(motion: Mapping[str, Any]) -> str:
    """Return what is taken for level, and what it costs if it is not: no mark tells a roll."""
    if not motion["level_assumed"]:
        return "level: by the world's axes of [plane]"
    return (
        "level: the camera is taken for level; each degree of its roll turns the neck about the "
        f"ear by {motion['roll_mm_per_deg']:.1f} mm, which no standard error holds"
    )


def _seen(tracks: Tracks) -> str:
    """Return in how many frames the markers are seen, and which ones are not always."""
    known = {name: tracks.known(name) for name in tracks.names}
    shares = {name: float(seen.mean()) for name, seen in known.items()}
    whole = [name for name, share in shares.items() if share == 1.0]
    mean = 100 * sum(shares.values()) / len(shares)
    text = f"markers: {len(shares)}, seen in {mean:.3g} % of {tracks.frame.size} frames"
    rest = sorted((share, name) for name, share in shares.items() if share < 1.0)
    if not rest:
        return text
    named = [f"{name} in {100 * share:.3g} %" for share, name in rest[:UNSEEN_MOST]]
    more = len(rest) - len(named)
    others = f" and {more} more" if more > 0 else ""
    return f"{text}; {len(whole)} always, {', '.join(named)}{others}"


def _to_look_at(report: Mapping[str, Any], tracks: Tracks) -> Iterator[str]:
    """Yield which file shows what, the doubtful instants first."""
    hidden = _longest_unseen(tracks)
    if hidden is None:
        yield "overlay.mp4, whether each cross stays on its marker"
    else:
        name, start_s, end_s = hidden
        yield (
            f"overlay.mp4 at {start_s:.2f} to {end_s:.2f} s, where {name} is not seen, and whether "
            "each cross stays on its marker"
        )
    yield "motion.png, whether it is smooth"
    if report["warnings"]:
        count = counted(len(report["warnings"]), "warning", "warnings")
        yield f"summary.json for the {count} above"


def _longest_unseen(tracks: Tracks) -> tuple[str, float, float] | None:
    """Return the marker that is not seen for longest at a stretch, from when to when, s."""
    longest: tuple[int, str, int] = (0, "", 0)
    for name in tracks.names:
        run = 0
        for frame, seen in enumerate(tracks.known(name)):
            run = 0 if seen else run + 1
            longest = max(longest, (run, name, frame))
    count, name, last = longest
    if count == 0:
        return None
    return name, float(tracks.time_s[last - count + 1]), float(tracks.time_s[last])
