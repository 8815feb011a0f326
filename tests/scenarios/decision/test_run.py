"""A study as a command, and from the front door."""

from functools import partial
from pathlib import Path

import pytest

import drinksim as ds
from scenarios.campaign.measures import HEADLINE
from scenarios.campaign.sip import STOPPED, WHOLE, SipRow, scenario_in
from scenarios.campaign.study import carried_out
from scenarios.cli.main import main
from scenarios.decision import run
from scenarios.decision.pair_section import SHOWN
from tests.support.approach import write_base

STUDY = """
base = "base.toml"
[meeting]
hand = "recorded"
[necks]
list = ["A38", "DC"]
[people]
count = 4
"""


def formula(task):
    folder = Path(task.folder)
    folder.mkdir(parents=True, exist_ok=True)
    scenario = scenario_in(folder, task.scenario_toml)
    value = 60.0 + 5.0 * (scenario.package.neck == "DC") + scenario.placement.shift_y_mm
    row = SipRow(WHOLE, "", 1.0, dict.fromkeys(SHOWN, value) | {HEADLINE: value})
    row.write(folder)
    return row


def stopped(task):
    return SipRow(STOPPED, "the step became too small", 1.0, dict.fromkeys(SHOWN, 1.0))


def interrupted(task):
    raise KeyboardInterrupt


@pytest.fixture
def folder(tmp_path, monkeypatch):
    write_base(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY)
    monkeypatch.chdir(tmp_path)
    computed_by(monkeypatch, formula)
    return tmp_path


def computed_by(monkeypatch, solver):
    monkeypatch.setattr(run, "carried_out", partial(carried_out, solver=solver))


@pytest.mark.slow
def test_the_command_prints_the_sentence_and_leaves_page_and_tables(folder, capsys):
    assert main(["study", "study.toml", "--out", "out"]) == 0
    printed = capsys.readouterr().out
    assert "out: study.html, results.parquet, results.csv; 8 sips" in printed
    assert "A38 is gentler than DC" in printed
    assert {"study.html", "results.parquet", "results.csv"} <= {
        p.name for p in Path("out").iterdir()
    }


@pytest.mark.slow
def test_a_finished_study_is_not_computed_again(folder, capsys, monkeypatch):
    assert main(["study", "study.toml", "--out", "out"]) == 0
    first = Path("out/results.csv").read_bytes()
    computed_by(monkeypatch, interrupted)
    assert main(["study", "study.toml", "--out", "out"]) == 0
    assert Path("out/results.csv").read_bytes() == first


def test_an_interrupted_study_says_how_it_goes_on(folder, capsys, monkeypatch):
    computed_by(monkeypatch, interrupted)
    assert main(["study", "study.toml", "--out", "out"]) == 130
    assert "drinksim study study.toml --out out --resume" in capsys.readouterr().err


@pytest.mark.slow
def test_a_study_of_which_nothing_worked_ends_with_its_own_code(folder, capsys, monkeypatch):
    computed_by(monkeypatch, stopped)
    assert main(["study", "study.toml", "--out", "out"]) == 3
    assert "study.html says why" in capsys.readouterr().err


@pytest.mark.slow
def test_more_people_are_added(folder):
    main(["study", "study.toml", "--out", "out"])
    (folder / "study.toml").write_text(STUDY.replace("count = 4", "count = 6"))
    assert main(["study", "study.toml", "--out", "out"]) == 2
    assert main(["study", "study.toml", "--out", "out", "--resume"]) == 0
    assert len(Path("out/results.csv").read_text().splitlines()) == 1 + 12


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["gone.toml"], "gone.toml: no such study file"),
        (["study.toml", "--workers", "0"], "--workers 0: give at least 1"),
        (["study.toml", "--workers", "2", "--scheduler", "tcp://x:1"], "not allowed with"),
    ],
)
def test_wrong_usage_is_one_line(folder, capsys, words, told):
    try:
        code = main(["study", *words, "--out", "out"])
    except SystemExit as stop:
        code = stop.code
    assert code == 2
    error = capsys.readouterr().err
    assert told in error
    assert len(error.splitlines()) == 1


def test_the_front_door_returns_the_study(folder):
    outcome = ds.study({"base": "base.toml", "meeting": {"hand": "recorded"}}, "out")
    table = outcome.to_dataframe()
    assert list(table["neck"]) == ["A38"]
    assert table[HEADLINE][0] == pytest.approx(60.0)
