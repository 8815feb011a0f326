"""A session: what is asked for becomes a state, can be undone, and is saved as convert reads it."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import OutputError
from mocap.convert import convert
from mocap.synthetic.truth import Truth
from mocap.tracking.marker_file import read_markers
from scenarios.marking.events import change_for
from scenarios.marking.pointing import MarkingError
from scenarios.marking.serving import Asked, opened_session
from scenarios.marking.session import Session
from scenarios.marking.traffic_light import traffic_lights
from scenarios.marking.view import page_spots, page_state
from tests.support.clips import Clip

CLIP = Clip(width=480, height=300, px_per_mm=1.45, frames=14, jaw=False, blur_px=0.35)
NAMES = ("ear", "nose", "package_lower", "package_upper")


def quiet(share: float, text: str) -> None:
    """Show no progress."""


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Truth]]:
    video, _, truths = CLIP.write(tmp_path_factory.mktemp("clip"))
    return video, truths


def session_of(video: Path, out: Path, **asked: Any) -> Session:
    return opened_session(Asked(video, out, **asked), quiet)


def at(truth: Truth, name: str) -> tuple[float, float]:
    marker = truth.markers[name]
    return marker.x_px, marker.y_px


def do(session: Session, name: str, **values: Any) -> None:
    session.change(change_for({"do": name, **values}))


@pytest.fixture
def placed(clip: tuple[Path, list[Truth]], tmp_path: Path) -> Session:
    """A session whose markers were pointed at, a few pixels beside their centres."""
    video, truths = clip
    session = session_of(video, tmp_path / "out")
    for name in NAMES:
        x, y = at(truths[0], name)
        do(session, "place", marker=name, frame=0, x=x + 2.0, y=y - 1.5)
    return session


@pytest.fixture
def tracked(placed: Session) -> Session:
    do(placed, "length", body="package", mm=14.0)
    do(placed, "track")
    return placed


def test_a_click_beside_a_spot_means_the_spot(
    clip: tuple[Path, list[Truth]], placed: Session
) -> None:
    for name in NAMES:
        found = placed.state.marking.placed[name][0]
        assert math.dist(found.at, at(clip[1][0], name)) < 0.1
        assert found.look is not None
    do(placed, "place", marker="ear", frame=0, x=20.0, y=21.0, free=True)
    assert placed.state.marking.placed["ear"][0].at == (20.0, 21.0)


def test_spots_are_suggested(clip: tuple[Path, list[Truth]], placed: Session) -> None:
    spots = page_spots(placed.film, 0, "auto")
    for name in NAMES:
        x, y = at(clip[1][0], name)
        assert min(math.hypot(spot["x"] - x, spot["y"] - y) for spot in spots) < 0.2


def test_tracks_follow_the_truth(clip: tuple[Path, list[Truth]], tracked: Session) -> None:
    tracks = tracked.state.tracks
    assert tracks is not None
    right = np.array([[at(truth, name) for name in tracks.names] for truth in clip[1]])
    assert np.abs(tracks.position_px - right).max() < 0.2
    assert (tracks.status == "seen").all()


def test_every_step_can_be_undone_and_done_again(placed: Session) -> None:
    states = [*placed.past, placed.state]
    for state in reversed(states[:-1]):
        placed.undo()
        assert placed.state is state
    for state in states[1:]:
        placed.redo()
        assert placed.state is state
    with pytest.raises(MarkingError, match="nothing more"):
        placed.redo()


def test_a_drag_changes_one_track_and_is_taken_back(tracked: Session) -> None:
    before = tracked.state.tracks
    assert before is not None
    nose = before.names.index("nose")
    do(tracked, "place", marker="nose", frame=6, x=200.0, y=40.0, free=True)
    after = tracked.state.tracks
    assert after is not None
    assert after.status[6, nose] == "fixed"
    others = [k for k in range(len(after.names)) if k != nose]
    np.testing.assert_array_equal(after.position_px[:, others], before.position_px[:, others])
    do(tracked, "forget", marker="nose", frame=6)
    assert tracked.state.tracks is not None
    assert tracked.state.tracks.status[6, nose] == "seen"
    do(tracked, "forget", marker="nose", frame=0)
    assert "nose" not in tracked.state.tracks.names
    assert tracked.state.marking.lacking() == ("nose",)


def test_a_failed_step_leaves_the_state(placed: Session) -> None:
    state = placed.state
    for event in (
        {"do": "fly"},
        {"do": "place", "marker": "chin", "frame": 0, "x": 5, "y": 5},
        {"do": "place", "marker": "ear", "frame": 99, "x": 5, "y": 5},
        {"do": "place", "marker": "ear", "frame": True, "x": 5, "y": 5},
        {"do": "place", "marker": "ear", "frame": 0, "x": 900, "y": 5},
        {"do": "place", "marker": "ear", "frame": 0, "x": math.nan, "y": 5},
        {"do": "place", "marker": "ear", "frame": 0, "x": "5", "y": 5},
        {"do": "length", "body": "package", "mm": -1},
        {
            "do": "ruler",
            "body": "package",
            "frame": 3,
            "x1": 1,
            "y1": 1,
            "x2": 99,
            "y2": 1,
            "mm": 9,
        },
        {"do": "length", "body": ["package"], "mm": 5},
    ):
        with pytest.raises(DrinksimError):
            placed.change(change_for(event))
        assert placed.state is state


def test_a_ruler_at_the_package_gives_its_scale(
    clip: tuple[Path, list[Truth]], placed: Session
) -> None:
    x, y = at(clip[1][0], "package_lower")
    length = 40.0 * CLIP.px_per_mm
    do(placed, "ruler", body="package", frame=0, x1=x, y1=y, x2=x, y2=y + length, mm=40.0)
    found = placed.state.marking.lengths["package"]
    assert found.mm == pytest.approx(14.0, abs=3 * found.sigma_mm)
    assert 0.05 < found.sigma_mm < 0.5


def test_a_second_step_waits_for_the_first(placed: Session) -> None:
    def inside(state, film, progress):
        placed.undo()

    with pytest.raises(MarkingError, match="still being done"):
        placed.change(inside)
    placed.undo()


def test_what_is_saved_is_what_convert_reads_and_shows(
    clip: tuple[Path, list[Truth]], tracked: Session
) -> None:
    do(tracked, "place", marker="nose", frame=5, x=250.0, y=60.0, free=True)
    tracked.save()
    shown = tracked.state.shown
    assert shown is not None
    assert read_markers(tracked.out / "markers.toml").positions_px["nose"] is not None
    found = convert(clip[0], tracked.out / "markers.toml", tracks=tracked.out / "tracks.csv").tracks
    order = [found.names.index(name) for name in shown.names]
    np.testing.assert_array_equal(found.status[:, order], shown.status)
    np.testing.assert_allclose(found.position_px[:, order], shown.position_px, atol=1e-4)
    np.testing.assert_allclose(found.sigma_px[:, order], shown.sigma_px, atol=2e-4)


@pytest.mark.slow
def test_saving_removes_a_motion_of_another_state(tracked: Session) -> None:
    tracked.convert()
    motion = tracked.out / "motion" / "motion.csv"
    assert tracked.converted is not None
    assert tracked.converted.motion == motion
    assert motion.is_file()
    tracked.save()
    assert motion.is_file(), "nothing changed"
    do(tracked, "touch", lip="lower", frame=4, x=9.0, y=9.0)
    assert tracked.converted is None
    tracked.save()
    assert not motion.exists()
    assert "lower_time_s = 0.16" in (tracked.out / "scenario.toml").read_text()


def test_a_saved_marking_is_gone_on_with(clip: tuple[Path, list[Truth]], tracked: Session) -> None:
    do(tracked, "place", marker="nose", frame=6, x=200.0, y=40.0, free=True)
    do(tracked, "place", marker="ear", frame=0, x=60.0, y=41.0, free=True)
    do(tracked, "touch", lip="upper", frame=7, x=240.5, y=150.25)
    tracked.save()
    again = session_of(clip[0], tracked.out)
    assert again.state.marking.touches == tracked.state.marking.touches
    assert again.state.marking.placed["ear"][0].at == (60.0, 41.0)
    assert again.state.marking.placed["nose"][6].at == (200.0, 40.0)
    assert again.state.tracks is not None
    assert tracked.state.tracks is not None
    np.testing.assert_array_equal(again.state.tracks.status, tracked.state.tracks.status)
    with pytest.raises(MarkingError, match="another film or interval"):
        session_of(clip[0], tracked.out, end_s=0.3)


def test_other_files_are_never_replaced(clip: tuple[Path, list[Truth]], tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(OutputError, match="holds files that are not results"):
        session_of(clip[0], tmp_path / "mine")
    convert_out = tmp_path / "converted"
    convert_out.mkdir()
    (convert_out / ".drinksim").touch()
    (convert_out / "summary.json").write_text("{}")
    with pytest.raises(MarkingError, match="holds another result"):
        session_of(clip[0], convert_out)


def colours(session: Session) -> dict[str, str]:
    return {light.about: light.colour for light in traffic_lights(session.state, session.film)}


def test_lights_turn_green_as_the_film_is_marked(
    clip: tuple[Path, list[Truth]], tmp_path: Path, tracked: Session
) -> None:
    empty = colours(session_of(clip[0], tmp_path / "other"))
    assert empty == {"markers": "red", "scale": "red", "depth": "grey", "blur": "grey",
                     "light": "grey", "level": "grey"}  # fmt: skip
    assert colours(tracked)["depth"] == "amber", "the head has no length of its own"
    do(tracked, "length", body="head", mm=102.7)
    poor = [one for one in traffic_lights(tracked.state, tracked.film) if one.colour != "green"]
    assert poor == []


@pytest.mark.parametrize(
    ("clip", "about"),
    [
        (replace(CLIP, frames=3, blur_px=2.6), "blur"),
        (replace(CLIP, frames=3, mark_colour=(0.75, 0.75, 0.75)), "light"),
        pytest.param(replace(CLIP, frames=16, exposure_s=0.03), "blur", marks=pytest.mark.slow),
    ],
)
def test_a_poor_film_is_told(clip: Clip, about: str, tmp_path: Path) -> None:
    video, _, truths = clip.write(tmp_path)
    session = session_of(video, tmp_path / "out")
    for name in NAMES:
        x, y = at(truths[0], name)
        do(session, "place", marker=name, frame=0, x=x, y=y)
    do(session, "track")
    light = next(one for one in traffic_lights(session.state, session.film) if one.about == about)
    assert light.colour in ("amber", "red"), light.sentence


def test_the_page_gets_values_for_json(tracked: Session) -> None:
    state = page_state(tracked)
    again = json.loads(json.dumps(state, allow_nan=False))
    assert again["film"]["frames"] == list(range(CLIP.frames))
    assert again["tracks"]["nose"]["status"] == "s" * CLIP.frames
    assert again["markers"][0]["placed"]["0"][2] is True


@pytest.mark.slow
def test_stickers_need_no_click(tmp_path: Path) -> None:
    clip = replace(
        CLIP, width=1280, height=720, px_per_mm=3.0, frames=8,
        stickers=("ear", "nose", "package_lower", "package_upper"),
    )  # fmt: skip
    video, _, truths = clip.write(tmp_path)
    given = tmp_path / "stickers.toml"
    given.write_text("[markers]\n" + "".join(f'{name} = "sticker"\n' for name in clip.stickers))
    session = session_of(video, tmp_path / "out", markers=given)
    do(session, "track")
    with pytest.raises(MarkingError, match="is found by itself"):
        do(session, "place", marker="ear", frame=0, x=50.0, y=50.0)
    session.convert()
    assert session.converted is not None
    assert session.state.tracks is not None
    ear = session.state.tracks.of("ear")[0][0]
    assert math.dist(ear, at(truths[0], "ear")) < 0.5
