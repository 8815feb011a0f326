"""After a correction only what depends on it is tracked again, and comes out as in a whole pass."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mocap.tracking.retrack as module
from mocap.tracking.detect import detect, refit
from mocap.tracking.follow import follow
from mocap.tracking.marker_file import read_markers
from mocap.tracking.markers import MarkerFile
from mocap.tracking.retrack import Correction, retrack
from mocap.tracking.tracks import Tracks
from mocap.video.frames import Video
from tests.support.clips import Clip

FIT_PX = 0.03
"""A fit that starts elsewhere ends within this, a standard error."""

CLEAR = Clip(width=480, height=300, px_per_mm=1.45, frames=30, jaw=False)
HIDDEN = replace(CLEAR, frames=40, occluded=(0.4, 1.0), seed=5)


@pytest.fixture(scope="module")
def clear(tmp_path_factory: pytest.TempPathFactory) -> tuple[Video, MarkerFile, Tracks]:
    return tracked(CLEAR, tmp_path_factory.mktemp("clear"))


def tracked(clip: Clip, folder: Path) -> tuple[Video, MarkerFile, Tracks]:
    video, markers, _ = clip.write(folder)
    film, file = Video(video), read_markers(markers)
    return film, file, follow(film, file)


def test_a_correction_to_the_same_place_changes_nothing_and_ends_soon(
    clear: tuple[Video, MarkerFile, Tracks], monkeypatch: pytest.MonkeyPatch
) -> None:
    film, file, tracks = clear
    fits = []
    monkeypatch.setattr(
        "mocap.tracking.link.refit", lambda *a, **k: fits.append(1) or refit(*a, **k)
    )
    nose = tracks.names.index("nose")
    at = tuple(tracks.position_px[10, nose])
    found = retrack(film, file, tracks, Correction("nose", 10, at, 0.02))
    assert found.status[10, nose] == "fixed"
    np.testing.assert_allclose(found.position_px, tracks.position_px, atol=FIT_PX)
    assert len(fits) == module.FRAMES_ALIKE


def test_a_wrong_stretch_is_mended_and_the_rest_is_left_alone(
    clear: tuple[Video, MarkerFile, Tracks],
) -> None:
    film, file, tracks = clear
    nose = tracks.names.index("nose")
    wrong = replace(tracks, position_px=tracks.position_px.copy())
    wrong.position_px[8:, nose] += 40.0
    wrong.position_px[:, tracks.names.index("ear")] += 0.3
    found = retrack(
        film, file, wrong, Correction("nose", 8, tuple(tracks.position_px[8, nose]), 0.02)
    )
    np.testing.assert_allclose(
        found.position_px[8:, nose], tracks.position_px[8:, nose], atol=FIT_PX
    )
    others = [k for k in range(len(tracks.names)) if k != nose]
    np.testing.assert_array_equal(found.position_px[:, others], wrong.position_px[:, others])
    assert (wrong.status == tracks.status).all(), "the tracks that were given are not changed"


def test_a_drag_to_where_nothing_is_is_given_up_after_a_second(
    clear: tuple[Video, MarkerFile, Tracks], monkeypatch: pytest.MonkeyPatch
) -> None:
    film, file, tracks = clear
    searches = []
    monkeypatch.setattr(
        "mocap.tracking.link.detect", lambda *a, **k: searches.append(1) or detect(*a, **k)
    )
    monkeypatch.setattr(module, "LONGEST_BRIDGE_S", 0.4)
    nose = tracks.names.index("nose")
    x, y = tracks.position_px[8, nose]
    found = retrack(film, file, tracks, Correction("nose", 8, (x + 18.0, y + 30.0), 0.5))
    assert found.status[8, nose] == "fixed"
    assert (found.status[9:, nose] == "lost").all()
    assert np.isnan(found.position_px[9:, nose]).all()
    assert len(searches) <= 0.4 * CLEAR.fps + 1 < CLEAR.frames - 9
    np.testing.assert_array_equal(found.position_px[:8], tracks.position_px[:8])
    others = [k for k in range(len(tracks.names)) if k != nose]
    np.testing.assert_array_equal(found.position_px[:, others], tracks.position_px[:, others])


def test_the_next_position_set_by_hand_ends_what_depends(
    clear: tuple[Video, MarkerFile, Tracks],
) -> None:
    film, file, tracks = clear
    nose = tracks.names.index("nose")
    later = replace(tracks, status=tracks.status.copy(), position_px=tracks.position_px.copy())
    later.status[12, nose] = "fixed"
    later.position_px[12:, nose] += 9.0
    found = retrack(film, file, later, Correction("nose", 9, (20.0, 20.0), 0.5))
    np.testing.assert_array_equal(found.position_px[12:, nose], later.position_px[12:, nose])
    np.testing.assert_array_equal(found.position_px[9, nose], (20.0, 20.0))


def test_taken_back_a_marker_is_searched_for_again(clear: tuple[Video, MarkerFile, Tracks]) -> None:
    film, file, tracks = clear
    nose = tracks.names.index("nose")
    off = retrack(film, file, tracks, Correction("nose", 14, (30.0, 30.0), 0.5))
    assert np.abs(off.position_px[14, nose] - tracks.position_px[14, nose]).max() > 50
    back = retrack(film, file, off, Correction("nose", 14, None))
    assert back.status[14, nose] == "seen"
    np.testing.assert_allclose(
        back.position_px[14, nose], tracks.position_px[14, nose], atol=FIT_PX
    )


def test_a_marker_that_had_no_track_is_followed_from_its_first_position(
    clear: tuple[Video, MarkerFile, Tracks],
) -> None:
    film, file, tracks = clear
    nose = tracks.names.index("nose")
    kept = [k for k in range(len(tracks.names)) if k != nose]
    without = replace(
        tracks,
        names=tuple(tracks.names[k] for k in kept),
        position_px=tracks.position_px[:, kept],
        sigma_px=tracks.sigma_px[:, kept],
        status=tracks.status[:, kept],
        ellipse=None,
    )
    found = retrack(
        film, file, without, Correction("nose", 0, tuple(tracks.position_px[0, nose]), 0.1)
    )
    assert found.names[-1] == "nose"
    np.testing.assert_allclose(found.of("nose")[0], tracks.position_px[:, nose], atol=FIT_PX)


@pytest.mark.slow
def test_a_hidden_marker_set_by_hand_is_as_in_a_whole_pass(tmp_path: Path) -> None:
    film, file, tracks = tracked(HIDDEN, tmp_path)
    nose = tracks.names.index("nose")
    hidden = np.flatnonzero(tracks.status[:, nose] == "lost")
    assert hidden.size > 10
    frame = int(hidden[hidden.size // 2])
    correction = Correction("nose", frame, (300.0, 140.0), 0.5)
    found = retrack(film, file, tracks, correction)
    given = replace(tracks, status=tracks.status.copy(), position_px=tracks.position_px.copy(),
                    sigma_px=tracks.sigma_px.copy())  # fmt: skip
    given.status[frame, nose], given.sigma_px[frame, nose] = "fixed", 0.5
    given.position_px[frame, nose] = correction.position_px
    whole = follow(film, file, given=given)
    np.testing.assert_array_equal(found.status, whole.status)
    np.testing.assert_allclose(found.position_px, whole.position_px, atol=FIT_PX)
