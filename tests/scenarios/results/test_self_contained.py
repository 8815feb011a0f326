"""A run directory holds all that it depends on, and goes on with nothing else."""

from __future__ import annotations

import base64
import html
import re
import shlex
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from geometry2d.anatomy.head import head_section
from geometry2d.drawings.drawn_head import HeadDrawing
from mocap.motion.motion import Motion
from scenarios.cli.main import main
from scenarios.export.abaqus import export_abaqus
from scenarios.export.vtk import export_vtk
from scenarios.results import integrity, run_inputs
from scenarios.results.increment import SolutionError
from scenarios.results.solution import Solution
from scenarios.settings.named_files import named_files
from scenarios.settings.scenario import LIBRARY, Scenario, load_scenario
from scenarios.sip import run
from scenarios.views.animation import animate
from scenarios.views.page.report import write_report
from tests.support.drawings import neck_drawing
from tests.support.made_up_sip import MadeUpReplay
from tests.support.marks import slow

FIRST_FRAME = """\
# head_axis_deg = -8.369
# package_axis_deg = 38.043
# picture_x_px = 311.137
# picture_y_px = 207.047
# picture_px_per_mm = 2.9317
"""
"""How A38-F's film shows head and package in its first frame."""

SAME = ("history.csv", "fields.h5", "scenario.toml", "inputs.json")


@pytest.fixture(autouse=True)
def made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay())


@pytest.fixture
def originals(tmp_path: Path) -> Path:
    """A folder with everything that a scenario can name."""
    folder = tmp_path / "originals"
    (folder / "converted").mkdir(parents=True)
    truth = (LIBRARY / "A38-F" / "truth_motion.csv").read_text()
    (folder / "converted" / "motion.csv").write_text(FIRST_FRAME + truth)
    for name in ("recording.mp4", "markers.toml"):
        shutil.copyfile(LIBRARY / "A38-F" / name, folder / name)
    (folder / "neck.svg").write_text(neck_drawing())
    (folder / "other").mkdir()
    (folder / "other" / "neck.svg").write_text(neck_drawing(shift_mm=0.5))
    (folder / "head.svg").write_text(HeadDrawing.of(head_section()).svg())
    (folder / "mine.toml").write_text(
        'name = "mine"\n[recording]\nvideo = "recording.mp4"\nmarkers = "markers.toml"\n'
        '[motion]\nfile = "converted/motion.csv"\n[package]\noutline = "other/neck.svg"\n'
        '[filmed]\noutline = "neck.svg"\n[numerics]\nresolution = "coarse"\n'
    )
    replayed = load_scenario("A38-F").with_(motion=folder / "converted" / "motion.csv")
    run.solve(replayed, out=folder / "reference")
    return folder


@pytest.fixture
def scenario(originals: Path) -> Scenario:
    hand = {"mode": "same", "reference": str(originals / "reference")}
    return load_scenario(originals / "mine.toml").with_(hand=hand)


@pytest.fixture
def with_head(scenario: Scenario, originals: Path) -> Scenario:
    """The scenario with a drawn head, which takes longer to read."""
    return scenario.with_(head={"outline": originals / "head.svg"})


def interrupted(scenario: Scenario, out: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Leave an unfinished run and return its directory."""
    monkeypatch.setattr(run, "replay", MadeUpReplay(until=6, interrupted=True))
    with pytest.raises(KeyboardInterrupt):
        run.solve(scenario, out=out)
    monkeypatch.setattr(run, "replay", MadeUpReplay())
    return out.with_name(f"{out.name}.partial")


def same_files(one: Path, other: Path) -> bool:
    return all((one / name).read_bytes() == (other / name).read_bytes() for name in SAME)


def shown(folder: Path, out: Path) -> dict[str, bytes]:
    """Return what the commands make of a run directory, by name."""
    out.mkdir()
    write_report([folder], out / "page.html")
    animate(folder, out / "beside.png", beside_video=True)
    export_vtk(folder, out / "vtk")
    export_abaqus(folder, out / "run.inp")
    return {
        file.relative_to(out).as_posix(): file.read_bytes()
        for file in sorted(out.rglob("*"))
        if file.is_file() and not file.name.startswith(".")
    }


def moved_alone(run_directory: Path, originals: Path) -> Path:
    """Move a run directory and remove what it was made from."""
    moved = run_directory.parent / "elsewhere" / run_directory.name
    moved.parent.mkdir()
    run_directory.rename(moved)
    shutil.rmtree(originals)
    return moved


@pytest.mark.slow
def test_a_moved_run_is_repeated_with_nothing_but_itself(
    with_head: Scenario, originals: Path, tmp_path: Path
) -> None:
    run.solve(with_head, out=tmp_path / "run")
    moved = moved_alone(tmp_path / "run", originals)
    kept = named_files(load_scenario(moved / "scenario.toml"))
    assert kept.keys() == named_files(with_head).keys()
    assert all(moved in Path(file).parents for file in kept.values())
    assert main(["replay", str(moved / "scenario.toml"), "--out", str(tmp_path / "again")]) == 0
    assert same_files(tmp_path / "again", moved)


@pytest.mark.slow
def test_a_moved_run_is_shown_with_nothing_but_itself(
    with_head: Scenario, originals: Path, tmp_path: Path
) -> None:
    run.solve(with_head, out=tmp_path / "run")
    before = shown(tmp_path / "run", tmp_path / "before")
    assert len(before) > 20
    assert shown(moved_alone(tmp_path / "run", originals), tmp_path / "after") == before


@pytest.mark.slow
def test_a_moved_run_goes_on_from_its_own_scenario(
    scenario: Scenario, originals: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run.solve(scenario, out=tmp_path / "whole")
    partial = interrupted(scenario, tmp_path / "run", monkeypatch)
    moved = moved_alone(partial, originals)
    own, out = moved / "scenario.toml", moved.with_name("run")
    with pytest.raises(SolutionError, match=r"unfinished run: --resume"):
        run.solve(load_scenario(own), out=out)
    with pytest.raises(SolutionError, match=r"lies in the unfinished run.*--resume"):
        run.solve(load_scenario(own), out=out, overwrite=True)
    assert main(["replay", str(own), "--out", str(out), "--resume"]) == 0
    assert same_files(out, tmp_path / "whole")


@pytest.mark.slow
def test_a_film_that_the_run_converted_is_not_converted_again(
    originals: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    filmed = replace(load_scenario(originals / "mine.toml"), motion=None)
    converted: list[Path] = []

    def convert_recording(recording, out: Path, *, progress):
        converted.append(out)
        shutil.copytree(originals / "converted", out)
        return run.Conversion(out / "motion.csv", ())

    monkeypatch.setattr(run, "convert_recording", convert_recording)
    partial = interrupted(filmed, tmp_path / "run", monkeypatch)
    later = replace(filmed, recording=replace(filmed.recording, start_s=0.2))
    with pytest.raises(SolutionError, match=r"with another recording\.start_s"):
        run.solve(later, out=tmp_path / "run", resume=True)
    with pytest.raises(SolutionError, match=r"with another file for motion\.file"):
        given = filmed.with_motion(Motion.read(LIBRARY / "A38-F" / "truth_motion.csv"))
        run.solve(given, out=tmp_path / "run", resume=True)
    shutil.copytree(partial, tmp_path / "copy.partial")
    run.solve(filmed, out=tmp_path / "run", resume=True)
    assert len(converted) == 1
    shutil.rmtree(originals)
    own = load_scenario(tmp_path / "copy.partial" / "scenario.toml")
    run.solve(own, out=tmp_path / "copy", resume=True)
    assert same_files(tmp_path / "copy", tmp_path / "run")


def edited(name: str, old: str = "", new: str = "\n") -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        text = (folder / name).read_text(encoding="utf-8")
        assert old in text
        (folder / name).write_text(text.replace(old, new) if old else text + new, encoding="utf-8")

    return edit


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (edited("other/neck.svg", 'r="1.5"', 'r="1.6"'), r"file for package\.outline"),
        slow(edited("neck.svg"), r"file for filmed\.outline"),
        slow(edited("markers.toml"), r"file for recording\.markers"),
        slow(edited("converted/motion.csv", "\n0.04000,", "\n0.04100,"), r"file for motion\.file"),
        slow(edited("reference/summary.json"), r"file for hand\.reference"),
    ],
)
def test_what_was_started_with_other_files_does_not_go_on(
    scenario: Scenario,
    originals: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    change: Callable[[Path], None],
    named: str,
) -> None:
    interrupted(scenario, tmp_path / "run", monkeypatch)
    change(originals)
    with pytest.raises(SolutionError, match=rf"started with another {named}.*--overwrite"):
        run.solve(scenario, out=tmp_path / "run", resume=True)


@pytest.mark.slow
def test_what_was_started_with_another_material_or_product_does_not_go_on(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted(scenario, tmp_path / "run", monkeypatch)
    materials = tmp_path / "materials"
    shutil.copytree(run_inputs.MATERIALS, materials)
    edited("L2-Ogden.toml")(materials)
    with monkeypatch.context() as patch:
        patch.setattr(run_inputs, "MATERIALS", materials)
        with pytest.raises(SolutionError, match=r"another file for skin\.configuration"):
            run.solve(scenario, out=tmp_path / "run", resume=True)
    monkeypatch.setattr(integrity, "version", lambda name: "0.0.1")
    with pytest.raises(SolutionError, match=r"started with drinksim .*, this is 0\.0\.1"):
        run.solve(scenario, out=tmp_path / "run", resume=True)


@pytest.mark.slow
def test_a_copy_that_was_changed_is_named(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    partial = interrupted(scenario, tmp_path / "run", monkeypatch)
    edited("inputs/package.outline/neck.svg")(partial)
    with pytest.raises(SolutionError, match=r"started with another neck\.svg than .*other/neck"):
        run.solve(scenario, out=tmp_path / "run", resume=True)
    finished = run.solve(scenario, out=tmp_path / "run", overwrite=True).folder
    assert finished is not None
    with (finished / "inputs" / "recording.video" / "recording.mp4").open("ab") as stream:
        stream.write(b"more")
    with pytest.raises(SolutionError, match=r"recording\.mp4 was changed"):
        Solution.load(finished)


@pytest.mark.slow
def test_a_page_says_how_to_repeat_its_run(
    with_head: Scenario, originals: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run.solve(with_head, out=tmp_path / "run")
    write_report([tmp_path / "run"], tmp_path / "page.html")
    shutil.rmtree(originals)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    desk = tmp_path / "desk"
    desk.mkdir()
    for address, name in re.findall(r'<a href="data:[^;]+;base64,([^"]+)" download="(.+?)"', page):
        (desk / html.unescape(name)).write_bytes(base64.b64decode(address))
    assert {file.name for file in desk.iterdir()} == {
        "scenario.toml",
        "motion.csv",
        "package-neck.svg",
        "filmed-neck.svg",
        "head-head.svg",
        "history.csv",
    }
    shutil.copytree(tmp_path / "run" / "reference", desk / "reference")  # as the page says
    command = re.search(r"<code>(drinksim replay .*?)</code>", page)
    assert command
    monkeypatch.chdir(desk)
    assert main(shlex.split(html.unescape(command[1]))[1:]) == 0
    assert (desk / "again" / "history.csv").read_bytes() == (desk / "history.csv").read_bytes()
    assert (desk / "again" / "fields.h5").read_bytes() == (
        tmp_path / "run" / "fields.h5"
    ).read_bytes()
    again, first = (load_scenario(f / "scenario.toml") for f in (desk / "again", tmp_path / "run"))
    for name in ("package", "filmed", "head"):
        one, other = (getattr(each, name).outline for each in (again, first))
        assert Path(one).read_bytes() == Path(other).read_bytes()
