"""Scenario in, run directory out: the chain from a recording to a solution on disk."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from mocap.convert import convert
from scenarios.drinking import replay
from scenarios.output import directory_at_once
from scenarios.progress import Progress
from scenarios.solution import Increment
from scenarios.spec import MotionFile, Recording, Scenario, ScenarioError, resolved_toml
from scenarios.writer import SolutionWriter

MOTION = "motion.csv"
TRACKS = "tracks.csv"


@dataclass(frozen=True)
class Run:
    """How a replay ended: where it is, whether the whole motion was replayed, and in words."""

    folder: Path
    finished: bool
    sentence: str


def convert_recording(recording: Recording, out: Path, *, progress: Progress) -> Path:
    """Convert a recording into the directory ``out`` and return its ``motion.csv``."""
    with directory_at_once(out) as partial:
        convert(
            Path(recording.video),
            Path(recording.markers),
            partial,
            start_s=recording.start_s,
            end_s=recording.end_s,
            progress=progress,
        )
    return out / MOTION


def replay_into(scenario: Scenario, out: Path, *, resume: bool, progress: Progress) -> Run:
    """Replay a scenario into the run directory ``out``.

    The motion is the scenario's, or else its recording's, converted first. Each increment is
    safe on disk once it is computed; ``resume`` goes on after the last one of an earlier attempt.

    Raises
    ------
    ValueError
        One of the packages' own kinds, if an input is wrong.
    OSError
        If ``out`` cannot be written.
    """
    on_disk = replace(scenario, motion=MotionFile(MOTION))
    with SolutionWriter(out, resolved_toml(on_disk), resume=resume) as writer:
        _provide_motion(scenario, writer, progress)

        def commit(increment: Increment) -> None:
            writer.commit(increment)
            progress(increment.relative_time, f"{increment.time_s:.2f} s of the sip")

        progress(0.0, "building the section")
        outcome = replay(
            scenario.with_motion(writer.folder / MOTION),
            on_model=writer.model,
            on_increment=commit,
            resume_from=writer.last(),
        )
        writer.finish(
            finished=outcome.finished,
            sentence=outcome.sentence,
            about={"scenario": scenario.name, "resolution": scenario.solver.resolution},
        )
    return Run(out, outcome.finished, outcome.sentence)


def _provide_motion(scenario: Scenario, writer: SolutionWriter, progress: Progress) -> None:
    """Put the motion, and the tracks it came from if there are any, into the run directory."""
    if scenario.motion is not None:
        motion = Path(scenario.motion.file)
        if not motion.is_file():
            raise ScenarioError(f"no motion file {motion}: make one with drinksim convert")
    elif (writer.folder / MOTION).is_file():
        return
    else:
        assert scenario.recording is not None  # a scenario has a motion or a recording
        motion = convert_recording(
            scenario.recording, writer.folder / "conversion", progress=progress
        )
    writer.keep(motion)
    if (motion.parent / TRACKS).is_file():
        writer.keep(motion.parent / TRACKS)
