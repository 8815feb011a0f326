"""``drinksim convert``: a video into motions of head and package."""

from __future__ import annotations

import dataclasses
from argparse import Namespace
from pathlib import Path
from textwrap import indent

from geometry2d.foundation.progress import progress_line
from mocap.convert import ConvertOptions
from mocap.tracking.marker_file import EXAMPLE
from scenarios.cli.options import add_out
from scenarios.cli.parser import Parser, warn
from scenarios.settings.scenario import Recording
from scenarios.settings.writing import about


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.epilog = f"{parser.epilog}\n\na marker file:\n\n{indent(EXAMPLE, '  ')}"
    parser.add_argument("video", metavar="VIDEO", type=Path, help="the recording, side view")
    parser.add_argument(
        "--markers",
        metavar="FILE",
        type=Path,
        help="marker file (TOML); a film with coded stickers needs none",
    )
    add_out(parser)
    what = {field.name: about(field) for field in dataclasses.fields(ConvertOptions)}
    parser.add_argument("--start", metavar="S", type=float, help=what["start_s"])
    parser.add_argument("--end", metavar="S", type=float, help=what["end_s"])
    parser.add_argument("--tracks", metavar="FILE", type=Path, help=what["tracks"])
    parser.add_argument("--fps", metavar="RATE", type=float, help=what["fps"])


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    from mocap.plausible import doubts
    from mocap.tracking.marker_file import read_markers
    from scenarios.sip.run import convert_recording

    recording = Recording(
        video=str(options.video),
        markers=None if options.markers is None else str(options.markers),
        start_s=options.start,
        end_s=options.end,
    )
    if options.markers is not None:
        for doubt in doubts(read_markers(options.markers)):
            warn(doubt)
    with progress_line("convert") as progress:
        conversion = convert_recording(
            recording, options.out, tracks=options.tracks, fps=options.fps, progress=progress
        )
    for warning in conversion.warnings:
        warn(warning)
    print(f"{conversion.motion.parent}: tracks.csv, motion.csv, boundary_conditions, overlay.mp4")
    for line in conversion.closing:
        print(line)
    return 0
