"""Mistakes on the way from a film to a decision, each with what has to be said.

Written from the documentation alone: studies, optimisations, the tests of tissue, pages, films and
exports, and what a packaging engineer brings along: catalogues, spreadsheets, other units.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from benchmarks.mistake_list import (
    FILM,
    Make,
    Mistake,
    Right,
    convert,
    drawn,
    file,
    marked,
    moved,
)
from geometry2d.neck import A38_NECK

STUDY = """\
base = "A38-F"
[necks]
list = ["A38", "DC"]
[people]
count = 2
[set.numerics]
resolution = "coarse"
"""

OPTIMUM = """\
base = "A38-F"
neck = "A38"
[bounds]
rim_radius_mm = {from = 0.4, to = 0.85}
[search]
trials = 3
[people]
count = 2
[set.numerics]
resolution = "coarse"
"""


def study(old: str = "", new: str = "", *more: str, text: str = STUDY) -> Make:
    """Return a study whose file was edited."""
    return _edited("study", text, old, new, more)


def optimum(old: str = "", new: str = "", *more: str, text: str = OPTIMUM) -> Make:
    """Return an optimisation whose file was edited."""
    return _edited("optimise", text, old, new, more)


def _edited(command: str, text: str, old: str, new: str, more: tuple[str, ...]) -> Make:
    def make(folder: Path) -> list[str]:
        assert old in text
        (folder / "mine.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
        return [command, "mine.toml", "--out", "out", *more]

    return make


def typed(*words: str, **files: str) -> Make:
    """Return what is typed beside files of these names and texts; ``_`` in a name is a dot."""

    def make(folder: Path) -> list[str]:
        for name, text in files.items():
            (folder / name.replace("_", ".")).write_text(text, encoding="utf-8")
        return list(words)

    return make


def _folder_as_marker_file(folder: Path) -> list[str]:
    (folder / "marks").mkdir()
    return ["convert", str(FILM), "--markers", "marks", "--out", "sip"]


def _unfinished(folder: Path) -> list[str]:
    (folder / "run.partial").mkdir()
    (folder / "run.partial" / "p.txt").write_text("mine")
    return moved()(folder)


def _film_of_another_neck(folder: Path) -> list[str]:
    text = 'base = "A38-F"\n[package]\nneck = "DC"\n[recording]\nvideo = "{}"\nmarkers = "{}"\n'
    return file(text.format(FILM, FILM.with_name("markers.toml")))(folder)


STUDIES = (
    Mistake("a neck of the study misspelt", study('"DC"', '"DC26"'), r"DC26.*(A38|DC)"),
    Mistake("one neck twice", study('"DC"', '"A38"'), r"two necks called 'A38'"),
    Mistake("a drawing of the study that is not there", study('"DC"', '"necks/mine.dxf"'),
        r"necks/mine\.dxf"),
    Mistake("a list of necks without quotes", study('["A38", "DC"]', "[A38, DC]"),
        r"mine\.toml.*line 3"),
    Mistake("necks as one text", study('["A38", "DC"]', '"A38, DC"'), r"list"),
    Mistake("a neck whose measurement is misspelt",
        study('"DC"', '{name = "fine", neck = "A38", pitch = 3.2}'), r"pitch.*pitch_mm"),
    Mistake("nobody drinks", study("count = 2", "count = 0"), r"count.*0.*1"),
    Mistake("half a person", study("count = 2", "count = 2.5"), r"count.*2\.5"),
    Mistake("sex in another word", study("count = 2", 'count = 2\nsex = "women"'),
        r"women.*female"),
    Mistake("people in the table of necks", study("[people]\n", ""),
        r"\[necks\] holds one key"),
    Mistake("a varied setting that is none",
        study("[people]", '[vary]\n"friction" = [0.5, 1.0]\n[people]'), r"contact\.friction"),
    Mistake("a range the wrong way round",
        study("[people]", '[vary]\n"contact.friction" = {from = 1.0, to = 0.5}\n[people]'),
        r"friction.*(from|1)"),
    Mistake("a spread without a mean",
        study("[people]", '[vary]\n"contact.friction" = {sd = 0.1}\n[people]'), r"mean"),
    Mistake("a range in a grid of texts",
        study("[people]", '[vary]\n"contact.friction" = "0.5 to 1"\n[people]'),
        r"friction.*0\.5 to 1"),
    Mistake("a varied value beyond its bounds",
        study("[people]", '[vary]\n"contact.friction" = [0.5, 50]\n[people]'), r"friction.*50"),
    Mistake("the hand in another word", study("[people]", '[meeting]\nhand = "forces"\n[people]'),
        r"forces.*force"),
    Mistake("a limit of no time", study("[people]", "[limits]\ntime_s = 0\n[people]"),
        r"time_s.*0"),
    Mistake("no workers", study("", "", "--workers", "0"), r"--workers 0"),
    Mistake("workers and a cluster", study("", "", "--workers", "2", "--scheduler", "tcp://a:1"),
        r"scheduler"),
    Mistake("a scenario given as a study", typed("study", "mine.toml", "--out", "out",
        mine_toml='base = "A38-F"\n[contact]\nfriction = 0.5\n'), r"contact.*(set|table|key)"),
    Mistake("a study given as a scenario", typed("replay", "mine.toml", "--out", "run",
        mine_toml=STUDY), r"necks|people"),
    Mistake("draws of a measured motion that is not there", study(
        "[people]", '[motions]\nlist = ["sips/one.csv"]\n[people]'), r"sips/one\.csv"),
)  # fmt: skip

OPTIMA = (
    Mistake("nothing to optimise", optimum(
        "[bounds]\nrim_radius_mm = {from = 0.4, to = 0.85}\n", ""), r"bounds"),
    Mistake("a dimension misspelt", optimum("rim_radius_mm", "rim_radius"), r"rim_radius_mm"),
    Mistake("bounds the wrong way round", optimum("from = 0.4, to = 0.85", "from = 0.85, to = 0.4"),
        r"rim_radius_mm.*0\.85"),
    Mistake("a radius larger than the wall", optimum("to = 0.85", "to = 8.5"), r"rim_radius_mm"),
    Mistake("a measure that is none", optimum(
        "[search]", '[objectives]\nlist = ["pressure"]\n[search]'), r"pressure"),
    Mistake("a closure that is not known", optimum(
        "[search]", '[constraints]\nclosure = "SP38-400"\n[search]'), r"SP38-400.*SP 38-400"),
    Mistake("a seal without a liquid", optimum(
        "[search]", "[constraints]\nleast_seal_kpa = 1\n[search]"), r"least_seal_kpa.*liquid"),
    Mistake("no trials", optimum("trials = 3", "trials = 0"), r"trials.*0"),
)  # fmt: skip

TISSUE = (
    Mistake("a suction curve with semicolons and commas", typed(
        "calibrate", "L1", "--target", "curve.csv", "--out", "fit",
        curve_csv="pressure_kpa;apex_mm\n1,46;0,306\n2,92;0,2\nfast;0,9\n"), r"curve\.csv.*fast"),
    Mistake("one point of a suction curve", typed(
        "calibrate", "L1", "--target", "curve.csv", "--out", "fit",
        curve_csv="pressure_kpa,apex_mm\n1.46,0.306\n"), r"curve\.csv"),
    Mistake("a configuration misspelt", typed("aspirate", "L2-Ogdn", "--out", "suction"),
        r"L2-Ogdn.*L2-Ogden"),
    Mistake("a modulus in kPa", typed(
        "aspirate", "skin.toml", "--out", "suction",
        skin_toml='[bulk]\nlaw = "neo-hookean"\nC10_kpa = 4\npoisson = 0.49\n'),
        r"C10_kpa.*C10_mpa"),
    Mistake("an incompressible tissue", typed(
        "aspirate", "skin.toml", "--out", "suction",
        skin_toml='[bulk]\nlaw = "neo-hookean"\nC10_mpa = 0.004\npoisson = 0.5\n'),
        r"poisson.*0\.5"),
    Mistake("a law misspelt", typed(
        "aspirate", "skin.toml", "--out", "suction",
        skin_toml='[bulk]\nlaw = "neohookean"\nC10_mpa = 0.004\npoisson = 0.49\n'),
        r"neohookean.*neo-hookean"),
    Mistake("a dermis in cm", typed("aspirate", "L2-Ogden", "--dermis-mm", "-0.12",
        "--out", "suction"), r"dermis.*-0\.12"),
    Mistake("a force of nothing", typed("press", "L2-Ogden", "--force", "0", "--out", "press"),
        r"force.*0"),
    Mistake("a force with its unit", typed("press", "L2-Ogden", "--force", "0.3N",
        "--out", "press"), r"force.*0\.3N"),
    Mistake("a drawing pressed into a lip", typed("press", "L2-Ogden", "--neck", "mine.dxf",
        "--out", "press"), r"mine\.dxf.*A38"),
)  # fmt: skip

WAYS = (
    Mistake("a preview of the wrong kind", typed("preview", "A38-F", "--out", "look.docx"),
        r"look\.docx.*png"),
    Mistake("a sheet of the wrong kind", typed("stickers", "--out", "sheet.docx"),
        r"sheet\.docx.*pdf"),
    Mistake("a film of a run that is not there", typed("animate", "runs/a38", "--out", "sip.mp4"),
        r"runs/a38.*replay"),
    Mistake("a film of the wrong kind", typed("animate", ".", "--out", "sip.avi"),
        r"sip\.avi.*mp4"),
    Mistake("an instant in seconds", typed("animate", ".", "--out", "a.png", "--at", "3.2"),
        r"--at.*3\.2"),
    Mistake("an export to Ansys", typed("export", ".", "--format", "ansys", "--out", "x"),
        r"ansys.*vtk"),
    Mistake("a folder as marker file", _folder_as_marker_file, r"marks"),
    Mistake("somebody's folder with the name of a draft", _unfinished, r"run\.partial"),
    Mistake("doubt about nothing", typed("replay", "A38-F", "--out", "run", "--doubt", "0"),
        r"--doubt.*0"),
    Mistake("resume and overwrite", typed("replay", "A38-F", "--out", "run", "--resume",
        "--overwrite"), r"overwrite.*resume|resume.*overwrite"),
    Mistake("a motion that is not there", typed("replay", "A38-F", "--motion", "sip/motion.csv",
        "--out", "run"), r"sip/motion\.csv"),
    Mistake("tracks given as a motion", typed("replay", "A38-F", "--motion", "tracks.csv",
        "--out", "run", tracks_csv="frame,time_s,marker,x_px,y_px,sigma_px,status\n"
        "0,0.0,ear,1,2,0.1,seen\n"), r"tracks\.csv.*rel_x_mm|tracks\.csv.*column"),
    Mistake("another neck beside the film", _film_of_another_neck, r"23\.0 mm wide.*\[filmed\]"),
    Mistake("a neck in the nose", moved(
        lambda rows: None, "placement.shift_y_mm=14", "placement.shift_x_mm=6"), r"into the nose"),
    Mistake("a plain tube drawn the other way round", drawn(
        neck=replace(A38_NECK, crests=0), mirrored=True), r"rounder end.*mirror", Right.FLAGGED),
    Mistake("a drawing and a neck of the library", drawn(more=("package.neck=DC",)),
        r"package\.(neck|outline).*package\.(outline|neck)"),
    Mistake("package in inch in the marker file", marked(package="0.55"), r"package = 0\.55.*mm"),
    Mistake("a marker file of a scenario", convert(markers='base = "A38-F"\n'), r"scale|base"),
)  # fmt: skip

DECISIONS = (*STUDIES, *OPTIMA, *TISSUE, *WAYS)
