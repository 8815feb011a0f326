"""One interface for one process, local workers and a cluster; the same rows from each."""

import os
import signal
import subprocess
import sys
import time

import pytest

from geometry2d.foundation.errors import DrinksimError
from scenarios.campaign.engine import InProcess, opened_engine
from scenarios.campaign.settings import StudySettings
from scenarios.campaign.sip import LOST, WHOLE, SipRow
from scenarios.campaign.study import carried_out, study_directory
from scenarios.campaign.table import read_parquet
from tests.support.killed_study import (
    ROOT,
    killed_and_finished,
    rows_in,
    table_of,
    undisturbed,
)
from tests.support.made_up_study import plan_of_factors, remembered


def quiet(share, text):
    pass


def table(rows):
    return [{name: value for name, value in row.items() if name != "seconds"} for row in rows]


def test_in_process_every_sip_is_a_row_in_the_order_of_the_plan(tmp_path):
    plan = plan_of_factors([{"neck": "A", "number": n} for n in range(5)])
    told = []
    result = carried_out(
        plan, tmp_path, InProcess(), solver=remembered, progress=lambda s, t: told.append((s, t))
    )
    assert [row["number"] for row in result.rows] == list(range(5))
    assert {row["status"] for row in result.rows} == {WHOLE}
    mean = sum(row["lips_window_kpa_peak"] for row in result.rows) / 5
    assert told[-1] == (1.0, f"5 of 5 sips, 0 s left; so far A {mean:.0f} kPa")
    assert read_parquet(tmp_path / "results.parquet") == [dict(row) for row in result.rows]


def test_what_is_there_is_not_computed_again(tmp_path):
    plan = plan_of_factors([{"neck": "A", "number": n} for n in range(3)])
    first = carried_out(plan, tmp_path, InProcess(), solver=remembered, progress=quiet)
    more = plan_of_factors([{"neck": "A", "number": n} for n in range(4)])
    tasks = []

    def counted(task):
        tasks.append(task)
        return remembered(task)

    second = carried_out(more, tmp_path, InProcess(), solver=counted, progress=quiet)
    assert len(tasks) == 1
    assert second.rows[:3] == first.rows


def test_equal_cases_are_computed_once(tmp_path):
    plan = plan_of_factors([{"neck": "A", "number": 1}])
    twice = plan.__class__(plan.settings, (), (), (), plan.cases * 2)
    tasks = []

    def counted(task):
        tasks.append(task)
        return remembered(task)

    result = carried_out(twice, tmp_path, InProcess(), solver=counted, progress=quiet)
    assert len(tasks) == 1
    assert len(result.rows) == 2


def test_a_failure_is_a_row_with_its_reason_and_is_tried_again_next_time(tmp_path):
    plan = plan_of_factors([{"neck": "A", "number": 1, "fails": True}, {"neck": "A", "number": 2}])
    result = carried_out(plan, tmp_path, InProcess(), solver=remembered, progress=quiet)
    assert [row["status"] for row in result.rows] == [LOST, WHOLE]
    assert result.rows[0]["reason"] == "RuntimeError: the disk is gone"
    tries = tmp_path / "runs" / plan.cases[0].identity / "tries.txt"
    assert len(tries.read_text().split()) == 1 + plan.settings.limits.retries
    assert SipRow.read(tries.parent) is None


def test_an_interrupted_study_keeps_its_table_and_goes_on(tmp_path):
    plan = plan_of_factors([{"neck": "A", "number": n} for n in range(4)])

    def interrupted(task):
        if task.folder.endswith("2"):
            raise KeyboardInterrupt
        return remembered(task)

    with pytest.raises(KeyboardInterrupt):
        carried_out(plan, tmp_path, InProcess(), solver=interrupted, progress=quiet)
    assert len((tmp_path / "results.csv").read_text().splitlines()) == 1 + 2
    assert not (tmp_path / "results.parquet").exists()
    result = carried_out(plan, tmp_path, InProcess(), solver=remembered, progress=quiet)
    assert len(result.rows) == 4


def test_workers_and_a_scheduler_are_not_both():
    with (
        pytest.raises(DrinksimError, match="--workers and --scheduler"),
        opened_engine(workers=2, scheduler="tcp://127.0.0.1:1"),
    ):
        pass


@pytest.mark.slow
def test_the_same_rows_whatever_the_number_of_workers(tmp_path):
    plan = plan_of_factors([{"neck": "A", "number": n} for n in range(12)])
    alone = carried_out(plan, tmp_path / "1", InProcess(), solver=remembered, progress=quiet)
    with opened_engine(workers=2) as engine:
        assert engine.isolated
        assert engine.workers == 2
        shared = carried_out(plan, tmp_path / "2", engine, solver=remembered, progress=quiet)
    assert table(shared.rows) == table(alone.rows)


@pytest.mark.slow
def test_a_sip_that_loses_its_worker_is_tried_again_and_others_go_on(tmp_path):
    factors = [{"neck": "A", "number": n} for n in range(4)]
    plan = plan_of_factors([*factors, {"neck": "A", "number": 4, "kills": 1}])
    hopeless = {"neck": "A", "number": 5, "kills": 99}
    plan = plan_of_factors([*factors, {"neck": "A", "number": 4, "kills": 1}, hopeless])
    with opened_engine(workers=2) as engine:
        result = carried_out(plan, tmp_path, engine, solver=remembered, progress=quiet)
    assert [row["status"] for row in result.rows] == [WHOLE] * 5 + [LOST]
    assert "lost its worker" in result.rows[5]["reason"]


@pytest.mark.slow
def test_a_scheduler_that_is_a_process_and_loses_one_of_its_workers(tmp_path):
    with Processes() as processes:
        contact = tmp_path / "scheduler.json"
        processes.start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
            "--scheduler-file", str(contact),
        )  # fmt: skip
        wait_for(contact.exists)
        worker = ("worker", "--scheduler-file", str(contact), "--nthreads", "1", "--no-dashboard")
        first = processes.start(*worker)
        processes.start(*worker)
        address = scheduler_address(contact)
        plan = plan_of_factors([{"neck": "A", "number": n, "busy_s": 0.25} for n in range(16)])
        killed = []

        def kill_one(share, text):
            if not killed:
                killed.append(first.kill())

        with opened_engine(scheduler=address) as engine:
            wait_for(lambda: engine.workers == 2)
            result = carried_out(plan, tmp_path, engine, solver=remembered, progress=kill_one)
    assert killed
    assert [row["status"] for row in result.rows] == [WHOLE] * 16
    alone = carried_out(plan, tmp_path / "1", InProcess(), solver=remembered, progress=quiet)
    assert table(result.rows) == table(alone.rows)


@pytest.mark.slow
def test_a_scheduler_that_does_not_answer_is_told(monkeypatch):
    monkeypatch.setattr("scenarios.campaign.engine.CONNECT_S", 0.5)
    with (
        pytest.raises(DrinksimError, match="no scheduler answers"),
        opened_engine(scheduler="tcp://127.0.0.1:9"),
    ):
        pass


def scheduler_address(contact):
    import json

    return json.loads(contact.read_text())["address"]


def wait_for(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "nothing happened"
        time.sleep(0.1)


class Processes:
    """Command lines of Dask that end with the block."""

    def __enter__(self):
        self.running = []
        return self

    def start(self, *words):
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.running.append(process)
        return process

    def __exit__(self, *_):
        for process in self.running:
            process.terminate()
        for process in self.running:
            process.wait(timeout=30)


@pytest.mark.slow
def test_a_study_that_is_killed_ends_with_the_same_table(tmp_path):
    killed, known = killed_and_finished(tmp_path / "killed", kills=2, seed=1)
    assert 0 < known[0] < known[-1] < len(killed.rows)
    assert table_of(killed) == table_of(undisturbed(tmp_path / "whole", len(killed.rows)))


def test_a_directory_is_for_one_study_unless_it_is_to_go_on(tmp_path):
    first = StudySettings(base="made up", folder=tmp_path)
    other = StudySettings(base="another", folder=tmp_path)
    out = tmp_path / "out"
    with study_directory(first, out, resume=False):
        pass
    # Nothing was computed for it: a dry run leaves that much.
    with study_directory(other, out, resume=False):
        (out / "runs").mkdir()
    with (
        pytest.raises(DrinksimError, match="holds another study"),
        study_directory(first, out, resume=False),
    ):
        pass
    with (
        pytest.raises(DrinksimError, match="unfinished study: --resume"),
        study_directory(other, out, resume=False),
    ):
        pass
    with study_directory(first, out, resume=True):
        pass


def test_files_that_are_not_a_study_s_are_left_alone(tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    study = StudySettings(base="made up", folder=tmp_path)
    with (
        pytest.raises(DrinksimError, match="not a study's"),
        study_directory(study, tmp_path, resume=True),
    ):
        pass


def test_two_processes_do_not_work_in_one_directory(tmp_path):
    study = StudySettings(base="made up", folder=tmp_path)
    with (
        study_directory(study, tmp_path / "out", resume=False),
        pytest.raises(DrinksimError, match="another process is at work"),
        study_directory(study, tmp_path / "out", resume=True),
    ):
        pass


@pytest.mark.slow
def test_workers_leave_an_interruption_to_the_process_that_was_typed(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.support.killed_study", str(tmp_path), "200"],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        process_group=0,
    )
    wait_for(lambda: rows_in(tmp_path) >= 6)
    os.killpg(process.pid, signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert told.count("Traceback") == 1
    assert told.strip().endswith("KeyboardInterrupt")
    assert len((tmp_path / "results.csv").read_text().splitlines()) >= 1 + 2
