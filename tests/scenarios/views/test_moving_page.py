"""The moving part of a report in a browser: one instant everywhere, values of the run directory."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import drinksim as ds
from scenarios.results.quantities import LIPS
from scenarios.results.skin_line import SkinLine
from scenarios.results.solution import Solution
from scenarios.views.page.report import write_report
from scenarios.views.shown import SHOWN
from tests.support.browser import Visit, driven, grave_faults, opened
from tests.support.made_up_sip import resealed
from tests.support.optional import needed_program

pytestmark = [
    pytest.mark.slow,
    # The driver leaves its event loop's socket to the collector.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]

PLACES = 20
NUMBER = r"[−\d.]+"


@pytest.fixture(scope="module")
def pair(run_directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of two runs that differ in a setting."""
    place = tmp_path_factory.mktemp("moving")
    other = place / "other"
    shutil.copytree(run_directory, other)
    toml = other / "scenario.toml"
    text = toml.read_text().replace("made up", "</script> & other")
    toml.write_text(f"{text}\n[contact]\nfriction = 0.25\n")
    write_report([run_directory, resealed(other)], place / "pair.html")
    return place / "pair.html"


@pytest.fixture(scope="module")
def running() -> Iterator[Any]:
    chromium = needed_program("chromium", "chromium-browser", "google-chrome", package="chromium")
    with driven(chromium) as browser:
        yield browser


@pytest.fixture(scope="module")
def visit(running: Any, pair: Path) -> Visit:
    found = opened(running, pair)
    found.ready()
    return found


def moved_to(tab: Any, frame: int) -> None:
    """Drag the slider to a frame of the first run."""
    tab.eval_on_selector(
        "#explore .time",
        "(slider, to) => { slider.value = to; slider.dispatchEvent(new Event('input')); }",
        frame,
    )


def number(text: str) -> float:
    return float(text.replace("−", "-"))


class Section:
    """The first section on the page: where a place of the head frame is on the screen."""

    def __init__(self, tab: Any) -> None:
        self.tab = tab
        canvas = tab.locator(".pane .section").first
        canvas.scroll_into_view_if_needed()
        self.box = canvas.bounding_box()
        self.centre = np.array([float(x) for x in canvas.get_attribute("data-centre").split()])
        self.px_per_mm = float(canvas.get_attribute("data-px-per-mm"))

    def pointed(self, place: np.ndarray) -> str | None:
        """What the page says of a place, mm; None if it is not in view."""
        middle = [self.box["width"] / 2, self.box["height"] / 2]
        x, y = middle + (place - self.centre) * [self.px_per_mm, -self.px_per_mm]
        if not (0 < x < self.box["width"] and 0 < y < self.box["height"]):
            return None
        self.tab.mouse.move(self.box["x"] + x, self.box["y"] + y)
        return str(self.tab.locator(".pane .pointed").first.inner_text())


@pytest.mark.parametrize("frame", [0, 3, 7, 10])
def test_the_slider_moves_everything_to_one_instant(
    visit: Visit, run_directory: Path, frame: int
) -> None:
    tab = visit.tab
    moved_to(tab, frame)
    time = Solution.load(run_directory).time_s[frame]
    seen = tab.eval_on_selector_all(
        ".section, .imprint-map canvas, .chart", "all => all.map(one => Number(one.dataset.timeS))"
    )
    assert len(seen) == 3 + 6 + 9
    assert seen == pytest.approx([time] * len(seen), abs=1e-6)
    assert f"{time:.2f} s" in tab.locator("#explore .now").inner_text()
    assert f"{time:.2f} s" in tab.get_attribute("#explore .time", "aria-valuetext")
    film = float(tab.get_attribute(".film", "data-time-s"))
    assert film == pytest.approx(time, abs=0.08)


def test_places_have_the_values_of_the_run_directory(visit: Visit, run_directory: Path) -> None:
    solution, tab = Solution.load(run_directory), visit.tab
    random = np.random.default_rng(7)
    checked = {"tissue": 0, "skin": 0}
    for _ in range(40 * PLACES):
        frame = int(random.integers(1, solution.time_s.size - 1))
        moved_to(tab, frame)
        section, snapshot = Section(tab), solution.snapshot(frame)
        positions = solution.model.nodes + snapshot.displacement
        element = int(random.integers(len(solution.model.triangles)))
        said = section.pointed(positions[solution.model.triangles[element, :3]].mean(axis=0))
        if said and (found := re.search(r"element (\d+): (.*); node (\d+)", said)):
            assert int(found[1]) == element
            values = [number(n) for n in re.findall(rf"({NUMBER})(?: kPa)?(?:,|$)", found[2])]
            for value, shown in zip(values, SHOWN.values(), strict=True):
                true = snapshot.element[shown.field][element] * shown.factor
                assert value == pytest.approx(true, abs=0.0501 if shown.unit else 0.000501)
            moved = re.search(rf"moved by \(({NUMBER}), ({NUMBER})\)", said)
            assert moved is not None
            expected = snapshot.displacement[int(found[3])]
            assert [number(n) for n in moved.groups()] == pytest.approx(expected, abs=0.000501)
            checked["tissue"] += 1
        lip = ("upper", "lower")[int(random.integers(2))]
        line = SkinLine(solution.model, solution.model.skin[lip], solution.contact[lip].arc_mm)
        point = int(random.integers(line.arc_mm.size))
        said = section.pointed(line.points(positions)[point])
        pattern = rf"skin, point (\d+), .* pressure ({NUMBER}) kPa, shear ({NUMBER}) kPa"
        if said and (found := re.search(pattern, said)):
            fields = solution.contact[lip].fields
            where = frame, int(found[1])
            assert said.startswith(lip)
            assert number(found[2]) == pytest.approx(
                1e3 * fields["pressure_mpa"][where], abs=0.0501
            )
            assert number(found[3]) == pytest.approx(1e3 * fields["shear_mpa"][where], abs=0.0501)
            checked["skin"] += 1
        if min(checked.values()) >= PLACES / 2:
            return
    raise AssertionError(f"too few places were in view: {checked}")


def test_the_difference_of_equal_runs_is_nothing(visit: Visit, run_directory: Path) -> None:
    tab = visit.tab
    moved_to(tab, 5)
    pane = tab.locator(".pane[data-kind=difference]")
    canvas = pane.locator(".section")
    canvas.scroll_into_view_if_needed()
    solution = Solution.load(run_directory)
    positions = solution.model.nodes + solution.snapshot(5).displacement
    middles = positions[solution.model.triangles[:, :3]].mean(axis=1)
    away = np.where(solution.model.region == 2, np.abs(middles[:, 0] - 99.0), np.inf)
    dermis = int(away.argmin())
    place = middles[dermis]
    box = canvas.bounding_box()
    centre = [float(x) for x in canvas.get_attribute("data-centre").split()]
    px_per_mm = float(canvas.get_attribute("data-px-per-mm"))
    x, y = (place - centre) * [px_per_mm, -px_per_mm]
    tab.mouse.move(box["x"] + box["width"] / 2 + x, box["y"] + box["height"] / 2 + y)
    said = pane.locator(".pointed").inner_text()
    assert said.endswith(f"less made up: 0.0 kPa (element {dermis})")


def test_a_map_tells_by_how_much_more_the_second_presses(
    running: Any, run_directory: Path, tmp_path: Path
) -> None:
    other = tmp_path / "half as hard"
    shutil.copytree(run_directory, other)
    with h5py.File(other / "fields.h5", "r+") as store:
        for lip in LIPS:
            store[f"contact/{lip}/pressure_mpa"][:] *= 0.5
    write_report([run_directory, resealed(other)], tmp_path / "both.html")
    tab = opened(running, tmp_path / "both.html").ready()
    moved_to(tab, 5)
    said = tab.locator(".pane .imprint-map[data-lip=upper] .values").all_inner_texts()
    first, second, less = (number(re.findall(rf"({NUMBER}) kPa", text)[0]) for text in said)
    assert first > 50.0
    assert second == pytest.approx(0.5 * first, abs=0.1)
    assert less == pytest.approx(second - first, abs=0.11)


def test_curves_tell_seconds_and_relative_time(
    running: Any, run_directory: Path, tmp_path: Path
) -> None:
    later = tmp_path / "later"
    shutil.copytree(run_directory, later)
    shift_history(later, seconds=2.0)
    write_report([run_directory, resealed(later)], tmp_path / "both.html")
    tab = opened(running, tmp_path / "both.html").ready()
    written = tab.evaluate(WRITTEN_ON_A_CURVE)
    assert {"0 %", "100 %", "1.0 s", "2.0 s", "3.0 s", "4.0 s"} <= set(written)
    moved_to(tab, 5)
    said = tab.locator(".chart[data-name=upper_lip_window_kpa] .values").inner_text()
    assert re.findall(r"at ([\d.]+) s", said) == ["1.50", "3.50"]


WRITTEN_ON_A_CURVE = """async () => {
  const written = [];
  const drawn = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, ...rest) {
    if (this.canvas.closest(".chart")) written.push(text);
    return drawn.call(this, text, ...rest);
  };
  document.querySelector(".chart .curve").style.width = "300px";
  await new Promise((done) => setTimeout(done, 400));
  return written;
}"""


def shift_history(run: Path, *, seconds: float) -> None:
    """Move a run in time, as if it had been filmed later."""
    with h5py.File(run / "fields.h5", "r+") as store:
        store["increments/time_s"][:] += seconds
        store["time_s"][:] += seconds
    lines = (run / "history.csv").read_text().splitlines()
    moved = [",".join([f"{float(line.split(',')[0]) + seconds:.9g}", *line.split(",")[1:]])
             for line in lines[1:]]  # fmt: skip
    (run / "history.csv").write_text("\r\n".join([lines[0], *moved, ""]))


def test_a_dim_room_has_dark_paper_that_can_be_read(running: Any, pair: Path) -> None:
    visit = opened(running, pair, color_scheme="dark")
    tab = visit.ready()
    assert dark_share(tab) > 0.3
    assert tab.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(21, 24, 28)"
    for card in (".curves figure", ".imprint figure", ".sequence li"):
        paper = tab.locator(card).first.evaluate("card => getComputedStyle(card).backgroundColor")
        assert paper == "rgb(255, 255, 255)"  # its picture was drawn on light paper
    assert grave_faults(tab) == []
    tab.emulate_media(color_scheme="light")
    tab.wait_for_timeout(300)
    assert dark_share(tab) < 0.05
    tab.emulate_media(color_scheme="dark", media="print")
    assert tab.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert visit.messages == []


def dark_share(tab: Any) -> float:
    """Return how much of the first section is nearly black."""
    return float(
        tab.locator(".pane .section").first.evaluate(
            """canvas => {
              const copy = document.createElement("canvas");
              [copy.width, copy.height] = [canvas.width, canvas.height];
              const context = copy.getContext("2d", { willReadFrequently: true });
              context.drawImage(canvas, 0, 0);
              const all = context.getImageData(0, 0, copy.width, copy.height);
              let dark = 0;
              for (let i = 0; i < all.data.length; i += 4) if (all.data[i] < 50) dark += 1;
              return (4 * dark) / all.data.length;
            }"""
        )
    )


def test_a_curve_tells_its_values(visit: Visit, run_directory: Path) -> None:
    solution, tab = Solution.load(run_directory), visit.tab
    moved_to(tab, 4)
    said = tab.locator(".chart[data-name=upper_lip_window_kpa] .values").inner_text()
    values = [number(n) for n in re.findall(rf"({NUMBER}) kPa at", said)]
    assert values == pytest.approx([solution["upper_lip_window_kpa"].values[4]] * 2, abs=0.0501)
    assert said.endswith("difference 0.0")
    chart = tab.locator(".chart[data-name=upper_lip_window_kpa] .u-over")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    chart.hover(position={"x": box["width"] * 0.7, "y": 20})
    said = tab.locator(".chart[data-name=upper_lip_window_kpa] .values").inner_text()
    found = re.search(rf"({NUMBER}) kPa at ({NUMBER}) s", said)
    assert found is not None
    assert number(found[2]) == pytest.approx(1.7, abs=0.001)
    value = solution["upper_lip_window_kpa"].values[7]
    assert number(found[1]) == pytest.approx(value, abs=0.0501)


def test_the_keyboard_reaches_everything(visit: Visit) -> None:
    tab = visit.tab
    tab.locator("#explore .play").focus()
    reached = set()
    for _ in range(60):
        reached.add(tab.evaluate("document.activeElement.className || document.activeElement.id"))
        tab.keyboard.press("Tab")
    assert {"play", "time", "speed", "field", "chosen", "zoom-in", "zoom-all", "section"} <= reached
    moved_to(tab, 4)
    tab.locator("#explore .time").focus()
    tab.keyboard.press("ArrowRight")
    assert tab.locator("#explore .time").input_value() == "5"
    canvas = tab.locator(".pane .section").first
    canvas.focus()
    before = float(canvas.get_attribute("data-px-per-mm"))
    tab.keyboard.press("+")
    assert float(canvas.get_attribute("data-px-per-mm")) == pytest.approx(1.5 * before, rel=1e-6)
    tab.keyboard.press("Shift+ArrowLeft")
    centre = canvas.get_attribute("data-centre")
    tab.keyboard.press("ArrowDown")
    assert tab.locator(".pane .pointed").first.inner_text() != "Point at the section for values."
    assert canvas.get_attribute("data-centre") == centre
    tab.keyboard.press("0")
    assert float(canvas.get_attribute("data-px-per-mm")) == pytest.approx(before, rel=1e-6)


def test_the_wheel_zooms_a_section_in_use_and_scrolls_else(visit: Visit) -> None:
    tab = visit.tab
    canvas = tab.locator(".pane .section").first
    canvas.scroll_into_view_if_needed()
    before = float(canvas.get_attribute("data-px-per-mm"))
    tab.locator("#explore .time").focus()
    canvas.hover()
    tab.mouse.wheel(0, -100)
    tab.wait_for_timeout(200)
    assert float(canvas.get_attribute("data-px-per-mm")) == pytest.approx(before)
    canvas.scroll_into_view_if_needed()
    canvas.click()
    tab.mouse.wheel(0, -100)
    tab.wait_for_timeout(200)
    assert float(canvas.get_attribute("data-px-per-mm")) > 1.1 * before
    tab.keyboard.press("0")


def test_playing_ends_at_the_end(visit: Visit) -> None:
    tab = visit.tab
    moved_to(tab, 8)
    tab.locator("#explore .play").click()
    tab.locator("#explore .play", has_text="Play").wait_for(timeout=5000)
    assert tab.locator("#explore .time").input_value() == "10"


def test_a_field_and_runs_are_chosen(visit: Visit) -> None:
    tab = visit.tab
    tab.select_option("#explore .field", "log_strain_max")
    assert "largest log strain" in tab.locator(".legend-field").inner_text()
    tab.select_option("#explore .field", "contact")
    assert tab.locator(".legend-field").is_hidden()
    tab.locator("#explore .chosen").last.select_option("-1")
    tab.wait_for_selector("#explore[data-count='1']")
    assert tab.locator(".pane:visible").count() == 1
    tab.locator("#explore .chosen").last.select_option("1")
    tab.wait_for_selector("#explore[data-count='2']")
    assert tab.locator(".pane:visible h3").all_inner_texts()[1].startswith("</script> & other")
    tab.select_option("#explore .field", "von_mises_mpa")


def test_dragging_keeps_thirty_frames_a_second(visit: Visit) -> None:
    lasted = visit.tab.evaluate(
        """async () => {
          const slider = document.querySelector("#explore .time");
          const times = [];
          for (let k = 0; k < 60; k++) {
            await new Promise(requestAnimationFrame);
            const begun = performance.now();
            slider.value = k % 11;
            slider.dispatchEvent(new Event("input"));
            times.push(performance.now() - begun);
          }
          return times.sort((a, b) => a - b)[30];
        }"""
    )
    assert lasted < 1000 / 30


def test_no_grave_fault_of_accessibility(visit: Visit) -> None:
    assert grave_faults(visit.tab) == []


def test_nothing_is_asked_for_and_nothing_complained_of(visit: Visit, pair: Path) -> None:
    assert visit.messages == []
    assert [url for url in visit.requests if not url.startswith("data:")] == [pair.as_uri()]


def test_without_scripts_the_printed_page_is_there(running: Any, pair: Path) -> None:
    tab = opened(running, pair, java_script_enabled=False).tab
    assert tab.locator("#explore").is_hidden()
    pictures = tab.locator("details[data-folded] img")
    assert pictures.count() > 20
    assert all(picture.is_visible() for picture in pictures.all())


@pytest.mark.parametrize("width_px", [390, 800, 1920])
def test_the_moving_part_fits_the_window(running: Any, pair: Path, width_px: int) -> None:
    tab = opened(running, pair, width_px=width_px).ready()
    assert tab.evaluate("document.documentElement.scrollWidth") <= width_px
    canvas = tab.locator(".pane .section").first.bounding_box()
    assert canvas["width"] > 280


def test_a_notebook_moves_it_in_a_frame(running: Any, run_directory: Path, tmp_path: Path) -> None:
    shown = ds.explore(run_directory)
    assert repr(shown) == "<Explorer of made up>"
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f"<!doctype html><meta charset=utf-8>{shown._repr_html_()}")
    visit = opened(running, notebook)
    frame = visit.tab.frame_locator("iframe")
    frame.locator("#explore[data-ready]").wait_for(timeout=20_000)
    frame.locator("#explore .time").press("Home")
    assert "1.00 s" in frame.locator("#explore .now").inner_text()
    assert visit.messages == []


def test_seven_runs_are_six_screens_and_a_small_file(
    running: Any, run_directory: Path, tmp_path: Path
) -> None:
    runs = [run_directory]
    for count in range(6):
        runs.append(tmp_path / f"run {count}")
        shutil.copytree(run_directory, runs[-1])
    page = tmp_path / "seven.html"
    write_report(runs, page)
    assert page.stat().st_size < 40e6
    visit = opened(running, page, height_px=800)
    tab = visit.ready()
    assert tab.evaluate("document.documentElement.scrollHeight") <= 6 * 800
    assert visit.messages == []
