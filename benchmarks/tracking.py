"""How fast markers are tracked, beside decoding alone, and in how much memory.

Run with ``python -m benchmarks.tracking [FRAMES]``. The bundled recording is played to and fro up
to the number of frames asked for (1000), written anew, and tracked without drawing an overlay.
"""

from __future__ import annotations

import itertools
import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from mocap.follow import follow
from mocap.markers import read_markers
from mocap.synthetic import write_recording
from mocap.video import Video

SIP = Path(__file__).parents[1] / "scenarios" / "library" / "A38-F"
CLIP_RATE = 25.0


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


def main() -> None:
    """Print frames per second of decoding and of tracking, and the memory taken."""
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    markers = read_markers(SIP / "markers.toml")
    follow(Video(SIP / "recording.mp4"), markers, end_s=0.1)  # compiles the kernels
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.mp4"
        long_clip(path, frames)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        start = time.perf_counter()
        decoded = sum(1 for _ in Video(path).frames())
        decoding = time.perf_counter() - start
        start = time.perf_counter()
        tracks = follow(Video(path), markers)
        tracking = time.perf_counter() - start
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    info = f"{decoded} frames of 1280 x 720 px, {len(tracks.names)} markers"
    print(f"{info}: decoding alone {decoded / decoding:.0f} frames/s")
    print(
        f"tracking {decoded / tracking:.0f} frames/s, {decoded / tracking / CLIP_RATE:.1f} times "
        f"the clip's own rate; seen {100 * np.mean(tracks.status == 'seen'):.1f} %"
    )
    print(f"memory above what the drawing took: {(after - before) / 1024:.0f} MB")


if __name__ == "__main__":
    main()
