"""What a conversion ends with: every figure that its user asks for, and where to look."""

from dataclasses import replace

import numpy as np
import pytest

from mocap.convert import convert
from mocap.measurement import measure
from mocap.motion.projection import PictureFormat
from mocap.tracking.tracks import Tracks
from mocap.views.closing import closing_lines
from tests.support.clips import Clip

TIMES = np.arange(50) / 25

REPORT = {
    "scale": {
        "head": {"px_per_mm_first": 3.0612, "from_marks_of": "package"},
        "package": {"px_per_mm_first": 2.9333, "from_marks_of": "package"},
    },
    "relative": {
        "sigma_x_mm_median": 0.021,
        "sigma_y_mm_median": 0.034,
        "sigma_theta_deg_median": 0.087,
        "level_assumed": True,
        "roll_mm_per_deg": 1.7234,
    },
    "drinking": {
        "phases_s": {"approach": (0.2, 0.88), "contact": (0.88, 1.04)},
        "style": "pull",
        "style_reason": "the upper lip meets the liquid",
    },
    "warnings": ["one", "two"],
}


def tracks(**unseen: slice) -> Tracks:
    names = ("ear", "nose", "package_lower", "package_upper")
    status = np.full((TIMES.size, len(names)), "seen", dtype="<U9")
    for name, frames in unseen.items():
        status[frames, names.index(name)] = "predicted"
    shape = status.shape
    return Tracks(np.arange(TIMES.size), TIMES, names, np.ones((*shape, 2)), np.ones(shape), status)


def test_all_figures_are_told():
    assert closing_lines(REPORT, tracks()) == [
        "markers: 4, seen in 100 % of 50 frames",
        "scale: head 3.06 px/mm (that of package), package 2.93 px/mm",
        "standard error of the motion, neck seen from the head: 0.02 mm in x, 0.03 mm in y, 0.09°",
        "level: the camera is taken for level; each degree of its roll turns the neck about the "
        "ear by 1.7 mm, which no standard error holds",
        "phases, s: approach 0.20 to 0.88, contact 0.88 to 1.04",
        "style: pull (the upper lip meets the liquid)",
        "look at: overlay.mp4, whether each cross stays on its marker; motion.png, whether it is "
        "smooth; summary.json for the 2 warnings above",
    ]


def test_a_plane_of_known_points_says_what_is_level():
    report = {**REPORT, "relative": {**REPORT["relative"], "level_assumed": False}}
    assert "level: by the world's axes of [plane]" in closing_lines(report, tracks())


@pytest.mark.slow
def test_the_cost_of_a_roll_is_what_a_rolled_camera_does(tmp_path):
    drawn = Clip(frames=12, jaw=False)
    video, markers, _ = drawn.write(tmp_path)
    level = convert(video, markers)
    width, height = drawn.width, drawn.height
    roll = np.radians(1.0)
    turn = np.array([[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]])
    middle = np.array([width - 1, height - 1]) / 2
    rolled = replace(level.tracks, position_px=(level.tracks.position_px - middle) @ turn + middle)
    moved = measure(rolled, level.markers, PictureFormat(width, height)).motion.relative_mm
    away = np.hypot(*(moved - level.motion.relative_mm).T)
    told = level.summary["relative"]["roll_mm_per_deg"]
    assert np.median(away) == pytest.approx(told, rel=0.05)


def test_a_marker_that_is_not_always_seen_is_named_with_its_longest_dropout():
    lines = closing_lines(REPORT, tracks(nose=slice(10, 20), ear=slice(0, 5)))
    assert lines[0] == (
        "markers: 4, seen in 92.5 % of 50 frames; 2 always, nose in 80 %, ear in 90 %"
    )
    assert lines[-1].startswith("look at: overlay.mp4 at 0.40 to 0.76 s, where nose is not seen")


def test_no_more_than_three_markers_are_named():
    hidden = {name: slice(0, n) for n, name in enumerate(tracks().names, start=1)}
    first = closing_lines(REPORT, tracks(**hidden))[0]
    assert first.endswith(
        "0 always, package_upper in 92 %, package_lower in 94 %, nose in 96 % and 1 more"
    )


def test_a_motion_without_a_sip_says_so():
    report = {**REPORT, "drinking": {**REPORT["drinking"], "phases_s": {}}, "warnings": []}
    lines = closing_lines(report, tracks())
    assert lines[4] == "phases, s: none found"
    assert "warnings" not in lines[-1]
