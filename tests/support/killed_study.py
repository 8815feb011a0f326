"""A study that is killed at random moments, as a user's machine or a batch system may do."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from scenarios.campaign.engine import InProcess, opened_engine
from scenarios.campaign.study import StudyOutcome, carried_out
from tests.support.made_up_study import plan_of_factors, remembered

BUSY_S = 0.3
SIPS_A_KILL = 6
"""So many sips a study has for each time it is killed, so that it is never done before."""

ROOT = Path(__file__).resolve().parents[2]


def made_up_outcome(folder: Path, sips: int, workers: int | None) -> StudyOutcome:
    """Carry out a study of slow formulas."""
    plan = plan_of_factors([{"neck": "A", "number": n, "busy_s": BUSY_S} for n in range(sips)])
    with opened_engine(workers=workers) as engine:
        return carried_out(plan, folder, engine, solver=remembered, progress=lambda s, t: None)


def undisturbed(folder: Path, sips: int) -> StudyOutcome:
    """Carry the same study out in this process, at once."""
    plan = plan_of_factors([{"neck": "A", "number": n} for n in range(sips)])
    return carried_out(plan, folder, InProcess(), solver=remembered, progress=lambda s, t: None)


def killed_and_finished(folder: Path, *, kills: int, seed: int) -> tuple[StudyOutcome, list[int]]:
    """Start the study again and again, kill all of it at random moments, and finish it.

    Returns
    -------
    outcome
        Of the study.
    known
        How many sips there were at each kill.
    """
    random = np.random.default_rng(seed)
    sips = SIPS_A_KILL * kills
    known: list[int] = []
    for _ in range(kills):
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.support.killed_study", str(folder), str(sips)],
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        began, before = time.monotonic(), rows_in(folder)
        while rows_in(folder) == before and process.poll() is None:
            assert time.monotonic() - began < 60.0, "the study does not come to anything"
            time.sleep(0.02)
        time.sleep(float(random.uniform(0.0, 2.0 * BUSY_S)))
        # Only the main process is killed: its workers must notice by themselves.
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        known.append(rows_in(folder))
    return made_up_outcome(folder, sips, None), known


def table_of(outcome: StudyOutcome) -> list[dict[str, object]]:
    """Return the rows of a study without how long each computed on purpose."""
    return [{name: row[name] for name in row if name != "busy_s"} for row in outcome.rows]


def rows_in(folder: Path) -> int:
    """Return how many sips have a row."""
    return len(list(folder.glob("runs/*/row.json")))


if __name__ == "__main__":
    made_up_outcome(Path(sys.argv[1]), int(sys.argv[2]), 2)
