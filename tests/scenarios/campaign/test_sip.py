"""One sip of a study: its row, its limits, and how it goes on."""

import threading
from dataclasses import replace
from pathlib import Path

import pytest

from scenarios.campaign import sip
from scenarios.campaign.history_checkpoint import HistoryCheckpoint
from scenarios.campaign.plan import planned
from scenarios.campaign.settings import read_study
from scenarios.campaign.sip import (
    MEMORY_LIMIT,
    REFUSED,
    TIME_LIMIT,
    WHOLE,
    SipRow,
    SipTask,
    solved_sip,
)
from tests.support.approach import write_base

FILE = 'base = "base.toml"\n[meeting]\nhand = "recorded"\n'


@pytest.fixture(scope="module")
def task(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sip")
    write_base(folder)
    (folder / "study.toml").write_text(FILE)
    (case,) = planned(read_study(folder / "study.toml"), folder / "out", lambda s, t: None).cases
    return SipTask(str(folder / "out" / "runs" / case.identity), case.scenario_toml)


def elsewhere(task, name):
    """Return the task with a directory of its own, beside the first."""
    return replace(task, folder=str(Path(task.folder).with_name(name)))


@pytest.mark.slow
def test_an_interrupted_sip_goes_on_to_the_same_row(task, monkeypatch):
    always = {"every_s": 0.0}
    monkeypatch.setattr(HistoryCheckpoint.__init__, "__kwdefaults__", always)
    whole = solved_sip(elsewhere(task, "whole"))
    assert whole.status == WHOLE
    assert whole.measures["lips_window_kpa_peak"] > 1.0
    assert 0.0 < whole.mesh_doubt < 1.0
    assert SipRow.read(Path(elsewhere(task, "whole").folder)) == whole
    limits, calls = sip._limits, []

    def interrupted(*arguments):
        check = limits(*arguments)

        def progress(share, text):
            calls.append(share)
            if len(calls) == 6:
                raise KeyboardInterrupt
            check(share, text)

        return progress

    monkeypatch.setattr(sip, "_limits", interrupted)
    again = elsewhere(task, "again")
    with pytest.raises(KeyboardInterrupt):
        solved_sip(again)
    assert SipRow.read(Path(again.folder)) is None
    assert (Path(again.folder) / sip.CHECKPOINT_FILE).is_file()
    before = len(calls)
    resumed = solved_sip(again)
    assert resumed.measures == whole.measures
    assert (resumed.mesh_doubt, resumed.notes) == (whole.mesh_doubt, whole.notes)
    assert calls[before + 2] > 0.0
    assert not (Path(again.folder) / sip.CHECKPOINT_FILE).exists()
    kept = solved_sip(replace(elsewhere(task, "kept"), keep="runs"))
    assert kept.measures == whole.measures
    assert (kept.mesh_doubt, kept.notes) == (whole.mesh_doubt, whole.notes)


def test_a_sip_that_takes_too_long_is_a_row_and_is_tried_again(task):
    limited = replace(elsewhere(task, "long"), time_s=0.0)
    row = solved_sip(limited)
    assert row.status == TIME_LIMIT
    assert "limits.time_s = 0 s" in row.reason
    assert not row.is_final
    assert SipRow.read(Path(limited.folder)) == row


def test_a_sip_that_takes_too_much_memory_is_a_row(task):
    row = solved_sip(replace(elsewhere(task, "large"), memory_mb=1.0))
    assert row.status == MEMORY_LIMIT
    assert "limits.memory_mb = 1 MB" in row.reason


def test_a_sip_that_contradicts_itself_is_a_row_with_the_reason(task):
    text = task.scenario_toml.replace("land_mm = 1.3", "land_mm = 99.0")
    row = solved_sip(replace(elsewhere(task, "odd"), scenario_toml=text))
    assert row.status == REFUSED
    assert "package" in row.reason


def test_what_is_there_is_returned(task):
    there = elsewhere(task, "there")
    SipRow(WHOLE, "", 3.0, {"lips_window_kpa_peak": 50.0}).write(Path(there.folder))
    assert solved_sip(there).measures == {"lips_window_kpa_peak": 50.0}


def test_a_damaged_row_is_computed_again(tmp_path):
    SipRow(WHOLE).write(tmp_path)
    (tmp_path / "row.json").write_text("{")
    assert SipRow.read(tmp_path) is None


def test_a_sip_that_hangs_is_ended_from_outside():
    ended = threading.Event()
    with sip._ended_after(0.05, ended.set):
        assert ended.wait(5.0)


def test_a_sip_that_is_done_in_time_is_not_ended():
    ended = threading.Event()
    with sip._ended_after(0.2, ended.set):
        pass
    assert not ended.wait(0.4)
