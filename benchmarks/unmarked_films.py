"""Films without coded stickers: no sticker may be named in them, and no dots told by their layout.

    python -m benchmarks.unmarked_films
    python -m benchmarks.unmarked_films film.mp4 another.mp4

Twenty drawn clips, which differ in motion, noise, print and colours, and the films that are named.
The drawn clips carry dots (six, or four) and printed squares as cartons have them; every frame is
searched for stickers. In films that are named, every fifth frame is searched for dots by the
usual layout, too: they are supposed to have none. Takes about three minutes of one core.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mocap.stickers.detect import find_stickers
from mocap.synthetic.scene import BLACK, WHITE, Scene, SceneBody, ScenePolygon
from mocap.tracking.errors import TrackingError
from mocap.tracking.locate import locate_markers
from mocap.tracking.marker_file import read_markers
from mocap.video.frames import Video
from tests.support.clips import Clip

CLIPS = 20
EVERY = 5
CELLS = 6
ANY = '[scale]\npackage = 14.0\n[markers]\near = "auto"\n'


@dataclass(frozen=True)
class PrintedClip(Clip):
    """A clip whose package carries printed squares of light and dark cells, no two alike."""

    def scene(self) -> Scene:
        """Return the scene with the print."""
        scene = super().scene()
        head, package, *others = scene.bodies
        rng = np.random.default_rng([self.seed, 11])
        printed = SceneBody(
            package.name,
            package.motion,
            (*package.shapes, *_prints(rng)),
            package.markers,
            package.out_of_plane,
        )
        return Scene((head, printed, *others), light=scene.light)


def _prints(rng: np.random.Generator) -> Iterator[ScenePolygon]:
    """Yield squares with cells like those of a code, on the wide part of the package."""
    for x, y in ((85.0, -25.0), (110.0, 0.0), (85.0, 25.0), (135.0, 30.0)):
        side = float(rng.uniform(10.0, 20.0))
        cell = side / CELLS
        yield _square(x, y, side + 2 * cell, WHITE)
        yield _square(x, y, side, BLACK)
        for row, column in np.argwhere(rng.random((CELLS - 2, CELLS - 2)) < 0.5):
            at = (np.array([column, row]) + 1.5) * cell - side / 2
            yield _square(x + at[0], y + at[1], 1.02 * cell, WHITE)


def _square(x: float, y: float, side: float, colour: tuple[float, float, float]) -> ScenePolygon:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * side / 2
    return ScenePolygon(corners + np.array([x, y]), colour)


def drawn_clip(seed: int) -> Clip:
    """Return one of the clips without stickers."""
    return PrintedClip(
        seed=seed,
        width=1280,
        height=720,
        px_per_mm=3.0,
        frames=12,
        jaw=bool(seed % 2),
        full_well_e=[np.inf, 9000.0, 3000.0][seed % 3],
        crf=[12.0, 20.0, 26.0][(seed // 3) % 3],
        exposure_s=[0.0, 0.01][(seed // 2) % 2],
        tilt_deg=(0.0, 15.0 * (seed % 4 == 0)),
    )


def stickers_named(film: Path) -> tuple[int, Counter[str]]:
    """Return how many frames a film has, and how often each sticker is named in them."""
    named: Counter[str] = Counter()
    frames = 0
    for frame in Video(film).frames():
        named.update(find_stickers(frame.image).keys())
        frames += 1
    return frames, named


def dots_named(film: Path, folder: Path) -> list[int]:
    """Return the frames in which the layout names dots."""
    file = folder / "any.toml"
    file.write_text(ANY, encoding="utf-8")
    anything, named = read_markers(file), []
    for frame in Video(film).frames():
        if frame.index % EVERY:
            continue
        try:
            locate_markers(frame.picture, anything, frame.index)
        except TrackingError:
            continue
        named.append(frame.index)
    return named


def main(films: list[Path]) -> None:
    """Search the drawn clips and the films, and print what was named."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wrong, frames = 0, 0
        for seed in range(CLIPS):
            video, _, _ = drawn_clip(seed).write(folder / str(seed))
            count, named = stickers_named(video)
            wrong, frames = wrong + named.total(), frames + count
            print(f"clip {seed}: {count} frames, stickers named: {dict(named) or 'none'}")
        for film in films:
            count, named = stickers_named(film)
            wrong, frames = wrong + named.total(), frames + count
            dots = dots_named(film, folder)
            print(f"{film.name}: {count} frames, stickers named: {dict(named) or 'none'}, "
                  f"dots named in frames: {dots or 'none'}")  # fmt: skip
        print(f"{wrong} stickers named in {frames} frames without any")


if __name__ == "__main__":
    main([Path(argument) for argument in sys.argv[1:]])
