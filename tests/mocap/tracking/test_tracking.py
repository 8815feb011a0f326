"""Whole drawn clips: positions, motions and errors against the truth; occlusion; corrections."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest

from mocap.convert import convert, given_tracks
from mocap.measurement import Measurement, measure
from mocap.motion.errors import MotionError
from mocap.motion.projection import PictureFormat
from mocap.synthetic.recording_file import write_recording
from mocap.synthetic.truth import Truth
from mocap.tracking.errors import TrackingError, UnnamedSpotsError
from mocap.tracking.follow import follow
from mocap.tracking.locate import locate_markers
from mocap.tracking.marker_file import read_markers
from mocap.tracking.markers import MarkerFile, MarkerFileError
from mocap.tracking.noise import with_temporal_noise
from mocap.tracking.tracks import Tracks, TracksError, read_tracks
from mocap.video.channels import Pixels
from mocap.video.frames import Video
from mocap.views.depths import depth_effect
from mocap.views.overlay import draw_frame
from tests.support.clips import Clip
from tests.support.marks import slow

SMALL = Clip(width=480, height=300, px_per_mm=1.45, frames=36)


@cache
def drawn(clip: Clip) -> tuple[Path, Path, list[Truth]]:
    return clip.write(Path(mkdtemp(prefix="clip")))


@cache
def tracked(clip: Clip) -> tuple[Tracks, Measurement, list[Truth]]:
    video, markers, truths = drawn(clip)
    file = read_markers(markers)
    film = Video(video)
    raw = follow(film, file)
    tracks = with_temporal_noise(
        raw, bodies=file.rigid_bodies, key_frames=film.key_frames
    ).interpolated()
    picture = PictureFormat(film.info.width, film.info.height)
    return tracks, measure(tracks, file, picture), truths


def pixel_errors(tracks: Tracks, truths: list[Truth]) -> np.ndarray:
    right = [[(t.markers[n].x_px, t.markers[n].y_px) for n in tracks.names] for t in truths]
    return tracks.position_px - np.array(right)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_clean_clip_to_a_twentieth_of_a_pixel() -> None:
    tracks, _, truths = tracked(SMALL)
    assert np.all(tracks.status == "seen")
    assert rms(pixel_errors(tracks, truths)) < 0.05


def test_errors_do_not_depend_on_the_place_within_a_pixel() -> None:
    tracks, _, truths = tracked(SMALL)
    off = pixel_errors(tracks, truths)
    phase = (tracks.position_px - off) % 1
    fifth = np.minimum((5 * phase).astype(int), 4)
    means = [off[fifth == k].mean() for k in range(5)]
    assert min(np.count_nonzero(fifth == k) for k in range(5)) > 40
    assert np.ptp(means) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize(
    "clip",
    [
        replace(SMALL, seed=1, full_well_e=4000, exposure_s=0.01, crf=20),
        slow(replace(SMALL, seed=2, full_well_e=4000, fps=50, uneven_times=True, crf=20)),
        slow(replace(SMALL, seed=3, full_well_e=4000, lens=(-0.15, 0.05), crf=18)),
        replace(SMALL, seed=4, mark_colour=(0.97, 0.97, 0.97), package_colour=(0.1, 0.2, 0.45)),
    ],
    ids=["noise and blur", "uneven times", "lens", "light marks"],
)
def test_realistic_clips_to_a_tenth_of_a_pixel(clip: Clip) -> None:
    tracks, measured, truths = tracked(clip)
    assert (tracks.status == "seen").mean() > 0.95
    assert rms(pixel_errors(tracks, truths)[tracks.status == "seen"]) < 0.10
    place, turn = clip.relative_truth(truths)
    assert rms(measured.motion.relative_mm - place) < 0.15
    assert np.degrees(rms(measured.motion.relative_rad - turn)) < 0.35


@pytest.mark.slow
def test_every_marker_is_itself_again_after_a_hand_passed() -> None:
    """The hand carries dark spots of its own and hides three markers for twelve frames."""
    clip = replace(SMALL, seed=5, frames=40, occluded=(0.5, 0.98), full_well_e=4000, crf=20)
    tracks, _, truths = tracked(clip)
    error = np.hypot(*np.moveaxis(pixel_errors(tracks, truths), -1, 0))
    seen = tracks.status == "seen"
    assert error[seen].max() < 0.5
    hidden = np.array([[t.markers[n].visible < 0.5 for n in tracks.names] for t in truths])
    assert hidden.sum() >= 3 * 12
    assert not np.any(seen & hidden)
    assert np.all(seen[-8:])
    assert np.all(tracks.status[hidden] == "predicted")
    # Where a marker is interpolated its stated error is large and covers the true one.
    within = error[hidden] < 3 * np.sqrt(2) * tracks.sigma_px[hidden]
    assert within.mean() > 0.9


@pytest.mark.slow
@pytest.mark.parametrize(
    "clip",
    [
        replace(SMALL, seed=6, head_depth_mm=65.0, full_well_e=6000),
        slow(
            Clip(1, 1280, 720, 2.9, frames=40, head_depth_mm=65.0, full_well_e=5000, crf=20),
        ),
    ],
    ids=["480x300", "1280x720"],
)
def test_depth_of_the_head_is_corrected_with_its_own_scale(clip: Clip) -> None:
    """And the report says how wrong the position would be without, from the clip itself."""
    tracks, measured, truths = tracked(clip)
    markers = drawn(clip)[1]
    place, turn = clip.relative_truth(truths)
    assert rms(measured.motion.relative_mm - place) < 0.15
    assert np.degrees(rms(measured.motion.relative_rad - turn)) < (
        0.15 if clip.width > 1000 else 0.3
    )
    said = depth_effect(measured, read_markers(markers))
    blind = markers.with_name("blind.toml")
    blind.write_text(clip.marker_file(truths[0], head_scale=False))
    without = measure(tracks, read_markers(blind), PictureFormat(clip.width, clip.height))
    wrong = np.sqrt(np.mean(np.sum((without.motion.relative_mm - place) ** 2, axis=1)))
    assert wrong > 3.0
    assert said["error_without_mm"] == pytest.approx(wrong, rel=0.1)
    # Without it, only what a difference of depth would do can be said.
    unsure = depth_effect(without, read_markers(blind))
    percent = 100 * (said["reference_over_moving_scale"] - 1)
    assert percent * unsure["error_per_percent_mm"] == pytest.approx(wrong, rel=0.15)
    assert any("[scale] head is not given" in warning for warning in unsure["warnings"])


@pytest.mark.slow
def test_stated_errors_hold_for_pixels_and_motions() -> None:
    """Fractions within one and two standard errors over clips of different quality."""
    pixels, places, turns = [], [], []
    for seed in range(6):
        clip = replace(
            SMALL,
            seed=100 + seed,
            full_well_e=[np.inf, 4000, 2000][seed % 3],
            exposure_s=[0.0, 0.01, 0.02][(seed // 2) % 3],
            crf=[12.0, 18.0, 23.0][(seed // 3) % 3],
            head_depth_mm=65.0 * (seed % 2),
        )
        tracks, measured, truths = tracked(clip)
        seen = tracks.status == "seen"
        pixels.append(pixel_errors(tracks, truths)[seen] / tracks.sigma_px[seen][:, None])
        place, turn = clip.relative_truth(truths)
        motion = measured.motion
        places.append((motion.relative_mm - place) / motion.sigma[:, :2])
        turns.append((motion.relative_rad - turn)[1:] / motion.sigma[1:, 2])
    score = np.abs(np.concatenate([part.ravel() for part in pixels]))
    assert 0.60 < np.mean(score < 1) < 0.76
    assert 0.91 < np.mean(score < 2) < 0.98
    # Errors of one clip's motion go together (its scale, its first frame), so six clips say less.
    for parts in (places, turns):
        score = np.abs(np.concatenate([part.ravel() for part in parts]))
        assert 0.45 < np.mean(score < 1) < 0.90
        assert 0.85 < np.mean(score < 2) <= 1.0


def test_markers_without_positions_are_told_by_their_layout() -> None:
    tracks, _, truths = tracked(SMALL)
    video, markers, _ = drawn(SMALL)
    bare = markers.with_name("bare.toml")
    bare.write_text(SMALL.marker_file(truths[0], positions=False))
    again = follow(Video(video), read_markers(bare), end_s=0.2)
    for name in tracks.names:
        np.testing.assert_allclose(again.of(name)[0], tracks.of(name)[0][: len(again.frame)])


def picture_of_spots(
    spots: Iterable[tuple[tuple[int, int], int, int]],
) -> Pixels:
    """Return a grey picture with round spots, each at a place, of a radius and a grey level."""
    import cv2

    image = np.full((400, 640), 190, np.uint8)
    for at, radius, level in spots:
        cv2.circle(image, at, radius, level, -1, cv2.LINE_AA)
    return Pixels(cv2.GaussianBlur(image, (0, 0), 0.8))


def all_auto(folder: Path) -> MarkerFile:
    """Return a marker file that leaves it to the program where the markers are."""
    file = folder / "auto.toml"
    file.write_text('[scale]\npackage = 14.0\n[markers]\near = "auto"\n')
    return read_markers(file)


@pytest.mark.parametrize(("package_level", "sure"), [(40, True), (240, False), (172, False)])
def test_spots_of_two_kinds_are_not_the_markers_of_one_person(
    tmp_path: Path, package_level: int, sure: bool
) -> None:
    head, package = [(100, 150), (310, 160)], [(480, 300), (500, 280)]
    spots = [(at, 7, 20) for at in head] + [(at, 7, package_level) for at in package]
    image, wanted = picture_of_spots(spots), all_auto(tmp_path)
    if sure:
        assert locate_markers(image, wanted, 0)["ear"].x == pytest.approx(100, abs=0.5)
    else:
        with pytest.raises(UnnamedSpotsError, match="no arrangement of them"):
            locate_markers(image, wanted, 0)


@pytest.mark.slow
def test_a_printed_carton_is_not_taken_for_markers(tmp_path: Path) -> None:
    print_on_carton = [(x, y) for x in range(360, 620, 26) for y in range(120, 380, 26)]
    image = picture_of_spots([(at, 6, 40) for at in [*print_on_carton, (120, 150), (310, 140)]])
    with pytest.raises(TrackingError, match=r"none is clearly better: give the positions of ear"):
        locate_markers(image, all_auto(tmp_path), 0)


@pytest.mark.parametrize(
    ("width_mm", "sure"), [(105, True), (112, True), (140, False), (78, False)]
)
def test_a_lone_arrangement_is_taken_if_it_is_like_a_face(
    tmp_path: Path, width_mm: int, sure: bool
) -> None:
    places = [(100, 150), (100 + 2 * width_mm, 160), (480, 300), (500, 280)]
    image, wanted = picture_of_spots([(at, 7, 40) for at in places]), all_auto(tmp_path)
    if sure:
        assert locate_markers(image, wanted, 0)["ear"].x == pytest.approx(100, abs=0.5)
    else:
        with pytest.raises(UnnamedSpotsError, match=r"are unlike one|no arrangement of them"):
            locate_markers(image, wanted, 0)


@pytest.mark.slow
def test_a_clip_corrected_by_hand(tmp_path: Path) -> None:
    video, markers, _ = drawn(SMALL)
    first = convert(video, markers, out=tmp_path / "first")
    path = tmp_path / "first" / "tracks.csv"
    lines = path.read_text().splitlines()
    kept = []
    for line in lines:
        frame, time, marker, *_ = line.split(",")
        if marker == "nose" and frame == "10":
            line = f"{frame},{time},nose,301.25,99.5,,fixed"  # noqa: PLW2901
        elif marker == "nose" and frame in ("9", "11"):
            line = f"{frame},{time},nose,,,,lost"  # noqa: PLW2901
        elif marker == "ear" and frame == "20":
            continue
        kept.append(line)
    corrected = tmp_path / "corrected.csv"
    corrected.write_text("\n".join(kept) + "\n")
    tracks = convert(video, markers, out=tmp_path / "second", tracks=corrected).tracks
    nose, ear = tracks.names.index("nose"), tracks.names.index("ear")
    np.testing.assert_allclose(tracks.position_px[10, nose], [301.25, 99.5])
    assert tracks.status[10, nose] == "fixed"
    assert np.isfinite(tracks.position_px[[9, 11], nose]).all()
    # What was left out was tracked anew, what was left alone is as it was.
    np.testing.assert_allclose(
        tracks.position_px[20, ear], first.tracks.position_px[20, ear], atol=0.02
    )
    np.testing.assert_allclose(tracks.position_px[30], first.tracks.position_px[30], atol=1e-4)
    again = read_tracks(tmp_path / "second" / "tracks.csv")
    np.testing.assert_allclose(again.position_px, tracks.position_px, atol=1e-4)
    assert again.names == tracks.names


def test_points_for_some_frames_only_are_honoured_and_filled_in_between(tmp_path: Path) -> None:
    """Two rows by hand, nothing else: the rest is tracked, from where the hand put the marker."""
    video, markers, _ = drawn(SMALL)
    tracks, _, _ = tracked(SMALL)
    nose, ear = (tracks.position_px[:, tracks.names.index(name)] for name in ("nose", "ear"))
    path = tmp_path / "few.csv"
    path.write_text(
        "frame,time_s,marker,x_px,y_px,sigma_px,status\n"
        f"8,{tracks.time_s[8]:.6f},nose,{nose[8, 0] + 1.5:.3f},{nose[8, 1]:.3f},0.3,fixed\n"
        f"20,{tracks.time_s[20]:.6f},nose,{nose[20, 0]:.3f},{nose[20, 1] - 1.2:.3f},,fixed\n"
    )
    found = follow(Video(video), read_markers(markers), given=given_tracks(path)).interpolated()
    k = found.names.index("nose")
    np.testing.assert_allclose(found.position_px[8, k], nose[8] + [1.5, 0], atol=1e-3)
    np.testing.assert_allclose(found.position_px[20, k], nose[20] - [0, 1.2], atol=1e-3)
    assert list(found.status[[7, 8, 9, 20], k]) == ["seen", "fixed", "seen", "fixed"]
    assert found.sigma_px[8, k] == 0.3 and found.sigma_px[20, k] == 0.5
    others = np.delete(np.arange(len(found.frame)), [8, 20])
    np.testing.assert_allclose(found.position_px[others, k], nose[others], atol=0.02)
    np.testing.assert_allclose(found.position_px[:, found.names.index("ear")], ear, atol=0.02)


def test_the_picture_of_the_motion_shows_its_uncertainty_as_a_band() -> None:
    _, measured, _ = tracked(SMALL)
    motion = measured.motion
    axes = motion.plot().axes
    curves = [*motion.relative_mm.T, np.degrees(motion.relative_rad)]
    sigmas = [*motion.sigma[:, :2].T, np.degrees(motion.sigma[:, 2])]
    for panel, strip, curve, sigma in zip(axes[::2], axes[1::2], curves, sigmas, strict=True):
        for place, middle in ((panel, curve), (strip, 0 * curve)):
            (band,) = (c for c in place.collections if c.get_label() == "band")
            corners = band.get_paths()[0].vertices
            assert corners[:, 1].max() == pytest.approx((middle + 2 * sigma).max())
            assert corners[:, 1].min() == pytest.approx((middle - 2 * sigma).min())
        # The strip is there because the band is too narrow beside the motion.
        assert np.median(4 * sigma) > 0.2 * np.ptp(strip.get_ylim())


def test_the_overlay_covers_what_a_rendered_recording_says_in_its_corner() -> None:
    """The overlay says "rendered" itself; of a filmed recording, the corner shines through."""
    tracks, measured, _ = tracked(SMALL)
    markers = read_markers(drawn(SMALL)[1])
    assert markers.rendered
    plain = np.full((720, 1280, 3), 250, np.uint8)
    written = plain.copy()
    written[12:28, 1190:1260] = 60
    same = {}
    for rendered in (True, False):
        said = replace(markers, rendered=rendered)
        first, second = (
            draw_frame(picture.copy(), tracks, 0, measured.motion, 0, said)
            for picture in (plain, written)
        )
        same[rendered] = np.array_equal(first, second)
    assert same == {True: True, False: False}


def test_tracks_of_another_program_are_taken_over(tmp_path: Path) -> None:
    video, markers, _ = drawn(SMALL)
    tracks, _, _ = tracked(SMALL)
    header = [["scorer"], ["bodyparts"], ["coords"]]
    for name in ("nose", "package_upper"):
        header[0] += ["net", "net"]
        header[1] += [name, name]
        header[2] += ["x", "y"]
    rows = [",".join(cells) for cells in header]
    for i in range(len(tracks.frame)):
        points = [tracks.of(name)[0][i] for name in ("nose", "package_upper")]
        rows.append(f"{i}," + ",".join(f"{v:.3f}" for v in np.ravel(points)))
    path = tmp_path / "net.csv"
    path.write_text("\n".join(rows) + "\n")
    found = follow(Video(video), read_markers(markers), given=given_tracks(path))
    nose = found.names.index("nose")
    np.testing.assert_allclose(found.position_px[:, nose], tracks.position_px[:, nose], atol=1e-3)
    assert np.all(found.sigma_px[:, nose] == 0.5)
    ear = found.names.index("ear")
    np.testing.assert_allclose(found.position_px[:, ear], tracks.position_px[:, ear], atol=1e-3)


def with_text(markers: Path, name: str, old: str, new: str) -> Path:
    changed = markers.with_name(name)
    text = markers.read_text()
    assert old in text
    changed.write_text(text.replace(old, new))
    return changed


def test_bad_input_leaves_nothing_behind(tmp_path: Path) -> None:
    video, markers, _ = drawn(SMALL)
    still = tmp_path / "still.mp4"
    black = np.zeros((64, 96, 3), np.uint8)
    write_recording(still, [black] * 5, np.arange(5) / 25)
    one = tmp_path / "one.mp4"
    write_recording(one, [black], np.zeros(1))
    ear = next(line for line in markers.read_text().splitlines() if line.startswith("ear"))
    upper = next(line for line in markers.read_text().splitlines() if "package_upper" in line)
    lower = next(line for line in markers.read_text().splitlines() if "package_lower" in line)
    off = with_text(markers, "off.toml", ear, "ear = [4000.0, 10.0]")
    nothing = with_text(markers, "nothing.toml", ear, "ear = [40.0, 280.0]")
    same = with_text(markers, "same.toml", upper, lower.replace("lower", "upper"))
    cases: list[tuple[Path, Path, type[ValueError], str]] = [
        (still, markers, TrackingError, "lies off the picture|shows nothing"),
        (video, off, TrackingError, r"ear = \[4000, 10\] lies off the picture of 480 x 300"),
        (video, nothing, TrackingError, "ear: no dark, light or coloured spot of its own within"),
        (video, same, MarkerFileError, "package_lower and package_upper coincide"),
    ]
    for film, file, error, words in cases:
        with pytest.raises(error, match=words):
            convert(film, file, out=tmp_path / "out")
    with pytest.raises(TrackingError, match="only one frame is used"):
        convert(video, markers, out=tmp_path / "out", end_s=0.0)
    with pytest.raises(TrackingError, match="shows nothing"):
        convert(one, markers, out=tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.mp4", "still.mp4"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("0,0.000000,ear", "0,0.000000,eer", "marker 'eer' is not in"),
        (",seen", ",sene", "status 'sene' is none of"),
        ("0,0.000000,ear,", "0,0.000000,ear,x", "is not a finite number"),
        ("0,0.000000,", "0,inf,", "not a finite number"),
        ("0,0.000000,ear,", "0,0.000000,ear,7,", "has 8 cells and the header 7"),
        ("frame,time_s", "frame,zeit", "lacks time_s"),
    ],
)
def test_broken_tracks_are_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    video, markers, _ = drawn(SMALL)
    tracks, _, _ = tracked(SMALL)
    path = tmp_path / "tracks.csv"
    tracks.write(path)
    text = path.read_text()
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(TracksError, match=words):
        convert(video, markers, out=tmp_path / "out", tracks=path)
    path.write_text(text + text.splitlines()[-1] + "\n")
    with pytest.raises(TracksError, match="is there twice"):
        read_tracks(path)


@pytest.mark.slow
def test_a_marker_that_never_returns_ends_the_motion() -> None:
    clip = replace(SMALL, seed=8, frames=30, occluded=(0.8, 9.0))
    tracks, measured, _ = tracked(clip)
    assert tracks.status[-1, tracks.names.index("nose")] == "lost"
    assert measured.capture.frame[-1] == 19
    lost = replace_all_lost(tracks)
    with pytest.raises(MotionError, match=r"no frame in which both bodies.*never seen"):
        markers = read_markers(drawn(clip)[1])
        measure_motion_only(lost, markers)


def replace_all_lost(tracks: Tracks) -> Tracks:
    return replace(
        tracks,
        position_px=np.full_like(tracks.position_px, np.nan),
        status=np.full_like(tracks.status, "lost"),
    )


def measure_motion_only(tracks: Tracks, markers) -> None:  # type: ignore[no-untyped-def]
    from mocap.motion.poses import usable_rows

    usable_rows(tracks, markers)
