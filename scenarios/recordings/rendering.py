"""Rendered recordings of the four scenarios: a person in profile drinks from a package.

``python -m scenarios.recordings.rendering A38-F --out DIR`` redraws the recording of a scenario
from the script in its library folder, bit for bit on the same machine. The face and the neck are
the outlines of `geometry2d` that the simulation uses; everything else (hair, hand, carton) is there
so that the picture has the clutter of a real one. No real recording of a person drinking with
markers on could be found, therefore these are called *rendered* wherever they are shown.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from geometry2d.rigid import rotated
from mocap.synthetic.camera import Image, SyntheticError
from mocap.synthetic.recording_file import frame_times, write_recording
from mocap.synthetic.rendering import render
from mocap.synthetic.scene import Scene
from mocap.synthetic.truth import Truth, write_truth
from scenarios.recordings.held_package import package_bodies
from scenarios.recordings.portrait import BACKGROUND, head_body, jaw_body, trunk_body
from scenarios.recordings.script import RenderingError, Script, script_of
from scenarios.settings.tables import SettingError

MOTION_COLUMNS = (
    "time_s",
    *(
        f"{body}_{part}"
        for body in ("head", "package", "rel")
        for part in ("x_mm", "y_mm", "theta_deg")
    ),
)

Array = NDArray[np.float64]

# The rim's edges are rounded: its ends are looked for within this from its front, mm.
RIM_MM = 1.0


def scene_of(script: Script) -> Scene:
    """Return the scene that a script describes."""
    head, neck = script.face(), script.neck()
    head_motion = script.head_motion()
    return Scene(
        (
            trunk_body(),
            head_body(head, head_motion),
            jaw_body(head, script.jaw_motion()),
            *package_bodies(neck, script.recording.carton, head_motion @ script.neck_motion()),
        ),
        background=BACKGROUND,
        light=script.light,
    )


def frames_of(script: Script, frames: Sequence[int] | None = None) -> Iterator[tuple[Image, Truth]]:
    """Yield the frames of a recording, with the caption, and their truth; all or those numbered."""
    times = frame_times(script.camera, script.recording.duration_s)
    numbers = range(len(times)) if frames is None else frames
    scene = scene_of(script)
    for frame, truth in render(scene, script.camera, script.sensor, times, numbers):
        yield captioned(frame, "rendered"), truth


def captioned(frame: Image, text: str) -> Image:
    """Return a copy of a frame with a small text in its upper right corner."""
    import cv2

    place = (frame.shape[1] - 90, 24)
    written = cv2.putText(
        frame.copy(), text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, (60, 60, 60), 1, cv2.LINE_AA
    )
    return np.asarray(written, np.uint8)


def redraw(name: str, out: Path) -> None:
    """Draw a recording of the library into a folder.

    Writes ``recording.mp4``, ``markers.toml``, ``truth.csv`` (markers, px), ``truth_bodies.csv``
    (placements of the bodies) and ``truth_motion.csv`` (the columns of ``motion.csv``).
    """
    write_script_output(script_of(name), out)


def write_script_output(script: Script, out: Path) -> None:
    """Draw a recording from its script; see `redraw` for the files."""
    out.mkdir(parents=True, exist_ok=True)
    truths: list[Truth] = []

    def remembered() -> Iterator[Image]:
        for frame, truth in frames_of(script):
            truths.append(truth)
            yield frame

    times = frame_times(script.camera, script.recording.duration_s)
    write_recording(out / "recording.mp4", remembered(), times, crf=script.recording.crf)
    write_truth(out / "truth.csv", out / "truth_bodies.csv", truths)
    write_motion_truth(out / "truth_motion.csv", script)
    write_marker_file(out / "markers.toml", script, truths[0])


def write_motion_truth(file: Path, script: Script) -> None:
    """Write the exact motion of every frame with the columns of ``motion.csv``, without sigmas."""
    times = frame_times(script.camera, script.recording.duration_s)
    head = script.head_motion()
    package = (head @ script.neck_motion()).resampled(times)
    head = head.resampled(times)
    neck = script.neck()
    ear = head.shift_mm
    mark = package.apply(neck.lower_mark)[:, 0]
    turns = [np.degrees(motion.angle_rad - motion.angle_rad[0]) for motion in (head, package)]
    seen = rotated(mark - ear, -np.radians(turns[0]))
    rows = np.column_stack([times, ear, turns[0], mark, turns[1], seen, turns[1] - turns[0]])
    with file.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(MOTION_COLUMNS)
        table.writerows([f"{value:.5f}" for value in row] for row in rows)


def write_marker_file(file: Path, script: Script, first: Truth) -> None:
    """Write the marker file a user would write for this recording: positions to a few px."""
    neck, head = script.neck(), script.face()
    mark_distance = float(np.hypot(*np.subtract(neck.upper_mark, neck.lower_mark)))
    head_distance = float(np.hypot(*np.subtract(head.landmarks["nose"], head.landmarks["ear"])))
    matrix, lens = script.camera.matrix, script.camera.lens
    lines = [
        "# Markers of a rendered recording: drawn by a virtual camera, not filmed.",
        "[recording]",
        "rendered = true",
        "",
        "[scale]",
        f"package = {mark_distance:.4g}   # mm between package_lower and package_upper",
        f"head = {head_distance:.6g}   # mm between ear and nose, which are nearer the camera",
        "",
        "[lens]   # OpenCV's names",
        f"fx = {matrix[0, 0]:.10g}",
        f"fy = {matrix[1, 1]:.10g}",
        f"cx = {matrix[0, 2]:.10g}",
        f"cy = {matrix[1, 2]:.10g}",
        *(f"{key} = {getattr(lens, key):.10g}" for key in ("k1", "k2", "p1", "p2", "k3")),
        "",
        "[markers]   # px in the first frame, as read off by eye",
        *(
            f"{name} = [{round(spot.x_px):d}.0, {round(spot.y_px):d}.0]"
            for name, spot in first.markers.items()
        ),
        "",
        "[style]   # likewise, in the middle of face and package",
        *(f"{name} = [{round(x):d}.0, {round(y):d}.0]" for name, (x, y) in _lip_and_rim(script)),
    ]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _lip_and_rim(script: Script) -> list[tuple[str, Array]]:
    """Return where upper lip and ends of the rim are in the picture, px, in the first frame."""
    neck, head = script.neck(), script.head_motion().at(0.0)
    walls = neck.lower_wall.sampled(0.05), neck.upper_wall.sampled(0.05)
    front = min(float(wall[:, 0].min()) for wall in walls)
    low, high = (wall[wall[:, 0] < front + RIM_MM][:, 1] for wall in walls)
    ends = ((front, float(low.min())), (front, float(high.max())))
    rim = script.neck_motion().at(0.0).apply(ends)
    points = head.apply([script.face().landmarks["upper_lip"], *rim])
    names = ("upper_lip", "rim_lower", "rim_upper")
    return list(zip(names, script.camera.project(points), strict=True))


def main(arguments: Sequence[str] | None = None) -> None:
    """Redraw the named recordings of the library; exit code 2 and one line if that cannot be."""
    parser = argparse.ArgumentParser(
        prog="python -m scenarios.recordings.rendering", description=__doc__
    )
    parser.add_argument("names", nargs="+", metavar="NAME", help="such as A38-F")
    parser.add_argument("--out", type=Path, required=True, help="folder to write into")
    given = parser.parse_args(arguments)
    for name in given.names:
        try:
            redraw(name, given.out / name if len(given.names) > 1 else given.out)
        except (RenderingError, SettingError, SyntheticError, OSError) as error:
            parser.error(str(error))


if __name__ == "__main__":
    main()
