"""From a scenario to its solution, in memory or in a run directory as well."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from fem2d.threads import Threads
from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.progress import (
    Progress,
    ProgressOption,
    Warn,
    chosen_progress,
    each_once,
    silent,
)
from mocap.convert import ConvertResult, convert
from mocap.motion.motion import Motion
from mocap.views.closing import closing_lines
from scenarios.messages.lines import activations_message
from scenarios.results.collector import SolutionCollector
from scenarios.results.increment import SolutionError
from scenarios.results.integrity import MOTION, differing_input
from scenarios.results.run_inputs import MOTION_FOLDER, REFERENCE_FOLDER, RunInputs
from scenarios.results.solution import Solution
from scenarios.results.summary import SUMMARY_FILE
from scenarios.results.writer import SolutionWriter
from scenarios.settings.hand import HandSettings
from scenarios.settings.scenario import Recording, Scenario, load_scenario
from scenarios.sip.activation import FoundActivation, read_activations, write_activations
from scenarios.sip.replay import refuse_unusable, replay

BESIDE_MOTION = ("summary.json", "tracks.csv")
"""What pictures need of a conversion beside its motion."""

ACTIVATIONS_FILE = "activations.json"
"""File of a run directory with the activations that were found."""


class NothingComputedError(DrinksimError):
    """A replay stopped before its first increment."""


@dataclass(frozen=True)
class Conversion:
    """The motion file that a conversion wrote, what is odd about it, and how well it went."""

    motion: Path
    warnings: tuple[str, ...]
    closing: tuple[str, ...] = ()


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
    result = _converted(recording, out=out, tracks=tracks, fps=fps, progress=progress)
    closing = closing_lines(result.summary, result.tracks)
    return Conversion(out / "motion.csv", result.warnings, tuple(closing))


def _converted(
    recording: Recording,
    *,
    out: Path | None = None,
    tracks: Path | None = None,
    fps: float | None = None,
    progress: Progress,
) -> ConvertResult:
    return convert(
        recording.video,
        recording.markers,
        out=out,
        start_s=recording.start_s,
        end_s=recording.end_s,
        tracks=tracks,
        fps=fps,
        progress=progress,
    )


@dataclass(frozen=True)
class _Means:
    """What a replay is done with, beside its scenario; see :func:`solve`."""

    threads: Threads | None
    warn: Warn
    progress: Progress


def solve(
    scenario: Scenario,
    *,
    out: Path | str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    threads: Threads | None = None,
    warn: Warn = silent,
    progress: ProgressOption = None,
) -> Solution:
    """Replay a scenario and return its solution.

    The motion is the scenario's, or else its recording's, converted first.

    Parameters
    ----------
    scenario
        What to replay.
    out
        A run directory to write too; None writes nothing. Each increment is safe on disk once it
        is computed.
    resume
        Go on after the last increment of an unfinished run in ``out``.
    overwrite
        Discard an unfinished run, or replace a finished one, in ``out``. Without it a finished run
        of the same inputs is returned as it is, and any other one is refused.
    threads
        That share the work, two by default; results are the same bits.
    warn
        A function that is told each thing that is odd, as soon as it is found.
    progress
        True shows a line on the terminal or in the notebook; a function is called with the share
        that is done and what is being done.

    Returns
    -------
    Solution
        Also if the replay stopped early: see ``finished`` and ``message``.

    Raises
    ------
    DrinksimError
        If an input is wrong, or if nothing could be computed.
    OSError
        If ``out`` cannot be written.
    """
    told = each_once(warn)
    refuse_unusable(scenario, told)
    with chosen_progress(progress, f"replay {scenario.name}") as show:
        means = _Means(threads, told, show)
        if out is None:
            return _solved_in_memory(scenario, means)
        with _motion_in_a_file(scenario) as on_disk:
            return _solved_into(
                on_disk,
                Path(out),
                resume=resume,
                overwrite=overwrite,
                means=means,
            )


def _solved_in_memory(scenario: Scenario, means: _Means) -> Solution:
    known = with_known_motion(scenario, means.progress)
    collector = SolutionCollector()
    outcome = replay(
        known,
        on_model=collector.model,
        on_increment=collector.commit,
        reference=_reference_run(known, None, means),
        threads=means.threads,
        warn=means.warn,
        progress=means.progress,
    )
    if collector.count == 0:
        raise NothingComputedError(f"nothing was computed: {outcome.message}")
    return collector.finish(
        known, finished=outcome.finished, message=outcome.message, about=outcome.about
    )


@contextmanager
def _motion_in_a_file(scenario: Scenario) -> Iterator[Scenario]:
    """Yield the scenario with its motion in a file, for as long as the block takes."""
    if not isinstance(scenario.motion, Motion):
        yield scenario
        return
    with TemporaryDirectory() as folder:
        file = Path(folder) / "motion.csv"
        scenario.motion.write(file)
        yield scenario.with_motion(file)


def _solved_into(
    scenario: Scenario,
    out: Path,
    *,
    resume: bool,
    overwrite: bool,
    means: _Means,
) -> Solution:
    inputs = RunInputs.of(scenario)
    if (out / SUMMARY_FILE).is_file() and not overwrite:
        other = differing_input(out, inputs.fingerprint)
        if other is not None:
            raise SolutionError(
                f"{out} holds a finished run with {other}: give another --out, or replace it with "
                "--overwrite"
            )
        return Solution.load(out)
    with SolutionWriter(
        out,
        inputs.text,
        inputs=inputs.checksums,
        sources=list(inputs.sources.values()),
        resume=resume,
        overwrite=overwrite,
    ) as writer:
        if writer.is_complete:
            writer.tidy()
        else:
            _replay_into(writer, scenario, inputs, means)
    return Solution.load(out)


def _replay_into(
    writer: SolutionWriter,
    scenario: Scenario,
    inputs: RunInputs,
    means: _Means,
) -> None:
    """Replay from where the writer's run is to the end, with the inputs that it keeps."""
    for setting, source in inputs.sources.items():
        writer.keep(source, inputs.places[setting])
    _provide_motion(scenario, inputs, writer, means)
    known = inputs.within(writer.folder)
    cache = writer.folder / ACTIVATIONS_FILE

    def found(activations: Sequence[FoundActivation]) -> None:
        if activations:
            write_activations(cache, activations)
            writer.log(activations_message({each.muscle: each.about() for each in activations}))

    outcome = replay(
        known,
        on_model=writer.model,
        on_increment=writer.commit,
        resume_from=writer.last(),
        reference=_reference_run(known, writer.folder / REFERENCE_FOLDER, means),
        threads=means.threads,
        warn=means.warn,
        activations=read_activations(cache),
        on_activations=found,
        progress=means.progress,
    )
    if writer.count == 0:
        writer.discard()
        raise NothingComputedError(f"nothing was computed: {outcome.message}")
    writer.finish(
        finished=outcome.finished,
        message=outcome.message,
        about={"scenario": scenario.name, **outcome.about},
    )


def _reference_run(scenario: Scenario, folder: Path | None, means: _Means) -> Solution | None:
    """Return the run whose forces the hand follows; None if it follows the film.

    A run that the scenario does not name is made, and kept in ``folder`` if that is given: that of
    the filmed package as it was filmed, or of ``hand.reference_scenario`` with the same motion and
    numerics.
    """
    hand = scenario.hand
    if hand.mode == "recorded":
        return None
    if hand.reference is not None:
        return Solution.load(hand.reference)
    if hand.reference_scenario is not None:
        named = load_scenario(hand.reference_scenario)
        searches = replace(
            scenario.numerics,
            pull_search=named.numerics.pull_search,
            activation_search=named.numerics.activation_search,
        )
        filmed = replace(named, motion=scenario.motion, numerics=searches)
    else:
        filmed = scenario.with_(
            name=f"{scenario.name}, filmed",
            hand=HandSettings(),
            package=scenario.filmed_package,
            filmed=None,
        )
    return solve(
        filmed,
        out=folder,
        resume=folder is not None,
        threads=means.threads,
        warn=means.warn,
        progress=means.progress,
    )


def _provide_motion(
    scenario: Scenario, inputs: RunInputs, writer: SolutionWriter, means: _Means
) -> None:
    """Put the motion into the run directory, with what pictures need beside it."""
    given = inputs.sources.get(MOTION)
    if given is not None:
        for name in BESIDE_MOTION:
            if given.with_name(name).is_file():
                writer.keep(given.with_name(name), f"{MOTION_FOLDER}/{name}")
        return
    kept = writer.folder / inputs.places[MOTION]
    if not kept.is_file():
        conversion = convert_recording(
            _recording_of(scenario), kept.parent, progress=means.progress
        )
        for warning in conversion.warnings:
            writer.log(f"recording: {warning}")
            means.warn(f"recording: {warning}")
    writer.converted(kept)


def with_known_motion(scenario: Scenario, progress: Progress) -> Scenario:
    """Return the scenario with a motion: its own, or its recording's, converted in memory."""
    if scenario.motion is not None:
        return scenario
    conversion = _converted(_recording_of(scenario), progress=progress)
    return scenario.with_motion(conversion.motion)


def _recording_of(scenario: Scenario) -> Recording:
    assert scenario.recording is not None  # a scenario has a motion or a recording
    return scenario.recording
