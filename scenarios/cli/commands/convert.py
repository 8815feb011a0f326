"""``drinksim convert``: a video, or positions in space, into motions of head and package."""

from __future__ import annotations

import dataclasses
from argparse import Namespace
from pathlib import Path
from textwrap import indent

from geometry2d.foundation.progress import progress_line
from mocap.convert import ConvertOptions
from mocap.formats.table_motion import ENDINGS, PositionOptions, convert_positions
from mocap.tracking.marker_file import EXAMPLE
from scenarios.cli.options import add_interval, add_out, add_settings, given_settings, settings_of
from scenarios.cli.parser import Parser, warn
from scenarios.settings.scenario import Recording
from scenarios.settings.tables import SettingError
from scenarios.settings.writing import about


def arguments(parser: Parser) -> None:
    """Add what the command takes."""
    parser.epilog = f"{parser.epilog}\n\na marker file:\n\n{indent(EXAMPLE, '  ')}"
    parser.add_argument(
        "video",
        metavar="VIDEO",
        type=Path,
        help="the recording, side view; or positions in space: .c3d, .trc, .bvh",
    )
    parser.add_argument(
        "--markers",
        metavar="FILE",
        type=Path,
        help="marker file (TOML); a film with coded stickers needs none",
    )
    add_out(parser)
    add_interval(parser)
    what = {field.name: about(field) for field in dataclasses.fields(ConvertOptions)}
    parser.add_argument("--tracks", metavar="FILE", type=Path, help=what["tracks"])
    add_settings(parser, PositionOptions)


def run(options: Namespace) -> int:
    """Do it and return the exit code."""
    if options.video.suffix.lower() in ENDINGS:
        return _run_positions(options)
    given = given_settings(PositionOptions, options)
    if given:
        raise SettingError(f"{given[0]}: is for positions in space ({', '.join(ENDINGS)}) only")
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


def _run_positions(options: Namespace) -> int:
    """Convert positions in space."""
    for name in ("markers", "tracks", "fps"):
        if getattr(options, name) is not None:
            raise SettingError(f"--{name}: is for films; positions in space need --head, --package")
    chosen = settings_of(PositionOptions, options)
    found = convert_positions(
        options.video, chosen, out=options.out, start_s=options.start, end_s=options.end
    )
    for warning in found.warnings:
        warn(warning)
    print(f"{options.out}: motion.csv, motion.png, boundary_conditions")
    return 0
