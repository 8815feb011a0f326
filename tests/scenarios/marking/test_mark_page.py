"""Marking in a browser, end to end: by mouse alone, by keyboard alone, a correction by one drag."""

from __future__ import annotations

import csv
import shutil
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mocap.convert import convert
from mocap.motion.motion import Motion
from mocap.tracking.marker_file import read_markers
from mocap.tracking.tracks import read_tracks
from scenarios.settings.scenario import load_scenario
from tests.support.browser import driven
from tests.support.clips import Clip
from tests.support.marking_page import Hand, served
from tests.support.optional import needed_module, needed_program, recorded_file

needed_module("starlette")

pytestmark = [
    pytest.mark.slow,
    # The driver leaves its event loop's socket to the collector.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]

MOST_S = 180.0
"""From an unmarked film to its motion, by mouse alone."""

CORRECTION_S = 5.0
HIDDEN = Clip(
    width=640, height=400, px_per_mm=1.9, frames=60, jaw=False, occluded=(0.8, 1.6), seed=5
)


@pytest.fixture(scope="module")
def running() -> Iterator[Any]:
    chromium = needed_program("chromium", "chromium-browser", "google-chrome", package="chromium")
    with driven(chromium) as browser:
        yield browser


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A copy of a library's recording, without its marker file."""
    source = load_scenario("A38-F").recording
    assert source is not None
    shutil.copy(source.video, tmp_path / "sip.mp4")
    return tmp_path / "sip.mp4"


def library_file() -> Path:
    source = load_scenario("A38-F").recording
    assert source is not None
    assert source.markers is not None
    return Path(source.markers)


def test_from_an_unmarked_film_to_its_motion_by_mouse_alone(
    running: Any, recording: Path, tmp_path: Path
) -> None:
    out, begin = tmp_path / "marked", time.monotonic()
    rough = read_markers(library_file())
    with served(str(recording), "--out", str(out)) as server:
        hand = Hand.on(running, server.address)
        for name in ("ear", "nose", "package_lower", "package_upper"):
            at = rough.positions_px[name]
            assert at is not None
            hand.point((at[0] + 3, at[1] - 2))
        hand.click("[data-key='marker-jaw_front']")
        hand.point((520.0, 495.0))
        hand.digits("input[data-body='package']", "14")
        hand.digits("input[data-body='head']", "104.3")
        hand.click("#track")
        hand.go_to(100)
        hand.click("[data-key='touch-lower']")
        hand.point((600.0, 350.0))
        for name, at in (("upper_lip", (613, 344)), ("rim_lower", (759, 535)),
                         ("rim_upper", (840, 472))):  # fmt: skip
            hand.click(f"[data-key='style-{name}']")
            hand.point(at)
        hand.click("#convert")
        hand.tab.wait_for_selector("#motion")
        assert hand.error() == ""
        assert set(hand.lights().values()) == {"green"}
        assert hand.messages == []
        assert hand.foreign == []
    assert server.process.returncode == 0
    assert time.monotonic() - begin < MOST_S
    motion, markers = Motion.read(out / "motion" / "motion.csv"), read_markers(out / "markers.toml")
    assert markers.style is not None
    assert "first_contact" in (out / "scenario.toml").read_text()
    truth = Motion.read(library_file().parent / "truth_motion.csv")
    mouth = slice(40, 110)
    away = (motion.relative_mm - truth.relative_mm)[mouth]
    # The camera's constants are not asked for: its distortion is left in the motion.
    assert np.sqrt(np.mean((away - away[0]) ** 2)) < 0.3


@pytest.mark.parametrize("name", ["A38-AE", "DC-F", "DC-AE"])
def test_other_recordings_are_marked_and_tracked(running: Any, tmp_path: Path, name: str) -> None:
    source = load_scenario(name).recording
    assert source is not None
    assert source.markers is not None
    rough = read_markers(source.markers).positions_px
    out = tmp_path / "marked"
    with served(source.video, "--out", str(out), "--end", "0.6") as server:
        hand = Hand.on(running, server.address)
        for marker in ("ear", "nose", "package_lower", "package_upper"):
            at = rough[marker]
            assert at is not None
            hand.point(at)
        hand.click("#track")
        hand.click("#save")
        assert hand.error() == ""
        assert hand.messages == []
    tracks = read_tracks(out / "tracks.csv")
    with (Path(source.markers).parent / "truth.csv").open(encoding="utf-8") as file:
        truth = {(int(row["frame"]), row["marker"]): (float(row["x_px"]), float(row["y_px"]))
                 for row in csv.DictReader(file)}  # fmt: skip
    right = np.array([[truth[int(frame), name] for name in tracks.names] for frame in tracks.frame])
    assert np.sqrt(np.mean((tracks.position_px - right) ** 2)) < 0.1


def test_a_hidden_mark_is_set_by_one_drag(running: Any, tmp_path: Path) -> None:
    video, given, truths = HIDDEN.write(tmp_path)
    out = tmp_path / "marked"
    with served(str(video), "--markers", str(given), "--out", str(out)) as server:
        hand = Hand.on(running, server.address)
        hand.click("#track")
        row = 28
        hand.go_to(row)
        shown = hand.tab.evaluate(
            "async () => { const s = await (await fetch('state')).json(); return s.tracks.nose; }"
        )
        assert shown["status"][row] == "p"
        right = truths[row].markers["nose"]
        start = shown["x"][row], shown["y"][row]
        took = hand.drag(start, (right.x_px, right.y_px))
        hand.click("#save")
        assert hand.error() == ""
    assert took < CORRECTION_S
    tracks = read_tracks(out / "tracks.csv")
    nose = tracks.names.index("nose")
    assert tracks.status[row, nose] == "fixed"
    assert np.hypot(*(tracks.position_px[row, nose] - [right.x_px, right.y_px])) < 1.0
    again = convert(video, out / "markers.toml", tracks=out / "tracks.csv")
    assert again.tracks.status[row, again.tracks.names.index("nose")] == "fixed"


def test_everything_by_keyboard_alone(running: Any, tmp_path: Path) -> None:
    clip = replace(HIDDEN, frames=10, occluded=None)
    video, _, truths = clip.write(tmp_path)
    with served(str(video), "--out", str(tmp_path / "marked")) as server:
        hand = Hand.on(running, server.address)
        tab, keys = hand.tab, hand.tab.keyboard
        tab.wait_for_selector("body[data-spots='0']")
        tab.locator("#picture").focus()
        # Spots are visited from left to right.
        for _ in ("ear", "nose"):
            keys.press("n")
            keys.press("Enter")
            hand.wait()
        for key in ("3", "n", "Enter"):
            keys.press(key)
            hand.wait()
        for key in ("4", "n", "Enter"):
            keys.press(key)
            hand.wait()
        for _ in range(60):
            keys.press("Tab")
            if tab.evaluate("document.activeElement.dataset.body") == "package":
                break
        keys.type("14")
        keys.press("Enter")
        hand.wait()
        keys.press("t")
        hand.wait()
        for key in (".", ".", ","):
            keys.press(key)
        tab.wait_for_selector("#picture[data-row='1']")
        keys.press("s")
        hand.wait()
        assert hand.error() == ""
    markers = read_markers(tmp_path / "marked" / "markers.toml")
    for name, at in markers.positions_px.items():
        truth = truths[0].markers[name]
        assert at == pytest.approx((truth.x_px, truth.y_px), abs=0.3), name


def test_the_page_can_be_used_by_everybody(running: Any, tmp_path: Path) -> None:
    """No rule of accessibility is broken, on a desk and on a telephone."""
    axe = needed_module("axe_playwright_python.sync_playwright")
    video, given, _ = replace(HIDDEN, frames=6, occluded=None).write(tmp_path)
    with served(str(video), "--markers", str(given), "--out", str(tmp_path / "out")) as server:
        for width in (1280, 390):
            hand = Hand.on(running, server.address, width_px=width)
            hand.click("#track")
            found = axe.Axe().run(hand.tab)
            assert found.violations_count == 0, found.generate_report()
            assert hand.tab.evaluate("document.documentElement.scrollWidth") <= width


def test_a_real_film_of_a_thrown_ball(running: Any, tmp_path: Path) -> None:
    """Two marks on a wall and a ball, filmed by others: pointed at, tracked, and it falls."""
    film = recorded_file("projectile/projetil.mp4")
    bodies = tmp_path / "wall.toml"
    bodies.write_text(
        '[scale]\nwall = 800.0\n[markers]\nleft = "auto"\n'
        '[bodies]\nwall = ["left", "right"]\nball = ["ball"]\nmoving = "ball"\nreference = "wall"\n'
        '[tracking]\npolarity = "light"\n'
    )
    out = tmp_path / "out"
    with served(str(film), "--markers", str(bodies), "--out", str(out)) as server:
        hand = Hand.on(running, server.address)
        for at in ((330, 497), (798, 497), (887, 1102)):
            hand.point(at)
        hand.click("#track")
        hand.click("#convert")
        hand.tab.wait_for_selector("#motion")
        assert hand.error() == ""
        assert hand.messages == []
    text = bodies.read_text().replace(
        'left = "auto"', "left = [330, 497]\nright = [798, 497]\nball = [887, 1102]"
    )
    bodies.write_text(text)
    typed = convert(film, bodies)
    motion = Motion.read(out / "motion" / "motion.csv")
    away = motion.relative_mm - typed.motion.relative_mm
    assert np.hypot(*away.T).max() < 0.5 * np.hypot(*typed.motion.sigma[:, :2].T).max()
