"""Which error a fault of filming makes: the table of the filming guide, by the virtual camera.

    python -m benchmarks.filming_errors
    python -m benchmarks.filming_errors --seeds 1 "as the guide says"

Every row is the same sip with one fault, drawn by the camera of ``mocap.synthetic`` and measured by
``convert``: 1280×720 px, 3 px/mm, 25 frames/s. ``error`` is that of the package's position seen
from the head, RMS over the half of the sip that is nearest to the mouth, one coordinate; ``stated``
is the median of ``sigma_x_mm`` and ``sigma_y_mm`` there; ``seen`` the share of frames in which the
worst marker is seen. The seeds differ in motion and noise. Takes about five minutes of one core.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidMotion, rotated
from mocap.convert import convert
from mocap.synthetic.truth import Truth
from tests.support.clips import Clip

Array = NDArray[np.float64]

SEEDS = 3
GOOD = Clip(
    width=1280,
    height=720,
    px_per_mm=3.0,
    frames=36,
    jaw=False,
    full_well_e=9000.0,
    exposure_s=0.004,
    crf=18.0,
)
NEARER_MM = 30.0
"""How much nearer to the camera an ear is than the middle of the neck, about."""


@dataclass(frozen=True)
class Rolled(Clip):
    """A clip whose camera is not level."""

    roll_deg: float = 3.0

    def motions(self) -> tuple[RigidMotion, RigidMotion]:
        """Motions of head and package, turned about the camera's axis."""
        angle = np.radians(self.roll_deg)
        head, package = (
            RigidMotion(one.time_s, one.angle_rad + angle, rotated(one.shift_mm, angle))
            for one in super().motions()
        )
        return head, package

    def relative_truth(self, truths: list[Truth]) -> tuple[Array, Array]:
        """Return the motion in the axes of a camera that is level."""
        places, turns = super().relative_truth(truths)
        return rotated(places, -np.radians(self.roll_deg)), turns


@dataclass(frozen=True)
class Case:
    """A fault: the clip that has it, and what the marker file says wrongly."""

    clip: Clip
    change: Callable[[str], str] = str


def _without_head(text: str) -> str:
    return "\n".join(line for line in text.splitlines() if not line.startswith("head = "))


def _longer(share: float) -> Callable[[str], str]:
    return lambda text: text.replace("package = 14.0", f"package = {14 * (1 + share):.3f}")


def _without_lens(text: str) -> str:
    start = text.index("[lens]")
    return text[:start] + text[text.index("[markers]") :]


DEEP = replace(GOOD, head_depth_mm=NEARER_MM)
CASES: Mapping[str, Case] = {
    "as the guide says": Case(DEEP),
    "the ear-to-nose distance not given": Case(DEEP, _without_head),
    "the same, camera at 0.7 m": Case(replace(DEEP, distance_mm=700.0), _without_head),
    "neck's distance measured 0.3 mm wrong": Case(DEEP, _longer(0.3 / 14)),
    "dots of 2 mm, half as many px": Case(replace(DEEP, dot_radius_mm=1.25, px_per_mm=1.5)),
    "out of focus": Case(replace(DEEP, blur_px=3.0)),
    "exposure 1/25 s": Case(replace(DEEP, exposure_s=0.04)),
    "a dark room: a sixtieth of the light": Case(replace(DEEP, full_well_e=150.0)),
    "strong compression": Case(replace(DEEP, crf=32.0)),
    "package turned 10° out of the plane": Case(replace(DEEP, tilt_deg=(0.0, 10.0))),
    "wide lens at 0.45 m, not calibrated": Case(
        replace(DEEP, lens=(-0.2, 0.0), distance_mm=450.0), _without_lens
    ),
    "camera rolled by 3°": Case(Rolled(**{**vars(DEEP), "roll_deg": 3.0})),
}


@dataclass(frozen=True)
class Outcome:
    """What a measurement of a clip was worth."""

    error_mm: float
    stated_mm: float
    seen: float


def measured(case: Case, seed: int) -> Outcome:
    """Draw a clip, convert it, and compare it with what was drawn."""
    clip = replace(case.clip, seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        video, markers, truths = clip.write(Path(folder))
        markers.write_text(case.change(markers.read_text(encoding="utf-8")), encoding="utf-8")
        result = convert(video, markers)
    places, _ = clip.relative_truth(truths)
    places = places[[int(frame) for frame in result.measured.capture.frame]]
    near = places[:, 0] <= np.median(places[:, 0])
    away = (result.motion.relative_mm - places)[near]
    known = [result.tracks.known(name).mean() for name in result.tracks.names]
    return Outcome(
        error_mm=float(np.sqrt(np.mean(away**2))),
        stated_mm=float(np.median(result.motion.sigma[near, :2])),
        seen=float(min(known)),
    )


def row(name: str, seeds: int) -> str:
    """Return a row of the table."""
    found: list[Outcome] = []
    refused = 0
    for seed in range(seeds):
        try:
            found.append(measured(CASES[name], seed))
        except DrinksimError:
            refused += 1
    left = f"{refused} of {seeds} refused" if refused else ""
    if not found:
        return f"| {name} | | | {left} |"
    error, stated = ([getattr(one, key) for one in found] for key in ("error_mm", "stated_mm"))
    seen = f"{100 * min(one.seen for one in found):.0f} %"
    return (
        f"| {name} | {_span(error)} | {_span(stated)} | {', '.join(filter(None, [seen, left]))} |"
    )


def _span(values: list[float]) -> str:
    low, high = f"{min(values):.2f}", f"{max(values):.2f}"
    return low if low == high else f"{low} to {high}"


def rows(names: list[str], seeds: int) -> Iterator[str]:
    """Yield the lines of the table."""
    yield "| what | error, mm | stated, mm | seen |"
    yield "|---|---|---|---|"
    for name in names or CASES:
        yield row(name, seeds)


def main(arguments: list[str]) -> None:
    """Print the table, or the rows that are named."""
    seeds = SEEDS
    if "--seeds" in arguments:
        at = arguments.index("--seeds")
        seeds = int(arguments[at + 1])
        arguments = arguments[:at] + arguments[at + 2 :]
    for line in rows(arguments, seeds):
        print(line, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
