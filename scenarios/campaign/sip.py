"""One sip of a study, computed where a worker is told to, within its limits.

The directory of a sip is its checkpoint: what is there is returned and not computed again, whoever
computed it. A failure is a result too, with its reason; a sip that takes too long or too much
memory is given up.
"""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem2d.solvers.march import MarchStatus
from fem2d.threads import Threads
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.progress import Progress
from geometry2d.foundation.toml import parsed_toml
from scenarios.campaign.history_checkpoint import HistoryCheckpoint
from scenarios.campaign.measures import felt_measures
from scenarios.messages.lines import mesh_doubt
from scenarios.results.doubt import RUN_FOLDER
from scenarios.results.history_file import HISTORY_FILE, write_history
from scenarios.results.quantities import LIPS
from scenarios.results.solution import Solution
from scenarios.settings.files import SCENARIO_FILE
from scenarios.settings.layers import SettingsLayer
from scenarios.settings.scenario import Scenario, ScenarioError, scenario_from
from scenarios.sip.replay import refuse_unusable, replay
from scenarios.sip.run import NothingComputedError, solve

Array = NDArray[np.float64]

ROW_FILE = "row.json"
CHECKPOINT_FILE = "checkpoint.npz"

WHOLE, STOPPED, REFUSED = "whole", "stopped", "refused"
TIME_LIMIT, MEMORY_LIMIT, LOST = "time limit", "memory limit", "lost"

FINAL = (WHOLE, STOPPED, REFUSED)
"""What comes out again whenever it is computed again; the others are tried anew by a next call."""

GRACE = 1.5
"""A sip that has not noticed its time limit is ended, with its worker, after so many times it."""

MB = 1e6


@dataclass(frozen=True)
class SipTask:
    """What a worker is told.

    Attributes
    ----------
    folder
        The sip's directory.
    scenario_toml
        The scenario; its paths start from ``folder``.
    keep
        "numbers", "histories" or "runs".
    time_s, memory_mb
        Limits.
    threads
        That the sip may use, 1 or 2.
    own_process
        Whether the process may be ended if the sip hangs.
    """

    folder: str
    scenario_toml: str
    keep: str = "numbers"
    time_s: float = np.inf
    memory_mb: float = np.inf
    threads: int = 1
    own_process: bool = False


@dataclass(frozen=True)
class SipRow:
    """What came out of a sip.

    Attributes
    ----------
    status, reason
        How it ended, and why if it is not whole.
    seconds
        How long it took.
    measures
        What it felt like.
    mesh_doubt
        By which share two measures of the highest pressure on a lip differ, on the worse lip.
    notes
        What to mind about it, in the words of a single replay.
    """

    status: str
    reason: str = ""
    seconds: float = 0.0
    measures: Mapping[str, float] | None = None
    mesh_doubt: float | None = None
    notes: tuple[str, ...] = ()

    @classmethod
    def read(cls, folder: Path) -> SipRow | None:
        """Return what is in a sip's directory; None if it is not there or cannot be read."""
        try:
            found = json.loads((folder / ROW_FILE).read_text(encoding="utf-8"))
            return cls(**found | {"notes": tuple(found.get("notes", ()))})
        except (OSError, ValueError, TypeError):
            return None

    def write(self, folder: Path) -> None:
        """Write it into a sip's directory, at once."""
        folder.mkdir(parents=True, exist_ok=True)
        with file_at_once(folder / ROW_FILE) as partial:
            partial.write_text(json.dumps(asdict(self), indent=1) + "\n", encoding="utf-8")

    @property
    def is_final(self) -> bool:
        """Whether it would come out again."""
        return self.status in FINAL


class SipLimitError(DrinksimError):
    """A sip took more than it may; ``status`` says of what."""

    def __init__(self, status: str, message: str) -> None:
        super().__init__(message)
        self.status = status


def solved_sip(task: SipTask) -> SipRow:
    """Return what comes out of a sip; it is in the sip's directory then.

    Nothing is raised for a sip that cannot be computed: that is a row with its reason.

    Raises
    ------
    OSError
        If the directory cannot be written.
    """
    folder = Path(task.folder)
    known = SipRow.read(folder)
    if known is not None and known.is_final:
        return known
    folder.mkdir(parents=True, exist_ok=True)
    with file_at_once(folder / SCENARIO_FILE) as partial:
        partial.write_text(task.scenario_toml, encoding="utf-8")
    started = time.monotonic()

    def row(status: str, reason: str, sip: _Replayed | None = None) -> SipRow:
        seconds = round(time.monotonic() - started, 2)
        if sip is None:
            return SipRow(status, reason, seconds)
        doubt, measures = (
            max(mesh_doubt(lip, sip.about) for lip in LIPS),
            felt_measures(sip.history),
        )
        return SipRow(status, reason, seconds, measures, doubt, tuple(sip.about["notes"]))

    def given_up() -> None:
        row(TIME_LIMIT, f"hung for more than {GRACE * task.time_s:g} s").write(folder)
        os._exit(1)

    with _ended_after(GRACE * task.time_s if task.own_process else np.inf, given_up):
        try:
            sip = _replayed(task, folder, _limits(task, started))
            if MarchStatus.INTERRUPTED.value in sip.message:
                raise KeyboardInterrupt
            status = WHOLE if sip.finished else STOPPED
            reason = "" if sip.finished else sip.message
            result = row(status, reason, sip)
            if task.keep == "histories":
                _write_history(sip.history, folder)
        except SipLimitError as error:
            result = row(error.status, str(error))
        except DrinksimError as error:
            result = row(REFUSED, str(error))
        except MemoryError:
            result = row(MEMORY_LIMIT, "there is not enough memory")
    result.write(folder)
    if result.is_final:
        (folder / CHECKPOINT_FILE).unlink(missing_ok=True)
    return result


def scenario_in(folder: Path, text: str) -> Scenario:
    """Return the scenario of a text whose paths start from a folder."""
    document = parsed_toml(text, where=str(folder / SCENARIO_FILE), error=ScenarioError)
    return scenario_from([SettingsLayer(document, folder.resolve())])


@dataclass(frozen=True)
class _Replayed:
    """How a replay ended, its history, and the numbers for a summary."""

    finished: bool
    message: str
    history: Mapping[str, Array]
    about: Mapping[str, Any]


def _replayed(task: SipTask, folder: Path, progress: Progress) -> _Replayed:
    """Replay a sip, from where an interrupted replay of it was."""
    scenario, threads = scenario_in(folder, task.scenario_toml), Threads(task.threads)
    needs_a_run = scenario.hand.mode != "recorded" and scenario.hand.reference is None
    if task.keep == "runs" or needs_a_run:
        out = folder / RUN_FOLDER if task.keep == "runs" else None
        solution = solve(
            scenario, out=out, resume=out is not None, threads=threads, progress=progress
        )
        return _Replayed(solution.finished, solution.message, solution.history, solution.summary)
    refuse_unusable(scenario)
    reference = scenario.hand.reference
    kept = HistoryCheckpoint(folder / CHECKPOINT_FILE)
    outcome = replay(
        scenario,
        on_increment=kept.commit,
        resume_from=kept.last,
        reference=None if reference is None else Solution.load(reference),
        threads=threads,
        progress=progress,
    )
    if kept.history["time_s"].size == 0:
        raise NothingComputedError(f"nothing was computed: {outcome.message}")
    return _Replayed(outcome.finished, outcome.message, kept.history, outcome.about)


def _limits(task: SipTask, started: float) -> Progress:
    """Return a progress function that gives up a sip beyond its limits."""

    def check(share: float, text: str) -> None:
        if time.monotonic() - started > task.time_s:
            raise SipLimitError(
                TIME_LIMIT,
                f"took more than limits.time_s = {task.time_s:g} s, {100 * share:.0f} % done",
            )
        if np.isfinite(task.memory_mb) and memory_mb() > task.memory_mb:
            raise SipLimitError(
                MEMORY_LIMIT, f"took more than limits.memory_mb = {task.memory_mb:g} MB"
            )

    return check


def memory_mb() -> float:
    """Return the memory that this process holds, MB; 0 where that cannot be asked."""
    try:
        import psutil
    except ImportError:
        return 0.0
    return float(psutil.Process().memory_info().rss) / MB


@contextmanager
def _ended_after(seconds: float, end: Any) -> Iterator[None]:
    """Call ``end`` from another thread if the block takes longer."""
    if not np.isfinite(seconds):
        yield
        return
    timer = threading.Timer(seconds, end)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _write_history(history: Mapping[str, Array], folder: Path) -> None:
    rows = [
        {name: float(history[name][k]) for name in history} for k in range(history["time_s"].size)
    ]
    with (
        file_at_once(folder / HISTORY_FILE) as partial,
        partial.open("w", newline="", encoding="utf-8") as stream,
    ):
        write_history(stream, rows)
