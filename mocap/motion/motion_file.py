"""Reading and writing of ``motion.csv``: a header of ``# key = value`` lines and a table.

The header is optional. Each of its lines is TOML behind ``#``; other comment lines are ignored.
Angles are in degrees and counter-clockwise, lengths in mm, times in s; y points up.

=====================  ============================================================================
key                    value
=====================  ============================================================================
``head_body``          name of the reference body in the marker file
``head_markers``       its markers; the first one is the body's origin
``head_axis_deg``      direction from its first to its last marker in the first frame
``package_body``       name, markers and direction of the moving body, likewise
``package_markers``
``package_axis_deg``
``picture_x_px``       position of the world's origin in the recording's picture, y down
``picture_y_px``
``picture_px_per_mm``  scale of the recording's picture at the package's depth
``picture_mirrored``   whether that picture has left and right exchanged: the person faces left
``rendered``           whether the recording is rendered and not filmed
=====================  ============================================================================

A direction that is not in the header is taken from ``first_frame`` of the ``summary.json`` beside
the file, if there is one.

A spreadsheet may have written the file: cells may be separated by commas, semicolons or tabs, with
decimal commas in the latter two cases (:mod:`geometry2d.foundation.delimited`), and empty cells may
follow a header line.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from geometry2d.foundation.delimited import SEPARATORS, named_table
from geometry2d.foundation.text import bytes_of, number, quoted, text_of
from geometry2d.foundation.toml import parsed_toml
from mocap.motion.errors import MotionError

Array: TypeAlias = NDArray[np.float64]
Value: TypeAlias = bool | float | str | list[str]

TITLE = "# drinksim motion; rel is the package seen from the head"
DECIMALS = 6
AXIS_DECIMALS = 12

RELATIVE = ("rel_x_mm", "rel_y_mm", "rel_theta_deg")
HEAD = ("head_x_mm", "head_y_mm", "head_theta_deg")
PACKAGE = ("package_x_mm", "package_y_mm", "package_theta_deg")
SIGMA = ("sigma_x_mm", "sigma_y_mm", "sigma_theta_deg")
COLUMNS = ("time_s", *HEAD, *PACKAGE, *RELATIVE, *SIGMA)
NEEDED = ("time_s", *RELATIVE)

KEYS: Mapping[str, type] = {
    "head_body": str,
    "head_markers": list,
    "head_axis_deg": float,
    "package_body": str,
    "package_markers": list,
    "package_axis_deg": float,
    "picture_x_px": float,
    "picture_y_px": float,
    "picture_px_per_mm": float,
    "picture_mirrored": bool,
    "rendered": bool,
}
"""The header's keys and the type of their values."""

WANTED = {str: "text in quotes", list: "list of texts", float: "number", bool: "true or false"}

AXES = ("head_axis_deg", "package_axis_deg")
MOST_SUMMARY_BYTES = 10_000_000
LONGEST_HEADER_LINE = 10_000


def motion_text(columns: Mapping[str, Array], header: Mapping[str, Value], *, decimals: int) -> str:
    """Return columns (n,) of numbers under a header, as a file holds them."""
    stream = StringIO(newline="")
    stream.write(TITLE + "\n")
    # JSON writes these values as TOML reads them, except the delete character.
    stream.writelines(
        f"# {key} = {json.dumps(value, ensure_ascii=False)}\n".replace("\x7f", "\\u007f")
        for key, value in header.items()
    )
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    rows = np.column_stack(list(columns.values()))
    writer.writerows([f"{value:.{decimals}f}" for value in row] for row in rows)
    return stream.getvalue()


def read_motion_file(path: Path) -> tuple[dict[str, Array], dict[str, Value]]:
    """Return the columns (n,) that a file holds, by name, and its header.

    Raises
    ------
    MotionError
        If the file is missing, lacks a column of ``NEEDED``, or holds a cell that is no number.
    """
    if not path.exists():
        raise MotionError(f"no motion file {path}: make one with drinksim convert")
    text = text_of(path, what="motion file", error=MotionError)
    # A spreadsheet encloses a line that holds quotation marks in quotation marks.
    lines = [(line, line.lstrip('"').startswith("#")) for line in text.split("\n")]
    rows = "\n".join("" if comment else line for line, comment in lines)
    table = named_table(path, rows, NEEDED, what="motion file", error=MotionError)
    columns = {
        name: table.numbers(name, blank=name not in NEEDED)
        for name in table.header
        if name in COLUMNS
    }
    header = _header([line for line, comment in lines if comment], table.separator, path)
    for axis, value in _axes_of_summary(path.with_name("summary.json")).items():
        header.setdefault(axis, value)
    return columns, header


def _header(lines: list[str], separator: str, path: Path) -> dict[str, Value]:
    header: dict[str, Value] = {}
    for line in lines:
        if len(line) > LONGEST_HEADER_LINE:
            raise MotionError(
                f"{path}: a line of its header has {len(line)} characters: shorten it"
            )
        cells = next(csv.reader([line], delimiter=separator)) if line[0] == '"' else [line]
        text = separator.join(cells).rstrip(SEPARATORS + " ")
        key, equals, stated = (part.strip() for part in text.lstrip("# ").partition("="))
        if not equals or key not in KEYS:
            continue
        value = _value(stated, KEYS[key], path)
        if value is None:
            raise MotionError(
                f"{path}: {quoted(text)} is no {WANTED[KEYS[key]]}: mend or remove the line"
            )
        header[key] = value
    return header


def _value(text: str, kind: type, path: Path) -> Value | None:
    """Return a value of the header, None if it is not of its kind."""
    if kind is float:
        return number(re.sub(r"^([-+]?[0-9]++),([0-9]++)$", r"\1.\2", text))
    try:
        value = parsed_toml(f"value = {text}", where=str(path), error=MotionError)["value"]
    except MotionError:
        return None
    if isinstance(value, list):
        texts = kind is list and all(isinstance(name, str) for name in value)
        return [str(name) for name in value] if texts else None
    return value if isinstance(value, (str, bool)) and isinstance(value, kind) else None


def _axes_of_summary(summary: Path) -> dict[str, float]:
    """Return the directions in the first frame that a summary of a conversion states."""
    try:
        data = bytes_of(summary, what="summary", error=MotionError, most_bytes=MOST_SUMMARY_BYTES)
        stated = json.loads(data)["first_frame"]
        return {name: float(stated[name]) for name in AXES if stated.get(name) is not None}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError):
        return {}
