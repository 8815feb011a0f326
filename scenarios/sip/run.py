"""Scenario in, run directory out: the chain from a recording to a solution on disk."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from geometry2d.foundation.output import check_replaceable
from geometry2d.foundation.progress import Progress
from mocap.convert import convert
from scenarios.results.solution import Increment, peaks_in_words
from scenarios.results.writer import SolutionWriter
from scenarios.settings.scenario import (
    MotionFile,
    Recording,
    Scenario,
    ScenarioError,
    resolved_toml,
)
from scenarios.sip.replay import replay

MOTION_FOLDER = "motion"
MOTION_FILES = ("motion.csv", "summary.json", "tracks.csv")
"""What a replay and its pictures need of a conversion; tracks only for pictures."""


@dataclass(frozen=True)
class Run:
    """How a replay ended: where it is, whether the whole motion was replayed, and in words.

    ``peaks`` says the extreme values of the run.
    """

    folder: Path
    finished: bool
    sentence: str
    peaks: str


@dataclass(frozen=True)
class Conversion:
    """The motion file that a conversion wrote, and what its reader must know."""

    motion: Path
    warnings: tuple[str, ...]


def convert_recording(
    recording: Recording,
    out: Path,
    *,
    tracks: Path | None = None,
    fps: float | None = None,
    progress: Progress,
) -> Conversion:
    """Convert a recording into the directory ``out``.

    ``tracks`` and ``fps`` are those of :func:`mocap.convert.convert`.
    """
    check_replaceable(out)

    def say(what: str, done: int, total: int) -> None:
        progress(done / total if total else 0.0, what)

    result = convert(
        recording.video,
        recording.markers,
        out,
        start_s=recording.start_s,
        end_s=recording.end_s,
        tracks=tracks,
        fps=fps,
        progress=say,
    )
    return Conversion(out / "motion.csv", tuple(result.summary["warnings"]))


def replay_into(scenario: Scenario, out: Path, *, resume: bool, progress: Progress) -> Run:
    """Replay a scenario into the run directory ``out``.

    The motion is the scenario's, or else its recording's, converted first; it is kept in the run
    directory. Each increment is safe on disk once it is computed, and ``resume`` goes on after the
    last one of an earlier attempt.

    Raises
    ------
    ValueError
        One of the packages' own kinds, if an input is wrong.
    OSError
        If ``out`` cannot be written.
    """
    kept = MotionFile(f"{MOTION_FOLDER}/motion.csv")
    text = resolved_toml(replace(scenario, motion=kept))
    with SolutionWriter(out, text, resume=resume) as writer:
        motion = _provided_motion(scenario, writer, progress)

        def commit(increment: Increment) -> None:
            writer.commit(increment)
            progress(increment.relative_time, f"{increment.time_s:.2f} s of the recording")

        outcome = replay(
            scenario.with_motion(motion),
            on_model=writer.model,
            on_increment=commit,
            resume_from=writer.last(),
            progress=progress,
        )
        if writer.count == 0:
            writer.discard()
            return Run(out, False, outcome.sentence, "nothing was computed")
        summary = writer.finish(
            finished=outcome.finished,
            sentence=outcome.sentence,
            about={"scenario": scenario.name, **outcome.about},
        )
    return Run(out, outcome.finished, outcome.sentence, peaks_in_words(summary))


def _provided_motion(scenario: Scenario, writer: SolutionWriter, progress: Progress) -> Path:
    """Put the motion into the run directory and return it there."""
    folder = writer.folder / MOTION_FOLDER
    kept = folder / "motion.csv"
    if scenario.motion is None:
        assert scenario.recording is not None  # a scenario has a motion or a recording
        if not kept.is_file():
            conversion = convert_recording(scenario.recording, folder, progress=progress)
            for warning in conversion.warnings:
                writer.log(f"recording: {warning}")
        return kept
    motion = Path(scenario.motion.file)
    if not motion.is_file():
        raise ScenarioError(f"no motion file {motion}: make one with drinksim convert")
    for name in MOTION_FILES:
        source = motion if name == "motion.csv" else motion.with_name(name)
        if source.is_file():
            writer.keep(source, folder / name)
    return kept
