"""How well drawn clips are tracked, and whether stated errors are true.

Run with ``python -m benchmarks.tracking_accuracy [CLIPS] [FIRST_SEED]`` (30 clips, about eight
minutes of one core). The clips are those of ``tracking_takes``. Printed for each and for all:

- RMS error per coordinate of markers that are seen; clean clips and noisy ones apart;
- swaps: sightings nearer to something else (another marker, a spot of the hand) than to the marker
  itself, or more than a pixel off;
- returns: of the markers that the hand hid, how many are seen again at most half a second after
  they are wholly visible, and themselves;
- pixel locking: the mean error as a function of where in a pixel the marker lies, clean clips;
- the relative motion's RMS error, and errors over stated ones. Of honest normal errors 0.683 lie
  within one standard error and 0.954 within two. Pixels are independent from frame to frame; scale
  and smoothing make a clip's motion errors go together, so that there the clip is what counts.

Then the head 65 mm nearer the camera than the package, at 1.5 m, with and without its own scale.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.tracking_takes import HEADINGS, Take, relative_truth
from geometry2d.rigid import rotated
from mocap.convert import measure
from mocap.measurement import Measurement
from mocap.motion.projection import PictureFormat
from mocap.synthetic.truth import Truth
from mocap.tracking.follow import follow
from mocap.tracking.marker_file import read_markers
from mocap.tracking.noise import with_temporal_noise
from mocap.tracking.tracks import Tracks
from mocap.video.frames import Video

Array = NDArray[np.float64]

CLIPS = 30
# A marker more than this (px) from its place while it is said to be seen is something else.
ASTRAY_PX = 1.0
RETURN_S = 0.5
PHASES = 10
DEPTH_SEEDS = (0, 1, 2, 3, 4, 5, 6)
DEPTH_MM, DISTANCE_MM = 65.0, 1500.0


@dataclass(frozen=True)
class Outcome:
    """What became of one clip."""

    take: Take
    tracks: Tracks
    measured: Measurement
    truths: list[Truth]

    @classmethod
    def of(cls, take: Take, folder: Path, *, head_scale: bool = True) -> Outcome:
        """Draw a clip into a folder and measure it."""
        video, markers, truths = take.write(folder)
        if not head_scale:
            markers.write_text(take.marker_file(truths[0], head_scale=False), encoding="utf-8")
        file, film = read_markers(markers), Video(video)
        tracks = with_temporal_noise(
            follow(film, file), bodies=file.rigid_bodies, key_frames=film.key_frames
        ).interpolated()
        measured = measure(tracks, file, PictureFormat(take.camera.width, take.camera.height))
        return cls(take, tracks, measured, truths)

    @property
    def right_px(self) -> Array:
        """True positions (n, m, 2)."""
        names = self.tracks.names
        return np.array([[_place(truth, name) for name in names] for truth in self.truths])

    @property
    def off_px(self) -> Array:
        """Errors (n, m, 2)."""
        return self.tracks.position_px - self.right_px

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Return (n, m) where markers are said to be seen."""
        return np.asarray(self.tracks.status == "seen")

    def swaps(self) -> int:
        """Return the number of sightings of something that is not the marker."""
        others = np.array(
            [[_place(t, name) for name in self.truths[0].markers] for t in self.truths]
        )
        found = self.tracks.position_px[:, :, None]
        away = np.hypot(*np.moveaxis(found - others[:, None], -1, 0))
        own = np.hypot(*np.moveaxis(self.off_px, -1, 0))
        elsewhere = away.min(axis=2) < own - 1e-6
        return int(np.sum(self.seen & (elsewhere | (own > ASTRAY_PX))))

    def returns(self) -> tuple[int, int]:
        """Return how many hidden markers came back as themselves, and how many were hidden."""
        back = hidden = 0
        own = np.hypot(*np.moveaxis(self.off_px, -1, 0))
        for k, name in enumerate(self.tracks.names):
            visible = np.array([truth.markers[name].visible for truth in self.truths])
            if visible.min() > 0.5:
                continue
            hidden += 1
            last = int(np.flatnonzero(visible < 0.99)[-1])
            after = slice(last + 1, last + 2 + round(RETURN_S * self.take.camera.fps))
            back += bool(np.any(self.seen[after, k] & (own[after, k] < ASTRAY_PX)))
        return back, hidden

    def motion_errors(self) -> tuple[Array, Array]:
        """Return the errors of relative position (n, 2) mm and rotation (n,) rad."""
        place, turn = relative_truth(self.truths)
        motion = self.measured.motion
        rows = np.searchsorted(self.tracks.frame, self.measured.capture.frame)
        first = rows[0]
        turn = turn - turn[first]
        return motion.relative_mm - _seen_from(place, self.truths, first)[rows], (
            motion.relative_rad - turn[rows]
        )

    def scores(self) -> dict[str, Array]:
        """Return errors over stated standard errors by quantity."""
        place, turn = self.motion_errors()
        sigma = self.measured.motion.sigma
        return {
            "pixels": (self.off_px[self.seen] / self.tracks.sigma_px[self.seen][:, None]).ravel(),
            "x": place[:, 0] / sigma[:, 0],
            "y": place[:, 1] / sigma[:, 1],
            # The first frame's angle is zero by definition.
            "theta": turn[1:] / sigma[1:, 2],
        }


def _place(truth: Truth, name: str) -> tuple[float, float]:
    return truth.markers[name].x_px, truth.markers[name].y_px


def _seen_from(place: Array, truths: list[Truth], first: int) -> Array:
    """Return positions in the head frame whose axes are the world's in frame ``first``."""
    head = [truth.placements["head"].angle_rad for truth in truths]
    return np.asarray(rotated(place, head[first] - head[0]))


def rms(values: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else float("nan")


def locking(outcomes: list[Outcome]) -> Array:
    """Return the mean error (px) by position within a pixel, over all coordinates seen."""
    phase = np.concatenate([o.right_px[o.seen].ravel() % 1 for o in outcomes])
    off = np.concatenate([o.off_px[o.seen].ravel() for o in outcomes])
    bin_of = np.minimum((phase * PHASES).astype(int), PHASES - 1)
    return np.array([off[bin_of == k].mean() for k in range(PHASES)])


def main() -> None:
    """Print the clips, then what all of them say together."""
    clips = int(sys.argv[1]) if len(sys.argv) > 1 else CLIPS
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    outcomes: list[Outcome] = []
    print(
        f"{HEADINGS}            | px: RMS swaps back | mm RMS  deg RMS | error/stated: px x y theta"
    )
    for seed in range(first, first + clips):
        with tempfile.TemporaryDirectory() as folder:
            outcome = Outcome.of(Take.of(seed), Path(folder))
        outcomes.append(outcome)
        back, hidden = outcome.returns()
        place, turn = outcome.motion_errors()
        ratios = " ".join(f"{rms(score):5.2f}" for score in outcome.scores().values())
        print(
            f"{outcome.take} | {rms(outcome.off_px[outcome.seen]):.3f} {outcome.swaps():3d} "
            f"{back}/{hidden} | {rms(place):.3f} {np.degrees(rms(turn)):.3f} | {ratios}",
            flush=True,
        )
    _print_totals(outcomes)
    _print_depth()


def _print_totals(outcomes: list[Outcome]) -> None:
    for kind, chosen in (
        ("clean", [o for o in outcomes if o.take.clean]),
        ("noisy", [o for o in outcomes if not o.take.clean]),
    ):
        each = [rms(o.off_px[o.seen]) for o in chosen]
        off = np.concatenate([o.off_px[o.seen] for o in chosen])
        x, y = rms(off[:, 0]), rms(off[:, 1])
        print(f"{kind}: {len(chosen)} clips, RMS px x {x:.3f} y {y:.3f}, worst {max(each):.3f}")
    back, hidden = np.sum([o.returns() for o in outcomes], axis=0)
    print(f"sightings of something else: {sum(o.swaps() for o in outcomes)}")
    print(f"hidden markers that came back as themselves: {back} of {hidden}")
    curve = locking([o for o in outcomes if o.take.clean])
    print("mean error by tenth of a pixel, clean:", " ".join(f"{value:+.4f}" for value in curve))
    print("\nquantity | within 1 sigma | within 2 sigma | samples")
    for name in ("pixels", "x", "y", "theta"):
        score = np.abs(np.concatenate([o.scores()[name] for o in outcomes]))
        print(f"{name:8} | {np.mean(score < 1):.3f} | {np.mean(score < 2):.3f} | {score.size}")


def _print_depth() -> None:
    print("\nhead 65 mm nearer, at 1.5 m: RMS mm and deg with [scale] head | without | size, seed")
    for seed in DEPTH_SEEDS:
        take = Take.of(seed)
        grown = DISTANCE_MM / take.camera.distance_mm
        focal = (take.camera.focal_px[0] * grown, take.camera.focal_px[1] * grown)
        camera = replace(take.camera, distance_mm=DISTANCE_MM, focal_px=focal)
        near = replace(take, camera=camera, head_depth_mm=DEPTH_MM, hand=False)
        cells = []
        for head_scale in (True, False):
            with tempfile.TemporaryDirectory() as folder:
                outcome = Outcome.of(near, Path(folder), head_scale=head_scale)
            place, turn = outcome.motion_errors()
            said = outcome.measured.motion.sigma[:, :2]
            cells.append(f"{rms(place):.3f} {np.degrees(rms(turn)):.3f} (said {rms(said):.3f})")
        print(f"{' | '.join(cells)} | {camera.width}x{camera.height}, {seed}", flush=True)


if __name__ == "__main__":
    main()
