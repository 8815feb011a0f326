"""Positions that a user gives are evidence: kept anywhere, and nothing else is made of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mocap.convert import given_tracks
from mocap.tracking.follow import follow
from mocap.tracking.marker_file import read_markers
from mocap.tracking.noise import with_temporal_noise
from mocap.tracking.tracks import Tracks, TracksError, read_tracks
from mocap.video.frames import Video
from tests.support.clips import Clip

SHORT = Clip(width=480, height=300, px_per_mm=1.45, frames=12, jaw=False)
HIDDEN = replace(SHORT, frames=60, occluded=(0.4, 2.0), seed=5, full_well_e=4000, crf=20)


def whole(video: Path, markers: Path, given: Tracks | None = None) -> Tracks:
    film, file = Video(video), read_markers(markers)
    raw = follow(film, file, given=given)
    return with_temporal_noise(
        raw, bodies=file.rigid_bodies, key_frames=film.key_frames
    ).interpolated()


@pytest.mark.slow
def test_a_table_that_comes_back_unchanged_gives_the_same_table(tmp_path: Path) -> None:
    video, markers, _ = HIDDEN.write(tmp_path)
    first = whole(video, markers)
    assert np.count_nonzero(first.status == "lost") > 20
    first.write(tmp_path / "tracks.csv")
    again = whole(video, markers, read_tracks(tmp_path / "tracks.csv"))
    np.testing.assert_array_equal(again.status, first.status)
    known = np.isfinite(first.position_px)
    assert np.abs(again.position_px - first.position_px)[known].max() < 0.01


def test_a_position_set_by_hand_is_kept_where_no_spot_is(tmp_path: Path) -> None:
    video, markers, truths = SHORT.write(tmp_path)
    rows = ["frame,time_s,marker,x_px,y_px,sigma_px,status"]
    for truth in truths[:4]:
        rows.append(f"{truth.frame},{truth.time_s:.6f},nose,250.5,40.25,,fixed")
    (tmp_path / "hand.csv").write_text("\n".join(rows) + "\n")
    found = follow(Video(video), read_markers(markers), given=given_tracks(tmp_path / "hand.csv"))
    nose = found.names.index("nose")
    assert found.status[:4, nose].tolist() == ["fixed"] * 4
    np.testing.assert_allclose(found.position_px[:4, nose], np.tile([250.5, 40.25], (4, 1)))
    others = [k for k, name in enumerate(found.names) if name != "nose"]
    right = np.array([[(m.x_px, m.y_px) for m in t.markers.values()] for t in truths])
    assert np.abs(found.position_px - right)[:, others].max() < 0.2


def test_frames_that_the_video_has_not_are_refused(tmp_path: Path) -> None:
    video, markers, _ = SHORT.write(tmp_path)
    header = "scorer,n,n\nbodyparts,nose,nose\ncoords,x,y\n"
    (tmp_path / "net.csv").write_text(header + "3,200,100\n90,200,100\n")
    with pytest.raises(TracksError, match="frame 90 is not in the video"):
        follow(Video(video), read_markers(markers), given=given_tracks(tmp_path / "net.csv"))
