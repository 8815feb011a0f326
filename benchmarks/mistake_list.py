"""Mistakes of somebody who has read the documentation in a hurry, each with what has to be said.

Written from the documentation's side: what a film, a marker file, a table of a motion, a drawing
and a scenario can get wrong when they come from other programs, rulers and habits.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from pathlib import Path

from geometry2d.neck import A38_NECK, NeckMeasurements
from scenarios.settings.files import LIBRARY
from tests.support.drawings import neck_drawing

FILM = LIBRARY / "A38-F" / "recording.mp4"
MARKERS = (LIBRARY / "A38-F" / "markers.toml").read_text(encoding="utf-8")

Make = Callable[[Path], list[str]]


class Right(Enum):
    """What has to become of a mistake: ``refused`` with exit code 2, or ``flagged``."""

    REFUSED = "refused"
    FLAGGED = "flagged"


@dataclass(frozen=True)
class Mistake:
    """One mistake: a function that makes its files and returns what is typed, and what is right."""

    name: str
    make: Make
    says: str
    right: Right = Right.REFUSED


def convert(film: str | Path = FILM, markers: str = MARKERS, *more: str) -> Make:
    """Return the conversion of a film with a marker file of this text."""

    def make(folder: Path) -> list[str]:
        (folder / "marks.toml").write_text(markers, encoding="utf-8")
        return ["convert", str(film), "--markers", "marks.toml", "--out", "sip", *more]

    return make


def marked(**changed: str) -> Make:
    """Return the conversion with other values of keys in the marker file; "" leaves one out."""
    text = MARKERS
    for key, value in changed.items():
        line = re.compile(rf"^{key} = [^#\n]*", re.MULTILINE)
        assert line.search(text), key
        text = line.sub(f"{key} = {value} " if value else "", text)
    return convert(markers=text)


def settings(*pairs: str, command: str = "replay") -> Make:
    """Return a replay of A38-F's film with settings."""
    words = [word for pair in pairs for word in ("--set", pair)]
    return lambda folder: [command, "A38-F", *words, *_out(command)]


def file(text: str, *more: str) -> Make:
    """Return the replay of a scenario file of this text."""

    def make(folder: Path) -> list[str]:
        (folder / "mine.toml").write_text(text, encoding="utf-8")
        return ["replay", "mine.toml", "--out", "run", *more]

    return make


def moved(change: Callable[[list[list[str]]], object] = lambda rows: None, *pairs: str) -> Make:
    """Return the replay of a motion whose table, a list of rows with its header, was changed."""

    def make(folder: Path) -> list[str]:
        rows = [list(row) for row in _table()]
        change(rows)
        return _replayed(folder, ",", rows, *pairs)

    return make


def separated(separator: str) -> Make:
    """Return the replay of a motion with decimal commas between such separators."""

    def make(folder: Path) -> list[str]:
        rows = [[cell.replace(".", ",") for cell in row] for row in _table()]
        return _replayed(folder, separator, rows)

    return make


def column(name: str, change: Callable[[float], object]) -> Callable[[list[list[str]]], object]:
    """Return a change of all the numbers of a column."""

    def changed(rows: list[list[str]]) -> None:
        at = rows[0].index(name)
        for row in rows[1:]:
            row[at] = str(change(float(row[at])))

    return changed


def columns(*changes: Callable[[list[list[str]]], object]) -> Callable[[list[list[str]]], object]:
    """Return several changes, one after another."""

    def changed(rows: list[list[str]]) -> None:
        for change in changes:
            change(rows)

    return changed


def drawn(
    *,
    neck: NeckMeasurements = A38_NECK,
    unit: str = "mm",
    scale: float = 1.0,
    mirrored: bool = False,
    marks_mm: float | None = None,
    edit: Callable[[str], str] = lambda text: text,
    name: str = "neck.svg",
    more: tuple[str, ...] = (),
) -> Make:
    """Return the replay of A38-F's motion with a drawn neck.

    Parameters
    ----------
    neck
        What is drawn.
    unit, scale
        Unit that the sheet states, and factor of its numbers.
    mirrored
        Turn the rim to the package.
    marks_mm
        Another distance of the marks.
    edit
        Change of the drawing's text.
    name, more
        Name of the file, and further settings.
    """

    def make(folder: Path) -> list[str]:
        text = edit(
            neck_drawing(neck, unit=unit, scale=scale, mirrored=mirrored, marks_mm=marks_mm)
        )
        (folder / name).write_text(text, encoding="utf-8")
        return _replayed(folder, ",", _table(), f"package.outline={name}", *more)

    return make


def _out(command: str) -> list[str]:
    return ["--out", "look.png"] if command == "preview" else ["--out", "run"]


def _replayed(folder: Path, separator: str, rows: list[list[str]], *pairs: str) -> list[str]:
    text = "\n".join(separator.join(row) for row in rows) + "\n"
    head = "# head_axis_deg = -8.3691\n# package_axis_deg = 38.0435\n"
    (folder / "motion.csv").write_text(head + text, encoding="utf-8")
    words = [word for pair in pairs for word in ("--set", pair)]
    return ["replay", "A38-F", "--motion", "motion.csv", *words, "--out", "run"]


@cache
def _table() -> list[list[str]]:
    """Return the motion behind A38-F's recording: time and the relative motion, with a header."""
    text = (LIBRARY / "A38-F" / "truth_motion.csv").read_text(encoding="utf-8")
    names = ("time_s", "rel_x_mm", "rel_y_mm", "rel_theta_deg")
    rows = csv.DictReader(io.StringIO(text))
    return [list(names), *([row[name] for name in names] for row in rows)]


def _other_file(name: str, content: bytes, arguments: list[str]) -> Make:
    def make(folder: Path) -> list[str]:
        (folder / name).write_bytes(content)
        return arguments

    return make


def _own_files_in_the_way(folder: Path) -> list[str]:
    (folder / "run").mkdir()
    (folder / "run" / "thesis.docx").write_bytes(b"all of it")
    return moved()(folder)


def _renamed(rows: list[list[str]]) -> None:
    rows[0] = ["t", "x", "y", "theta"]


def _headless(rows: list[list[str]]) -> None:
    del rows[0]


def _backwards(rows: list[list[str]]) -> None:
    rows[1:] = rows[:0:-1]


def _holed(rows: list[list[str]]) -> None:
    del rows[60:100]


def _only_approach(rows: list[list[str]]) -> None:
    del rows[75:]


def _with_a_gap_of_text(rows: list[list[str]]) -> None:
    rows[40][1] = "n/a"


IN_CM, IN_INCH = 0.1, 1 / 25.4

FILMS = (
    Mistake("film misspelt", convert("sipp.mp4"), r"sipp\.mp4.*(check|no )"),
    Mistake("film and marker file exchanged", _other_file(
        "marks.toml", MARKERS.encode(),
        ["convert", "marks.toml", "--markers", str(FILM), "--out", "sip"]),
        r"recording\.mp4|marks"),
    Mistake("a picture instead of a film", _other_file(
        "sip.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF\0" + bytes(200),
        ["convert", "sip.jpg", "--markers", "sip.jpg", "--out", "sip"]), r"sip\.jpg"),
    Mistake("neck marks exchanged", marked(
        package_lower="[840.0, 522.0]", package_upper="[808.0, 547.0]"),
        r"exchange.*package_lower.*package_upper", Right.FLAGGED),
    Mistake("ear and nose exchanged", marked(ear="[613.0, 247.0]", nose="[298.0, 201.0]"),
        r"exchange.*ear and nose", Right.FLAGGED),
    Mistake("scale of the package in cm", marked(package="1.4"), r"package = 1\.4.*mm"),
    Mistake("scale of the head in cm", marked(head="10.43"), r"head = 10\.43.*mm"),
    Mistake("diameter given as the marks' distance", marked(package="38"),
        r"package = 38.*(times|nearer|farther|away)", Right.FLAGGED),
    Mistake("head measured to the tip of the nose and back", marked(head="190"),
        r"head = 190.*(times|nearer|farther|away)", Right.FLAGGED),
    Mistake("decimal comma in the marker file", marked(package="14,0"), r"marks\.toml.*line"),
    Mistake("marker misspelt", convert(markers=MARKERS.replace("package_lower =", "package_low =")),
        r"package_low.*did you mean 'package_lower'"),
    Mistake("marker off the picture", marked(nose="[1613.0, 247.0]"), r"nose.*1613"),
    Mistake("x and y exchanged", marked(ear="[201.0, 298.0]"), r"ear.*201"),
    Mistake("two markers at one place", marked(nose="[298.0, 201.0]"), r"ear and nose coincide"),
    Mistake("positions as shares of the picture", marked(
        ear="[0.23, 0.28]", nose="[0.48, 0.34]", package_lower="[0.63, 0.76]",
        package_upper="[0.66, 0.73]"), r"coincide|share"),
    Mistake("focal length in mm", marked(fx="35", fy="35"), r"fx = 35.*px"),
    Mistake("start after the end of the film", convert(FILM, MARKERS, "--start", "60"),
        r"60.*5\.9"),
    Mistake("start after end", convert(FILM, MARKERS, "--start", "4", "--end", "2"),
        r"start.*4.*2"),
    Mistake("a rate of 0", convert(FILM, MARKERS, "--fps", "0"), r"fps.*0"),
    Mistake("tracks of another table", _other_file(
        "tracks.csv", b"a,b\n1,2\n", ["convert", str(FILM), "--markers",
        str(LIBRARY / "A38-F" / "markers.toml"), "--tracks", "tracks.csv", "--out", "sip"]),
        r"tracks\.csv"),
)  # fmt: skip

MOTIONS = (
    Mistake("times in ms", moved(column("time_s", lambda t: 1000 * t)), r"milliseconds|ms"),
    Mistake("times as frames", moved(column("time_s", lambda t: round(25 * t))), r"frame numbers"),
    Mistake("angle in radians", moved(column("rel_theta_deg", math.radians)), r"radians"),
    Mistake("lengths in m", moved(columns(
        column("rel_x_mm", lambda x: x / 1000), column("rel_y_mm", lambda y: y / 1000))),
        r"rel_x_mm.*\bm\b"),
    Mistake("lengths in cm", moved(columns(
        column("rel_x_mm", lambda x: x / 10), column("rel_y_mm", lambda y: y / 10))),
        r"rel_x_mm.*\bcm\b"),
    Mistake("lengths in px", moved(columns(
        column("rel_x_mm", lambda x: 2.93 * x), column("rel_y_mm", lambda y: 2.93 * y))),
        r"(never|stays|nearest).*mm"),
    Mistake("y down", moved(column("rel_y_mm", lambda y: -y)), r"(never|stays|nearest|goes).*mm"),
    Mistake("angle clockwise", moved(column("rel_theta_deg", lambda a: -a)),
        r"the neck, .* goes .* into the"),
    Mistake("a neck that stays away", moved(column("rel_x_mm", lambda x: x + 200)),
        r"(never|stays|nearest).*mm"),
    Mistake("rows missing in the middle", moved(_holed), r"hole|missing", Right.FLAGGED),
    Mistake("only the approach", moved(_only_approach), r"cut short|last instant", Right.FLAGGED),
    Mistake("time backwards", moved(_backwards), r"motion\.csv.*time"),
    Mistake("columns renamed", moved(_renamed), r"motion\.csv.*time_s"),
    Mistake("no header", moved(_headless), r"motion\.csv.*(column|header)"),
    Mistake("a text among numbers", moved(_with_a_gap_of_text), r"motion\.csv.*n/a"),
    Mistake("decimal commas between commas", separated(","), r"motion\.csv.*(comma|cells|column)"),
    Mistake("a motion that does not move", moved(columns(
        column("rel_x_mm", lambda x: 120), column("rel_y_mm", lambda y: -60))), r"travels 0"),
    Mistake("a conversion's folder as motion", lambda folder: [
        "replay", "A38-F", "--motion", ".", "--out", "run"], r"motion\.file"),
)  # fmt: skip

NECKS = (
    Mistake("a drawing in cm that says mm", drawn(scale=IN_CM), r"3\.7.*cm"),
    Mistake("a drawing in inch that says mm", drawn(scale=IN_INCH), r"1\.4.*inch|apart"),
    Mistake("a drawing in mm that says inch", drawn(unit="in"), r"neck.*mm"),
    Mistake("rim at the wrong end", drawn(mirrored=True), r"rim is at the wrong end"),
    Mistake("marks 20 mm apart", drawn(marks_mm=20.0), r"20\.0 mm apart.*14"),
    Mistake("a drawing without a unit", drawn(
        edit=lambda text: text.replace('width="200mm"', 'width="200"').replace(
            'height="200mm"', 'height="200"')), r"neck\.svg.*unit|size"),
    Mistake("an open wall", drawn(edit=lambda text: text.replace(" Z", "", 1)),
        r"upper_wall.*open"),
    Mistake("a wall not named", drawn(edit=lambda text: text.replace('id="lower_wall"', "")),
        r"lower_wall"),
    Mistake("names of the walls exchanged", drawn(edit=lambda text: text.replace(
        "upper_wall", "x").replace("lower_wall", "upper_wall").replace('"x"', '"lower_wall"')),
        r"exchange"),
    Mistake("a PDF", drawn(name="neck.pdf"), r"neck\.pdf.*svg"),
    Mistake("a STEP file", drawn(name="neck.stp"), r"neck\.stp.*svg"),
    Mistake("a measurement beside a drawing", drawn(more=("package.thread_diameter_mm=36",)),
        r"thread_diameter_mm"),
    Mistake("a drawn neck of half the size", drawn(neck=replace(
        A38_NECK, thread_diameter_mm=18.0, root_diameter_mm=16.5)), r"18\.0 mm", Right.FLAGGED),
    Mistake("radii instead of diameters", settings(
        "package.thread_diameter_mm=18.6", "package.root_diameter_mm=17.4"), r"18\.6",
        Right.FLAGGED),
    Mistake("a wall of 18 mm", settings("package.wall_thickness_mm=18"), r"wall_thickness_mm"),
    Mistake("half a crest", settings("package.crests=1.5"), r"crests.*1\.5"),
    Mistake("neck misspelt", settings("package.neck=A83"), r"A83.*A38"),
    Mistake("thread as high as its root", settings("package.thread_diameter_mm=34.8"),
        r"thread_diameter_mm.*34\.8"),
    Mistake("marks measured anew", settings("package.mark_distance_mm=20"), r"20.*14",
        Right.FLAGGED),
)  # fmt: skip

SCENARIOS = (
    Mistake("scenario misspelt", lambda folder: ["replay", "A38F", "--out", "run"], r"A38F.*A38-F"),
    Mistake("key without its table", settings("friction=0.5"), r"contact\.friction"),
    Mistake("friction in percent", settings("contact.friction=50"), r"contact\.friction.*50.*3"),
    Mistake("decimal comma in a setting", settings("contact.friction=0,5"), r"friction.*0,5"),
    Mistake("a range instead of a value", settings("contact.friction=0.5-1"), r"friction.*0\.5-1"),
    Mistake("thickness of a lip in cm", settings("head.upper_lip_thickness_mm=1.48"),
        r"upper_lip_thickness_mm.*1\.48"),
    Mistake("jaw shut", settings("head.jaw_opening_deg=0"), r"jaw", Right.FLAGGED),
    Mistake("jaw opened in mm", settings("head.jaw_opening_deg=40"), r"jaw_opening_deg.*40"),
    Mistake("skin misspelt", settings("skin.configuration=L2-ogden"), r"L2-ogden.*L2-Ogden"),
    Mistake("resolution misspelt", lambda folder: [
        "replay", "A38-F", "--resolution", "Coarse", "--out", "run"], r"Coarse.*coarse"),
    Mistake("volume in litres", settings("liquid.volume_ml=0.2"), r"volume_ml.*0\.2"),
    Mistake("density in g/cm³", settings("liquid.volume_ml=200", "liquid.density_kg_per_m3=1.0"),
        r"density.*\b1\b"),
    Mistake("width of the lip in cm", settings("hand.mode=same", "hand.width_mm=2.5"),
        r"width_mm.*2\.5"),
    Mistake("a reference that is not there", settings("hand.mode=same", "hand.reference=runs/A38"),
        r"hand\.reference.*runs/A38"),
    Mistake("a place found without anything seen", settings("placement.shift_x_mm=auto"),
        r"first_contact"),
    Mistake("a shift in µm", settings("placement.shift_x_mm=1200"), r"shift_x_mm.*1200"),
    Mistake("an activation in percent", settings("muscles.mentalis=40"), r"mentalis.*40"),
    Mistake("quotes forgotten", file("base = A38-F\n"), r"mine\.toml.*line 1"),
    Mistake("table in the wrong case", file('base = "A38-F"\n[Contact]\nfriction = 0.5\n'),
        r"Contact.*contact"),
    Mistake("nothing to replay", file('name = "mine"\n[package]\nneck = "DC"\n'), r"recording"),
    Mistake("a film that is not beside the file", file(
        'base = "A38-F"\n[recording]\nvideo = "films/sip.mp4"\n'), r"recording\.video.*films/sip"),
    Mistake("own files in the way", _own_files_in_the_way, r"run.*(not results|another)"),
    Mistake("a page about a folder that is no run", lambda folder: [
        "report", ".", "--out", "page.html"], r"run directory"),
    Mistake("a page of the wrong kind", lambda folder: [
        "report", ".", "--out", "page.pdf"], r"page\.pdf.*html"),
    Mistake("a material that is not there", lambda folder: [
        "element", "L2-Ogden/epidermis", "--out", "cube"], r"epidermis"),
    Mistake("a target in MPa", _other_file(
        "curve.csv", b"pressure_mpa,apex_mm\n0.001,0.3\n0.002,0.6\n",
        ["calibrate", "L1", "--target", "curve.csv", "--out", "fit"]), r"curve\.csv.*pressure_kpa"),
)  # fmt: skip

MISTAKES = (*FILMS, *MOTIONS, *NECKS, *SCENARIOS)
