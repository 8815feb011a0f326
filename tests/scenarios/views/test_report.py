"""The report: one page that loads nothing, says what was found, and trusts no text of a file."""

from __future__ import annotations

import base64
import csv
import io
import json
import math
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image as Pillow

from scenarios.cli.main import main
from scenarios.messages.lines import verdict_message
from scenarios.messages.verdict import FAILURE, PAIN, Verdict
from scenarios.results.integrity import write_inputs
from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution
from scenarios.settings.scenario import MotionFile, load_scenario
from scenarios.views.animation import animate
from scenarios.views.page.figures import RunCurve, curves, line_style
from scenarios.views.page.hypertext import Markup, joined, tag
from scenarios.views.page.report import write_report
from scenarios.views.page.scripts import page_script, script_policy
from scenarios.views.plots import plot_histories
from tests.support.made_up_sip import resealed

HOSTILE = '<script>alert("x")</script> & $\\frac{$ "quoted"'
VOID = {"img", "meta", "br", "hr", "col", "link", "input"}


class Page(HTMLParser):
    """A page taken apart: its elements, what it says, and whether its tags are balanced."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.words: list[str] = []
        self.cells: list[list[str]] = []
        self.scripts: list[tuple[dict[str, str], str]] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, name: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((name, {key: value or "" for key, value in attributes}))
        if name == "tr":
            self.cells.append([])
        if name in ("td", "th") and self.cells:
            self.cells[-1].append("")
        if name not in VOID:
            self._open.append(name)

    def handle_endtag(self, name: str) -> None:
        assert self._open.pop() == name

    def handle_data(self, data: str) -> None:
        if "script" in self._open:
            self.scripts.append((self.elements[-1][1], data))
        if {"style", "script"} & set(self._open):
            return
        self.words.append(data)
        if {"td", "th"} & set(self._open):
            self.cells[-1][-1] += data

    def named(self, name: str) -> list[dict[str, str]]:
        return [attributes for element, attributes in self.elements if element == name]

    @property
    def pictures(self) -> list[dict[str, str]]:
        """Those that are there without scripts."""
        return [picture for picture in self.named("img") if picture.get("class") != "film"]

    @property
    def text(self) -> str:
        return " ".join("".join(self.words).split())

    def row(self, title: str) -> list[str]:
        return next(cells[2:] for cells in self.cells if cells and cells[0] == title)


def embedded(address: str) -> bytes:
    head, data = address.split(",", 1)
    assert head.startswith("data:")
    assert head.endswith(";base64")
    return base64.b64decode(data)


def renamed(run: Path, to: Path, name: str, **summary: object) -> Path:
    """Copy a run, under another scenario name and with other entries in its summary."""
    shutil.copytree(run, to)
    toml = to / "scenario.toml"
    text = toml.read_text()
    described = f"name = {json.dumps(name)}\ndescription = {json.dumps(name)}"
    toml.write_text(text.replace('name = "made up"', described))
    known = json.loads((to / "summary.json").read_text())
    (to / "summary.json").write_text(json.dumps({**known, "scenario": name, **summary}))
    return resealed(to)


@pytest.fixture(scope="module")
def one_file(run_directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report") / "one.html"
    write_report([run_directory], out)
    return out


@pytest.fixture(scope="module")
def one(one_file: Path) -> Page:
    return Page(one_file.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def hostile_pair(run_directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Page:
    place = tmp_path_factory.mktemp("pair")
    other = renamed(
        run_directory, place / "b", HOSTILE, finished=False, sentence=HOSTILE, version=HOSTILE
    )
    with (other / "scenario.toml").open("a") as toml:
        toml.write("[contact]\nfriction = 0.25\n")
    resealed(other)
    out = place / "pair.html"
    assert main(["report", str(run_directory), str(other), "--out", str(out)]) == 0
    return Page(out.read_text(encoding="utf-8"))


def test_a_page_loads_nothing_and_runs_nothing_but_its_script(
    one: Page, hostile_pair: Page
) -> None:
    for page in (one, hostile_pair):
        for name, attributes in page.elements:
            assert name not in ("link", "iframe", "object", "base")
            assert not any(key.startswith("on") for key in attributes)
            for key in ("src", "href"):
                assert attributes.get(key, "#").startswith(("data:", "#"))
        policies = [meta for meta in page.named("meta") if "http-equiv" in meta]
        assert policies[0]["content"].startswith("default-src 'none'")
        held, run = page.scripts
        assert held[0]["type"] == "application/json"
        assert run == ({}, page_script())
        assert policies[0]["content"].endswith(f"script-src {script_policy(page_script())}")


def test_every_picture_can_be_read_and_is_described(one: Page) -> None:
    pictures = one.pictures
    # Nine histories, six instants twice, the imprint in time and on the contour.
    assert len(pictures) == 9 + 12 + 2
    for picture in pictures:
        assert len(picture["alt"]) > 8
        data = embedded(picture["src"])
        if picture["src"].startswith("data:image/svg+xml"):
            assert b"<svg" in data
        else:
            assert Pillow.open(io.BytesIO(data)).size >= (480, 400)
    assert sum("recording (rendered)" in picture["alt"] for picture in pictures) == 6


def test_a_page_has_an_outline_and_targets_for_its_links(one: Page) -> None:
    assert one.named("html")[0]["lang"] == "en"
    assert len(one.named("h1")) == len(one.named("main")) == 1
    ids = [attributes["id"] for _, attributes in one.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    links = [link["href"][1:] for link in one.named("a") if link["href"].startswith("#")]
    labels = [e["aria-labelledby"] for e in one.named("section")]
    assert set(links + labels) <= set(ids)


def test_text_from_files_stays_text(hostile_pair: Page) -> None:
    shown = " ".join(HOSTILE.split())
    assert shown in hostile_pair.text
    assert f"The run is not complete: {shown}" in hostile_pair.text
    assert hostile_pair.row("drinksim")[1] == HOSTILE
    summed = [picture["alt"] for picture in hostile_pair.named("img")]
    assert any(HOSTILE in words for words in summed)


def test_the_numbers_are_the_runs(one: Page, run_directory: Path) -> None:
    solution = Solution.load(run_directory)
    for lip in LIPS:
        shown = float(one.row(f"highest mean of two surface elements, {lip} lip")[0])
        assert shown == pytest.approx(solution[f"{lip}_lip_pressure_kpa"].values.max(), abs=0.05)
    shown = one.row("smallest log strain")[0].replace("−", "-")
    assert float(shown) == pytest.approx(-0.4, abs=5e-4)
    both = [sum(solution[f"{lip}_lip_force_{axis}_n"].values for lip in LIPS) for axis in "xy"]
    force = 1e3 * np.hypot(*both).max()
    assert float(one.row("largest force on the hand, per mm of width")[0]) == pytest.approx(
        force, rel=1e-3
    )
    # Of a summary that lacks them, solver facts are absent, not a failure.
    assert one.row("deepest penetration, neck") == ["–"]


@pytest.mark.slow
def test_runs_of_one_scenario_are_told_apart_and_forces_are_per_width(
    run_directory: Path, tmp_path: Path
) -> None:
    thick = tmp_path / "thick"
    shutil.copytree(run_directory, thick)
    with (thick / "scenario.toml").open("a") as toml:
        toml.write("[numerics]\nthickness_mm = 4.0\n")
    write_report([run_directory, resealed(thick)], tmp_path / "r.html")
    page = Page((tmp_path / "r.html").read_text())
    assert "made up (run)" in page.text
    assert "made up (thick)" in page.text
    first, second = (
        float(x.split()[0]) for x in page.row("largest force on the hand, per mm of width")
    )
    assert second == pytest.approx(first / 4, rel=1e-3)
    told = page.row("largest force on the hand, per mm of width")[1]
    assert told.endswith(f"(−{first - second:.1f})")
    assert ["numerics.thickness_mm", "1.0", "4.0"] in page.cells


def test_a_comparison_says_what_differs(hostile_pair: Page) -> None:
    assert ["contact.friction", "1.0", "0.25"] in hostile_pair.cells
    assert "Settings that differ between the runs: 1" in hostile_pair.text


@pytest.mark.slow
def test_copies_of_one_film_are_no_difference(run_directory: Path, tmp_path: Path) -> None:
    runs = [renamed(run_directory, tmp_path / name, name) for name in ("a", "b")]
    recording = load_scenario(runs[1] / "scenario.toml").recording
    assert recording is not None
    kept = Path(recording.video)
    shutil.copyfile(kept, tmp_path / "copy.mp4")
    scenario = runs[1] / "scenario.toml"
    text = scenario.read_text(encoding="utf-8")
    scenario.write_text(text.replace(str(kept), str(tmp_path / "copy.mp4")), encoding="utf-8")
    for checksums, shown in ((("one", "one"), False), (("one", "other"), True)):
        for run, checksum in zip(runs, checksums, strict=True):
            write_inputs(run, {"recording.video": checksum})
            resealed(run)
        out = tmp_path / "pair.html"
        assert main(["report", *map(str, runs), "--out", str(out)]) == 0
        page = Page(out.read_text(encoding="utf-8"))
        assert any("recording.video" in cells for cells in page.cells) == shown


def test_the_page_holds_what_repeats_the_run(
    one: Page, run_directory: Path, tmp_path: Path
) -> None:
    files = {
        link["download"]: embedded(link["href"]) for link in one.named("a") if "download" in link
    }
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    kept, own = (load_scenario(f / "scenario.toml") for f in (tmp_path, run_directory))
    assert kept == replace(own, recording=None, motion=MotionFile(str(tmp_path / "motion.csv")))
    assert files["motion.csv"] == (run_directory / "motion" / "motion.csv").read_bytes()
    lines = list(csv.DictReader(io.StringIO(files["history.csv"].decode())))
    assert len(lines) == Solution.load(run_directory).time_s.size


@pytest.mark.slow
def test_the_same_runs_give_the_same_bytes(
    one_file: Path, run_directory: Path, tmp_path: Path
) -> None:
    write_report([run_directory], tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == one_file.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["again.html"]


@pytest.mark.slow
def test_names_of_runs_are_no_formulas(run_directory: Path, tmp_path: Path) -> None:
    other = renamed(run_directory, tmp_path / "other", HOSTILE)
    plot_histories([run_directory, other], tmp_path / "histories.png")
    animate(other, tmp_path / "sheet.png")
    assert (tmp_path / "histories.png").is_file()
    assert (tmp_path / "sheet.png").is_file()


@pytest.mark.slow
def test_a_lost_recording_is_said(run_directory: Path, tmp_path: Path) -> None:
    lost = tmp_path / "lost"
    shutil.copytree(run_directory, lost)
    toml = lost / "scenario.toml"
    toml.write_text(re.sub(r'video = ".*?"', 'video = "gone.mp4"', toml.read_text()))
    write_report([resealed(lost)], tmp_path / "r.html")
    page = Page((tmp_path / "r.html").read_text())
    assert "lost its recording's file" in page.text
    assert len(page.pictures) == 9 + 6 + 2


@pytest.mark.parametrize(
    ("runs", "out", "wanted"),
    [
        (["run"], "r.pdf", ".html"),
        (["run", "run"], "r.html", "more than once"),
        (["nothing"], "r.html", "no run directory"),
    ],
)
def test_wrong_input_is_one_line(
    capsys: pytest.CaptureFixture[str],
    run_directory: Path,
    tmp_path: Path,
    runs: list[str],
    out: str,
    wanted: str,
) -> None:
    named = [str(run_directory.parent / run) for run in runs]
    assert main(["report", *named, "--out", str(tmp_path / out)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert wanted in captured.err
    assert len(captured.err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@given(st.text(), st.text())
def test_a_tag_gives_back_its_text(child: str, value: str) -> None:
    # Browsers and this parser read a carriage return as a new line; nothing else is changed.
    written = tag("p", child.replace("\r", ""), title=value.replace("\r", ""))
    page = Page(written)
    assert page.elements == [("p", {"title": value.replace("\r", "")})]
    assert "".join(page.words) == child.replace("\r", "")


def test_only_markup_is_not_escaped() -> None:
    assert joined("<b>", tag("b", "x")) == "&lt;b&gt;<b>x</b>"
    assert isinstance(joined("a"), Markup)


def verdict(pressure: float, strain: float) -> Verdict:
    return Verdict.of(
        {
            "upper_lip_window_kpa": pressure,
            "lower_lip_window_kpa": 0.0,
            "dermis_max_log_strain": strain,
        }
    )


def test_thresholds_are_the_papers() -> None:
    assert (PAIN.low, PAIN.high) == (272.0, 508.0)
    assert FAILURE.low == pytest.approx(math.log(1.54)) == pytest.approx(0.43, abs=0.005)


@pytest.mark.parametrize(
    ("pressure", "strain", "wanted"),
    [
        (136.0, 0.3, ("136 kPa", "50 % of the lowest pressure", "35 %", "below the 54 %")),
        (300.0, 0.44, ("within the range", "beyond the 54 %")),
        (600.0, 0.1, ("above the whole range",)),
        (0.0, 0.0, ("never presses",)),
    ],
)
def test_a_verdict_says_which_side_of_the_thresholds(
    pressure: float, strain: float, wanted: tuple[str, ...]
) -> None:
    sentence = verdict_message(verdict(pressure, strain))
    assert all(words in sentence for words in wanted), sentence


def test_lines_of_six_runs_differ_in_more_than_colour_where_colours_are_used_up() -> None:
    styles = [line_style(index) for index in range(12)]
    assert len(set(styles)) == 12


def test_a_figure_survives_constant_and_single_values() -> None:
    flat = RunCurve(np.array([0.0]), np.array([0.0]))
    assert b"<svg" in curves([flat, flat], label="kPa", shows="nothing").data
