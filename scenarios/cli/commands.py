"""The console script ``drinksim``: every command is a thin layer over a function.

Exit codes: 0, 2 for wrong usage or wrong input (one line on stderr), 3 for a computation that
could not finish (what was computed is kept).
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib.metadata
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from textwrap import indent
from typing import NoReturn

from geometry2d.foundation.output import directory_at_once
from geometry2d.foundation.progress import Progress, progress_line
from mocap.convert import ConvertOptions
from mocap.tracking.marker_file import EXAMPLE
from scenarios.results.quantities import ELEMENT_FIELDS
from scenarios.settings.files import split_setting
from scenarios.settings.scenario import (
    Numerics,
    Recording,
    Scenario,
    library_names,
    load_scenario,
    resolved_toml,
)
from scenarios.settings.tables import Table, keys_of, table_from
from scenarios.settings.writing import about, toml_value
from scenarios.studies.aspiration import AspirationOptions
from scenarios.studies.calibration import CalibrationOptions
from scenarios.studies.element import ElementOptions
from scenarios.studies.press import PressOptions

WRONG_INPUT = 2
NOT_FINISHED = 3
INTERRUPTED = 130
PACKAGES = ("geometry2d", "mocap", "fem2d", "scenarios")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    options = _parser().parse_args(arguments)
    try:
        code: int = options.command(options)
        sys.stdout.flush()
    except KeyboardInterrupt:
        resumable = "resume" in options
        remedy = "; the same command with --resume goes on where it was" if resumable else ""
        return _complain(f"interrupted{remedy}", INTERRUPTED)
    except BrokenPipeError:
        # Whoever read our output has enough; nothing is left to be flushed at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        return _complain(f"{place}{error.strerror or error}: check the path and its permissions")
    except ValueError as error:
        if not _is_ours(error):
            raise
        return _complain(str(error))
    return code


def _convert(options: argparse.Namespace) -> int:
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


def _scenarios(options: argparse.Namespace) -> int:
    if options.name is None:
        for name in library_names():
            print(f"{name:<8}  {load_scenario(name).description}")
        return 0
    if options.redraw is not None:
        return _redraw(options.name, options.redraw)
    sys.stdout.write(resolved_toml(load_scenario(options.name, options.set)))
    return 0


def _redraw(name: str, out: Path) -> int:
    from scenarios.recordings.rendering import redraw

    with progress_line("redraw") as progress, directory_at_once(out) as partial:
        progress(0.0, f"drawing the recording of {name}")
        redraw(name, partial)
    print(f"{out}: recording.mp4, markers.toml and the truth behind them")
    return 0


def _replay(options: argparse.Namespace) -> int:
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
        return _complain(str(error), NOT_FINISHED)
    print(f"{options.out}: {solution.message}\n{peaks_message(solution.summary)}")
    return 0 if solution.finished else _complain(solution.message, NOT_FINISHED)


def _preview(options: argparse.Namespace) -> int:
    from scenarios.sip.findings import Severity
    from scenarios.views.preview import write_preview

    with progress_line("preview") as progress:
        found = write_preview(_chosen_scenario(options), options.out, progress=progress)
    errors = [finding for finding in found if finding.severity is Severity.ERROR]
    for finding in found:
        if finding.severity is Severity.WARNING:
            print(f"warning: {finding}")
    if errors:
        return _complain("; ".join(str(finding) for finding in errors))
    print(f"{options.out}: head and neck at first contact, half way and at last contact")
    return 0


def _element(options: argparse.Namespace) -> int:
    from scenarios.studies.element import element_study, thesis_figures

    if options.thesis:
        result = thesis_figures(options.out)
    elif options.material is None:
        return _complain("no MATERIAL given: name one, or redo the thesis' figures with --thesis")
    else:
        result = element_study(options.material, options.out, _settings(ElementOptions, options))
    pictures = ", ".join(sorted(path.name for path in result.folder.glob("*.png")))
    print("\n".join([f"{result.folder}: {pictures}, and the curves as CSV", *result.sentences]))
    return 0


def _aspirate(options: argparse.Namespace) -> int:
    from scenarios.studies.aspiration import aspiration_study, thesis_comparison

    chosen = _settings(AspirationOptions, options)
    with progress_line("aspirate") as progress:
        if options.thesis:
            result = thesis_comparison(options.out, chosen, progress=progress)
            files = "aspiration-*.csv, high-*.csv, comparison.png"
        elif options.configuration is None:
            return _complain("no CONFIG given: name one, or compare the thesis' with --thesis")
        else:
            result = aspiration_study(options.configuration, options.out, chosen, progress=progress)
            files = "aspiration.csv, aspiration.png, field.png"
    print("\n".join([f"{result.folder}: {files}", *result.sentences]))
    return 0 if result.complete else _complain(result.sentences[-1], NOT_FINISHED)


def _calibrate(options: argparse.Namespace) -> int:
    from scenarios.studies.calibration import CalibrationStopped, calibration_study

    chosen = _settings(CalibrationOptions, options)
    with progress_line("calibrate") as progress:
        try:
            result = calibration_study(
                options.configuration, options.target, options.out, chosen, progress=progress
            )
        except CalibrationStopped as stopped:
            return _complain(f"{stopped}; what was computed is kept", NOT_FINISHED)
    print("\n".join([f"{result.folder}: calibration.json, calibration.png", *result.sentences]))
    return 0 if result.converged else _complain(result.sentences[0], NOT_FINISHED)


def _sensitivity(options: argparse.Namespace) -> int:
    from scenarios.studies.sensitivity import sensitivity_study

    chosen = _settings(AspirationOptions, options)
    with progress_line(f"sensitivity to {options.of}") as progress:
        result = sensitivity_study(
            options.configuration, options.of, options.out, chosen, progress=progress
        )
    print("\n".join([f"{result.folder}:", *result.sentences]))
    return 0


def _press(options: argparse.Namespace) -> int:
    from scenarios.studies.press import press_study

    chosen = _settings(PressOptions, options)
    with progress_line("press") as progress:
        result = press_study(options.configuration, options.out, chosen, progress=progress)
    print("\n".join([f"{result.folder}: press.json, press.png", *result.sentences]))
    return 0


def _animate(options: argparse.Namespace) -> int:
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


def _report(options: argparse.Namespace) -> int:
    from scenarios.views.page.report import write_report

    with progress_line("report") as progress:
        write_report(options.runs, options.out, progress=progress)
    print(options.out)
    return 0


def _export(options: argparse.Namespace) -> int:
    if options.format == "abaqus":
        from scenarios.export.abaqus import export_abaqus

        export_abaqus(options.run, options.out)
        print(f"{options.out}: input deck for Abaqus/Standard")
        return 0
    from scenarios.export.vtk import export_vtk

    with progress_line("export") as progress:
        export_vtk(options.run, options.out, progress=progress)
    print(f"{options.out}: run.pvd for ParaView, and its increments")
    return 0


def _demo(options: argparse.Namespace) -> int:
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
    return 0 if solution.finished else _complain(solution.message, NOT_FINISHED)


@contextmanager
def _stage(title: str) -> Iterator[Progress]:
    """Say in one line, also in a pipe, what is being done and how long it took."""
    started = time.monotonic()
    with progress_line(title) as progress:
        yield progress
    print(f"{title:<40} {time.monotonic() - started:6.1f} s", flush=True)


def _chosen_scenario(options: argparse.Namespace) -> Scenario:
    overrides = list(options.set)
    for name in ("plane", "resolution"):
        if getattr(options, name, None) is not None:
            overrides.append(f"numerics.{name}={getattr(options, name)}")
    if options.motion is not None:
        overrides.append(f"motion.file={toml_value(str(options.motion))}")
    return load_scenario(options.scenario, overrides)


def _complain(sentence: str, code: int = WRONG_INPUT) -> int:
    print(f"drinksim: {' '.join(sentence.split())}", file=sys.stderr)
    return code


def _is_ours(error: ValueError) -> bool:
    """Whether the error is one of the packages' own kinds, which speak about the user's input."""
    return type(error).__module__.partition(".")[0] in PACKAGES


class _Parser(argparse.ArgumentParser):
    """Complains about wrong usage in one line that says where help is."""

    def error(self, message: str) -> NoReturn:
        self.exit(_complain(f"{message} (see {self.prog} --help)"))


class _Help(argparse.RawDescriptionHelpFormatter):
    """Leaves examples on one line, and gives names room."""

    def __init__(self, prog: str) -> None:
        columns = shutil.get_terminal_size().columns
        super().__init__(prog, max_help_position=24, width=min(columns, 100) - 2)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="drinksim",
        formatter_class=_Help,
        description="A virtual consumer: how a package opening feels on the lips.",
    )
    version = f"%(prog)s {importlib.metadata.version('drinksim')}"
    parser.add_argument("--version", action="version", version=version)
    # The list of commands is written by hand: argparse gives long names a line of their own.
    commands = parser.add_subparsers(
        metavar="COMMAND", required=True, parser_class=_Parser, help=argparse.SUPPRESS
    )
    listed = ["commands:"]

    def command(
        name: str, function: Callable[[argparse.Namespace], int], does: str, example: str
    ) -> argparse.ArgumentParser:
        listed.append(f"  {name:<13}{does}")
        added = commands.add_parser(
            name,
            description=f"{does[0].upper()}{does[1:]}.",
            epilog=f"example: {example}",
            formatter_class=_Help,
        )
        added.set_defaults(command=function)
        return added

    demo = command(
        "demo",
        _demo,
        "the whole chain on the bundled A38-F recording",
        "drinksim demo --out demo",
    )
    _add_out(demo)

    convert = command(
        "convert",
        _convert,
        "turn a video into motions of head and package and boundary-condition tables",
        "drinksim convert sip.mp4 --markers markers.toml --out sip",
    )
    convert.epilog = f"{convert.epilog}\n\na marker file:\n\n{indent(EXAMPLE, '  ')}"
    convert.add_argument("video", metavar="VIDEO", type=Path, help="the recording, side view")
    convert.add_argument(
        "--markers", metavar="FILE", type=Path, required=True, help="marker file (TOML)"
    )
    _add_out(convert)
    what = {field.name: about(field) for field in dataclasses.fields(ConvertOptions)}
    convert.add_argument("--start", metavar="S", type=float, help=what["start_s"])
    convert.add_argument("--end", metavar="S", type=float, help=what["end_s"])
    convert.add_argument("--tracks", metavar="FILE", type=Path, help=what["tracks"])
    convert.add_argument("--fps", metavar="RATE", type=float, help=what["fps"])

    scenarios = command(
        "scenarios",
        _scenarios,
        "list the scenarios, or show one with every setting, its unit and its source",
        "drinksim scenarios A38-F",
    )
    scenarios.add_argument("name", metavar="NAME", nargs="?", help="a built-in name or a file")
    scenarios.add_argument(
        "--redraw", metavar="DIR", type=Path, help="render a built-in recording anew, bit for bit"
    )
    _add_set(scenarios)

    replay = command(
        "replay",
        _replay,
        "replay a recorded sip on the model of the lips",
        "drinksim replay A38-F --out run --resolution coarse --set contact.friction=0.5",
    )
    replay.add_argument("scenario", metavar="SCENARIO", help="a built-in name or a scenario file")
    _add_out(replay)
    replay.add_argument(
        "--motion", metavar="FILE", type=Path, help="motion.csv to replay instead of the scenario's"
    )
    for key in keys_of(Numerics):
        if key.choices:
            replay.add_argument(
                f"--{key.field.name}",
                choices=key.choices,
                help=f"{about(key.field)} (default: the scenario's)",
            )
    replay.add_argument(
        "--resume", action="store_true", help="go on with the unfinished run in --out, if any"
    )
    replay.add_argument(
        "--overwrite", action="store_true", help="discard what an earlier run left in --out"
    )
    _add_set(replay)

    preview = command(
        "preview",
        _preview,
        "show head and neck at three instants, and what is odd, before anything is computed",
        "drinksim preview A38-F --set package.crests=1 --out preview.png",
    )
    preview.add_argument(
        "scenario", metavar="SCENARIO", help="a library name (see drinksim scenarios) or a file"
    )
    preview.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="picture: .png, .svg or .pdf"
    )
    preview.add_argument(
        "--motion", metavar="FILE", type=Path, help="motion.csv to show instead of the scenario's"
    )
    _add_set(preview)

    element = command(
        "element",
        _element,
        "pull and press one cube of a material, as in the thesis' section 3.1.1",
        "drinksim element L2-Ogden/dermis --mode uniaxial --out cube",
    )
    element.add_argument(
        "material", metavar="MATERIAL", nargs="?", help="a library name or a material file"
    )
    _add_out(element)
    _add_settings(element, ElementOptions)
    element.add_argument(
        "--thesis", action="store_true", help="redo the thesis' Figures 3.7 to 3.9 instead"
    )

    aspirate = command(
        "aspirate",
        _aspirate,
        "suck at layered tissue with a cup, as in the thesis' section 3.1.2",
        "drinksim aspirate L2-Ogden --out aspiration",
    )
    _add_configuration(aspirate, optional=True)
    _add_out(aspirate)
    _add_settings(aspirate, AspirationOptions)
    aspirate.add_argument(
        "--thesis", action="store_true", help="compare the thesis' four, also at high suction"
    )

    calibrate = command(
        "calibrate",
        _calibrate,
        "fit a configuration to a suction curve",
        "drinksim calibrate L2-Ogden --target aspiration/aspiration.csv --out fit",
    )
    _add_configuration(calibrate)
    calibrate.add_argument(
        "--target",
        metavar="FILE",
        type=Path,
        required=True,
        help="CSV file with columns pressure_kpa and apex_mm",
    )
    _add_out(calibrate)
    _add_settings(calibrate, CalibrationOptions)

    sensitivity = command(
        "sensitivity",
        _sensitivity,
        "vary layers, parameters or mesh of the suction test",
        "drinksim sensitivity L2-Ogden --of thickness --out thickness",
    )
    _add_configuration(sensitivity)
    sensitivity.add_argument(
        "--of", choices=("thickness", "parameters", "mesh"), required=True, help="what is varied"
    )
    _add_out(sensitivity)
    _add_settings(sensitivity, AspirationOptions)

    press = command(
        "press",
        _press,
        "press a threaded neck into a lip, as in the thesis' section 3.1.3",
        "drinksim press L2-Ogden --force 0.3 --neck A38 --out press",
    )
    _add_configuration(press)
    _add_out(press)
    _add_settings(press, PressOptions)

    animate = command(
        "animate",
        _animate,
        "show a run as a film (.mp4, .gif) or as six frames (.png)",
        "drinksim animate run --out sip.mp4 --beside-video",
    )
    animate.add_argument("run", metavar="DIR", type=Path, help="a run directory")
    animate.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="ending in .mp4, .gif or .png"
    )
    animate.add_argument(
        "--beside-video", action="store_true", help="put the recording next to the model"
    )
    fields = [quantity.name for quantity in ELEMENT_FIELDS]
    animate.add_argument(
        "--field",
        choices=fields,
        default="von_mises_mpa",
        help="what the dermis is coloured by (default: %(default)s)",
    )

    report = command(
        "report",
        _report,
        "write one page about one run, or comparing several",
        "drinksim report a38-f dc-f --out report.html",
    )
    report.add_argument("runs", metavar="DIR", type=Path, nargs="+", help="run directories")
    report.add_argument("--out", metavar="FILE", type=Path, required=True, help="ending in .html")

    export = command(
        "export",
        _export,
        "write a run for other programs",
        "drinksim export run --format vtk --out paraview",
    )
    export.add_argument("run", metavar="DIR", type=Path, help="a run directory")
    export.add_argument(
        "--format",
        choices=("vtk", "abaqus"),
        required=True,
        help="vtk: a time series for ParaView; abaqus: an input deck of the model",
    )
    export.add_argument(
        "--out",
        metavar="OUT",
        type=Path,
        required=True,
        help="directory for vtk, file for abaqus (run.inp)",
    )

    parser.epilog = "\n".join([*listed, "", "example: drinksim demo --out demo"])
    return parser


def _add_settings(parser: argparse.ArgumentParser, table: type[object]) -> None:
    """Add one option for every setting of a table."""
    for key in keys_of(table):
        parser.add_argument(
            "--" + key.field.name.replace("_", "-"),
            metavar=None if key.choices else "VALUE",
            choices=key.choices or None,
            help=f"{about(key.field)} (default: {key.field.default})".replace("%", "%%"),
        )


def _settings(table: type[Table], options: argparse.Namespace) -> Table:
    """Return the table of the options that :func:`_add_settings` added, checked."""
    names = [key.field.name for key in keys_of(table)]
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    values = {name: split_setting(f"{name}={text}")[1] for name, text in given.items()}
    return table_from(table, values, where="")


def _add_configuration(parser: argparse.ArgumentParser, *, optional: bool = False) -> None:
    parser.add_argument(
        "configuration",
        metavar="CONFIG",
        nargs="?" if optional else None,
        help="L1, L2-GOH, L2-Ogden, L3, or a TOML file with one table a layer",
    )


def _add_out(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out", metavar="DIR", type=Path, required=True, help="directory for the results"
    )


def _add_set(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="change a setting, e.g. contact.friction=0.5; may be repeated; relative paths start "
        "from the current directory (in a scenario file, from the file's)",
    )
