"""The command line: results, exit codes, and one helpful line for whatever is wrong."""

from __future__ import annotations

import errno
import importlib.metadata
import io
import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pytest

from geometry2d.foundation.progress import progress_line
from geometry2d.neck import A38_NECK
from mocap.synthetic.recording_file import write_recording
from mocap.video.frames import Video
from scenarios.cli.main import main
from scenarios.cli.parser import COMMANDS, drinksim_parser, module_of
from scenarios.messages.closing import closing_message
from scenarios.recordings.script import LIBRARY
from scenarios.results.solution import Solution
from scenarios.sip import run
from tests.support.made_up_sip import (
    COUNT,
    MARKERS,
    MadeUpReplay,
    write_motion,
    write_small_recording,
)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("filmed")
    write_small_recording(folder)
    return folder


def complaint(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Return the one line on stderr of a command that must end with exit code 2."""
    try:
        code = main([str(argument) for argument in arguments])
    except SystemExit as stop:
        code = int(stop.code or 0)
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert len(lines) == 1, captured.err
    assert lines[0].startswith("drinksim: ")
    return lines[0]


def test_the_version_is_the_installed_one(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"drinksim {importlib.metadata.version('drinksim')}\n"


def test_a_missing_video(capsys: pytest.CaptureFixture[str], tmp_path: Path, filmed: Path) -> None:
    markers, out = filmed / "markers.toml", tmp_path / "out"
    line = complaint(capsys, "convert", "sipp.mp4", "--markers", markers, "--out", out)
    assert "sipp.mp4" in line
    assert list(tmp_path.iterdir()) == []


def test_a_video_without_a_frame(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, filmed: Path
) -> None:
    empty = tmp_path / "empty.mp4"
    with av.open(str(empty), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 320, 200, "yuv420p"
        container.start_encoding()
    markers, out = filmed / "markers.toml", tmp_path / "out"
    assert str(empty) in complaint(capsys, "convert", empty, "--markers", markers, "--out", out)
    words = tmp_path / "words.mp4"
    words.write_text("not a video")
    assert str(words) in complaint(capsys, "convert", words, "--markers", markers, "--out", out)
    assert not out.exists()


@pytest.mark.parametrize(
    ("change", "wanted"),
    [
        (lambda text: text.replace("package =", "pakage ="), ("pakage", "package")),
        (lambda text: text.replace("[255.0, 170.0]", "[5255.0, 170.0]"), ("5255", "package_lower")),
        (lambda text: text.replace("[scale]", "[scale"), ("TOML",)),
    ],
)
def test_a_wrong_marker_file(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    filmed: Path,
    change: Callable[[str], str],
    wanted: tuple[str, ...],
) -> None:
    markers = tmp_path / "markers.toml"
    markers.write_text(change(MARKERS))
    line = complaint(
        capsys, "convert", filmed / "recording.mp4", "--markers", markers, "--out", tmp_path / "out"
    )
    assert all(word in line for word in wanted)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_what_a_conversion_warns_of_is_said_on_screen(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    sip = LIBRARY / "A38-F"
    shown = Video(sip / "recording.mp4").frames(end_s=0.8)
    frames = [frame.colour()[..., ::-1] for frame in shown]
    frames[15] = frames[14]
    write_recording(tmp_path / "v.mp4", frames, np.arange(len(frames)) / 25)
    video, markers, out = tmp_path / "v.mp4", sip / "markers.toml", tmp_path / "out"
    assert main(["convert", str(video), "--markers", str(markers), "--out", str(out)]) == 0
    said = capsys.readouterr().err.splitlines()
    assert any("frame 15 repeats the previous picture" in line for line in said)
    warnings = json.loads((out / "summary.json").read_text(encoding="utf-8"))["warnings"]
    assert said == [f"drinksim: warning: {warning}" for warning in warnings]


def test_the_help_of_convert_shows_a_marker_file(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["convert", "--help"])
    said = capsys.readouterr().out
    assert "example: drinksim convert" in said and "package_lower = [752.0, 374.0]" in said


def test_an_unknown_scenario(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = complaint(capsys, "replay", "A38F", "--out", tmp_path / "out")
    assert "did you mean 'A38-F'?" in line
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_setting(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = complaint(capsys, "scenarios", "A38-F", "--set", "contact.fricton=1")
    assert "did you mean contact.friction?" in line


def test_a_missing_motion_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    line = complaint(
        capsys, "replay", "A38-F", "--out", tmp_path / "out", "--motion", tmp_path / "no.csv"
    )
    assert "no.csv" in line
    assert "drinksim convert" in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["convert", "replay", "animate", "demo"])
def test_an_out_that_cannot_be_written(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    filmed: Path,
    run_directory: Path,
    command: str,
) -> None:
    in_the_way = tmp_path / "a-file"
    in_the_way.write_text("")
    out = in_the_way / "out.mp4"
    given = {
        "convert": (filmed / "recording.mp4", "--markers", filmed / "markers.toml"),
        "replay": ("A38-F", "--motion", run_directory / "motion" / "motion.csv"),
        "animate": (run_directory,),
        "demo": (),
    }
    assert "a-file" in complaint(capsys, command, *given[command], "--out", out)


def test_an_out_without_permission(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("geometry2d.foundation.output.os.access", lambda *_: False)
    line = complaint(capsys, "replay", "A38-F", "--out", tmp_path / "run")
    assert f"no permission in {tmp_path}" in line


def test_an_out_that_holds_something_else(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "letter.txt").write_text("Dear")
    assert "give another directory" in complaint(capsys, "replay", "A38-F", "--out", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


@pytest.mark.parametrize(
    "arguments",
    [("replay",), ("replay", "A38-F"), ("reply", "A38-F"), ("animate", "run", "--beside"), ()],
)
def test_wrong_usage(capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...]) -> None:
    assert "--help" in complaint(capsys, *arguments)


def help_of(capsys: pytest.CaptureFixture[str], *command: str) -> str:
    """Return the help of a command, its lines joined."""
    with pytest.raises(SystemExit) as stop:
        main([*command, "--help"])
    assert stop.value.code == 0
    return " ".join(capsys.readouterr().out.split())


def test_every_command_has_help_with_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    listed = help_of(capsys)
    for command in [command.name for command in COMMANDS]:
        assert f" {command} " in listed
        shown = help_of(capsys, command)
        (example,) = re.findall(rf"example: drinksim ({command} [^>]*)", shown)
        words = shlex.split(example.split(" a marker file:")[0])
        assert drinksim_parser().parse_args(words).command == command


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("scenarios", "--set", "contact.friction=1"), "no NAME given"),
        (("scenarios", "--redraw", "x"), "no NAME given"),
        (("scenarios", "A38-F", "--redraw", "x", "--set", "name=x"), "--set has no effect beside"),
        (("element", "L1", "--thesis", "--out", "x"), "MATERIAL has no effect beside --thesis"),
        (("element", "--thesis", "--points", "3", "--out", "x"), "--points has no effect beside"),
        (("element", "L2-Ogden/dermis", "--mode", "compression", "--to-mm", "1", "--out", "x"),
         "to_mm = 1 mm has no effect in compression"),
        (("aspirate", "L1", "--thesis", "--out", "x"), "CONFIG has no effect beside --thesis"),
        (("aspirate", "L1", "--hypodermis-mm", "3", "--out", "x"), "hypodermis_mm = 3 mm has no"),
        (("sensitivity", "L1", "--of", "mesh", "--edge-mm", "0.5", "--out", "x"), "edge_mm = 0.5"),
        (("replay", "A38-F", "--resume", "--overwrite", "--out", "x"), "not allowed with argument"),
        (("replay", "A38-F", "--plane", "strain", "--set", "numerics.plane=stress", "--out", "x"),
         'numerics.plane is given twice, "stress" and "strain"'),
        (("replay", "A38-F", "--motion", "a.csv", "--set", "motion.file=b.csv", "--out", "x"),
         "motion.file is given twice"),
    ],
)  # fmt: skip
def test_options_without_effect_are_refused(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], said: str
) -> None:
    assert said in complaint(capsys, *arguments)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (
            OSError(errno.ENOSPC, "No space left on device", "run/x"),
            "run/x: No space left on device",
        ),
        (OSError(errno.EFBIG, "File too large"), "File too large: what was computed is kept"),
        (MemoryError(), "there is not enough memory: what was computed is kept"),
    ],
)
def test_a_computation_without_room_ends_with_its_own_code(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    error: BaseException,
    said: str,
) -> None:
    def fails(_: object) -> int:
        raise error

    monkeypatch.setattr(module_of("report"), "run", fails)
    assert main(["report", "run", "--out", "r.html"]) == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("drinksim: ") and said in line


def test_an_interrupted_command_says_how_it_goes_on(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(_: object) -> int:
        raise KeyboardInterrupt

    for command in ("replay", "calibrate", "report"):
        monkeypatch.setattr(module_of(command), "run", interrupted)
    for typed, again in (
        ("replay 'my sip.toml' --out run --overwrite", "replay 'my sip.toml' --out run --resume"),
        ("replay A38-F --out run --resume", "replay A38-F --out run --resume"),
        ("calibrate L1 --target t.csv --out fit", "calibrate L1 --target t.csv --out fit"),
    ):
        assert main(shlex.split(typed)) == 130
        line = f"drinksim: interrupted; to go on where it was: drinksim {again}\n"
        assert capsys.readouterr().err == line
    assert main(["report", "run", "--out", "r.html"]) == 130
    assert capsys.readouterr().err == "drinksim: interrupted\n"


def test_scenarios_are_listed_and_shown(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["scenarios"]) == 0
    assert "A38-F " in capsys.readouterr().out
    assert main(["scenarios", "A38-F", "--set", "contact.friction=0.25"]) == 0
    shown = capsys.readouterr().out
    assert "friction = 0.25" in shown
    assert "thesis, section 4.2" in shown
    assert "mm: outer diameter of the thread" in shown
    document = tomllib.loads(shown)
    assert document["contact"]["friction"] == 0.25
    (tmp_path / "x.toml").write_text(shown)
    assert main(["scenarios", str(tmp_path / "x.toml")]) == 0
    assert tomllib.loads(capsys.readouterr().out) == document


def test_a_cube_is_pulled(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "cube"
    command = ("element", "L2-Ogden/dermis", "--out", out)
    assert main([str(word) for word in (*command, "--points", "7", "--from-mm", "0")]) == 0
    assert "element.png" in capsys.readouterr().out
    assert len((out / "element.csv").read_text().splitlines()) == 8
    assert "from_mm = -2 mm is too small" in complaint(capsys, *command, "--from-mm", "-2")
    assert 'points = "x": give a whole number' in complaint(capsys, *command, "--points", "x")
    assert "name one" in complaint(capsys, "element", "--out", out)


def test_a_recording_is_redrawn_whole_or_not_at_all(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    out = tmp_path / "redrawn"
    line = complaint(capsys, "scenarios", "A38G", "--redraw", out)
    assert "A38-F" in line
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr(
        "scenarios.recordings.rendering.redraw",
        lambda name, folder: (folder / name).write_text("drawn"),
    )
    assert main(["scenarios", "A38-F", "--redraw", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == [".drinksim", "A38-F"]


@pytest.mark.slow
def test_output_may_be_cut_off() -> None:
    command = f"{sys.executable} -c 'from scenarios.cli.main import main; raise SystemExit(main())'"
    piped = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command} scenarios A38-F | head -n 1"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "MPLBACKEND": "agg"},
    )
    assert piped.returncode == 0
    assert piped.stderr == ""


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    return write_motion(tmp_path / "converted", tracked=False)


def test_a_replay_becomes_a_run_directory(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    motion: Path,
) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay())
    out = tmp_path / "run"
    assert main(["replay", "A38-F", "--motion", str(motion), "--out", str(out)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said == [f"{out}: {closing_message(Solution.load(out))}"]
    assert "11 of 11" in (out / "run.log").read_text()
    solution = Solution.load(out)
    assert solution.summary["scenario"] == "A38-F"
    assert solution.summary["elements"] == 7
    assert (out / "motion" / "motion.csv").read_bytes() == motion.read_bytes()
    assert main(["replay", str(out / "scenario.toml"), "--out", str(tmp_path / "again")]) == 0
    assert (tmp_path / "again" / "history.csv").read_text() == (out / "history.csv").read_text()
    assert main(["animate", str(out), "--out", str(tmp_path / "sip.png")]) == 0


@pytest.mark.slow
def test_a_replay_that_stops_keeps_what_it_has(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    motion: Path,
) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay(until=6))
    out = tmp_path / "run"
    assert main(["replay", "A38-F", "--motion", str(motion), "--out", str(out)]) == 3
    printed = capsys.readouterr()
    assert printed.err == f"drinksim: {out} stopped at 1.50 s: run.log there says why\n"
    assert "kPa" not in printed.out
    solution = Solution.load(out)
    assert solution.time_s.size == 6
    assert solution.summary["finished"] is False
    assert main(["animate", str(out), "--out", str(tmp_path / "sip.png")]) == 0
    assert main(["report", str(out), "--out", str(tmp_path / "sip.html")]) == 0
    told = (tmp_path / "sip.html").read_text()
    assert "Numbers are those until 1.50 s; what presses most may come later." in told


def test_verbose_says_how_the_solver_went(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    motion: Path,
) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay())
    replay = ["replay", "A38-F", "--motion", str(motion), "--out", str(tmp_path / "run")]
    assert main([*replay, "--verbose"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "solver: 11 of 11"


def test_a_replay_that_computes_nothing_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, motion: Path
) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay(until=0))
    out = tmp_path / "run"
    assert main(["replay", "A38-F", "--motion", str(motion), "--out", str(out)]) == 3
    assert [path.name for path in tmp_path.iterdir()] == [motion.parent.name]


def test_an_interrupted_replay_goes_on(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    motion: Path,
) -> None:
    out = tmp_path / "run"
    command = ["replay", "A38-F", "--motion", str(motion), "--out", str(out)]
    monkeypatch.setattr(run, "replay", MadeUpReplay(until=6, interrupted=True))
    assert main(command) == 130
    assert not out.exists()
    assert f"--out {out} --resume\n" in capsys.readouterr().err
    monkeypatch.setattr(run, "replay", MadeUpReplay())
    assert "--overwrite" in complaint(capsys, *command, "--resume", "--set", "contact.friction=0.9")
    assert main([*command, "--resume"]) == 0
    assert Solution.load(out).time_s.size == COUNT


@pytest.mark.slow
def test_the_demo_says_what_to_look_at(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay())
    assert main(["demo", "--out", str(tmp_path / "demo")]) == 0
    said = capsys.readouterr().out.splitlines()
    stages = [line for line in said if line.endswith(" s")]
    assert [stage[:3] for stage in stages] == ["1/5", "2/5", "3/5", "4/5", "5/5"]
    named = [Path(line.split("  ")[1]) for line in said if line.startswith("  ")]
    assert len(named) == 6
    assert all(path.is_file() and path.stat().st_size > 1000 for path in named)
    assert {"A38-F.mp4", "A38-F.png"} <= {path.name for path in named}
    page = Path(said[-1].removeprefix("Open in a browser and drag the slider: "))
    assert page == (tmp_path / "demo" / "A38-F.html").resolve()
    assert "Move through the sip" in page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_replay_converts_its_recording_if_it_must(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay(until=6, interrupted=True))
    out = tmp_path / "run"
    assert main(["replay", "A38-F", "--out", str(out)]) == 130
    converted = tmp_path / "run.partial" / "motion" / "motion.csv"
    written = converted.stat().st_mtime_ns
    monkeypatch.setattr(run, "replay", MadeUpReplay())
    assert main(["replay", "A38-F", "--out", str(out), "--resume"]) == 0
    assert (out / "motion" / "motion.csv").stat().st_mtime_ns == written
    assert main(["animate", str(out), "--out", str(tmp_path / "a.png"), "--beside-video"]) == 0


def test_plane_and_resolution_are_short_for_settings(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, motion: Path
) -> None:
    monkeypatch.setattr(run, "replay", MadeUpReplay())
    out = tmp_path / "run"
    options = ["--plane", "strain", "--resolution", "coarse", "--set", "contact.friction=0.5"]
    assert main(["replay", "A38-F", "--motion", str(motion), "--out", str(out), *options]) == 0
    text = (out / "scenario.toml").read_text()
    assert 'plane = "strain"' in text
    assert 'resolution = "coarse"' in text
    assert "friction = 0.5 " in text


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_is_shown_on_a_terminal_and_nowhere_else(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with progress_line("replay") as progress:
        progress(0.5, "half")
    assert capsys.readouterr().err == ""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress_line("replay") as progress:
        progress(0.5, "half of it")
        progress(1.0, "x" * 500)
    shown = terminal.getvalue()
    assert " 50%" in shown
    assert "half of it" in shown
    assert shown.endswith("\r\x1b[K")
    assert all(len(line) < 130 for line in shown.split("\r"))


def test_an_error_of_ours_is_a_line_and_a_bug_is_not(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, motion: Path
) -> None:
    def buggy(*_: object, **__: object) -> None:
        raise ValueError("operands could not be broadcast together")

    monkeypatch.setattr(run, "replay", buggy)
    with pytest.raises(ValueError, match="broadcast"):
        main(["replay", "A38-F", "--motion", str(motion), "--out", str(tmp_path / "run")])


def test_a_preview_refuses_a_drawing_in_centimetres(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    settings = [
        f"--set=package.{name}={getattr(A38_NECK, name) / 10}"
        for name in (
            "thread_diameter_mm",
            "root_diameter_mm",
            "wall_thickness_mm",
            "rim_radius_mm",
            "crest_radius_mm",
            "root_radius_mm",
            "land_mm",
            "pitch_mm",
            "crest_width_mm",
            "mark_distance_mm",
        )
    ]
    line = complaint(capsys, "preview", "A38-F", *settings, "--out", tmp_path / "preview.png")
    assert "a drawing in cm" in line
    assert not (tmp_path / "preview.png").exists()


@pytest.mark.slow
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&-"])
def test_a_closed_stream_is_no_error(closed: str) -> None:
    command = f"{sys.executable} -m drinksim scenarios A38-F {closed}"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize(
    "environment",
    [
        {"LC_ALL": "C", "PYTHONIOENCODING": "ascii"},
        {"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
        {"PYTHONIOENCODING": "cp1252"},
        {"HOME": "/nonexistent", "XDG_CACHE_HOME": "/nonexistent"},
    ],
)
def test_any_locale_and_no_home_will_do(environment: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "drinksim", "scenarios", "A38-F"],
        env={"PATH": os.environ["PATH"], "PYTHONPATH": os.pathsep.join(sys.path)} | environment,
        capture_output=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"[liquid]" in done.stdout
