"""A scenario is solved in memory as it is in a run directory."""

from __future__ import annotations

from pathlib import Path

import pytest

from drinksim.values import Scenario, Solution, load_scenario
from mocap.motion.motion import Motion
from scenarios.sip import run
from scenarios.sip.run import NothingComputedError
from scenarios.views.page.report import write_report
from scenarios.views.page.reported import ReportError
from tests.support.made_up_sip import COUNT, MadeUpReplay, write_motion


@pytest.fixture
def motion(tmp_path: Path) -> Motion:
    return Motion.read(write_motion(tmp_path / "converted", tracked=False))


@pytest.fixture
def scenario(motion: Motion) -> Scenario:
    return load_scenario("A38-F").with_(motion=motion)


@pytest.fixture(autouse=True)
def made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay())


def test_a_solution_in_memory_writes_nothing_and_equals_the_one_on_disk(
    scenario: Scenario, motion: Motion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    in_memory = scenario.solve()
    assert sorted(tmp_path.rglob("*")) == before
    assert in_memory.folder is None
    assert in_memory.scenario == scenario
    assert in_memory.time_s.size == COUNT

    on_disk = scenario.solve(out="run")
    assert on_disk.folder == Path("run")
    assert on_disk == in_memory == Solution.load(tmp_path / "run")
    assert on_disk.motion == in_memory.motion == motion.rounded()
    assert on_disk.message == in_memory.message


def test_a_run_started_from_memory_goes_on_and_is_not_computed_again(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = scenario.solve()
    monkeypatch.setattr(run, "replay", MadeUpReplay(until=6, interrupted=True))
    with pytest.raises(KeyboardInterrupt):
        scenario.solve(out=tmp_path / "run")
    monkeypatch.setattr(run, "replay", MadeUpReplay())
    assert scenario.solve(out=tmp_path / "run", resume=True) == whole
    monkeypatch.setattr(run, "replay", MadeUpReplay(until=0))
    assert scenario.solve(out=tmp_path / "run") == whole


def test_progress_is_told_to_whom_it_concerns(scenario: Scenario) -> None:
    told: list[str] = []

    class Talking(MadeUpReplay):
        def __call__(self, scenario, *, progress, **options):
            progress(0.5, "half of it")
            return super().__call__(scenario, progress=progress, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "replay", Talking())
        scenario.solve(progress=lambda share, text: told.append(f"{share:.0%} {text}"))
        scenario.solve(progress=False)
        scenario.solve()
    assert told == ["50% half of it"]


def test_a_replay_that_stops_is_a_solution_and_one_of_nothing_an_error(
    scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay(until=6))
    part = scenario.solve()
    assert not part.finished
    assert "unfinished" in repr(part)
    assert "6 of 11" in part._repr_html_()
    monkeypatch.setattr(run, "replay", MadeUpReplay(until=0))
    with pytest.raises(NothingComputedError, match="nothing was computed: 0 of 11"):
        scenario.solve()


@pytest.mark.slow
def test_a_page_about_a_solution_in_memory_is_the_one_about_its_run_directory(
    scenario: Scenario, tmp_path: Path
) -> None:
    in_memory, on_disk = scenario.solve(), scenario.solve(out=tmp_path / "run")
    pages = []
    for number, solution in enumerate((in_memory, on_disk)):
        file = tmp_path / f"{number}.html"
        write_report([solution], file)
        text = file.read_text(encoding="utf-8")
        pages.append(text)
        assert text.count('download="') == 3
    assert pages[0].count("<img") == pages[1].count("<img") > 9
    with pytest.raises(ReportError, match=r"<Solution A38-F.*given more than once"):
        write_report([in_memory, in_memory], tmp_path / "twice.html")
    write_report([in_memory, on_disk], tmp_path / "both.html")
