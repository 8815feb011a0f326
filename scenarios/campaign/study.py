"""A study from its settings to its table: the outermost function of the engine's side."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from filelock import FileLock, Timeout

from geometry2d.foundation.output import file_at_once
from geometry2d.foundation.progress import Progress, part_of
from scenarios.campaign.cases import Case
from scenarios.campaign.engine import Engine
from scenarios.campaign.films import FilmedSip
from scenarios.campaign.measures import HEADLINE
from scenarios.campaign.plan import RUNS, Plan, planned
from scenarios.campaign.settings import LimitSettings, StudySettings
from scenarios.campaign.sip import LOST, SipRow, SipTask, solved_sip
from scenarios.campaign.table import PARQUET_FILE, Row, write_csv, write_parquet
from scenarios.campaign.variation import StudyError
from scenarios.results.doubt import STUDY_TABLE
from scenarios.sip.run import solve

if TYPE_CHECKING:
    import pandas as pd

STUDY_RECORD = "study.json"
LOCK = ".drinksim"

NAMED = 3
"""Necks whose mean pressure so far is shown while a study is computed."""

PREPARING = 0.02
"""Share of the progress that preparation takes."""

NOTES_BETWEEN = " | "
"""Between the notes of a sip in the table; they have semicolons of their own."""

Solver = Callable[[SipTask], SipRow]
"""Computes one sip; a test puts a formula in its place."""


@dataclass(frozen=True)
class StudyOutcome:
    """A study that was carried out.

    Attributes
    ----------
    plan
        What was to be computed.
    rows
        Of the table, in the order of the plan's cases.
    folder
        The study's directory.
    """

    plan: Plan
    rows: tuple[Row, ...]
    folder: Path

    def to_dataframe(self) -> pd.DataFrame:
        """Return the table as pandas', a row a sip.

        Raises
        ------
        StudyError
            If pandas is not installed.
        """
        try:
            import pandas as pd
        except ImportError:
            raise StudyError("pandas is not installed: pip install 'drinksim[notebook]'") from None
        return pd.DataFrame(list(self.rows))

    @property
    def failed(self) -> tuple[Row, ...]:
        """The sips that were not replayed to their end."""
        return tuple(row for row in self.rows if row["status"] != "whole")


@contextmanager
def study_directory(study: StudySettings, out: Path, *, resume: bool) -> Iterator[Path]:
    """Yield the directory of a study, locked for this process.

    Raises
    ------
    StudyError
        If it holds something else, another study, or an unfinished one without ``resume``, or if
        another process is at work in it.
    """
    _refuse_other(study, out, resume=resume)
    out.mkdir(parents=True, exist_ok=True)
    lock = FileLock(out / LOCK, blocking=False)
    try:
        lock.acquire()
    except Timeout:
        raise StudyError(
            f"another process is at work in {out}: wait until it has ended, or give another --out"
        ) from None
    try:
        with file_at_once(out / STUDY_RECORD) as partial:
            partial.write_text(json.dumps(_record(study), indent=1) + "\n", encoding="utf-8")
        yield out
    finally:
        lock.release()


def _refuse_other(study: StudySettings, out: Path, *, resume: bool) -> None:
    if out.is_file():
        raise StudyError(f"--out {out} is a file: give a directory")
    record = out / STUDY_RECORD
    if not record.is_file():
        if out.is_dir() and any(each.name != LOCK for each in out.iterdir()):
            raise StudyError(
                f"--out {out} holds files that are not a study's: give another directory"
            )
        return
    if resume or not (out / RUNS).is_dir():
        return
    try:
        same = json.loads(record.read_text(encoding="utf-8")) == _record(study)
    except ValueError:
        same = False
    if not same:
        raise StudyError(
            f"{out} holds another study, or another version's: give another --out, or --resume to "
            "use of it what both have in common"
        )
    if not (out / PARQUET_FILE).is_file():
        raise StudyError(f"{out} holds an unfinished study: --resume goes on with it")


def _record(study: StudySettings) -> dict[str, Any]:
    known = asdict(study)
    known["folder"] = str(study.folder)
    record: dict[str, Any] = json.loads(json.dumps(known, default=str))
    return record | {"version": version("drinksim")}


def carried_out(
    plan: Plan,
    folder: Path,
    engine: Engine,
    *,
    solver: Solver = solved_sip,
    progress: Progress,
) -> StudyOutcome:
    """Compute what is not there yet, write the tables and return the study.

    Parameters
    ----------
    plan
        What to compute.
    folder
        The study's directory.
    engine
        Where.
    solver
        Computes a sip.
    progress
        Told how far it is, and what is to be expected.
    """
    limits = plan.settings.limits
    for film in plan.films:
        _reference_made(film, progress)
    known = {case.identity: SipRow.read(_place(folder, case)) for case in plan.cases}
    found = {name: row for name, row in known.items() if row is not None and row.is_final}
    wanted = [case for case in _once(plan.cases) if case.identity not in found]
    tasks = [_task(case, folder, limits, plan.settings.keep, engine) for case in wanted]
    clock = _Clock(len(tasks), len(found))
    try:
        for ended in engine.ended(solver, tasks, retries=limits.retries):
            row, case = ended.result or SipRow(LOST, ended.reason), wanted[ended.index]
            found[case.identity] = row
            progress(*clock.after(row, str(case.factors.get("neck", ""))))
    finally:
        rows = tuple(
            _row(case, found[case.identity]) for case in plan.cases if case.identity in found
        )
        if rows:
            write_csv(rows, folder / STUDY_TABLE)
    write_parquet(rows, folder / PARQUET_FILE)
    return StudyOutcome(plan, rows, folder)


def _reference_made(film: FilmedSip, progress: Progress) -> None:
    """Make the run whose forces are held, if it is not there."""
    if film.reference is None or film.base.hand.upper_force_n is not None:
        return
    show = part_of(progress, 0.0, PREPARING)
    solve(
        film.scenario,
        out=film.reference,
        resume=True,
        progress=lambda share, text: show(share, f"{film.name} as filmed, {text}"),
    )


def _once(cases: Sequence[Case]) -> list[Case]:
    """Return cases, each only once that has the same identity."""
    return list({case.identity: case for case in cases}.values())


def _place(folder: Path, case: Case) -> Path:
    return folder / RUNS / case.identity


def _task(case: Case, folder: Path, limits: LimitSettings, keep: str, engine: Engine) -> SipTask:
    return SipTask(
        folder=str(_place(folder, case).resolve()),
        scenario_toml=case.scenario_toml,
        keep=keep,
        time_s=limits.time_s,
        memory_mb=limits.memory_mb,
        own_process=engine.isolated,
    )


def _row(case: Case, sip: SipRow) -> Row:
    about: Mapping[str, Any] = {
        "status": sip.status,
        "reason": sip.reason,
        "run": f"{RUNS}/{case.identity}",
        "seconds": sip.seconds,
        "mesh_doubt": sip.mesh_doubt,
        "notes": NOTES_BETWEEN.join(sip.notes),
    }
    return {**case.factors, **about, **(sip.measures or {})}


class _Clock:
    """Tells how far a study is and when it will end."""

    def __init__(self, total: int, known: int) -> None:
        self._total, self._known = total, known
        self._pressures: dict[str, list[float]] = {}
        self._done = self._failed = 0
        self._started = time.monotonic()

    def after(self, row: SipRow, neck: str) -> tuple[float, str]:
        """Return the share that is done after another sip, and a text with what came out."""
        self._done += 1
        self._failed += not row.is_final or row.measures is None
        each = (time.monotonic() - self._started) / self._done
        left = each * (self._total - self._done)
        share = PREPARING + (1 - PREPARING) * self._done / max(self._total, 1)
        text = f"{self._done} of {self._total} sips, {duration(left)} left"
        if self._known:
            text += f", {self._known} were there"
        if self._failed:
            text += f", {self._failed} failed"
        if row.measures is not None and HEADLINE in row.measures:
            self._pressures.setdefault(neck, []).append(row.measures[HEADLINE])
        means = [f"{name} {np.mean(v):.0f}" for name, v in list(self._pressures.items())[:NAMED]]
        if means:
            text += f"; so far {', '.join(means)} kPa"
        return share, text


def duration(seconds: float) -> str:
    """Return a time in words.

    >>> duration(42), duration(600), duration(9000)
    ('42 s', '10 min', '2.5 h')
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def plan_of(study: StudySettings, folder: Path, progress: Progress) -> Plan:
    """Return the plan of a study in its directory."""
    return planned(study, folder, part_of(progress, 0.0, PREPARING))
