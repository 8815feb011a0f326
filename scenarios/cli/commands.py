"""The console script ``drinksim``: every command is a thin layer over a function.

Exit codes: 0; 2 for wrong usage or wrong input (one line on the standard error); 3 for a
computation that could not finish (what was computed is kept); 130 for one that was interrupted (the
line says how to go on).
"""

from __future__ import annotations

import errno
import os
import shlex
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from geometry2d.foundation.errors import DrinksimError
from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress, progress_line
from scenarios.cli.parser import (
    SETTINGS_OF,
    complain,
    drinksim_parser,
    given_settings,
    settings_of,
)
from scenarios.settings.scenario import (
    Recording,
    Scenario,
    library_names,
    load_scenario,
    resolved_toml,
)
from scenarios.settings.writing import toml_value
from scenarios.studies.element import ElementOptions
from scenarios.studies.fit import CalibrationOptions
from scenarios.studies.press import PressOptions
from scenarios.studies.suction_curve import AspirationOptions, CurveOptions

NOT_FINISHED = 3
INTERRUPTED = 130

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of a disk that is full, or full for this user or file."""

GOES_ON = ("calibrate",)
"""Commands that use what an interrupted call of theirs computed without being told to."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    typed = list(sys.argv[1:] if arguments is None else arguments)
    options = drinksim_parser().parse_args(typed)
    try:
        code = COMMANDS[options.command](options)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return complain(f"interrupted{_going_on(options, typed)}", INTERRUPTED)
    except BrokenPipeError:
        # Whoever read our output has enough; nothing is left to be flushed at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        reason = f"{place}{error.strerror or error}"
        if error.errno in NO_ROOM:
            return complain(f"{reason}: what was computed is kept; make room", NOT_FINISHED)
        return complain(f"{reason}: check the path and its permissions")
    except MemoryError:
        remedy = "what was computed is kept; choose a coarser resolution or free some"
        return complain(f"there is not enough memory: {remedy}", NOT_FINISHED)
    except DrinksimError as error:
        return complain(str(error))
    return code


def _going_on(options: Namespace, typed: Sequence[str]) -> str:
    """Return how an interrupted command goes on, to be put behind what happened to it."""
    again = [word for word in typed if word != "--overwrite"]
    if "resume" in options and "--resume" not in again:
        again.append("--resume")
    elif "resume" not in options and options.command not in GOES_ON:
        return ""
    return f"; to go on where it was: drinksim {shlex.join(again)}"


def _convert(options: Namespace) -> int:
    from scenarios.sip.run import convert_recording

    recording = Recording(
        video=str(options.video),
        markers=str(options.markers),
        start_s=options.start,
        end_s=options.end,
    )
    with progress_line("convert") as progress:
        conversion = convert_recording(
            recording, options.out, tracks=options.tracks, fps=options.fps, progress=progress
        )
    for warning in conversion.warnings:
        sys.stderr.write(f"drinksim: warning: {warning}\n")
    print(f"{conversion.motion.parent}: tracks.csv, motion.csv, boundary_conditions, overlay.mp4")
    return 0


def _scenarios(options: Namespace) -> int:
    if options.name is None:
        if options.set or options.redraw is not None:
            return complain("no NAME given: say which scenario --set or --redraw is about")
        for name in library_names():
            print(f"{name:<8}  {load_scenario(name).description}")
        return 0
    if options.redraw is not None:
        if options.set:
            return complain("--set has no effect beside --redraw: give one of them")
        return _redraw(options.name, options.redraw)
    sys.stdout.write(resolved_toml(load_scenario(options.name, options.set)))
    return 0


def _redraw(name: str, out: Path) -> int:
    from scenarios.recordings.rendering import redraw

    with progress_line("redraw") as progress, directory_at_once(out) as partial:
        progress(0.0, f"rendering the recording of {name}")
        redraw(name, partial)
    print(f"{out}: recording.mp4, markers.toml and the truth behind them")
    return 0


def _replay(options: Namespace) -> int:
    from scenarios.results.messages import peaks_message
    from scenarios.sip.run import NothingComputedError, solve

    scenario = _chosen_scenario(options)
    try:
        solution = solve(
            scenario,
            out=options.out,
            resume=options.resume,
            overwrite=options.overwrite,
            progress=True,
        )
    except NothingComputedError as error:
        return complain(str(error), NOT_FINISHED)
    print(f"{options.out}: {solution.message}\n{peaks_message(solution.summary)}")
    return 0 if solution.finished else complain(solution.message, NOT_FINISHED)


def _preview(options: Namespace) -> int:
    from scenarios.sip.findings import Severity
    from scenarios.views.preview import write_preview

    with progress_line("preview") as progress:
        found = write_preview(_chosen_scenario(options), options.out, progress=progress)
    errors = [finding for finding in found if finding.severity is Severity.ERROR]
    for finding in found:
        if finding.severity is Severity.WARNING:
            print(f"warning: {finding}")
    if errors:
        return complain("; ".join(str(finding) for finding in errors))
    print(f"{options.out}: head and neck at first contact, half way and at last contact")
    return 0


def _chosen_scenario(options: Namespace) -> Scenario:
    settings = list(options.set)
    for name in ("plane", "resolution"):
        if getattr(options, name, None) is not None:
            settings.append(f"numerics.{name}={getattr(options, name)}")
    if options.motion is not None:
        settings.append(f"motion.file={toml_value(str(options.motion))}")
    return load_scenario(options.scenario, settings)


def _element(options: Namespace) -> int:
    from scenarios.studies.element import element_study, thesis_figures

    with progress_line("element") as progress:
        if options.thesis:
            ineffective = given_settings(SETTINGS_OF["element"], options)
            ineffective += ["MATERIAL"] if options.material is not None else []
            if ineffective:
                return complain(f"{ineffective[0]} has no effect beside --thesis: leave it out")
            result = thesis_figures(options.out, progress=progress)
        elif options.material is None:
            return complain("no MATERIAL given: name one, or redo the thesis' figures: --thesis")
        else:
            chosen = settings_of(ElementOptions, options)
            result = element_study(options.material, options.out, chosen)
    pictures = ", ".join(sorted(path.name for path in result.folder.glob("*.png")))
    print("\n".join([f"{result.folder}: {pictures}, and the curves as CSV", *result.messages]))
    return 0


def _aspirate(options: Namespace) -> int:
    from scenarios.studies.aspiration import aspiration_study, thesis_comparison

    chosen = settings_of(AspirationOptions, options)
    with progress_line("aspirate") as progress:
        if options.thesis:
            if options.configuration is not None:
                return complain("CONFIG has no effect beside --thesis: leave it out")
            result = thesis_comparison(options.out, chosen, progress=progress)
            files = "aspiration-*.csv, high-*.csv, comparison.png"
        elif options.configuration is None:
            return complain("no CONFIG given: name one, or compare the thesis' with --thesis")
        else:
            result = aspiration_study(options.configuration, options.out, chosen, progress=progress)
            files = "aspiration.csv, aspiration.png, field.png"
    print("\n".join([f"{result.folder}: {files}", *result.messages]))
    return 0 if result.complete else complain(result.messages[-1], NOT_FINISHED)


def _calibrate(options: Namespace) -> int:
    from scenarios.studies.calibration import calibration_study
    from scenarios.studies.curve_gradient import CalibrationStopped

    chosen = settings_of(CalibrationOptions, options)
    with progress_line("calibrate") as progress:
        try:
            result = calibration_study(
                options.configuration, options.target, options.out, chosen, progress=progress
            )
        except CalibrationStopped as stopped:
            return complain(f"{stopped}; what was computed is kept", NOT_FINISHED)
    print("\n".join([f"{result.folder}: calibration.json, calibration.png", *result.messages]))
    return 0 if result.complete else complain(result.messages[0], NOT_FINISHED)


def _sensitivity(options: Namespace) -> int:
    from scenarios.studies.sensitivity import sensitivity_study

    chosen = settings_of(CurveOptions, options)
    with progress_line(f"sensitivity to {options.of}") as progress:
        result = sensitivity_study(
            options.configuration, options.of, options.out, chosen, progress=progress
        )
    print("\n".join([f"{result.folder}:", *result.messages]))
    return 0


def _press(options: Namespace) -> int:
    from scenarios.studies.press_study import press_study

    chosen = settings_of(PressOptions, options)
    with progress_line("press") as progress:
        result = press_study(options.configuration, options.out, chosen, progress=progress)
    print("\n".join([f"{result.folder}: press.json, press.png", *result.messages]))
    return 0


def _animate(options: Namespace) -> int:
    from scenarios.views.animation import animate

    with progress_line("animate") as progress:
        animate(
            options.run,
            options.out,
            beside_video=options.beside_video,
            field=options.field,
            progress=progress,
        )
    print(options.out)
    return 0


def _report(options: Namespace) -> int:
    from scenarios.views.page.report import write_report

    with progress_line("report") as progress:
        write_report(options.runs, options.out, progress=progress)
    print(options.out)
    return 0


def _export(options: Namespace) -> int:
    from scenarios.export.abaqus import export_abaqus
    from scenarios.export.vtk import export_vtk

    with progress_line("export") as progress:
        if options.format == "abaqus":
            export_abaqus(options.run, options.out, progress=progress)
        else:
            export_vtk(options.run, options.out, progress=progress)
    what = {
        "abaqus": "input deck for Abaqus/Standard",
        "vtk": "run.pvd for ParaView, and its increments",
    }
    print(f"{options.out}: {what[options.format]}")
    return 0


def _demo(options: Namespace) -> int:
    from scenarios.results.messages import peaks_message
    from scenarios.sip.run import convert_recording, solve
    from scenarios.views.animation import animate
    from scenarios.views.plots import plot_histories, plot_imprint

    out: Path = options.out
    scenario = load_scenario("A38-F")
    assert scenario.recording is not None  # the library's scenarios are recorded
    film, sheet = out / "A38-F.mp4", out / "A38-F.png"
    histories, imprint = out / "A38-F-history.png", out / "A38-F-imprint.png"
    with _stage("1/4 convert: video to motion") as progress:
        conversion = convert_recording(scenario.recording, out / "conversion", progress=progress)
    with _stage("2/4 replay: motion to contact") as progress:
        solution = solve(
            scenario.with_motion(conversion.motion), out=out / "replay", progress=progress
        )
    with _stage("3/4 animate: model beside recording") as progress:
        animate(out / "replay", film, beside_video=True, progress=progress)
        animate(out / "replay", sheet, beside_video=True, progress=progress)
    with _stage("4/4 plot: histories and imprint"):
        plot_histories([out / "replay"], histories)
        plot_imprint(out / "replay", imprint)
    print(f"\n{solution.message}\n{peaks_message(solution.summary)}\n\nLook at")
    for path, what in (
        (film, "the sip: recording and model side by side"),
        (sheet, "the same as six frames"),
        (histories, "strain, stress and pressure over the sip"),
        (imprint, "where and when the neck is pressed"),
        (out / "conversion" / "overlay.mp4", "the recording with its tracked markers"),
        (out / "replay" / "history.csv", "the numbers"),
    ):
        print(f"  {path!s:<32}  {what}")
    return 0 if solution.finished else complain(solution.message, NOT_FINISHED)


@contextmanager
def _stage(title: str) -> Iterator[Progress]:
    """Print one line, also in a pipe: what is being done and how long it took."""
    started = time.monotonic()
    with progress_line(title) as progress:
        yield progress
    print(f"{title:<40} {time.monotonic() - started:6.1f} s", flush=True)


COMMANDS: Mapping[str, Callable[[Namespace], int]] = {
    "demo": _demo,
    "convert": _convert,
    "scenarios": _scenarios,
    "preview": _preview,
    "replay": _replay,
    "animate": _animate,
    "report": _report,
    "export": _export,
    "element": _element,
    "aspirate": _aspirate,
    "calibrate": _calibrate,
    "sensitivity": _sensitivity,
    "press": _press,
}
"""What each command does."""
