"""How fast markers are tracked, beside decoding alone, and in how much memory.

Run with ``python -m benchmarks.tracking [FRAMES]``. The bundled recording is played to and fro up
to the number of frames asked for (1000), written anew, and tracked without drawing an overlay. Each
figure is taken in a process of its own that does nothing else, and memory for clips of different
length, to see that it does not grow with it. The clips are drawn in other processes too: the memory
that a process is said to have used at most includes what its parent used when it was started.
"""

from __future__ import annotations

import itertools
import multiprocessing
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from mocap.synthetic.recording_file import write_recording
from mocap.tracking.follow import follow
from mocap.tracking.marker_file import read_markers
from mocap.video.frames import Video

SIP = Path(__file__).parents[1] / "scenarios" / "library" / "A38-F"
CLIP_RATE = 25.0
T = TypeVar("T")


@dataclass(frozen=True)
class Cost:
    """What going through a clip took: wall and processor time (s), and the most memory (MB)."""

    frames: int
    wall_s: float
    processor_s: float
    memory_mb: float
    seen: float


def long_clip(path: Path, frames: int) -> None:
    """Write the bundled recording played to and fro, ``frames`` frames long."""
    pictures = [frame.colour()[..., ::-1] for frame in Video(SIP / "recording.mp4").frames()]
    there_and_back = itertools.cycle([*pictures, *pictures[-2:0:-1]])
    write_recording(
        path,
        itertools.islice(there_and_back, frames),
        np.arange(frames) / CLIP_RATE,
        crf=23,
        preset="veryfast",
    )


def cost(path: Path, *, tracked: bool) -> Cost:
    """Return what decoding a clip takes, and tracking it where asked; meant for a fresh process."""
    markers = read_markers(SIP / "markers.toml")
    follow(Video(SIP / "recording.mp4"), markers, end_s=0.1)  # loads the compiled kernels
    wall, processor = time.perf_counter(), time.process_time()
    if tracked:
        tracks = follow(Video(path), markers)
        frames, seen = tracks.frame.size, float(np.mean(tracks.status == "seen"))
    else:
        frames, seen = sum(1 for _ in Video(path).frames()), 0.0
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Cost(frames, wall, processor, memory, seen)


def in_fresh_process(work: Callable[..., T], *arguments: object, **named: object) -> T:
    """Return what a function returns when called in a process of its own."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(work, arguments, named)


def main() -> None:
    """Print frames per second and memory of decoding and of tracking."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    print("what     | frames | frames/s | times 25 fps | per s of processor | MB")
    with tempfile.TemporaryDirectory() as folder:
        for length in (max(frames // 4, 2), frames):
            path = Path(folder) / f"{length}.mp4"
            in_fresh_process(long_clip, path, length)
            for what, tracked in (("decoding", False), ("tracking", True)):
                found = in_fresh_process(cost, path, tracked=tracked)
                rate = found.frames / found.wall_s
                print(
                    f"{what:8} | {found.frames:6d} | {rate:8.0f} | {rate / CLIP_RATE:12.1f} | "
                    f"{found.frames / found.processor_s:18.0f} | {found.memory_mb:.0f}",
                    flush=True,
                )
    print(f"markers seen in {100 * found.seen:.1f} % of the frames")


if __name__ == "__main__":
    main()
