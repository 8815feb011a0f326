"""The small files of a run directory as bytes, also for a solution that has none."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO
from pathlib import Path

from mocap.motion.motion import Motion
from scenarios.results.history_file import HISTORY_FILE, write_history
from scenarios.results.integrity import MOTION
from scenarios.results.run_inputs import REFERENCE_FOLDER
from scenarios.results.solution import Solution
from scenarios.settings.files import SCENARIO_FILE
from scenarios.settings.inputs import REFERENCE
from scenarios.settings.named_files import named_files, with_files
from scenarios.settings.scenario import MotionFile, resolved_toml

MOTION_FILE = "motion.csv"


def repeating_files(solution: Solution) -> dict[str, bytes]:
    """Return what a repetition needs, by file name: a scenario, and the files that it names.

    The files lie beside one another. The recording is left out, since the motion is known. A run
    directory whose forces the hand follows is named as it lies in the run directory, and left out
    too. A file that is missing is left out.
    """
    scenario = solution.scenario
    contents = {MOTION_FILE: motion_bytes(solution)}
    names = {MOTION: MOTION_FILE}
    for setting, place in named_files(scenario).items():
        if setting == REFERENCE:
            names[setting] = REFERENCE_FOLDER
        elif setting.endswith(".outline"):
            file = Path(place)
            names[setting] = f"{setting.removesuffix('.outline')}-{file.name}"
            contents[names[setting]] = file.read_bytes() if file.is_file() else None
    alone = replace(scenario, recording=None, motion=MotionFile(MOTION_FILE))
    text = resolved_toml(with_files(alone, names)).encode("utf-8")
    there = {name: content for name, content in contents.items() if content is not None}
    return {SCENARIO_FILE: text, **there}


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
