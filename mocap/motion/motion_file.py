"""The text of ``motion.csv``: a header of ``# key = value`` lines and a table of numbers.

The header is optional. Each of its lines is TOML behind ``# ``; other comment lines are ignored.
Angles are in degrees, lengths in mm, times in s, y points up, and angles are counter-clockwise.

=====================  ============================================================================
key                    value
=====================  ============================================================================
``head_body``          name of the reference body in the marker file
``head_markers``       its markers; the first one is the body's origin
``head_axis_deg``      direction from its first to its last marker in the first frame
``package_body``       name, markers and direction of the moving body, likewise
``package_markers``
``package_axis_deg``
``picture_x_px``       place of the world's origin in the recording's picture, y down
``picture_y_px``
``picture_px_per_mm``  scale of the recording's picture at the package's depth
``rendered``           whether the recording is rendered and not filmed
=====================  ============================================================================

A file without a direction in its header takes it from ``first_frame`` of the ``summary.json`` that
lies beside it, if there is one.
"""

from __future__ import annotations

import csv
import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

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
    "rendered": bool,
}
"""The header's keys and the type of their values."""

WANTED = {str: "text in quotes", list: "list of texts", float: "number", bool: "true or false"}

AXES = ("head_axis_deg", "package_axis_deg")


def write_motion_file(
    path: Path, columns: Mapping[str, Array], header: Mapping[str, Value], *, decimals: int
) -> None:
    """Write columns (n,) of numbers under a header."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        stream.write(TITLE + "\n")
        # JSON writes these values as TOML reads them.
        stream.writelines(
            f"# {key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in header.items()
        )
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        rows = np.column_stack(list(columns.values()))
        writer.writerows([f"{value:.{decimals}f}" for value in row] for row in rows)


def read_motion_file(path: Path) -> tuple[dict[str, Array], dict[str, Value]]:
    """Return the columns (n,) that a file holds, by name, and its header.

    Raises
    ------
    MotionError
        If the file is missing, lacks a column of ``NEEDED``, or holds what is no number.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise MotionError(f"no motion file {path}: make one with drinksim convert") from None
    except (OSError, UnicodeDecodeError) as error:
        raise MotionError(f"{path} cannot be read as text ({error}): check the path") from None
    header = _header([line for line in lines if line.startswith("#")], path)
    for axis, value in _axes_of_summary(path.with_name("summary.json")).items():
        header.setdefault(axis, value)
    return _columns([line for line in lines if line.strip() and line[0] != "#"], path), header


def _header(lines: list[str], path: Path) -> dict[str, Value]:
    header: dict[str, Value] = {}
    for line in lines:
        found = re.fullmatch(r"#\s*(\w+)\s*=\s*(.*)", line.rstrip())
        if found is None or found[1] not in KEYS:
            continue
        key = found[1]
        value = _value(found[2], KEYS[key])
        if value is None:
            raise MotionError(f"{path}: {line!r} is no {WANTED[KEYS[key]]}: mend or remove it")
        header[key] = value
    return header


def _value(text: str, kind: type) -> Value | None:
    """Return a value of the header, None if it is not of its kind."""
    value: Value
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return None
    if isinstance(value, list):
        return value if kind is list and all(isinstance(name, str) for name in value) else None
    if kind is float and type(value) in (int, float):
        return float(value) if np.isfinite(value) else None
    return value if type(value) is kind else None


def _axes_of_summary(summary: Path) -> dict[str, float]:
    """Return the directions in the first frame that a summary of a conversion states."""
    try:
        stated = json.loads(summary.read_text(encoding="utf-8"))["first_frame"]
        return {name: float(stated[name]) for name in AXES if stated.get(name) is not None}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def _columns(lines: list[str], path: Path) -> dict[str, Array]:
    rows = list(csv.reader(lines))
    names = rows[0] if rows else []
    for name in NEEDED:
        if name not in names:
            raise MotionError(
                f"{path} is not a motion file: column {name} is missing "
                f"(needed are {', '.join(NEEDED)})"
            )
    for number, row in enumerate(rows[1:], start=1):
        if len(row) != len(names):
            raise MotionError(
                f"{path}: row {number} has {len(row)} values for {len(names)} columns: mend it"
            )
    return {
        name: np.array([_number(row[k], name, number, path) for number, row in enumerate(rows[1:])])
        for k, name in enumerate(names)
        if name in COLUMNS
    }


def _number(text: str, name: str, row: int, path: Path) -> float:
    try:
        return float(text)
    except ValueError:
        raise MotionError(
            f"{path}: {name} = {text!r} in row {row + 1} is not a number: mend it"
        ) from None
