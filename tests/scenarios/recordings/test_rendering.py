"""The rendered recordings: physically plausible, true to their truth, and redrawn alike."""

from __future__ import annotations

import csv
import tomllib
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
import shapely

from geometry2d.foundation.errors import DrinksimError
from geometry2d.rigid import RigidPlacement
from mocap.synthetic.recording_file import frame_times
from scenarios.recordings.choreography import minimum_jerk
from scenarios.recordings.rendering import frames_of, main, redraw, write_script_output
from scenarios.recordings.script import LIBRARY, RenderingError, Script, read_script, script_of
from scenarios.settings.scenario import load_scenario
from scenarios.settings.tables import SettingError
from tests.support.marks import slow

NAMES = sorted(file.parent.name for file in LIBRARY.glob("*/recording.toml"))
CASES = [name if name == "A38-F" else slow(name) for name in NAMES]
"""The recordings of nearly empty packages are twice as long."""


@dataclass(frozen=True)
class Encounter:
    """How deep the walls of the neck are in the undeformed lips (mm) and how far from the rest."""

    time_s: np.ndarray
    tilt_deg: np.ndarray
    upper: np.ndarray
    lower: np.ndarray
    teeth: np.ndarray
    nose: np.ndarray

    def touched(self, depth: np.ndarray) -> tuple[float, float]:
        times = self.time_s[depth > 0]
        return float(times[0]), float(times[-1])


@cache
def tissue(name: str):
    head = script_of(name).face()
    lips = {}
    for lip in (head.upper, head.lower):
        body = shapely.union_all([shapely.Polygon(p).buffer(1e-6) for p in lip.regions.values()])
        shapely.prepare(body)
        lips[lip.name] = body, shapely.LineString(lip.curves["skin"])
    teeth = shapely.union_all(
        [shapely.Polygon(t.sampled(0.1)) for t in (head.upper_tooth, head.lower_tooth)]
    )
    above_subnasale = shapely.box(-500, head.landmarks["subnasale"][1] + 1, 500, 500)
    return lips, teeth, lips["upper"][0].intersection(above_subnasale)


def depth_in(wall, lip) -> float:
    """Depth of the deepest point of a wall (n, 2) under the skin; negative: distance from it."""
    body, skin = lip
    points = shapely.points(wall)
    inside = shapely.contains(body, points)
    distance = shapely.distance(skin, points)
    return float(np.where(inside, distance, -distance).max())


@cache
def encounter(name: str) -> Encounter:
    script = script_of(name)
    lips, teeth, nose = tissue(name)
    neck, motion = script.neck(), script.neck_motion()
    walls = neck.upper_wall.sampled(0.2), neck.lower_wall.sampled(0.2)
    rows = []
    for time in np.arange(0, script.recording.duration_s, 0.05):
        place: RigidPlacement = motion.at(float(time))
        upper, lower = (place.apply(wall) for wall in walls)
        both = shapely.MultiPolygon([shapely.Polygon(upper), shapely.Polygon(lower)])
        rows.append(
            (
                time,
                np.degrees(place.angle_rad),
                depth_in(upper, lips["upper"]),
                depth_in(lower, lips["lower"]),
                shapely.distance(both, teeth),
                shapely.distance(both, nose),
            )
        )
    return Encounter(*np.array(rows).T)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_the_neck_clears_teeth_and_nose(name):
    met = encounter(name)
    assert met.teeth.min() >= 0.3
    assert met.nose.min() > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_the_lower_lip_is_touched_first_and_left_last(name):
    met = encounter(name)
    lower, upper = met.touched(met.lower), met.touched(met.upper)
    assert lower[0] < upper[0] < upper[1] < lower[1]
    assert met.lower[0] < -20 and met.upper[0] < -20
    assert met.lower[-1] < -20 and met.upper[-1] < -20


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_the_lips_are_pressed_as_a_sip_presses_them(name):
    met = encounter(name)
    assert 1.5 <= met.lower.max() <= 2.6
    if name != "DC-AE":
        assert 2.5 <= met.upper.max() <= 3.6


@pytest.mark.parametrize("name", CASES)
def test_contact_lasts_as_long_as_the_timing_says(name):
    timing = tomllib.loads((LIBRARY / "timing.toml").read_text())["recordings"]
    key = "full_contact_s" if name.endswith("-F") else "almost_empty_contact_s"
    first, last = encounter(name).touched(encounter(name).lower)
    assert last - first == pytest.approx(timing[key], abs=0.3)


@pytest.mark.slow
def test_the_lips_embrace_the_small_neck_when_it_is_sucked_at():
    """Deeper than any press: the upper lip has to be drawn out of the way and over the wall."""
    assert 5.5 <= encounter("DC-AE").upper.max() <= 7.5


def test_the_mouth_is_wider_open_only_where_the_neck_goes_in():
    opening = {name: script_of(name).head.jaw_opening_deg for name in NAMES}
    assert opening == {"A38-F": 7.0, "A38-AE": 7.0, "DC-F": 7.0, "DC-AE": 10.0}
    for name in NAMES:
        assert load_scenario(name).head.measurements.jaw_opening_deg == opening[name]


def test_a38_f_tilts_about_the_lower_lip_until_the_upper_lip_closes_on_the_rim():
    met = encounter("A38-F")
    first = met.touched(met.upper)[0]
    before, after = np.interp([1.2, 2.4], met.time_s, met.tilt_deg)
    assert 12 <= after - before <= 20
    assert 1.2 < first < 2.4
    during = (met.time_s > 1.5) & (met.time_s < 4.6)
    assert np.ptp(met.lower[during]) < 0.6


@pytest.mark.parametrize("name", CASES)
def test_the_head_pitches_as_the_timing_says(name):
    timing = tomllib.loads((LIBRARY / "timing.toml").read_text())["recordings"]
    key = "full_pitch_deg" if name.endswith("-F") else "almost_empty_pitch_deg"
    script = script_of(name)
    head = np.degrees(script.head_motion().angle_rad)
    assert np.ptp(head) == pytest.approx(timing[key], abs=1.0)
    tilt = script.head.steps[1]
    noticeable = tilt.from_s + 0.19 * (tilt.to_s - tilt.from_s)
    assert minimum_jerk(0.19) == pytest.approx(0.05, abs=0.002)
    assert tilt.to_s - tilt.from_s == pytest.approx(timing["pitch_step_s"])
    first = encounter(name).touched(encounter(name).lower)[0]
    assert first - noticeable == pytest.approx(timing["pitch_begins_before_contact_s"], abs=0.15)


@pytest.mark.parametrize("name", CASES)
def test_the_stored_motion_and_pixels_belong_together(name):
    """Projecting the stored millimetres with the script's camera gives the stored pixels."""
    script, folder = script_of(name), LIBRARY / name
    with (folder / "truth_motion.csv").open() as file:
        motion = list(csv.DictReader(file))
    with (folder / "truth.csv").open() as file:
        pixels = {(int(r["frame"]), r["marker"]): r for r in csv.DictReader(file)}
    assert len(motion) == round(script.recording.duration_s * script.camera.fps)
    for frame in range(0, len(motion), 9):
        row = {key: float(value) for key, value in motion[frame].items()}
        truth = pixels[frame, "package_lower"]
        seen = script.camera.project([row["package_x_mm"], row["package_y_mm"]])
        assert seen == pytest.approx([float(truth["x_px"]), float(truth["y_px"])], abs=0.02)
        turn = np.radians(row["head_theta_deg"])
        c, s = np.cos(turn), np.sin(turn)
        x, y = row["rel_x_mm"], row["rel_y_mm"]
        world = [row["head_x_mm"] + c * x - s * y, row["head_y_mm"] + s * x + c * y]
        assert world == pytest.approx([row["package_x_mm"], row["package_y_mm"]], abs=1e-4)
        assert float(truth["visible"]) > 0.99


@pytest.mark.parametrize("name", CASES)
def test_the_stored_recording_shows_what_the_script_draws(name):
    """Stale pictures are noticed: after a change of face or neck, redraw the recordings."""
    import av

    script = script_of(name)
    wanted = round(0.45 * script.recording.duration_s * script.camera.fps)
    file = LIBRARY / name / "recording.mp4"
    assert file.stat().st_size <= 2_000_000
    with av.open(str(file)) as container:
        stream = container.streams.video[0]
        assert (stream.width, stream.height) == (1280, 720)
        assert stream.codec_context.name == "h264" and stream.pix_fmt == "yuv420p"
        assert stream.average_rate == 25
        for index, frame in enumerate(container.decode(stream)):
            if index == wanted:
                stored = frame.to_ndarray(format="rgb24", src_colorspace="ITU709")
        assert index + 1 == round(script.recording.duration_s * script.camera.fps)
    drawn, _ = next(frames_of(script, frames=[wanted]))
    difference = np.abs(stored.astype(float) - drawn)
    assert difference.mean() < 2.0
    assert np.percentile(difference, 99.9) < 25


@pytest.mark.slow
def test_drawing_twice_gives_the_same_bytes(tmp_path):
    script = script_of("A38-F")
    short = replace(script, recording=replace(script.recording, duration_s=0.12))
    for name in ("one", "two"):
        write_script_output(short, tmp_path / name)
    for file in sorted((tmp_path / "one").iterdir()):
        assert file.read_bytes() == (tmp_path / "two" / file.name).read_bytes(), file.name
    positions = tomllib.loads((tmp_path / "one" / "markers.toml").read_text())
    stored = tomllib.loads((LIBRARY / "A38-F" / "markers.toml").read_text())
    assert positions == stored
    assert positions["recording"]["rendered"] is True
    assert positions["scale"]["package"] == 14.0


def test_unknown_names_and_keys_are_refused(tmp_path):
    with pytest.raises(RenderingError, match=r"no recording 'A39'.*A38-F"):
        redraw("A39", tmp_path)
    text = (LIBRARY / "A38-F" / "recording.toml").read_text()
    wrong = tmp_path / "recording.toml"
    wrong.write_text(text.replace("distance_mm", "distanc_mm"))
    with pytest.raises(SettingError, match=r"camera.distanc_mm.*camera.distance_mm"):
        read_script(wrong)
    wrong.write_text(text.replace('neck = "A38"', 'neck = "A83"'))
    with pytest.raises(RenderingError, match=r"'A83': known necks are A38"):
        read_script(wrong).neck()


@pytest.mark.parametrize(
    ("old", "new", "error", "words"),
    [
        ("[light]", "[lihgt]", RenderingError, r"no table \[lihgt\]: did you mean 'light'"),
        ("[camera.lens]", "[spare]", RenderingError, r"no table \[spare\]"),
        ("focal_px = [4400.0, 4400.0]", "focal_px = [4400.0]", SettingError, "a list of 2 numbers"),
        ("focal_px = [4400.0, 4400.0]", "focal_px = [4400.0, nan]", DrinksimError, "focal_px"),
        (
            "duration_s = 6.0",
            "duration_s = 1e9",
            RenderingError,
            "at most 600 s and 20000 pictures",
        ),
        ("duration_s = 6.0", "duration_s = nan", DrinksimError, "duration_s"),
        (
            "fps = 25.0\nexposure_s = 0.006",
            "fps = 1e6",
            RenderingError,
            "at most 600 s and 20000 pictures",
        ),
        ("width = 1280", "width = 128000", RenderingError, "at most 8192 px"),
        ("width = 1280", f"width = {'9' * 5000}", RenderingError, "too many digits"),
        ("gamma = 2.2", f"gamma = {'[' * 5000}", RenderingError, "nested more than"),
    ],
)
def test_a_hostile_script_is_refused(tmp_path, old, new, error, words):
    text = (LIBRARY / "A38-F" / "recording.toml").read_text()
    wrong = tmp_path / "recording.toml"
    assert old in text
    wrong.write_text(text.replace(old, new, 1))
    with pytest.raises(error, match=rf"recording\.toml.*{words}"):
        read_script(wrong)
    wrong.write_text("[package]\nsteps = 3\n")
    with pytest.raises(DrinksimError, match=r"recording\.toml"):
        read_script(wrong)
    wrong.write_bytes("# é\n".encode("latin-1"))
    with pytest.raises(RenderingError, match="line 1: byte 0xe9 is not UTF-8"):
        read_script(wrong)


def test_the_command_says_in_one_line_what_is_wrong(tmp_path, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(["A39", "--out", str(tmp_path)])
    assert stopped.value.code == 2
    assert "there is no recording 'A39' in the library" in capsys.readouterr().err


def test_every_script_is_a_script():
    assert all(isinstance(script_of(name), Script) for name in NAMES)
    assert all(
        len(frame_times(s.camera, s.recording.duration_s)) > 100 for s in map(script_of, NAMES)
    )
