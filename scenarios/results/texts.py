"""The small files of a run directory as bytes, also for a solution that has none."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO
from pathlib import Path

from mocap.motion.motion import Motion
from scenarios.results.history_file import HISTORY_FILE, write_history
from scenarios.results.solution import Solution
from scenarios.settings.scenario import MotionFile, resolved_toml

SCENARIO_FILE, MOTION_FILE = "scenario.toml", "motion.csv"


def scenario_bytes(solution: Solution) -> bytes:
    """Return the scenario as a file that names the motion as `MOTION_FILE` beside it."""
    if solution.folder is not None:
        return (solution.folder / SCENARIO_FILE).read_bytes()
    scenario = replace(solution.scenario, motion=MotionFile(MOTION_FILE))
    return resolved_toml(scenario).encode("utf-8")


def history_bytes(solution: Solution) -> bytes:
    """Return history.csv."""
    if solution.folder is not None:
        return (solution.folder / HISTORY_FILE).read_bytes()
    names, columns = zip(*solution.history.items(), strict=True)
    rows = [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]
    stream = StringIO(newline="")
    write_history(stream, rows)
    return stream.getvalue().encode("utf-8")


def motion_bytes(solution: Solution) -> bytes | None:
    """Return the motion's file; None if it is no longer where the scenario names it."""
    motion = solution.scenario.motion
    if isinstance(motion, Motion):
        return motion.text().encode("utf-8")
    if motion is None or not Path(motion.file).is_file():
        return None
    return Path(motion.file).read_bytes()
