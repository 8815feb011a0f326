"""Films, contact sheets and plots: they are made, and show what the run says."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import av
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from geometry2d.rigid import RigidPlacement
from mocap.motion.errors import MotionError
from mocap.motion.motion import Motion
from scenarios.results.increment import SectionModel, SolutionError
from scenarios.results.skin_line import SkinLine
from scenarios.results.solution import Solution
from scenarios.views.animation import animate, film_frames, film_times, telling_times
from scenarios.views.filmed import Crop, picture_scale, pictures_at
from scenarios.views.labels import PartLabels, most_pressed_place
from scenarios.views.limits import colour_reach
from scenarios.views.page.moving import moving_page
from scenarios.views.page.reported import reported_runs
from scenarios.views.plots import imprint, plot_histories, plot_imprint
from scenarios.views.run_view import RunView, RunViewError
from scenarios.views.scene import FADED, SectionArtists, boundary_loops
from scenarios.views.shown import SHOWN
from scenarios.views.themes import THEMES
from tests.support.made_up_sip import PICTURE_ORIGIN, PICTURE_SCALE, UPPER_MOUTH, earlier_version
from tests.support.marks import slow


@pytest.mark.slow
def test_a_film_plays_in_a_browser(run_directory: Path, tmp_path: Path) -> None:
    animate(run_directory, tmp_path / "sip.mp4", beside_video=True)
    with av.open(str(tmp_path / "sip.mp4")) as film:
        stream = film.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        times = [frame.time for frame in film.decode(stream)]
    assert (stream.width, stream.height) == (1280, 720)
    np.testing.assert_allclose(times, np.arange(26) / 25, atol=1e-4)
    data = (tmp_path / "sip.mp4").read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")  # starts before all of it has arrived
    assert [path.name for path in tmp_path.iterdir()] == ["sip.mp4"]


def test_the_recording_runs_along_with_the_model(run_directory: Path) -> None:
    run_view = RunView.of(run_directory, field="von_mises_mpa", beside_video=True)
    times = np.array([1.0, 1.5, 2.0])
    frames = list(film_frames(run_view, times, lambda share, text: None))
    red = np.array([frame[400, 60, 0] for frame in frames], float)
    # Frame n of the recording is shown at 0.8 + 0.04 n s and has red 40 + 4 n.
    np.testing.assert_allclose(red, 40 + 4 * (times - 0.8) / 0.04, atol=6)
    model = [frame[52:514, 648:1264].astype(int) for frame in frames]
    assert np.abs(model[1] - model[0]).max(axis=2).mean() > 2
    assert run_view.recording_title == "recording (rendered)"


def test_the_recording_is_shown_upright_and_in_its_place(run_directory: Path) -> None:
    run_view = RunView.of(run_directory, field="von_mises_mpa", beside_video=True)
    (frame,) = film_frames(run_view, np.array([1.5]), lambda share, text: None)
    panel = frame[52:514, 16:632].astype(int).sum(axis=2)
    rows, columns = np.nonzero(panel[40:] < 120)  # the dark bar, below the panel's label
    window = run_view.window_px(616 / 462)
    crop = Crop.around(window, picture=(320, 200), aspect=616 / 462)
    scale = 616 / crop.width
    # The bar covers the px 200…259 and 130…139 of the recording.
    assert rows.mean() + 40 == pytest.approx((134.5 - crop.top) * scale, abs=3)
    assert columns.mean() == pytest.approx((229.5 - crop.left) * scale, abs=3)


def test_frames_depend_on_their_time_alone(run_directory: Path) -> None:
    run_view = RunView.of(run_directory, field="von_mises_mpa", beside_video=False)
    once = list(film_frames(run_view, np.array([1.0, 1.5]), lambda share, text: None))
    alone = list(film_frames(run_view, np.array([1.5]), lambda share, text: None))
    np.testing.assert_array_equal(once[1], alone[0])


@pytest.mark.parametrize("beside", [True, slow(False)])
def test_a_contact_sheet_has_six_frames(run_directory: Path, tmp_path: Path, beside: bool) -> None:
    animate(run_directory, tmp_path / "sip.png", beside_video=beside)
    with Image.open(tmp_path / "sip.png") as sheet:
        assert sheet.width > 2000
        assert sheet.height > (800 if beside else 500)


def test_one_instant_is_shown_alone(run_directory: Path, tmp_path: Path) -> None:
    out = tmp_path / "half.png"
    animate(run_directory, out, beside_video=True, at=0.5)
    run_view = RunView.of(run_directory, field="von_mises_mpa", beside_video=True)
    (frame,) = film_frames(run_view, np.array([1.5]), lambda share, text: None)
    with Image.open(out) as picture:
        np.testing.assert_array_equal(np.array(picture), frame)
    for file, at, wanted in (("a.mp4", 0.5, r"must end in \.png"), ("a.png", 1.2, "between 0")):
        with pytest.raises(RunViewError, match=wanted):
            animate(run_directory, tmp_path / file, at=at)


def test_the_model_lies_over_the_recording_where_it_was(run_directory: Path) -> None:
    run_view = RunView.of(run_directory, field="von_mises_mpa", beside_video=False, over_video=True)
    (frame,) = film_frames(run_view, np.array([1.5]), lambda share, text: None)
    window = run_view.window(1248 / 462)
    mm_per_px = window.width / 1248
    # The lower lip's bulk is drawn over the picture, and fades it where it is in the world.
    solution = run_view.solution
    model, snapshot = solution.model, solution.at(1.5)
    bulk = np.unique(model.triangles[model.region == 3])
    points = run_view.head.at(1.5).apply((model.nodes + snapshot.displacement)[bulk])
    x, y = points.mean(axis=0)
    column = 16 + (x - window.left) / mm_per_px
    row = 52 + (window.bottom + window.height - y) / mm_per_px
    # The recording is green 96 there, the tissue 201.
    expected = FADED * 201 + (1 - FADED) * 96
    assert frame[int(row) + 20, int(column), 1] == pytest.approx(expected, abs=6)


def test_over_and_beside_exclude_each_other(run_directory: Path) -> None:
    with pytest.raises(RunViewError, match="exclude each other"):
        RunView.of(run_directory, field="von_mises_mpa", beside_video=True, over_video=True)


def test_a_band_stands_off_the_skin_by_its_pressure(run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    snapshot, model = solution.snapshot(5), solution.model
    for lip, side in (("upper", -1.0), ("lower", 1.0)):
        line = SkinLine(model, model.skin[lip], solution.contact[lip].arc_mm)
        points = line.points(model.nodes + snapshot.displacement)
        quads = line.band(points, np.full(len(points), 2.0))
        off = quads[:, 1] - quads[:, 0]
        np.testing.assert_allclose(np.hypot(*off.T), 2.0)
        assert np.median(side * off[:, 1]) > 1.5  # towards the opening, away from the tissue


def test_the_closer_look_follows_the_most_pressed_place(run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    lip, place = most_pressed_place(solution)
    assert lip == "upper"
    for index in (5, 8):
        snapshot = solution.snapshot(index)
        x, _ = snapshot.placement.apply(place[None])[0]
        assert x == pytest.approx(95.0, abs=1.5)


def test_names_lie_on_what_they_name(run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    figure = Figure()
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xlim=(70, 120), ylim=(-60, 0))
    labels = PartLabels(axes, size=10)
    labels.show(solution.snapshot(5), RigidPlacement(0.0, (0.0, 0.0)))
    texts = {text.get_text(): text for text in axes.texts if text.get_visible()}
    assert {"upper lip", "lower lip", "dermis", "neck"} <= texts.keys()
    assert texts["upper lip"].get_position()[1] > UPPER_MOUTH[1] > -38.0
    assert texts["lower lip"].get_position()[1] < -38.0


@pytest.mark.slow
def test_a_gif_repeats(run_directory: Path, tmp_path: Path) -> None:
    animate(run_directory, tmp_path / "sip.gif", field="log_strain_min")
    with Image.open(tmp_path / "sip.gif") as gif:
        assert gif.size == (800, 450)
        assert gif.n_frames == 13
        assert gif.info["loop"] == 0


@slow
def test_a_dark_film_is_dark_and_tells_the_same(run_directory: Path, tmp_path: Path) -> None:
    for theme in ("light", "dark"):
        animate(run_directory, tmp_path / f"{theme}.png", at=0.5, theme=theme)
    light, dark = (np.asarray(Image.open(tmp_path / f"{t}.png").convert("L")) for t in THEMES)
    assert np.median(light) > 240
    assert np.median(dark) < 60
    with pytest.raises(RunViewError, match="no theme 'black': take one of light, dark"):
        animate(run_directory, tmp_path / "black.png", at=0.5, theme="black")


def test_tissue_outside_the_dermis_is_coloured_where_a_field_is_there(run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    model = solution.model
    dermis = np.isin(model.region, (0, 2))
    assert set(SHOWN["von_mises_mpa"].tissue(model)) == set(np.flatnonzero(dermis))
    assert SHOWN["activation"].tissue(model).size == len(model.triangles)
    stretch = SHOWN["thickness_stretch"]
    far = colour_reach(solution, stretch)
    assert far.largest[0] == pytest.approx(solution.fields.along("thickness_stretch").max() - 1.0)
    assert far.largest[0] > 0.05
    norm = stretch.norm(far.limits[0])
    assert (norm.vmin, norm.vmax) == (1.0 - far.limits[0], 1.0 + far.limits[0])


def test_a_run_of_an_earlier_version_shows_what_it_holds(
    run_directory: Path, tmp_path: Path
) -> None:
    earlier = earlier_version(run_directory, tmp_path / "earlier")
    animate(earlier, tmp_path / "at.png", at=0.5)
    with pytest.raises(RunViewError, match=r"holds no activation, .* show one of log_strain_min"):
        animate(earlier, tmp_path / "at.png", at=0.5, field="activation")
    animate(run_directory, tmp_path / "other.png", at=0.5, field="activation")
    both, new = reported_runs([earlier, run_directory]), reported_runs([run_directory])
    assert [field["name"] for field in moving_page(both)["fields"]] == list(SHOWN)[:3]
    assert [field["name"] for field in moving_page(new)["fields"]] == list(SHOWN)


def test_what_cannot_be_shown_is_refused(run_directory: Path, tmp_path: Path) -> None:
    with pytest.raises(RunViewError, match=r"must end in one of \.mp4, \.gif, \.png"):
        animate(run_directory, tmp_path / "sip.avi")
    with pytest.raises(RunViewError, match="did you mean 'von_mises_mpa'"):
        animate(run_directory, tmp_path / "sip.mp4", field="von_mises")
    with pytest.raises(SolutionError, match="no run directory"):
        animate(tmp_path / "nowhere", tmp_path / "sip.mp4")
    assert list(tmp_path.iterdir()) == []


def test_telling_times_span_the_contact(run_directory: Path) -> None:
    times = telling_times(Solution.load(run_directory), 6)
    assert times.shape == (6,)
    assert (np.diff(times) > 0).all()
    assert times[0] < 1.1
    assert times[-1] > 1.9
    assert film_times(Solution.load(run_directory), 25.0)[-1] <= 2.0 + 1e-9


def test_the_model_is_drawn_where_it_is_in_the_world(run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    figure = Figure()
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xlim=(0, 200), ylim=(-100, 100))
    scene = SectionArtists(axes, solution.snapshot(0), SHOWN["von_mises_mpa"], (80.0, 80.0))
    head = RigidPlacement(0.3, (5.0, -7.0))
    frame = solution.snapshot(5)
    scene.show(frame, head)
    corner = int(np.argmin(np.hypot(*(solution.model.nodes - UPPER_MOUTH).T)))
    expected = head.apply(solution.model.nodes[corner] + frame.displacement[corner])
    path = scene.element_colours.get_paths()
    to_world = scene.element_colours.get_transform() - axes.transData
    drawn = np.vstack([to_world.transform(polygon.vertices) for polygon in path])
    assert np.hypot(*(drawn - expected).T).min() < 1e-9


def test_pressure_is_drawn_where_the_lip_is_pressed(run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    figure = Figure()
    FigureCanvasAgg(figure)
    scene = SectionArtists(
        figure.add_subplot(), solution.snapshot(0), SHOWN["von_mises_mpa"], (80.0, 80.0)
    )
    scene.show(solution.snapshot(5), RigidPlacement(0.0, (0.0, 0.0)))
    segments = np.array(scene.pressure_colours.get_segments())
    pressure = np.asarray(scene.pressure_colours.get_array())
    assert pressure.max() == pytest.approx(60.0, rel=0.01)
    pressed = segments[pressure > 30.0].mean(axis=1)
    assert np.abs(pressed[:, 0] - 95.0).max() < 3.0
    assert {-1, 1} == set(np.sign(pressed[:, 1] + 32.0))  # on both lips
    assert np.abs(pressed[:, 1] + 32.0).min() > 6.0  # pushed in, away from the opening


def test_loops_run_once_around_a_region(model: SectionModel) -> None:
    bulk = model.triangles[model.region == 1]
    (loop,) = boundary_loops(bulk)
    x, y = model.nodes[loop].T
    assert len(set(loop.tolist())) == len(loop)
    area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    assert area == pytest.approx(24.0 * 10.5)
    turned = bulk[:, [0, 2, 1, 5, 4, 3]]
    mixed = np.where((np.arange(len(bulk)) % 2 == 0)[:, None], bulk, turned)
    assert {frozenset(line.tolist()) for line in boundary_loops(mixed)} == {
        frozenset(loop.tolist())
    }


def test_two_regions_that_touch_in_a_node_have_closed_loops(model: SectionModel) -> None:
    squares = np.array([[0, 1, 2, 3, 4, 5], [2, 6, 7, 8, 9, 10]])
    loops = boundary_loops(squares)
    assert sorted(node for loop in loops for node in set(loop.tolist())) in (
        [0, 1, 2, 2, 3, 4, 5, 6, 7, 8, 9, 10],
        [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10],
    )


def test_colours_end_at_round_numbers_above_what_occurs(run_directory: Path) -> None:
    stress, pressure = colour_reach(Solution.load(run_directory), SHOWN["von_mises_mpa"]).limits
    assert stress == 80.0
    assert pressure == 80.0


def test_the_picture_scale_is_found_from_the_tracks(run_directory: Path) -> None:
    folder = run_directory / "motion"
    scale = picture_scale(Motion.read(folder / "motion.csv"), folder / "tracks.csv")
    assert scale is not None
    assert scale.px_per_mm == pytest.approx(PICTURE_SCALE, rel=1e-4)
    np.testing.assert_allclose(scale.pixels(np.zeros((1, 2)))[0], PICTURE_ORIGIN, atol=0.02)


def test_a_crop_keeps_places_and_stays_inside(tmp_path: Path) -> None:
    picture = np.zeros((200, 320, 3), np.uint8)
    picture[100:110, 200:210] = 255
    crop = Crop.around(Crop(190.0, 90.0, 40.0, 30.0), picture=(320, 200), aspect=4 / 3)
    assert -0.5 <= crop.left <= 319.5 - crop.width
    assert -0.5 <= crop.top <= 199.5 - crop.height
    scaled = crop.scaled(picture, (400, 300))
    y, x = np.argwhere(scaled[..., 0] > 127).mean(axis=0)
    factor = crop.width / 400
    assert crop.left + (x + 0.5) * factor == pytest.approx(204.5 + 0.5, abs=0.5)
    assert crop.top + (y + 0.5) * factor == pytest.approx(104.5 + 0.5, abs=0.5)
    whole = Crop.around(None, picture=(320, 200), aspect=4 / 3)
    assert (whole.width, whole.height) == pytest.approx((320, 240))


def test_pictures_are_those_nearest_in_time(run_directory: Path) -> None:
    video = run_directory.parent / "filmed" / "recording.mp4"
    pictures = list(pictures_at(video, [0.0, 0.83, 1.6, 1.61, 9.0]))
    red = [float(np.median(picture[:50, :, 0])) for picture in pictures]
    np.testing.assert_allclose(red, [40, 44, 120, 120, 196], atol=4)


def test_a_motion_without_the_head_in_the_world_is_refused(run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    motion = solution.motion
    headless = Motion.of(motion.time_s, motion.relative_mm, motion.relative_rad)
    solution = dataclasses.replace(solution, replayed=solution.scenario.with_(motion=headless))
    with pytest.raises(MotionError, match="no place of the head in the world"):
        RunView.of(solution, field="von_mises_mpa", beside_video=False)


def test_the_imprint_is_the_pressure_along_the_neck(run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    arc, pressure = imprint(solution, "upper")
    assert pressure.shape == (11, arc.size)
    row, column = np.unravel_index(np.argmax(pressure), pressure.shape)
    assert row == 5
    assert arc[column] == pytest.approx(10.0, abs=0.15)
    assert pressure.max() == pytest.approx(60.0, rel=0.01)
    assert pressure[0].max() == 0.0


@pytest.mark.slow
def test_plots_are_written(run_directory: Path, tmp_path: Path) -> None:
    plot_histories([run_directory, run_directory], tmp_path / "histories.png")
    plot_histories([run_directory], tmp_path / "history.svg")
    plot_imprint(run_directory, tmp_path / "imprint.png")
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "histories.png",
        "history.svg",
        "imprint.png",
    ]
