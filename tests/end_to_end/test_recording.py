"""The bundled rendered recording and a real one, against truth and an independent record."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from geometry2d.foundation.output import MARK, OutputError
from mocap.convert import ConvertResult, convert, write_conversion
from mocap.formats.exchange import read_positions
from mocap.measurement import measure
from mocap.motion.motion import Motion
from mocap.motion.projection import PictureFormat
from mocap.tracking.errors import TrackingError
from mocap.tracking.follow import follow
from mocap.tracking.locate import locate_markers
from mocap.tracking.marker_file import read_markers
from mocap.tracking.noise import with_temporal_noise
from mocap.video.frames import Video

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
SIP = ROOT / "scenarios" / "library" / "A38-F"
# Two bright marks on a wall, 0.80 m apart, and a ball thrown between them.
BALL_MARKERS = """
[scale]
wall = 800.0
[markers]
left_mark = [330, 497]
right_mark = [798, 497]
ball = [887, 1102]
[bodies]
wall = ["left_mark", "right_mark"]
ball = ["ball"]
moving = "ball"
reference = "wall"
[tracking]
polarity = "light"
"""
# The neck is near the lips while its lower mark is this close to its nearest place, mm.
NEAR_MM = 30.0


@pytest.fixture(scope="module")
def sip() -> ConvertResult:
    return convert(SIP / "recording.mp4", SIP / "markers.toml")


@pytest.fixture(scope="module")
def written(sip: ConvertResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("sip") / "result"
    write_conversion(sip, out)
    return out


@pytest.fixture(scope="module")
def ball(
    tmp_path_factory: pytest.TempPathFactory, recorded: Callable[[str], Path]
) -> ConvertResult:
    folder = tmp_path_factory.mktemp("ball")
    (folder / "markers.toml").write_text(BALL_MARKERS, encoding="utf-8")
    video = recorded("projectile/projetil.mp4")
    return convert(video, folder / "markers.toml")


def columns(path: Path) -> dict[str, np.ndarray]:
    return Motion.read(path).columns()


def test_markers_of_the_sip_are_tracked_to_a_tenth_of_a_pixel(sip: ConvertResult) -> None:
    with (SIP / "truth.csv").open(encoding="utf-8") as handle:
        truth = {
            (int(row["frame"]), row["marker"]): (float(row["x_px"]), float(row["y_px"]))
            for row in csv.DictReader(handle)
        }
    tracks = sip.tracks
    assert set(tracks.names) == {name for _, name in truth}
    for k, name in enumerate(tracks.names):
        right = np.array([truth[int(frame), name] for frame in tracks.frame])
        error = tracks.position_px[:, k] - right
        assert np.sqrt(np.mean(error**2)) < 0.10, name
        assert (tracks.status[:, k] == "seen").mean() > 0.95


def test_relative_motion_of_the_sip(sip: ConvertResult) -> None:
    truth = columns(SIP / "truth_motion.csv")
    motion = sip.motion.columns()
    np.testing.assert_allclose(motion["time_s"], truth["time_s"], atol=1e-4)
    apart = np.hypot(
        truth["rel_x_mm"] - truth["rel_x_mm"][truth["rel_x_mm"].argmin()],
        truth["rel_y_mm"] - truth["rel_y_mm"][truth["rel_x_mm"].argmin()],
    )
    near = apart < NEAR_MM
    assert near.sum() > 50
    for name, limit in (("rel_x_mm", 0.15), ("rel_y_mm", 0.15), ("rel_theta_deg", 0.15)):
        assert np.sqrt(np.mean((motion[name] - truth[name])[near] ** 2)) < limit, name


def test_depth_of_the_head_matters_and_is_reported(sip: ConvertResult) -> None:
    depth = sip.summary["depth"]
    assert depth["own_scale_of_reference"]
    assert depth["error_without_mm"] > 2.0
    assert sip.summary["recording"]["rendered"] is True


def test_skin_that_slides_over_the_jaw_is_reported_and_kept_apart(sip: ConvertResult) -> None:
    """The recording's script slides the jaw's skin by 0.8 and 1.3 mm on the head."""
    jaw = sip.summary["other_bodies"]["jaw"]
    assert jaw["moves_on_reference_mm"] == pytest.approx(np.hypot(0.8, 1.3), abs=0.15)
    opening = sip.measured.jaw_opening
    assert opening is not None
    # The jaw rests: what its marks show lies far within what sliding skin leaves.
    assert np.abs(opening.opening_rad[1:]).max() < 0.2 * opening.sigma_rad[1:].min()
    assert np.degrees(opening.sigma_rad[1]) == pytest.approx(6.0, abs=1.0)
    assert sip.summary["bodies"]["head"]["markers"] == ["ear", "nose"]
    assert list(sip.summary["drinking"]["phases_s"]) == [
        "approach", "contact", "tilt", "drink", "release"
    ]  # fmt: skip


def test_the_style_is_told_from_lip_and_rim(sip: ConvertResult) -> None:
    found = sip.summary["drinking"]
    assert found["style"] == "pull" and "inside the opening" in found["style_reason"]


@pytest.mark.parametrize(
    ("name", "style"), [("A38-AE", "pull"), ("DC-AE", "suck"), ("DC-F", "unknown")]
)
def test_the_style_of_the_other_recordings(name: str, style: str) -> None:
    """As their scripts say, but for DC-F, whose upper lip lies on the rim: that cannot be told."""
    folder = SIP.parent / name
    markers, film = read_markers(folder / "markers.toml"), Video(folder / "recording.mp4")
    tracks = with_temporal_noise(
        follow(film, markers), bodies=markers.rigid_bodies, key_frames=film.key_frames
    ).interpolated()
    measured = measure(tracks, markers, PictureFormat(film.info.width, film.info.height))
    found = measured.motion.drinking(measured.lip)
    assert found.style == style
    assert 14 < abs(found.neck_tilt_deg) < found.package_tilt_deg < 60


def test_boundary_conditions_are_the_motion_from_its_start(written: Path) -> None:
    motion = columns(written / "motion.csv")
    folder = written / "boundary_conditions"
    tables = sorted(path.stem for path in folder.glob("*.txt"))
    assert tables == sorted(
        f"{body}_{dof}" for body in ("head", "package", "relative") for dof in ("u1", "u2", "ur3")
    )
    table = np.loadtxt(folder / "relative_u1.txt", delimiter="\t")
    np.testing.assert_allclose(table[:, 0], motion["time_s"] - motion["time_s"][0], atol=1e-6)
    np.testing.assert_allclose(table[:, 1], motion["rel_x_mm"] - motion["rel_x_mm"][0], atol=2e-6)
    turn = np.loadtxt(folder / "relative_ur3.txt", delimiter="\t")
    np.testing.assert_allclose(turn[:, 1], np.radians(motion["rel_theta_deg"]), atol=1e-6)
    for ending in ("trc", "c3d"):
        package = read_positions(folder / f"motion.{ending}").of("package_lower")
        np.testing.assert_allclose(package[:, 0], motion["package_x_mm"], atol=1e-4)
        np.testing.assert_allclose(package[:, 1], motion["package_y_mm"], atol=1e-4)


def test_overlay_plays_in_a_browser(sip: ConvertResult, written: Path) -> None:
    import av

    with av.open(str(written / "overlay.mp4")) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        times = [frame.time for frame in container.decode(stream)]
    np.testing.assert_allclose(times, sip.tracks.time_s - sip.tracks.time_s[0], atol=1e-3)


def test_the_ball_agrees_with_the_independent_record(
    ball: ConvertResult, recorded: Callable[[str], Path]
) -> None:
    """Row k of the record is frame k + 2; its first rows, at the throw, belong to no one instant.

    The record's origin was placed by hand, so a constant shift between the two means nothing.
    """
    record = np.loadtxt(recorded("projectile/massa_A.txt"), skiprows=2)
    row = {int(frame): i for i, frame in enumerate(ball.measured.capture.frame)}
    k = np.arange(6, len(record))
    ours = ball.motion.relative_mm[[row[i + 2] for i in k]]
    apart = ours - 1000 * record[k, 1:]
    spread = apart - apart.mean(axis=0)
    assert np.sqrt(np.mean(spread**2)) < 6.0
    assert np.abs(apart.mean(axis=0)).max() < 20.0


def test_marks_on_the_wall_stay_rigid_while_the_camera_drifts(ball: ConvertResult) -> None:
    left, _ = ball.tracks.of("left_mark")
    right, _ = ball.tracks.of("right_mark")
    assert np.ptp(left, axis=0).max() > 4.0
    distance = np.hypot(*(right - left).T)
    slow = np.polyval(np.polyfit(ball.tracks.time_s, distance, 3), ball.tracks.time_s)
    assert np.abs(distance - slow).max() < 1.0
    # Gravity is the same in the end as at the start, however the camera moved.
    time = ball.motion.time_s
    flight = (time > 0.2) & (time < 1.1)
    fall = np.polyfit(time[flight], ball.motion.relative_mm[flight, 1], 2)
    assert -2 * fall[0] == pytest.approx(9810, rel=0.05)


def test_one_marker_bodies_do_not_turn(ball: ConvertResult) -> None:
    assert np.all(ball.motion.package.angle_rad == 0)
    assert any("one marker" in warning for warning in ball.summary["warnings"])


def test_a_video_without_face_and_package_is_refused_in_words(
    tmp_path: Path, recorded: Callable[[str], Path]
) -> None:
    markers = tmp_path / "markers.toml"
    markers.write_text("[scale]\npackage = 14.0\n[markers]\n")
    with pytest.raises(TrackingError) as caught:
        convert(recorded("projectile/projetil.mp4"), markers, out=tmp_path / "out")
    message = str(caught.value)
    assert "round spots were found" in message
    assert "(with ear, nose, package_lower, package_upper)" in message
    assert {path.name for path in (tmp_path / "out").iterdir()} == {".drinksim", "spots.png"}
    wanted = read_markers(markers)
    for frame in Video(recorded("projectile/projetil.mp4")).frames(end_s=0.8):
        # Two lights far off, and two faint blots that look like the marks of a package.
        if frame.index in (4, 21):
            with pytest.raises(TrackingError):
                locate_markers(frame.picture, wanted, frame.index)


@pytest.mark.parametrize("name", ["A38-F", "A38-AE", "DC-F", "DC-AE"])
@pytest.mark.parametrize("jaw", [True, False])
def test_markers_are_told_by_their_layout_wherever_the_clip_starts(
    tmp_path: Path, name: str, jaw: bool
) -> None:
    """Also while the head is pitched back, and with dots on the jaw that the file does not name."""
    folder = SIP.parent / name
    text = (folder / "markers.toml").read_text(encoding="utf-8")
    text = re.sub(r"^(ear|nose|package_lower|package_upper) = .*\n", "", text, flags=re.MULTILINE)
    left = r'\1 = "auto"\n' if jaw else ""
    text = re.sub(r"^(jaw_\w+) = .*\n", left, text, flags=re.MULTILINE)
    (tmp_path / "markers.toml").write_text(text, encoding="utf-8")
    wanted = read_markers(tmp_path / "markers.toml")
    assert len(wanted.names) == (6 if jaw else 4)
    with (folder / "truth.csv").open(encoding="utf-8") as handle:
        truth = {(int(row["frame"]), row["marker"]): row for row in csv.DictReader(handle)}
    for frame in Video(folder / "recording.mp4").frames():
        if frame.index % 40 == 0:
            for marker, spot in locate_markers(frame.picture, wanted, frame.index).items():
                row = truth[frame.index, marker]
                apart = (spot.x - float(row["x_px"]), spot.y - float(row["y_px"]))
                assert np.hypot(*apart) < 1.0, (frame.index, marker)


def test_bottles_without_markers_are_refused_wherever_the_clip_starts(
    tmp_path: Path, recorded: Callable[[str], Path]
) -> None:
    bottles = recorded("bottle.mp4")
    markers = tmp_path / "markers.toml"
    markers.write_text("[scale]\npackage = 14.0\n[markers]\n")
    wanted = read_markers(markers)
    for frame in Video(bottles).frames():
        if frame.index % 20 == 0:
            with pytest.raises(TrackingError, match=r"package_upper\)|for 4 markers"):
                locate_markers(frame.picture, wanted, frame.index)
    with pytest.raises(TrackingError) as caught:
        convert(bottles, markers, out=tmp_path / "out")
    assert "frame 0: 7 round spots were found" in str(caught.value)
    assert "(with ear, nose, package_lower, package_upper)" in str(caught.value)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {".drinksim", "spots.png"}


def test_in_memory_and_on_disk_a_conversion_is_the_same(sip: ConvertResult, written: Path) -> None:
    assert Motion.read(written / "motion.csv") == sip.motion
    assert repr(sip) == f"ConvertResult(recording.mp4, 6 markers, {len(sip.warnings)} warnings)"
    assert sip.scales["package"].source == "package" and sip.motion.picture is not None


def test_progress_grows_to_the_end(tmp_path: Path) -> None:
    told: list[tuple[float, str]] = []
    convert(
        SIP / "recording.mp4",
        SIP / "markers.toml",
        out=tmp_path / "out",
        end_s=0.4,
        progress=lambda share, what: told.append((share, what)),
    )
    shares = [share for share, _ in told]
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert {what for _, what in told} == {"tracking the markers", "drawing the overlay"}


def test_results_are_replaced_whole_and_nothing_else_is(written: Path, tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("mine")
    with pytest.raises(OutputError, match="holds files that are not results"):
        convert(SIP / "recording.mp4", SIP / "markers.toml", out=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]
    report = json.loads((written / "summary.json").read_text(encoding="utf-8"))
    assert report["command"] == "drinksim convert"
    assert {path.name for path in written.iterdir()} == {
        "tracks.csv",
        "motion.csv",
        "motion.png",
        "jaw.csv",
        "boundary_conditions",
        "overlay.mp4",
        "summary.json",
        MARK,
    }
    assert [path.name for path in written.parent.iterdir()] == ["result"]
