"""Sound files of every format that is read, written by the project, and who reads them.

`benchmarks/mutants.py` damages them. Nothing here was recorded by others.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import ezdxf
import numpy as np

from fem2d.materials.library import LIBRARY as MATERIALS
from fem2d.materials.library import configuration_cards, material_card
from geometry2d.anatomy.head import head_section
from geometry2d.drawings.drawn_head import HeadDrawing, drawn_head
from geometry2d.drawings.drawn_neck import drawn_neck
from geometry2d.drawings.stl import CutPlane, cut, read_stl
from geometry2d.neck import A38_NECK, neck_section
from mocap.convert import given_tracks
from mocap.formats.c3d import write_c3d
from mocap.formats.exchange import read_positions
from mocap.formats.marker_table import MarkerTable
from mocap.formats.trc import write_trc
from mocap.motion.jaw import JawOpening
from mocap.motion.motion import Motion
from mocap.tracking.marker_file import EXAMPLE, read_markers
from mocap.tracking.tracks import Tracks
from mocap.video.frames import Video
from scenarios.recordings.script import LIBRARY, read_script
from scenarios.settings.person import JAW_INTERVAL_S
from scenarios.settings.scenario import load_scenario, resolved_toml
from scenarios.studies.fit import Target
from tests.support.foreign_files import KVA, deeplabcut_h5, sleap_h5
from tests.support.made_up_motion import made_up_motion

NAMES = ("ear", "nose", "package_lower", "package_upper")
FRAMES = 24


@dataclass(frozen=True)
class Parser:
    """Who reads a format, and a function that writes sound files of it into a folder."""

    read: Callable[[Path], object]
    seeds: Callable[[Path], Sequence[Path]]


def written(folder: Path, contents: dict[str, str | bytes]) -> list[Path]:
    """Write files by name and return their places."""
    for name, content in contents.items():
        data = content.encode() if isinstance(content, str) else content
        (folder / name).write_bytes(data)
    return [folder / name for name in contents]


def positions(unit: str = "mm") -> MarkerTable:
    """Return markers that move on circles, one of them missing for a while."""
    time = np.arange(FRAMES) / 50
    at = np.arange(1, len(NAMES) + 1)
    turn = time[:, None] * at
    places = np.stack([100 * at + np.cos(turn), 80 * at + np.sin(turn), 0 * turn], axis=-1)
    places[5:9, 1] = np.nan
    return MarkerTable(time, NAMES, places, unit)


def scenarios(folder: Path) -> list[Path]:
    by_hand = """\
name = "by hand"
description = 'a "made-up" one'
[motion]
file = "motion.csv"
[head]
nasolabial_angle_deg = 104.5
[package]
neck = "A38"
crests = 2
[skin]
configuration = "L1"
[contact]
friction = 0.5
[placement]
shift_x_mm = "auto"
[first_contact]
lower_time_s = 0.5
[muscle]
tense_from_s = [0.1, 0.9]
tense_to_s = [0.2, 1.0]
relax_from_s = [0.5, 1.5]
relax_to_s = [0.6, 1.6]
[solver]
resolution = "coarse"
"""
    return written(
        folder, {"library.toml": resolved_toml(load_scenario("A38-F")), "hand.toml": by_hand}
    )


def markers(folder: Path) -> list[Path]:
    optional = re.compile(r"^# (?=\[|\w+ = )", re.MULTILINE)
    everything = optional.sub("", EXAMPLE).replace("\nmoving", "\n# moving")
    everything = everything.replace("\nreference", "\n# reference")
    return written(folder, {"example.toml": EXAMPLE, "everything.toml": everything})


def tracks(folder: Path) -> list[Path]:
    table = positions("px")
    missing = np.isnan(table.positions[..., 0])
    Tracks(
        np.arange(FRAMES),
        table.time_s,
        NAMES,
        table.positions[..., :2],
        np.where(missing, np.nan, 0.1),
        np.where(missing, "lost", "seen").astype("<U9"),
    ).write(folder / "tracks.csv")
    return [folder / "tracks.csv"]


def motions(folder: Path) -> list[Path]:
    whole = made_up_motion(np.arange(FRAMES) / 25)
    whole.write(folder / "motion.csv")
    rows = [line for line in (folder / "motion.csv").read_text().splitlines() if line[0] != "#"]
    elsewhere = "\n".join(rows).replace(",", ";").replace(".", ",")
    axes = "# head_axis_deg = 8.5;;\n# package_axis_deg = 121,5;;\n"
    sheet = f"\ufeffsep=;\n{axes}{elsewhere}\n"
    return [folder / "motion.csv", *written(folder, {"spreadsheet.csv": sheet})]


def jaws(folder: Path) -> list[Path]:
    opening = np.radians(np.linspace(0.0, 5.0, FRAMES))
    times = np.arange(FRAMES) / 25
    JawOpening(np.arange(FRAMES), times, opening, 0.1 * opening).write(folder / "jaw.csv")
    return [folder / "jaw.csv"]


def trc(folder: Path) -> list[Path]:
    write_trc(positions(), folder / "tabs.trc")
    commas = (folder / "tabs.trc").read_text().replace("\t", ",")
    return [folder / "tabs.trc", *written(folder, {"commas.trc": commas})]


def c3d(folder: Path) -> list[Path]:
    write_c3d(positions(), folder / "real.c3d")
    return [folder / "real.c3d"]


def bvh(folder: Path) -> list[Path]:
    skeleton = """HIERARCHY
ROOT hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT head
  {
    OFFSET 0 50.5 1
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 12 0
    }
  }
}
MOTION
"""
    rows = "".join(" ".join(f"{np.sin(k + c):.4f}" for c in range(9)) + "\n" for k in range(FRAMES))
    text = f"{skeleton}Frames: {FRAMES}\nFrame Time: 0.0333333\n{rows}"
    return written(folder, {"skeleton.bvh": text})


def kinovea(folder: Path) -> list[Path]:
    table = positions("px")
    heads = [f'"{name}/{axis} (px)"' for name in NAMES for axis in "XY"]
    lines, trajectories = [",".join(['"Time (ms)"', *heads])], ["#Kinovea Trajectory data export"]
    for time, row in zip(table.time_s, table.positions, strict=True):
        cells = ["" if np.isnan(v) else f"{v:.2f}" for v in row[:, :2].ravel()]
        lines.append(",".join([f"{1e3 * time:.0f}", *cells]))
    semicolons = "\n".join(lines).replace(",", ";").replace(".", ",") + "\n"
    for k, name in enumerate(NAMES):
        trajectories += ["#T X Y", "", f"# {name}"]
        for time, row in zip(table.time_s, table.positions[:, k], strict=True):
            if np.isfinite(row).all():
                trajectories.append(f"{1e3 * time:.0f} {row[0]:.2f} {row[1]:.2f}")
    return written(
        folder,
        {
            "commas.csv": "\n".join(lines) + "\n",
            "semicolons.csv": semicolons,
            "trajectories.txt": "\n".join(trajectories) + "\n",
        },
    )


def tracker(folder: Path) -> list[Path]:
    table = positions("")
    lines = ["\t".join(["", *(cell for name in NAMES for cell in (name, ""))])]
    lines.append("\t".join(["t", *("x", "y") * len(NAMES)]))
    for time, row in zip(table.time_s, table.positions, strict=True):
        cells = ["" if np.isnan(v) else f"{v:.6E}" for v in row[:, :2].ravel()]
        lines.append("\t".join([f"{time:.6E}", *cells]))
    text = "\n".join(lines) + "\n"
    return written(folder, {"tabs.txt": text, "commas.txt": text.replace("\t", ",")})


def deeplabcut(folder: Path) -> list[Path]:
    table = positions("px")
    lines = [
        ",".join(["scorer", *["net"] * (3 * len(NAMES))]),
        ",".join(["bodyparts", *(name for name in NAMES for _ in range(3))]),
        ",".join(["coords", *("x", "y", "likelihood") * len(NAMES)]),
    ]
    for k, row in enumerate(table.positions):
        cells = [f"{x:.3f},{y:.3f},0.98" if np.isfinite(x) else ",,0.01" for x, y, _ in row]
        lines.append(f"labeled-data/sip/img{k:04d}.png," + ",".join(cells))
    return written(folder, {"points.csv": "\n".join(lines) + "\n"})


def poses_h5(folder: Path) -> list[Path]:
    return [
        sleap_h5(folder / "one.h5"),
        sleap_h5(folder / "two.h5", tracks=2, later=True),
        deeplabcut_h5(folder / "net.h5"),
        deeplabcut_h5(folder / "animals.h5", animals=("a", "b"), protocol=4),
    ]


def annotations(folder: Path) -> list[Path]:
    return written(folder, {"film.kva": KVA, "other.xml": KVA.replace("512", "1")})


def svg(folder: Path) -> list[Path]:
    neck = neck_section(A38_NECK)
    shapes = []
    for name in ("upper_wall", "lower_wall"):
        points = getattr(neck, name).sampled(0.5) * (1, -1)
        data = "M" + " L".join(f"{x:.4f} {y:.4f}" for x, y in points) + " Z"
        shapes.append(f'<path id="{name}" d="{data}"/>')
    for name in ("upper_mark", "lower_mark"):
        x, y = getattr(neck, name)
        shapes.append(f'<circle id="{name}" cx="{x}" cy="{-y}" r="1"/>')
    others = (
        '<path id="free" d="M0 0C1 2 3 4 5 6S7 8 9 9Q1 2 3 4T5 6A7 8 9 0 1 2 3h4v5H6V7z"/>'
        '<g transform="matrix(1 0 0 1 2 3) skewX(10)"><ellipse cx="1" cy="2" rx="9" ry="4"/>'
        '<polygon points="0,0 1,0 1,1"/><rect x="1" y="2" width="3" height="4"/></g>'
        '<line x1="0" y1="1" x2="2" y2="3" style="stroke: black"/>'
    )
    sheet = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<svg xmlns="http://www.w3.org/2000/svg" '
        'width="200mm" height="200mm" viewBox="-100 -100 200 200">\n{}\n</svg>\n'
    )
    turned = '<g transform="translate(6 9) rotate(-35)">{}</g>'
    return written(
        folder,
        {
            "neck.svg": sheet.format(turned.format("\n".join(shapes)) + others),
            "head.svg": HeadDrawing.of(head_section()).svg(),
        },
    )


def dxf(folder: Path) -> list[Path]:
    neck = neck_section(A38_NECK)
    files = []
    for version, kind in (("R2000", "asc"), ("R2010", "asc"), ("R2018", "bin")):
        document = ezdxf.new(version)
        document.header["$INSUNITS"] = 4
        space = document.modelspace()
        wall, outer = (document.blocks.new(name) for name in ("wall", "outer"))
        for side, place in (("upper", space), ("lower", wall)):
            points = getattr(neck, f"{side}_wall").sampled(0.5)
            place.add_polyline2d(points, close=True, dxfattribs={"layer": f"{side}_wall"})
            centre = getattr(neck, f"{side}_mark")
            space.add_circle(centre, 1, dxfattribs={"layer": f"{side}_mark"})
        outer.add_blockref("wall", (0, 0))
        outer.add_arc((0, 0), 5, 0, 180, dxfattribs={"layer": "other"})
        space.add_blockref("outer", (0, 0))
        grid = {"row_count": 3, "column_count": 2, "row_spacing": 9, "column_spacing": 9}
        document.blocks.new("dot").add_circle((0, 0), 1, dxfattribs={"layer": "dots"})
        space.add_blockref("dot", (50, 50), dxfattribs=grid)
        space.add_spline([(0, 0), (3, 4), (5, 1), (9, 9)], dxfattribs={"layer": "free"})
        space.add_ellipse((0, 0), (8, 0), 0.5, dxfattribs={"layer": "oval"})
        space.add_lwpolyline([(0, 0, 0), (9, 0, 1), (9, 4, 0)], "xyb")
        files.append(folder / f"{version}.dxf")
        document.saveas(files[-1], fmt=kind)
    return files


def triangles() -> np.ndarray:
    """Return a closed surface (m, 3, 3): a ball of triangles, mm."""
    around, rows = 24, 13
    u = 2 * np.pi * np.arange(around)[None, :] / around
    v = np.linspace(-0.5 * np.pi, 0.5 * np.pi, rows)[:, None]
    points = 8 * np.stack(
        [np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v) + 0 * u], axis=-1
    )
    points[0], points[-1] = (0, 0, -8), (0, 0, 8)
    a, b = points[:-1], np.roll(points[:-1], -1, axis=1)
    c, d = np.roll(points[1:], -1, axis=1), points[1:]
    quads = [np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]
    return np.concatenate(quads).reshape(-1, 3, 3).astype(np.float32)


def stl(folder: Path) -> list[Path]:
    surface = triangles()
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in surface)
    lines = ["solid ball"]
    for t in surface:
        lines += ["facet normal 0 0 0", " outer loop"]
        lines += [f"  vertex {x!s} {y!s} {z!s}" for x, y, z in t]
        lines += [" endloop", "endfacet"]
    head = b"made here".ljust(80) + struct.pack("<I", len(surface))
    return written(
        folder, {"binary.stl": head + body, "ascii.stl": "\n".join([*lines, "endsolid ball\n"])}
    )


def materials(folder: Path) -> list[Path]:
    return written(
        folder, {file.name: file.read_bytes() for file in sorted(MATERIALS.glob("*.toml"))}
    )


def targets(folder: Path) -> list[Path]:
    rows = "".join(f"{0.5 * k:.3f},{0.02 * k:.5f}\n" for k in range(30))
    return written(folder, {"target.csv": f"pressure_kpa,apex_mm\n{rows}"})


def scripts(folder: Path) -> list[Path]:
    return written(folder, {"script.toml": (LIBRARY / "A38-F" / "recording.toml").read_bytes()})


FILMS = (
    ("h264.mp4", "libx264", "yuv420p"),
    ("mpeg4.avi", "mpeg4", "yuv420p"),
    ("vp8.mkv", "libvpx", "yuv420p"),
    ("pal.gif", "gif", "rgb8"),
    ("mjpeg.mov", "mjpeg", "yuvj420p"),
    ("mpeg2.ts", "mpeg2video", "yuv420p"),
)


def films(folder: Path) -> list[Path]:
    for name, codec, pixels in FILMS:
        with av.open(str(folder / name), "w") as container:
            stream = container.add_stream(codec, rate=Fraction(25))
            stream.width, stream.height, stream.pix_fmt = 96, 64, pixels
            for k in range(12):
                picture = np.full((64, 96, 3), 200, np.uint8)
                picture[20:30, 4 * k : 4 * k + 10] = (30, 60, 90)
                frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                container.mux(stream.encode(frame.reformat(format=pixels)))
            container.mux(stream.encode())
    return [folder / name for name, _, _ in FILMS]


def _drawing(file: Path) -> object:
    if b"tooth" in file.read_bytes():
        return drawn_head(file, dermis_mm=1.0, tie_fade_mm=2.0)
    return drawn_neck(file)


def _configuration(file: Path) -> object:
    if b"\nlaw" in file.read_bytes().partition(b"[")[0]:
        return material_card(str(file))
    return configuration_cards(str(file))


def _jaw(file: Path) -> object:
    return JawOpening.read(file).means(JAW_INTERVAL_S)


def _film(file: Path) -> int:
    return sum(frame.colour().size for frame in Video(file).frames())


def _cut(file: Path) -> object:
    surface = read_stl(file, unit_mm=1.0)
    return cut(surface, CutPlane((0, 0, 0.3), (1, 0, 0), (0, 1, 0)))


def _scenario(file: Path) -> str:
    return resolved_toml(load_scenario(str(file)))


def _positions(file: Path) -> object:
    return read_positions(file), given_tracks(file)


PARSERS = {
    "scenario": Parser(_scenario, scenarios),
    "markers": Parser(read_markers, markers),
    "tracks": Parser(given_tracks, tracks),
    "motion": Parser(Motion.read, motions),
    "jaw": Parser(_jaw, jaws),
    "trc": Parser(read_positions, trc),
    "c3d": Parser(read_positions, c3d),
    "bvh": Parser(read_positions, bvh),
    "kinovea": Parser(read_positions, kinovea),
    "tracker": Parser(read_positions, tracker),
    "deeplabcut": Parser(_positions, deeplabcut),
    "poses-h5": Parser(read_positions, poses_h5),
    "annotations": Parser(read_positions, annotations),
    "svg": Parser(_drawing, svg),
    "dxf": Parser(drawn_neck, dxf),
    "stl": Parser(_cut, stl),
    "materials": Parser(_configuration, materials),
    "targets": Parser(Target.read, targets),
    "scripts": Parser(read_script, scripts),
    "video": Parser(_film, films),
}
