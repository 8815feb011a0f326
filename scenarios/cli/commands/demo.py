"""``drinksim demo``: the bundled A38-F recording, replayed with passive and with acting lips."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from geometry2d.foundation.progress import Progress, progress_line
from scenarios.cli.options import add_out
from scenarios.cli.parser import NOT_FINISHED, Parser, complain
from scenarios.settings.scenario import load_scenario


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    add_out(parser)


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from scenarios.messages.closing import closing_message
    from scenarios.sip.run import convert_recording, solve
    from scenarios.views.animation import animate
    from scenarios.views.page.report import write_report
    from scenarios.views.plots import plot_histories, plot_imprint

    out: Path = options.out
    scenario = load_scenario("A38-F-acting")
    assert scenario.recording is not None  # the library's scenarios are recorded
    film, sheet = out / "A38-F.mp4", out / "A38-F.png"
    page = out / "A38-F.html"
    histories, imprint = out / "A38-F-history.png", out / "A38-F-imprint.png"
    passive, acting = out / "passive", out / "replay"
    with _stage("1/5 convert: video to motion") as progress:
        conversion = convert_recording(scenario.recording, out / "conversion", progress=progress)
    with _stage("2/5 replay: passive lips, neck as filmed") as progress:
        reference = load_scenario("A38-F").with_motion(conversion.motion)
        solve(reference, out=passive, progress=progress)
    with _stage("3/5 replay: acting lips, equal force") as progress:
        follows = {"reference": passive.resolve(), "reference_scenario": None}
        solution = solve(
            scenario.with_motion(conversion.motion).with_(hand=follows),
            out=acting,
            progress=progress,
        )
    with _stage("4/5 animate: model beside recording") as progress:
        animate(acting, film, beside_video=True, progress=progress)
        animate(acting, sheet, beside_video=True, progress=progress)
    with _stage("5/5 report: a page that moves") as progress:
        write_report([acting, passive], page, progress=progress)
        plot_histories([passive, acting], histories)
        plot_imprint(acting, imprint)
    print(f"\n{closing_message(solution)}\n\nLook at")
    for path, what in (
        (film, "the sip with acting lips: recording and model side by side"),
        (sheet, "the same as six frames"),
        (histories, "strain, stress and pressure over the sip, passive and acting"),
        (imprint, "where and when the neck is pressed"),
        (out / "conversion" / "overlay.mp4", "the recording with its tracked markers"),
        (acting / "history.csv", "the numbers"),
    ):
        print(f"  {path!s:<32}  {what}")
    print(f"\nOpen in a browser and drag the slider: {page.resolve()}")
    stopped = f"{out / 'replay'} stopped at {solution.time_s[-1]:.2f} s: run.log there says why"
    return 0 if solution.finished else complain(stopped, NOT_FINISHED)


@contextmanager
def _stage(title: str) -> Iterator[Progress]:
    """Print one line, also in a pipe: what is being done and how long it took."""
    started = time.monotonic()
    with progress_line(title) as progress:
        yield progress
    print(f"{title:<40} {time.monotonic() - started:6.1f} s", flush=True)
